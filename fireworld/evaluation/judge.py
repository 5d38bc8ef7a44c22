"""Judge: rules that do not learn, and nobody, in one scenario after another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import msgspec

from fireworld.evaluation.contested import Limits
from fireworld.evaluation.runs import evaluate_each
from fireworld.evaluation.scenario_check import NO_WATER, RULES, PolicyResult, ScenarioCheck, policy_result
from fireworld.executors import Workers
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.names import BUILT_IN
from fireworld.scenario import Scenario
from fireworld.simulation.built import BuiltScenario, CityCache

N_POLICIES: Final = len(RULES) + 1


@dataclass(frozen=True)
class Judge:
    """What scenarios are judged with: the same seeds and limits for all of them.

    Attributes:
        seeds: of the runs of every policy.
        limits: between which a fire is contested.
        workers: who makes the runs; Interrupted if they are asked to stop.
        cities: those built so far.
        on_run: called after every run.
    """

    seeds: Sequence[int]
    limits: Limits = field(default_factory=Limits)
    workers: Workers | None = None
    cities: CityCache = field(default_factory=CityCache)
    on_run: Callable[[], object] = lambda: None

    def rules(self, built: BuiltScenario) -> tuple[PolicyResult, ...]:
        """Let the rules play a scenario."""
        return self._results({rule: (built, BUILT_IN[rule]()) for rule in RULES})

    def no_water(self, built: BuiltScenario) -> PolicyResult:
        """Let nobody put water on the fire of a scenario."""
        return self._results({NO_WATER: (_without_water(built), BUILT_IN[RULES[0]]())})[0]

    def check(self, name: str, built: BuiltScenario, rules: tuple[PolicyResult, ...] = ()) -> ScenarioCheck:
        """Let the rules, and nobody, play a scenario.

        Args:
            name: what the scenario is called.
            built: the scenario.
            rules: how the rules came out, if that is known.
        """
        placement = built.placement
        return ScenarioCheck(
            name=name,
            scenario=built.scenario,
            n_buildings=built.city.n_buildings,
            n_burning=len(placement.ignited) + len(placement.later_building),
            rules=rules or self.rules(built),
            no_water=self.no_water(built),
            limits=self.limits,
            seeds=self.seeds,
        )

    def _results(self, measured: dict[str, tuple[BuiltScenario, KernelPolicy]]) -> tuple[PolicyResult, ...]:
        found = evaluate_each([*measured.values()], self.seeds, workers=self.workers, on_run=self.on_run)
        return tuple(policy_result(name, outcomes) for name, outcomes in zip(measured, found, strict=True))


def _without_water(built: BuiltScenario) -> BuiltScenario:
    """Return a scenario whose brigades have no water to put on anything; so it does not matter what they do."""
    scenario: Scenario = built.scenario
    brigades = msgspec.structs.replace(scenario.parameters.brigades, power_litres=0)
    parameters = msgspec.structs.replace(scenario.parameters, brigades=brigades)
    return replace(built, scenario=msgspec.structs.replace(scenario, parameters=parameters))
