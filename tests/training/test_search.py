"""Searching the weights of a ranking: the same for any number of threads, stopped and resumed, and worth it."""

from __future__ import annotations

from threading import Event

import numpy as np
import pytest

from fireworld.errors import TrainingError
from fireworld.executors import threads
from fireworld.kernels.ranking import N_OF_TEAM, N_TARGET_FEATURES, N_WEIGHTS
from fireworld.policy.kernel import from_rankings
from fireworld.policy.teams.ranking_words import WEIGHTS
from fireworld.simulation.built import build_scenario
from fireworld.training.methods.search import Search
from tests.training.generations import maker, read

FIRES = """
stages:
  - name: fires
    cooperation: true
    base: quick
    each:
      - {fires.0.n_buildings: 4}
      - {fires.0.n_buildings: 6}
      - {fires.0.n_buildings: 7}
"""
SHORT = {"n_generations": 3, "n_candidates": 6, "n_best": 2, "n_fires": 2, "n_steps_max": 30}
TEAM = [weight.name in {"others_here", "others_near", "enough"} for weight in WEIGHTS]
ACTIONS = [False] * N_TARGET_FEATURES + [True] * 4


@pytest.fixture(scope="module")
def fires(tmp_path_factory):
    """Three fires that six rules cannot all hold, with a town that is built once."""
    return read(FIRES, tmp_path_factory.mktemp("search"))


@pytest.fixture(scope="module")
def make(fires):
    return maker(fires, Search(**SHORT))


def found(searcher, *, n_threads=1):
    """Search to the end; return the weights."""
    reports = list(searcher.run(threads(n_threads)))
    assert [report.generation for report in reports] == list(range(searcher.method.n_generations))
    return searcher.team().weights


def test_the_same_weights_whatever_the_number_of_threads(make):
    one, three = (make(), make())
    reports = [list(searcher.run(threads(n))) for searcher, n in ((one, 1), (three, 3))]
    assert reports[0] == reports[1]
    assert one.team().weights.tobytes() == three.team().weights.tobytes()
    assert one.progress.spread.tobytes() == three.progress.spread.tobytes()


def test_other_seeds_and_hyperparameters_other_weights(make):
    variants = ({}, {"seed": 2}, {"n_fires": 1}, {"n_steps_max": 20}, {"step": 0.5}, {"spread": 2.0}, {"n_best": 3})
    assert len({found(make(**variant)).tobytes() for variant in variants}) == len(variants)


class SetAfter(Event):
    """Becomes set when it has been looked at so many times: at the start of every generation and of every fight."""

    def __init__(self, n_looks):
        super().__init__()
        self._left = n_looks

    def is_set(self):
        self._left -= 1
        if self._left < 0:
            self.set()
        return super().is_set()


@pytest.mark.parametrize("n_threads", [1, 2])
@pytest.mark.parametrize(("n_looks", "n_done"), [(1, 0), (6, 0), (12, 0), (14, 1), (25, 1), (30, 2)])
def test_stopped_within_a_generation_and_resumed(make, n_looks, n_done, n_threads):
    """A generation is 6 x 2 fights, 13 looks: one that was left off is as if it had not begun."""
    whole, searcher = make(), make()
    reports = list(whole.run(threads(1)))
    first = list(searcher.run(threads(n_threads, stop=SetAfter(n_looks))))
    assert first == reports[:n_done]
    assert searcher.progress.generation == n_done
    if not n_done:
        assert not searcher.team().weights.any()
    assert list(searcher.run(threads(n_threads))) == reports[n_done:]
    assert searcher.done
    assert searcher.team().weights.tobytes() == whole.team().weights.tobytes()
    assert list(searcher.run(threads(1))) == [], "it is done"


def test_stopped_at_once_nothing_is_found(make):
    stop = Event()
    stop.set()
    searcher = make()
    assert list(searcher.run(threads(2, stop=stop))) == []
    assert not searcher.team().weights.any()
    assert searcher.team().provenance["generations_done"] == 0


@pytest.mark.parametrize(
    ("changes", "at_zero"),
    [
        ({}, ACTIONS),
        ({"own_targets": False}, [False] * N_WEIGHTS),
        ({"cooperation": False}, [a or b for a, b in zip(TEAM, ACTIONS, strict=True)]),
        ({"cooperation": False, "own_targets": False}, TEAM),
    ],
)
def test_what_is_not_searched_for_stays_zero(make, changes, at_zero):
    assert sum(TEAM) == N_OF_TEAM
    searcher = make(**changes)
    weights = found(searcher)
    assert weights.shape == (1, N_WEIGHTS)
    assert (weights[0] == 0.0).tolist() == at_zero
    assert (searcher.progress.spread == 0.0).tolist() == at_zero
    assert searcher.team().own_targets == changes.get("own_targets", True)


def test_what_a_ranking_tells_of_its_origin(make, fires):
    searcher = make(seed=7)
    found(searcher)
    told = searcher.team().provenance
    assert (told["seed"], told["generations_done"]) == (7, 3)
    assert told["curriculum"] == {"name": "fires", "digest": fires.digest}
    assert told["method"] == {"name": "search", **Search(**SHORT).as_dict()}


def share_of_score(weights, fires, *, seeds=range(50, 58)):
    """The mean score of a ranking, as a share of the maximum, with random draws that nobody searched with."""
    shares = []
    for scenario in fires.stages[0].scenarios:
        built = build_scenario(scenario.with_settings({"steps": "40"}))
        for seed in seeds:
            world = built.world(seed=seed)
            world.run(from_rankings(weights, own_targets=True).for_brigades(world.n_brigades))
            shares.append(world.state.outcome.score[0] / world.state.outcome.score[1])
    return np.mean(shares)


