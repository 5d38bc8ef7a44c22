"""What a reproduction measures: each repetition is trained and tested once, or found where an earlier call left it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, partial
from threading import Event, Lock
from typing import Any

from fireworld.executors import AnyExecutor, in_this_process, workers_for
from fireworld.interrupt import Interrupted
from fireworld.policy.kernel import KernelPolicy
from fireworld.reproduction.folder import ReproductionFolder
from fireworld.reproduction.repetitions import Repetition, RepetitionTraining, n_scenarios
from fireworld.reproduction.study import Study
from fireworld.reproduction.team_tests import LEARNED, RULES, TeamTests, Tested, build_tests, collect, rules
from fireworld.simulation.built import CityCache
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
    """Trainings and tests; any thread or process may do a part of them.

    Attributes:
        folder: where what is done is kept.
        curriculum: of the trainings.
        method: of the trainings.
        n_repetitions: trainings.
        seeds: of the test runs.
        stop: set it, and a part under way raises Interrupted.
        on_progress: called after every scenario of a training ("training") and every test of a policy ("testing").
        cities: cities built before; added to.
    """

    folder: ReproductionFolder
    curriculum: Curriculum
    method: Sarsa
    n_repetitions: int
    seeds: Sequence[int]
    stop: Event = field(default_factory=Event)
    on_progress: OnProgress = lambda *_: None
    cities: CityCache = field(default_factory=CityCache)

    @cached_property
    def tests(self) -> TeamTests:
        """The tests, built."""
        return build_tests(self.seeds, self.cities)

    @cached_property
    def training_parts(self) -> Parts:
        """Scenarios of training that are done."""
        return Parts("training", self.n_repetitions * n_scenarios(self.curriculum), self.on_progress)

    @cached_property
    def testing_parts(self) -> Parts:
        """Tests of policies that are done."""
        n_policies = self.n_repetitions * len(LEARNED) + len(RULES)
        return Parts("testing", len(self.tests.built) * n_policies, self.on_progress)

    @property
    def identity(self) -> dict[str, Any]:
        """What decides the outcome: equal identities, equal tables."""
        return {
            "repetitions": self.n_repetitions,
            "seeds": [*self.seeds],
            "curriculum": {"name": self.curriculum.name, "digest": self.curriculum.digest},
            "method": self.method.as_dict(),
            "tests": {name: built.scenario.digest for name, built in self.tests.built.items()},
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
        training, testing, per_policy = self.training_parts, self.testing_parts, len(self.tests.built)

        def on_result(_: int, result: tuple[Repetition | None, Tested]) -> None:
            if not in_this_process(executor):  # the parts were done where nobody counts
                training.done(n_scenarios(self.curriculum) if result[0] else 0)
                testing.done(per_policy * len(LEARNED if result[0] else RULES))

        repeat: list[Task] = [partial(self.repetition, number + 1) for number in range(self.n_repetitions)]
        tasks = [*repeat, self.rules]  # the rules are short and fill up the end
        done = workers_for(executor, stop=self.stop).run(tasks, on_result)
        if done is None:
            raise Interrupted("interrupted")
        repetitions = [repetition for repetition, _ in done if repetition is not None]
        *of_repetitions, of_rules = (tested for _, tested in done)
        study = Study(
            n_repetitions=self.n_repetitions,
            seeds=self.seeds,
            curves=[curve for repetition in repetitions for curve in repetition.curves],
            outcomes=collect(of_repetitions, of_rules),
            agreement=[repetition.agreement for repetition in repetitions],
        )
        return study, repetitions[0]

    def repetition(self, number: int) -> tuple[Repetition | None, Tested]:
        """Train the teams of a repetition and test them; errors as for `run`."""
        trained = self.folder.repetition(number)
        if trained is None:
            training = RepetitionTraining(
                curriculum=self.curriculum,
                method=self.method,
                number=number,
                cities=self.cities,
                stop=self.stop,
                on_scenario=self.training_parts.done,
                with_graduates=number == 1,  # they are recorded
            )
            trained = training()
            self.folder.write_repetition(number, trained)
        else:
            self.training_parts.done(n_scenarios(self.curriculum))
        return trained, self._test(str(number), LEARNED, lambda: self.tests.policies_of(trained, number))

    def rules(self) -> tuple[Repetition | None, Tested]:
        """Test what does not learn; errors as for `run`."""
        return None, self._test("rules", RULES, rules)

    def __reduce__(self) -> tuple[Any, ...]:
        """Send what decides the outcome; another process builds tests and cities once."""
        return _received, (self.folder, self.curriculum, self.method, self.n_repetitions, self.seeds)

    def _test(self, name: str, teams: Sequence[str], policies: Callable[[], dict[str, KernelPolicy]]) -> Tested:
        tested = self.folder.tested(name, scenarios=self.tests.built, teams=teams, seeds=self.seeds)
        if tested is None:
            tested = self.tests.run(policies(), self._on_test)
            self.folder.write_tested(name, tested)
        else:
            self.testing_parts.done(len(tested) * len(teams))
        return tested

    def _on_test(self) -> None:
        self.testing_parts.done()
        if self.stop.is_set():
            raise Interrupted("interrupted")


@lru_cache(maxsize=1)
def _received(*values: Any) -> Measurement:
    return Measurement(*values)
