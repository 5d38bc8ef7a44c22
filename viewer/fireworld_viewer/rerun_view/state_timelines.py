"""Timelines of states in Rerun: what each brigade does and which action it chose, as colored bands over the steps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import rerun
from numpy.typing import NDArray

from fireworld.records import ACTION_NAMES, ACTIVITIES, Recording
from fireworld_viewer import colors
from fireworld_viewer.rerun_view.layers import Layers
from fireworld_viewer.story.series import per_brigade

NO_CHOICE: Final = "no choice"
"""Of a brigade that refills or is dead, or where nothing burns."""


def log_brigade_states(layers: Layers, recording: Recording) -> None:
    """Send two timelines for each brigade: its activity, and the action that it chose."""
    activity = recording.column("/brigades", "activity")
    action = per_brigade(recording, "action", missing=-1)
    names, rgb = (*ACTION_NAMES, NO_CHOICE), (*colors.ACTION_RGB, colors.NO_CHOICE_RGB)
    for brigade in range(activity.shape[1]):
        path = f"activity/brigade_{brigade}"
        log_state_timeline(layers, path, activity[:, brigade], ACTIVITIES, colors.ACTIVITY_RGB)
        log_state_timeline(layers, f"action/brigade_{brigade}", action[:, brigade], names, rgb)


def log_state_timeline(
    layers: Layers, path: str, codes: NDArray[np.integer], names: Sequence[str], rgb: Sequence[colors.Rgb]
) -> None:
    """Send one timeline: a row wherever the code changes.

    codes: (k,) index into the names of the states, and into their colors, at each step; -1 is the last of them.
    """
    layers.static(path, rerun.StateConfiguration(values=list(names), colors=colors.packed_table(rgb)))
    changed = layers.changed(path, codes[:, np.newaxis])
    if len(changed):
        states = rerun.StateChange.columns(state=[names[code] for code in codes[changed]])
        layers.rows(path, states, steps=layers.steps[changed])
