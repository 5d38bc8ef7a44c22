"""Parameters of a policy as they follow its name, `k=3,near=true`: read, written and checked against a signature."""

from __future__ import annotations

import inspect
import json
import math
import re
from collections.abc import Callable, Mapping
from typing import Any, Final

from fireworld.errors import PolicyError, ScenarioError, expected, nearest
from fireworld.scenario.yaml_text import read_yaml

Parameters = Mapping[str, Any]
"""Plain values by name: None, bool, int, float, str, and lists of these."""

_QUOTED: Final = r""""(?:\\.|[^"\\])*"|'[^']*'"""
_INNER: Final = rf"\[(?:{_QUOTED}|[^\[\]\"'])*\]"
_LIST: Final = rf"\[(?:{_QUOTED}|{_INNER}|[^\[\]\"'])*\]"
_PART: Final = re.compile(rf"([^=,]*)=((?:{_QUOTED}|{_LIST}|[^,\"'\[\]])*)(?:,(?=.)|$)", re.DOTALL)
_BARE: Final = re.compile(r"[A-Za-z_./][\w./+-]*")


def read_parameters(text: str, *, where: str) -> dict[str, Any]:
    """Return the parameters that a text says, as in "k=3,near=true,name='a, b'"; YAML values, nothing is evaluated."""
    values: dict[str, Any] = {}
    at = 0
    while at < len(text):
        part = _PART.match(text, at)
        name = part[1].strip() if part else ""
        if part is None or not name.isidentifier():
            raise PolicyError(expected(where, "", "parameters as in k=3,near=true", text[at:]))
        if name in values:
            raise PolicyError(expected(where, "", "every parameter once", f"{name} twice"))
        values[name] = _read_value(part[2], where=f"{where}: {name}")
        at = part.end()
    return values


def write_parameters(parameters: Parameters) -> str:
    """Return parameters as text that `read_parameters` reads back."""
    return ",".join(f"{name}={_write_value(value)}" for name, value in parameters.items())


def check_plain(parameters: Parameters, *, where: str) -> dict[str, Any]:
    """Return parameters given in Python as plain values; PolicyError for what could not stand on the command line."""
    for name, value in parameters.items():
        if not (isinstance(name, str) and name.isidentifier()):
            raise PolicyError(expected(where, "", "names of parameters", name))
        if not _is_plain(value):
            wanted = "a plain value (a number, text, true or false, None, or a list of these)"
            raise PolicyError(expected(where, name, wanted, value, "give the policy as an object"))
    return {name: _as_lists(value) for name, value in parameters.items()}


def check_no_parameters(parameters: Parameters, *, where: str) -> None:
    """Raise PolicyError if there are parameters."""
    for name in parameters:
        raise PolicyError(expected(where, "", "no parameters", name))


def takes(target: Callable[..., Any], parameters: Parameters, *, n_before: int = 0) -> bool:
    """Return whether a function can be called with some arguments and then these parameters as keywords."""
    try:
        inspect.signature(target).bind(*[None] * n_before, **parameters)
    except TypeError:
        return False
    return True


def check_signature(target: Callable[..., Any], parameters: Parameters, *, where: str) -> None:
    """Raise PolicyError if a class or function does not take these parameters as keywords, or needs others."""
    try:
        taken = inspect.signature(target).parameters.values()
    except (TypeError, ValueError):  # some of what is written in C has none
        return
    open_ended = any(one.kind is one.VAR_KEYWORD for one in taken)
    known = {one.name: one for one in taken if one.kind in (one.POSITIONAL_OR_KEYWORD, one.KEYWORD_ONLY)}
    for name in parameters:
        if name not in known and not open_ended:
            wanted = f"parameters {', '.join(known)}" if known else "no parameters"
            raise PolicyError(expected(where, "", wanted, name, nearest(name, known)))
    for name, one in known.items():
        if one.default is one.empty and name not in parameters:
            raise PolicyError(expected(where, "", f"a value for {name}, as in {name}=VALUE", "none"))


def _read_value(text: str, *, where: str) -> Any:
    if not text.strip():
        return ""
    try:
        value = read_yaml(text, source=where)
    except ScenarioError as error:
        raise PolicyError(str(error)) from None
    if not _is_plain(value):
        raise PolicyError(expected(where, "", "a number, text, true, false, null or a list of these", text))
    return value


def _write_value(value: Any) -> str:
    if isinstance(value, str):
        return value if _BARE.fullmatch(value) and read_yaml(value, source="") == value else json.dumps(value)
    return f"[{', '.join(map(_write_value, value))}]" if isinstance(value, list) else json.dumps(value)


def _as_lists(value: Any) -> Any:
    return [_as_lists(one) for one in value] if isinstance(value, list | tuple) else value


def _is_plain(value: Any) -> bool:
    if isinstance(value, list | tuple):
        return all(map(_is_plain, value))
    return value is None or type(value) in (bool, int, str) or (type(value) is float and math.isfinite(value))
