"""Improving a network by rollouts: what is tried out, what is learned, the same for any number of threads, resumed."""

from __future__ import annotations

import math
from collections import Counter
from threading import Event

import numpy as np
import pytest

from fireworld.errors import TrainingError
from fireworld.executors import threads
from fireworld.kernels.fitting import fit_once, gain
from fireworld.policy.teams.network_layers import OF_OTHERS, OWN_SEEN
from fireworld.policy.teams.team import load_team
from fireworld.simulation.state import score_of
from fireworld.training.methods.rollouts import Rollouts
from fireworld.training.options import TriedDecision, try_options
from tests.training.generations import CONDITIONS, SHORT_ROLLOUTS, maker, read
from tests.training.test_search import SetAfter


@pytest.fixture(scope="module")
def make(tmp_path_factory):
    return maker(read(CONDITIONS, tmp_path_factory.mktemp("rollouts")), Rollouts(**SHORT_ROLLOUTS))


def improved(trainer, *, n_threads=1):
    """Improve to the end; return the network and what is kept."""
    list(trainer.run(threads(n_threads)))
    assert trainer.done
    return trainer.newest.tobytes(), trainer.kept.tobytes()


def test_other_seeds_and_hyperparameters_another_network(make):
    changes = ({"n_options": 3}, {"commit": 1}, {"horizon": 3}, {"n_rollouts": 1}, {"rate": 0.1}, {"n_batch": 3})
    changes += ({"n_epochs": 2}, {"temperature": 1.0}, {"share": 0.5}, {"n_brigades": 1}, {"start": "none"})
    networks = [improved(make())[0], improved(make(seed=2))[0], *(improved(make(**one))[0] for one in changes)]
    assert len({*networks}) == len(networks)


@pytest.mark.parametrize(("n_looks", "n_done"), [(1, 0), (9, 0), (30, 0), (120, 1)])
def test_stopped_and_resumed(make, n_looks, n_done):
    whole, trainer = make(), make()
    reports = list(whole.run(threads(1)))
    done = list(trainer.run(threads(1, stop=SetAfter(n_looks))))
    assert len(done) <= n_done
    second = make()
    second.restore(trainer.team(), trainer.state(), source="t.npz")
    assert list(second.run(threads(1))) == reports[len(done) :]
    assert second.team().to_bytes() == whole.team().to_bytes()
    assert improved(second) == improved(whole)


@pytest.mark.parametrize("hidden", [3, 0])
def test_the_team_is_the_mean_of_the_last_networks(make, hidden):
    trainer = make(hidden=hidden, n_generations=3, n_averaged=2)
    networks = [trainer.newest]
    for _ in trainer:
        networks.append(trainer.newest)
        of_each = [trainer.method.layers_of(one) for one in networks[-2:]]
        seen = np.random.default_rng(1).normal(size=(50, 26))
        values = [by_layers(layers, seen) for layers in (*of_each, trainer.team().layers)]
        assert values[2] == pytest.approx((values[0] + values[1]) / 2)
        assert not np.allclose(values[0], values[1])
    assert len({one.tobytes() for one in networks}) == 4


def by_layers(layers, seen):
    """The values of a network of one hidden layer, or of none."""
    for layer in layers[:-1]:
        seen = np.maximum(seen @ layer.weights + layer.biases, 0.0)
    return (seen @ layers[-1].weights + layers[-1].biases)[:, 0]


def test_curves(make):
    trainer = make()
    for report in trainer:
        found = trainer.points(report)
        assert {*found} == {*trainer.plots, *trainer.own_plots()}
        assert {*found["conditions"]} == {"usual", "many"}
        assert math.isclose(math.fsum(found["conditions"].values()) / 2, report.score_mean)
        assert found["check"] == {"": report.score_checked}


def test_the_conditions_come_in_turn(make):
    trainer = make()
    report = next(iter(trainer))
    (record,) = trainer.records()
    assert Counter(trainer.curriculum.scenarios[fire].brigades.n for fire in record.fire) == {2: 3, 4: 3}
    assert len({*record.seed.tolist()}) == 6
    assert record.n_tried.sum() == report.n_decisions


def tried_in(make, *, share=1.0, **changes):
    """What is tried out in one fight of the team that a training begins with."""
    trainer = make(share=share, **changes)
    built = trainer._cities.build(trainer.curriculum.scenarios[-1])
    world = built.world(seed=5, n_steps_max=20)
    return world, try_options(world, trainer.policy_of(trainer.newest), trainer.method.trial, Event())


def test_trying_options_out_changes_no_fight(make):
    world, found = tried_in(make)
    trainer = make()
    alone = trainer._cities.build(trainer.curriculum.scenarios[-1]).world(seed=5, n_steps_max=20)
    alone.run(trainer.policy_of(trainer.newest).for_brigades(alone.n_brigades))
    assert world.digest() == alone.digest()
    assert len(found) > 5


