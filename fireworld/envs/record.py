"""Episodes that learners play, recorded: a training log with the seeds and the actions of each, and no more."""

from __future__ import annotations

import os
import sys
import weakref
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from fireworld.envs.autoreset import Autoreset
from fireworld.envs.bound_worlds import BoundWorlds
from fireworld.envs.history import Histories, recorded
from fireworld.envs.setup import Setup
from fireworld.errors import OutputError, expected, one_line
from fireworld.kernels.arrays import COUNTS, Array
from fireworld.kernels.episode_arrays import STEP
from fireworld.scenario import Scenario
from fireworld.training.log.environment import ENVIRONMENT, Environment, PlayedTrainer, curriculum_played
from fireworld.training.log.played import Played
from fireworld.training.log.writer import open_writer
from fireworld.training.seeds import Seeds

_BURNT_OUT, _ALIVE = COUNTS.index("n_burnt_out"), COUNTS.index("n_civilians_alive")


class Beginning(NamedTuple):
    """An episode as it begins in a world."""

    scenario: int
    """Its position among the scenarios."""
    episode: int
    """Its number among those of the world."""
    base: int
    """What the seeds of the world's episodes follow from."""
    step: int
    """The step after which it begins."""
    seed_given: bool
    """Its seed does not follow from the base."""


class Unrecorded:
    """Records nothing: what worlds tell of their episodes, and all that they may ask."""

    def ran(self, runs: Array) -> None:
        """Take what was done in a step by the worlds, (m,), that have just run it."""

    def got(self, reward: Array) -> None:
        """Take the rewards of that step, (n,); episodes that ended with it are written.

        Raises:
            OutputError: one cannot be written.
        """

    def begin(self, index: int, episode: int, base: int, *, seed_given: bool) -> None:
        """Begin an episode at the start of its scenario; if one is under way in that world, it was left.

        Args:
            index: of the world, which has begun already, but is not shown yet.
            episode: number of the episode.
            base: what the seeds follow from.
            seed_given: that of the world does not.
        """

    def fork(self, source: int, index: int, episode: int, base: int) -> None:
        """Begin an episode in the state of another world, as `begin` does."""

    def leave_for(self, held: Mapping[str, Array]) -> None:
        """Write the episodes under way as left, before all worlds take the state of a snapshot.

        Raises:
            LogError: what that holds of what was done is not of such worlds; nothing is written then.
        """

    def restore(self, held: Mapping[str, Array], episodes: Array, base: int) -> None:
        """Begin episodes of these numbers, (n,), in the state of a snapshot, which all worlds are in now."""

    def held(self) -> dict[str, Array]:
        """Return what a snapshot holds of what was done before."""
        return {}

    def close(self) -> None:
        """Write the episodes under way as left, and give the log its name; called again, it does nothing.

        Raises:
            OutputError: it cannot be written.
        """


UNRECORDED: Final = Unrecorded()


