"""Trials: every team and control on every test of the paper, for `fireworld reproduce`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from fireworld.cli.repetitions import Repetition, random_tables
from fireworld.evaluation import paper
from fireworld.evaluation.runs import Outcomes, evaluate
from fireworld.evaluation.study import FIXED, NO_WATER, RANDOM_TABLES, TEAMS
from fireworld.policy.kernel import KernelPolicy, at_random, from_tables
from fireworld.policy.names import BUILT_IN
from fireworld.scenario import load_scenario
from fireworld.world.stage import Ground, Stage, build_stage


@dataclass(frozen=True)
class Trial:
    """One team on one test: a policy and the seeds it meets."""

    scenario: str
    team: str
    stage: Stage
    policy: KernelPolicy
    seeds: Sequence[int]

    def __call__(self) -> Outcomes:
        """Run all seeds."""
        return evaluate(self.stage, self.policy, self.seeds)


def test_scenarios() -> list[str]:
    """Name the tests of Tables 2 and 3."""
    return [row.scenario for row in (*paper.TABLE_2, *paper.TABLE_3)]


def build_stages(grounds: dict[str, Ground]) -> dict[str, Stage]:
    """Build the tests."""
    return {name: build_stage(load_scenario(name), grounds=grounds) for name in test_scenarios()}


def all_trials(
    stages: Mapping[str, Stage], repetitions: Sequence[Repetition], seeds: Sequence[int], grounds: dict[str, Ground]
) -> list[Trial]:
    """List all trials: a learned or drawn team comes once a repetition, a rule once.

    Args:
        stages: the tests, by name.
        repetitions: the trained teams.
        seeds: of the runs' luck.
        grounds: cities built before.
    """
    policies: dict[str, list[KernelPolicy]] = {
        name: [repetition.teams[name].policy() for repetition in repetitions] for name in repetitions[0].teams
    }
    n_brigades_max = max(len(stage.setup.brigade_refuge) for stage in stages.values())
    policies[RANDOM_TABLES] = [
        from_tables(random_tables(number, n_brigades=n_brigades_max)) for number in range(1, len(repetitions) + 1)
    ]
    policies |= {name: [make()] for name, make in _rules().items()}
    dry = {name: _without_water(stage, grounds) for name, stage in stages.items()}
    return [
        Trial(name, team, dry[name] if team == NO_WATER else stage, policy, seeds)
        for name, stage in stages.items()
        for team in TEAMS
        for policy in policies[team]
    ]


def collect(trials: Sequence[Trial], outcomes: Sequence[Outcomes]) -> dict[str, dict[str, list[Outcomes]]]:
    """Sort outcomes by scenario and team, repetition after repetition."""
    found: dict[str, dict[str, list[Outcomes]]] = {}
    for trial, outcome in zip(trials, outcomes, strict=True):
        found.setdefault(trial.scenario, {}).setdefault(trial.team, []).append(outcome)
    return found


def _rules() -> dict[str, Callable[[], KernelPolicy]]:
    return {"random": at_random, NO_WATER: at_random, **{name: BUILT_IN[name] for name in FIXED}}


def _without_water(stage: Stage, grounds: dict[str, Ground]) -> Stage:
    """Return a test in which the brigades' pumps stand still."""
    scenario = stage.scenario.with_settings({"parameters.brigades.power_litres": "0"})
    return build_stage(scenario, grounds=grounds)
