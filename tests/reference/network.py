"""What a network makes of the features of a target, in plain numpy: MODEL 8."""

from __future__ import annotations

import numpy as np

from fireworld.city.city import Float64Array
from fireworld.kernels.arrays import NetworkArrays
from fireworld.kernels.network import RELU, TANH


def value(network: NetworkArrays, seen: Float64Array) -> float:
    """Return the value of a target; `seen` (17,) are its features, those of the actions last."""
    numbers = seen[network.feature]
    for n_inputs, n_outputs, activation, place in network.layer.tolist():
        biases, weights = np.split(network.number[place : place + n_outputs * (1 + n_inputs)], [n_outputs])
        numbers = numbers @ weights.reshape(n_inputs, n_outputs) + biases
        if activation == RELU:
            numbers = np.maximum(numbers, 0.0)
        elif activation == TANH:
            numbers = np.tanh(numbers)
    return float(numbers[0])
