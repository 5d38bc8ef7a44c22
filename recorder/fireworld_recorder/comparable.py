"""Compare the headers of two runs: what they were asked to do, and whether the runs can be compared at all."""

from __future__ import annotations

import dataclasses

from fireworld.errors import LogError
from fireworld.records import RunHeader

_DIGEST_SHOWN = 12


def header_differences(a: RunHeader, b: RunHeader) -> dict[str, tuple[str | int, str | int]]:
    """Return what the runs were asked to do differently; attachments are covered by the digests."""
    names = [item.name for item in dataclasses.fields(RunHeader) if item.name != "attachments"]
    return {name: (getattr(a, name), getattr(b, name)) for name in names if getattr(a, name) != getattr(b, name)}


def check_same_scenario(a: RunHeader, b: RunHeader, *, names: tuple[str, str]) -> None:
    """Check that two runs are of one scenario.

    Args:
        a: header of the first run.
        b: header of the second run.
        names: what to call the two.

    Raises:
        LogError: they are not; with both scenarios.
    """
    if a.scenario_digest == b.scenario_digest:
        return
    shown = [
        f"{header.scenario} ({header.scenario_digest[:_DIGEST_SHOWN]}) in {name}"
        for header, name in zip((a, b), names, strict=True)
    ]
    raise LogError(
        f"cannot compare runs of different scenarios, {shown[0]} and {shown[1]}; try --any-scenario if that is meant"
    )
