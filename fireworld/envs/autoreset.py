"""When a world that has ended begins its next episode."""

from __future__ import annotations

from enum import Enum

from fireworld.arguments import ArgumentError
from fireworld.errors import expected


class Autoreset(Enum):
    """When a world that has ended begins its next episode; the names and meanings are those of Gymnasium."""

    NEXT_STEP = "NextStep"
    """In the step after its last one, which then runs nothing: its action is ignored, its reward 0."""
    SAME_STEP = "SameStep"
    """At the end of its last step; what was seen at the end of the episode is returned beside what is seen then."""
    DISABLED = "Disabled"
    """When the caller says so."""


def autoreset_of(value: object) -> Autoreset:
    """Return a mode of ours, of Gymnasium's, or by its name.

    Raises:
        ArgumentError: there is none of that name.
    """
    named = getattr(value, "value", value)
    for mode in Autoreset:
        if named in (mode.value, mode.name, mode.name.lower().replace("_", "-")):
            return mode
    wanted = ", ".join(f"Autoreset.{mode.name}" for mode in Autoreset)
    raise ArgumentError(expected("autoreset", "", f"one of {wanted}", value))
