"""Every form records what was played in it, and what the others did; each episode is a run that verifies."""

from __future__ import annotations

import numpy as np
import pytest

import fireworld as fw
from fireworld import envs
from tests.envs.extra import MISSING, needs_extra
from tests.envs.towns import HOT, SMALL

pytestmark = needs_extra()

if not MISSING:
    import gymnasium


def allowed(mask, step):
    """Return an action, or one of each brigade, that masks allow."""
    return (np.random.default_rng(step).random(mask.shape) * mask).argmax(axis=-1)


def team(**options):
    env = envs.team(SMALL, own_targets=3, **options)
    seen, _ = env.reset()
    for step in range(60):
        if not env.agents:
            seen, _ = env.reset()
        seen, *_ = env.step({name: int(allowed(seen[name]["action_mask"], step)) for name in env.agents})
    return env


def turns(**options):
    env = envs.turns(SMALL, own_targets=3, **options)
    env.reset()
    for step in range(150):
        if not env.agents:
            env.reset()
        name = env.agent_selection
        left = env.terminations[name] or env.truncations[name]
        env.step(None if left else int(allowed(env.observe(name)["action_mask"], step)))
    return env


def brigade(others="best", **options):
    env = envs.brigade(SMALL, brigade=1, others=others, own_targets=2, **options)
    env.reset()
    for step in range(60):
        _, _, terminated, truncated, _ = env.step(int(allowed(env.action_masks(), step)))
        if terminated or truncated:
            env.reset()
    return env


def whole_team(**options):
    env = gymnasium.make("fireworld/Team-v0", scenario=SMALL, **options)
    seen, _ = env.reset(seed=3)
    for step in range(60):
        seen, _, terminated, truncated, _ = env.step(allowed(seen["action_mask"], step))
        if terminated or truncated:
            seen, _ = env.reset(options={"world_seed": step})
    return env


def vector(**options):
    env = gymnasium.make_vec("fireworld/Team-v0", num_envs=3, scenario=HOT, own_targets=2, **options)
    seen, _ = env.reset(seed=3)
    for step in range(60):
        seen, *_ = env.step(allowed(seen["action_mask"], step))
    return env


def mine(observation):
    return observation.brigade % 4


FORMS = {
    "team": (team, "simultaneous"),
    "turns": (turns, "in-turn"),
    "brigade": (brigade, "in-turn"),
    "brigade among a user's": (lambda **options: brigade(others=mine, **options), "in-turn"),
    "whole team": (whole_team, "simultaneous"),
    "vector": (vector, "simultaneous"),
}


@pytest.mark.parametrize(("form", "choices"), FORMS.values(), ids=[*FORMS])
def test_forms_record(form, choices, tmp_path):
    form(record=f"{tmp_path}/", seed=None if form in {vector, whole_team} else 6).close()
    path = tmp_path / "episodes-1.mcap"
    log = fw.open_training(path)
    assert fw.verify(path), fw.verify(path)
    assert len(log) > 2
    assert {one.choices for one in log.scenarios} == {choices}
    for number in (0, len(log) - 1):
        run = fw.open_episode(log, number)
        assert fw.verify(run)
        assert run.outcome.score == log.lines[number].score
        assert len(run) == log.lines[number].last_step + 1


def test_a_fork_of_a_form_goes_its_own_way(tmp_path):
    env = team(record=tmp_path / "a.mcap")
    forked = env.fork(seed=3)
    forked.close()
    env.close()
    assert fw.verify(tmp_path / "a.mcap")


def test_a_snapshot_of_a_form_goes_on_with_its_past(tmp_path):
    env = envs.team(HOT, record=tmp_path / "a.mcap", seed=1)
    seen, _ = env.reset()
    for step in range(5):
        seen, *_ = env.step({name: int(allowed(seen[name]["action_mask"], step)) for name in env.agents})
    saved = env.snapshot()
    env.close()
    other = envs.team(HOT, record=tmp_path / "b.mcap", seed=2)
    seen, _ = other.restore(saved)
    for step in range(4):
        seen, *_ = other.step({name: int(allowed(seen[name]["action_mask"], step)) for name in other.agents})
    other.close()
    (line,) = fw.open_training(tmp_path / "b.mcap").lines
    assert (line.first_step, line.n_steps, line.replayable) == (5, 4, True)
    verified = fw.verify(tmp_path / "b.mcap")
    assert verified
    assert verified.n_unknown == 0
