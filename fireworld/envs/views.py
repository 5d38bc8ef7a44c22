"""The arrays in which kernels show many worlds to learners, and the kinds of observation that are made of them."""

from __future__ import annotations

from typing import Final

import numpy as np

from fireworld.arguments import ArgumentError
from fireworld.errors import expected, nearest
from fireworld.kernels.arrays import COUNTS, SCORES, Array
from fireworld.kernels.batch import EACH, TEAM, Batch, Result, View
from fireworld.kernels.observation import N_ACTIONS, N_FEATURES
from fireworld.kernels.ranking import N_OF_BUILDING, N_TARGET_FEATURES

OBSERVATIONS: Final = {
    "features": "the paper's eight features of every brigade",
    "targets": "13 features of each of the four targets that the actions name, as rankings weigh them",
    "graph": "the burning buildings and the brigades, each with its features",
}


def observation_of(value: object) -> str:
    """Return a kind of observation.

    Raises:
        ArgumentError: there is no such kind.
    """
    if isinstance(value, str) and value in OBSERVATIONS:
        return value
    hint = nearest(value, OBSERVATIONS) if isinstance(value, str) else ""
    raise ArgumentError(expected("observation", "", f"one of {', '.join(OBSERVATIONS)}", value, hint))


def fresh_batch(
    n: int, n_brigades: int, *, observation: str = "features", own_targets: int = 0, n_burning_max: int = 64
) -> Batch:
    """Return the arrays of n worlds; what the kind of observation does not need has no rows."""
    b, k = n_brigades, own_targets
    with_targets, with_graph = n if observation == "targets" else 0, n if observation == "graph" else 0
    view = View(
        features=np.zeros((n, b, N_FEATURES), dtype=np.int64),
        state=np.full((n, b), -1, dtype=np.int64),
        mask=np.zeros((n, b, N_ACTIONS + k), dtype=np.uint8),
        alive=np.zeros((n, b), dtype=np.uint8),
        chooses=np.zeros((n, b), dtype=np.uint8),
        own=np.full((n, b, k), -1, dtype=np.int32),
        targets=np.zeros((with_targets, b, N_ACTIONS, N_TARGET_FEATURES), dtype=np.float32),
        team=np.zeros((n, len(TEAM)), dtype=np.float32),
        burning=np.full((with_graph, n_burning_max), -1, dtype=np.int32),
        buildings=np.zeros((with_graph, n_burning_max, N_OF_BUILDING), dtype=np.float32),
        brigades=np.zeros((with_graph, b, len(EACH)), dtype=np.float32),
        frame=np.ones((n, 4)),
    )
    view.mask[:, :, 0] = 1
    result = Result(
        reward=np.zeros((n, 6)),
        score=np.zeros((n, len(SCORES))),
        counts=np.zeros((n, len(COUNTS)), dtype=np.int32),
        terminated=np.zeros(n, dtype=np.uint8),
        truncated=np.zeros(n, dtype=np.uint8),
        seed=np.zeros(n, dtype=np.int64),
        step=np.zeros(n, dtype=np.int64),
        action=np.full((n, b), -1, dtype=np.int32),
        target=np.full((n, b), -1, dtype=np.int32),
    )
    result.score[:, SCORES.index("score_max")] = 1.0
    return Batch(np.zeros((n, b), dtype=np.int32), view, result)


def hide_absent(view: View, index: int, n_brigades: int) -> None:
    """Let nothing be seen of brigades that a world's team does not have, beyond the first `n_brigades`."""
    for zero in (view.features, view.alive, view.chooses, view.mask, view.targets, view.brigades):
        if len(zero):
            zero[index, n_brigades:] = 0
    view.mask[index, n_brigades:, 0] = 1
    view.state[index, n_brigades:] = view.own[index, n_brigades:] = -1


def observed(view: View, observation: str) -> dict[str, Array]:
    """Return copies of what a kind of observation shows of n worlds; b brigades, k targets of their own."""
    shown = {
        "action_mask": view.mask.astype(np.bool_),
        "alive": view.alive.astype(np.bool_),
        "team": view.team.copy(),
    }
    if view.own.shape[2]:
        shown["own"] = view.own.copy()
    if observation == "targets":
        return {"targets": view.targets.copy(), **shown}
    if observation == "graph":
        graph = {"burning": view.burning, "buildings": view.buildings, "brigades": view.brigades}
        return {**{name: array.copy() for name, array in graph.items()}, **shown}
    return {"features": view.features.astype(np.int8), **shown}
