"""n worlds in the hands of kernels: their memory, and the arrays in which they take actions and show what is seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Final

import numpy as np

from fireworld.arguments import RUN_SEED_MAX, STEPS_MAX
from fireworld.envs.setup import Setup
from fireworld.envs.snapshots import fitting, within
from fireworld.envs.views import fresh_batch, hide_absent
from fireworld.kernels.addresses import address_row
from fireworld.kernels.arrays import Array
from fireworld.kernels.batch import BEGIN, SHOW, STEP_DECIDED, STEP_GIVEN, Result, View, work_on_worlds
from fireworld.kernels.episode_arrays import LAST_STEP, SEED, STEP
from fireworld.policy.kernel import KernelPolicy, given
from fireworld.simulation.built import BuiltScenario
from fireworld.simulation.world import World

_BOUNDS: Final = {"clock": (0, RUN_SEED_MAX), "action": (-1, 4), "target": (-1, 2**31 - 1)}


class BoundWorlds:
    """n worlds, each of one of the scenarios that are built.

    Attributes:
        batch: what kernels read and write: `fireworld.kernels.batch.Batch`.
        batch_row: its address row.
        rows: (n, r) int64, address rows of an `Episode` each.
        playing: (n,) int64, which of the scenarios each is of.
    """

    def __init__(
        self,
        setup: Setup,
        built: Sequence[BuiltScenario],
        playing: Sequence[int],
        *,
        threads: int,
        others: KernelPolicy | None,
    ) -> None:
        """Make the worlds.

        Args:
            setup: what they are made of.
            built: its scenarios.
            playing: (n,) which of them each world is of.
            threads: that work on them.
            others: the policy of brigades that nobody else decides for.
        """
        self._setup, self._built, self._threads, self._others = setup, built, threads, others
        n, b = len(playing), max(one.n_brigades for one in built)
        self.batch = fresh_batch(
            n,
            b,
            observation=setup.observation,
            own_targets=setup.own_targets,
            n_burning_max=setup.n_burning_max,
        )
        self.batch_row, self.playing = address_row(self.batch), np.array(playing, dtype=np.int64)
        self._team = given(b) if others is None else others.for_brigades(b)
        self._worlds = [self._made(number) for number in playing]
        self._bound = [world.bound(self._team) for world in self._worlds]
        self.rows = np.stack([bound.row for bound in self._bound])
        self._pool = ThreadPoolExecutor(threads, "fireworld-worlds") if threads > 1 else None

    @property
    def shown(self) -> View:
        """What is seen of the worlds; not to be changed."""
        return self.batch.shown

    @property
    def result(self) -> Result:
        """What their last steps came to; not to be changed."""
        return self.batch.result

    def begin(self, index: int, playing: int, seed: int) -> None:
        """Let a world begin anew, with a scenario and a seed."""
        self._place(index, playing)
        self._worlds[index].memory[:] = self._built[playing].start.packing.memory
        clock = self._bound[index].clock
        clock[SEED], clock[STEP], clock[LAST_STEP] = seed, 0, self._last_step(playing)

    def copy(self, source: int, target: int) -> None:
        """Bring one world into the state of another."""
        self._place(target, int(self.playing[source]))
        self._worlds[target].memory[:] = self._worlds[source].memory
        self._bound[target].clock[:] = self._bound[source].clock
        for array in (self.result.action, self.result.target):
            array[target] = array[source]

    def draw_anew(self, index: int, seed: int) -> None:
        """Let the random draws of a world follow from another seed from here on."""
        self._bound[index].clock[SEED] = seed

    def show(self, which: Array, *, begun: bool) -> None:
        """Let worlds be seen; `which` (m,) are their indices; `begun`: their coming step has begun already."""
        for index in which.tolist():
            world = self._worlds[index]
            hide_absent(self.shown, index, world.n_brigades)
            self.shown.frame[index] = world.start.frame
        self._work(which, SHOW if begun else BEGIN)

    def step(self, which: Array, *, decided: bool = False) -> None:
        """Run a step of worlds and show them; `which` (m,) are their indices; `decided`: brigades have taken turns."""
        self._work(which, STEP_DECIDED if decided else STEP_GIVEN)

    def world(self, index: int) -> World:
        """Return a world itself, with its clock as it stands; its coming step has begun."""
        world, clock = self._worlds[index], self._bound[index].clock.tolist()
        world.seed, world.step_number, world.n_steps_max = clock[SEED], clock[STEP], clock[LAST_STEP]
        return world

    def arrays(self) -> dict[str, Array]:
        """Return all that the worlds are in, to be taken by `take`."""
        memory = {f"world{index}": world.memory.copy() for index, world in enumerate(self._worlds)}
        return {
            "playing": self.playing.copy(),
            "clock": np.stack([bound.clock for bound in self._bound]),
            "action": self.result.action.copy(),
            "target": self.result.target.copy(),
            **memory,
        }

    def check(self, held: Mapping[str, Array]) -> None:
        """Raise LogError for arrays that such worlds cannot be in."""
        playing = within(held, "playing", self.playing, least=0, most=len(self._built) - 1)
        for name, like in (("clock", np.zeros((len(playing), 3), dtype=np.int64)), *self._decided()):
            least, most = _BOUNDS[name]
            within(held, name, like, least=least, most=most)
        steps = {"clock": held["clock"][:, STEP:]}
        within(steps, "clock", np.zeros((len(playing), 2), dtype=np.int64), least=0, most=STEPS_MAX)
        for index, number in enumerate(playing.tolist()):
            fitting(held, f"world{index}", self._built[number].start.packing.memory)

    def take(self, held: Mapping[str, Array]) -> None:
        """Bring the worlds into a state of `arrays`, which fits, and show them."""
        for name, array in self._decided():
            array[...] = held[name]
        for index, playing in enumerate(held["playing"].tolist()):
            self._place(index, playing)
            self._worlds[index].memory[:] = held[f"world{index}"]
            self._bound[index].clock[:] = held["clock"][index]
        self.show(np.arange(len(self.playing)), begun=True)

    def another(self) -> BoundWorlds:
        """Return as many worlds in the same states, which go their own way."""
        made = BoundWorlds(self._setup, self._built, self.playing.tolist(), threads=self._threads, others=self._others)
        made.take(self.arrays())
        return made

    def close(self) -> None:
        """End the threads; one does the work from here on."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None

    def _decided(self) -> tuple[tuple[str, Array], ...]:
        return ("action", self.result.action), ("target", self.result.target)

    def _last_step(self, playing: int) -> int:
        return self._built[playing].scenario.steps if self._setup.steps is None else self._setup.steps

    def _made(self, playing: int) -> World:
        return self._built[playing].world(seed=0, n_steps_max=self._last_step(playing))

    def _place(self, index: int, playing: int) -> None:
        """Let a world be of another scenario, unless it is already."""
        if self.playing[index] == playing:
            return
        self.playing[index] = playing
        self._worlds[index] = world = self._made(playing)
        self._bound[index] = world.bound(self._team)
        self.rows[index] = self._bound[index].row

    def _work(self, which: Array, what: int) -> None:
        """Let the kernel work on worlds, in threads if there are any."""
        if self._pool is None or len(which) < 2 * self._threads:
            work_on_worlds(self.rows, self.batch_row, which, what)
            return
        parts = np.array_split(which, self._threads)
        submit, rows, batch_row = self._pool.submit, self.rows, self.batch_row
        for done in [submit(work_on_worlds, rows, batch_row, part, what) for part in parts]:
            done.result()
