"""The run in words: a line for each event, and for each new choice with its value and what the brigade observed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fireworld.records import ACTIONS, EVENT_KINDS, LEVELS, VOLUMES, Recording, name_of
from fireworld_viewer import colors
from fireworld_viewer.story.series import ChoiceTables, action_name, per_brigade


class LogLine(NamedTuple):
    """A line of a log."""

    step: int
    level: str  # INFO, WARN, ERROR or CRITICAL
    text: str
    rgb: colors.Rgb


_OTHERS: Final = {f"others_{action.replace('-', '_')}": action for action in ACTIONS}
OBSERVED: Final = ("state_index", "free_edges", "distance_from_center", "distance_from_civilian", "volume", *_OTHERS)
"""The fields of /observations that a line about a choice contains."""

_EVENT_LINES: Final = {
    "ignited": ("WARN", "building {} ignited", colors.FIERYNESS_RGB[2]),
    "extinguished": ("INFO", "building {} is out", colors.FIERYNESS_RGB[5]),
    "burnt-out": ("ERROR", "building {} burnt out", colors.GREY_RGB),
    "civilian-hurt": ("WARN", "civilian {} is hurt", colors.DYING_RGB),
    "civilian-died": ("CRITICAL", "civilian {} died", colors.DYING_RGB),
    "tank-empty": ("WARN", "brigade {}: tank empty", colors.HYDRANT_RGB),
    "refilled": ("INFO", "brigade {}: tank full", colors.ACTIVITY_RGB[4]),
    "site-out": ("INFO", "fire {} is out", colors.REFUGE_RGB),
    "brigade-hurt": ("WARN", "brigade {} is hurt", colors.DYING_RGB),
    "brigade-died": ("CRITICAL", "brigade {} died", colors.DYING_RGB),
}


_UNKNOWN_EVENT: Final = ("INFO", "event of kind {} of {}", colors.GREY_RGB)
"""Of a kind that a later version knows."""


def event_lines(recording: Recording) -> Iterator[LogLine]:
    """Write the events in words, in the order in which they happened."""
    building_id = np.asarray(recording.city.building_id).tolist()
    kinds, entities = recording.ragged("/events", "kind"), recording.ragged("/events", "entity")
    for step, kind_row, entity_row in zip(recording.steps.tolist(), kinds, entities, strict=True):
        for kind, entity in zip(kind_row.tolist(), entity_row.tolist(), strict=True):
            level, wording, rgb = _UNKNOWN_EVENT
            if kind < len(EVENT_KINDS):
                level, wording, rgb = _EVENT_LINES[EVENT_KINDS[kind]]
            else:
                wording = wording.format(kind, "{}")
            if "building" in wording and not 0 <= entity < len(building_id):
                wording = wording.replace("building", "building of index")
                yield LogLine(step, level, wording.format(entity), rgb)
                continue
            yield LogLine(step, level, wording.format(building_id[entity] if "building" in wording else entity), rgb)


def decision_lines(recording: Recording, choices: ChoiceTables, new: NDArray[np.bool_]) -> Iterator[LogLine]:
    """Write choices in words, a line each; arguments as for `choice_words`."""
    steps = recording.steps.tolist()
    for row, brigade, text in choice_words(recording, choices, new):
        rgb = colors.BRIGADE_RGB[brigade % len(colors.BRIGADE_RGB)]
        yield LogLine(steps[row], "INFO", f"brigade {brigade}: {text}", rgb)


def choice_words(
    recording: Recording, choices: ChoiceTables, shown: NDArray[np.bool_]
) -> Iterator[tuple[int, int, str]]:
    """Write choices in words: the action, its target and value, and what the brigade observed.

    Args:
        recording: the run.
        choices: its choices.
        shown: (k, n_brigades), which of them to write.

    Yields:
        The row of the step, the brigade, and the words.
    """
    building_id = np.asarray(recording.city.building_id).tolist()
    observed = {name: per_brigade(recording, name, missing=-1, topic="/observations") for name in OBSERVED}
    for row, brigade in zip(*(places.tolist() for places in np.nonzero(shown)), strict=True):
        action, target = int(choices.action[row, brigade]), int(choices.target[row, brigade])
        parts = ["no choice"]
        if action >= 0:
            aim = f" → building {building_id[target]}" if target >= 0 else ""
            exploring = " (exploring)" if choices.explored[row, brigade] else ""
            state = state_words({name: int(table[row, brigade]) for name, table in observed.items()})
            parts = [f"{action_name(action)}{aim}{exploring}", value_words(choices, row, brigade), state]
        yield row, brigade, ", ".join(part for part in parts if part)


def value_words(choices: ChoiceTables, row: int, brigade: int) -> str:
    """Write the value of a choice and that of the best other action; "" where the policy has no values."""
    values, action = choices.action_values[row, brigade], int(choices.action[row, brigade])
    own = float(choices.value[row, brigade])
    if np.isnan(own):
        return ""
    ranked = bool(choices.ranked[row, brigade])
    text = f"{'value' if ranked else 'Q'} {own:.4g}"
    others = [other for other in range(len(ACTIONS)) if other != action and not np.isnan(values[other])]
    if not others:
        return text
    best = max(others, key=lambda other: values[other])
    if ranked:
        return f"{text}, {ACTIONS[best]} would be {values[best]:.4g}"
    return f"{text} against {values[best]:.4g} of {ACTIONS[best]}"


def state_words(observed: Mapping[str, int]) -> str:
    """Write the state that a brigade observed, feature by feature; "" where it observed none."""
    if observed["state_index"] < 0:
        return ""
    others = [action for name, action in _OTHERS.items() if observed[name] == 1]
    return (
        f"state {observed['state_index']}: free edges {observed['free_edges']}, "
        f"center {name_of(LEVELS, observed['distance_from_center'])}, "
        f"civilian {name_of(LEVELS, observed['distance_from_civilian'])}, "
        f"volume {name_of(VOLUMES, observed['volume'])}, "
        f"others {' '.join(others) or 'nothing'}"
    )
