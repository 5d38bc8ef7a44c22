"""Where two recordings first differ, in the steps of them that are shown."""

from __future__ import annotations

from fireworld_recorder.diff import RunComparison, compare
from fireworld_viewer.story.steps import check_same_city

from fireworld.records import Recording


def compare_shown(first: Recording, second: Recording) -> RunComparison:
    """Compare two recordings that are shown side by side; ViewError if they are of two cities."""
    check_same_city(first.city, second.city)
    return compare(first, second)


def first_shown(difference: RunComparison, first: Recording) -> tuple[int, str] | None:
    """Return the step at which a difference is to be seen, and the difference in words; None if there is none.

    Args:
        difference: of two recordings.
        first: the first of them, whose first step stands for what differs before any step.
    """
    found = difference.first
    if found is None:
        return None
    return int(first.steps[0]) if found.step is None else found.step, found.sentence
