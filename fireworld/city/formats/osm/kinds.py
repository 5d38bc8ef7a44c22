"""What a building of OpenStreetMap is like: floors and material, by what its tags say, else by its kind."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from fireworld import draws

LEVEL_HEIGHT_M: Final = 3.0
FLOORS_MAX: Final = 200
DEFAULT_FLOORS: Final = 2
FLOORS_BY_KIND: Final[Mapping[str, int]] = {
    "apartments": 4, "block": 4, "dormitory": 4, "hospital": 4, "hotel": 4, "office": 4, "residential": 3,
    "commercial": 3, "civic": 3, "government": 3, "public": 3, "university": 3, "college": 3, "train_station": 2,
    "cathedral": 4, "church": 3, "tower": 4, "retail": 2, "school": 2, "house": 2, "detached": 2,
    "semidetached_house": 2, "terrace": 2, "farm": 2, "industrial": 2, "warehouse": 1, "supermarket": 1,
    "kindergarten": 1, "barn": 1, "bungalow": 1, "cabin": 1, "carport": 1, "garage": 1, "garages": 1, "greenhouse": 1,
    "hangar": 1, "hut": 1, "kiosk": 1, "pavilion": 1, "roof": 1, "service": 1, "shed": 1, "stable": 1,
    "static_caravan": 1, "utility": 1, "toilets": 1,
}  # fmt: skip
"""Floors where neither levels nor height are given; DEFAULT_FLOORS for all other kinds."""

WOOD, STEEL, CONCRETE = 0, 1, 2
MATERIALS_BY_TAG: Final[Mapping[str, int]] = {
    "wood": WOOD, "timber": WOOD, "timber_framing": WOOD, "bamboo": WOOD, "log": WOOD, "plywood": WOOD, "reed": WOOD,
    "steel": STEEL, "metal": STEEL, "metal_plates": STEEL, "glass": STEEL, "iron": STEEL, "aluminium": STEEL,
    "tin": STEEL, "plastic": STEEL,
    "concrete": CONCRETE, "reinforced_concrete": CONCRETE, "cement_block": CONCRETE, "brick": CONCRETE,
    "bricks": CONCRETE, "masonry": CONCRETE, "stone": CONCRETE, "sandstone": CONCRETE, "limestone": CONCRETE,
    "granite": CONCRETE, "marble": CONCRETE, "plaster": CONCRETE, "cement": CONCRETE, "adobe": CONCRETE,
    "clay": CONCRETE, "mud": CONCRETE, "tiles": CONCRETE,
}  # fmt: skip
"""What the materials of OpenStreetMap are taken for: the model knows three."""
SHARES: Final[Mapping[str, tuple[int, int, int]]] = {
    "homes": (80, 5, 15),
    "halls": (10, 65, 25),
    "blocks": (20, 30, 50),
}
"""Wood, steel and concrete in per cent, by group of kinds."""
OTHER_SHARES: Final = (75, 20, 5)
"""Of all other kinds: as in generated cities and the official maps."""
BLOCK_FLOORS: Final = 4
GROUP_OF: Final[Mapping[str, str]] = {
    **dict.fromkeys(
        ("house", "detached", "semidetached_house", "terrace", "bungalow", "cabin", "farm", "barn", "hut", "shed",
         "garage", "garages", "carport", "stable", "static_caravan"),
        "homes",
    ),
    **dict.fromkeys(
        ("industrial", "warehouse", "hangar", "retail", "supermarket", "greenhouse", "train_station", "roof", "service",
         "utility"),
        "halls",
    ),
    **dict.fromkeys(
        ("apartments", "block", "dormitory", "hospital", "hotel", "office", "residential", "commercial", "civic",
         "government", "public", "university", "college", "school", "kindergarten", "church", "cathedral"),
        "blocks",
    ),
}  # fmt: skip
_NUMBER: Final = re.compile(r"\s*(\d{1,6}(?:\.\d{1,6})?)\s*(m|metres|meters)?\s*", re.IGNORECASE)
_MATERIAL_DRAW: Final = 64
"""Property of a building that is drawn; those below it are of generated lots."""


def floors_of(tags: Mapping[str, str]) -> tuple[int, str]:
    """Return a building's floors, and the tag that they come from: "" where only its kind says something.

    Half a level counts as one; a height is divided by 3 m and rounded.
    """
    levels = _number(tags.get("building:levels"))
    if levels is not None:
        return _bounded(levels), "building:levels"
    height = _number(tags.get("height"))
    if height is not None:
        return _bounded(height / LEVEL_HEIGHT_M), "height"
    return FLOORS_BY_KIND.get(tags["building"], DEFAULT_FLOORS), ""


def material_of(tags: Mapping[str, str], *, floors: int, seed: int, key: int) -> tuple[int, bool]:
    """Return a building's material and whether its tag says so; else it is drawn, by a key of its own, by its kind.

    One of no known kind with four floors or more counts as a block.
    """
    said = MATERIALS_BY_TAG.get(tags.get("building:material", "").lower())
    if said is not None:
        return said, True
    group = GROUP_OF.get(tags["building"], "blocks" if floors >= BLOCK_FLOORS else "")
    wood, steel, _ = SHARES.get(group, OTHER_SHARES)
    drawn = draws.below(seed, draws.CITY, key, _MATERIAL_DRAW, bound=100)
    return (WOOD if drawn < wood else STEEL if drawn < wood + steel else CONCRETE), False


def _number(text: str | None) -> float | None:
    """Read a number, in metres if a unit is named; None for anything else."""
    found = None if text is None or not text.isascii() else _NUMBER.fullmatch(text)
    return None if found is None else float(found[1])


def _bounded(floors: float) -> int:
    """Round floors, half ones up, to what a building can have."""
    return min(max(int(floors + 0.5), 1), FLOORS_MAX)
