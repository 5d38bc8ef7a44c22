"""Fires that are like those of a curriculum, drawn at random in cities that no training and no suite has.

Nobody looked whether they are contested, so they flatter no team, and there are as many as anybody wants.
"""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import islice
from typing import Final

from fireworld.draws import PLACEMENT, below, uniform
from fireworld.errors import ScenarioError, expected
from fireworld.evaluation.fire_base import FireBase, base_of
from fireworld.scenario import Scenario
from fireworld.scenario.document import CitySource
from fireworld.simulation.built import BuiltScenario, CityCache

FIRST_CITY: Final = 700_000
"""Seed of the first city; curricula and suites have those below 100,000."""
N_CITIES: Final = 20
"""Of each kind of city in the curriculum."""
LEAST, MOST = 0.7, 1.3
"""So many times as many buildings burn as in the fire that one is like."""
TRIES: Final = 20
"""So many times as many fires are drawn at most as are wanted."""
MODEL, CITY, PLACE, SIZE = range(4)
"""What is drawn for a fire: which one it is like, the city, the place in it, and how large it is."""


def add_drawn(parser: ArgumentParser, like: str) -> None:
    """Let a command take how many fires are drawn; 0 is none."""
    parser.add_argument("--drawn", type=_count, default=0, metavar="N", help=f"N other fires like those of each {like}")


def _count(text: str) -> int:
    if not text.isdecimal():
        raise ArgumentTypeError(f"expected a number of fires, got {text}")
    return int(text)


def fires_of(models: Sequence[Scenario], cities: CityCache, *, drawn: int, seed: int) -> list[BuiltScenario]:
    """Return the fires themselves, or, if so many are to be drawn, others like them; errors as for `drawn_fires`."""
    return drawn_fires(models, drawn, cities, seed=seed) if drawn else [cities.build(one) for one in models]


def drawn_fires(models: Sequence[Scenario], n: int, cities: CityCache, *, seed: int) -> list[BuiltScenario]:
    """Draw n fires, each like one of the models: its team, conditions and kind of city, at another place elsewhere.

    Raises:
        ScenarioError: cities of this kind have hardly anywhere room for such fires, or are not generated.
    """
    found = [*islice(_drawn(models, cities, seed, n_tries=TRIES * n), n)]
    if len(found) < n:
        raise ScenarioError(expected(models[0].name, "fires", f"room for {n} like these", f"room for {len(found)}"))
    return found


def _drawn(models: Sequence[Scenario], cities: CityCache, seed: int, *, n_tries: int) -> Iterator[BuiltScenario]:
    """Draw so many fires; those for which a city has no room are left out."""
    bases = dict[CitySource, FireBase]()
    for number in range(1, n_tries + 1):
        model = models[below(seed, PLACEMENT, number, MODEL, bound=len(models))]
        city = FIRST_CITY + below(seed, PLACEMENT, number, CITY, bound=N_CITIES)
        elsewhere = model.with_values({"city.generated.seed": city})
        if elsewhere.city not in bases:
            base = base_of(elsewhere, seed=city, brigades=None, civilians=None, values={})
            bases[elsewhere.city] = replace(base, people_stay=False)
        base = replace(bases[elsewhere.city], scenario=elsewhere)
        at = below(seed, PLACEMENT, number, PLACE, bound=1 << 31)
        place = next(base.places(at, n_places=1, n_fires=len(model.fires)))
        times = LEAST + (MOST - LEAST) * uniform(seed, PLACEMENT, number, SIZE)
        burning = round(times * sum(fire.n_buildings or 0 for fire in model.fires))
        try:
            yield cities.build(place.lit(elsewhere, max(len(model.fires), burning)))
        except ScenarioError:
            continue