def test_searching_is_worth_it(make, fires):
    """Weights of zero go for the lowest id, and lose a quarter; those found lose next to nothing, with new draws."""
    searcher = make(n_generations=4, n_candidates=12, n_best=3, n_fires=3, n_steps_max=40)
    reports = list(searcher.run(threads(2)))
    assert reports[-1].score_mean > reports[0].score_mean + 0.1
    assert reports[-1].spread < reports[0].spread
    assert all(report.score_best >= report.score_mean for report in reports)
    assert share_of_score(np.zeros((1, N_WEIGHTS)), fires) < 0.8
    assert share_of_score(searcher.team().weights, fires) > 0.95


def test_one_generation_by_hand(make, monkeypatch):
    """Of six candidates the two that fare best: mean and spread go half of the way to theirs."""
    searcher = make(n_generations=1, step=0.5, spread=2.0, spread_least=1.1)
    tried = {}

    def fight(weights, fire, _seed):
        tried[weights.tobytes()] = weights
        return weights[3] + fire

    monkeypatch.setattr(searcher, "_fight", fight)
    (report,) = searcher.run(threads(1))
    candidates = np.array(sorted(tried.values(), key=lambda weights: -weights[3]))
    assert candidates.shape == (6, N_WEIGHTS)
    assert len(set(candidates[:, 3])) == 6
    best = candidates[:2]
    assert searcher.progress.mean == pytest.approx(0.5 * best.mean(axis=0))
    spread = np.maximum(0.5 * 2.0 + 0.5 * best.std(axis=0), 1.1)
    spread[N_TARGET_FEATURES:] = 0.0
    assert searcher.progress.spread == pytest.approx(spread)
    assert report.spread == pytest.approx(spread[:N_TARGET_FEATURES].mean())
    assert report.score_best - report.score_mean == pytest.approx(best[:, 3].mean() - candidates[:, 3].mean())


class Fires:
    """Notes which fires are fought, instead of fighting them."""

    def __init__(self, searcher, monkeypatch):
        self.fought = []
        monkeypatch.setattr(searcher, "_fight", self)

    def __call__(self, weights, fire, seed):
        self.fought.append(fire)
        return 0.0


def test_all_candidates_meet_the_same_fires_drawn_anew_and_never_twice(make, monkeypatch):
    searcher = make(n_generations=20, n_candidates=2, n_best=1)
    fought = Fires(searcher, monkeypatch).fought
    list(searcher.run(threads(1)))
    generations = [fought[k : k + 4] for k in range(0, 80, 4)]
    assert all(fires[:2] == fires[2:] and fires[0] != fires[1] for fires in generations)
    assert {tuple(sorted(fires[:2])) for fires in generations} == {(0, 1), (0, 2), (1, 2)}
    many = make(n_fires=99, n_generations=1, n_candidates=1, n_best=1)
    fought = Fires(many, monkeypatch).fought
    list(many.run(threads(1)))
    assert sorted(fought) == [0, 1, 2], "no more than there are"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"n_generations": 0}, "method: n_generations: expected a whole number from 1 to 1000000, got 0"),
        ({"n_candidates": 0}, "method: n_candidates: expected a whole number from 1"),
        ({"n_best": 0}, "method: n_best: expected a whole number from 1"),
        ({"n_best": 49}, "method: n_best: expected at most n_candidates, 48, got 49"),
        ({"n_fires": -1}, "method: n_fires: "),
        ({"n_steps_max": 1_000_001}, "method: n_steps_max: "),
        ({"step": 0.0}, "method: step: expected a number above 0, at most 1, got 0.0"),
        ({"step": 1.1}, "method: step: "),
        ({"step": float("nan")}, "method: step: "),
        ({"spread": 0.0}, "method: spread: expected a number > 0, got 0.0"),
        ({"spread": float("inf")}, "method: spread: "),
        ({"spread_least": -0.1}, "method: spread_least: expected a number > 0, got -0.1"),
    ],
)
def test_hyperparameters_that_make_no_search(changes, message):
    with pytest.raises(TrainingError, match=f"^{message}"):
        Search(**changes)


def test_hyperparameters_set_by_hand():
    search = Search().with_settings({"n_fires": "5", "step": "0.25", "own_targets": "false", "cooperation": "true"})
    assert search == Search(n_fires=5, step=0.25, own_targets=False)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"n_fire": "3"}, "--set: n_fire: expected one of own_targets, cooperation, n_generations, .*, got 'n_fire'"),
        ({"n_fires": "3.5"}, "--set: n_fires: expected a whole number, got '3.5'"),
        ({"n_fires": "9" * 5000}, "--set: n_fires: expected a whole number, got "),
        ({"step": "fast"}, "--set: step: expected a number, got 'fast'"),
        ({"own_targets": "yes"}, "--set: own_targets: expected true or false, got 'yes'"),
        ({"step": "nan"}, "method: step: expected a number above 0"),
        ({"n_best": "50"}, "method: n_best: expected at most n_candidates, 48, got 50"),
    ],
)
def test_hyperparameters_that_cannot_be_set(settings, message):
    with pytest.raises(TrainingError, match=f"^{message}") as caught:
        Search().with_settings(settings)
    assert "\n" not in str(caught.value)
