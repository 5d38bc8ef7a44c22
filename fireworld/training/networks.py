"""What methods share that improve a network that values targets, generation by generation, under many conditions."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from threading import Event
from typing import Annotated, Any, ClassVar, Final, TypeVar

import numpy as np

from fireworld.draws import BEGINNING
from fireworld.errors import TrainingError, expected
from fireworld.kernels.arrays import Array, NetworkArrays
from fireworld.kernels.draws import fill_normals
from fireworld.kernels.ranking import N_TARGET_FEATURES
from fireworld.policy.kernel import KernelPolicy, from_network
from fireworld.policy.teams.network_layers import OF_OTHERS, OWN_SEEN, Layer, pack, unpack
from fireworld.policy.teams.network_team import NetworkTeam
from fireworld.policy.teams.npz import check_arrays, check_finite
from fireworld.policy.teams.ranking_team import RankingTeam
from fireworld.policy.teams.team import Team, load_team
from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import Curriculum
from fireworld.training.generations import GenerationMethod, GenerationTrainer
from fireworld.training.method import Limits, Report
from fireworld.training.seeds import check_seed

HIDDEN_MAX: Final = 256
Hidden = Annotated[int, Limits(f"a whole number from 0 to {HIDDEN_MAX}", 0, HIDDEN_MAX)]
ACTIVATION: Final = "relu"
N_OF_RANKING: Final = 2
"""Hidden units that compute a ranking: one its values above 0, one those below."""


class NetworkMethod(GenerationMethod):
    """A method that improves a network, whose layers follow from (k,) float64 numbers.

    Attributes:
        is_packed: the numbers are biases and weights of the layers, as `pack` puts them.
    """

    is_packed: ClassVar[bool] = False

    @property
    @abstractmethod
    def features(self) -> tuple[str, ...]:
        """What the network reads of a target."""

    @property
    @abstractmethod
    def start(self) -> str:
        """The shipped team as which the network values targets before the first generation; `none`: all of them 0."""

    @property
    def n_checks(self) -> int:
        """Fights of a check with each fire."""
        return 1

    @property
    @abstractmethod
    def widths(self) -> tuple[int, ...]:
        """How many features the network reads, and the outputs of its layers; relu comes after all but the last."""

    @abstractmethod
    def first_numbers(self, start: Team | None, seed: int) -> Array:
        """Return the numbers before the first generation.

        Args:
            start: as which the network values targets; None: it values all of them 0.
            seed: of what is drawn.

        Raises:
            TrainingError: no network of this method values targets as this team.
        """

    @abstractmethod
    def layers_of(self, numbers: Array) -> tuple[Layer, ...]:
        """Return the layers that follow from the numbers."""


@dataclass(frozen=True, kw_only=True)
class LayeredMethod(NetworkMethod):
    """A method that improves the biases and weights of one hidden layer and of the value, or of the value alone."""

    is_packed: ClassVar[bool] = True

    hidden: Hidden
    """Numbers of the layer between features and value, relu; 0: the value is one weighted sum."""
    cooperation: bool = True
    """Brigades see what the others go for."""

    def __post_init__(self) -> None:
        """Raise TrainingError if a hyperparameter is not what it may be."""
        super().__post_init__()
        if self.start == "best-2026" and 0 < self.hidden < N_OF_RANKING:
            wanted = f"0, or at least {N_OF_RANKING}, which a ranking takes (start best-2026)"
            raise TrainingError(expected("method", "hidden", wanted, self.hidden))

    @property
    def features(self) -> tuple[str, ...]:
        """What the network reads of a target: all that there is, or what a team without cooperation sees."""
        return tuple(name for name in OWN_SEEN if self.cooperation or name not in OF_OTHERS)

    @property
    def widths(self) -> tuple[int, ...]:
        """The features, the hidden layer if there is one, the value."""
        return (len(self.features), *([self.hidden] if self.hidden else []), 1)

    def first_numbers(self, start: Team | None, seed: int) -> Array:
        """Return the numbers before the first generation; see `NetworkMethod.first_numbers`.

        Weights of hidden units that the start does not need are drawn; what they say counts 0.
        """
        n, rows = len(self.features), [OWN_SEEN.index(name) for name in self.features]
        if not self.hidden:
            weighed = np.zeros(len(OWN_SEEN)) if start is None else _weights_of_all(start)
            return pack([Layer(weighed[rows, np.newaxis], np.zeros(1))], (), self.features).number
        hidden = Layer(np.zeros((n, self.hidden)), np.zeros(self.hidden))
        value = Layer(np.zeros((self.hidden, 1)), np.zeros(1))
        fill_normals(seed, BEGINNING, 0, hidden.weights)
        hidden.weights[:] /= math.sqrt(n)
        if start is not None:
            of_start, its_value = _hidden_of(start)
            k = len(of_start.biases)
            if k > self.hidden:
                raise TrainingError(expected("method", "hidden", f"at least {k} (start {self.start})", self.hidden))
            hidden.weights[:, :k], hidden.biases[:k] = of_start.weights[rows], of_start.biases
            value.weights[:k], value.biases[:] = its_value.weights, its_value.biases
        return pack([hidden, value], (ACTIVATION,), self.features).number

    def layers_of(self, numbers: Array) -> tuple[Layer, ...]:
        """Return the layers whose biases and weights the numbers are."""
        return unpack(numbers, self.widths)


AMethod = TypeVar("AMethod", bound=NetworkMethod)
AReport = TypeVar("AReport", bound=Report)


class NetworkTrainer(GenerationTrainer[AMethod, AReport]):
    """Improves one network; arguments as for `Method.trainer`.

    The stages of the curriculum are the conditions; all of them count equally. Networks are (k,) float64 numbers that
    their layers follow from, as the method says.
    """

    def __init__(self, curriculum: Curriculum, method: AMethod, *, seed: int, cities: CityCache | None = None) -> None:
        super().__init__(curriculum, method, seed=seed, cities=cities)
        self._activations = (ACTIVATION,) * (len(method.widths) - 2)
        self._conditions = _conditions(curriculum)
        self._start = None if method.start == "none" else load_team(method.start)
        self._first = method.first_numbers(self._start, seed)

    @property
    @abstractmethod
    def kept(self) -> Array:
        """The numbers of the team."""

    @property
    def identity(self) -> dict[str, Any]:
        """What decides what comes of a training; of the team that it starts with the digest."""
        return {**super().identity, **({} if self._start is None else {"start": self._start.digest})}

    def team(self) -> NetworkTeam:
        """Return the network of the kept numbers; before the first generation what it starts with."""
        return self._team_of(self.kept)

    def own_plots(self) -> Mapping[str, str]:
        """Return the plot of the conditions, if there are several."""
        return {"conditions": "Score by condition"} if len(self._conditions) > 1 else {}

    def network_of(self, numbers: Array) -> NetworkArrays:
        """Return the network of these numbers as the kernels take it, with arrays of its own."""
        return pack(self.method.layers_of(numbers), self._activations, self.method.features)

    def policy_of(self, numbers: Array) -> KernelPolicy:
        """Return the policy of a team whose brigades all follow the network of these numbers."""
        return from_network(self.network_of(numbers), own_targets=True)

    def _team_of(self, numbers: Array) -> NetworkTeam:
        """Return the team of these numbers."""
        provenance = {**self.identity, "generations_done": self.generation}
        layers, features = self.method.layers_of(numbers), self.method.features
        return NetworkTeam(layers, self._activations, features, own_targets=True, provenance=provenance)

    def _kept_state(self) -> dict[str, Array]:
        """Return the kept numbers for a checkpoint, if its team does not tell them."""
        return {} if self.method.is_packed else {"kept": self.kept}

    def _kept_of(self, team: Team, state: Mapping[str, Array], *lengths: tuple[str, int], source: str) -> Array:
        """Return the kept numbers of a checkpoint, whose state has arrays of these lengths by name, and `_kept_state`.

        Raises:
            TrainingError: it is of no such network.
        """
        method = self.method
        found = [*lengths, *((name, len(array)) for name, array in self._kept_state().items())]
        check_arrays(state, "generation", *(name for name, _ in found), source=source)
        for name, wanted in found:
            array = state[name]
            if array.shape != (wanted,) or array.dtype != np.float64:
                raise TrainingError(expected(source, name, f"{wanted} numbers", f"{array.dtype} {array.shape}"))
            check_finite(array, name, source=source)
        if not isinstance(team, NetworkTeam):
            raise TrainingError(expected(source, "", NetworkTeam.what, team.what))
        if team.widths != method.widths or team.features != method.features or team.activations != self._activations:
            wanted_team = f"a network of {'-'.join(map(str, method.widths))}"
            raise TrainingError(expected(source, "", wanted_team, team.summary))
        if method.is_packed:
            return pack(team.layers, team.activations, team.features).number
        kept = state["kept"].copy()
        if self._team_of(kept).digest != team.digest:
            raise TrainingError(expected(source, "kept", "the numbers of its team", "those of another"))
        return kept

    def _score_on_all(self, pool: Executor, stop: Event, numbers: Array) -> float | None:
        """Return the score of a network on all fires, in whole fights; None if the work is to stop."""
        n = self.curriculum.n_scenarios
        fires = [*range(n)] * self.method.n_checks
        seeds = [check_seed(self.seed, place) for place in range(len(fires))]
        scores = self._scores(pool, stop, numbers[np.newaxis], fires, seeds, whole=True)
        return None if scores is None else self._mean(scores[0].tolist(), fires)

    def _by_condition(self, scores: Sequence[float], fires: Sequence[int]) -> dict[str, float]:
        """Return the mean score of each condition that has some of the fires; a score for each fire."""
        found = dict[str, float]()
        for name, among in self._conditions.items():
            mine = [score for fire, score in zip(fires, scores, strict=True) if fire in among]
            if mine:
                found[name] = math.fsum(mine) / len(mine)
        return found

    def _mean(self, scores: Sequence[float], fires: Sequence[int]) -> float:
        """Return the mean score, all conditions that were fought in counting equally."""
        conditions = self._by_condition(scores, fires)
        return math.fsum(conditions.values()) / len(conditions)


def _conditions(curriculum: Curriculum) -> dict[str, range]:
    """Return the numbers of the scenarios of each stage, by its name."""
    found, first = dict[str, range](), 0
    for stage in curriculum.stages:
        found[stage.name] = range(first, first + len(stage.scenarios))
        first += len(stage.scenarios)
    return found


def weights_of(start: Team) -> Array:
    """Return what a shipped ranking weighs the features of a target by, (13,) float64."""
    if not isinstance(start, RankingTeam) or not start.own_targets or len(start.weights) != 1:
        raise TrainingError(expected("method", "start", "one ranking of own targets", start.summary))
    return start.weights[0, :N_TARGET_FEATURES]


def _weights_of_all(start: Team) -> Array:
    """Return what a shipped ranking weighs all features by, (26,) float64: 0 for those that it does not read."""
    return np.pad(weights_of(start), (0, len(OWN_SEEN) - N_TARGET_FEATURES))


def _hidden_of(start: Team) -> tuple[Layer, Layer]:
    """Return the hidden layer of all features, and the value, by which a network values targets as a shipped team."""
    if isinstance(start, NetworkTeam):
        if start.features != OWN_SEEN or start.activations != (ACTIVATION,) or not start.own_targets:
            wanted = f"a network of own targets with one hidden layer, {ACTIVATION}"
            raise TrainingError(expected("method", "start", wanted, start.summary))
        hidden, value = start.layers
        return hidden, value
    weighed = _weights_of_all(start)
    both = Layer(np.column_stack([weighed, -weighed]), np.zeros(N_OF_RANKING))
    return both, Layer(np.array([[1.0], [-1.0]]), np.zeros(1))