class EpisodeRecorder(Unrecorded):
    """Records the episodes of n worlds, each when it ends; those under way when it is closed are marked as left.

    Args:
        record: the log to make, or an existing folder for it.
        scenarios: what is played, as it is built.
        method: in which environment.
        base: what the seeds follow from.
        bound: the worlds.

    Raises:
        OutputError: the log cannot be made.
    """

    def __init__(
        self,
        record: str | os.PathLike[str],
        scenarios: Sequence[Scenario],
        method: Environment,
        *,
        base: int,
        bound: BoundWorlds,
    ) -> None:
        n = len(bound.playing)
        self._trainer = PlayedTrainer(curriculum_played([*scenarios]), method, seed=base)
        self._n_brigades = [scenario.brigades.n for scenario in scenarios]
        self._first_worker, self._bound = method.first_worker, bound
        self._histories = Histories(bound.result)
        self._begun: list[Beginning | None] = [None] * n
        """Of the episodes that are under way, or not written yet."""
        self._state = [""] * n
        """Digests of the states that they began in, where what was done before is not known."""
        self._runs = np.arange(0)
        self._total = np.zeros(n)
        self._process = os.getpid()
        self._failed: OutputError | None = None
        self._writer = open_writer(record, self._trainer)

    @property
    def path(self) -> Path:
        """The log."""
        return self._writer.path

    def ran(self, runs: Array) -> None:
        """Take what was done in a step; see `Unrecorded`, here and below."""
        self._runs = runs
        for index in self._histories.note(runs).tolist():
            self._begin_unknown(index)

    def got(self, reward: Array) -> None:
        """Take the rewards of that step."""
        self._total += reward
        runs, result = self._runs, self._bound.result
        for index in runs[(result.terminated[runs] | result.truncated[runs]) != 0].tolist():
            self._write(index)

    def begin(self, index: int, episode: int, base: int, *, seed_given: bool) -> None:
        """Begin an episode at the start of its scenario."""
        self._begin(index, self._beginning(index, episode, base, seed_given=seed_given))
        self._histories.begin(index, self._bound.world(index).seed)

    def fork(self, source: int, index: int, episode: int, base: int) -> None:
        """Begin an episode in the state of another world."""
        self._begin(index, self._beginning(index, episode, base, seed_given=True))
        self._histories.copy(source, index, self._bound.world(index).seed)
        self._find_state(index)

    def leave_for(self, held: Mapping[str, Array]) -> None:
        """Write the episodes under way as left."""
        self._histories.check(held, held["clock"][:, STEP])
        self._leave()

    def restore(self, held: Mapping[str, Array], episodes: Array, base: int) -> None:
        """Begin episodes in the state of a snapshot."""
        for index, episode in enumerate(episodes.tolist()):
            begun = self._beginning(index, episode, base, seed_given=True)
            self._begin(index, begun)
            self._histories.restore(index, begun.step, self._bound.world(index).seed, held)
            self._find_state(index)

    def held(self) -> dict[str, Array]:
        """Return what a snapshot holds of what was done before."""
        return self._histories.held()

    def close(self) -> None:
        """Write the episodes under way as left, and give the log its name."""
        if os.getpid() == self._process and self._failed is None:
            self._leave()
            self._writer.close()

    def _leave(self) -> None:
        for index in range(len(self._begun)):
            self._write(index)

    def _beginning(self, index: int, episode: int, base: int, *, seed_given: bool) -> Beginning:
        step, playing = self._bound.world(index).step_number, int(self._bound.playing[index])
        return Beginning(playing, episode, base, step, seed_given)

    def _begin(self, index: int, beginning: Beginning) -> None:
        self._write(index)
        self._begun[index], self._state[index], self._total[index] = beginning, "", 0.0

    def _begin_unknown(self, index: int) -> None:
        """Continue an episode of which a step was missed, as if it began after that."""
        begun = self._begun[index]
        if begun is not None:
            step = int(self._bound.result.step[index])
            self._begun[index], self._total[index] = begun._replace(step=step, seed_given=True), 0.0
        self._find_state(index)

    def _find_state(self, index: int) -> None:
        self._state[index] = "" if self._histories.known[index] else self._bound.world(index).digest()

    def _write(self, index: int) -> None:
        """Write the episode of a world, if it is not written yet and a step of it was played."""
        begun, result = self._begun[index], self._bound.result
        last = int(result.step[index])
        if begun is None or last <= begun.step:
            return
        self._begun[index] = None
        (_, seed), *later = self._histories.seeds[index].items()
        self._commit(
            Played(
                scenario=begun.scenario,
                world=self._first_worker + index,
                episode=begun.episode,
                base=begun.base,
                seed=seed,
                seed_given=begun.seed_given,
                first_step=begun.step,
                state=bytes.fromhex(self._state[index]),
                n_steps=last - begun.step,
                terminated=bool(result.terminated[index]),
                truncated=bool(result.truncated[index]),
                total_reward=float(self._total[index]),
                score=float(result.score[index, 0]),
                score_max=float(result.score[index, 1]),
                n_burnt_out=int(result.counts[index, _BURNT_OUT]),
                n_civilians_alive=int(result.counts[index, _ALIVE]),
                later_step=np.array([step for step, _ in later], dtype=np.int32),
                later_seed=np.array([one for _, one in later], dtype=np.uint64),
                **recorded(self._histories.done(index), self._n_brigades[begun.scenario]),
            )
        )

    def _commit(self, played: Played) -> None:
        """Write an episode; when this returns a kill cannot lose it."""
        if os.getpid() != self._process:
            got = "another that it was forked into"
            raise OutputError(expected(str(self.path), "", "the process that made the worlds", got))
        if self._failed is not None:
            raise self._failed
        self._trainer.take(played)
        try:
            self._writer.write()
        except OutputError as error:
            self._failed = error
            raise


def recorder_of(
    owner: object,
    setup: Setup,
    bound: BoundWorlds,
    scenarios: Sequence[Scenario],
    *,
    first_worker: int,
    seeds: Seeds,
    autoreset: Autoreset,
) -> Unrecorded:
    """Return what records the episodes of worlds, if their setup asks for it; it is closed when these are forgotten.

    Args:
        owner: the worlds, as the caller has them.
        setup: what the worlds are made of.
        bound: the same, as kernels have them.
        scenarios: what is played, as it is built.
        first_worker: number of the first world.
        seeds: of the episodes.
        autoreset: when a world begins anew.

    Raises:
        OutputError: the log cannot be made.
    """
    if setup.record is None:
        return UNRECORDED
    method = ENVIRONMENT.with_settings(
        {
            "observation": setup.observation,
            "reward": setup.reward.kind if isinstance(setup.reward.kind, str) else "function",
            "own_targets": setup.own_targets,
            "steps": setup.steps or 0,
            "n_worlds": len(bound.playing),
            "first_worker": first_worker,
            "test_seeds": seeds.test,
            "autoreset": autoreset.name.lower().replace("_", "-"),
        }
    )
    recorder = EpisodeRecorder(setup.record, scenarios, method, base=seeds.base, bound=bound)
    weakref.finalize(owner, _close_at_last, recorder)
    return recorder


def _close_at_last(recorder: EpisodeRecorder) -> None:
    """Close a recorder that nobody has closed; there is nobody left to catch an error."""
    try:
        recorder.close()
    except OutputError as error:
        sys.stderr.write(f"fireworld: {one_line(str(error))}\n")
