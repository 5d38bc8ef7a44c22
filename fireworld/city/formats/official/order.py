"""The order in which the official program keeps buildings: that of its hash tables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from fireworld.city.table_order import table_order

CONVERTED: Final = ("refuge", "gasstation", "hydrant", "firestation", "policeoffice", "ambulancecentre")
"""Kinds of buildings in the order in which the official program makes them of plain ones."""


def map_order(building_ids: Sequence[int]) -> list[int]:
    """Return the ids of buildings, listed in the order of the file, in the order of the map's own table."""
    return [building_ids[at] for at in table_order(building_ids)]


def world_order(plain: Sequence[int], converted: Sequence[int], n_entities: int) -> list[int]:
    """Return the ids of all buildings in the order of the world's table, the one of a trace's city.

    Args:
        plain: buildings that stayed plain ones, in the order of the map's table.
        converted: the others, in the order in which they were made of plain ones.
        n_entities: buildings, roads and people: all that is in the table.
    """
    inserted = [*plain, *converted]
    return [inserted[at] for at in table_order(inserted, n_entries=n_entities)]
