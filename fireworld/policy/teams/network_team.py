"""Teams with a network: layers of weighted sums by which all brigades value targets."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

import numpy as np

from fireworld.errors import TrainingError, expected, one_line, shown
from fireworld.kernels.arrays import Array
from fireworld.policy.kernel import KernelPolicy, from_network
from fireworld.policy.teams.network_layers import (
    FEATURES,
    Layer,
    check_activations,
    check_layers,
    check_reading,
    floats_of,
    mean_of_networks,
    pack,
    plain_provenance,
)
from fireworld.policy.teams.network_words import NetworkDifference
from fireworld.policy.teams.npz import check_arrays
from fireworld.policy.teams.ranking_words import AROUND, WEIGHTS, targets_in_words
from fireworld.policy.teams.team import MEAN_OF, Team, no_states
from fireworld.shown import SHOWN_MAX, Block, TextTable


@dataclass(frozen=True, eq=False, repr=False)
class NetworkTeam(Team):
    """A network that all brigades value targets by, and where it comes from; `from_layers` and `from_onnx` make one."""

    kind: ClassVar[str] = "network"
    what: ClassVar[str] = "a network"

    layers: tuple[Layer, ...]
    activations: tuple[str, ...]
    """What comes after each layer but the last: relu or tanh."""
    features: tuple[str, ...] = FEATURES
    """What the network reads of a target."""
    own_targets: bool = False
    """Brigades go for any burning building of their site, not only for the four that the paper's actions name."""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    """Where it comes from: plain values."""

    @classmethod
    def from_layers(
        cls,
        layers: Sequence[tuple[Any, Any]],
        *,
        activation: str | Sequence[str] = (),
        features: Sequence[str] = FEATURES,
        own_targets: bool = False,
        provenance: Mapping[str, Any] | None = None,
    ) -> Self:
        """Make a team of the weights and biases of a network.

        Args:
            layers: of each layer the weights, (inputs, outputs), and the biases, (outputs,): arrays of floats, which
                become float64. Of a layer of torch that is `weight.T` and `bias`. The last layer has one output.
            activation: what comes after each layer but the last, "relu" or "tanh": one for all, or one for each.
            features: what the network reads of a target, in the order of its inputs.
            own_targets: brigades go for any burning building of their site, not only for the four that the paper's
                actions name.
            provenance: where the network comes from: keys and plain values, which the team file holds.

        Raises:
            TrainingError: layers that do not fit each other or the features, or exceed the limits; numbers that are
                none.
        """
        return cls._made(layers, activation, features, own_targets, provenance or {}, source=cls.__name__)

    @classmethod
    def from_onnx(
        cls,
        path: str | os.PathLike[str],
        *,
        features: Sequence[str] = FEATURES,
        own_targets: bool = False,
        provenance: Mapping[str, Any] | None = None,
    ) -> Self:
        """Make a team of an ONNX model, which is nothing but layers, Relu and Tanh. Needs `fireworld[onnx]`.

        Args:
            path: the file.
            features: as of `from_layers`.
            own_targets: the same.
            provenance: the same; what wrote the model is added.

        Raises:
            TrainingError: the package onnx is not installed, the file is no ONNX model, or there is something else in
                it, whose node is named; or what `from_layers` raises.
        """
        from fireworld.policy.teams.onnx_file import read_onnx

        model = read_onnx(path)
        origin = {"producer": model.producer, **(provenance or {})}
        return cls._made(model.layers, model.activations, features, own_targets, origin, source=os.fspath(path))

    @classmethod
    def mean_of(cls, teams: Sequence[Team], *, names: Sequence[str] = ()) -> Self:
        """Make a team that values a target by the mean of what other teams value it by; each has the same weight.

        Trainings of one method differ by chance; their mean has less of it. It is one network, whose hidden layers have
        the units of all. Values count as they are: a network whose values are farther apart has more say.

        Args:
            teams: networks that read the same features, have the same activations, and value the same targets.
            names: what errors call them; `teams[0]` and so on if left out.

        Raises:
            TrainingError: there is none, or one of them is no such network; or the mean would be too wide.
        """
        called = names or [f"teams[{k}]" for k in range(len(teams))]
        networks = list[Self]()
        for name, team in zip(called, teams, strict=True):
            if not isinstance(team, cls):
                raise TrainingError(expected(name, "", cls.what, team.what))
            networks.append(team)
            wanted, own = networks[0].header(), team.header()
            if key := next((key for key in wanted if wanted[key] != own[key]), ""):
                raise TrainingError(expected(name, key, f"as in {called[0]}, {shown(wanted[key])}", own[key]))
        if not networks:
            raise TrainingError(expected("mean", "teams", "one at least", 0))
        first, layers = networks[0], mean_of_networks([one.layers for one in networks])
        checked = check_layers(layers, n_inputs=len(first.features), source="mean")
        origin = {MEAN_OF: [{"digest": one.digest, **one.provenance} for one in networks]}
        return cls(checked, first.activations, first.features, first.own_targets, origin)

    @classmethod
    def _made(
        cls,
        layers: Sequence[tuple[Any, Any]],
        activation: object,
        features: object,
        own_targets: object,
        provenance: Mapping[str, Any],
        *,
        source: str,
    ) -> Self:
        """Make a team of arrays of floats, and check all of it."""
        if not isinstance(layers, list | tuple):
            raise TrainingError(expected(source, "layers", "a list of pairs: weights, biases", type(layers).__name__))
        reads = check_reading(features, own_targets, source=source)
        after = check_activations(activation, len(layers), source=source)
        pairs = [floats_of(layer, k, source=source) for k, layer in enumerate(layers)]
        checked = check_layers(pairs, n_inputs=len(reads), source=source)
        return cls(checked, after, reads, bool(own_targets), plain_provenance(provenance, source=source))

    @property
    def digest(self) -> str:
        """SHA-256 of what the brigades follow."""
        content = hashlib.sha256(repr((self.features, self.own_targets, self.activations, self.widths)).encode())
        for array in self.arrays().values():
            content.update(array.tobytes())
        return content.hexdigest()

    @property
    def widths(self) -> tuple[int, ...]:
        """How many features the network reads, and the outputs of its layers."""
        return (len(self.features), *(len(layer.biases) for layer in self.layers))

    @property
    def summary(self) -> str:
        """How wide the layers are, and what is valued."""
        what = "own targets" if self.own_targets else "the paper's actions"
        return f"a network of {'-'.join(map(str, self.widths))} for {what}"

    def policy(self) -> KernelPolicy:
        """Return the policy of the team."""
        return from_network(pack(self.layers, self.activations, self.features), own_targets=self.own_targets)

    def arrays(self) -> dict[str, Array]:
        """Return weights and biases, layer by layer."""
        return {
            f"{name}_{k}": np.ascontiguousarray(array, dtype="<f8")
            for k, layer in enumerate(self.layers)
            for name, array in layer._asdict().items()
        }

    def header(self) -> dict[str, Any]:
        """Return what the network reads, what comes between its layers, and what is valued."""
        return {
            "features": list(self.features),
            "activations": list(self.activations),
            "own_targets": self.own_targets,
        }

    @classmethod
    def from_file(
        cls, header: dict[str, Any], arrays: dict[str, Array], *, provenance: Mapping[str, Any], source: str
    ) -> Self:
        """Make a team of what its file holds; see `Team.from_file`."""
        features, own_targets = header.pop("features", None), header.pop("own_targets", None)
        activations = header.pop("activations", None)
        for key in header:
            raise TrainingError(expected(source, key, "features, activations, own_targets and nothing else", key))
        reads = check_reading(features, own_targets, source=source)
        if not isinstance(activations, list):
            raise TrainingError(expected(source, "activations", "a list", activations))
        n_layers = len(activations) + 1
        after = check_activations(activations, n_layers, source=source)
        names = [(f"weights_{k}", f"biases_{k}") for k in range(n_layers)]
        check_arrays(arrays, *(name for pair in names for name in pair), source=source)
        pairs = [(arrays.pop(weights), arrays.pop(biases)) for weights, biases in names]
        for name in arrays:
            if name.startswith(("weights_", "biases_")):
                raise TrainingError(expected(source, name, f"the arrays of {n_layers} layers", name))
        return cls(
            check_layers(pairs, n_inputs=len(reads), source=source),
            after,
            reads,
            own_targets,
            provenance,
        )

    def difference(self, other: Self) -> NetworkDifference:
        """Compare the network of another team with this one."""
        return NetworkDifference.of((self.header(), other.header()), self.layers, other.layers)

    def describe(self, *, states: Sequence[str] = (), limit: int = SHOWN_MAX) -> Iterator[Block]:
        """Yield what the network reads, and its layers."""
        del limit
        no_states(self.what, states)
        yield f"a network that values {targets_in_words(own_targets=self.own_targets)}, one for all brigades"
        origin = self.origin or [f"{key} {shown(value)}" for key, value in self.provenance.items()]
        yield from (*map(one_line, origin), f"digest {self.digest}", "")
        rows = [
            [str(k), *map(str, layer.weights.shape), after, f"{np.abs(layer.weights).max():.3f}"]
            for k, (layer, after) in enumerate(zip(self.layers, [*self.activations, "none"], strict=True))
        ]
        yield TextTable(["layer", "inputs", "outputs", "activation", "largest weight"], rows)
        yield ""
        meanings = {weight.name: weight.meaning for weight in (*WEIGHTS, *AROUND)}
        yield TextTable(["input", "of what"], [[name, meanings[name]] for name in self.features], n_left=2)

    def as_dict(self, *, states: Sequence[str] = (), limit: int = SHOWN_MAX) -> dict[str, Any]:
        """Return what `describe` shows as plain values."""
        del limit
        no_states(self.what, states)
        return {
            "digest": self.digest,
            **self.header(),
            "widths": list(self.widths),
            "n_numbers": sum(array.size for array in self.arrays().values()),
            "provenance": self.short_provenance,
        }
