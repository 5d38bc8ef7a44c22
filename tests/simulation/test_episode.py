"""The compiled episode and the step-by-step world are one simulator, and a snapshot is all that either goes on from."""

from __future__ import annotations

import numpy as np
import pytest
from fireworld_recorder.chain import Digest

from fireworld.errors import LogError
from fireworld.simulation.observer import Observer
from fireworld.simulation.state import SCRATCH, copy_into, named_arrays, restore_snapshot, take_snapshot
from tests.simulation.town import POLICIES, Asked, begin, play, policy_named, town_world


def assert_equal(world, other, *, scratch=True):
    """Compare every array, bit by bit."""
    assert world.step_number == other.step_number
    for (name, array), (_, expected) in zip(named_arrays(world.state), named_arrays(other.state), strict=True):
        if scratch or name not in SCRATCH:
            assert array.dtype == expected.dtype
            assert array.tobytes() == expected.tobytes(), name


@pytest.mark.parametrize("flush", [True, False])
@pytest.mark.parametrize("name", POLICIES)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_episode_ends_in_the_same_arrays(name, seed, flush):
    stepped, run = (town_world(seed=seed, n_fires=4, flush=flush) for _ in range(2))
    last = play(stepped, policy_named(name))
    assert run.run(policy_named(name).for_brigades(run.n_brigades)) == last
    assert_equal(run, stepped)
    assert 1 < last <= 60


@pytest.mark.parametrize("choices", ["in-turn", "simultaneous"])
@pytest.mark.parametrize("name", ["ranking-of-named", "ranking-of-all", "network-of-named", "network-of-all"])
def test_a_crowd_ranks_alike_together_and_one_by_one(name, choices):
    """In the episode brigades share what they make of the buildings; asked from Python, each begins anew."""
    stepped, run = (town_world(seed=4, n_fires=9, n_brigades=13, choices=choices) for _ in range(2))
    last = play(stepped, Asked(begin(policy_named(name), stepped)))
    assert run.run(policy_named(name).for_brigades(run.n_brigades)) == last >= 4
    assert_equal(run, stepped)


def test_both_ends_of_an_episode_are_met():
    """Some of these runs put the fire out, others run to their last step: the tests above have seen both."""
    ends = [town_world(seed=seed, n_fires=n) for seed in (1, 2, 3) for n in (1, 4)]
    for world in ends:
        world.run(policy_named("each-another").for_brigades(world.n_brigades))
    assert {(world.terminated, world.truncated) for world in ends} == {(True, False), (False, True)}


def test_an_episode_that_is_over_does_not_go_on():
    world = town_world(seed=1, n_fires=0)
    assert world.terminated
    assert world.run(policy_named("fixed").for_brigades(world.n_brigades)) == 0
    world = town_world(seed=2, n_fires=8, n_steps_max=5)
    for _ in range(2):
        assert world.run(policy_named("fixed").for_brigades(world.n_brigades)) == 5
    stepped = town_world(seed=2, n_fires=8, n_steps_max=5)
    play(stepped, policy_named("fixed"))
    assert_equal(world, stepped)


@pytest.mark.parametrize("name", POLICIES)
@pytest.mark.parametrize("middle", [1, 13])
def test_a_snapshot_is_all_that_a_run_goes_on_from(name, middle):
    """Restored into a new world, and into the kernel's, it leads to the same end."""
    whole = town_world(seed=6, n_fires=6)
    play(whole, policy_named(name), to=middle)
    snapshot = take_snapshot(whole.state)
    play(whole, policy_named(name))
    for go_on in (play, lambda world, policy: world.run(policy.for_brigades(world.n_brigades))):
        other = town_world(seed=6, n_fires=2)  # a world of another past
        play(other, policy_named("random"), to=7)
        restore_snapshot(other.state, snapshot)
        other.step_number = middle
        go_on(other, policy_named(name))
        assert_equal(other, whole, scratch=False)


@pytest.mark.parametrize("middle", [1, 13, 30])
def test_a_restored_run_has_the_same_digest(middle, town_record):
    """The records after the snapshot, events included, are those of the run that went through."""
    digests = []
    for restored in (False, True):
        world = town_world(seed=6, n_fires=6)
        observer, policy, digest = Observer(world), begin(policy_named("each-another"), world), Digest(town_record)
        digest.write(observer.record())
        while not (world.terminated or world.truncated):
            digest.write(observer.record(world.step(policy)))
            if restored and world.step_number == middle:
                snapshot = take_snapshot(world.state)
                world = town_world(seed=6)
                restore_snapshot(world.state, snapshot)
                world.step_number = middle
                observer = Observer(world)
        digests.append((world.step_number, digest.digest))
    assert digests[0] == digests[1]


def test_a_snapshot_is_a_copy():
    world = town_world(seed=1)
    snapshot = take_snapshot(world.state)
    before = {name: array.copy() for name, array in snapshot.items()}
    play(world, policy_named("fixed"), to=5)
    assert all((snapshot[name] == before[name]).all() for name in before)
    restore_snapshot(world.state, snapshot)
    play(world, policy_named("fixed"), to=8)
    assert all((snapshot[name] == before[name]).all() for name in before)


def test_worlds_are_copied_into_each_other():
    world, other = town_world(seed=1), town_world(seed=2)
    play(world, policy_named("fixed"), to=5)
    copy_into(other.state, world.state)
    other.step_number, other.seed = world.step_number, world.seed
    play(world, policy_named("fixed"))
    play(other, policy_named("fixed"))
    assert_equal(world, other)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda held: held.pop("fire.energy"), r"fire.energy: expected float64 \(\d+,\), got nothing"),
        (lambda held: held.update({"fire.energy": np.zeros(3)}), r"fire.energy: expected .*, got float64 \(3,\)"),
        (
            lambda held: held.update({"brigades.tank": held["brigades.tank"].astype(np.int64)}),
            r"brigades.tank: expected int32 \(3,\), got int64 \(3,\)",
        ),
    ],
)
def test_a_snapshot_of_something_else_is_refused(change, message):
    world = town_world(seed=1)
    held = take_snapshot(world.state)
    change(held)
    with pytest.raises(LogError, match=message):
        restore_snapshot(world.state, held)
