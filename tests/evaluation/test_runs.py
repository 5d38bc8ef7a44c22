"""Outcomes of many seeds: those of the runs one by one, whatever the number of threads."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld.evaluation.runs import evaluate
from fireworld.executors import threads
from fireworld.outcome import COLUMNS
from fireworld.policy.names import BUILT_IN, find_policy
from fireworld.scenario import load_scenario
from fireworld.simulation.built import build_scenario
from fireworld.simulation.prepared_run import prepare_run

SEEDS = [3, 1, 4]


@pytest.fixture(scope="module")
def built():
    return build_scenario(load_scenario("quick").with_settings({"steps": "60"}))


def test_outcomes_are_those_of_recorded_runs(built):
    found = evaluate(built, BUILT_IN["nearest-to-me"](), SEEDS)
    for place, seed in enumerate(SEEDS):
        last = [*prepare_run(built, find_policy("nearest-to-me"), seed=seed)][-1]
        assert found.seed[place] == seed
        assert found.score[place] == last.score.score
        assert found.score_max[place] == last.score.score_max == 5
        assert found.n_burnt_out[place] == last.score.n_burnt_out
        assert found.steps[place] == last.step
        assert found.completed[place] == last.terminated
        assert found.n_civilians_alive[place] == last.score.n_civilians_alive
        assert found.total_reward[place] == last.rewards.sum_so_far
        assert found.water_used_litres[place] == last.score.water_used_litres
    assert found.score_share.tolist() == [score / 5 for score in found.score.tolist()]


def test_threads_change_nothing(built):
    one = evaluate(built, BUILT_IN["random"](), range(8))
    many = evaluate(built, BUILT_IN["random"](), range(8), workers=threads(3))
    assert len(set(one.total_reward.tolist())) > 4
    for quantity in ("seed", *COLUMNS.values()):
        np.testing.assert_array_equal(getattr(one, quantity), getattr(many, quantity))