def test_what_was_chosen_comes_first_and_is_worth_nothing_more(make):
    _, found = tried_in(make)
    weights = load_team("best-2026").weights[0, :13]
    for decision in found:
        assert decision.worth[0] == 0.0
        assert decision.seen.shape == (len(decision.worth), 30)
        assert 2 <= len(decision.worth) <= 4
        values = decision.seen[:, :13] @ weights
        assert values[0] >= values.max() - 1e-9, "the team prefers what it chose"
    assert any(decision.worth.any() for decision in found)


def test_likely_options_are_those_that_the_team_values_next(make):
    _, drawn = tried_in(make)
    _, likely = tried_in(make, n_likely=2)
    weights = load_team("best-2026").weights[0, :13]
    values = [decision.seen[:, :13] @ weights for decision in likely]
    assert all((one[:-1] >= one[1:] - 1e-9).all() for one in (value[:3] for value in values))
    assert any(one[3:].size and one[3] < one[2] for one in values)
    assert len(drawn) == len(likely)
    assert any(not np.array_equal(one.seen, other.seen) for one, other in zip(drawn, likely, strict=True))


@pytest.mark.parametrize("hidden", [72, 80])
def test_it_may_start_with_a_shipped_network(make, hidden):
    trainer, team = make(start="best", hidden=hidden, n_averaged=1), load_team("best")
    assert trainer.team().widths == (26, hidden, 1)
    assert trainer.identity["start"] == team.digest
    seen = np.random.default_rng(1).normal(size=(50, 26))
    assert by_layers(trainer.team().layers, seen) == pytest.approx(by_layers(team.layers, seen))
    if hidden == 72:
        assert trainer.team().digest == team.digest


@pytest.mark.parametrize("hidden", [3, 0])
def test_without_cooperation_nobody_sees_what_others_go_for(make, hidden):
    trainer = make(cooperation=False, hidden=hidden)
    assert {*OWN_SEEN} > OF_OTHERS
    assert trainer.team().features == tuple(name for name in OWN_SEEN if name not in OF_OTHERS)
    ranking = dict(zip(OWN_SEEN, load_team("best-2026").weights[0, :13], strict=False))
    seen = np.random.default_rng(1).normal(size=(50, 21))
    wanted = seen @ [ranking.get(name, 0.0) for name in trainer.team().features]
    assert by_layers(trainer.team().layers, seen) == pytest.approx(wanted)
    assert improved(trainer)[0] != improved(make(hidden=hidden))[0]
    assert trainer.team().features == trainer.method.features


def test_a_target_that_is_chosen_anyway_is_worth_the_same(make, monkeypatch):
    """Forced to do for one step what it does by itself, a brigade comes to what the team comes to."""
    trainer = make(share=1.0, commit=1)
    built = trainer._cities.build(trainer.curriculum.scenarios[-1])
    from fireworld.training import options

    worths = []
    real = options.Rollouts.tried

    def tried(self, before, step, asked):
        found = real(self, before, step, asked)
        room, seed = self._room, (1 << 32) + (options.hash_key(self._seed, options.ROLLOUT, 0, step) >> 32)
        forced = self._worth(before, step, asked.brigade, asked.targets[0], seed)
        options.copy_into(room, before)
        self._bound.run(seed, step - 1, step - 1 + self._trial.horizon)
        score = score_of(room)
        worths.append((forced, score.score / score.score_max - 0.005 * score.n_burning))
        return found

    monkeypatch.setattr(options.Rollouts, "tried", tried)
    try_options(built.world(seed=5, n_steps_max=20), trainer.policy_of(trainer.newest), trainer.method.trial, Event())
    assert len(worths) > 5
    assert all(one == other for one, other in worths)


def test_a_network_learns_to_prefer_what_is_worth_more(make):
    """Of made-up decisions: targets are worth what one feature says; the network comes to prefer by that."""
    trainer, random = make(hidden=4, n_epochs=40, rate=0.02, n_batch=20), np.random.default_rng(3)
    decisions = []
    for _ in range(200):
        seen = random.normal(size=(4, 30))
        worth = seen[:, 2] - seen[0, 2]
        decisions.append(TriedDecision(seen, worth))
    numbers, gained = trainer._learned(trainer.newest, decisions)
    most = float(np.mean([one.worth.max() for one in decisions]))
    assert gained > 0.9 * most
    before = trainer._learned(trainer.newest, [])[0]
    assert before.tobytes() == trainer.newest.tobytes()
    assert numbers.tobytes() != before.tobytes()


