"""Search: find the weights of a ranking of targets by the cross-entropy method, on many fires at once."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from threading import Event
from typing import Any, ClassVar, Final

import numpy as np

from fireworld.draws import WEIGHT
from fireworld.errors import LogError, TrainingError, expected
from fireworld.kernels.arrays import Array
from fireworld.kernels.draws import fill_normals
from fireworld.kernels.ranking import N_OF_TEAM, N_TARGET_FEATURES, N_WEIGHTS
from fireworld.policy.kernel import KernelPolicy, from_rankings
from fireworld.policy.teams.npz import check_arrays, check_finite
from fireworld.policy.teams.ranking_team import RankingTeam
from fireworld.policy.teams.ranking_words import OF_ACTION, OF_BRIGADE, OF_BUILDING, OF_TEAM, WEIGHTS, Weight
from fireworld.policy.teams.team import Team
from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import Curriculum
from fireworld.training.generations import GenerationMethod, GenerationTrainer
from fireworld.training.log.records import Tried
from fireworld.training.method import Count, Positive, PositiveShare, Report

GROUPS: Final[Mapping[str, Sequence[Weight]]] = {
    "the building": OF_BUILDING,
    "the brigade": OF_BRIGADE,
    "the team": OF_TEAM,
    "the action": OF_ACTION,
}
"""The weights by what they are about, in their order."""
HELP: Final = """\
## How to read this

A point for every generation: the mean score of all rankings that were tried in it; that of the best, on the fires by
which they were found to be the best; and how far the rankings of the next generation lie apart.

The team is the mean of the weights. What a weight counts:
"""


@dataclass(frozen=True, kw_only=True)
class Search(GenerationMethod):
    """Search for the weights of a ranking."""

    name: ClassVar[str] = "search"
    curriculum: ClassVar[str] = "contested"

    own_targets: bool = True
    """Brigades go for any burning building of their site, not only for the four that the paper's actions name."""
    cooperation: bool = True
    """Brigades see what the others go for; if not, the weights of that are 0."""
    n_generations: Count = 14
    n_candidates: Count = 48
    """Rankings tried in a generation."""
    n_best: Count = 12
    """Of them, those that the next generation is drawn around."""
    n_fires: Count = 48
    """Fires of the curriculum that each ranking fights in a generation: the same fires, the same random draws."""
    n_steps_max: Count = 150
    """Steps of a fight at most: which fights are lost shows early, and lost ones are the slow ones."""
    step: PositiveShare = 0.8
    """Share of the way that mean and spread move towards those of the best."""
    spread: Positive = 1.0
    """Standard deviation of every weight at first; the means are 0."""
    spread_least: Positive = 0.1
    """What it does not fall below, before the last generation."""

    def __post_init__(self) -> None:
        """Raise TrainingError if a hyperparameter is not what it may be."""
        super().__post_init__()
        if self.n_best > self.n_candidates:
            raise TrainingError(expected("method", "n_best", f"at most n_candidates, {self.n_candidates}", self.n_best))

    def trainer(self, curriculum: Curriculum, *, seed: int, cities: CityCache | None = None) -> SearchTrainer:
        """Return what searches for one team; see `Method.trainer`."""
        return SearchTrainer(curriculum, self, seed=seed, cities=cities)


METHOD: Final = Search()


@dataclass(frozen=True, kw_only=True)
class Generation(Report):
    """What came of one generation."""

    milestone: bool = True
    generation: int
    """From 0."""
    n_generations: int
    """In all."""
    score_mean: float
    """Of all rankings, as a share of the maximum."""
    score_best: float
    """Of the best ones, on the fires by which they were found to be the best."""
    spread: float
    """Mean standard deviation of the weights from now on."""

    @property
    def text(self) -> str:
        """The generation in one line."""
        return (
            f"generation {self.generation + 1} of {self.n_generations}, score {self.score_mean:.3f}, "
            f"of the best {self.score_best:.3f}, spread {self.spread:.2f}"
        )


