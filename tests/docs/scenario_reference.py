"""The field reference in docs/scenarios.md, made from the types.

`python -m tests.docs.scenario_reference` renews it.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Final

from msgspec import NODEFAULT, Struct, inspect, to_builtins

from fireworld.parameters import PRESETS
from fireworld.scenario.document import Document, Overrides
from fireworld.scenario.explain import bare, words
from tests.docs.pages import ROOT, with_part

BEGIN: Final = "<!-- made by tests.docs.scenario_reference -->"
END: Final = "<!-- end -->"
PAGE: Final = ROOT / "docs" / "scenarios.md"


def field_reference() -> str:
    """Return two Markdown tables: the keys of a scenario, and the physical parameters with every preset's values."""
    lines = ["| key | expected | default | meaning |", "|---|---|---|---|"]
    lines += _key_rows(inspect.type_info(Document), "")
    lines += ["", "| parameter | expected | " + " | ".join(PRESETS) + " |", "|---" * (2 + len(PRESETS)) + "|"]
    lines += _parameter_rows()
    return "\n".join(lines) + "\n"


def renew(page: str) -> str:
    """Return the page with its field reference made anew."""
    return with_part(page, BEGIN, END, f"\n\n{field_reference()}\n")


def _key_rows(document: inspect.Type, prefix: str) -> Iterator[str]:
    """Yield a row for every key, each followed by the keys below it."""
    for item in _fields(document):
        key = f"{prefix}{item.encode_name}"
        below, wanted, below_prefix = _with_keys(item.type), words(item.type), f"{key}."
        if isinstance(below, inspect.VarTupleType) and _fields(below.item_type):
            below, wanted, below_prefix = below.item_type, "a list, each entry with the keys below", f"{key}.0."
        elif key == "parameters":
            below, wanted = inspect.AnyType(), "the keys of the next table"
        elif _fields(below):
            wanted = words(_without_null(item.type)).replace(words(below), "the keys below")
        yield f"| `{key}` | {wanted} | {_default(item)} | {_meaning(item.type)} |"
        yield from _key_rows(below, below_prefix)


def _parameter_rows() -> Iterator[str]:
    """Yield a row for every physical parameter."""
    presets = [asdict(preset) for preset in PRESETS.values()]
    for section in _fields(inspect.type_info(Overrides)):
        for item in _fields(section.type):
            name, values = item.encode_name, [preset[section.encode_name][item.encode_name] for preset in presets]
            shown = " | ".join(f"{value:.12g}" for value in values)
            yield f"| `parameters.{section.encode_name}.{name}` | {words(_without_null(item.type))} | {shown} |"


def _fields(kind: inspect.Type) -> Sequence[inspect.Field]:
    """Return the keys of a type, none for a plain value."""
    kind = bare(kind)
    return kind.fields if isinstance(kind, inspect.StructType) else ()


def _without_null(kind: inspect.Type) -> inspect.Type:
    """Return a type without the null it may also be."""
    kind = bare(kind)
    if not isinstance(kind, inspect.UnionType):
        return kind
    options = tuple(option for option in kind.types if not isinstance(option, inspect.NoneType))
    return options[0] if len(options) == 1 else inspect.UnionType(options)


def _with_keys(kind: inspect.Type) -> inspect.Type:
    """Return the option of a type that has keys, if one has, or else the type without null."""
    kind = _without_null(kind)
    options = kind.types if isinstance(kind, inspect.UnionType) else ()
    return next((option for option in options if _fields(option)), kind)


def _meaning(kind: inspect.Type) -> str:
    """Return what a key's description says."""
    return str((kind.extra_json_schema or {}).get("description", "")) if isinstance(kind, inspect.Metadata) else ""


def _default(item: inspect.Field) -> str:
    """Return a key's default as YAML, or that it must be there."""
    if item.required:
        return "required"
    default = item.default_factory() if item.default is NODEFAULT else item.default
    return "" if isinstance(default, Struct) else f"`{json.dumps(to_builtins(default))}`"


if __name__ == "__main__":
    PAGE.write_text(renew(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
