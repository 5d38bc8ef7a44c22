"""The run in words: a line for each event and for each choice that differs from the step before."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

import numpy as np

from fireworld.records import ACTIONS, EVENT_KINDS, CityRecord, Recording
from viewer import colors
from viewer.stage import Stage

Line = tuple[int, str, str, colors.Rgb]
"""Step, level, text, color."""

_CIVILIAN: Final = "civilian {}"
_EVENT_LINES: Final = {
    "ignited": ("WARN", "building {} ignited", colors.FIERYNESS_RGB[2]),
    "extinguished": ("INFO", "building {} is out", colors.FIERYNESS_RGB[5]),
    "burnt-out": ("ERROR", "building {} burnt out", (150, 150, 150)),
    "civilian-hurt": ("WARN", "civilian {} is hurt", colors.DYING_RGB),
    "civilian-died": ("CRITICAL", "civilian {} died", colors.DYING_RGB),
    "tank-empty": ("WARN", "brigade {}: tank empty", colors.ACTIVITY_RGB[3]),
    "refilled": ("INFO", "brigade {}: tank full", colors.ACTIVITY_RGB[4]),
    "site-out": ("INFO", "fire {} is out", colors.HEALTHY_RGB),
    "brigade-hurt": ("WARN", "brigade {} is hurt", colors.DYING_RGB),
    "brigade-died": ("CRITICAL", "brigade {} died", colors.DYING_RGB),
}


def log_text(stage: Stage, recording: Recording) -> None:
    """Send the lines of events and of decisions, each to a log of its own."""
    _log_lines(stage, "log/events", event_lines(recording))
    _log_lines(stage, "log/decisions", decision_lines(recording))


def event_lines(recording: Recording) -> Iterator[Line]:
    """Word the events, in the order in which they happened."""
    named = _building_names(recording.city)
    kinds, entities = recording.ragged("/events", "kind"), recording.ragged("/events", "entity")
    for step, kind_row, entity_row in zip(recording.steps.tolist(), kinds, entities, strict=True):
        for kind, entity in zip(kind_row.tolist(), entity_row.tolist(), strict=True):
            level, wording, rgb = _EVENT_LINES[EVENT_KINDS[kind]]
            yield step, level, wording.format(named(entity) if "building" in wording else entity), rgb


def decision_lines(recording: Recording) -> Iterator[Line]:
    """Word each brigade's choice where it is new: another action, another target, or an exploring draw."""
    named = _building_names(recording.city)
    columns = [recording.ragged("/decisions", name) for name in ("action", "target", "explored")]
    last: dict[int, tuple[int, int]] = {}
    for step, *rows in zip(recording.steps.tolist(), *columns, strict=True):
        for brigade, (action, target, explored) in enumerate(zip(*(row.tolist() for row in rows), strict=True)):
            if last.get(brigade) == (action, target) and not explored:
                continue
            last[brigade] = (action, target)
            if action < 0:
                text = f"brigade {brigade}: no choice"
            else:
                aim = f" → building {named(target)}" if target >= 0 else ""
                text = f"brigade {brigade}: {ACTIONS[action]}{aim}{' (exploring)' if explored else ''}"
            yield step, "INFO", text, colors.BRIGADE_RGB[brigade % len(colors.BRIGADE_RGB)]


def _building_names(city: CityRecord) -> Callable[[int], int]:
    ids = np.asarray(city.building_id).tolist()
    return lambda index: ids[index]


def _log_lines(stage: Stage, path: str, lines: Iterator[Line]) -> None:
    import rerun

    table = list(lines)
    if not table:
        return
    steps, levels, texts, rgb = zip(*table, strict=True)
    columns = rerun.TextLog.columns(text=texts, level=levels, color=colors.packed_table(rgb))
    stage.rows(path, columns, steps=np.array(steps, dtype=np.int64))
