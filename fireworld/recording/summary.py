"""Summary: what a recording holds and how far it is good, as plain values."""

from __future__ import annotations

from typing import Any

from fireworld_recorder.header import to_metadata
from fireworld_recorder.reader import Log
from fireworld_recorder.totals import plain, totals_of

from fireworld.records import FORMAT


def summary(log: Log) -> dict[str, Any]:
    """Return a recording's header, state, outcome and sizes, as `fireworld info --json` writes them.

    Raises:
        LogError: the recording changed since it was opened.
    """
    steps = log.steps
    metadata = to_metadata(log.header).items()
    return {
        "path": str(log.path),
        "format": FORMAT,
        "state": log.state,
        "damage": log.damage,
        "digest": log.digest,
        "header": {key: value for key, value in metadata if ":" not in key and key not in {"format", "checksum"}},
        "steps": {"n": len(log), "first": int(steps[0]), "last": int(steps[-1])} if len(log) else {"n": 0},
        "ending": _ending(log),
        "totals": plain(totals_of(log)),
        "n_buildings": len(log.city.building_id),
        "n_brigades": len(log.city.brigade_tank_litres),
        "n_civilians": len(log.city.civilian_hp),
        "snapshots": log.snapshots,
        "attachments": {name: len(data) for name, data in log.header.attachments.items()},
        "n_bytes": log.found.n_bytes,
        "topics": plain(log.topics),
    }


def _ending(log: Log) -> str:
    """Return how the run ended, in words."""
    if not len(log):
        return "no step"
    last = log.step(int(log.steps[-1]))
    if last.terminated:
        return "terminated: nothing burned any more"
    return "truncated: the last step of the scenario" if last.truncated else "stopped before its end"
