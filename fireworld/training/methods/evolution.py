"""Evolution: improve a network that values targets by an evolution strategy, on fires of many conditions. MODEL 10."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from threading import Event
from typing import Annotated, Any, ClassVar, Final, Literal

import numpy as np

from fireworld.draws import WEIGHT
from fireworld.errors import LogError
from fireworld.kernels.arrays import Array
from fireworld.kernels.draws import fill_normals
from fireworld.policy.teams.team import Team
from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import Curriculum
from fireworld.training.log.records import Evolved
from fireworld.training.method import Count, Limits, Positive, Report
from fireworld.training.networks import Hidden, LayeredMethod, NetworkMethod, NetworkTrainer

Momentum = Annotated[float, Limits("a number from 0, below 1", 0.0, math.nextafter(1.0, 0.0))]


@dataclass(frozen=True, kw_only=True)
class EvolutionStrategy(NetworkMethod):
    """An evolution strategy for the numbers of a network."""

    curriculum: ClassVar[str] = "conditions"

    start: Literal["best-2026", "none"] = "best-2026"
    """The network before the first generation: it values targets as the ranking `best-2026`, or all of them 0."""
    n_generations: Count = 150
    n_pairs: Count = 24
    """Pairs of candidates of a generation: the mean plus and minus the same noise."""
    n_fires: Count = 45
    """Fires that each candidate fights in a generation, spread evenly over the stages of the curriculum."""
    n_steps_max: Count = 400
    """Steps of a fight at most; those of the checks are as long as the scenarios."""
    noise: Positive = 0.1
    """Standard deviation of the noise, of every number of the network."""
    rate: Positive = 0.5
    """Length of the move for a direction of length 1."""
    momentum: Momentum = 0.9
    """Share of the direction that is left from generation to generation."""
    check_every: Count = 5
    """Generations from one check of the mean on all fires to the next; the best mean that was checked is the team."""

    @abstractmethod
    def drop_idle(self, noise: Array) -> None:
        """Take out of noise, (pairs, k) float64, what changes no choice, so that the mean does not drift by it."""

    def trainer(self, curriculum: Curriculum, *, seed: int, cities: CityCache | None = None) -> EvolutionTrainer:
        """Return what trains one team; see `Method.trainer`."""
        return EvolutionTrainer(curriculum, self, seed=seed, cities=cities)


@dataclass(frozen=True, kw_only=True)
class Evolution(EvolutionStrategy, LayeredMethod):
    """Evolution of a network that values targets."""

    name: ClassVar[str] = "evolution"

    hidden: Hidden = 12
    """Numbers of the layer between features and value, relu; 0: the value is one weighted sum."""

    def drop_idle(self, noise: Array) -> None:
        """Take out the noise of the last bias, which all targets get alike."""
        noise[:, -1 - self.widths[-2]] = 0.0


METHOD: Final = Evolution()


@dataclass(frozen=True, kw_only=True)
class Generation(Report):
    """What came of one generation."""

    milestone: bool = True
    generation: int
    """From 0."""
    n_generations: int
    """In all."""
    score_mean: float
    """Of all candidates, as a share of the maximum; all conditions count equally."""
    score_best: float
    """Of the best candidate."""
    score_checked: float
    """Of the mean on all fires, when it was last checked."""
    score_kept: float
    """The best of those: that of the team."""

    @property
    def text(self) -> str:
        """The generation in one line."""
        return (
            f"generation {self.generation + 1} of {self.n_generations}, score {self.score_mean:.3f}, of the best "
            f"{self.score_best:.3f}, on all fires {self.score_checked:.3f}, of the team {self.score_kept:.3f}"
        )


@dataclass
class Progress:
    """How far an evolution has come: all that it needs to continue. Networks are (k,) numbers."""

    generation: int
    mean: Array
    """(k,) float64, what candidates are drawn around."""
    direction: Array
    """(k,) float64, in which the mean moves."""
    kept: Array
    """(k,) float64, the best mean that was checked: the team."""
    score_checked: float = 0.0
    score_kept: float = 0.0


class EvolutionTrainer(NetworkTrainer[EvolutionStrategy, Generation]):
    """Evolves one network, a report after every generation; arguments as for `Method.trainer`.

    The stages of the curriculum are the conditions; all of them count equally.
    """

    report_type: ClassVar[type[Report]] = Generation
    plots: ClassVar[Mapping[str, str]] = {
        "score": "Score, as a share of the maximum",
        "check": "Score of the mean on all fires",
    }
    topics: ClassVar[tuple[type[Any], ...]] = (Evolved,)
    whole: ClassVar[type[Any] | None] = Evolved

    def __init__(
        self, curriculum: Curriculum, method: EvolutionStrategy, *, seed: int, cities: CityCache | None = None
    ) -> None:
        super().__init__(curriculum, method, seed=seed, cities=cities)
        self._evolved: Evolved | None = None
        self.progress = Progress(0, self._first, np.zeros(len(self._first)), self._first)

    @property
    def generation(self) -> int:
        """How many generations are done."""
        return self.progress.generation

    @property
    def kept(self) -> Array:
        """The numbers of the best mean that was checked."""
        return self.progress.kept

    def state(self) -> dict[str, Array]:
        """Return the generation, the mean, the direction of its moves, and the scores of the checks."""
        progress = self.progress
        return {
            "generation": np.array([progress.generation], dtype=np.int64),
            "mean": progress.mean,
            "direction": progress.direction,
            "checks": np.array([progress.score_checked, progress.score_kept]),
            **self._kept_state(),
        }

    def restore(self, team: Team, state: Mapping[str, Array], *, source: str) -> None:
        """Continue where another trainer stood; see `Trainer.restore`."""
        n = len(self.progress.mean)
        kept = self._kept_of(team, state, ("mean", n), ("direction", n), ("checks", 2), source=source)
        generation = self._generation_of(state, source=source)
        checked, best = state["checks"].tolist()
        self.progress = Progress(generation, state["mean"].copy(), state["direction"].copy(), kept, checked, best)

    def records(self) -> list[Any]:
        """Return the last generation."""
        return [self._evolved]

    def follow(self, part: Mapping[type[Any], Any]) -> Generation:
        """Go through a generation that a training log holds; see `Trainer.follow`."""
        evolved: Evolved | None = part.get(Evolved)
        n = len(self.progress.mean)
        if evolved is None or {*map(len, (evolved.mean, evolved.direction, evolved.kept))} != {n}:
            raise LogError(f"a part holds no generation of networks of {n} numbers")
        return self._end_generation(evolved)

    def points(self, report: Generation) -> Mapping[str, Mapping[str, float]]:
        """Return what is drawn of the last generation."""
        conditions = {"conditions": self._score_by_condition()} if len(self._conditions) > 1 else {}
        return {
            "score": {"all": report.score_mean, "the best": report.score_best},
            "check": {"last": report.score_checked, "of the team": report.score_kept},
            **conditions,
        }

    def candidates(self) -> tuple[Array, Array]:
        """Return the noise of each pair in this generation, (pairs, k), and its candidates, (2 pairs, k) float64.

        The first half is the mean plus the noise, the second half the mean minus it.
        """
        method, mean = self.method, self.progress.mean
        noise = np.zeros((method.n_pairs, len(mean)))
        fill_normals(self.seed, WEIGHT, self.generation, noise)
        method.drop_idle(noise)
        return noise, np.concatenate([mean + method.noise * noise, mean - method.noise * noise])

    def _generation(self, pool: Executor, stop: Event) -> Generation | None:
        """Let all candidates fight, move the mean, and check it if it is time."""
        method, progress = self.method, self.progress
        noise, candidates = self.candidates()
        fires = self._fires_of_generation()
        seeds = self._seeds(fires)
        scores = self._scores(pool, stop, candidates, fires, seeds)
        if scores is None:
            return None
        means = [self._mean(row, fires) for row in scores.tolist()]
        moved = _moved(progress, noise, centred_ranks(means), method)
        checked = self._checked(pool, stop, progress, moved)
        if checked is None:
            return None
        evolved = Evolved(
            generation=progress.generation,
            score_mean=math.fsum(means) / len(means),
            score_best=max(means),
            score_checked=checked.score_checked,
            score_kept=checked.score_kept,
            fire=np.array(fires),
            seed=np.array(seeds, dtype=np.uint64),
            scores=scores.ravel(),
            mean=checked.mean,
            direction=checked.direction,
            kept=checked.kept,
        )
        return self._end_generation(evolved)

    def _end_generation(self, evolved: Evolved) -> Generation:
        """Continue with the next generation; return the report of this one."""
        self._evolved = evolved
        self.progress = Progress(
            evolved.generation + 1,
            evolved.mean.copy(),
            evolved.direction.copy(),
            evolved.kept.copy(),
            evolved.score_checked,
            evolved.score_kept,
        )
        return Generation(
            generation=evolved.generation,
            n_generations=self.method.n_generations,
            score_mean=evolved.score_mean,
            score_best=evolved.score_best,
            score_checked=evolved.score_checked,
            score_kept=evolved.score_kept,
        )

    def _checked(self, pool: Executor, stop: Event, before: Progress, moved: Progress) -> Progress | None:
        """Return the progress with what the checks say that are due; None if the work is to stop.

        Before the first generation what it starts with is checked; then every so many generations, and after the last.
        """
        found, method = moved, self.method
        first = before.generation == 0
        due = moved.generation % method.check_every == 0 or moved.generation == method.n_generations
        for numbers in [*([before.mean] if first else []), *([moved.mean] if due else [])]:
            score = self._score_on_all(pool, stop, numbers)
            if score is None:
                return None
            found = replace(found, score_checked=score)
            if numbers is before.mean or score > found.score_kept:
                found = replace(found, score_kept=score, kept=numbers)
        return found

    def _fires_of_generation(self) -> list[int]:
        """Draw as many fires of each condition; those that are left over go to one condition after another in turn."""
        n = len(self._conditions)
        each, left = divmod(self.method.n_fires, n)
        fires = list[int]()
        for place, among in enumerate(self._conditions.values()):
            turn = (place - self.generation * left) % n
            fires += self._draw_fires(among, each + (1 if turn < left else 0))
        return fires

    def _score_by_condition(self) -> dict[str, float]:
        """Return the mean score of all candidates of the last generation in each condition that they fought in."""
        evolved = self._evolved
        if evolved is None:
            return {}
        scores = evolved.scores.reshape(-1, len(evolved.fire))
        of_fires = [math.fsum(column) / len(column) for column in scores.T.tolist()]
        return self._by_condition(of_fires, evolved.fire.tolist())


def centred_ranks(scores: Sequence[float]) -> list[float]:
    """Return the ranks of some scores, from -0.5 for the least to 0.5 for the greatest; equal ones share theirs."""
    order = sorted(scores)
    places: dict[float, list[int]] = {}
    for place, score in enumerate(order):
        places.setdefault(score, []).append(place)
    most = max(len(scores) - 1, 1)
    return [(places[score][0] + places[score][-1]) / (2 * most) - 0.5 for score in scores]


def _moved(progress: Progress, noise: Array, ranks: Sequence[float], method: EvolutionStrategy) -> Progress:
    """Move the mean: in the direction of the noise of candidates that fared better than their opposites. MODEL 10."""
    n = method.n_pairs
    worth = [(ranks[k] - ranks[n + k]) / n for k in range(n)]
    weighted = np.array(worth)[:, np.newaxis] * noise
    new = np.array([math.fsum(column) for column in weighted.T.tolist()])  # fsum: the same sum whatever the machine
    direction = method.momentum * progress.direction + (1.0 - method.momentum) * new
    mean = progress.mean + method.rate * direction
    return replace(progress, generation=progress.generation + 1, mean=mean, direction=direction)
