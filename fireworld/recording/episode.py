"""An episode of a training as a run in memory."""

from __future__ import annotations

from fireworld.recording.record import run_prepared
from fireworld.recording.run import Run
from fireworld.training.log.reader import AnyTraining, opened
from fireworld.training.log.replay import run_of


def open_episode(log: AnyTraining, number: int = -1) -> Run:
    """Return an episode of a training as a run in memory, worked out by replay and compared with the training log.

    Args:
        log: the path of a training log, or one that is open; as far as it is good.
        number: of the episode, counted through the log from 0; -1 is the last, -2 the one before it.
            `fireworld.replay_episode` finds episodes by scenario and world, and writes them.

    Raises:
        LogError: there is no such episode, it cannot be replayed, or this fireworld computes another one.
    """
    training = opened(log, partial=True)
    return run_prepared(run_of(training, number + len(training) if number < 0 else number))
