"""What methods share that improve a network by decisions whose options were tried out, under many conditions."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from itertools import pairwise
from threading import Event
from typing import Any, ClassVar, TypeVar

import numpy as np

from fireworld.draws import FIRE, SHUFFLE, hash_key
from fireworld.errors import LogError, TrainingError, expected
from fireworld.kernels.arrays import Array, NetworkArrays
from fireworld.kernels.fitting import Fitting, fit_once, gain
from fireworld.kernels.network import widest
from fireworld.kernels.situation import N_SEEN
from fireworld.policy.teams.network_layers import WIDTH_MAX, Layer, mean_of_networks, unpack
from fireworld.policy.teams.team import Team
from fireworld.simulation.built import CityCache
from fireworld.simulation.state import fresh_target_learner
from fireworld.simulation.world import World
from fireworld.training.curriculum import Curriculum
from fireworld.training.log.records import Improved
from fireworld.training.method import Report
from fireworld.training.networks import LayeredMethod, NetworkTrainer
from fireworld.training.options import TriedDecision
from fireworld.training.seeds import fight_seed


class DecisionMethod(LayeredMethod):
    """A method that improves a network by decisions whose options were tried out; the team is a mean of networks."""

    is_packed: ClassVar[bool] = False

    @property
    @abstractmethod
    def n_averaged(self) -> int:
        """Networks that the team is the mean of: those after the last generations, and the first one before them."""

    @property
    @abstractmethod
    def n_fights(self) -> int:
        """Fights of a generation, the conditions in turn."""

    @property
    @abstractmethod
    def n_options(self) -> int:
        """Options of a decision at most."""

    @property
    @abstractmethod
    def n_epochs(self) -> int:
        """How often the network goes through the decisions of a generation."""

    @property
    @abstractmethod
    def n_batch(self) -> int:
        """Decisions between two moves of the network."""

    @property
    @abstractmethod
    def rate(self) -> float:
        """Length of a move, of every number (Adam)."""

    @property
    @abstractmethod
    def temperature(self) -> float:
        """Differences of values that decide, while the network learns, how probable an option is."""

    def __post_init__(self) -> None:
        """Raise TrainingError if a hyperparameter is not what it may be."""
        super().__post_init__()
        if self.hidden * self.n_averaged > WIDTH_MAX:
            wanted = f"at most {WIDTH_MAX // self.hidden} (with {self.hidden} hidden)"
            raise TrainingError(expected("method", "n_averaged", wanted, self.n_averaged))

    @property
    def widths(self) -> tuple[int, ...]:
        """Of the team: the features, the hidden layers of all networks side by side if there are any, the value."""
        n_in, *hidden, n_out = super().widths
        return (n_in, *(n * self.n_averaged for n in hidden), n_out)

    def layers_of(self, numbers: Array) -> tuple[Layer, ...]:
        """Return the layers of a network by its numbers, or of the mean of several by theirs, one after another.

        The mean of networks is one, whose hidden layer has the units of all.
        """
        widths = super().widths
        n_numbers = sum(n_out * (1 + n_in) for n_in, n_out in pairwise(widths))
        return mean_of_networks([unpack(one, widths) for one in numbers.reshape(-1, n_numbers)])


AMethod = TypeVar("AMethod", bound=DecisionMethod)


def fresh_fitting(network: NetworkArrays, n_options: int) -> Fitting:
    """Return what the fitting of a network begins with, for decisions of so many options at most."""
    k = len(network.number)
    return Fitting(
        gradient=np.zeros(k),
        mean=np.zeros(k),
        square=np.zeros(k),
        left=np.ones(2),
        share=np.zeros(n_options),
        work=np.zeros((2, widest(network))),
        learner=fresh_target_learner(network, np.zeros(0), 0, decay=0.0, commit=1),
    )


@dataclass(frozen=True, kw_only=True)
class Generation(Report):
    """What came of one generation."""

    milestone: bool = True
    generation: int
    """From 0."""
    n_generations: int
    """In all."""
    score_mean: float
    """Of its fights, as a share of the maximum; all conditions count equally."""
    n_decisions: int
    """Whose options were tried."""
    gain: float
    """How much more rollouts came to after what the network prefers now, on the mean of these decisions."""
    score_checked: float
    """Of the team on all fires."""

    @property
    def text(self) -> str:
        """The generation in one line."""
        return (
            f"generation {self.generation + 1} of {self.n_generations}, score {self.score_mean:.3f}, "
            f"{self.n_decisions:,} decisions, gain {self.gain:.5f}, of the team on all fires {self.score_checked:.3f}"
        )


@dataclass
class Progress:
    """How far a training has come: all that it needs to continue."""

    generation: int
    networks: Array
    """(averaged, k) float64, the networks that the team is the mean of; the fights of the last one come next."""
    score_checked: float = 0.0


class DecisionTrainer(NetworkTrainer[AMethod, Generation]):
    """Improves one network, a report after every generation; arguments as for `Method.trainer`."""

    report_type: ClassVar[type[Report]] = Generation
    plots: ClassVar[Mapping[str, str]] = {
        "score": "Score of the fights, as a share of the maximum",
        "gain": "What the network gains on its decisions",
        "check": "Score of the team on all fires",
    }
    topics: ClassVar[tuple[type[Any], ...]] = (Improved,)
    whole: ClassVar[type[Any] | None] = Improved

    def __init__(self, curriculum: Curriculum, method: AMethod, *, seed: int, cities: CityCache | None = None) -> None:
        super().__init__(curriculum, method, seed=seed, cities=cities)
        self._improved: Improved | None = None
        self.progress = Progress(0, np.repeat(self._first[np.newaxis], method.n_averaged, axis=0))

    @abstractmethod
    def _tried_in(self, world: World, stop: Event) -> list[TriedDecision]:
        """Fight to the end in a world, and return the decisions whose options were tried out on the way."""

    @property
    def generation(self) -> int:
        """How many generations are done."""
        return self.progress.generation

    @property
    def newest(self) -> Array:
        """The network whose fights come next, (k,) float64."""
        newest: Array = self.progress.networks[-1]
        return newest

    @property
    def kept(self) -> Array:
        """The networks that the team is the mean of, one after another."""
        return self.progress.networks.ravel()

    def state(self) -> dict[str, Array]:
        """Return the generation, the networks, and the score of the last check."""
        generation = np.array([self.generation], dtype=np.int64)
        return {"generation": generation, "check": np.array([self.progress.score_checked]), **self._kept_state()}

    def restore(self, team: Team, state: Mapping[str, Array], *, source: str) -> None:
        """Continue where another trainer stood; see `Trainer.restore`."""
        kept = self._kept_of(team, state, ("check", 1), source=source)
        generation = self._generation_of(state, source=source)
        self.progress = Progress(generation, kept.reshape(self.method.n_averaged, -1), float(state["check"][0]))

    def records(self) -> list[Any]:
        """Return the last generation."""
        return [self._improved]

    def follow(self, part: Mapping[type[Any], Any]) -> Generation:
        """Go through a generation that a training log holds; see `Trainer.follow`."""
        improved: Improved | None = part.get(Improved)
        n = len(self.kept)
        if improved is None or len(improved.numbers) != n:
            raise LogError(f"a part holds no generation of networks of {n} numbers")
        return self._end_generation(improved)

    def points(self, report: Generation) -> Mapping[str, Mapping[str, float]]:
        """Return what is drawn of the last generation."""
        improved = self._improved
        conditions = {} if improved is None else self._by_condition(improved.score.tolist(), improved.fire.tolist())
        return {
            "score": {"": report.score_mean},
            "gain": {"": report.gain},
            "check": {"": report.score_checked},
            **({"conditions": conditions} if len(self._conditions) > 1 else {}),
        }

    def _generation(self, pool: Executor, stop: Event) -> Generation | None:
        """Fight and try options out, learn from that, and check what was learned."""
        method, before = self.method, self.progress
        fires = [self._fire(fight) for fight in range(method.n_fights)]
        seeds = [fight_seed(self.seed, fight, before.generation) for fight in range(method.n_fights)]
        fights = [*pool.map(lambda one: self._try_out(one[0], one[1], stop), zip(fires, seeds, strict=True))]
        if stop.is_set():
            return None
        decisions = [decision for _, tried in fights for decision in tried]
        numbers, gained = self._learned(self.newest, decisions)
        kept = np.concatenate([*self.progress.networks[1:], numbers])
        checked = self._score_on_all(pool, stop, kept)
        if checked is None:
            return None
        scores = [score for score, _ in fights]
        improved = Improved(
            generation=before.generation,
            score_mean=self._mean(scores, fires),
            n_decisions=len(decisions),
            gain=gained,
            score_checked=checked,
            fire=np.array(fires),
            seed=np.array(seeds, dtype=np.uint64),
            score=np.array(scores),
            n_tried=np.array([len(tried) for _, tried in fights]),
            numbers=kept,
        )
        return self._end_generation(improved)

    def _end_generation(self, improved: Improved) -> Generation:
        """Continue with the next generation; return the report of this one."""
        self._improved = improved
        networks = improved.numbers.reshape(self.method.n_averaged, -1)
        self.progress = Progress(improved.generation + 1, networks, improved.score_checked)
        named = ("generation", "score_mean", "n_decisions", "gain", "score_checked")
        return Generation(n_generations=self.method.n_generations, **{name: getattr(improved, name) for name in named})

    def _try_out(self, fire: int, seed: int, stop: Event) -> tuple[float, list[TriedDecision]]:
        """Fight a fire and try options out on the way; return the score, as a share of the maximum, and these."""
        world = self._world(fire, seed)
        tried = self._tried_in(world, stop)
        return world.outcome.score_share, tried

    def _fire(self, fight: int) -> int:
        """Draw the fire of a fight: the conditions come in turn."""
        among = [*self._conditions.values()][fight % len(self._conditions)]
        return among[hash_key(self.seed, FIRE, fight, self.generation) % len(among)]

    def _learned(self, numbers: Array, decisions: Sequence[TriedDecision]) -> tuple[Array, float]:
        """Return the numbers of a network that has learned from decisions, and what it gains on them."""
        method, network = self.method, self.network_of(numbers)
        d, c = len(decisions), method.n_options
        seen, worth = np.zeros((d, c, N_SEEN)), np.zeros((d, c))
        n_options = np.array([len(one.worth) for one in decisions], dtype=np.int64)
        for place, one in enumerate(decisions):
            seen[place, : n_options[place]], worth[place, : n_options[place]] = one.seen, one.worth
        fitting = fresh_fitting(network, c)
        for epoch in range(method.n_epochs):
            number = self.generation * method.n_epochs + epoch
            keys = [hash_key(self.seed, SHUFFLE, place, number) for place in range(d)]
            order = np.argsort(np.array(keys, dtype=np.uint64), kind="stable")
            fit_once(network, seen, worth, n_options, order, method.n_batch, method.temperature, method.rate, fitting)
        return network.number, gain(network, seen, worth, n_options, fitting.work)
