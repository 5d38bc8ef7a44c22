"""What a policy is, as a digest: of its source, and of the values it was made with."""

from __future__ import annotations

import ast
import dataclasses
import dis
import hashlib
import inspect
import json
import linecache
import sys
import sysconfig
from collections.abc import Iterator
from contextlib import suppress
from enum import Enum
from functools import cached_property, partial
from pathlib import Path, PurePath
from threading import Lock
from types import CellType, CodeType, FunctionType, GetSetDescriptorType, MemberDescriptorType, MethodType, ModuleType
from typing import Any, Final

import numpy as np

LIBRARIES: Final = (
    str(Path(__file__).parents[1]),
    *(sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib")),
    "<",  # code without a file
)
"""Where code that is not the user's own comes from."""
_PARSING: Final = Lock()
"""Python 3.11 counts how deep a tree is for all threads together: two that parse at once may get a SystemError."""
NOTEBOOK: Final = "__main__"
"""The module of what is made in a notebook, or in a script that is run."""
_NO_MEMBERS: Final = ("_abc_impl", "__annotate__", "__annotate_func__")
_WITHIN: Final[dict[type, tuple[str, ...]]] = {
    property: ("fget", "fset", "fdel"),
    staticmethod: ("__func__",),
    classmethod: ("__func__",),
    cached_property: ("func",),
}
"""Where the functions of a class's members are that are none themselves."""


class _UntoldError(Exception):
    """Raised for what no digest can cover: it has no source, or is no plain value."""


def covering(digest: str, values: Any) -> str:
    """Return a digest that covers another one, "" if there is none, and values that JSON can hold, if there are any."""
    if not (digest and values):
        return digest
    return hashlib.sha256(json.dumps([digest, values], sort_keys=True).encode()).hexdigest()


def digest_of(given: Any) -> str:
    """Return the digest of a class, function or object; "" if source and values cannot tell what it does.

    For a class or function in a file, the file counts; for one made in a notebook or a script that is run, its text
    and what it refers to there. For an object its attributes count too, for a function its defaults and closure.
    """
    kind: Any = given if inspect.isclass(given) or isinstance(given, FunctionType) else type(given)
    if isinstance(given, MethodType | partial):
        kind = given.func if isinstance(given, partial) else given.__func__
    module = sys.modules.get(kind.__module__)
    try:
        if kind.__module__ == NOTEBOOK:
            return covering("text", [_content(kind, set()), _state(given, set())])
        return covering(digest_of_module(module), _state(given, set())) if module is not None else ""
    except (_UntoldError, RecursionError):
        return ""


def digest_of_module(module: ModuleType) -> str:
    """Return the SHA-256 of the file of a module, and of those of all modules that it brought in; "" if it has none.

    Brought in are its package, and the modules that it, and these in turn, name or take names from, as far as they are
    neither fireworld's, nor Python's, nor installed as a library.
    """
    own, others = _digest_of_file(module), modules_brought_in(module)
    return covering(own, {one.__name__: _digest_of_file(one) for one in others})


def modules_brought_in(module: ModuleType) -> list[ModuleType]:
    """Return the modules of a user's that a module needs, besides itself."""
    found, left = {module.__name__: module}, [module]
    while left:
        one = left.pop()
        imported = _imported_by(one)
        named = [value if isinstance(value, ModuleType) else _module_of(value) for value in [*vars(one).values()]]
        named = [other for other in named if other is None or not _is_inside(other, one) or other.__name__ in imported]
        named += [sys.modules.get(name) for name in imported]
        package = sys.modules.get(one.__name__.rpartition(".")[0])
        for other in (*named, package):
            file = str(getattr(other, "__file__", None) or "<")
            if other is None or other.__name__ in found or file.startswith(LIBRARIES):
                continue
            found[other.__name__] = other
            left.append(other)
    return [one for name, one in sorted(found.items()) if one is not module]


def _is_inside(other: ModuleType, package: ModuleType) -> bool:
    """Return whether a module is in a package: whoever imports it makes it an attribute of the package."""
    return other.__name__.startswith(f"{package.__name__}.")


def _imported_by(module: ModuleType) -> set[str]:
    """Return the full names of what a module imports when it is imported; some are names in modules."""
    try:
        source = inspect.getsource(module)
        with _PARSING:
            tree = ast.parse(source)
    except (OSError, TypeError, SyntaxError, ValueError):
        return set()
    found = set()
    package = module.__name__ if hasattr(module, "__path__") else module.__name__.rpartition(".")[0]
    left: list[ast.AST] = [tree]
    while left:
        node = left.pop()
        left += [
            one for one in ast.iter_child_nodes(node) if not isinstance(one, ast.FunctionDef | ast.AsyncFunctionDef)
        ]
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: -(node.level - 1) or None] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            found |= {f"{base}.{alias.name}" for alias in node.names}
    return found


def _module_of(value: Any) -> ModuleType | None:
    """Return the module that a class, function or object was taken from."""
    try:
        name = getattr(value, "__module__", None)
    except Exception:  # noqa: BLE001 - a user's object may do anything
        return None
    return sys.modules.get(name) if isinstance(name, str) else None


def _digest_of_file(module: ModuleType) -> str:
    """Return the SHA-256 of the file of a module; "" if it has none."""
    with suppress(AttributeError, OSError):
        return hashlib.sha256(Path(str(module.__file__)).read_bytes()).hexdigest()
    with suppress(OSError, TypeError):  # a module in an archive
        return hashlib.sha256(inspect.getsource(module).encode()).hexdigest()
    return ""


