"""Pictures and the live view show what a run with the same decisions shows."""

from __future__ import annotations

import copy
from functools import partial

import numpy as np
import pytest

import fireworld as fw
from fireworld.arguments import ArgumentError
from fireworld.envs.rendering import Rendering
from fireworld.errors import ViewError
from tests.envs.extra import MISSING, needs_extra
from tests.envs.towns import HOT, SMALL, pickled
from tests.viewer import rrd

pytestmark = [needs_extra(), pytest.mark.slow]

if not MISSING:
    from fireworld_viewer.pictures.frames import RunFrames
    from fireworld_viewer.rerun_view import app, live

    from fireworld import envs
    from fireworld.envs.check.logs import FOLLOWERS
    from fireworld.envs.check.players import PLAYERS, play, randomly

FORMS = ("team", "turns", "brigade", "whole team")


@pytest.mark.parametrize("form", FORMS)
def test_a_picture_is_the_one_of_a_run_with_the_same_decisions(form, monkeypatch):
    choices = "in-turn" if form in {"turns", "brigade"} else "simultaneous"
    run = fw.run(SMALL, policy="best", seed=4, set={"choices": choices})
    follower_of = FOLLOWERS[form]
    make = follower_of.make
    monkeypatch.setattr(
        follower_of,
        "make",
        lambda self, scenario, options: make(self, scenario, {**options, "render_mode": "rgb_array"}),
    )
    follower = follower_of(fw.Scenario.from_dict({**SMALL, "choices": choices}), run)
    frames = RunFrames(run.city, "small")
    for record in list(run)[1:4]:
        follower.act(record)
        picture = follower.env.render()
        assert (picture.dtype, picture.ndim, picture.shape[2]) == (np.uint8, 3, 3)
        assert np.array_equal(picture, frames.frame(record, note="seed 4"))
        assert len(np.unique(picture)) > 20


@pytest.mark.parametrize("form", FORMS)
def test_pictures_change_nothing(form):
    player, stories = PLAYERS[form], []
    for mode in (None, "rgb_array"):
        env = player.make(HOT, seed=1, render_mode=mode)
        player.begin(env)
        stories.append([digest for _, digest in play(player, env, 30, randomly(1))])
        if mode:
            env.render()
        env.close()
    assert stories[0] == stories[1]


def test_pictures_after_restores_forks_and_copies():
    env = envs.team(HOT, seed=1, render_mode="rgb_array")
    env.reset()
    pictures = [env.render()]
    saved = env.snapshot()
    for _ in range(3):
        env.step(dict.fromkeys(env.agents, 3))
        pictures.append(env.render())
    assert not np.array_equal(pictures[0], pictures[-1])
    env.restore(saved)
    assert np.array_equal(env.render(), pictures[0])
    for other in (env.fork(), copy.deepcopy(env), pickled(env)):
        assert np.array_equal(other.render(), pictures[0])
        for picture in pictures[1:]:
            other.step(dict.fromkeys(other.agents, 3))
            assert np.array_equal(other.render(), picture)
    assert np.array_equal(env.render(), pictures[0])


def test_pictures_of_many_worlds():
    env = envs.TeamVectorEnv(3, [SMALL, HOT], seed=1, render_mode="rgb_array", steps=2)
    env.reset()
    for _ in range(4):  # worlds begin anew, with the other scenario
        pictures = env.render()
        assert len(pictures) == 3
        assert not np.array_equal(pictures[0], pictures[1])
        env.step(np.zeros((3, 3), dtype=int))
    env.fork(0, 2)
    pictures = env.render()
    assert np.array_equal(pictures[0], pictures[2])


def test_what_cannot_be_rendered():
    env = envs.team(HOT)
    env.reset()
    with pytest.raises(
        ArgumentError, match="render: expected render_mode rgb_array or rerun when it was made, got None"
    ):
        env.render()
    with pytest.raises(ArgumentError, match="render: expected an environment that was reset, got one that was not"):
        envs.team(HOT, render_mode="rgb_array").render()


def to_file(path, *_):
    """Instead of a window: Rerun's own program, which writes what it is fed to a file."""
    return partial(live.ViewerProcess, (str(app.viewer_executable()), "-", "--save", str(path)), stays=False)


@pytest.mark.parametrize("form", ["turns", "vector"])
def test_a_live_view_shows_every_episode(form, monkeypatch, tmp_path):
    monkeypatch.setattr(live, "own_window", partial(to_file, tmp_path / "seen.rrd"))
    player = PLAYERS[form]
    env = player.make(SMALL, seed=3, render_mode="rerun", steps=4)
    player.begin(env)
    play(player, env, 30, randomly(1))
    assert env.render() is None
    copied = copy.deepcopy(env)
    play(player, copied, 5, randomly(1))
    env.close()
    env.close()
    seen = rrd.read_all(tmp_path / "seen.rrd")
    names = [name.as_py()[0] for _, name in seen["/__properties"]["RecordingInfo:name"]]
    seeds = [envs.Seeds(3).seed(0, episode) for episode in range(len(names))]
    assert sorted(names) == sorted(f"small, environment, seed {seed}" for seed in seeds)
    assert len(names) >= 3
    steps = [step for step, _ in seen["/plots/score"]["Scalars:scalars"]]
    assert steps.count(0) == len(names)
    assert min(steps.count(step) for step in range(1, 5)) >= len(names) - 1


def test_a_live_view_without_a_display(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(
        ViewError, match=r"^render_mode: no display here; try view_url of a viewer that runs, or rgb_arra"
    ):
        envs.team(HOT, render_mode="rerun")
    with pytest.raises(ViewError, match="view_url: expected an address of this machine"):
        envs.team(HOT, render_mode="rerun", view_url="http://elsewhere")


def test_modes():
    with pytest.raises(ArgumentError, match="got 'rgb-array'; try rgb_array"):
        Rendering("rgb-array", None)
