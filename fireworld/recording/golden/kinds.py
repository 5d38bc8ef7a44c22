"""Kinds of scenarios: which ways through the simulator the runs of a scenario take."""

from __future__ import annotations

from fireworld.parameters import PRESETS
from fireworld.scenario import Scenario
from fireworld.scenario.document import DIRECTIONS


def scenario_kind(scenario: Scenario) -> str:
    """Return the kind of a scenario in words.

    Scenarios that differ only in places, in numbers of buildings or people, or in random draws are of one kind.
    """
    changed = scenario.resolved_parameters != PRESETS[scenario.preset]
    return ", ".join(
        (
            f"{'generated city' if scenario.city.generated else 'city'} of {scenario.city.summary}",
            f"{scenario.brigades.n} brigades",
            _where_fire_is(scenario),
            _where_people_are(scenario),
            f"choices {scenario.choices}",
            f"reward {scenario.reward if isinstance(scenario.reward, str) else f'{scenario.reward.of} with weights'}",
            f"parameters {scenario.preset}" + (" with changes" if changed else ""),
        )
    )


def _where_fire_is(scenario: Scenario) -> str:
    place = "one place" if len(scenario.fires) == 1 else "several places"
    return f"fire in {place}" + (", by building" if any(fire.buildings for fire in scenario.fires) else "")


def _where_people_are(scenario: Scenario) -> str:
    civilians = scenario.civilians
    if civilians.count == 0:
        return "no civilians"
    if civilians.buildings is not None:
        return "civilians by building"
    return "civilians all around" if set(civilians.directions) == set(DIRECTIONS) else "civilians on some sides"
