"""Episodes that learners play, recorded: a training log with the seeds and the actions of each, and no more."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fireworld.envs.history import Histories
from fireworld.errors import OutputError, expected
from fireworld.kernels.arrays import COUNTS, Array
from fireworld.kernels.batch import Batch
from fireworld.scenario import Scenario
from fireworld.training.log.environment import Environment, PlayedTrainer, curriculum_played
from fireworld.training.log.played import OWN, Played
from fireworld.training.log.writer import open_writer

_BURNT_OUT, _ALIVE = COUNTS.index("n_burnt_out"), COUNTS.index("n_civilians_alive")


class Beginning(NamedTuple):
    """An episode as it begins in a world."""

    scenario: int
    """Its position among the scenarios."""
    episode: int
    """Its number among those of the world."""
    base: int
    """What its seed follows from."""
    seed: int
    step: int
    """The step after which it begins."""


class EpisodeRecorder:
    """Records the episodes of n worlds, each when it ends; those under way when it is closed are marked as left.

    Args:
        record: the log to make, or an existing folder for it.
        scenarios: what is played.
        method: in which environment.
        base: what the seeds follow from.
        batch: what the worlds take and give; they write it, and this reads it.

    Raises:
        OutputError: the log cannot be made.
    """

    def __init__(
        self,
        record: str | os.PathLike[str],
        scenarios: Sequence[Scenario],
        method: Environment,
        base: int,
        batch: Batch,
    ) -> None:
        n = len(batch.actions)
        self._trainer = PlayedTrainer(curriculum_played([*scenarios]), method, seed=base)
        self._n_brigades = [scenario.brigades.n for scenario in scenarios]
        self._first_worker, self._batch = method.first_worker, batch
        self._histories = Histories(batch, names_targets=method.own_targets > 0)
        self._begun: list[Beginning | None] = [None] * n
        """Of the episodes that are under way, or not written yet."""
        self._elsewhere = [False] * n
        """Whether they began in forks or snapshots."""
        self._state = [""] * n
        """Digests of the states that they began in, where what was done before is not known."""
        self._total = np.zeros(n)
        self._process = os.getpid()
        self._failed: OutputError | None = None
        self._writer = open_writer(record, self._trainer)

    @property
    def path(self) -> Path:
        """The log."""
        return self._writer.path

    def note(self) -> None:
        """Note what the brigades are about to do in a step."""
        self._histories.note()

    def took(self, reward: Array, ended: Array) -> None:
        """Take the rewards of a step, (n,), and write the episodes of the worlds, (m,), that ended with it."""
        self._histories.noted()
        self._total += reward
        for index in ended.tolist():
            self._write(index)

    def begin(self, index: int, beginning: Beginning) -> None:
        """Begin an episode at the start of its scenario; if one is under way, it was left."""
        self._begin(index, beginning, elsewhere=False)
        self._histories.begin(index, beginning.seed)
        self._state[index] = ""

    def fork(self, source: int, index: int, beginning: Beginning, state: Callable[[], str]) -> None:
        """Begin an episode in the state of another world, of which `state` returns the digest."""
        self._begin(index, beginning, elsewhere=True)
        self._histories.copy(source, index, beginning.step, beginning.seed)
        self._state[index] = "" if self._histories.known[index] else state()

    def restore(self, index: int, beginning: Beginning, state: Callable[[], str], held: Mapping[str, Array]) -> None:
        """Begin an episode in the state of a snapshot, which may hold what was done before."""
        self._begin(index, beginning, elsewhere=True)
        self._histories.restore(index, beginning.step, beginning.seed, held)
        self._state[index] = "" if self._histories.known[index] else state()

    def held(self) -> dict[str, Array]:
        """Return what a snapshot holds of what was done before."""
        return self._histories.held()

    def close(self) -> None:
        """Write the episodes under way as left, and give the log its name.

        Raises:
            OutputError: it cannot be written.
        """
        if os.getpid() != self._process or self._failed is not None:
            return
        for index in range(len(self._begun)):
            self._write(index)
        self._writer.close()

    def _begin(self, index: int, beginning: Beginning, *, elsewhere: bool) -> None:
        self._write(index)
        self._elsewhere[index] = elsewhere
        self._begun[index] = beginning
        self._total[index] = 0.0

    def _write(self, index: int) -> None:
        """Write the episode of a world, if it is not written yet and a step of it was played."""
        begun, result = self._begun[index], self._batch.result
        last = int(result.step[index])
        if begun is None or last <= begun.step:
            return
        self._begun[index] = None
        state = bytes.fromhex(self._state[index])
        action, target = (one[:, : self._n_brigades[begun.scenario]].T.ravel() for one in self._histories.done(index))
        (_, seed), *later = self._histories.seeds[index].items()
        self._commit(
            Played(
                scenario=begun.scenario,
                world=self._first_worker + index,
                episode=begun.episode,
                base=begun.base,
                seed=seed,
                elsewhere=self._elsewhere[index],
                first_step=begun.step,
                state=state,
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
                action=action,
                target=target[action == OWN],
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
