"""The vector environment is what Gymnasium makes of as many single ones, in every way to begin anew."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv
from gymnasium.wrappers.vector import RecordEpisodeStatistics

from fireworld import envs
from fireworld.envs.check.checks import Check
from fireworld.envs.check.players import exact, randomly
from fireworld.envs.setup import Scenarios
from fireworld.envs.views import OBSERVATIONS

_N, _SEED, _LAST_STEP = 4, 11, 60


def checks_of_vectors(scenario: Scenarios) -> Iterator[Check]:
    """Yield the checks of the vector environment."""
    for mode in AutoresetMode:
        name = mode.name.lower().replace("_", " ")
        for kind in OBSERVATIONS:
            compared = partial(compare_with_single, scenario, mode, observation=kind, steps=_LAST_STEP)
            yield Check(f"{name}, {kind}", "vector", compared)
        yield Check(f"{name}, wrappers", "vector", partial(_wrapped, scenario, mode))


def compare_with_single(scenario: Scenarios, mode: AutoresetMode, *, n_steps: int = 250, **options: Any) -> str:
    """Raise AssertionError unless it is what `SyncVectorEnv` of single environments is, to the last bit.

    Args:
        scenario: what is played.
        mode: when episodes begin anew.
        n_steps: how many steps are compared.
        options: of the environments.
    """
    ours = _made(scenario, mode, **options)
    theirs: Any = SyncVectorEnv(
        [
            partial(envs.WholeTeamEnv, scenario, seed=envs.Seeds(_SEED), worker=worker, **options)
            for worker in range(_N)
        ],
        autoreset_mode=mode,
    )
    for name in ("single_observation_space", "observation_space", "single_action_space", "action_space"):
        assert getattr(ours, name) == getattr(theirs, name), f"{name} is another one"
    assert ours.metadata["autoreset_mode"] is theirs.metadata["autoreset_mode"] is mode
    _same(ours.reset(), theirs.reset(), "reset")
    choose, n_ended = randomly(3), 0
    for step in range(n_steps):
        actions = choose(ours.worlds.observe()["action_mask"])
        one, other = ours.step(actions), theirs.step(actions)
        _same(one, other, f"step {step}")
        assert one[0] in ours.observation_space, f"step {step}: outside of its space"
        ended = one[2] | one[3]
        n_ended += int(ended.sum())
        if mode is AutoresetMode.DISABLED and ended.any():
            masks = [{"reset_mask": ended.copy()} for _ in range(2)]  # Gymnasium takes it out of the options
            _same(ours.reset(options=masks[0]), theirs.reset(options=masks[1]), f"reset after step {step}")
    assert n_ended, f"nothing ended in {n_steps} steps"
    return f"{n_ended} episodes ended"


def _made(scenario: Scenarios, mode: AutoresetMode, **options: Any) -> Any:
    """Make a vector environment by its name, as users do."""
    made = gymnasium.make_vec(
        "fireworld/Team-v0",
        num_envs=_N,
        scenario=scenario,
        seed=envs.Seeds(_SEED),
        autoreset_mode=mode,
        **options,
    )
    assert isinstance(made, VectorEnv)
    return made


def _wrapped(scenario: Scenarios, mode: AutoresetMode) -> None:
    """A wrapper of Gymnasium counts steps and rewards of every episode."""
    made = _made(scenario, mode, steps=9, reward="stock")
    env: Any = RecordEpisodeStatistics(made)
    env.reset()
    choose, found = randomly(5), []
    for _ in range(40):
        _, _, terminated, truncated, infos = env.step(choose(made.worlds.observe()["action_mask"]))
        ended = terminated | truncated
        if ended.any():
            found += infos["episode"]["l"][ended].tolist()
            if mode is AutoresetMode.DISABLED:
                env.reset(options={"reset_mask": ended})
    assert found, "no episode was counted"
    assert max(found) == 9, f"the longest of episodes of 9 steps has {max(found)}"


def _same(ours: tuple[Any, ...], theirs: tuple[Any, ...], where: str) -> None:
    """Compare results; what is known of no world may be there or not."""
    names = ("observation", "reward", "terminated", "truncated", "info") if len(ours) > 2 else ("observation", "info")
    for name, one, other in zip(names, ours, theirs, strict=True):
        assert exact(_sorted(one)) == exact(_sorted(other)), f"{where}: {name} is another one"


def _sorted(value: Any) -> Any:
    """Return nested mappings in order of their names."""
    if isinstance(value, dict):
        return {name: _sorted(value[name]) for name in sorted(value)}
    if isinstance(value, np.ndarray) and value.dtype == object:
        return [_sorted(item) for item in value.tolist()]
    return value
