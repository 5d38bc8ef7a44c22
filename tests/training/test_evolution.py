"""Evolving a network: what it starts with, that it is the same for any number of threads, resumed, replayed."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest

from fireworld.draws import WEIGHT
from fireworld.errors import TrainingError
from fireworld.executors import threads
from fireworld.kernels.draws import normal
from fireworld.policy.teams.network_layers import OWN_SEEN, pack
from fireworld.policy.teams.network_team import NetworkTeam
from fireworld.policy.teams.team import load_team
from fireworld.scenario import load_scenario
from fireworld.training.methods.evolution import Evolution, centred_ranks
from tests.networks import make_network
from tests.training.generations import CONDITIONS, SHORT_EVOLUTION, decisions, maker, read
from tests.training.test_search import SetAfter


@pytest.fixture(scope="module")
def fires(tmp_path_factory):
    return read(CONDITIONS, tmp_path_factory.mktemp("evolution"))


@pytest.fixture(scope="module")
def make(fires):
    return maker(fires, Evolution(**SHORT_EVOLUTION))


def evolved(trainer, *, n_threads=1):
    """Evolve to the end; return the mean, the direction and what is kept."""
    list(trainer.run(threads(n_threads)))
    assert trainer.done
    return tuple(
        array.tobytes() for array in (trainer.progress.mean, trainer.progress.direction, trainer.progress.kept)
    )


def test_other_seeds_and_hyperparameters_another_evolution(make):
    variants = (
        {},
        {"seed": 2},
        {"start": "none"},
        {"n_fires": 2},
        {"noise": 0.2},
        {"rate": 1.0},
        {"momentum": 0.0},
        {"n_pairs": 3},
        {"n_steps_max": 5},
    )
    assert len({evolved(make(**variant))[0] for variant in variants}) == len(variants)


@pytest.mark.parametrize("hidden", [0, 2, 12])
@pytest.mark.parametrize("name", ["quick", "test-2"])
def test_it_starts_with_what_the_best_ranking_does(make, hidden, name):
    team = make(hidden=hidden).team()
    assert isinstance(team, NetworkTeam)
    assert team.widths == ((26, hidden, 1) if hidden else (26, 1))
    scenario = load_scenario(name)
    assert decisions(team.policy(), scenario) == decisions(load_team("best-2026").policy(), scenario)


def test_without_a_start_all_targets_are_worth_the_same(make):
    team = make(start="none").team()
    assert not team.layers[-1].weights.any()
    assert team.layers[0].weights.any(), "hidden weights are drawn"
    assert "start" not in make(start="none").identity
    assert make().identity["start"] == load_team("best-2026").digest


@pytest.mark.parametrize(
    ("start", "hidden", "wanted"),
    [
        (make_network(own_targets=True), 0, "start: expected one ranking of own targets, got a net"),
        (
            make_network(own_targets=True),
            12,
            "start: expected a network of own targets with one hidden layer, relu, got a",
        ),
        (load_team("paper-cooperative"), 12, "start: expected one ranking of own targets, got "),
        (load_team("best"), 12, r"hidden: expected at least 72 \(start best-2026\), got 12"),
    ],
)
def test_a_start_that_no_such_network_can_be(make, monkeypatch, start, hidden, wanted):
    monkeypatch.setattr("fireworld.training.networks.load_team", lambda _: start)
    with pytest.raises(TrainingError, match=f"^method: {wanted}"):
        make(hidden=hidden)


@pytest.mark.parametrize("n_threads", [1, 2])
@pytest.mark.parametrize(("n_looks", "n_done"), [(1, 0), (6, 0), (13, 0), (18, 0), (22, 0), (23, 1), (36, 1), (40, 1)])
def test_stopped_within_a_generation_and_resumed(make, n_looks, n_done, n_threads):
    """A generation looks once, and for 4 x 3 fights and 5 of a check; the first one has two checks."""
    whole, trainer = make(), make()
    reports = list(whole.run(threads(1)))
    assert list(trainer.run(threads(n_threads, stop=SetAfter(n_looks)))) == reports[:n_done]
    second = make()
    second.restore(trainer.team(), trainer.state(), source="t.npz")
    assert list(second.run(threads(n_threads))) == reports[n_done:]
    assert second.team().to_bytes() == whole.team().to_bytes()
    assert evolved(second) == evolved(whole)


def test_one_generation_by_hand(make, monkeypatch):
    """The direction is the noise of each pair, as much as the one fared better than the other, by their ranks."""
    trainer = make(n_generations=1, momentum=0.25, rate=2.0, noise=0.5, n_fires=5, check_every=9)
    start = trainer.progress.mean
    tried = []

    def fight(numbers, fire, _seed):
        tried.append(numbers)
        return (numbers[5] + 10 * (fire >= 3)) / 20

    monkeypatch.setattr(trainer, "_fight", fight)
    monkeypatch.setattr(trainer, "_fight_to_the_end", fight)
    (report,) = trainer.run(threads(1))
    n = len(start)
    noise = np.array([[normal(1, WEIGHT, row * n + k, 0) for k in range(n)] for row in range(2)])
    noise[:, -4] = 0.0  # the last layer is a bias and three weights
    candidates = [start + 0.5 * noise[0], start + 0.5 * noise[1], start - 0.5 * noise[0], start - 0.5 * noise[1]]
    assert np.array(tried[:20:5]) == pytest.approx(np.array(candidates))
    values = [one[5] for one in candidates]
    rank = [sorted(values).index(one) / 3 for one in values]
    new = ((rank[0] - rank[2]) * noise[0] + (rank[1] - rank[3]) * noise[1]) / 2
    assert trainer.progress.direction == pytest.approx(0.75 * new)
    assert trainer.progress.mean == pytest.approx(start + 2.0 * 0.75 * new)
    assert report.score_best == pytest.approx(max(values) / 20 + 0.25), "both conditions count equally: 3 fires and 2"
    assert report.score_mean == pytest.approx(np.mean(values) / 20 + 0.25)
    better = trainer.progress.mean[5] > start[5]
    assert (trainer.progress.kept == (trainer.progress.mean if better else start)).all()
    assert better
    assert report.score_kept == report.score_checked == pytest.approx(trainer.progress.mean[5] / 20 + 0.25)


def test_the_start_is_kept_until_something_is_better(make, monkeypatch):
    trainer = make(n_generations=7, check_every=3)
    start = trainer.progress.mean.copy()
    n_checks = 0

    def score(_pool, _stop, numbers):
        nonlocal n_checks
        n_checks += 1
        return 1.0 if (numbers == start).all() else 0.5

    monkeypatch.setattr(trainer, "_score_on_all", score)
    monkeypatch.setattr(trainer, "_fight", lambda numbers, *_: numbers[0] / 100)
    reports = list(trainer)
    assert n_checks == 4, "of the start, and after the generations 3, 6 and 7"
    assert [report.score_checked for report in reports] == [1.0, 1.0, 0.5, 0.5, 0.5, 0.5, 0.5]
    assert {report.score_kept for report in reports} == {1.0}
    assert (pack(trainer.team().layers, ("relu",), OWN_SEEN).number == start).all()
    assert (trainer.progress.mean != start).any()


def test_all_candidates_meet_the_same_fires_of_all_conditions(make, monkeypatch):
    trainer = make(n_generations=6, n_pairs=1, check_every=99)
    fought = []
    monkeypatch.setattr(trainer, "_score_on_all", lambda *_: 0.5)
    monkeypatch.setattr(trainer, "_fight", lambda _, *fire: fought.append(fire) or 0.5)
    list(trainer)
    generations = [fought[k : k + 6] for k in range(0, 36, 6)]
    assert all(one[:3] == one[3:] for one in generations)
    n_usual = [sum(fire < 3 for fire, _ in one[:3]) for one in generations]
    assert n_usual == [2, 1, 2, 1, 2, 1], "the third fire goes to the conditions in turn"
    assert len({*fought}) == 18, "other draws in every generation"
    assert len(Counter(fire for fire, _ in fought)) == 5
    assert trainer.progress.mean.tolist() == make().progress.mean.tolist(), "who all fare alike go nowhere"


def test_checks_are_fought_to_the_end(make, fires, monkeypatch):
    longest = {"fight": 0, "check": 0}

    def score(_numbers, world):
        of_check = world.n_steps_max == fires.scenarios[0].steps
        longest["check" if of_check else "fight"] = max(longest["check" if of_check else "fight"], world.n_steps_max)
        return 0.5

    trainer = make()
    monkeypatch.setattr(trainer, "_score", score)
    list(trainer)
    assert longest == {"fight": 25, "check": 100}


def test_curves(make):
    trainer = make()
    for report in trainer:
        found = trainer.points(report)
        assert {*found} == {*trainer.plots, *trainer.own_plots()}
        assert {*found["conditions"]} == {"usual", "many"}
        assert math.isclose(math.fsum(found["conditions"].values()) / 2, report.score_mean)
        assert trainer.numbers(report)["conditions/usual"] == found["conditions"]["usual"]
        assert report.score_kept >= report.score_checked


def test_centred_ranks():
    assert centred_ranks([0.2, 0.9, 0.1]) == [0.0, 0.5, -0.5]
    assert centred_ranks([0.5, 0.5, 0.7, 0.1]) == pytest.approx([0.0, 0.0, 0.5, -0.5])
    assert centred_ranks([0.5, 0.5]) == [0.0, 0.0]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"hidden": 1}, r"hidden: expected 0, or at least 2, which a ranking takes \(start best-2026\), got 1"),
        ({"hidden": 257}, "hidden: expected a whole number from 0 to 256, got 257"),
        ({"start": "paper"}, "start: expected one of best-2026, none, got 'paper'"),
        ({"n_generations": 0}, "n_generations: expected a whole number from 1 to 1000000, got 0"),
        ({"n_pairs": 0}, "n_pairs: expected a whole number from 1"),
        ({"n_fires": 0}, "n_fires: "),
        ({"n_steps_max": -1}, "n_steps_max: "),
        ({"noise": 0.0}, "noise: expected a number > 0, got 0.0"),
        ({"rate": float("nan")}, "rate: expected a number > 0, got nan"),
        ({"momentum": 1.0}, "momentum: expected a number from 0, below 1, got 1.0"),
        ({"check_every": 0}, "check_every: expected a whole number from 1"),
    ],
)
def test_hyperparameters_that_make_no_evolution(changes, message):
    with pytest.raises(TrainingError, match=f"^method: {message}"):
        Evolution(**changes)
    assert Evolution(hidden=1, start="none").hidden == 1


@pytest.mark.parametrize(
    ("broken", "wanted"),
    [
        ({"generation": np.array([9])}, "generation: expected a whole number up to 2"),
        ({"mean": np.zeros(3)}, r"mean: expected 85 numbers, got float64 \(3,\)"),
        ({"direction": np.full(85, np.nan)}, "direction"),
        ({"checks": np.zeros(3)}, "checks: expected 2 numbers"),
    ],
)
def test_a_checkpoint_that_makes_no_sense(make, broken, wanted):
    trainer = make()
    with pytest.raises(TrainingError, match=f"^t.npz: {wanted}"):
        trainer.restore(trainer.team(), {**trainer.state(), **broken}, source="t.npz")
