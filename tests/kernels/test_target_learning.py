"""How a network of targets is learned: its gradient, what a choice is compared with, and the updates by hand."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld.kernels.network import value_by_network, widest
from fireworld.kernels.situation import N_SEEN
from fireworld.kernels.target_learning import explored_place, go_for_and_learn, learn_target, value_and_gradient
from fireworld.policy.teams.network_layers import FEATURES, Layer, pack
from fireworld.simulation.state import fresh_learner, fresh_target_learner
from tests.networks import random_layers

ALPHA, GAMMA, DECAY = 0.1, 0.9, 0.7


def ready(*widths, activation="tanh", seed=8):
    layers = [Layer(*layer) for layer in random_layers(*widths, seed=seed)]
    return pack(layers, [activation] * (len(layers) - 1), FEATURES)


def learner_of(network, state_weight=None, *, n_brigades=1, commit=1):
    of_targets = fresh_target_learner(
        network, np.zeros(N_SEEN) if state_weight is None else state_weight, n_brigades, decay=DECAY, commit=commit
    )
    return fresh_learner(np.zeros((1, 1, 4)), n_brigades, alpha=ALPHA, gamma=GAMMA)._replace(of_targets=of_targets)


@pytest.mark.parametrize("activation", ["tanh", "relu"])
@pytest.mark.parametrize("widths", [(13, 1), (13, 5, 1), (13, 7, 6, 1), (13, 9, 8, 7, 1)])
def test_the_gradient_is_that_of_small_changes(widths, activation):
    network = ready(*widths, activation=activation)
    learner, seen = learner_of(network).of_targets, np.random.default_rng(2).normal(size=N_SEEN)

    def value():
        return value_by_network(network, seen, np.zeros((2, widest(network))))

    assert value_and_gradient(network, seen, learner) == value()
    gradient, step = learner.gradient.copy(), 1e-6
    for k in range(len(network.number)):
        before = network.number[k]
        network.number[k] = before + step
        up = value()
        network.number[k] = before - step
        down = value()
        network.number[k] = before
        assert gradient[k] == pytest.approx((up - down) / (2 * step), rel=1e-5, abs=1e-8)
    assert np.count_nonzero(gradient) > len(gradient) // 10


def test_updates_are_those_of_sarsa_with_traces():
    """Three choices of one brigade and the end, in numpy: a network of one layer, so that its gradient is plain."""
    random = np.random.default_rng(5)
    network, weight = ready(13, 1), random.normal(size=N_SEEN)
    learner = learner_of(network, weight.copy())
    theta, trace, state_trace = network.number.copy(), 0.0, 0.0
    before = None
    for reward in (-3.0, 1.5, -0.25):
        seen, mean = random.normal(size=(2, N_SEEN))
        mean_gradient, mean_value = random.normal(size=14), float(random.normal())
        learner.of_targets.state_seen[:] = mean
        learner.of_targets.mean_gradient[:] = mean_gradient
        learner.of_targets.mean_value[0] = mean_value
        go_for_and_learn(0, seen, network, learner)
        gradient = np.concatenate([[1.0], seen[:13]])
        value = gradient @ theta - mean_value + weight @ mean
        gradient = gradient - mean_gradient
        if before is not None:
            came, was = before
            error = came + GAMMA * value - was
            assert learner.td_error[0] == pytest.approx(error, rel=1e-12)
            theta, weight = theta + ALPHA * error * trace, weight + ALPHA * error * state_trace
        kept = GAMMA * DECAY if before is not None else 0.0
        size = 1.0 + gradient @ gradient + mean @ mean
        trace, state_trace = kept * trace + gradient / size, kept * state_trace + mean / size
        assert network.number == pytest.approx(theta, rel=1e-12)
        assert learner.of_targets.state_weight == pytest.approx(weight, rel=1e-12)
        learner.reward[0], learner.discount[0] = reward, GAMMA
        before = reward, value
    learn_target(0, 0.0, network, learner)
    error = before[0] - before[1]
    assert network.number == pytest.approx(theta + ALPHA * error * trace, rel=1e-12)


def test_who_has_chosen_nothing_learns_nothing():
    network = ready(13, 4, 1)
    learner, before = learner_of(network), network.number.copy()
    learn_target(0, 5.0, network, learner)
    assert (network.number == before).all()


def test_exploring_is_drawn_as_often_as_it_should_be_and_evenly():
    drawn = np.array([explored_place(1, 4, 9, 0.3, 77, step) for step in range(20_000)])
    assert np.mean(drawn >= 0) == pytest.approx(0.3, abs=0.01)
    counts = np.bincount(drawn[drawn >= 0], minlength=9)
    assert counts[:4].sum() == 0
    assert counts[4:] == pytest.approx(counts.sum() / 5, rel=0.08)
    assert (np.array([explored_place(1, 4, 9, 0.0, 77, step) for step in range(100)]) == -1).all()
