"""The value of a target by a network: that of numpy, with sums in a fixed order, and a tangent of fireworld's own."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fireworld.kernels.network import AT_ONCE, tanh, value_by_network, value_together, widest
from fireworld.kernels.situation import N_SEEN
from fireworld.policy.kernel import NO_NETWORK
from fireworld.policy.teams.network_layers import FEATURES, SEEN, Layer, pack
from tests.networks import random_layers
from tests.reference import network as reference


def ready(*widths, activation, features=FEATURES, seed=8):
    layers = [Layer(*layer) for layer in random_layers(*widths, seed=seed)]
    return pack(layers, [activation] * (len(layers) - 1), features)


def value(network, seen):
    return value_by_network(network, seen, np.full((2, widest(network)), np.nan))


@pytest.mark.parametrize("activation", ["relu", "tanh"])
@pytest.mark.parametrize(
    "widths", [(13, 1), (13, 1, 1), (13, 64, 1), (13, 64, 64, 1), (13, 3, 300, 2, 17, 1), (13, *[9] * 7, 1)]
)
def test_values_are_those_of_numpy(widths, activation):
    random = np.random.default_rng(3)
    for seed in range(20):
        network = ready(*widths, activation=activation, seed=seed)
        seen = random.normal(size=N_SEEN) * random.choice([0.1, 1.0, 3.0])
        expected = reference.value(network, seen)
        assert value(network, seen) == pytest.approx(expected, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("features", [("mine",), ("volume", "temperature"), SEEN, SEEN[::-1]])
def test_it_reads_its_features_in_their_order(features):
    network = ready(len(features), 4, 1, activation="tanh", features=features)
    seen = np.random.default_rng(4).normal(size=N_SEEN)
    by_name = dict(zip(SEEN, seen, strict=True))
    (first, _), (second, _) = random_layers(len(features), 4, 1)
    biases = [layer[1] for layer in random_layers(len(features), 4, 1)]
    hidden = np.tanh(np.array([by_name[name] for name in features]) @ first + biases[0])
    assert value(network, seen) == pytest.approx(float((hidden @ second + biases[1])[0]), rel=1e-13)


def test_sums_begin_with_the_bias_and_take_the_inputs_in_their_order():
    """To the last bit: in Python, number by number."""
    network = ready(13, 40, 1, activation="relu")
    (first, first_biases), (second, second_biases) = (
        (weights.tolist(), biases.tolist()) for weights, biases in random_layers(13, 40, 1)
    )
    for seed in range(50):
        seen = np.random.default_rng(seed).normal(size=N_SEEN)
        hidden = list(first_biases)
        for number, row in zip(seen.tolist(), first, strict=False):
            hidden = [total + number * weight for total, weight in zip(hidden, row, strict=True)]
        (total,) = second_biases
        for number, (weight,) in zip(hidden, second, strict=True):
            total += max(number, 0.0) * weight
        assert value(network, seen) == total


@pytest.mark.parametrize("activation", ["relu", "tanh"])
@pytest.mark.parametrize("widths", [(13, 1), (13, 4, 1), (13, 7, 1), (13, 72, 1), (13, 3, 30, 2, 9, 1)])
def test_targets_valued_together_have_the_bits_that_they_have_alone(widths, activation):
    network = ready(*widths, activation=activation)
    work = np.full((2, AT_ONCE * widest(network)), np.nan)
    for n in range(1, AT_ONCE + 1):
        seen, values = np.random.default_rng(n).normal(size=(AT_ONCE, N_SEEN)), np.full(n, np.nan)
        seen[n:] = np.inf  # of others, whatever it is
        value_together(network, seen, values, work)
        assert values.tolist() == [value(network, row) for row in seen[:n]]


def test_a_network_without_layers_needs_no_room():
    assert widest(NO_NETWORK) == 0
    assert widest(ready(13, 5, 40, 1, activation="relu")) == 40
    assert widest(ready(13, 5, 1, activation="relu")) == 13


def test_tanh_is_that_of_numpy():
    steps = np.linspace(-25.0, 25.0, 20_001)
    tiny = 10.0 ** np.arange(-300.0, 2.0)
    x = np.concatenate([steps, tiny, -tiny, [0.0, 1e300, -1e300]])
    found = np.array([tanh(one) for one in x.tolist()])
    np.testing.assert_allclose(found, np.tanh(x), rtol=2e-15, atol=0.0)
    assert (found[x == 0.0] == 0.0).all()


@given(st.floats(-40.0, 40.0))
def test_tanh_is_odd(x):
    assert tanh(-x) == -tanh(x)


def test_tanh_has_the_same_bits_everywhere():
    pinned = {
        0.001: "0x1.0624d77516ce2p-10",
        0.1: "0x1.983d7795f4136p-4",
        -0.5: "-0x1.d9353d7568af0p-2",
        1.0: "0x1.85efab514f395p-1",
        2.5: "0x1.f9258260a71c1p-1",
        -7.25: "-0x1.ffffde2760a42p-1",
        18.0: "0x1.ffffffffffffcp-1",
        30.0: "0x1.0000000000000p+0",
    }
    assert {x: tanh(x).hex() for x in pinned} == pinned


def test_tanh_is_exact_arithmetic_rounded():
    """What the kernel does in doubles, in fractions: rounding alone is between them."""
    for x in (0.3, -1.7, 4.0, 11.0):
        part = Fraction(x) / 64
        square = part * part
        up = part * (135135 + square * (17325 + square * (378 + square)))
        down = 135135 + square * (62370 + square * (3150 + square * 28))
        for _ in range(6):
            up, down = 2 * up * down, down * down + up * up
        assert tanh(x) == pytest.approx(float(up / down), rel=1e-15)
