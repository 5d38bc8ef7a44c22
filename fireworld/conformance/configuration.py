"""The configuration of the official program, as a trace keeps it, turned into parameters."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Final, Never, TypeVar

from fireworld.errors import TraceError, expected
from fireworld.parameters import BrigadeParameters, FireParameters
from fireworld.scenario.document import ANY_AMOUNT, BOUNDS
from fireworld.scenario.explain import within

PREFIX: Final = "resq-fire."
FIRE_KEYS: Final = {
    **{
        f"{theirs}_{their_name}": f"{name}_{material}"
        for their_name, name in (
            ("energy", "fuel_density"),
            ("capacity", "heat_capacity"),
            ("ignition", "ignition_point"),
        )
        for theirs, material in (("wooden", "wood"), ("steel", "steel"), ("concrete", "concrete"))
    },
    "cell_size": "air_cell_mm",
    "air_to_air_flow": "air_to_air_flow",
    "air_to_building_flow": "air_to_building_flow",
    "air_cell_heat_capacity": "air_heat_capacity",
    "energy_loss": "air_heat_kept",
    "radiation_coefficient": "radiation_coefficient",
    "water_thermal_capacity": "water_heat_per_litre",
    "gamma": "water_unburnt_share",
}
"""Parameter of each key, without its prefix, that every replay needs."""
BURN_KEYS: Final = {"burn-rate-average": "burn_rate_mean", "burn-rate-variance": "burn_rate_sd"}
"""Needed where the trace has no draws. The official "variance" is a standard deviation."""
RAY_KEYS: Final = {"ray_rate": "ray_rate_per_mm", "max_ray_distance": "ray_range_mm"}
"""Needed where the trace has no links."""
BRIGADE_KEYS: Final = {
    "water_capacity": "tank_litres",
    "max_extinguish_power_sum": "power_litres",
    "water_refill_rate": "refuge_refill_litres",
    "water_hydrant_refill_rate": "hydrant_refill_litres",
    "water_distance": "range_m",
}
"""Needed where the city has brigades."""
MILLIMETRES: Final = {"range_m": 1000.0}
"""Parameters that the configuration gives in a smaller unit."""

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
        value = self.number(key) / MILLIMETRES.get(name, 1.0)
        bounds = BOUNDS.get(name, ANY_AMOUNT)
        if not within(value, bounds) or (kind == "int" and value != int(value)):
            what = "a whole number" if kind == "int" else "a number"
            least = f"at least {bounds.ge:g}" if bounds.ge is not None else f"above {bounds.gt:g}"
            self._refuse(key, f"{what} {least} and at most {bounds.le:g}", self.values[PREFIX + key])
        return int(value) if kind == "int" else value

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
