"""Map formats: for each, one module that reads a city's plan; found by the ending of the file's name.

To add one, write a module with `parse_plan(content, *, where, name) -> Plan` that raises CityError, and name it here.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fireworld.errors import CityError, expected

if TYPE_CHECKING:
    from fireworld.city.city import Plan

FORMATS: Final = {".json": "fireworld.city.formats.json_plan"}
"""The module that reads each kind of file, by its ending."""


def read_plan(content: bytes, *, file: Path, where: str) -> Plan:
    """Return the plan of a city from the content of its file, whose name says the format, and names the city.

    Raises CityError, which begins with `where`, if there is no such format, or the content makes no city.
    """
    module = FORMATS.get(file.suffix.lower())
    if module is None:
        raise CityError(expected(where, "", f"a city file ending in {', '.join(FORMATS)}", file.suffix or "no ending"))
    plan: Plan = import_module(module).parse_plan(content, where=where, name=file.stem)
    return plan
