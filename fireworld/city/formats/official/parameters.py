"""The values of an official configuration as parameters of a scenario."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from typing import Any, Final

from fireworld.city.formats.official.cfg import Config
from fireworld.city.formats.official.keys import (
    BRIGADE_KEYS,
    BURN_KEYS,
    FIRE_KEYS,
    HEALTH_KEYS,
    MILLIMETRES,
    PREFIX,
    RAY_KEYS,
    STEPS_KEY,
    SYNONYMS,
)
from fireworld.parameters import Parameters
from fireworld.scenario.bounds import bounded

STEPS_MAX: Final = 100_000
STEPS: Final = 300
"""Of an official run whose configuration does not say."""
SECTIONS: Final = {
    "fire": {PREFIX + key: name for key, name in (FIRE_KEYS | BURN_KEYS | RAY_KEYS).items()},
    "health": HEALTH_KEYS,
    "brigades": {PREFIX + key: name for key, name in BRIGADE_KEYS.items()},
}


def overrides(config: Config, preset: Parameters) -> dict[str, dict[str, int | float]]:
    """Return the parameters, by section, that a configuration sets to other values than a preset has.

    Raises:
        CityError: which names file and key, for a value that is no number or out of bounds.
    """
    found = {name: dict(_differing(config, keys, getattr(preset, name))) for name, keys in SECTIONS.items()}
    return {name: values for name, values in found.items() if values}


def steps(config: Config) -> int:
    """Return how many steps a run has."""
    return config.whole(STEPS_KEY, low=1, high=STEPS_MAX, default=STEPS)


def _differing(config: Config, keys: dict[str, str], section: Any) -> Iterator[tuple[str, int | float]]:
    kinds = {item.name: str(item.type) for item in fields(section)}
    for key, name in keys.items():
        used = key if key in config.values else SYNONYMS.get(key.removeprefix(PREFIX), key)
        text = config.text(used)
        if text is None:
            continue
        try:
            number = float(text) / MILLIMETRES.get(name, 1.0)
        except ValueError:
            config.refuse(used, "a number")
        value, wanted = bounded(name, kinds[name], number)
        if value is None:
            config.refuse(used, wanted)
        if value != getattr(section, name):
            yield name, value


def uneven_injuries(config: Config) -> list[str]:
    """List the kinds of injury by fire whose probability depends on material or collapse, which fireworld has not."""
    uneven = []
    for kind in ("slight", "serious", "critical"):
        suffix = f".{kind}"
        texts = {
            value.text
            for key, value in config.values.items()
            if key.startswith("misc.injury.fire.") and key.endswith(suffix) and key.count(".") == 5
        }
        if len(texts) > 1:
            uneven.append(kind)
    return uneven
