"""Who and what is where, as scenario.xml and *.cfg."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fireworld.city.city import Plan
from fireworld.city.formats.json_plan import BUILDING_TYPES
from fireworld.city.formats.official.floors import MAX_FLOOR
from fireworld.city.formats.official.keys import HEALTH_KEYS, INFLAMMABLE_KEYS, MILLIMETRES, PREFIX, STEPS_KEY, SYNONYMS
from fireworld.city.formats.official.parameters import SECTIONS
from fireworld.city.formats.official.scenario_xml import BUILDING_KINDS, KINDS
from fireworld.parameters import Parameters


def scenario_xml(plan: Plan, hydrants: Sequence[int], people: Mapping[str, Sequence[int]]) -> str:
    """Return the text of a scenario.xml.

    Args:
        plan: the city, for the kinds of its buildings.
        hydrants: ids of roads.
        people: ids of places by kind: fire, civilian, firebrigade.
    """
    ids = plan.footprints.building_id
    kinds = plan.footprints.refuge if plan.kind is None else plan.kind  # 0 building, 1 refuge in either
    places: dict[str, Sequence[int]] = {
        kind: ids[kinds == BUILDING_TYPES.index(kind)].tolist() for kind in BUILDING_KINDS
    }
    places |= {"hydrant": hydrants, **people}
    lines = [f'  <scenario:{kind} scenario:location="{place}"/>' for kind in KINDS for place in places.get(kind, ())]
    head = '<?xml version="1.0" encoding="UTF-8"?>\n\n<scenario:scenario xmlns:scenario="urn:roborescue:map:scenario">'
    return "\n".join([head, *lines, "</scenario:scenario>"]) + "\n"


def config_files(plan: Plan, parameters: Parameters, n_steps: int) -> dict[str, str]:
    """Return the texts of the configuration's files, by name: the keys that a fire depends on.

    A whole configuration of the official program has more; these take the place of its files of the same names.
    """
    most_floors = int(np.max(plan.footprints.floors))
    return {
        "common.cfg": _text({"random.seed": 1, STEPS_KEY: n_steps}),
        "gis.cfg": _text(
            {
                "gis.map.dir": ".",
                "gis.map.file": "map.gml",
                "gis.map.scenario": "scenario.xml",
                MAX_FLOOR[0]: max(MAX_FLOOR[1], most_floors),
                "gis.map.floor-placement.random": "false",
                "gis.map.building-code-placement.random": "false",
            }
        ),
        "resq-fire.cfg": _text(
            {**_values(parameters, "fire"), **_values(parameters, "brigades"), **_inflammable(plan)}
        ),
        "misc.cfg": _text(_injuries(parameters)),
    }


def _values(parameters: Parameters, section: str) -> dict[str, Any]:
    """Return the keys of a section of parameters, by both names of those that have two."""
    values: dict[str, Any] = {}
    for key, name in SECTIONS[section].items():
        value = getattr(getattr(parameters, section), name)
        if name in MILLIMETRES:
            value = round(value * MILLIMETRES[name])
        values[key] = value
        second = SYNONYMS.get(key.removeprefix(PREFIX))
        if second is not None:
            values[second] = value
    return values


def _inflammable(plan: Plan) -> dict[str, str]:
    """Return for each kind whether it burns, as its first building says."""
    kinds = plan.footprints.refuge if plan.kind is None else plan.kind
    burns: dict[str, str] = {}
    for kind, key in INFLAMMABLE_KEYS.items():
        of_kind = plan.footprints.inflammable[kinds == BUILDING_TYPES.index(kind)]
        burns[PREFIX + key] = "true" if len(of_kind) and of_kind[0] else "false"
    return burns


def _injuries(parameters: Parameters) -> dict[str, Any]:
    """Return the keys of injuries; probabilities are alike for all materials and degrees of collapse."""
    values: dict[str, Any] = {}
    for key, name in HEALTH_KEYS.items():
        value = getattr(parameters.health, name)
        if ".wood.none." not in key:
            values[key] = value
            continue
        for material in ("wood", "steel", "concrete"):
            for degree in ("none", "partial", "half", "all"):
                values[key.replace(".wood.none.", f".{material}.{degree}.")] = value
    return values


def _text(values: Mapping[str, Any]) -> str:
    return "".join(f"{key}: {value}\n" for key, value in values.items())
