"""The layers of a network: checked, and packed for the kernels."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, Final, NamedTuple

import numpy as np

from fireworld.errors import TrainingError, described, expected, nearest
from fireworld.kernels.arrays import Array, NetworkArrays
from fireworld.kernels.network import LINEAR, RELU, TANH
from fireworld.policy.teams.npz import check_finite
from fireworld.policy.teams.ranking_words import AROUND, N_TARGET_WEIGHTS, OF_ACTION, WEIGHTS

ACTIVATIONS: Final = {"relu": RELU, "tanh": TANH}
"""What may come between two layers; after the last there is nothing."""
SEEN: Final = tuple(weight.name for weight in (*WEIGHTS, *AROUND))
"""What a network may read of a target: what a ranking weighs, in its order, and what is around it."""
OWN_SEEN: Final = tuple(name for name in SEEN if name not in {weight.name for weight in OF_ACTION})
"""The same where brigades name targets of their own: no action names them."""
OF_OTHERS: Final = frozenset({"others_here", "others_near", "enough", "side_others", "site_others"})
"""What a team without cooperation does not see."""
FEATURES: Final = SEEN[:N_TARGET_WEIGHTS]
"""The features of a target: what a network reads if nothing else is said."""
N_LAYERS_MAX: Final = 8
WIDTH_MAX: Final = 1024
"""Outputs of a layer at most."""
NUMBER_MAX: Final = 1e9
"""Size of a weight or bias at most: so no sum overflows."""

AN_ARRAY: Final = "an array of float16, float32 or float64"


class Layer(NamedTuple):
    """A layer of a network: inputs @ weights + biases."""

    weights: Array  # (inputs, outputs) float64
    biases: Array  # (outputs,) float64


def check_reading(features: object, own_targets: object, *, source: str) -> tuple[str, ...]:
    """Return the features that a network reads; TrainingError, which names the source, if they make no sense."""
    if not isinstance(own_targets, bool):
        raise TrainingError(expected(source, "own_targets", "true or false", own_targets))
    if not isinstance(features, list | tuple) or not features or not all(isinstance(one, str) for one in features):
        raise TrainingError(expected(source, "features", "a list of names, as temperature, volume", features))
    known = OWN_SEEN if own_targets else SEEN
    for place, name in enumerate(features):
        if name in SEEN and name not in known:
            raise TrainingError(expected(source, "features", "no actions where targets are a brigade's own", name))
        if name not in known:
            raise TrainingError(expected(source, "features", ", ".join(known), name, nearest(name, known)))
        if name in features[:place]:
            raise TrainingError(expected(source, "features", "every one once", f"{name} twice"))
    return tuple(features)


def check_activations(activations: object, n_layers: int, *, source: str) -> tuple[str, ...]:
    """Return what comes after each layer but the last, which may be given as one name for all of them.

    Raises:
        TrainingError: there are no layers, or too many of them, or what comes between them is none of `ACTIVATIONS`.
    """
    if not 1 <= n_layers <= N_LAYERS_MAX:
        raise TrainingError(expected(source, "", f"a network of 1 to {N_LAYERS_MAX} layers", f"{n_layers} of them"))
    found = [activations] * (n_layers - 1) if isinstance(activations, str) else activations
    of_them = ", ".join(ACTIVATIONS)
    if not isinstance(found, list | tuple) or len(found) != n_layers - 1:
        wanted = f"one of {of_them} for each of {n_layers} layers but the last"
        raise TrainingError(expected(source, "activations", wanted, activations))
    for name in (activations,) if isinstance(activations, str) else found:
        if not isinstance(name, str) or name not in ACTIVATIONS:
            raise TrainingError(expected(source, "activations", f"one of {of_them}", name))
    return tuple(found)


def check_layers(pairs: Sequence[tuple[Array, Array]], *, n_inputs: int, source: str) -> tuple[Layer, ...]:
    """Return the layers of weights (inputs, outputs) and biases (outputs,), all float64; the last has one output.

    Raises:
        TrainingError: an array has another type or shape, or a number in it is none, or too large.
    """
    layers = []
    for k, (weights, biases) in enumerate(pairs):
        last = k == len(pairs) - 1
        n_outputs = weights.shape[1] if weights.ndim == 2 and not last else 1
        fits = weights.shape == (n_inputs, n_outputs) and 1 <= n_outputs <= WIDTH_MAX
        if weights.dtype != np.float64 or not fits:
            wide = "1" if last else f"1 to {WIDTH_MAX}"
            wanted = f"float64 weights of shape ({n_inputs}, {wide}), a row for each input"
            turned = not fits and weights.ndim == 2 and weights.shape[1] == n_inputs
            hint = "torch has them the other way round, take weight.T" if turned else ""
            raise TrainingError(expected(source, f"weights_{k}", wanted, f"{weights.dtype} {weights.shape}", hint))
        if biases.dtype != np.float64 or biases.shape != (n_outputs,):
            wanted = f"float64 biases of shape ({n_outputs},)"
            raise TrainingError(expected(source, f"biases_{k}", wanted, f"{biases.dtype} {biases.shape}"))
        for name, array in ((f"weights_{k}", weights), (f"biases_{k}", biases)):
            check_finite(array, name, source=source)
            largest = float(np.abs(array).max())
            if largest > NUMBER_MAX:
                raise TrainingError(expected(source, name, f"numbers of at most {NUMBER_MAX:.0e} in size", largest))
        layers.append(Layer(np.ascontiguousarray(weights), np.ascontiguousarray(biases)))
        n_inputs = n_outputs
    return tuple(layers)


def floats_of(layer: Any, k: int, *, source: str) -> tuple[Array, Array]:
    """Return weights and biases of layer k, arrays of floats or what becomes them, as float64.

    Raises:
        TrainingError: it is no such pair.
    """
    if not isinstance(layer, list | tuple) or len(layer) != 2:
        raise TrainingError(expected(source, f"layers[{k}]", "a pair: weights, biases", type(layer).__name__))
    found = []
    for name, values in zip((f"weights_{k}", f"biases_{k}"), layer, strict=True):
        try:
            array = np.asarray(values)
        except Exception as error:  # noqa: BLE001 - a tensor of whatever library says in its own way what is wrong
            raise TrainingError(expected(source, name, AN_ARRAY, described(error))) from None
        if array.dtype.kind != "f" or array.dtype.itemsize > 8:
            raise TrainingError(expected(source, name, AN_ARRAY, f"{array.dtype} {array.shape}"))
        found.append(array.astype(np.float64))
    weights, biases = found
    return weights, biases


def plain_provenance(provenance: Mapping[str, Any], *, source: str) -> dict[str, Any]:
    """Return where a network comes from as a team file gives it back; TrainingError if it cannot hold it."""
    try:
        plain: dict[str, Any] = json.loads(json.dumps(dict(provenance)))
    except (TypeError, ValueError, RecursionError) as error:
        raise TrainingError(expected(source, "provenance", "keys and plain values", described(error))) from None
    return plain


def unpack(numbers: Array, widths: Sequence[int]) -> tuple[Layer, ...]:
    """Return the layers of a network by its numbers, in the order in which `pack` puts them.

    Args:
        numbers: (k,) float64, of each layer the biases, then the weights.
        widths: inputs, then the outputs of each layer.
    """
    layers, place = [], 0
    for n_in, n_out in pairwise(widths):
        biases, weights = np.split(numbers[place : place + n_out * (1 + n_in)], [n_out])
        layers.append(Layer(weights.reshape(n_in, n_out).copy(), biases.copy()))
        place += n_out * (1 + n_in)
    return tuple(layers)


def pack(layers: Sequence[Layer], activations: Sequence[str], features: Sequence[str]) -> NetworkArrays:
    """Return a network as the kernels take it."""
    rows, numbers, place = [], [], 0
    codes = [*(ACTIVATIONS[name] for name in activations), LINEAR]
    for (weights, biases), code in zip(layers, codes, strict=True):
        rows.append([*weights.shape, code, place])
        numbers += [biases, weights.ravel()]
        place += biases.size + weights.size
    reads = [SEEN.index(name) for name in features]
    return NetworkArrays(np.array(reads, dtype=np.int64), np.array(rows, dtype=np.int64), np.concatenate(numbers))


def mean_of_networks(networks: Sequence[Sequence[Layer]]) -> tuple[Layer, ...]:
    """Return the layers of a network whose value is the mean of those of others, but for rounding.

    They have as many layers each, with the same activations. The hidden layers of the mean have the units of all, side
    by side; nothing leads from the units of one to those of another.
    """
    n, (*hidden, values) = len(networks), zip(*networks, strict=True)
    biases = sum(one.biases for one in values) / n
    if not hidden:
        return (Layer(sum(one.weights for one in values) / n, biases),)
    first, *further = hidden
    layers = [Layer(np.concatenate([one.weights for one in first], axis=1), _in_a_row(first))]
    for layer in further:
        apart = np.zeros(tuple(np.sum([one.weights.shape for one in layer], axis=0)))
        row = column = 0
        for weights, _ in layer:
            n_in, n_out = weights.shape
            apart[row : row + n_in, column : column + n_out] = weights
            row, column = row + n_in, column + n_out
        layers.append(Layer(apart, _in_a_row(layer)))
    return (*layers, Layer(np.concatenate([one.weights for one in values]) / n, biases))


def _in_a_row(layers: Sequence[Layer]) -> Array:
    """Return the biases of layers, one after another."""
    return np.concatenate([one.biases for one in layers])
