"""The vector environment: resets of some, forks, snapshots, teams of several sizes, threads, and mistakes."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld.arguments import ArgumentError
from fireworld.errors import LogError
from tests.envs.extra import MISSING, needs_extra
from tests.envs.towns import HOT, LATER, SMALL

pytestmark = needs_extra()

if not MISSING:
    import gymnasium
    from gymnasium.vector import AutoresetMode

    from fireworld import envs
    from fireworld.envs.check.players import PLAYERS, exact, play, randomly
    from fireworld.envs.check.vectors import compare_with_single


def made(n=3, scenario=SMALL, **options):
    env = envs.TeamVectorEnv(n, scenario, **{"seed": 5, **options})
    env.reset()
    return env


@pytest.mark.parametrize("mode", ["NEXT_STEP", "SAME_STEP", "DISABLED"])
def test_several_scenarios_are_those_of_single_ones(mode):
    found = compare_with_single(
        [SMALL, LATER, HOT], AutoresetMode[mode], n_steps=150, own_targets=4, observation="graph", n_burning_max=5
    )
    assert int(found.split()[0]) > 10


def test_256_by_name():
    env = gymnasium.make_vec("fireworld/Team-v0", num_envs=256, scenario="quick", threads=2)
    seen, infos = env.reset(seed=1)
    assert env.num_envs == 256
    assert seen["features"].shape == (256, 2, 8)
    assert len(set(infos["seed"].tolist())) == 256
    assert env.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    seen, rewards, *_ = env.step(env.action_space.sample())
    assert rewards.shape == (256,)
    assert seen in env.observation_space
    env.close()
    env.close()
    assert env.closed


def test_threads_change_nothing():
    one, two = (made(7, observation="targets", threads=threads) for threads in (1, 2))
    player = PLAYERS["vector"]
    assert exact(play(player, one, 40, randomly(1))) == exact(play(player, two, 40, randomly(1)))


@pytest.mark.parametrize("given", ["SAME_STEP", "SameStep", "same-step"])
def test_modes_by_any_name(given):
    for mode in (given, AutoresetMode.SAME_STEP, envs.Autoreset.SAME_STEP):
        env = envs.TeamVectorEnv(2, SMALL, autoreset_mode=mode)
        assert env.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP


def test_resets_of_some():
    env = made()
    for _ in range(3):
        env.step(np.zeros((3, 3), dtype=int))
    mask = np.array([False, True, False])
    options = {"reset_mask": mask}
    _, infos = env.reset(options=options)
    assert options == {"reset_mask": mask}
    assert infos["_seed"].tolist() == mask.tolist()
    assert infos["seed"].tolist() == [0, envs.Seeds(5).seed(1, 1), 0]
    assert env.worlds.info()["step"].tolist() == [3, 0, 3]
    _, infos = env.reset(options={"world_seeds": [7, 8, 9]})
    assert infos["seed"].tolist() == [7, 8, 9]


@pytest.mark.parametrize(
    "mask", [np.zeros(3, dtype=bool), np.ones(2, dtype=bool), np.ones(3, dtype=int), [True, False, True]]
)
def test_masks_that_make_no_sense(mask):
    with pytest.raises(ArgumentError, match=r"reset: reset_mask: expected \(3,\) bool, one of them true"):
        made().reset(options={"reset_mask": mask})


def test_world_seeds_that_make_no_sense():
    for wrong in ([1, 2], 5, [[1, 2, 3]], "abc"):
        with pytest.raises(ArgumentError, match="reset: world_seeds: expected 3, one of each world, got "):
            made().reset(options={"world_seeds": wrong})
    with pytest.raises(ArgumentError, match="world_seeds: expected a whole number"):
        made().reset(options={"world_seeds": [1, 2, -3]})


def test_a_fork():
    env = made()
    for _ in range(2):
        env.step(np.array([[0, 1, 2], [1, 1, 1], [3, 2, 0]]))
    env.fork(2, 0)
    for _ in range(5):
        seen, rewards, *_ = env.step(np.array([[0, 0, 1], [1, 1, 1], [0, 0, 1]]))
        assert not np.array_equal(seen["features"][0], seen["features"][1])
        assert all(np.array_equal(array[0], array[2]) for array in seen.values())
        assert rewards[0] == rewards[2]


def test_snapshots_go_between_environments_of_as_many():
    env, other = made(), made(seed=99, threads=2, autoreset_mode="same-step")
    env.step(np.array([[0, 1, 2], [1, 1, 1], [3, 2, 0]]))
    seen, infos = other.restore(env.snapshot())
    assert exact(seen) == exact(env.restore(env.snapshot())[0])
    assert infos["step"].tolist() == [1, 1, 1]
    with pytest.raises(LogError, match="snapshot: "):
        made(4).restore(env.snapshot())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"n": 0}, "num_envs: expected a whole number from 1 to 2048, got 0"),
        ({"threads": 0}, "threads: expected a whole number"),
        ({"autoreset_mode": "never"}, "autoreset: expected one of"),
        ({"worker": 2046}, "worker: expected a whole number from 0 to 2045, got 2046"),
        ({"observation": "pixels"}, "observation: expected one of features"),
    ],
)
def test_mistakes_of_making(options, message):
    with pytest.raises(ArgumentError, match=message):
        made(**options)


def test_a_world_that_has_ended_is_not_stepped():
    env = made(autoreset_mode="disabled", steps=1)
    env.step(np.zeros((3, 3), dtype=int))
    with pytest.raises(ArgumentError, match="world 0: expected one under way"):
        env.step(np.zeros((3, 3), dtype=int))


def test_what_is_returned_is_nobody_elses():
    env, other = made(autoreset_mode="same-step", steps=2), made(autoreset_mode="same-step", steps=2)
    for _ in range(5):
        for value in flat(env.step(np.zeros((3, 3), dtype=int))):
            value[...] = 1
        results = other.step(np.zeros((3, 3), dtype=int))
    again = env.step(np.zeros((3, 3), dtype=int)), other.step(np.zeros((3, 3), dtype=int))
    assert exact(again[0]) == exact(again[1])
    assert results[1].shape == (3,)


def flat(value):
    """Yield all arrays of numbers in nested values."""
    if isinstance(value, dict):
        value = list(value.values())
    elif isinstance(value, np.ndarray):
        if value.dtype != object:
            yield value
            return
        value = [one for one in value.tolist() if one is not None]
    for one in value:
        yield from flat(one)
