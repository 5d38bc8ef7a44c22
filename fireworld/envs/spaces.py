"""The spaces of observations and actions, as Gymnasium has them."""

from __future__ import annotations

from typing import Any, Final, Protocol

import numpy as np
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, MultiDiscrete, Space

from fireworld.envs.setup import Setup
from fireworld.kernels.arrays import Array
from fireworld.kernels.batch import EACH, TEAM
from fireworld.kernels.observation import N_ACTIONS
from fireworld.kernels.ranking import METERS_MOST, N_OF_BUILDING, N_TARGET_FEATURES
from fireworld.policy.words import RADIX


class Sizes(Protocol):
    """What spaces follow from: `Worlds`, or a dataset."""

    @property
    def n_brigades(self) -> int:
        """Of the largest team."""

    @property
    def n_buildings(self) -> int:
        """Of the largest city."""

    @property
    def n_actions(self) -> int:
        """Actions of a brigade."""

    @property
    def setup(self) -> Setup:
        """What learners are shown."""


_BOUNDED: Final = {2: 1.0, 3: METERS_MOST, 7: 1.0, 8: METERS_MOST, 9: 1.0, 12: 1.0}
"""The most that features of targets can be; the others have no bound. MODEL 7."""


def action_space(worlds: Sizes) -> Discrete[Any]:
    """Return the actions of a brigade: 0 to 3 are the paper's, 4 + j its j-th own target."""
    return Discrete(worlds.n_actions)


def agent_space(worlds: Sizes) -> Dict:
    """Return what a brigade sees as an agent of its own: `agents.agent_view`."""
    kind = worlds.setup.observation
    seen = _graph(worlds) if kind == "graph" else {}
    observation: Space[Any] = _features(()) if kind == "features" else _targets(())
    if kind == "graph":
        own = {"own": _places(worlds, (worlds.setup.own_targets,))} if worlds.setup.own_targets else {}
        observation = Dict({**seen, "team": _shares((len(TEAM),)), **own, "brigade": Discrete(worlds.n_brigades)})
    return Dict({"observation": observation, "action_mask": MultiBinary(worlds.n_actions)})


def team_space(worlds: Sizes) -> Dict:
    """Return what is seen of a world: `Worlds.observe`, with masks in int8."""
    b, k, kind = worlds.n_brigades, worlds.setup.own_targets, worlds.setup.observation
    seen: dict[str, Space[Any]] = _graph(worlds)
    if kind != "graph":
        seen = {kind: _features((b,)) if kind == "features" else _targets((b,))}
    seen |= {"action_mask": MultiBinary((b, worlds.n_actions)), "alive": MultiBinary(b), "team": _shares((len(TEAM),))}
    return Dict({**seen, "own": _places(worlds, (b, k))} if k else seen)


def team_actions(worlds: Sizes) -> MultiDiscrete[Any]:
    """Return the actions of a team, one of each brigade."""
    return MultiDiscrete([worlds.n_actions] * worlds.n_brigades)


def state_space(n: int) -> Box:
    """Return the space of `agents.whole_view`, (n,)."""
    return Box(0.0, np.inf, (n,), dtype=np.float32)


def in_int8(seen: dict[str, Array]) -> dict[str, Array]:
    """Return what is seen of worlds with its truths as `MultiBinary` has them; the arrays are the same."""
    return {name: array.view(np.int8) if array.dtype == np.bool_ else array for name, array in seen.items()}


def _graph(worlds: Sizes) -> dict[str, Space[Any]]:
    """Return the spaces of the burning buildings and the brigades."""
    g = worlds.setup.n_burning_max
    return {
        "burning": _places(worlds, (g,)),
        "buildings": Box(np.zeros((g, N_OF_BUILDING), dtype=np.float32), _most(N_OF_BUILDING, (g,)), dtype=np.float32),
        "brigades": _shares((worlds.n_brigades, len(EACH))),
    }


def _features(shape: tuple[int, ...]) -> MultiDiscrete[Any]:
    return MultiDiscrete(np.broadcast_to(np.array(RADIX), (*shape, len(RADIX))).copy(), dtype=np.int8)


def _targets(shape: tuple[int, ...]) -> Box:
    most = _most(N_TARGET_FEATURES, (*shape, N_ACTIONS))
    return Box(np.zeros_like(most), most, dtype=np.float32)


def _most(n: int, shape: tuple[int, ...]) -> Array:
    """Return the most that the first n features of targets can be, (*shape, n)."""
    return np.broadcast_to(np.array([_BOUNDED.get(k, np.inf) for k in range(n)], dtype=np.float32), (*shape, n)).copy()


def _shares(shape: tuple[int, ...]) -> Box:
    return Box(0.0, 1.0, shape, dtype=np.float32)


def _places(worlds: Sizes, shape: tuple[int, ...]) -> Box:
    """Return indices of buildings, -1 none."""
    return Box(-1, worlds.n_buildings - 1, shape, dtype=np.int32)
