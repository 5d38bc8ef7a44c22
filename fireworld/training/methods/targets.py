"""SARSA over the features of targets: a network of their values, learned while fighting many fires. MODEL 9."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Final

import numpy as np

from fireworld.draws import FIRE, WEIGHT, below
from fireworld.errors import LogError, TrainingError, expected
from fireworld.executors import Workers
from fireworld.kernels.arrays import Array, Learner, NetworkArrays
from fireworld.kernels.draws import fill_normals
from fireworld.kernels.situation import N_SEEN
from fireworld.policy.kernel import NO_TABLES, from_network
from fireworld.policy.teams.network_layers import OF_OTHERS, pack, unpack
from fireworld.policy.teams.network_team import NetworkTeam
from fireworld.policy.teams.npz import check_arrays, check_finite
from fireworld.policy.teams.ranking_words import AROUND, OF_BRIGADE, OF_BUILDING, OF_TEAM
from fireworld.policy.teams.team import Team
from fireworld.simulation.built import BuiltScenario, CityCache
from fireworld.simulation.state import fresh_learner, fresh_target_learner
from fireworld.training.curriculum import Curriculum
from fireworld.training.log.records import Lesson
from fireworld.training.method import Count, Limits, Method, Positive, Report, Share, Trainer
from fireworld.training.seeds import fight_seed

HIDDEN_MAX: Final = 256
Hidden = Annotated[int, Limits(f"a whole number from 0 to {HIDDEN_MAX}", 0, HIDDEN_MAX)]
Steps = Annotated[int, Limits("a whole number from 1 to 1000", 1, 1000)]
ACTIVATION: Final = "tanh"
N_LEARNING: Final = 4
"""Brigades that learn at the full rate; of more, each learns less, since all move the same numbers at once."""
NUMBER_MAX: Final = 1e6
"""A network with a greater number does not learn any more; what it needs is below 100."""


@dataclass(frozen=True, kw_only=True)
class Targets(Method):
    """Learning of a network that values targets, one for all brigades."""

    name: ClassVar[str] = "targets"
    curriculum: ClassVar[str] = "contested"

    hidden: Hidden = 16
    """Numbers of the layer between features and value, tanh of weighted sums; 0: the value is one weighted sum."""
    around: bool = True
    """Brigades also see what is around a target: their tank and way, its side and its site."""
    cooperation: bool = True
    """Brigades see what the others go for."""
    n_lessons: Count = 64
    n_fights: Count = 250
    """Fights of a lesson, each with a fire drawn from the curriculum."""
    n_steps_max: Count = 200
    """Steps of a fight at most."""
    alpha: Positive = 0.01
    """Learning rate of the first lesson; it falls to 0 in even steps. Of n > 4 brigades each learns at 4 / n of it."""
    gamma: Share = 0.99
    """Discount of a step."""
    trace_decay: Share = 0.95
    """Lambda: how much of a choice's part in what comes is left from choice to choice, beside the discount."""
    commit: Steps = 4
    """Steps that a choice is kept for while the team learns, as long as its target burns."""
    epsilon_first: Share = 0.3
    """Probability of exploring in the first lesson."""
    epsilon_last: Share = 0.1
    """The same in the last one, with even steps between."""

    @property
    def features(self) -> tuple[str, ...]:
        """What the network reads."""
        seen = (*OF_BUILDING, *OF_BRIGADE, *OF_TEAM, *(AROUND if self.around else ()))
        return tuple(one.name for one in seen if self.cooperation or one.name not in OF_OTHERS)

    def trainer(self, curriculum: Curriculum, *, seed: int, cities: CityCache | None = None) -> TargetsTrainer:
        """Return what trains one team; see `Method.trainer`."""
        return TargetsTrainer(curriculum, self, seed=seed, cities=cities)


METHOD: Final = Targets()


@dataclass(frozen=True, kw_only=True)
class LessonReport(Report):
    """What came of one lesson."""

    milestone: bool = True
    lesson: int
    """From 0."""
    n_lessons: int
    """In all."""
    epsilon: float
    score_mean: float
    """Of its fights, exploration included, as a share of the maximum."""
    error_mean: float
    """Mean size of the last TD error of each brigade in each fight, in percent of the maximal score."""

    @property
    def text(self) -> str:
        """The lesson in one line."""
        return (
            f"lesson {self.lesson + 1} of {self.n_lessons}, epsilon {self.epsilon:.3f}, score {self.score_mean:.3f}, "
            f"TD error {self.error_mean:.2f}"
        )


