"""Search: find the weights of a ranking of targets by the cross-entropy method, on many fires at once."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from threading import Event
from typing import Any, Final

import numpy as np

from fireworld import __version__
from fireworld.draws import EPISODE, FIRE, WEIGHT, hash_key
from fireworld.errors import TrainingError, expected
from fireworld.kernels.arrays import Array
from fireworld.kernels.draws import fill_normals
from fireworld.kernels.ranking import N_OF_TEAM, N_TARGET_FEATURES, N_WEIGHTS
from fireworld.policy.kernel import KernelPolicy, from_rankings
from fireworld.policy.ranking import Ranking
from fireworld.simulation.built import BuiltScenario, CityCache
from fireworld.training.curriculum import Curriculum
from fireworld.training.method import read_figures

SEED_BITS: Final = 32


@dataclass(frozen=True, kw_only=True)
class Search:
    """How weights are searched for."""

    own_targets: bool = True
    """Brigades go for any burning building of their site, not only for the four that the paper's actions name."""
    cooperation: bool = True
    """Brigades see what the others go for; if not, the weights of that are 0."""
    n_generations: int = 14
    n_candidates: int = 48
    """Rankings tried in a generation."""
    n_best: int = 12
    """Of them, those that the next generation is drawn around."""
    n_fires: int = 48
    """Fires of the curriculum that each ranking fights in a generation, all the same ones with the same luck."""
    n_steps_max: int = 150
    """Steps of a fight at most: which fights are lost shows early, and lost ones are the slow ones."""
    step: float = 0.8
    """Share of the way that mean and spread move towards those of the best."""
    spread: float = 1.0
    """Standard deviation of every weight at first; the means are 0."""
    spread_least: float = 0.1
    """What it does not fall below, before the last generation."""

    def __post_init__(self) -> None:
        """Refuse figures that make no search."""
        for name in ("n_generations", "n_candidates", "n_best", "n_fires", "n_steps_max"):
            if not 1 <= getattr(self, name) <= COUNT_MAX:
                raise TrainingError(
                    expected("method", name, f"a whole number from 1 to {COUNT_MAX}", getattr(self, name))
                )
        if self.n_best > self.n_candidates:
            raise TrainingError(expected("method", "n_best", f"at most n_candidates, {self.n_candidates}", self.n_best))
        if not 0.0 < self.step <= 1.0:
            raise TrainingError(expected("method", "step", "a number above 0, at most 1", self.step))
        for name in ("spread", "spread_least"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise TrainingError(expected("method", name, "a number > 0", getattr(self, name)))

    def as_dict(self) -> dict[str, Any]:
        """Return all figures by name."""
        return asdict(self)

    def with_settings(self, settings: Mapping[str, str]) -> Search:
        """Return the search with other figures; as `Method.with_settings`."""
        return replace(self, **read_figures(settings, self))


COUNT_MAX: Final = 1_000_000


@dataclass(frozen=True)
class Generation:
    """What came of one generation."""

    generation: int
    """From 0."""
    score_mean: float
    """Of all rankings, as a share of the maximum."""
    score_best: float
    """Of the best ones, on the fires by which they were found to be the best."""
    spread: float
    """Mean standard deviation of the weights from now on."""


@dataclass
class State:
    """How far a search has come: all that it needs to go on."""

    generation: int
    mean: Array  # (17,) float64
    spread: Array  # (17,) float64


class Searcher:
    """Searches for one ranking. Iterate over it: every generation is done when its report is yielded."""

    def __init__(self, curriculum: Curriculum, search: Search, *, seed: int, cities: CityCache) -> None:
        self.curriculum, self.search, self.seed = curriculum, search, seed
        self._cities = cities
        self._stages: list[BuiltScenario] = []
        self._free = self.free_weights()
        self.state = State(0, np.zeros(len(self._free)), np.where(self._free, search.spread, 0.0))

    @property
    def done(self) -> bool:
        """Whether all generations are done."""
        return self.state.generation >= self.search.n_generations

    def ranking(self) -> Ranking:
        """Return what has been found so far: the mean of the distribution that candidates are drawn from."""
        provenance = {
            "fireworld": __version__,
            "method": {"name": "search", **self.search.as_dict()},
            "seed": self.seed,
            "generations_done": self.state.generation,
            "curriculum": {"name": self.curriculum.name, "digest": self.curriculum.digest},
        }
        return Ranking(self.state.mean[np.newaxis].copy(), self.search.own_targets, provenance)

    def free_weights(self) -> Array:
        """Return which weights are searched for, (17,) bool; the others stay 0."""
        free = np.ones(N_WEIGHTS, dtype=np.bool_)
        if not self.search.cooperation:
            free[N_TARGET_FEATURES - N_OF_TEAM : N_TARGET_FEATURES] = False
        if self.search.own_targets:
            free[N_TARGET_FEATURES:] = False
        return free

    def policy_of(self, weights: Array) -> KernelPolicy:
        """Return the policy of a team whose brigades all follow these weights."""
        return from_rankings(weights[np.newaxis], own_targets=self.search.own_targets)

    def run(self, *, n_threads: int, stop: Event) -> Iterator[Generation]:
        """Search on; leave off within a generation, as if it had not begun, when `stop` is set.

        Args:
            n_threads: fights at a time; the outcome does not depend on it.
            stop: asks to leave off.
        """
        self._build()
        with ThreadPoolExecutor(n_threads) as pool:
            while not self.done and not stop.is_set():
                report = self._generation(pool, stop)
                if report is not None:
                    yield report

    def _build(self) -> None:
        if self._stages:
            return
        steps = str(self.search.n_steps_max)
        scenarios = [scenario for stage in self.curriculum.stages for scenario in stage.scenarios]
        short = [
            one.with_settings({"steps": steps}) if one.steps > self.search.n_steps_max else one for one in scenarios
        ]
        self._stages = [self._cities.build(scenario) for scenario in short]

    def _generation(self, pool: ThreadPoolExecutor, stop: Event) -> Generation | None:
        search, state = self.search, self.state
        candidates = state.mean + state.spread * self._noise()
        fires = self._fires()
        shares = pool.map(
            lambda pair: math.nan if stop.is_set() else self._fight(*pair),
            ((candidate, fire) for candidate in candidates for fire in fires),
        )
        scores = np.array(list(shares)).reshape(len(candidates), len(fires))
        if np.isnan(scores).any():
            return None
        means = [math.fsum(row) / len(fires) for row in scores]  # fsum: the same sum whatever the machine
        best = sorted(range(len(means)), key=lambda k: -means[k])[: search.n_best]
        self.state = _moved(state, candidates[best], search, self._free)
        return Generation(
            generation=state.generation,
            score_mean=math.fsum(means) / len(means),
            score_best=math.fsum(means[k] for k in best) / len(best),
            spread=math.fsum(self.state.spread[self._free]) / int(self._free.sum()),
        )

    def _noise(self) -> Array:
        noise = np.zeros((self.search.n_candidates, len(self._free)))
        fill_normals(self.seed, WEIGHT, self.state.generation, noise)
        return noise

    def _fires(self) -> list[int]:
        """Draw the fires of a generation, without repetition while there are enough."""
        generation = self.state.generation
        order = sorted(range(len(self._stages)), key=lambda fire: hash_key(self.seed, FIRE, fire, generation))
        return order[: self.search.n_fires]

    def _fight(self, weights: Array, fire: int) -> float:
        """Return the score of a ranking on a fire, as a share of the maximum."""
        key = hash_key(self.seed, EPISODE, fire, self.state.generation)
        world = self._stages[fire].world(seed=key >> (64 - SEED_BITS))
        world.run(self.policy_of(weights).for_brigades(world.n_brigades))
        return float(world.state.outcome.score[0] / world.state.outcome.score[1])


def _moved(state: State, best: Array, search: Search, free: Array) -> State:
    """Move mean and spread towards those of the best candidates."""
    n, step = len(best), search.step
    mean, spread = state.mean.copy(), state.spread.copy()
    for k in np.flatnonzero(free):
        column: Sequence[float] = best[:, k].tolist()
        center = math.fsum(column) / n
        deviation = math.sqrt(math.fsum((weight - center) ** 2 for weight in column) / n)
        mean[k] = (1.0 - step) * mean[k] + step * center
        spread[k] = max((1.0 - step) * spread[k] + step * deviation, search.spread_least)
    return State(state.generation + 1, mean, spread)
