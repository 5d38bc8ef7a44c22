"""What a document was expected to hold, in words: for errors and for the docs.

msgspec judges whether a document fits its types; this walks the same types once more to name the first key at
fault, what was expected there and what was found.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from msgspec import Meta, inspect

from fireworld.errors import nearest


class Fault(NamedTuple):
    """What is wrong with one key of a document."""

    key: str
    wanted: str
    got: object
    hint: str = ""


def find_faults(value: object, kind: inspect.Type, key: str = "") -> Iterator[Fault]:
    """Yield what in a document, as a YAML or JSON reader returned it, does not fit a type, in the document's order.

    `key` is the dotted path of the value in the document.
    """
    kind = bare(kind)
    if isinstance(kind, inspect.UnionType):
        if value is None and any(isinstance(option, inspect.NoneType) for option in kind.types):
            return
        options = [option for option in kind.types if not isinstance(option, inspect.NoneType)]
        fitting = [option for option in options if isinstance(option, inspect.StructType) == isinstance(value, Mapping)]
        (option, *_) = fitting or options
        named = isinstance(option, inspect.LiteralType) and isinstance(value, str)
        for fault in find_faults(value, option, key):
            yield fault if fault.key != key or fault.hint or named else fault._replace(wanted=words(kind))
    elif isinstance(kind, inspect.StructType):
        yield from _struct_faults(value, kind, key)
    elif isinstance(kind, inspect.VarTupleType | inspect.TupleType):
        n = len(value) if isinstance(value, list) else -1
        kinds = kind.item_types if isinstance(kind, inspect.TupleType) else [kind.item_type] * n
        if not isinstance(value, list) or n != len(kinds) or n < (getattr(kind, "min_length", None) or 0):
            yield Fault(key, words(kind), _shown(value))
            return
        for index, (item, item_kind) in enumerate(zip(value, kinds, strict=True)):
            yield from find_faults(item, item_kind, _join(key, str(index)))
    elif not _fits(value, kind):
        names = [str(name) for name in kind.values] if isinstance(kind, inspect.LiteralType) else []
        yield Fault(key, words(kind), _shown(value), nearest(str(value), names))


def words(kind: inspect.Type) -> str:
    """Describe a type the way a user would: "whole number from 1 to 5, or null"."""
    kind = bare(kind)
    match kind:
        case inspect.UnionType():
            options = ["null" if isinstance(option, inspect.NoneType) else words(option) for option in kind.types]
            text = ", or ".join(options)
        case inspect.LiteralType():
            text = "one of " + ", ".join(str(name) for name in kind.values)
        case inspect.IntType():
            text = "a whole number" + _bounds(kind)
        case inspect.FloatType():
            text = "a number" + _bounds(kind)
        case inspect.StrType():
            text = f"text like {kind.pattern}" if kind.pattern else "text"
        case inspect.TupleType():
            each = dict.fromkeys(words(item) for item in kind.item_types)
            text = f"a list of {len(kind.item_types)}, each {' or '.join(each)}"
        case inspect.VarTupleType():
            text = f"a list of {kind.min_length or 0} or more, each {words(kind.item_type)}"
        case inspect.StructType():
            text = "keys and values"
        case _:
            raise AssertionError(f"no words for {kind}")
    return text


def bare(kind: inspect.Type) -> inspect.Type:
    """Take the descriptions off a type."""
    while isinstance(kind, inspect.Metadata):
        kind = kind.type
    return kind


def _struct_faults(value: object, kind: inspect.StructType, key: str) -> Iterator[Fault]:
    """Yield unknown keys, then missing ones, then what is wrong with the values."""
    if not isinstance(value, Mapping):
        yield Fault(key, words(kind), _shown(value))
        return
    fields = {item.encode_name: item for item in kind.fields}
    for name in value:
        if name not in fields:
            known = f"one of the keys {', '.join(fields)}" if len(fields) <= 6 else "a known key"
            yield Fault(_join(key, name if name.isprintable() else repr(name)), known, name, nearest(name, fields))
    for name, item in fields.items():
        if item.required and name not in value:
            yield Fault(_join(key, name), words(item.type), "no value")
    for name, content in value.items():
        if name in fields:
            yield from find_faults(content, fields[name].type, _join(key, name))


def _fits(value: object, kind: inspect.Type) -> bool:
    """Return whether msgspec would take a scalar."""
    match kind:
        case inspect.LiteralType():
            return isinstance(value, str) and value in kind.values
        case inspect.IntType():
            return isinstance(value, int) and not isinstance(value, bool) and within(value, kind)
        case inspect.FloatType():
            return isinstance(value, int | float) and not isinstance(value, bool) and within(value, kind)
        case inspect.StrType():
            return isinstance(value, str) and (kind.pattern is None or re.search(kind.pattern, value) is not None)
        case _:
            raise AssertionError(f"no scalar: {kind}")


def within(number: float, kind: inspect.IntType | inspect.FloatType | Meta) -> bool:
    """Return whether a number keeps its bounds; NaN does not."""
    return (
        (kind.ge is None or number >= kind.ge)
        and (kind.gt is None or number > kind.gt)
        and (kind.le is None or number <= kind.le)
    )


def _bounds(kind: inspect.IntType | inspect.FloatType) -> str:
    """Describe the bounds of a number."""
    if kind.gt is not None:
        return f" above {kind.gt:.12g}" + (f" and at most {kind.le:.12g}" if kind.le is not None else "")
    if kind.ge is not None:
        return f" from {kind.ge:.12g} to {kind.le:.12g}" if kind.le is not None else f" of at least {kind.ge:.12g}"
    return ""


def _shown(value: object) -> object:
    """Show what was found on one line: text in quotes, collections by what they are."""
    if value is None:
        return "no value"
    if isinstance(value, Mapping):
        return "a mapping"
    if isinstance(value, list):
        return f"the list {value}"
    return repr(value) if isinstance(value, str) and " " in value else value


def _join(key: str, name: str) -> str:
    """Extend a dotted path."""
    return f"{key}.{name}" if key else name