def can_be_imported(given: Any) -> bool:
    """Return whether another process finds a class or function, or the class of an object, by importing its module."""
    named = given if inspect.isclass(given) or isinstance(given, FunctionType) else type(given)
    found: Any = sys.modules.get(named.__module__) if named.__module__ != NOTEBOOK else None
    for name in named.__qualname__.split("."):
        found = vars(found).get(name) if found is not None else None
    return found is named


def _state(given: Any, seen: set[int]) -> list[Any]:
    """Return what separates a function or object from others of one source; of an object what pickle would keep."""
    parts: tuple[Any, ...] = ()
    if isinstance(given, FunctionType):
        enclosed = [cell.cell_contents for cell in given.__closure__ or () if cell != CellType()]
        parts = given.__defaults__, given.__kwdefaults__, enclosed or None
    elif isinstance(given, partial):
        parts = given.func, given.args, given.keywords
    elif isinstance(given, MethodType):
        return [_content(type(given.__self__), seen), _state(given.__self__, seen)]
    elif not inspect.isclass(given):
        kind: Any = type(given)
        if kind.__reduce_ex__ is not object.__reduce_ex__ or kind.__reduce__ is not object.__reduce__:
            raise _UntoldError
        try:
            reduced: Any = object.__reduce_ex__(given, 2)
            _, _, held, *items = reduced
        except (TypeError, ValueError):  # what it holds is known to its C code only
            raise _UntoldError from None
        parts = *(held if isinstance(held, tuple) else (held,)), *items
    return [_plain(part, seen) for part in parts if part is not None]


def _plain(value: Any, seen: set[int]) -> Any:
    """Return what stands for a value in a digest."""
    if isinstance(value, np.ndarray | np.generic) and not value.dtype.hasobject:
        return [str(value.dtype), value.shape, hashlib.sha256(value.tobytes()).hexdigest()]
    if value is None or isinstance(value, bool | int | float | str | bytes | Enum | PurePath | ModuleType):
        return value.__name__ if isinstance(value, ModuleType) else repr(value)
    if isinstance(value, dict | list | tuple | set | frozenset):
        unordered = isinstance(value, set | frozenset)
        items = sorted(value, key=repr) if unordered else value.items() if isinstance(value, dict) else value
        return [type(value).__name__, [_plain(one, seen) for one in items]]
    if inspect.isclass(value) or inspect.isroutine(value) or isinstance(value, partial):
        return _content(value, seen)
    if dataclasses.is_dataclass(value):
        return [_content(type(value), seen), _state(value, seen)]
    raise _UntoldError


def _content(thing: Any, seen: set[int]) -> Any:
    """Return what stands for a class or function: its name, or its text and what that refers to, if it has no file."""
    if isinstance(thing, partial):
        return _state(thing, seen)
    if isinstance(thing, MethodType):
        return [_content(thing.__func__, seen), _state(thing, seen)]
    name = f"{thing.__module__}:{thing.__qualname__}"
    if id(thing) in seen or not (inspect.isclass(thing) or isinstance(thing, FunctionType)):
        return name
    seen.add(id(thing))
    own = thing.__module__ == NOTEBOOK
    if inspect.isclass(thing):
        return [name, [_content(base, seen) for base in thing.__bases__], [*_members(thing, seen)]] if own else name
    named = {word: thing.__globals__[word] for word in _globals_of(thing.__code__) if word in thing.__globals__}
    return [[_text_of(thing.__code__), _plain(named, seen)] if own else name, _state(thing, seen)]


def _members(kind: type, seen: set[int]) -> Iterator[Any]:
    """Yield what stands for the methods and attributes of a class made in a notebook."""
    for name, member in vars(kind).items():
        if name in _NO_MEMBERS or isinstance(member, GetSetDescriptorType | MemberDescriptorType):
            continue
        if name.startswith("__"):  # most are Python's own, or made by @dataclass of what is seen here anyway
            source: Any = inspect.unwrap(member) if isinstance(member, FunctionType) else None
            if source is None or not linecache.getlines(source.__code__.co_filename):
                continue
        within = [getattr(member, part) for part in _WITHIN.get(type(member), ())] or [member]
        yield [name, type(member).__name__, [_plain(part, seen) for part in within]]


def _globals_of(code: CodeType) -> list[str]:
    """Return the names that a function, and those within it, look up in their module."""
    names = [one.argval for one in dis.get_instructions(code) if one.opname == "LOAD_GLOBAL"]
    for inner in code.co_consts:
        names += _globals_of(inner) if isinstance(inner, CodeType) else []
    return sorted(set(names))


def _text_of(code: CodeType) -> str:
    """Return the source of a function; of a lambda only its own part of the lines that it stands in."""
    if code.co_name != "<lambda>":
        try:
            return inspect.getsource(code)
        except OSError:
            raise _UntoldError from None
    lines = [line.encode() for line in linecache.getlines(code.co_filename)]
    spans = [(a, c, b, d) for a, b, c, d in code.co_positions() if a and b and c is not None and d]
    if not (spans and lines):
        raise _UntoldError
    first, start = min(span[:2] for span in spans)
    last, end = max(span[2:] for span in spans)
    taken = lines[first - 1 : last]
    taken[-1] = taken[-1][:end]
    taken[0] = taken[0][start:]
    return f"lambda {', '.join(code.co_varnames[: code.co_argcount])}: {b''.join(taken).decode()}"
