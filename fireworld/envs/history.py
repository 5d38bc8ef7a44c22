"""What was done in worlds since the start of their episodes: the actions of every brigade, and the seeds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from fireworld.arguments import RUN_SEED_MAX
from fireworld.envs.snapshots import fitting, within
from fireworld.errors import LogError, expected
from fireworld.kernels.arrays import Array
from fireworld.kernels.batch import Result
from fireworld.training.log.played import NOTHING, OWN

ROOM: Final = 512
"""Steps of all worlds that are held as they were noted, before they are put in order."""
_NAMES: Final = ("played_known", "played_action", "played_target", "played_seeds")


class Done(NamedTuple):
    """What the brigades of a world did; t steps."""

    action: Array  # (t, b) uint8: as it is recorded
    target: Array  # (t, b) int32: where the action is OWN, the building


class Histories:
    """What was done in n worlds of b brigades at most; it goes with forks and snapshots.

    To note a step is a copy of two small arrays. They are put in order, world by world, when somebody asks for them.

    Attributes:
        known: (n,) bool, whether it is known from the start on.
        seeds: of each world by the step after which each counts.

    Args:
        result: what the last steps of the worlds came to: they write it, and this reads it.
    """

    def __init__(self, result: Result) -> None:
        n, b = result.action.shape
        self._result = result
        self._action = np.zeros((ROOM, n, b), dtype=np.uint8)
        self._target = np.zeros((ROOM, n, b), dtype=np.int32)
        self._n_noted = 0
        self._nothing = Done(np.zeros((0, b), dtype=np.uint8), np.zeros((0, b), dtype=np.int32))
        self._before = [self._nothing] * n
        """What was done in each world before what is noted of it."""
        self._since, self._first, self._last = np.zeros((3, n), dtype=np.int64)
        """Where what is noted of each world begins, after which step, and the last step of it."""
        self.known = np.zeros(n, dtype=np.bool_)
        self.seeds: list[dict[int, int]] = [{} for _ in range(n)]

    def note(self, runs: Array) -> Array:
        """Note what the brigades did in the worlds, (m,), that have just run a step.

        Returns:
            Those of which a step was missed, because somebody was interrupted in it: what they did is not known.
        """
        if self._n_noted == ROOM:
            self._before = [self.done(index) for index in range(len(self.known))]
            self._n_noted, self._since[:], self._first[:] = 0, 0, self._last
        np.minimum(self._result.action.view(np.uint32), NOTHING, out=self._action[self._n_noted], casting="unsafe")
        self._target[self._n_noted] = self._result.target
        self._n_noted += 1
        steps = self._result.step[runs]
        missed: Array = runs[steps != self._last[runs] + 1]
        self._last[runs] = steps
        for index in missed.tolist():
            self._begin(index, self._last[index], self._nothing, known=False, seeds=self.seeds[index])
        return missed

    def begin(self, index: int, seed: int) -> None:
        """Begin at the start of a scenario."""
        self._begin(index, 0, self._nothing, known=True, seeds={0: seed})

    def copy(self, source: int, index: int, seed: int) -> None:
        """Begin where another world stands, and continue with a seed."""
        step, known = int(self._last[source]), bool(self.known[source])
        before = self.done(source) if known else self._nothing
        self._begin(index, step, before, known=known, seeds=_continued(self.seeds[source], step, seed))

    def restore(self, index: int, step: int, seed: int, held: Mapping[str, Array]) -> None:
        """Begin after a step that a snapshot holds, with all that was done before, if it has that, too."""
        if step == 0 or "played_known" not in held or not held["played_known"][index]:
            self._begin(index, step, self._nothing, known=step == 0, seeds={0: seed})
            return
        before = Done(held["played_action"][index, :step], held["played_target"][index, :step])
        seeds: dict[int, int] = dict(held["played_seeds"][held["played_seeds"][:, 0] == index, 1:].tolist())
        self._begin(index, step, before, known=True, seeds=_continued(seeds, step, seed))

    def done(self, index: int) -> Done:
        """Return what the brigades of a world did, from the first step that is known to the last."""
        before, since = self._before[index], self._since[index]
        rows = slice(since, since + self._last[index] - self._first[index])
        action = self._action[rows, index]
        names_targets = (action == OWN).any()  # as few learners do
        target = self._target[rows, index] if names_targets else np.zeros(action.shape, dtype=np.int32)
        return Done(np.concatenate((before.action, action)), np.concatenate((before.target, target)))

    def held(self) -> dict[str, Array]:
        """Return what a snapshot holds of it."""
        n, most, (_, b) = len(self.known), int(self._last.max(initial=0)), self._nothing.action.shape
        action, target = np.zeros((n, most, b), dtype=np.uint8), np.zeros((n, most, b), dtype=np.int32)
        for index in np.flatnonzero(self.known).tolist():
            done = self.done(index)
            action[index, : len(done.action)], target[index, : len(done.action)] = done
        seeds = [(index, *one) for index, found in enumerate(self.seeds) for one in found.items()]
        arrays = self.known.copy(), action, target, np.array(seeds, dtype=np.int64).reshape(-1, 3)
        return dict(zip(_NAMES, arrays, strict=True))

    def check(self, held: Mapping[str, Array], steps: Array) -> None:
        """Check what a snapshot holds of worlds that have done so many steps, (n,), if it holds anything of it.

        Raises:
            LogError: it is not of such worlds.
        """
        if "played_known" not in held:
            return
        n, most, (_, b) = len(steps), int(steps.max(initial=0)), self._nothing.action.shape
        fitting(held, "played_known", self.known)
        within(held, "played_action", np.zeros((n, most, b), dtype=np.uint8), least=0, most=NOTHING)
        within(held, "played_target", np.zeros((n, most, b), dtype=np.int32), least=-1, most=2**31 - 1)
        seeds = held.get("played_seeds", np.zeros(0))
        within(held, "played_seeds", np.zeros((len(seeds), 3), dtype=np.int64), least=0, most=RUN_SEED_MAX)
        first = np.diff(seeds[:, 0], prepend=-1) > 0
        rise = ((seeds[:, 1] == 0) == first).all() and (np.diff(seeds[:, 1])[~first[1:]] > 0).all()
        there = np.isin(np.flatnonzero(held["played_known"]), seeds[first, 0]).all()
        if not (rise and there and (seeds[:, 1] <= steps[np.minimum(seeds[:, 0], n - 1)]).all()):
            raise LogError(expected("snapshot", "played_seeds", "steps that rise from 0 in each world", "others"))

    def _begin(self, index: int, step: Any, before: Done, *, known: bool, seeds: dict[int, int]) -> None:
        self._before[index], self.known[index], self.seeds[index] = before, known, seeds
        self._since[index], self._first[index], self._last[index] = self._n_noted, step, step


def recorded(done: Done, n_brigades: int) -> dict[str, Array]:
    """Return what the first brigades did as the columns of an episode."""
    action, target = (one[:, :n_brigades].T.ravel() for one in done)
    return {"action": action, "target": target[action == OWN]}


def _continued(seeds: Mapping[int, int], step: int, seed: int) -> dict[int, int]:
    """Return seeds of which another one counts from a step on, unless it does already."""
    return dict(seeds) if [*seeds.values()][-1:] == [seed] else {**seeds, step: seed}
