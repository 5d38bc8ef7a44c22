"""The run in words: lines of text for events and for choices, each in a log of its own."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import rerun

from fireworld.records import Recording
from fireworld_viewer import colors
from fireworld_viewer.rerun_view.layers import Layers
from fireworld_viewer.story.narration import LogLine, decision_lines, event_lines
from fireworld_viewer.story.series import choices_of


def log_text(layers: Layers, recording: Recording) -> None:
    """Send a line for every event, and one for every choice that is new or explores."""
    log_lines(layers, "log/events", event_lines(recording))
    choices = choices_of(recording)
    new = choices.explored.copy()
    for brigade in range(new.shape[1]):
        pairs = np.column_stack([choices.action[:, brigade], choices.target[:, brigade]])
        new[layers.changed(f"log/decisions/{brigade}", pairs), brigade] = True
    new[[len(row) == 0 for row in recording.ragged("/decisions", "action")]] = False  # nobody was asked
    log_lines(layers, "log/decisions", decision_lines(recording, choices, new))


def log_lines(layers: Layers, path: str, lines: Iterable[LogLine]) -> None:
    """Send lines of text, each at its step; nothing if there is none."""
    table = list(lines)
    if not table:
        return
    steps, levels, texts, rgb = zip(*table, strict=True)
    columns = rerun.TextLog.columns(text=texts, level=levels, color=colors.packed_table(rgb))
    layers.rows(path, columns, steps=np.array(steps, dtype=np.int64))
