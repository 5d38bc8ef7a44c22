"""The benchmark that says how well a fire must be known: options are tried out in it and in fires nearly alike."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.blurred import BLURS, blurred, found_in, gain, main, together
from benchmarks.blurred_planner import BlurredPlanner
from fireworld.planning.planner import Planner
from fireworld.policy.names import find_policy
from fireworld.policy.teams.team import load_team
from fireworld.simulation.built import CityCache
from fireworld.training.options import Trial
from tests.training.generations import CONDITIONS, read

TRIAL = Trial(share=1.0, n_brigades=1, n_options=4, n_likely=2, n_rollouts=2, commit=6, horizon=20)


@pytest.fixture(scope="module")
def fires(tmp_path_factory):
    curriculum, cities = read(CONDITIONS, tmp_path_factory.mktemp("blurred")), CityCache()
    return [[cities.build(one) for one in stage.scenarios] for stage in curriculum.stages]


def test_heat_and_fuel_of_burning_buildings_alone_are_blurred(fires):
    world = fires[0][0].world(seed=1)
    before = world.state.fire
    burning = (before.fieryness >= 1) & (before.fieryness <= 3)
    after = blurred(world.state, 0.1, np.random.default_rng(1)).fire
    assert burning.any()
    assert (after.energy != before.energy).tolist() == burning.tolist()
    assert np.abs(after.energy[burning] / before.energy[burning] - 1.0).max() < 0.5
    assert (after.fuel <= before.fuel).all()
    assert (after.fuel[~burning] == before.fuel[~burning]).all()
    assert (blurred(world.state, 0.0, np.random.default_rng(1)).fire.energy == before.energy).all()


def test_options_are_tried_out_in_the_fire_twice_and_in_fires_like_it(fires):
    network = load_team("best").policy().network
    found = found_in(fires, network, TRIAL, 12, 1)
    assert len(found) >= 4
    for worths in found:
        assert len(worths) == 2 + len(BLURS)
        assert all(len(worth) == len(worths[0]) and worth[0] == 0.0 for worth in worths)
    itself, again, *others = zip(*found, strict=True)
    assert any((one != other).any() for one, other in zip(itself, again, strict=True)), "other random draws"
    assert all(together(itself, other) != together(itself, again) for other in others)
    again_found = found_in(fires, network, TRIAL, 12, 1)
    assert [[worth.tobytes() for worth in one] for one in again_found] == [
        [worth.tobytes() for worth in one] for one in found
    ]


def test_what_is_gained_is_measured_by_the_other_side():
    by, its = [np.array([0.0, 0.5, 0.1]), np.array([0.0, -0.5])], [np.array([0.0, -0.2, 9.0]), np.array([0.0, 9.0])]
    assert gain(by, its) == pytest.approx(-0.1)
    assert together(by, its) == pytest.approx((-0.1 + 0.9 - 4.5) / 3.0)


def test_a_team_without_a_network(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["blurred", "--team", "chief"])
    with pytest.raises(SystemExit):
        main()
    assert "--team: expected a team with a network, got chief" in capsys.readouterr().err


def fought(built, policy):
    world = built.world(seed=1, n_steps_max=24)
    policy.begin(world.city_arrays, world.n_brigades, world.seed)
    targets = []
    while not (world.terminated or world.truncated):
        world.step(policy)
        targets.append(world.state.brigades.target.tolist())
    return targets


def test_a_planner_that_knows_the_fire_nearly_only(fires):
    (built, *_), exact = fires[0], Planner(over="best")
    assert fought(built, BlurredPlanner(blur=0.0)) == fought(built, exact)
    nearly = BlurredPlanner(blur=0.5)
    found = fought(built, nearly)
    assert found != fought(built, exact)
    assert found == fought(built, nearly), "the same run has the same numbers"


def test_brigades_that_follow_the_team_see_the_fire_as_it_is(fires, monkeypatch):
    """Where following is all that they do, it makes no difference how little the planner knows."""
    (built, *_), best = fires[0], find_policy("best").policy
    monkeypatch.setattr("fireworld.planning.planner.climb", lambda _, starts, *__: min(starts))
    assert fought(built, BlurredPlanner(blur=0.5)) == fought(built, best)
