"""What a world keeps of the ways it has looked for changes nothing but its speed."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld.kernels.arrays import GOAL
from fireworld.simulation import ways
from fireworld.simulation.state import copy_into, copy_world, named_arrays, take_snapshot
from tests.simulation.town import POLICIES, play, policy_named, town_world


@pytest.fixture(params=[0, 1 << 20], ids=["two-kept", "as-many-as-brigades"])
def on_demand(request, monkeypatch):
    """Let all cities be large ones, in which ways are looked for when somebody drives them."""
    monkeypatch.setattr(ways, "N_NODES_COMPLETE", 0)
    monkeypatch.setattr(ways, "KEPT_BYTES", request.param)


def ends(name):
    """Every array at the end of an episode of each kind of world, run in one call and step by step."""
    for seed in (1, 2, 3):
        for run in (play, lambda world, policy: world.run(policy.for_brigades(world.n_brigades))):
            world = town_world(seed=seed, n_fires=4, n_brigades=5)
            run(world, policy_named(name))
            yield {name: array.tobytes() for name, array in named_arrays(world.state)}


EXPECTED = {name: list(ends(name)) for name in POLICIES}


@pytest.mark.parametrize("name", POLICIES)
@pytest.mark.usefixtures("on_demand")
def test_worlds_come_out_the_same_however_few_ways_are_kept(name):
    assert list(ends(name)) == EXPECTED[name]


@pytest.mark.usefixtures("on_demand")
def test_what_is_known_is_in_no_snapshot_and_no_comparison():
    world = town_world(seed=1)
    play(world, policy_named("fixed"), to=10)
    assert world.state.ways.table[:, GOAL].any()
    assert not [name for name in take_snapshot(world.state) if name.startswith("ways")]
    assert not [name for name, _ in named_arrays(world.state) if name.startswith("ways")]


@pytest.mark.usefixtures("on_demand")
def test_each_world_looks_for_its_own_ways():
    """Copies share no array that a step writes on, and one that is overwritten keeps the ways that it knows."""
    world = town_world(seed=1)
    play(world, policy_named("fixed"), to=10)
    copied = copy_world(world.state)
    assert copied.ways.table.shape == world.state.ways.table.shape
    assert not copied.ways.table.any()
    assert not any(np.shares_memory(a, b) for a, b in zip(copied.ways, world.state.ways, strict=True))
    copy_into(copied, world.state)
    assert not copied.ways.table.any()


def test_worlds_of_a_small_city_share_all_ways():
    world = town_world(seed=1)
    copied = copy_world(world.state)
    assert copied.ways is world.state.ways
    before = [array.copy() for array in (copied.ways.line, copied.ways.table)]
    play(world, policy_named("fixed"))
    assert all(map(np.array_equal, before, (copied.ways.line, copied.ways.table)))
