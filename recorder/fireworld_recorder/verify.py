"""Hold a recording against a replay of itself."""

from __future__ import annotations

from fireworld.records import Recording
from fireworld_recorder.diff import Difference, compare


def verify(log: Recording, replay: Recording) -> Difference | None:
    """Compare a log with its replay: city and every step, exactly.

    Args:
        log: the recording.
        replay: the same scenario, seed and decisions, run again while it is walked through, once.

    Returns:
        How they differ, the log's values as `a`; None if they do not.

    Raises:
        LogError: the log cannot be read.
    """
    difference = compare(log, replay)
    return None if difference.same else difference
