"""Networks: the value of a target by layers of weighted sums of what a brigade sees of it."""

from __future__ import annotations

from fireworld.kernels.arrays import Array, NetworkArrays
from fireworld.kernels.jit import inner, kernel

Eight = tuple[float, float, float, float, float, float, float, float]
LINEAR, RELU, TANH = 0, 1, 2
"""Activations: what is done to the sums of a layer."""
AT_ONCE = 8
"""So many targets are valued together: their sums fit into the registers of a processor."""
FEW = 2
"""So few are valued one by one, which takes less time."""
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
    activate(activation, result)


@inner
def value_together(network: NetworkArrays, seen: Array, values: Array, work: Array) -> None:
    """Write the values of some targets, (n,) with n up to 8, each to the last bit as `value_by_network` returns it.

    `seen` (8, 30) float64 is what the brigade sees of them; `work` (2, 8 w), w as `widest` says, is written.
    """
    n, row = len(values), 0
    if n <= FEW:
        for k in range(n):
            values[k] = value_by_network(network, seen[k], work)
        return
    for i in range(len(network.feature)):
        for k in range(n):
            work[row, AT_ONCE * i + k] = seen[k, network.feature[i]]
    for k in range(len(network.layer)):
        put_all_through(network, k, work[row], work[1 - row])
        row = 1 - row
    for k in range(n):
        values[k] = work[row, k]


@inner
def put_all_through(network: NetworkArrays, k: int, came: Array, out: Array) -> None:
    """Write the outputs of layer k for eight targets, (8 w,), of its inputs, (8 w,); four outputs at a time."""
    number, (n_in, n_out, activation, place), j = network.number, network.layer[k], 0
    while j + 4 <= n_out:
        bias, weight = number[place + j : place + j + 4], place + n_out + j
        one, two, three, four = eight(bias[0]), eight(bias[1]), eight(bias[2]), eight(bias[3])
        for i in range(n_in):
            inputs, weights = came[AT_ONCE * i : AT_ONCE * i + AT_ONCE], number[weight : weight + 4]
            one, two = plus(one, weights[0], inputs), plus(two, weights[1], inputs)
            three, four = plus(three, weights[2], inputs), plus(four, weights[3], inputs)
            weight += n_out
        put(one, out, j)
        put(two, out, j + 1)
        put(three, out, j + 2)
        put(four, out, j + 3)
        j += 4
    while j < n_out:
        one, weight = eight(number[place + j]), place + n_out + j
        for i in range(n_in):
            one = plus(one, number[weight], came[AT_ONCE * i : AT_ONCE * i + AT_ONCE])
            weight += n_out
        put(one, out, j)
        j += 1
    activate(activation, out[: AT_ONCE * n_out])


@inner
def eight(x: float) -> Eight:
    """Return a number for each of eight targets."""
    return x, x, x, x, x, x, x, x


@inner
def plus(sums: Eight, weight: float, x: Array) -> Eight:
    """Return sums with a multiple of numbers (8,) added."""
    return (
        sums[0] + weight * x[0],
        sums[1] + weight * x[1],
        sums[2] + weight * x[2],
        sums[3] + weight * x[3],
        sums[4] + weight * x[4],
        sums[5] + weight * x[5],
        sums[6] + weight * x[6],
        sums[7] + weight * x[7],
    )


@inner
def put(sums: Eight, out: Array, j: int) -> None:
    """Write the j-th output of eight targets."""
    to = out[AT_ONCE * j : AT_ONCE * j + AT_ONCE]
    to[0], to[1], to[2], to[3], to[4], to[5], to[6], to[7] = sums


@inner
def activate(activation: int, sums: Array) -> None:
    """Do to the sums of a layer, (n,), what its activation says."""
    if activation == RELU:
        for j in range(len(sums)):
            sums[j] = max(sums[j], 0.0)
    elif activation == TANH:
        for j in range(len(sums)):
            sums[j] = tanh(sums[j])


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
