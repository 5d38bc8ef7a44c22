"""Every team and control on every test of the paper."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from fireworld.evaluation.runs import Outcomes, evaluate
from fireworld.policy.kernel import KernelPolicy, at_random, from_tables
from fireworld.policy.names import BUILT_IN
from fireworld.reproduction import paper
from fireworld.reproduction.repetitions import Repetition, random_tables
from fireworld.reproduction.study import FIXED, NO_WATER, RANDOM_TABLES, TEAMS
from fireworld.scenario import load_scenario
from fireworld.simulation.built import BuiltScenario, CityCache

RULES: Final = ("random", *FIXED, NO_WATER)
"""Teams that do not differ between repetitions."""
LEARNED: Final = tuple(team for team in TEAMS if team not in RULES)
"""Teams that do."""
Tested = dict[str, dict[str, Outcomes]]
"""Outcomes by scenario and team."""


@dataclass(frozen=True)
class TeamTests:
    """The tests of Tables 2 and 3, built, and the seeds of their runs."""

    built: Mapping[str, BuiltScenario]
    dry: Mapping[str, BuiltScenario]
    """The same without water."""
    seeds: Sequence[int]

    def run(self, policies: Mapping[str, KernelPolicy], on_test: Callable[[], object]) -> Tested:
        """Run every policy in every test under all seeds.

        Args:
            policies: by team.
            on_test: called after every test of a policy; an exception of it ends the work.
        """
        tested: Tested = {}
        for name in self.built:
            for team, policy in policies.items():
                built = (self.dry if team == NO_WATER else self.built)[name]
                tested.setdefault(name, {})[team] = evaluate(built, policy, self.seeds)
                on_test()
        return tested

    def policies_of(self, repetition: Repetition, number: int) -> dict[str, KernelPolicy]:
        """Return what differs between repetitions: the trained teams, and tables drawn at random."""
        n_brigades = max(built.n_brigades for built in self.built.values())
        trained = {name: team.policy() for name, team in repetition.teams.items()}
        return {**trained, RANDOM_TABLES: from_tables(random_tables(number, n_brigades=n_brigades))}


def build_tests(seeds: Sequence[int], cities: CityCache) -> TeamTests:
    """Build the tests, whose runs have these seeds; cities that are built are added to those built before."""
    scenarios = {row.scenario: load_scenario(row.scenario) for row in (*paper.TABLE_2, *paper.TABLE_3)}
    no_water = {"parameters.brigades.power_litres": 0}
    return TeamTests(
        built={name: cities.build(scenario) for name, scenario in scenarios.items()},
        dry={name: cities.build(scenario.with_values(no_water)) for name, scenario in scenarios.items()},
        seeds=seeds,
    )


def rules() -> dict[str, KernelPolicy]:
    """Return the policies that do not differ between repetitions, by team."""
    return {name: at_random() if name in {"random", NO_WATER} else BUILT_IN[name]() for name in RULES}


def collect(of_repetitions: Sequence[Tested], of_rules: Tested) -> dict[str, dict[str, list[Outcomes]]]:
    """Sort outcomes by scenario and team, repetition after repetition; scenarios and teams in their usual order."""
    return {
        name: {
            team: [tested[name][team] for tested in ([of_rules] if team in RULES else of_repetitions)] for team in TEAMS
        }
        for name in of_rules
    }
