"""Floors and materials of buildings: those of the map, or drawn as the official reader draws them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from fireworld.city.formats.official.cfg import Config
from fireworld.city.formats.official.gml import Area
from fireworld.city.formats.official.mersenne import MersenneTwister
from fireworld.city.formats.official.report import Report

MAX_FLOOR: Final = ("gis.map.max-floor", 3)
MAX_CODE: Final = ("gis.map.max-building-code", 2)
RANDOM_FLOORS: Final = "gis.map.floor-placement.random"
RANDOM_CODES: Final = "gis.map.building-code-placement.random"
RATE_MAX: Final = 1_000_000


def floors_and_codes(
    buildings: Sequence[Area], config: Config, report: Report
) -> tuple[dict[int, int], dict[int, int]]:
    """Return floors and code of each building, given in the order of the map's table: from the file, or drawn.

    Where both are drawn, each building draws its floors, then its code.
    """
    max_floor = config.whole(MAX_FLOOR[0], low=1, high=100, default=MAX_FLOOR[1])
    max_code = config.whole(MAX_CODE[0], low=0, high=2, default=MAX_CODE[1])
    draws_floors, draws_codes = (config.flag(key, default=False) for key in (RANDOM_FLOORS, RANDOM_CODES))
    floor_rates = _rates(config, f"{RANDOM_FLOORS}.floor-rate.", 1, max_floor) if draws_floors else []
    code_rates = _rates(config, f"{RANDOM_CODES}.code-rate.", 0, max_code) if draws_codes else []
    seed = config.text("random.seed", "") or ""
    generator = MersenneTwister(seed if draws_floors or draws_codes else "0", where=config.where)
    floors, codes = {}, {}
    for area in buildings:
        floors[area.area_id] = 1 + _drawn(generator, floor_rates) if draws_floors else min(max_floor, area.floors)
        codes[area.area_id] = _drawn(generator, code_rates) if draws_codes else min(max_code, area.code)
    what = " and ".join(word for word, drawn in (("floors", draws_floors), ("codes", draws_codes)) if drawn)
    if what:
        report.note("drawn", f"{what} of all buildings are drawn, random.seed {seed}")
    if not draws_floors:
        cut = [area.area_id for area in buildings if area.floors > max_floor]
        report.note_areas("floors-cut", f"buildings with more than {max_floor} floors: they get {max_floor}", cut)
    if not draws_codes:
        cut = [area.area_id for area in buildings if area.code > max_code]
        report.note_areas("codes-cut", f"buildings of a code above {max_code}: they get {max_code}", cut)
    return floors, codes


def _rates(config: Config, prefix: str, low: int, high: int) -> list[int]:
    """Return the rates of the values from low to high, added up."""
    total, cumulated = 0, []
    for value in range(low, high + 1):
        total += config.whole(f"{prefix}{value}", low=0, high=RATE_MAX)
        cumulated.append(total)
    if total == 0:
        config.refuse(f"{prefix}{low}", "rates that are not all 0")
    return cumulated


def _drawn(generator: MersenneTwister, cumulated: Sequence[int]) -> int:
    """Draw the position of a rate."""
    number = generator.next_int(cumulated[-1]) + 1
    return next(at for at, bound in enumerate(cumulated) if number <= bound)
