"""Whether a recorded run is still what this simulator computes, for commands that build on it."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fireworld.records import Recording, Steps


def check_replay(recorded: Recording, replayed: Steps, *, source: str, hint: str = "") -> None:
    """Hold steps that were computed again against those recorded.

    Args:
        recorded: the steps in the file.
        replayed: the same steps, computed again; it is walked through once.
        source: the file.
        hint: what to do if they differ; to see all of it, if left out.

    Raises:
        LogError: they differ; names the first step.
    """
    from fireworld_recorder.diff import compare

    from fireworld.errors import LogError

    first = compare(recorded, replayed).first
    if first is not None:
        hint = hint or f"see `fireworld verify {source}`"
        raise LogError(f"{source}: does not replay to what is recorded: {first.sentence}; {hint}")
