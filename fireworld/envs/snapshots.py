"""Snapshots of environments as bytes: a head of plain values and arrays, checked when they are read."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from fireworld.errors import LogError, expected
from fireworld.kernels.arrays import Array
from fireworld.npz import read_npz


def pack(form: str, head: Mapping[str, Any], arrays: Mapping[str, Array]) -> bytes:
    """Return a snapshot.

    Args:
        form: what it is of, with the version of the format, as in "fireworld-worlds/1".
        head: plain values.
        arrays: none is named "head".
    """
    data = io.BytesIO()
    named: dict[str, Any] = {"head": np.array(json.dumps({"format": form, **head})), **arrays}
    np.savez(data, **named)
    return data.getvalue()


def unpack(form: str, snapshot: bytes) -> tuple[dict[str, Any], dict[str, Array]]:
    """Return the head and the arrays of a snapshot.

    Raises:
        LogError: it is no snapshot, a damaged one, or one of something else.
    """
    try:
        held = read_npz(io.BytesIO(snapshot))
        head = dict(json.loads(str(held.pop("head"))))
        found = head["format"]
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise LogError(expected("snapshot", "", "the bytes of a snapshot", str(error) or "others")) from None
    if found != form:
        raise LogError(expected("snapshot", "format", form, found))
    return head, held


def fitting(held: Mapping[str, Array], name: str, like: Array) -> Array:
    """Return an array of a snapshot.

    Raises:
        LogError: it is not there, or not of the type and shape of the other one.
    """
    found = held.get(name)
    if found is None or found.dtype != like.dtype or found.shape != like.shape:
        got = "nothing" if found is None else f"{found.dtype} {found.shape}"
        raise LogError(expected("snapshot", name, f"{like.dtype} {like.shape}", got))
    return found


def within(held: Mapping[str, Array], name: str, like: Array, *, least: int, most: int) -> Array:
    """Return an array of a snapshot whose numbers are in bounds.

    Raises:
        LogError: as for `fitting`; or one is out of bounds.
    """
    found = fitting(held, name, like)
    wrong = (found < least) | (found > most)
    if wrong.any():
        raise LogError(expected("snapshot", name, f"numbers from {least} to {most}", int(found[wrong][0])))
    return found
