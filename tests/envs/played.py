"""Learners of a moment whose episodes are recorded."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from fireworld import envs
from tests.envs.towns import HOT, LATER, SMALL


def chosen(seen: dict[str, Any], step: int) -> Any:
    """Return actions that masks allow, by a generator of the step."""
    random, mask = np.random.default_rng(step), seen["action_mask"]
    return (random.random(mask.shape) * mask).argmax(axis=-1)


def play(path: Path, *, scenarios: Any = (SMALL, LATER), n: int = 3, n_steps: int = 73, **options: Any) -> Path:
    """Play at random, recorded to a file; return it."""
    worlds = envs.worlds(list(scenarios), n, **{"seeds": 4, "record": path, **options})
    seen = worlds.reset()
    for step in range(n_steps):
        seen = worlds.step(chosen(seen, step)).observation
    worlds.close()
    return path


def play_with_forks(path: Path, **options: Any) -> Path:
    """Play at random in a fire that burns on, with forks, snapshots and resets in between; return the log."""
    worlds = envs.worlds(HOT, 3, **{"seeds": 4, "record": path, "autoreset": "disabled", **options})
    seen = worlds.reset()
    for step in range(8):
        seen = worlds.step(chosen(seen, step)).observation
    saved = worlds.snapshot()
    worlds.fork(0, 1)
    worlds.fork(0, 2, seed=77)
    for step in range(8, 14):
        worlds.step(chosen(worlds.observe(), step))
    worlds.fork(2, 0, seed=5)
    for step in range(14, 18):
        worlds.step(chosen(worlds.observe(), step))
    seen = worlds.restore(saved)
    for step in range(3):
        seen = worlds.step(chosen(seen, step)).observation
    worlds.reset(indices=[1], world_seeds=[9])
    worlds.reset(indices=[2], seed=11)
    for step in range(4):
        worlds.step(chosen(worlds.observe(), step))
    worlds.close()
    return path
