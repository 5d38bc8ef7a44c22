"""Methods that learn generation by generation: candidates fight the same fires, and the next ones follow from how."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from threading import Event
from typing import Any, ClassVar, TypeVar

import numpy as np

from fireworld.draws import FIRE, hash_key
from fireworld.errors import TrainingError, expected
from fireworld.executors import Workers
from fireworld.kernels.arrays import Array
from fireworld.policy.kernel import KernelPolicy
from fireworld.simulation.built import BuiltScenario, CityCache
from fireworld.simulation.world import World
from fireworld.training.curriculum import Curriculum
from fireworld.training.method import Method, Report, Trainer
from fireworld.training.seeds import fight_seed


class GenerationMethod(Method):
    """A method whose candidates fight the same fires in every generation."""

    @property
    @abstractmethod
    def n_generations(self) -> int:
        """How many there are."""

    @property
    @abstractmethod
    def n_steps_max(self) -> int:
        """Steps of a fight at most."""


AMethod = TypeVar("AMethod", bound=GenerationMethod)
AReport = TypeVar("AReport", bound=Report)


class GenerationTrainer(Trainer[AMethod, AReport]):
    """Trains generation by generation, a report after every one; arguments as for `Method.trainer`.

    The scenarios of the curriculum are the fires.
    """

    unit: ClassVar[str] = "generation"
    uses_workers: ClassVar[bool] = True

    def __init__(self, curriculum: Curriculum, method: AMethod, *, seed: int, cities: CityCache | None = None) -> None:
        super().__init__(curriculum, method, seed=seed)
        self._cities = cities if cities is not None else CityCache()
        self._fires: list[BuiltScenario] = []

    @property
    @abstractmethod
    def generation(self) -> int:
        """How many generations are done: the number of the next one."""

    @abstractmethod
    def policy_of(self, numbers: Array) -> KernelPolicy:
        """Return the policy of a team whose brigades all follow a candidate's numbers."""

    @abstractmethod
    def _generation(self, pool: Executor, stop: Event) -> AReport | None:
        """Go through a generation; None, and all as before it, if the work is to stop."""

    @property
    def share_done(self) -> float:
        """How many of the generations are done."""
        return self.generation / self.method.n_generations

    def run(self, workers: Workers) -> Iterator[AReport]:
        """Train, yielding a report after every generation.

        Args:
            workers: who fights, in threads. When their `stop` is set, the generation under way is left, as if it had
                not begun.
        """
        if not self._fires:
            self._fires = [self._cities.build(scenario) for scenario in self.curriculum.scenarios]
        with workers.make_pool(workers.n) as pool:
            while not self.done and not workers.stop.is_set():
                report = self._generation(pool, workers.stop)
                if report is not None:
                    yield report

    def _draw_fires(self, among: Iterable[int], n: int) -> list[int]:
        """Draw the fires of a generation, without repetition, from these; all of them if they are no more than `n`."""
        return sorted(among, key=lambda fire: hash_key(self.seed, FIRE, fire, self.generation))[:n]

    def _seeds(self, fires: Sequence[int]) -> list[int]:
        """Return the seeds of the fights of a generation, one for each fire."""
        return [fight_seed(self.seed, fire, self.generation) for fire in fires]

    def _scores(
        self,
        pool: Executor,
        stop: Event,
        candidates: Array,
        fires: Sequence[int],
        seeds: Sequence[int],
        *,
        whole: bool = False,
    ) -> Array | None:
        """Let every candidate fight every fire.

        Args:
            pool: who fights.
            stop: set if the work is to stop.
            candidates: (candidates, numbers) float64.
            fires: their numbers.
            seeds: of the random draws on each fire, the same ones for all candidates.
            whole: to the last step of the scenarios, however many that are.

        Returns:
            (candidates, fires) float64, as shares of the maximum; None if the work is to stop.
        """
        fight = self._fight_to_the_end if whole else self._fight
        fights = ((candidate, *fire) for candidate in candidates for fire in zip(fires, seeds, strict=True))
        shares = pool.map(lambda one: math.nan if stop.is_set() else fight(*one), fights)
        scores = np.array(list(shares)).reshape(len(candidates), len(fires))
        return None if np.isnan(scores).any() else scores

    def _fight(self, numbers: Array, fire: int, seed: int) -> float:
        """Return the score of a candidate on a fire, as a share of the maximum, after `n_steps_max` steps at most."""
        return self._score(numbers, self._world(fire, seed))

    def _fight_to_the_end(self, numbers: Array, fire: int, seed: int) -> float:
        """The same, after the last step of the scenario."""
        return self._score(numbers, self._fires[fire].world(seed=seed))

    def _world(self, fire: int, seed: int) -> World:
        """Return a fire that is fought for `n_steps_max` steps at most."""
        built = self._fires[fire]
        return built.world(seed=seed, n_steps_max=min(self.method.n_steps_max, built.scenario.steps))

    def _score(self, numbers: Array, world: World) -> float:
        world.run(self.policy_of(numbers).for_brigades(world.n_brigades))
        return world.outcome.score_share

    def _generation_of(self, state: Mapping[str, Any], *, source: str) -> int:
        """Return how many generations are done by a checkpoint; TrainingError if there are not so many."""
        generation, n = state["generation"], self.method.n_generations
        if generation.shape != (1,) or generation.dtype != np.int64 or not 0 <= generation[0] <= n:
            raise TrainingError(expected(source, "generation", f"a whole number up to {n}", str(generation.tolist())))
        return int(generation[0])
