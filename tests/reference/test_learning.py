"""The compiled episode learns what the plain one learns, however it ends and whatever brigades are bound to."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from fireworld.policy.kernel import from_tables
from fireworld.scenario import load_scenario
from fireworld.simulation.built import build_scenario
from fireworld.simulation.state import fresh_learner
from fireworld.training.methods.sarsa import RULES
from tests.reference import episode
from tests.reference.learning import Learner

RATES = {"alpha": 0.6, "alpha_decay": 0.1, "gamma": 0.7}
EPSILON = 0.3


@cache
def town(choices):
    """Build a small town with four brigades whose tanks run dry."""
    settings = {
        "brigades.n": "4",
        "choices": choices,
        "fires.0.n_buildings": "12",
        "parameters.brigades.tank_litres": "6000",
    }
    built = build_scenario(load_scenario("quick").with_settings(settings))
    scenario, setup = built.scenario, built.placement
    tables = episode.Tables.of_city(
        built.city, scenario.resolved_parameters, unit_volume_m3=scenario.unit_volume_m3, in_turn=choices == "in-turn"
    )
    start = {
        "ignited": setup.ignited,
        "civilian_building": setup.civilian_building,
        "civilian_mm": setup.civilian_mm,
        "brigade_refuge": setup.brigade_refuge,
    }
    return built, tables, start


def learn_twice(*, rule="sarsa", commit=1, n_steps=40, choices="in-turn", shape=(4, 4320, 4), seed=1):
    """Run an episode compiled and plain; return both learners, and whether it terminated."""
    built, tables, start = town(choices)
    begun = np.random.default_rng(seed).normal(scale=50.0, size=shape)
    ready = from_tables(begun.copy(), epsilon=EPSILON, commit=commit).for_brigades(4)
    compiled = fresh_learner(ready.tables, 4, rule=RULES.index(rule), **RATES)
    world = built.world(seed=seed, n_steps_max=n_steps)
    world.run(ready, compiled)
    policy = from_tables(begun.copy(), epsilon=EPSILON, commit=commit)
    plain = Learner(policy.tables, rule, epsilon=EPSILON, **RATES)
    episode.run_episode(
        tables,
        episode.World.at_start(tables, **start),
        policy,
        seed=seed,
        first_step=1,
        last_step=n_steps,
        learner=plain,
    )
    return compiled, plain, world.terminated


@pytest.mark.parametrize(
    "changes",
    [
        *({"rule": rule, "commit": commit} for rule in RULES for commit in (1, 3)),
        *({"commit": 5, "n_steps": n_steps} for n_steps in (1, 2, 3, 4, 5, 6, 12)),
        {"commit": 4, "shape": (1, 270, 4)},
        {"commit": 4, "choices": "simultaneous", "rule": "q-learning"},
        {"commit": 2, "n_steps": 400},
    ],
    ids=str,
)
def test_both_learn_the_same(changes):
    compiled, plain, terminated = learn_twice(**changes)
    assert terminated == (changes.get("n_steps") == 400)
    np.testing.assert_array_equal(compiled.visits, plain.visits)
    np.testing.assert_allclose(compiled.tables, plain.tables, rtol=1e-12)
    assert plain.visits.sum() >= min(4, changes.get("n_steps", 40))
