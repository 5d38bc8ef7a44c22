"""Networks: the value of a target by layers of weighted sums of what a brigade sees of it."""

from __future__ import annotations

from fireworld.kernels.arrays import Array, NetworkArrays
from fireworld.kernels.jit import inner, kernel

LINEAR, RELU, TANH = 0, 1, 2
"""Activations: what is done to the sums of a layer."""
TANH_MOST = 20.0
"""From there on the hyperbolic tangent is 1 in double precision."""


@kernel
def widest(network: NetworkArrays) -> int:
    """Return the most inputs or outputs that a layer has; 0 without layers."""
    width = len(network.feature)
    for k in range(len(network.layer)):
        width = max(width, network.layer[k, 1])
    return width


@kernel
def value_by_network(network: NetworkArrays, seen: Array, work: Array) -> float:
    """Return the value of a target by a network with layers; MODEL 8.

    Every sum begins with the bias and takes the inputs in their order, so that it has the same bits on every machine.
    `seen` (30,) float64 is what the brigade sees of the target; `work` (2, w) float64, w as `widest` says, is written.
    """
    row = 0
    for i in range(len(network.feature)):
        work[row, i] = seen[network.feature[i]]
    for k in range(len(network.layer)):
        put_through(network, k, work[row], work[1 - row])
        row = 1 - row
    return work[row, 0]


@inner
def put_through(network: NetworkArrays, k: int, came: Array, out: Array) -> None:
    """Write the outputs of layer k, (w,), of its inputs, (w,)."""
    number, (n_in, n_out, activation, place) = network.number, network.layer[k]
    result = out[:n_out]
    for j in range(n_out):
        result[j] = number[place + j]
    add_multiples(came[:n_in], number[place + n_out : place + (n_in + 1) * n_out], result)
    if activation == RELU:
        for j in range(n_out):
            result[j] = max(result[j], 0.0)
    elif activation == TANH:
        for j in range(n_out):
            result[j] = tanh(result[j])


@inner
def slope(activation: int, result: float) -> float:
    """Return how fast an activation changes with what it is of, by what it has made of it."""
    if activation == RELU:
        return 1.0 if result > 0.0 else 0.0
    return 1.0 - result * result if activation == TANH else 1.0


@inner
def add_multiple(factor: float, numbers: Array, out: Array) -> None:
    """Add a multiple of some numbers to `out`, both (k,) float64; processors do several at a time."""
    for j in range(len(out)):
        out[j] += factor * numbers[j]


@inner
def add_multiples(factors: Array, numbers: Array, out: Array) -> None:
    """Add multiples of rows of numbers to `out`, (k,) float64, a row (k,) for each factor (n,).

    One after another, but four at a time, so that the sums are read and written less often.
    """
    n, width, i = len(factors), len(out), 0
    while i + 4 <= n:
        f0, f1, f2, f3 = factors[i], factors[i + 1], factors[i + 2], factors[i + 3]
        rows = numbers[i * width : (i + 4) * width]
        one, two, three, four = rows[:width], rows[width : 2 * width], rows[2 * width : 3 * width], rows[3 * width :]
        for j in range(width):
            out[j] = (((out[j] + f0 * one[j]) + f1 * two[j]) + f2 * three[j]) + f3 * four[j]
        i += 4
    while i < n:
        add_multiple(factors[i], numbers[i * width : (i + 1) * width], out)
        i += 1


@inner
def tanh(x: float) -> float:
    """Return the hyperbolic tangent, to 1e-15 of it, from + - * / alone: libraries' differ between processors.

    For x / 64 it is up / down, a convergent of Lambert's continued fraction; tanh(2 y) = 2 t / (1 + t^2), t = tanh(y),
    taken six times, leads to x.
    """
    part = min(max(x, -TANH_MOST), TANH_MOST) / 64.0
    square = part * part
    up = part * (1.0 + square * (17325.0 + square * (378.0 + square)) / 135135.0)
    down = 1.0 + square * (62370.0 + square * (3150.0 + square * 28.0)) / 135135.0
    for _ in range(6):
        up, down = 2.0 * up * down, down * down + up * up
    return up / down
