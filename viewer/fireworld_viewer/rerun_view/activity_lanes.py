"""Lanes: what each brigade does and which action it follows, as colored bands over the steps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fireworld.records import ACTION_NAMES, ACTIVITIES, Recording
from fireworld_viewer import colors
from fireworld_viewer.rerun_view.layers import Stage
from fireworld_viewer.story import choices

NO_CHOICE: Final = "no choice"
"""Of a brigade that refills or is dead, or where nothing burns."""


def log_lanes(stage: Stage, recording: Recording) -> None:
    """Send two lanes for each brigade: its activity, and the action that it chose."""
    activity = recording.column("/brigades", "activity")
    action = choices.per_brigade(recording, "action", missing=-1)
    for brigade in range(activity.shape[1]):
        log_lane(stage, f"activity/brigade_{brigade}", activity[:, brigade], ACTIVITIES, colors.ACTIVITY_RGB)
        names, rgb = (*ACTION_NAMES, NO_CHOICE), (*colors.ACTION_RGB, colors.NO_CHOICE_RGB)
        log_lane(stage, f"action/brigade_{brigade}", action[:, brigade], names, rgb)


def log_lane(
    stage: Stage, path: str, codes: NDArray[np.integer], names: Sequence[str], rgb: Sequence[colors.Rgb]
) -> None:
    """Send one lane: a row wherever the code changes.

    Args:
        stage: where to.
        path: entity path below the prefix.
        codes: (k,) index into the names at each step; -1 is the last of them.
        names: of the states.
        rgb: their colors.
    """
    import rerun

    style = rerun.StateConfiguration(values=list(names), colors=colors.packed_table(rgb))
    stage.static(path, style)
    changed = stage.changed(path, codes[:, np.newaxis])
    if len(changed):
        states = rerun.StateChange.columns(state=[names[code] for code in codes[changed]])
        stage.rows(path, states, steps=stage.steps[changed])
