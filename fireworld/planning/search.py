"""Search for a good joint assignment: from the best of a few, by changing one brigade's action at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from fireworld.planning.forecast import Assignment
from fireworld.records import ACTIONS

Value = Callable[[Assignment], float]


def with_action(assignment: Assignment, brigade: int, action: int) -> Assignment:
    """Return an assignment in which one brigade takes another action."""
    return (*assignment[:brigade], action, *assignment[brigade + 1 :])


def action_values(value: Value, assignment: Assignment, brigade: int) -> tuple[float, ...]:
    """Return the values of a brigade's four actions while the others follow the assignment."""
    return tuple(value(with_action(assignment, brigade, action)) for action in range(len(ACTIONS)))


def climb(value: Value, starts: Iterable[Assignment]) -> Assignment:
    """Return an assignment that no brigade can improve alone: coordinate ascent.

    The best start (ties: the lowest assignment) is improved brigade after brigade, until a whole round changes
    nothing. A change must be worth strictly more, so the climb ends; equal changes: the lowest action. The number of
    values grows with the number of brigades, that of all assignments as its power.

    Args:
        value: of an assignment; asked for the same one repeatedly.
        starts: at least one assignment.
    """
    best = max(sorted(starts), key=value)
    n_settled = 0
    brigade = 0
    while n_settled < len(best):
        values = action_values(value, best, brigade)
        action = values.index(max(values))
        if values[action] > values[best[brigade]]:
            best = with_action(best, brigade, action)
            n_settled = 0
        n_settled += 1
        brigade = (brigade + 1) % len(best)
    return best
