"""What counts as an event of a step: the rules, for kernels and for imported logs."""

from __future__ import annotations

from typing import Any, Final

from fireworld.records import EVENT_KINDS

IGNITED, EXTINGUISHED, BURNT_OUT, SITE_OUT, REFILLED, TANK_EMPTY = (
    EVENT_KINDS.index(kind) for kind in ("ignited", "extinguished", "burnt-out", "site-out", "refilled", "tank-empty")
)
CIVILIAN_HURT, CIVILIAN_DIED, BRIGADE_HURT, BRIGADE_DIED = (
    EVENT_KINDS.index(f"{who}-{what}") for who in ("civilian", "brigade") for what in ("hurt", "died")
)
FIRE_EVENTS: Final = (IGNITED, EXTINGUISHED, BURNT_OUT)
"""Those of buildings, in the order in which they are recorded."""
NO_EVENT: Final = -1


def fire_event(before: int, code: int) -> int:
    """Return what happened to a building, one of FIRE_EVENTS or NO_EVENT; compiled by `fireworld.kernels.recorded`.

    Args:
        before: its fieryness before the step.
        code: its fieryness after it.
    """
    burnt, burns = 1 <= before <= 3, 1 <= code <= 3
    if burns:
        return NO_EVENT if burnt else IGNITED
    if code == 8:
        return NO_EVENT if before == 8 else BURNT_OUT
    return EXTINGUISHED if burnt else NO_EVENT


def zero_against_more(zero: Any, more: Any) -> Any:
    """Return whether the one number is zero and the other more; of two arrays where. Compiled as `fire_event` is.

    It says who was hurt or died, and which tank is empty: the one number is of now, the other of before.
    """
    return (zero == 0) & (more > 0)
