"""The steps of a recording that are to be shown, read in one pass and held in memory."""

from __future__ import annotations

from fireworld.errors import ViewError, expected
from fireworld.records import MemoryRecording, Recording


def select_steps(
    recording: Recording, *, first: int | None = None, last: int | None = None, every: int = 1
) -> MemoryRecording:
    """Hold the steps from `first` to `last`, both included, and of these each `every`-th.

    What happened in steps left out (events, choices) is left out too.

    Raises:
        ViewError: no step is left.
    """
    steps = recording.steps
    low = int(first) if first is not None else int(steps.min(initial=0))
    high = int(last) if last is not None else int(steps.max(initial=0))
    kept = {int(step) for step in steps[(steps >= low) & (steps <= high)][::every]}
    if not kept:
        held = f"steps {steps[0]} to {steps[-1]}" if len(steps) else "no step at all"
        wanted = f"steps of the recording, which holds {held}"
        asked = f"steps {low} to {high}" if last is not None or low <= high else f"steps from {low} on"
        raise ViewError(expected("view", "--from and --to", wanted, asked))
    return MemoryRecording(recording.header, recording.city, [one for one in recording if one.step in kept])
