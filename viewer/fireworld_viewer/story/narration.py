"""The run in words: a line for each event, and for each choice that is new, with what the brigade saw and weighed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fireworld.records import ACTION_NAMES, ACTIONS, EVENT_KINDS, LEVELS, VOLUMES, CityRecord, Recording
from fireworld_viewer import colors
from fireworld_viewer.rerun_view.layers import Stage
from fireworld_viewer.story.choices import Choices, choices_of, per_brigade

Line = tuple[int, str, str, colors.Rgb]
"""Step, level, text, color."""

SEEN: Final = (
    "free_edges",
    "distance_from_center",
    "distance_from_civilian",
    "volume",
    *(f"others_{action.replace('-', '_')}" for action in ACTIONS),
    "state_index",
)
"""The features of /observations that a line tells."""

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


def log_text(stage: Stage, recording: Recording) -> None:
    """Send the lines of events and of decisions, each to a log of its own."""
    _log_lines(stage, "log/events", event_lines(recording))
    chosen = choices_of(recording)
    new = chosen.explored.copy()
    for brigade in range(new.shape[1]):
        pairs = np.column_stack([chosen.action[:, brigade], chosen.target[:, brigade]])
        new[stage.changed(f"log/decisions/{brigade}", pairs), brigade] = True
    new[[len(row) == 0 for row in recording.ragged("/decisions", "action")]] = False  # nobody was asked
    _log_lines(stage, "log/decisions", decision_lines(recording, chosen, new))


def event_lines(recording: Recording) -> Iterator[Line]:
    """Word the events, in the order in which they happened."""
    named = _building_names(recording.city)
    kinds, entities = recording.ragged("/events", "kind"), recording.ragged("/events", "entity")
    for step, kind_row, entity_row in zip(recording.steps.tolist(), kinds, entities, strict=True):
        for kind, entity in zip(kind_row.tolist(), entity_row.tolist(), strict=True):
            level, wording, rgb = _EVENT_LINES[EVENT_KINDS[kind]]
            yield step, level, wording.format(named(entity) if "building" in wording else entity), rgb


def decision_lines(recording: Recording, chosen: Choices, new: NDArray[np.bool_]) -> Iterator[Line]:
    """Word the choices that are new: what for, by which value, and what the brigade saw.

    Args:
        recording: the steps.
        chosen: their choices.
        new: (k, n_brigades) which of the choices to word.
    """
    named = _building_names(recording.city)
    seen = {name: per_brigade(recording, name, missing=-1, topic="/observations") for name in SEEN}
    steps = recording.steps.tolist()
    for row, brigade in zip(*(places.tolist() for places in np.nonzero(new)), strict=True):
        action, target = int(chosen.action[row, brigade]), int(chosen.target[row, brigade])
        parts = ["no choice"]
        if action >= 0:
            aim = f" → building {named(target)}" if target >= 0 else ""
            exploring = " (exploring)" if chosen.explored[row, brigade] else ""
            weighed = weighed_words(chosen, row, brigade)
            saw = seen_words({name: int(table[row, brigade]) for name, table in seen.items()})
            parts = [f"{ACTION_NAMES[action]}{aim}{exploring}", weighed, saw]
        text = f"brigade {brigade}: {', '.join(part for part in parts if part)}"
        yield steps[row], "INFO", text, colors.BRIGADE_RGB[brigade % len(colors.BRIGADE_RGB)]


def weighed_words(chosen: Choices, row: int, brigade: int) -> str:
    """Say the value of a choice and that of the best other action; "" where the policy has no values."""
    values, action = chosen.values[row, brigade], int(chosen.action[row, brigade])
    own = float(chosen.chosen[row, brigade])
    if np.isnan(own):
        return ""
    ranked = bool(chosen.ranked[row, brigade])
    text = f"{'value' if ranked else 'Q'} {own:.4g}"
    others = [other for other in range(len(ACTIONS)) if other != action and not np.isnan(values[other])]
    if not others:
        return text
    best = max(others, key=lambda other: values[other])
    if ranked:
        return f"{text}, {ACTIONS[best]} would be {values[best]:.4g}"
    return f"{text} against {values[best]:.4g} of {ACTIONS[best]}"


def seen_words(saw: Mapping[str, int]) -> str:
    """Say the features that a brigade saw, by their names in the records; "" where it saw none."""
    if saw["state_index"] < 0:
        return ""
    others = [action for action in ACTIONS if saw[f"others_{action.replace('-', '_')}"] == 1]
    return (
        f"state {saw['state_index']}: free edges {saw['free_edges']}, center {LEVELS[saw['distance_from_center']]}, "
        f"civilian {LEVELS[saw['distance_from_civilian']]}, volume {VOLUMES[saw['volume']]}, "
        f"others {' '.join(others) or 'nothing'}"
    )


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
