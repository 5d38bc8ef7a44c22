"""A fire in a city of OpenStreetMap as a scenario file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from fireworld.city.city import Plan
from fireworld.errors import ScenarioError, expected
from fireworld.maps.imported import WHERE, checked_scenario

PRESET: Final = "paper"
N_FIRES: Final = 2
"""Buildings in the middle that burn where none are named."""
FIRE_MIN_M2: Final = 100
N_CIVILIANS: Final = 8
PEOPLE_FROM_TO_M: Final = (60.0, 250.0)
N_BRIGADES: Final = 4
STEPS: Final = 300


def fire_text(plan: Plan, city_text: str, *, fires: Sequence[int | str] | None, city: str) -> str:
    """Return the text of a scenario file: a fire, people around it, and four brigades at the refuges.

    Args:
        plan: the city.
        city_text: content of its file.
        fires: buildings that burn, by number or id of OpenStreetMap; by default two in the middle.
        city: the city file as the scenario names it.

    Raises:
        ScenarioError: no such building, or one that cannot burn.
    """
    document: dict[str, Any] = {
        "name": plan.name,
        "description": f"A fire in {plan.name}.",
        "preset": PRESET,
        "city": {"file": city},
        "fires": [{"buildings": _in_the_middle(plan) if fires is None else _ids(plan, fires)}],
        "civilians": _civilians(plan),
        "brigades": {"n": N_BRIGADES},
        "steps": STEPS,
    }
    return checked_scenario(document, plan, city_text)


def _in_the_middle(plan: Plan) -> list[int]:
    """Return the numbers of the buildings nearest to the middle that burn; not of sheds, if there are others."""
    footprints = plan.footprints
    burning = np.flatnonzero(footprints.inflammable)
    if not len(burning):
        raise ScenarioError(expected(WHERE, "fires", "a building that can burn", "none in the city"))
    large = burning[footprints.ground_area_m2[burning] >= FIRE_MIN_M2]
    burning = large if len(large) else burning
    low, high = footprints.outline_mm.min(axis=0).astype(np.int64), footprints.outline_mm.max(axis=0).astype(np.int64)
    away = footprints.centroid_mm[burning].astype(np.int64) - (low + high) // 2
    nearest = np.argsort((away * away).sum(axis=1), kind="stable")[:N_FIRES]
    chosen: list[int] = footprints.building_id[burning[nearest]].tolist()
    return chosen


def _n_burning(plan: Plan) -> int:
    return int(plan.footprints.inflammable.sum())


def _civilians(plan: Plan) -> dict[str, Any]:
    """Return people around the fire; none in a city too small for a distance from it."""
    if _n_burning(plan) < 20 * N_CIVILIANS:
        return {"n": 0}
    low, high = PEOPLE_FROM_TO_M
    return {"n": N_CIVILIANS, "from_m": low, "to_m": high}


def _ids(plan: Plan, fires: Sequence[int | str]) -> list[int]:
    """Return the numbers of buildings that are named by number or by id of OpenStreetMap."""
    numbers = {source: int(one) for source, one in zip(plan.source_id, plan.footprints.building_id, strict=True)}
    known = set(numbers.values())
    found = []
    for one in fires:
        text = str(one).strip()
        number = int(text) if text.isascii() and text.isdecimal() and len(text) < 10 else numbers.get(text)
        if number not in known:
            wanted = (
                f"numbers of buildings, 1 to {len(known)}, or their ids in OpenStreetMap, such as {plan.source_id[0]}"
            )
            raise ScenarioError(expected("--fires", "", wanted, text or "nothing"))
        found.append(number)
    return list(dict.fromkeys(found))
