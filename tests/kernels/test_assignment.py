"""The assignment of brigades to burning buildings: the highest sum, whatever the values."""

from itertools import permutations

import numpy as np
import pytest

from fireworld.kernels.assignment import assign, fresh_assignment, keep_best
from fireworld.policy.kernel import from_assignment, from_rankings
from fireworld.scenario import load_scenario
from fireworld.simulation.built import CityCache


def assigned(value, further):
    """Return the building and place of each row, by the kernel; value (n, k), further (n, k)."""
    n, n_buildings = value.shape
    room = fresh_assignment(n, n_buildings)
    room.value[:], room.further[:] = value, further
    assign(n, n_buildings, room)
    taken = room.taken_by[: n * n_buildings]
    return [divmod(int(np.flatnonzero(taken == row)[0]), n_buildings) for row in range(n)]


def best_sum(value, further):
    n, n_buildings = value.shape
    places = [(place, k) for place in range(n) for k in range(n_buildings)]
    return max(
        sum(value[row, k] + further[place, k] for row, (place, k) in enumerate(chosen))
        for chosen in permutations(places, n)
    )


@pytest.mark.parametrize("seed", range(40))
def test_sum_is_the_highest(seed):
    random = np.random.default_rng(seed)
    n, n_buildings = int(random.integers(1, 4)), int(random.integers(1, 5))
    value = random.normal(size=(n, n_buildings)) * 10.0 ** random.integers(-3, 4)
    further = np.minimum.accumulate(np.vstack([np.zeros(n_buildings), -random.exponential(size=(n - 1, n_buildings))]))
    found = assigned(value, further)
    assert len({*found}) == n, "a place is taken once"
    total = sum(value[row, k] + further[place, k] for row, (place, k) in enumerate(found))
    assert total == pytest.approx(best_sum(value, further), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_what_is_not_kept_is_not_needed(seed):
    random = np.random.default_rng(seed)
    value = random.integers(0, 9, size=(3, 8)).astype(float)
    further = np.minimum.accumulate(np.vstack([np.zeros(8), -random.integers(0, 9, size=(2, 8))]).astype(float))
    room = fresh_assignment(3, 8)
    room.value[:] = value
    n_kept = keep_best(3, 8, room)
    kept = room.building[:n_kept]
    assert 3 <= n_kept <= 8
    assert [*kept] == sorted({*kept})
    np.testing.assert_array_equal(room.value[:, :n_kept], value[:, kept])
    assert best_sum(value[:, kept], further[:, kept]) == best_sum(value, further)


def test_all_go_to_one_building_if_further_places_cost_nothing():
    value = np.array([[1.0, 0.5], [1.0, 0.5], [1.0, 0.5]])
    assert {k for _, k in assigned(value, np.zeros((3, 2)))} == {0}


def test_each_to_another_if_further_places_cost_much():
    """In turn the first would take what only the second can do well."""
    value = np.array([[1.0, 0.9], [1.0, 0.0]])
    further = np.array([[0.0, 0.0], [-5.0, -5.0]])
    assert assigned(value, further) == [(0, 1), (0, 0)]


def test_a_team_of_one_does_as_by_the_ranking_itself():
    """Alone there is nothing to assign: the best building of the ranking, and the whole run is the same."""
    weights = np.random.default_rng(3).normal(size=17)
    built = CityCache().build(load_scenario("test-1").with_values({"brigades.n": 1, "steps": 60}))
    outcomes = []
    for policy in (from_assignment(weights), from_rankings(weights[np.newaxis], own_targets=True)):
        world = built.world(seed=4)
        world.run(policy.for_brigades(1))
        outcomes.append(world.outcome)
    assert outcomes[0] == outcomes[1]


def test_brigades_that_value_all_alike_spread_as_the_weight_of_enough_says():
    """With a dislike of targets that are taken care of, four brigades go for more buildings than without."""
    built, taken = CityCache().build(load_scenario("test-1")), []
    for enough in (0.0, -100.0):
        weights = np.zeros(17)
        weights[10], weights[12] = enough, enough
        world = built.world(seed=4)
        policy = from_assignment(weights)
        world.step(policy)
        taken.append(len({*world.state.brigades.target.tolist()}))
    assert taken[0] < taken[1] == 4
