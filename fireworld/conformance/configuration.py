"""The configuration of the official program, as a trace keeps it, turned into parameters."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Never, TypeVar

from fireworld.city.formats.official.keys import MILLIMETRES, PREFIX
from fireworld.errors import TraceError, expected
from fireworld.parameters import BrigadeParameters, FireParameters
from fireworld.scenario.bounds import bounded

Section = TypeVar("Section", FireParameters, BrigadeParameters)


@dataclass(frozen=True)
class Configuration:
    """A configuration and the file it came from."""

    where: str
    values: Mapping[str, Any]

    def has(self, keys: Mapping[str, str]) -> bool:
        """Return whether all of some keys are set."""
        return all(self.values.get(PREFIX + key) is not None for key in keys)

    def parameters(self, section: type[Section], keys: Mapping[str, str]) -> Section:
        """Return a section of parameters, the named ones from the configuration and the others at their defaults."""
        kinds = {item.name: str(item.type) for item in fields(section)}
        values: dict[str, Any] = {name: self._number(key, name, kinds[name]) for key, name in keys.items()}
        return section(**values)

    def number(self, key: str) -> float:
        """Return the value of one key; TraceError if it is missing or no number."""
        found = self.values.get(PREFIX + key)
        if found is None:
            self._refuse(key, "this key to be set", "nothing")
        try:
            return float("" if isinstance(found, bool) else found)
        except (ValueError, TypeError, OverflowError):
            self._refuse(key, "a number", found)

    def _number(self, key: str, name: str, kind: str) -> int | float:
        """Read one parameter within the bounds that it has in a scenario."""
        value, wanted = bounded(name, kind, self.number(key) / MILLIMETRES.get(name, 1.0))
        if value is None:
            self._refuse(key, wanted, self.values[PREFIX + key])
        return value

    def _refuse(self, key: str, wanted: str, got: object) -> Never:
        """Raise for one key."""
        raise TraceError(expected(self.where, f"params: {PREFIX}{key}", wanted, got))


def read_configuration(where: str, text: str) -> Configuration:
    """Parse the JSON text of a configuration; TraceError if it is no JSON object."""
    try:
        values = json.loads(text)
    except (ValueError, RecursionError):
        raise TraceError(expected(where, "params", "a JSON text", text)) from None
    if not isinstance(values, dict):
        raise TraceError(expected(where, "params", "a JSON object", text))
    return Configuration(where, values)
