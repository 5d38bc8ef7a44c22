"""Worlds saved, restored, forked, pickled and copied go the same way, to the last bit."""

from __future__ import annotations

import copy
import io
import json

import numpy as np
import pytest
import yaml

import fireworld as fw
from fireworld import envs
from fireworld.arguments import STEPS_MAX, ArgumentError
from fireworld.errors import LogError
from fireworld.scenario import parse_scenario
from fireworld.training.seeds import Seeds
from tests.envs.towns import HOT, LATER, SMALL, pickled

KINDS = ["features", "targets", "graph"]


def made(**options):
    return envs.worlds([SMALL, LATER], 3, **{"seeds": 6, "observation": "graph", "own_targets": 5, **options})


def random_actions(seen, step):
    """Return actions that masks allow, by a generator of the step."""
    random, mask = np.random.default_rng(step), seen["action_mask"]
    return (random.random(mask.shape) * mask).argmax(axis=-1)


def go(worlds, seen, first, last):
    """Run steps and return all that they come to."""
    story = []
    for step in range(first, last):
        done = worlds.step(random_actions(seen, step))
        seen = done.observation
        story.append((done, worlds.digest(), worlds.decisions()))
    return seen, story


def bytes_of(value):
    """Return nested values in a form that compares bit by bit."""
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if isinstance(value, dict):
        return {name: bytes_of(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [bytes_of(item) for item in value]
    return bytes_of(vars(value)) if hasattr(value, "__dict__") else value


WAYS = {
    "restored elsewhere": lambda worlds: restored(made(seeds=99), worlds.snapshot()),
    "restored in a batch with threads": lambda worlds: restored(made(threads=2), worlds.snapshot()),
    "pickled": pickled,
    "deeply copied": copy.deepcopy,
    "copied": copy.copy,
}


def restored(worlds, snapshot):
    worlds.restore(snapshot)
    return worlds


@pytest.mark.parametrize("autoreset", ["next-step", "same-step"])
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("at", [0, 7, 31])
def test_all_ways_lead_to_the_same_story(way, at, autoreset):
    worlds = made(autoreset=autoreset)
    seen, _ = go(worlds, worlds.reset(), 0, at)
    other = WAYS[way](worlds)
    other.autoreset = worlds.autoreset
    assert bytes_of(other.observe()) == bytes_of(seen)
    assert bytes_of(other.info()) == bytes_of(worlds.info())
    _, story = go(worlds, seen, at, at + 40)
    _, again = go(other, other.observe(), at, at + 40)
    assert bytes_of(again) == bytes_of(story)
    assert worlds.episode_number.tolist() == other.episode_number.tolist()


@pytest.mark.parametrize("observation", KINDS)
def test_a_world_goes_back(observation):
    worlds = made(observation=observation)
    seen, _ = go(worlds, worlds.reset(), 0, 9)
    saved = worlds.snapshot()
    _, story = go(worlds, seen, 9, 40)
    again = worlds.restore(saved)
    assert bytes_of(again) == bytes_of(seen)
    assert bytes_of(go(worlds, again, 9, 40)[1]) == bytes_of(story)
    assert worlds.restore(saved).keys() == seen.keys()


def test_worlds_that_have_not_begun_are_kept_too():
    worlds = made()
    for other in (copy.deepcopy(worlds), pickled(worlds)):
        assert other.episode_number.tolist() == [-1] * 3
        with pytest.raises(ArgumentError, match="expected one under way"):
            other.step(np.zeros((3, 5), dtype=int))
        assert bytes_of(other.reset()) == bytes_of(made().reset())


def test_copies_go_their_own_way():
    worlds = made()
    seen, _ = go(worlds, worlds.reset(), 0, 5)
    before, copied = worlds.digest(), copy.deepcopy(worlds)
    go(copied, seen, 5, 30)
    copied.close()
    assert worlds.digest() == before
    assert bytes_of(worlds.observe()) == bytes_of(seen)


def test_a_fork_goes_the_way_of_its_source():
    worlds = made()
    seen, _ = go(worlds, worlds.reset(), 0, 6)
    worlds.fork(0, 2)
    seen = worlds.observe()
    assert worlds.info()["seed"][2] == worlds.info()["seed"][0]
    for step in range(6, 20):
        actions = random_actions(seen, step)
        actions[2] = actions[0]
        done = worlds.step(actions)
        seen = done.observation
        assert all(np.array_equal(array[0], array[2]) for array in seen.values())
        assert done.reward[0] == done.reward[2]
        if done.terminated[0] or done.truncated[0]:
            break
    assert worlds.world(0).digest() == worlds.world(2).digest()
    while worlds.episode_number[2] == 0:
        worlds.step(np.zeros((3, 5), dtype=int))
    assert worlds.info()["seed"][2] == Seeds(6).seed(2, 1)


def test_a_fork_with_draws_of_its_own():
    worlds = envs.worlds([LATER, HOT], 3, seeds=6)
    go(worlds, worlds.reset(), 0, 3)
    same, other = copy.deepcopy(worlds), copy.deepcopy(worlds)
    same.fork(1, 1)
    other.fork(1, 1, seed=12345)
    assert same.digest() == worlds.digest() != other.digest()
    assert other.info()["seed"].tolist() == [*worlds.info()["seed"][:1], 12345, worlds.info()["seed"][2]]
    go(same, same.observe(), 3, 12)
    go(other, other.observe(), 3, 12)
    assert same.world(1).state.fire.energy.tobytes() != other.world(1).state.fire.energy.tobytes()


def test_what_cannot_be_forked():
    worlds = made()
    with pytest.raises(ArgumentError, match="fork: world 0: expected one that has begun, got one that has not"):
        worlds.fork(0, 1)
    worlds.reset(indices=[0])
    worlds.fork(0, 1)
    assert worlds.episode_number.tolist() == [0, 0, -1]
    for wrong in ((0, 3), (-1, 0)):
        with pytest.raises(ArgumentError, match="index: expected a whole number from 0 to 2"):
            worlds.fork(*wrong)
    with pytest.raises(ArgumentError, match="seed: expected a whole number"):
        worlds.fork(0, 1, seed=-1)


def altered(change):
    """Return a snapshot with other arrays."""
    worlds = made()
    worlds.reset()
    with np.load(io.BytesIO(worlds.snapshot())) as held:
        arrays = dict(held)
    change(arrays)
    data = io.BytesIO()
    np.savez(data, **arrays)
    return data.getvalue()


def put(name, value):
    return lambda arrays: arrays.update({name: value})


FOREIGN = {
    "no bytes of one": lambda: b"nothing",
    "nothing": lambda: b"",
    "cut off": lambda: made().snapshot()[:5000],
    "damaged": lambda: made().snapshot().replace(b"world", b"wurld"),
    "with other bytes": lambda: with_other_bytes(made().snapshot()),
    "of other scenarios": lambda: envs.worlds([SMALL, HOT], 3).snapshot(),
    "of fewer scenarios": lambda: envs.worlds(SMALL, 3).snapshot(),
    "of another reward": lambda: made(reward="change").snapshot(),
    "of more worlds": lambda: envs.worlds([SMALL, LATER], 4).snapshot(),
    "of a session": lambda: fw.world("quick").snapshot(),
    "without a head": lambda: altered(lambda arrays: arrays.pop("head")),
    "with an odd head": lambda: altered(put("head", np.array("[1, 2]"))),
    "without an array": lambda: altered(lambda arrays: arrays.pop("world1")),
    "of other types": lambda: altered(put("ended", np.zeros(3))),
    "with numbers out of bounds": lambda: altered(put("playing", np.array([0, 1, 2]))),
    "with episodes out of bounds": lambda: altered(put("episode_number", np.array([0, -2, 0]))),
    "with a clock out of bounds": lambda: altered(put("clock", np.full((3, 3), -1))),
    "with steps out of bounds": lambda: altered(put("clock", np.full((3, 3), STEPS_MAX + 1))),
    "with memory of another size": lambda: altered(put("world0", np.zeros(3, dtype=np.uint8))),
    "with another base": lambda: altered(with_base(-1)),
    "without a base": lambda: altered(with_base(None)),
}


def with_other_bytes(snapshot):
    return snapshot[:9000] + b"\xff" * 64 + snapshot[9064:]


def with_base(base):
    def change(arrays):
        head = json.loads(str(arrays["head"]))
        arrays["head"] = np.array(json.dumps({**head, "base": base}))

    return change


@pytest.mark.parametrize("name", FOREIGN)
def test_foreign_snapshots_are_refused_and_change_nothing(name):
    worlds = made()
    go(worlds, worlds.reset(), 0, 4)
    before, snapshot = worlds.digest(), FOREIGN[name]()
    with pytest.raises(LogError, match=r"^snapshot: "):
        worlds.restore(snapshot)
    assert worlds.digest() == before
    assert worlds.seeds == Seeds(6)


def test_what_is_known_of_a_state_holds_for_no_other():
    """Kernels go on with lists of what is warm: those of a fire in one corner miss a fire in the other."""
    city = {"generated": {"columns": 32, "rows": 32}}
    weak = {"parameters": {"brigades": {"power_litres": 1}}, "steps": 60}
    corners = [{"city": city, "fires": [{"buildings": [building]}], **weak} for building in (40, 980)]
    worlds = envs.worlds([parse_scenario(yaml.safe_dump(corner), source="corner") for corner in corners], 2)
    worlds.reset(world_seeds=[1, 1])
    actions = np.zeros((2, worlds.n_brigades), dtype=int)
    for _ in range(10):
        worlds.step(actions)
    arrays = worlds._bound.arrays()
    worlds._bound.take(arrays | {"world0": arrays["world1"]})
    for _ in range(30):
        worlds.step(actions)
    assert worlds.world(0).digest() == worlds.world(1).digest()