@dataclass
class Progress:
    """How far a training has come: all that it needs to continue."""

    lesson: int
    numbers: Array
    """(k,) float64, biases and weights of the network, layer by layer."""
    state_weights: Array
    """(30,) float64, what the mean of each feature says of a state."""


class TargetsTrainer(Trainer[Targets, LessonReport]):
    """Trains one network, a report after every lesson; arguments as for `Method.trainer`.

    The scenarios of the curriculum are the fires, whatever their stage.
    """

    report_type: ClassVar[type[Report]] = LessonReport
    unit: ClassVar[str] = "lesson"
    topics: ClassVar[tuple[type[Any], ...]] = (Lesson,)
    whole: ClassVar[type[Any] | None] = Lesson
    plots: ClassVar[Mapping[str, str]] = {
        "score": "Score, as a share of the maximum",
        "epsilon": "Epsilon",
        "error": "Size of the TD errors",
    }

    def __init__(self, curriculum: Curriculum, method: Targets, *, seed: int, cities: CityCache | None = None) -> None:
        super().__init__(curriculum, method, seed=seed)
        self._cities = cities if cities is not None else CityCache()
        self._fires: dict[int, BuiltScenario] = {}
        self._lesson: Lesson | None = None
        self._widths = [len(method.features), *([method.hidden] if method.hidden else []), 1]
        self.progress = Progress(0, self._first_numbers(), np.zeros(N_SEEN))

    @property
    def share_done(self) -> float:
        """How many of the lessons are done."""
        return self.progress.lesson / self.method.n_lessons

    def run(self, workers: Workers) -> Iterator[LessonReport]:
        """Train, yielding a report after every lesson; all in this thread.

        When the `stop` of the workers is set, the lesson under way is left, as if it had not begun.
        """
        while not self.done and not workers.stop.is_set():
            lesson = self._teach(workers)
            if lesson is not None:
                self._lesson = lesson
                yield self._end_lesson(lesson)

    def team(self) -> NetworkTeam:
        """Return the team as it is now."""
        provenance = {**self.identity, "lessons_done": self.progress.lesson}
        layers = unpack(self.progress.numbers, self._widths)
        after = (ACTIVATION,) * (len(layers) - 1)
        return NetworkTeam(layers, after, self.method.features, own_targets=True, provenance=provenance)

    def state(self) -> dict[str, Array]:
        """Return the lesson, and what the means of the features say of a state."""
        lesson = np.array([self.progress.lesson], dtype=np.int64)
        return {"lesson": lesson, "state_weights": self.progress.state_weights}

    def restore(self, team: Team, state: Mapping[str, Array], *, source: str) -> None:
        """Continue where another trainer stood; see `Trainer.restore`."""
        check_arrays(state, "lesson", "state_weights", source=source)
        lesson, weights, n = state["lesson"], state["state_weights"], self.method.n_lessons
        if weights.shape != (N_SEEN,) or weights.dtype != np.float64:
            raise TrainingError(
                expected(source, "state_weights", f"{N_SEEN} numbers", f"{weights.dtype} {weights.shape}")
            )
        check_finite(weights, "state_weights", source=source)
        if lesson.shape != (1,) or lesson.dtype != np.int64 or not 0 <= lesson[0] <= n:
            raise TrainingError(expected(source, "lesson", f"a whole number up to {n}", str(lesson.tolist())))
        if not isinstance(team, NetworkTeam):
            raise TrainingError(expected(source, "", NetworkTeam.what, team.what))
        numbers = pack(team.layers, team.activations, team.features).number
        if team.features != self.method.features or len(numbers) != len(self.progress.numbers):
            wanted = f"a network of {'-'.join(map(str, self._widths))}"
            raise TrainingError(expected(source, "", wanted, team.summary))
        self.progress = Progress(int(lesson[0]), numbers, weights.copy())

    def records(self) -> list[Any]:
        """Return the last lesson."""
        return [self._lesson]

    def follow(self, part: Mapping[type[Any], Any]) -> LessonReport:
        """Go through a lesson that a training log holds; see `Trainer.follow`."""
        lesson: Lesson | None = part.get(Lesson)
        if lesson is None or len(lesson.numbers) != len(self.progress.numbers) or len(lesson.state_weights) != N_SEEN:
            raise LogError(f"a part holds no lesson of {len(self.progress.numbers)} numbers")
        return self._end_lesson(lesson)

    def points(self, report: LessonReport) -> Mapping[str, Mapping[str, float]]:
        """Return what is drawn of the last lesson."""
        return {
            "score": {"": report.score_mean},
            "epsilon": {"": report.epsilon},
            "error": {"": report.error_mean},
        }

    def share_left(self, lesson: int) -> float:
        """Return how much of the training is left when a lesson begins, 1 to 0."""
        return 1.0 - lesson / self.method.n_lessons

    def epsilon(self, lesson: int) -> float:
        """Return the probability of exploring in a lesson."""
        method = self.method
        share = lesson / max(method.n_lessons - 1, 1)
        return method.epsilon_first + share * (method.epsilon_last - method.epsilon_first)

    def _first_numbers(self) -> Array:
        """Return the network before the first lesson: hidden weights drawn, all else 0."""
        n_in, hidden = self._widths[0], self.method.hidden
        if not hidden:
            return np.zeros(n_in + 1)
        drawn = np.zeros((n_in, hidden))
        fill_normals(self.seed, WEIGHT, 0, drawn)
        return np.concatenate([np.zeros(hidden), (drawn / math.sqrt(n_in)).ravel(), np.zeros(1 + hidden)])

    def _fire(self, number: int) -> BuiltScenario:
        """Return a fire of the curriculum."""
        if number not in self._fires:
            self._fires[number] = self._cities.build(self.curriculum.scenarios[number])
        return self._fires[number]

    def _network(self) -> NetworkArrays:
        """Return the network that is learned, a copy."""
        team = self.team()
        return pack(team.layers, team.activations, team.features)

    def _learner(self, network: NetworkArrays, state_weights: Array, n_brigades: int, alpha: float) -> Learner:
        method = self.method
        rate = alpha * min(1.0, N_LEARNING / n_brigades)
        learner = fresh_learner(NO_TABLES, n_brigades, alpha=rate, gamma=method.gamma)
        of_targets = fresh_target_learner(
            network, state_weights, n_brigades, decay=method.trace_decay, commit=method.commit
        )
        return learner._replace(of_targets=of_targets)

    def _teach(self, workers: Workers) -> Lesson | None:
        """Fight the fires of a lesson and learn; None if the work is to stop."""
        method, number, n_fights = self.method, self.progress.lesson, self.method.n_fights
        network, state_weights = self._network(), self.progress.state_weights.copy()
        policy, epsilon = from_network(network, own_targets=True), self.epsilon(number)
        alpha = method.alpha * self.share_left(number)
        fires = [below(self.seed, FIRE, number, k, bound=self.curriculum.n_scenarios) for k in range(n_fights)]
        seeds = [fight_seed(self.seed, number, k) for k in range(n_fights)]
        teams: dict[int, tuple[Any, Learner]] = {}
        scores, errors, lengths = np.zeros(n_fights), np.zeros(n_fights), np.zeros(n_fights, dtype=np.int32)
        for k, (fire, seed) in enumerate(zip(fires, seeds, strict=True)):
            if workers.stop.is_set():
                return None
            built = self._fire(fire)
            world = built.world(seed=seed, n_steps_max=min(method.n_steps_max, built.scenario.steps))
            if world.n_brigades not in teams:
                ready = policy.for_brigades(world.n_brigades)
                ready.epsilon[0] = epsilon
                teams[world.n_brigades] = ready, self._learner(network, state_weights, world.n_brigades, alpha)
            ready, learner = teams[world.n_brigades]
            lengths[k] = world.run(ready, learner)
            scores[k], errors[k] = world.outcome.score_share, math.fsum(np.abs(learner.td_error)) / world.n_brigades
        if not (np.abs(network.number) <= NUMBER_MAX).all():  # nor NaN
            raise TrainingError(f"lesson {number + 1}: the network's numbers grow without end; a smaller alpha helps")
        return Lesson(
            lesson=number,
            epsilon=epsilon,
            alpha=alpha,
            score_mean=math.fsum(scores) / len(scores),
            error_mean=math.fsum(errors) / len(errors),
            fire=np.array(fires),
            seed=np.array(seeds, dtype=np.uint64),
            score=scores,
            n_steps=lengths,
            numbers=network.number,
            state_weights=state_weights,
        )

    def _end_lesson(self, lesson: Lesson) -> LessonReport:
        """Continue with the next lesson; return the report of this one."""
        self.progress = Progress(lesson.lesson + 1, lesson.numbers.copy(), lesson.state_weights.copy())
        return LessonReport(
            lesson=lesson.lesson,
            n_lessons=self.method.n_lessons,
            epsilon=lesson.epsilon,
            score_mean=lesson.score_mean,
            error_mean=lesson.error_mean,
        )