def test_the_gradient_is_that_of_the_mean_worth(make):
    """By differences: of each number of the network, for options of unequal number."""
    from fireworld.training.decisions import fresh_fitting

    trainer, random = make(hidden=3), np.random.default_rng(4)
    network = trainer.network_of(random.normal(size=len(trainer.newest)))
    seen, worth, n_options = random.normal(size=(3, 4, 30)), random.normal(size=(3, 4)), np.array([4, 2, 3])
    order, temperature = np.array([2, 0, 1]), 0.7

    def mean_worth(number):
        moved = network._replace(number=number)
        return fit_once(moved, seen, worth, n_options, order, 99, temperature, 0.0, fresh_fitting(moved, 4))

    def values(number):
        layers = np.split(number, [3, 3 + 3 * 26, 3 + 3 * 26 + 1])
        reads = network.feature
        hidden = np.maximum(seen[:, :, reads] @ layers[1].reshape(26, 3) + layers[0], 0.0)
        return hidden @ layers[3] + layers[2]

    share = np.exp(values(network.number) / temperature) * (np.arange(4) < n_options[:, np.newaxis])
    share /= share.sum(axis=1, keepdims=True)
    assert mean_worth(network.number.copy()) == pytest.approx((share * worth).sum(axis=1).mean())
    fitting = fresh_fitting(network, 4)
    fit_once(network, seen, worth, n_options, order, 99, temperature, 0.0, fitting)
    gradient = fitting.mean / (1.0 - 0.9)
    for k in random.permutation(len(gradient))[:30]:
        step = np.zeros(len(gradient))
        step[k] = 1e-5
        slope = (mean_worth(network.number + step) - mean_worth(network.number - step)) / 2e-5
        assert gradient[k] == pytest.approx(slope, abs=1e-6)


def test_a_move_is_adams():
    from fireworld.kernels.fitting import move
    from fireworld.training.decisions import fresh_fitting
    from tests.networks import make_network

    network = make_network(own_targets=True).policy().network
    fitting, number = fresh_fitting(network, 2), np.array(network.number)
    wanted, mean, square = number.copy(), np.zeros(len(number)), np.zeros(len(number))
    random = np.random.default_rng(1)
    for batch in range(1, 4):
        fitting.gradient[:] = random.normal(size=len(number))
        gradient = fitting.gradient / 8
        mean, square = 0.9 * mean + 0.1 * gradient, 0.999 * square + 0.001 * gradient**2
        wanted += 0.01 * mean / (1 - 0.9**batch) / (np.sqrt(square / (1 - 0.999**batch)) + 1e-8)
        move(number, 0.01, 8, fitting)
        assert number == pytest.approx(wanted)


def test_what_is_preferred_gains_its_worth(make):
    trainer = make(start="none", hidden=0)
    network = trainer.network_of(np.zeros(27))
    network.number[1 + OWN_SEEN.index(OWN_SEEN[0])] = 1.0
    seen = np.zeros((2, 3, 30))
    seen[0, :, network.feature[0]], seen[1, :, network.feature[0]] = [1, 3, 2], [1, 1, 9]
    worth = np.array([[0.0, 0.5, 9.0], [0.0, 7.0, 9.0]])
    assert gain(network, seen, worth, np.array([3, 2]), np.zeros((2, 26))) == 0.25, "ties: the first"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"hidden": 1}, r"hidden: expected 0, or at least 2, which a ranking takes \(start best-2026\), got 1"),
        ({"start": "paper"}, "start: expected one of best-2026, best, none, got 'paper'"),
        ({"share": 0.0}, "share: expected a number above 0, at most 1, got 0.0"),
        ({"n_fights": 0}, "n_fights: expected a whole number from 1"),
        ({"horizon": 0}, "horizon: "),
        ({"temperature": -1.0}, "temperature: expected a number > 0"),
        ({"n_checks": 0}, "n_checks: "),
        ({"n_averaged": 0}, "n_averaged: expected a whole number from 1"),
        ({"hidden": 100, "n_averaged": 11}, r"n_averaged: expected at most 10 \(with 100 hidden\), got 11"),
    ],
)
def test_hyperparameters_that_make_no_improvement(changes, message):
    with pytest.raises(TrainingError, match=f"^method: {message}"):
        Rollouts(**changes)


@pytest.mark.parametrize(
    ("broken", "wanted"),
    [
        ({"generation": np.array([9])}, "generation: expected a whole number up to 2"),
        ({"kept": np.zeros(3)}, r"kept: expected 255 numbers, got float64 \(3,\)"),
        ({"kept": np.ones(255)}, "kept: expected the numbers of its team, got those of another"),
        ({"check": np.zeros(3)}, "check: expected 1 numbers"),
    ],
)
def test_a_checkpoint_that_makes_no_sense(make, broken, wanted):
    trainer = make()
    with pytest.raises(TrainingError, match=f"^t.npz: {wanted}"):
        trainer.restore(trainer.team(), {**trainer.state(), **broken}, source="t.npz")
