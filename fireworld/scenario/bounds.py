"""Physical parameters that come from elsewhere than a scenario, held to the bounds they have in one."""

from __future__ import annotations

from fireworld.scenario.document import ANY_AMOUNT, BOUNDS
from fireworld.scenario.explain import within


def bounded(name: str, kind: str, value: float) -> tuple[int | float | None, str]:
    """Return the value of a parameter as its kind, "int" or "float", has it, None if out of bounds; and its bounds."""
    bounds = BOUNDS.get(name, ANY_AMOUNT)
    what = "a whole number" if kind == "int" else "a number"
    least = f"at least {bounds.ge:g}" if bounds.ge is not None else f"above {bounds.gt:g}"
    wanted = f"{what} {least} and at most {bounds.le:g}"
    if not within(value, bounds) or (kind == "int" and value != int(value)):
        return None, wanted
    return (int(value) if kind == "int" else value), wanted
