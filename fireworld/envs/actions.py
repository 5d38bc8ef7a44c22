"""Actions that callers give, checked before anything is changed."""

from __future__ import annotations

from typing import Any

import numpy as np

from fireworld.arguments import ArgumentError, whole_number
from fireworld.errors import expected
from fireworld.kernels.arrays import Array
from fireworld.kernels.batch import View


def checked_actions(actions: Any, view: View, *, playing: Array) -> Array:
    """Return the actions of n worlds.

    Args:
        actions: (n, b) whole numbers.
        view: what is seen of the worlds.
        playing: (n,) bool, which have not ended: in others any action is ignored that there is.

    Raises:
        ArgumentError: another shape, type or number, or an action that the mask forbids.
    """
    n, b, n_actions = view.mask.shape
    try:
        array = np.asarray(actions)
    except ValueError:  # rows of several lengths
        raise ArgumentError(expected("step", "actions", f"whole numbers {n, b}", "something else")) from None
    if array.shape != (n, b) or array.dtype.kind not in "iu":
        raise ArgumentError(expected("step", "actions", f"whole numbers {n, b}", f"{array.dtype} {array.shape}"))
    _refuse((array < 0) | (array >= n_actions), array, f"an action from 0 to {n_actions - 1}")
    if view.own.shape[2]:
        allowed = np.take_along_axis(view.mask, array[:, :, None].astype(np.int64), axis=2)[:, :, 0]
        forbidden = (allowed == 0) & (view.chooses != 0) & playing[:, None]
        _refuse(forbidden, array, "an action that its action_mask allows")
    return array


def checked_action(action: object, view: View, brigade: int) -> int:
    """Return the action of a brigade of a single world.

    Raises:
        ArgumentError: it is no action, or the mask forbids it.
    """
    where = f"brigade {brigade}"
    number = whole_number(f"step: {where}: action", action, least=0, most=view.mask.shape[2] - 1)
    if view.own.shape[2] and view.chooses[0, brigade] and not view.mask[0, brigade, number]:
        raise ArgumentError(expected("step", where, "an action that its action_mask allows", number))
    return number


def _refuse(wrong: Array, actions: Array, wanted: str) -> None:
    """Raise ArgumentError for the first of the wrong actions, (n, b) bool, if there is one."""
    if wrong.any():
        world, brigade = np.argwhere(wrong)[0].tolist()
        where = f"world {world}, brigade {brigade}"
        raise ArgumentError(expected("step", where, wanted, int(actions[world, brigade])))
