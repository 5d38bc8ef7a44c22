"""What a reproduction measures: each repetition is trained and tested once, or found where an earlier call left it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, partial
from threading import Event, Lock
from typing import Any

import numpy as np

from fireworld.evaluation.runs import Outcomes, evaluate, row_of
from fireworld.executors import AnyExecutor, in_this_process, workers_for
from fireworld.interrupt import Interrupted
from fireworld.planning.planner import Planner
from fireworld.policy.kernel import KernelPolicy, at_random, from_tables
from fireworld.policy.names import BUILT_IN
from fireworld.policy.protocol import Policy
from fireworld.policy.teams.table_team import TableTeam
from fireworld.policy.words import N_STATES_ALONE
from fireworld.reproduction.folder import ReproductionFolder
from fireworld.reproduction.paper import TESTS, World
from fireworld.reproduction.repetitions import Repetition, n_scenarios, random_tables, train_repetition
from fireworld.reproduction.study import (
    ALONE,
    DIFFERENT_ALONE,
    LEARNED,
    MIXED,
    NO_WATER,
    PLANNER,
    RANDOM_ALONE,
    RANDOM_ALONE_FOR_ALL,
    RANDOM_TABLES,
    RULES,
    TEAMS,
    UNTAUGHT,
    Study,
    Tested,
)
from fireworld.scenario import load_scenario
from fireworld.simulation.built import BuiltScenario, CityCache
from fireworld.training.curriculum import Curriculum
from fireworld.training.methods.sarsa import Sarsa
from fireworld.version import __version__

OnProgress = Callable[[str, int, int], object]
"""Called with what is being done, how many parts of it are done, and how many there are."""

Task = Callable[[], tuple[Repetition | None, Tested]]


class Parts:
    """Counts the parts of some work that are done, in any thread."""

    def __init__(self, what: str, n_all: int, on_progress: OnProgress) -> None:
        self._what, self._n_all, self._on_progress = what, n_all, on_progress
        self._n_done, self._lock = 0, Lock()
        on_progress(what, 0, n_all)

    def done(self, n: int = 1) -> None:
        """Count some more."""
        with self._lock:
            self._n_done += n
            self._on_progress(self._what, self._n_done, self._n_all)


@dataclass(frozen=True)
class Measurement:
    """Trainings and tests; any thread or process may do a part of them. What is done is kept in the folder."""

    folder: ReproductionFolder
    curriculum: Curriculum
    method: Sarsa
    n_repetitions: int
    seeds: Sequence[int]  # of the test runs
    world: World = TESTS
    record_trainings: bool = False  # keep the training logs in the folder
    stop: Event = field(default_factory=Event)  # set it, and a part under way raises Interrupted
    on_progress: OnProgress = lambda *_: None  # called after every scenario of a training and every test of a policy
    cities: CityCache = field(default_factory=CityCache)

    @cached_property
    def tests(self) -> Mapping[str, BuiltScenario]:
        """The tests of Tables 2 and 3, built."""
        names = [row.scenario for row in self.world.tests]
        return {name: self.cities.build(load_scenario(name)) for name in names}

    @cached_property
    def tests_without_water(self) -> Mapping[str, BuiltScenario]:
        """The same, where brigades have no water."""
        dry = {"parameters.brigades.power_litres": 0}
        return {name: self.cities.build(built.scenario.with_values(dry)) for name, built in self.tests.items()}

    @cached_property
    def training_parts(self) -> Parts:
        """Scenarios of training that are done."""
        return Parts("training", self.n_repetitions * n_scenarios(self.curriculum), self.on_progress)

    @cached_property
    def testing_parts(self) -> Parts:
        """Tests of policies that are done."""
        n_policies = self.n_repetitions * (len(LEARNED) + len(MIXED)) + len(UNTAUGHT)
        return Parts("testing", len(self.tests) * n_policies, self.on_progress)

    @property
    def identity(self) -> dict[str, Any]:
        """What decides the outcome: equal identities, equal tables."""
        return {
            "repetitions": self.n_repetitions,
            "seeds": [*self.seeds],
            "curriculum": {"name": self.curriculum.name, "digest": self.curriculum.digest},
            "method": self.method.as_dict(),
            "record_trainings": self.record_trainings,
            "tests": {name: built.scenario.digest for name, built in self.tests.items()},
            "fireworld": __version__,
        }

    def run(self, executor: AnyExecutor) -> tuple[Study, Repetition]:
        """Train and test all repetitions; return what was measured, and the first repetition.

        Raises:
            Interrupted: `stop` was set.
            TrainingError: what an earlier call has written is damaged.
            OutputError: something cannot be written.
            ExecutorError: a process died.
        """
        training, testing = self.training_parts, self.testing_parts

        def on_result(_: int, result: tuple[Repetition | None, Tested]) -> None:
            if not in_this_process(executor):  # the parts were done where nobody counts
                training.done(n_scenarios(self.curriculum) if result[0] else 0)
                testing.done(sum(map(len, result[1].values())))

        repeat: list[Task] = [partial(self.repetition, number + 1) for number in range(self.n_repetitions)]
        tasks = [*repeat, self.rules]  # the rules are short and fill up the end
        workers = workers_for(executor, stop=self.stop)
        done = workers.run(tasks, on_result)
        if done is None:
            raise Interrupted("interrupted")
        repetitions = [repetition for repetition, _ in done if repetition is not None]
        *of_repetitions, of_rules = (tested for _, tested in done)
        alone = [repetition.teams[ALONE] for repetition in repetitions]
        more: list[Task] = [partial(self.planner, test) for test in self.tests]
        more += [partial(self.controls, n + 1, [*alone[n:], *alone[:n]]) for n in range(len(alone))]
        done = workers.run(more, on_result)
        if done is None:
            raise Interrupted("interrupted")
        found = [tested for _, tested in done]
        of_untaught = {test: {**of_rules[test], **found[n][test]} for n, test in enumerate(self.tests)}
        of_each = [
            {test: {**tested[test], **controls[test]} for test in tested}
            for tested, controls in zip(of_repetitions, found[len(self.tests) :], strict=True)
        ]
        study = Study(
            world=self.world,
            n_repetitions=self.n_repetitions,
            seeds=self.seeds,
            curves=[curve for repetition in repetitions for curve in repetition.curves],
            outcomes={
                test: {
                    team: [tested[test][team] for tested in ([of_untaught] if team in UNTAUGHT else of_each)]
                    for team in TEAMS
                }
                for test in of_rules
            },
            agreement=[repetition.agreement for repetition in repetitions],
        )
        return study, repetitions[0]

    def repetition(self, number: int) -> tuple[Repetition | None, Tested]:
        """Train the teams of a repetition and test them; errors as for `run`."""
        trained = self.folder.repetition(number)
        if trained is None:
            trained = train_repetition(
                self.curriculum,
                self.method,
                number,
                cities=self.cities,
                stop=self.stop,
                on_scenario=self.training_parts.done,
                with_graduates=number == 1,  # they are recorded
                logs=self.folder.logs(number) if self.record_trainings else None,
            )
            self.folder.write_repetition(number, trained)
        else:
            self.training_parts.done(n_scenarios(self.curriculum))

        def policies() -> dict[str, Policy]:
            tables = random_tables(number, n_brigades=self.n_brigades_max)
            return {**{name: team.policy() for name, team in trained.teams.items()}, RANDOM_TABLES: from_tables(tables)}

        return trained, self._test(str(number), LEARNED, policies)

    def rules(self) -> tuple[Repetition | None, Tested]:
        """Test what does not learn; errors as for `run`."""
        made = {**BUILT_IN, NO_WATER: at_random}
        return None, self._test("rules", RULES, lambda: {name: made[name]() for name in RULES})

    def planner(self, test: str) -> tuple[Repetition | None, Tested]:
        """Run the planner in a test; errors as for `run`."""
        return None, self._test(f"{PLANNER}-{test}", (PLANNER,), lambda: {PLANNER: Planner()}, tests=[test])

    def controls(self, number: int, teams: Sequence[TableTeam]) -> tuple[Repetition | None, Tested]:
        """Test the controls of a repetition that need no training of their own; errors as for `run`.

        Args:
            number: of the repetition.
            teams: the non-cooperative ones of all repetitions, this one's first: a brigade for each table, in turn.
        """
        different = np.concatenate([team.tables for team in teams[: self.n_brigades_max]])
        tables = random_tables(number, n_brigades=self.n_brigades_max, n_states=N_STATES_ALONE)
        made = {DIFFERENT_ALONE: different, RANDOM_ALONE_FOR_ALL: tables[:1], RANDOM_ALONE: tables}
        return None, self._test(f"controls-{number}", MIXED, lambda: {name: from_tables(made[name]) for name in MIXED})

    @property
    def n_brigades_max(self) -> int:
        """Brigades of the largest team that is tested."""
        return max(built.n_brigades for built in self.tests.values())

    def __reduce__(self) -> tuple[Any, ...]:
        """Send what decides the outcome; another process builds tests and cities once."""
        settings = (self.n_repetitions, self.seeds, self.world, self.record_trainings)
        return _received, (self.folder, self.curriculum, self.method, *settings)

    def _test(
        self,
        name: str,
        teams: Sequence[str],
        policies: Callable[[], Mapping[str, Policy]],
        *,
        tests: Sequence[str] | None = None,
    ) -> Tested:
        """Run every policy in every test under all seeds, unless the outcomes are kept under this name."""
        names = [*self.tests] if tests is None else tests
        tested = self.folder.tested(name, scenarios=names, teams=teams, seeds=self.seeds)
        if tested is not None:
            self.testing_parts.done(len(tested) * len(teams))
            return tested
        tested, by_team = {}, policies()
        for test in names:
            tested[test] = {}
            for team, policy in by_team.items():
                built = (self.tests_without_water if team == NO_WATER else self.tests)[test]
                tested[test][team] = self._outcomes(built, policy)
                self.testing_parts.done()
                if self.stop.is_set():
                    raise Interrupted("interrupted")
        self.folder.write_tested(name, tested)
        return tested

    def _outcomes(self, built: BuiltScenario, policy: Policy) -> Outcomes:
        """Run a policy under all seeds."""
        if isinstance(policy, KernelPolicy):
            return evaluate(built, policy, self.seeds)
        rows = []
        for seed in self.seeds:
            world = built.world(seed=seed)
            policy.begin(world.city_arrays, world.n_brigades, seed)
            while not (world.terminated or world.truncated):
                world.step(policy)
                if self.stop.is_set():
                    raise Interrupted("interrupted")
            rows.append(row_of(world.outcome))
        return Outcomes(self.seeds, rows)


@lru_cache(maxsize=1)
def _received(*values: Any) -> Measurement:
    return Measurement(*values)
