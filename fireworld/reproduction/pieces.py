"""The pieces of work of `fireworld reproduce`: each is done once and kept, or found where an earlier call kept it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from threading import Event
from typing import Any

from fireworld import __version__
from fireworld.policy.kernel import KernelPolicy
from fireworld.reproduction.kept import Kept
from fireworld.reproduction.repetitions import InterruptedTraining, Repetition, Training, n_scenarios
from fireworld.reproduction.study import TEAMS
from fireworld.reproduction.trials import RULES, Tested, Tests, rules
from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import Curriculum
from fireworld.training.methods.sarsa import Sarsa


@dataclass(frozen=True, kw_only=True)
class Workshop:
    """Where repetitions are trained and tested; any thread may do a piece."""

    kept: Kept
    curriculum: Curriculum
    method: Sarsa
    n_repetitions: int
    tests: Tests
    cities: CityCache
    stop: Event
    """Set it, and a piece under way raises InterruptedTraining."""
    on_scenario: Callable[[int], object]
    """Called with the number of scenarios of training that are done since the last call."""
    on_trial: Callable[[int], object]
    """Called with the number of tests of a policy that are done since the last call."""

    @property
    def identity(self) -> dict[str, Any]:
        """What decides what comes of the work: equal identities, equal figures."""
        return {
            "repetitions": self.n_repetitions,
            "seeds": [*self.tests.seeds],
            "curriculum": {"name": self.curriculum.name, "digest": self.curriculum.digest},
            "method": self.method.as_dict(),
            "tests": {name: built.scenario.digest for name, built in self.tests.stages.items()},
            "fireworld": __version__,
        }

    @property
    def n_scenarios(self) -> int:
        """Scenarios of training in all."""
        return self.n_repetitions * n_scenarios(self.curriculum)

    @property
    def n_trials(self) -> int:
        """Tests of policies in all."""
        return len(self.tests.stages) * (self.n_repetitions * (len(TEAMS) - len(RULES)) + len(RULES))

    def pieces(self) -> Sequence[Callable[[], tuple[Repetition | None, Tested]]]:
        """List the work: every repetition, then the rules, which are short and fill up the end."""
        repetitions = [lambda number=number: self.repetition(number) for number in range(1, self.n_repetitions + 1)]
        return [*repetitions, lambda: (None, self.rules())]

    def repetition(self, number: int) -> tuple[Repetition, Tested]:
        """Train the teams of a repetition and test them.

        Raises:
            InterruptedTraining: `stop` was set.
            TrainingError: what an earlier call has kept is damaged.
            OutputError: something cannot be kept.
        """
        trained = self.kept.repetition(number)
        if trained is None:
            training = Training(
                curriculum=self.curriculum,
                method=self.method,
                number=number,
                cities=self.cities,
                stop=self.stop,
                on_scenario=lambda: self.on_scenario(1),
                with_graduates=number == 1,  # they are recorded
            )
            trained = training()
            self.kept.keep_repetition(number, trained)
        else:
            self.on_scenario(n_scenarios(self.curriculum))
        learned = [team for team in TEAMS if team not in RULES]
        return trained, self._test(str(number), learned, lambda: self.tests.policies_of(trained, number))

    def rules(self) -> Tested:
        """Test what does not learn; errors as for `repetition`."""
        return self._test("rules", RULES, rules)

    def _test(self, name: str, teams: Sequence[str], policies: Callable[[], dict[str, KernelPolicy]]) -> Tested:
        tested = self.kept.tested(name, scenarios=self.tests.stages, teams=teams, seeds=self.tests.seeds)
        if tested is None:
            tested = self.tests.run(policies(), self._trial_done)
            self.kept.keep_tested(name, tested)
        else:
            self.on_trial(len(tested) * len(teams))
        return tested

    def _trial_done(self) -> None:
        self.on_trial(1)
        if self.stop.is_set():
            raise InterruptedTraining
