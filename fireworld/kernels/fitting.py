"""Fit a network to what the options of decisions are worth: the more they are worth, the higher it shall value them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fireworld import scores
from fireworld.kernels.arrays import Array, Float64, Float64x2, NetworkArrays, TargetLearner
from fireworld.kernels.jit import inner, kernel
from fireworld.kernels.network import add_multiple, value_by_network
from fireworld.kernels.target_learning import value_and_gradient

exp_of_minus = inner(scores.exp_of_minus)
FARTHEST = 8.0
"""Options whose values are so many temperatures below the highest count nothing."""
DECAY, DECAY_OF_SQUARES, LEAST = 0.9, 0.999, 1e-8
"""Of Adam: what is left of its means from batch to batch, and what keeps it from dividing by nothing."""


class Fitting(NamedTuple):
    """What the fitting remembers and writes on; k numbers of the network, c options at most."""

    gradient: Float64  # (k,), of a batch
    mean: Float64  # (k,), running mean of the gradients
    square: Float64  # (k,), of their squares
    left: Float64  # (2,), DECAY and DECAY_OF_SQUARES to the power of the batches so far
    share: Float64  # (c,), scratch: how probable each option is
    work: Float64x2  # (2, w), scratch of the layers
    learner: TargetLearner  # its scratch


@kernel
def fit_once(
    network: NetworkArrays,
    seen: Array,
    worth: Array,
    n_options: Array,
    order: Array,
    n_batch: int,
    temperature: float,
    rate: float,
    fitting: Fitting,
) -> float:
    """Go through all decisions once, batch by batch, and move the network's numbers; MODEL 11.

    Of each decision the mean worth of its options is made greater, where each counts by how probable it is to one that
    prefers what is valued higher. There are d decisions, of c options at most.

    Args:
        network: its numbers are changed.
        seen: (d, c, 30) float64, what the brigade saw of each option.
        worth: (d, c) float64.
        n_options: (d,) int64, how many options each had; the rest of the rows is nothing.
        order: (d,) int64, in which they come.
        n_batch: decisions between two moves.
        temperature: differences of values that matter.
        rate: length of a move, of each number.
        fitting: what is remembered from batch to batch.

    Returns:
        The mean worth so made greater, as it was before each batch.
    """
    total, n_of_batch = 0.0, 0
    fitting.gradient[:] = 0.0
    for place in range(len(order)):
        d = order[place]
        total += add_gradient(network, seen[d], worth[d], n_options[d], temperature, fitting)
        n_of_batch += 1
        if n_of_batch == n_batch or place + 1 == len(order):
            move(network.number, rate, n_of_batch, fitting)
            fitting.gradient[:] = 0.0
            n_of_batch = 0
    return total / max(len(order), 1)


@inner
def add_gradient(
    network: NetworkArrays, seen: Array, worth: Array, n_options: int, temperature: float, fitting: Fitting
) -> float:
    """Add how the numbers change the mean worth of a decision's options, (c, 30) and (c,); return that mean."""
    share = fitting.share
    highest, total, mean = -np.inf, 0.0, 0.0
    for option in range(n_options):
        share[option] = value_by_network(network, seen[option], fitting.work) / temperature
        highest = max(highest, share[option])
    for option in range(n_options):
        below = highest - share[option]
        share[option] = exp_of_minus(below) if below < FARTHEST else 0.0
        total += share[option]
    for option in range(n_options):
        share[option] /= total
        mean += share[option] * worth[option]
    for option in range(n_options):
        part = share[option] * (worth[option] - mean) / temperature
        if part != 0.0:
            value_and_gradient(network, seen[option], fitting.learner)
            add_multiple(part, fitting.learner.gradient, fitting.gradient)
    return mean


@inner
def move(number: Array, rate: float, n_of_batch: int, fitting: Fitting) -> None:
    """Move numbers, (k,), by the gradient of a batch: Adam (Kingma and Ba, 2015)."""
    left = fitting.left
    left[0] *= DECAY
    left[1] *= DECAY_OF_SQUARES
    for k in range(len(number)):
        gradient = fitting.gradient[k] / n_of_batch
        fitting.mean[k] = DECAY * fitting.mean[k] + (1.0 - DECAY) * gradient
        fitting.square[k] = DECAY_OF_SQUARES * fitting.square[k] + (1.0 - DECAY_OF_SQUARES) * gradient * gradient
        mean, square = fitting.mean[k] / (1.0 - left[0]), fitting.square[k] / (1.0 - left[1])
        number[k] += rate * mean / (np.sqrt(square) + LEAST)


@kernel
def gain(network: NetworkArrays, seen: Array, worth: Array, n_options: Array, work: Array) -> float:
    """Return the mean worth of what a network values highest (ties: the first); arguments as above."""
    total = 0.0
    for d in range(len(n_options)):
        best, highest = 0, -np.inf
        for option in range(n_options[d]):
            value = value_by_network(network, seen[d, option], work)
            if value > highest:
                best, highest = option, value
        total += worth[d, best]
    return total / max(len(n_options), 1)
