"""What was done in worlds since the start of their episodes: the actions of every brigade, and the seeds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

from fireworld.errors import LogError, expected
from fireworld.kernels.arrays import Array
from fireworld.kernels.batch import Batch
from fireworld.training.log.played import NOTHING, OWN, STEP_MAX

ROOM: Final = 512
"""Steps of all worlds that are held as they were noted, before they are put in order."""


class Done(NamedTuple):
    """What the brigades of a world did; t steps."""

    action: Array  # (t, b) uint8: as it is recorded
    target: Array  # (t, b) int32: where the action is OWN, the building


class Histories:
    """What was done in n worlds of b brigades at most; it goes with forks and snapshots.

    To note a step is a copy of a small array. They are put in order, world by world, when somebody asks for them.

    Attributes:
        known: (n,) bool, whether it is known from the start on.
        seeds: of each world by the step after which each counts.

    Args:
        batch: what the worlds take and give; they write it, and this reads it.
        names_targets: brigades may name targets of their own.
    """

    def __init__(self, batch: Batch, *, names_targets: bool) -> None:
        n, b = batch.actions.shape
        self._batch, self._names_targets = batch, names_targets
        self._action = np.zeros((ROOM, n, b), dtype=np.uint8)
        self._target = np.zeros((ROOM if names_targets else 0, n, b), dtype=np.int32)
        self._n_noted, self._under_way = 0, False
        self._nothing = Done(np.zeros((0, b), dtype=np.uint8), np.zeros((0, b), dtype=np.int32))
        self._before = [self._nothing] * n
        """What was done in each world before what is noted of it."""
        self._since, self._step = np.zeros((2, n), dtype=np.int64)
        """Where what is noted of each world begins, and the step that was its last one then."""
        self.known = np.zeros(n, dtype=np.bool_)
        self.seeds: list[dict[int, int]] = [{} for _ in range(n)]

    def note(self) -> None:
        """Note what the brigades are about to do, until `noted` says that it is done.

        Of worlds that do not run the step, or are interrupted before it, it is forgotten.
        """
        if self._n_noted == ROOM or self._under_way:
            self._put_in_order()
        row, batch = self._n_noted, self._batch
        action = self._action[row]
        np.minimum(batch.actions, OWN, out=action, casting="unsafe")
        action[batch.shown.chooses == 0] = NOTHING
        if self._names_targets:
            place = np.maximum(batch.actions - OWN, 0)[:, :, None]
            self._target[row] = np.take_along_axis(batch.shown.own, place, axis=2)[:, :, 0]
        self._n_noted, self._under_way = row + 1, True

    def noted(self) -> None:
        """Say that the step is done."""
        self._under_way = False

    def begin(self, index: int, seed: int) -> None:
        """Begin at the start of a scenario."""
        self._begin(index, 0, self._nothing, known=True, seeds={0: seed})

    def copy(self, source: int, index: int, step: int, seed: int) -> None:
        """Begin where another world stands after a step, and go on with a seed."""
        known = bool(self.known[source])
        before = self.done(source) if known else self._nothing
        self._begin(index, step, before, known=known, seeds=_go_on(self.seeds[source], step, seed))

    def restore(self, index: int, step: int, seed: int, held: Mapping[str, Array]) -> None:
        """Begin after a step that a snapshot holds, with all that was done before, if it has that, too."""
        if step == 0 or "played_known" not in held or not held["played_known"][index]:
            self._begin(index, step, self._nothing, known=step == 0, seeds={0: seed})
            return
        before = Done(held["played_action"][index, :step], held["played_target"][index, :step])
        seeds: dict[int, int] = dict(held["played_seeds"][held["played_seeds"][:, 0] == index, 1:].tolist())
        self._begin(index, step, before, known=True, seeds=_go_on(seeds, step, seed))

    def done(self, index: int) -> Done:
        """Return what the brigades of a world did, from the first step that is known to the last."""
        before, first = self._before[index], self._since[index]
        rows = slice(first, first + self._batch.result.step[index] - self._step[index])
        action = np.concatenate((before.action, self._action[rows, index]))
        if not self._names_targets:
            return Done(action, np.concatenate((before.target, np.zeros_like(action[len(before.action) :], np.int32))))
        return Done(action, np.concatenate((before.target, self._target[rows, index])))

    def held(self) -> dict[str, Array]:
        """Return what a snapshot holds of it."""
        n, (_, b) = len(self.known), self._nothing.action.shape
        most = int(self._batch.result.step.max(initial=0))
        action, target = np.zeros((n, most, b), dtype=np.uint8), np.zeros((n, most, b), dtype=np.int32)
        for index in np.flatnonzero(self.known).tolist():
            done = self.done(index)
            action[index, : len(done.action)], target[index, : len(done.action)] = done
        seeds = [(index, *one) for index, found in enumerate(self.seeds) for one in found.items()]
        return {
            "played_known": self.known.copy(),
            "played_action": action,
            "played_target": target,
            "played_seeds": np.array(seeds, dtype=np.int64).reshape(-1, 3),
        }

    def _begin(self, index: int, step: int, before: Done, *, known: bool, seeds: dict[int, int]) -> None:
        self._before[index], self.known[index], self.seeds[index] = before, known, seeds
        self._since[index], self._step[index] = self._n_noted, step

    def _put_in_order(self) -> None:
        """Put what is noted in order, so that there is room again."""
        self._before = [self.done(index) for index in range(len(self.known))]
        self._n_noted, self._since[:], self._step[:] = 0, 0, self._batch.result.step


def check_held(held: Mapping[str, Array], steps: Array, n_brigades: int) -> None:
    """Check what a snapshot holds of what was done, if it does, in worlds that have done so many steps, (n,).

    Raises:
        LogError: it is not of such worlds.
    """
    if "played_known" not in held:
        return
    n, most = len(steps), int(steps.max(initial=0))
    shapes = {"played_known": (n,), "played_action": (n, most, n_brigades), "played_target": (n, most, n_brigades)}
    kinds = {"played_known": np.bool_, "played_action": np.uint8, "played_target": np.int32, "played_seeds": np.int64}
    fits = (
        all(name in held and held[name].dtype == kind for name, kind in kinds.items())
        and all(held[name].shape == shape for name, shape in shapes.items())
        and bool((held["played_action"] <= NOTHING).all())
        and _fit(held["played_seeds"], n)
    )
    if not fits:
        raise LogError(expected("snapshot", "", "what was done in these worlds", "something else"))


def _fit(seeds: Array, n: int) -> bool:
    """Return whether rows of world, step and seed make sense: the steps of each world rise from 0."""
    if seeds.ndim != 2 or seeds.shape[1] != 3 or not ((seeds >= 0) & (seeds < (n, STEP_MAX, 1 << 32))).all():
        return False
    first = np.diff(seeds[:, 0], prepend=-1) > 0
    return bool(((seeds[:, 1] == 0) == first).all() and (np.diff(seeds[:, 1])[~first[1:]] > 0).all())


def _go_on(seeds: Mapping[int, int], step: int, seed: int) -> dict[int, int]:
    """Return seeds of which another one counts from a step on, unless it does already."""
    return dict(seeds) if [*seeds.values()][-1:] == [seed] else {**seeds, step: seed}