@dataclass
class Progress:
    """How far a search has come: all that it needs to continue."""

    generation: int
    mean: Array  # (17,) float64
    spread: Array  # (17,) float64


class SearchTrainer(GenerationTrainer[Search, Generation]):
    """Searches for one ranking, a report after every generation; arguments as for `Method.trainer`.

    The scenarios of the curriculum are the fires, whatever their stage.
    """

    report_type: ClassVar[type[Report]] = Generation
    plots: ClassVar[Mapping[str, str]] = {
        "score": "Score, as a share of the maximum",
        "spread": "Spread: mean standard deviation of the weights",
    }
    topics: ClassVar[tuple[type[Any], ...]] = (Tried,)
    whole: ClassVar[type[Any] | None] = Tried

    def __init__(self, curriculum: Curriculum, method: Search, *, seed: int, cities: CityCache | None = None) -> None:
        super().__init__(curriculum, method, seed=seed, cities=cities)
        self._free = self.free_weights()
        self._tried: Tried | None = None
        self.progress = Progress(0, np.zeros(len(self._free)), np.where(self._free, method.spread, 0.0))

    @property
    def generation(self) -> int:
        """How many generations are done."""
        return self.progress.generation

    def team(self) -> RankingTeam:
        """Return what has been found so far: the mean of the distribution that candidates are drawn from."""
        provenance = {**self.identity, "generations_done": self.progress.generation}
        return RankingTeam(self.progress.mean[np.newaxis].copy(), self.method.own_targets, provenance)

    def state(self) -> dict[str, Array]:
        """Return the generation, and the standard deviation of every weight."""
        generation = np.array([self.progress.generation], dtype=np.int64)
        return {"spread": self.progress.spread, "generation": generation}

    def restore(self, team: Team, state: Mapping[str, Array], *, source: str) -> None:
        """Continue where another trainer stood; see `Trainer.restore`."""
        check_arrays(state, "spread", "generation", source=source)
        spread = state["spread"]
        if spread.shape != (N_WEIGHTS,) or spread.dtype != np.float64 or (spread < 0).any():
            wanted = f"{N_WEIGHTS} numbers >= 0"
            raise TrainingError(expected(source, "spread", wanted, f"{spread.dtype} {spread.shape}"))
        check_finite(spread, "spread", source=source)
        generation = self._generation_of(state, source=source)
        if not isinstance(team, RankingTeam):
            raise TrainingError(expected(source, "", RankingTeam.what, team.what))
        self.progress = Progress(generation, team.weights[0].copy(), spread.copy())

    def records(self) -> list[Any]:
        """Return the last generation, with all that was tried in it."""
        return [self._tried]

    def follow(self, part: Mapping[type[Any], Any]) -> Generation:
        """Go through a generation that a training log holds; see `Trainer.follow`."""
        tried: Tried | None = part.get(Tried)
        n_weights = len(self._free)
        if tried is None or len(tried.mean) != n_weights or len(tried.spread) != n_weights:
            raise LogError(f"a part holds no generation with {n_weights} weights")
        return self._end_generation(tried)

    def own_plots(self) -> Mapping[str, str]:
        """Return a plot for every group of weights that are searched for."""
        return {self._plot(group): f"Weights of {group}" for group in self._groups()}

    def points(self, report: Generation) -> Mapping[str, Mapping[str, float]]:
        """Return what is drawn of the last generation."""
        mean = self.progress.mean.tolist()
        return {
            "score": {"all": report.score_mean, "the best": report.score_best},
            "spread": {"": report.spread},
            **{
                self._plot(group): {weight.name: mean[place] for place, weight in members.items()}
                for group, members in self._groups().items()
            },
        }

    def page(self) -> str:
        """Return what the weights come to by now, and what each of them counts."""
        prefers = "\n".join(f"* {sentence}" for sentence in self.team().sentences(row=0))
        members = [weight for group in self._groups().values() for weight in group.values()]
        meanings = "\n".join(f"* **{weight.name}**: {weight.meaning}" for weight in members)
        n = f"{self.progress.generation} of {self.method.n_generations}"
        return f"# Generation {n}\n\n{prefers}\n\n{HELP}\n{meanings}\n"

    def free_weights(self) -> Array:
        """Return which weights are searched for, (17,) bool; the others stay 0."""
        free = np.ones(N_WEIGHTS, dtype=np.bool_)
        if not self.method.cooperation:
            free[N_TARGET_FEATURES - N_OF_TEAM : N_TARGET_FEATURES] = False
        if self.method.own_targets:
            free[N_TARGET_FEATURES:] = False
        return free

    def policy_of(self, numbers: Array) -> KernelPolicy:
        """Return the policy of a team whose brigades all follow these weights, (17,) float64."""
        return from_rankings(numbers[np.newaxis], own_targets=self.method.own_targets)

    def _plot(self, group: str) -> str:
        return f"weights/{group.replace(' ', '-')}"

    def _groups(self) -> Mapping[str, Mapping[int, Weight]]:
        """Return the weights that are searched for, by their place among all, in groups of what they are about."""
        place = {weight.name: k for k, weight in enumerate(WEIGHTS)}
        groups = {
            name: {place[one.name]: one for one in members if self._free[place[one.name]]}
            for name, members in GROUPS.items()
        }
        return {name: members for name, members in groups.items() if members}

    def _generation(self, pool: Executor, stop: Event) -> Generation | None:
        method, progress = self.method, self.progress
        noise = np.zeros((method.n_candidates, len(self._free)))
        fill_normals(self.seed, WEIGHT, progress.generation, noise)
        candidates = progress.mean + progress.spread * noise
        fires = self._draw_fires(range(len(self._fires)), method.n_fires)
        seeds = self._seeds(fires)
        scores = self._scores(pool, stop, candidates, fires, seeds)
        if scores is None:
            return None
        means = [math.fsum(row) / len(fires) for row in scores]  # fsum: the same sum whatever the machine
        best = sorted(range(len(means)), key=lambda k: -means[k])[: method.n_best]
        moved = _moved(progress, candidates[best], method, self._free)
        self._tried = Tried(
            generation=progress.generation,
            score_mean=math.fsum(means) / len(means),
            score_best=math.fsum(means[k] for k in best) / len(best),
            spread_mean=math.fsum(moved.spread[self._free]) / int(self._free.sum()),
            fire=np.array(fires),
            seed=np.array(seeds, dtype=np.uint64),
            weights=candidates.ravel(),
            scores=scores.ravel(),
            best=np.array(best),
            mean=moved.mean,
            spread=moved.spread,
        )
        return self._end_generation(self._tried)

    def _end_generation(self, tried: Tried) -> Generation:
        """Continue with the next generation; return the report of this one."""
        self.progress = Progress(tried.generation + 1, tried.mean.copy(), tried.spread.copy())
        return Generation(
            generation=tried.generation,
            n_generations=self.method.n_generations,
            score_mean=tried.score_mean,
            score_best=tried.score_best,
            spread=tried.spread_mean,
        )


def _moved(progress: Progress, best: Array, method: Search, free: Array) -> Progress:
    """Move mean and spread towards those of the best candidates."""
    n, step = len(best), method.step
    mean, spread = progress.mean.copy(), progress.spread.copy()
    for k in np.flatnonzero(free):
        column: Sequence[float] = best[:, k].tolist()
        center = math.fsum(column) / n
        deviation = math.sqrt(math.fsum((weight - center) ** 2 for weight in column) / n)
        mean[k] = (1.0 - step) * mean[k] + step * center
        spread[k] = max((1.0 - step) * spread[k] + step * deviation, method.spread_least)
    return Progress(progress.generation + 1, mean, spread)
