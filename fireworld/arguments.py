"""Arguments that library functions are given, checked before any work."""

from __future__ import annotations

import operator
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from fireworld.errors import FireworldError, expected

SEED_MAX: Final = 2**32 - 1
"""Of a seed that is asked for."""
RUN_SEED_MAX: Final = 2**63 - 1
"""Of a seed that follows from one: what the kernels count with."""
STEPS_MAX: Final = 100_000


class ArgumentError(FireworldError, ValueError):
    """An argument of a library function that makes no sense."""


def whole_number(name: str, value: object, *, least: int, most: int) -> int:
    """Return a whole number within bounds.

    Raises:
        ArgumentError: it is another kind of value, or out of bounds.
    """
    wanted = f"a whole number from {least} to {most}"
    try:
        number = operator.index(value)  # type: ignore[arg-type]  # whatever was given
    except TypeError:
        raise ArgumentError(expected(name, "", wanted, value)) from None
    if isinstance(value, bool) or not least <= number <= most:
        raise ArgumentError(expected(name, "", wanted, value))
    return number


def seed_of(value: object, *, name: str = "seed") -> int:
    """Return the seed of a run; errors as for `whole_number`."""
    return whole_number(name, value, least=0, most=SEED_MAX)


def last_step_of(value: object) -> int | None:
    """Return the step to stop after, None for the scenario's own; errors as for `whole_number`."""
    return None if value is None else whole_number("steps", value, least=1, most=STEPS_MAX)


def path_of(name: str, value: object) -> Path:
    """Return a path.

    Raises:
        ArgumentError: it is no path.
    """
    if not isinstance(value, str | os.PathLike) or not os.fspath(value):
        raise ArgumentError(expected(name, "", "the path of a file", value))
    return Path(value)


def settings_of(value: object, *, name: str = "set") -> dict[str, Any]:
    """Return values by dotted key.

    Raises:
        ArgumentError: it is no mapping from text.
    """
    if value is None:
        return {}
    if not isinstance(value, Mapping) or not all(isinstance(key, str) for key in value):
        raise ArgumentError(expected(name, "", 'values by key, as in {"brigades.n": 7}', value))
    return dict(value)
