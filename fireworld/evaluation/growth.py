"""Fires that grow, building by building, until they are contested."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass

import msgspec

from fireworld.errors import ScenarioError
from fireworld.evaluation.contested import Contest
from fireworld.evaluation.judge import Judge
from fireworld.evaluation.scenario_check import PolicyResult, mean_share
from fireworld.scenario import Scenario
from fireworld.scenario.document import Civilians, Fire, Point
from fireworld.simulation.built import BuiltScenario

USUAL_SHARE, USUAL_MOST_OF_FEW, SHARE_OF_FEW = 8, 16, 2
"""Unless asked otherwise, one in eight of the buildings that can burn does so at the start at most; in a small city 16,
or one in two."""


@dataclass(frozen=True)
class FirePlace:
    """Where fires start, and who is in danger there."""

    number: int
    """Among the places that are drawn, from 1 on."""
    at: tuple[Point, ...]
    """One for each fire."""
    civilians: Civilians

    def lit(self, base: Scenario, n_burning: int) -> Scenario:
        """Return a scenario with so many burning buildings here, shared out among the fires, and nowhere else."""
        n = len(self.at)
        fires = tuple(
            Fire(at=at, n_buildings=n_burning // n + (k < n_burning % n))  # the first ones get what is left
            for k, at in enumerate(self.at)
        )
        return msgspec.structs.replace(base, fires=fires, civilians=self.civilians)


@dataclass(frozen=True, kw_only=True)
class Grown:
    """How a fire has grown at a place."""

    place: FirePlace
    n_burning: int
    """The number of burning buildings at which it stopped growing."""
    built: BuiltScenario | None = None
    rules: tuple[PolicyResult, ...] = ()
    """How the rules came out with so many."""
    verdict: Contest | None = None
    """None: the city has no room there for the people, or for so many burning buildings."""
    brigades_matter: bool = True
    """It makes a difference there what brigades do."""
    error: ScenarioError | None = None
    """What was missing then."""


def spreads(base: Scenario, place: FirePlace, n_burning: int, judge: Judge) -> bool:
    """Return whether a fire of so many buildings is not held, if nobody puts water on it; errors as for `grow`.

    Else there is no use in letting it grow. True as well where there is no room for so many.
    """
    with suppress(ScenarioError):
        no_water = judge.no_water(judge.cities.build(place.lit(base, n_burning)))
        return judge.limits.verdict(no_water.score_share) != "held"
    return True


def grow(base: Scenario, place: FirePlace, counts: Sequence[int], judge: Judge) -> Grown:
    """Let a fire grow at a place until the rules do not hold it any more.

    If it is lost then, numbers that were left out before are tried, halving what is between held and lost.

    Args:
        base: the scenario, but for its fires and civilians.
        place: where.
        counts: numbers of burning buildings to try, rising.
        judge: who says what is held, contested and lost.

    Raises:
        CityError: the city cannot be built.
        Interrupted: the judge's workers were asked to stop.
    """
    held = 0
    for count in counts:
        grown = _judged(base, place, count, judge)
        if grown.verdict != "held":
            break
        held = count
    while held and grown.verdict == "lost" and grown.n_burning - held > 1:
        middle = _judged(base, place, (held + grown.n_burning) // 2, judge)
        if middle.verdict == "held":
            held = middle.n_burning
        else:
            grown = middle
    return grown


def _judged(base: Scenario, place: FirePlace, n_burning: int, judge: Judge) -> Grown:
    try:
        built = judge.cities.build(place.lit(base, n_burning))
    except ScenarioError as error:
        return Grown(place=place, n_burning=n_burning, error=error)
    rules = judge.rules(built)
    verdict = judge.limits.verdict(mean_share(rules))
    return Grown(place=place, n_burning=n_burning, built=built, rules=rules, verdict=verdict)


def usual_counts(n_fires: int, n_inflammable: int) -> list[int]:
    """Return the numbers of burning buildings that are tried unless others are asked for: 1, 2, 3, 4, 6, 8, 12, 16 ...

    Args:
        n_fires: as many burn at least.
        n_inflammable: buildings that can burn.
    """
    few = min(USUAL_MOST_OF_FEW, n_inflammable // SHARE_OF_FEW)
    most = max(n_fires, few, n_inflammable // USUAL_SHARE)
    return sorted({max(n_fires, count) for count in _steps(most)})


def _steps(most: int) -> Iterator[int]:
    count = 1
    while count <= most:
        yield count
        if count >= 2 and count * 3 // 2 <= most:
            yield count * 3 // 2
        count *= 2
