"""What the page gets of a city and of a run in it: columns of numbers, and words."""

from __future__ import annotations

from collections import deque
from typing import Any, Final

import numpy as np

from fireworld.errors import one_line
from fireworld.outcome import QUANTITIES, outcome_of
from fireworld.records import CityRecord, Recording
from fireworld_viewer.play.columns import Columns
from fireworld_viewer.play.look import PANELS
from fireworld_viewer.story.narration import choice_words, event_lines
from fireworld_viewer.story.series import choices_of, chosen_targets, recorded, series

PLACE_DIGITS: Final = 1
"""Of places in metres."""
ENTITY_FIELDS: Final = {
    "buildings.fieryness": 0,
    "buildings.temperature": 1,
    "buildings.fuel_share": 3,
    "buildings.water_litres": 0,
    "brigades.x_m": PLACE_DIGITS,
    "brigades.y_m": PLACE_DIGITS,
    "brigades.activity": 0,
    "brigades.tank_litres": 0,
    "brigades.sprayed_litres": 0,
    "brigades.hp": 0,
    "civilians.hp": 0,
    "civilians.x_m": PLACE_DIGITS,
    "civilians.y_m": PLACE_DIGITS,
    "civilians.buriedness": 0,
}
"""What is shown of buildings, brigades and civilians, and the digits after the point."""
_OF_CITY: Final = {
    **dict.fromkeys(("building_id", "floors", "material", "refuge_building"), 0),
    **dict.fromkeys(("outline_x_m", "outline_y_m", "center_x_m", "center_y_m"), PLACE_DIGITS),
    **dict.fromkeys(("node_x_m", "node_y_m", "hydrant_x_m", "hydrant_y_m"), PLACE_DIGITS),
    **dict.fromkeys(("civilian_x_m", "civilian_y_m"), PLACE_DIGITS),
    **dict.fromkeys(("outline_ptr", "street_from", "street_to"), 0),
    **dict.fromkeys(("civilian_building", "civilian_hp", "brigade_tank_litres"), 0),
    **dict.fromkeys(("ground_area_m2", "ignition_point"), 0),
}


def add_city(columns: Columns, city: CityRecord) -> dict[str, Any]:
    """Add the columns of a city, and return its words."""
    for name, digits in _OF_CITY.items():
        columns.add(f"city.{name}", getattr(city, name), digits=digits)
    return {"name": one_line(city.name), "attribution": one_line(city.attribution)}


def add_run(columns: Columns, recording: Recording, prefix: str) -> dict[str, Any]:
    """Add the columns of a run, their names below a prefix, and return its words."""
    for name, digits in ENTITY_FIELDS.items():
        numbers = recording.column(name) if recorded(recording, name) else np.zeros((0, 0))
        if numbers.shape[1]:  # positions of civilians, say, are in some logs only
            columns.add(f"{prefix}{name}", numbers, digits=digits)
    for panel in PANELS:
        for curve in panel.curves:
            if recorded(recording, curve.field):
                numbers = series(recording, curve.field)
                values = numbers.sum(axis=1) if curve.summed else numbers
                columns.add(f"{prefix}curve.{curve.field}", values, digits=curve.digits)
    columns.add(f"{prefix}steps", recording.steps)
    return {
        **_facts(recording),
        **_add_decisions(columns, recording, prefix),
        **_add_events(columns, recording, prefix),
    }


def _facts(recording: Recording) -> dict[str, Any]:
    """Return what identifies a run, and how it came out."""
    header, (last,) = recording.header, deque(recording, maxlen=1)
    outcome = outcome_of(last, recording.city)
    return {
        "scenario": one_line(header.scenario),
        "policy": one_line(header.policy),
        "seed": None if header.lacks("seed") else str(header.seed),
        "title": one_line(header.title),
        "outcome": [[one.label, one.text(outcome)] for one in QUANTITIES],
    }


def _add_decisions(columns: Columns, recording: Recording, prefix: str) -> dict[str, Any]:
    """Add the targets of all brigades and which words say what they chose; return the words, each once."""
    if not recorded(recording, "decisions"):
        return {"words": None}
    columns.add(f"{prefix}decisions.target", chosen_targets(recording))
    choices = choices_of(recording)
    asked = np.array([len(row) > 0 for row in recording.ragged("/decisions", "action")], dtype=bool)
    shown = np.repeat(asked[:, np.newaxis], choices.action.shape[1], axis=1)
    places: dict[str, int] = {"": 0}
    word = np.zeros(shown.shape, dtype=np.int64)
    for row, brigade, text in choice_words(recording, choices, shown):
        word[row, brigade] = places.setdefault(text, len(places))
    columns.add(f"{prefix}decisions.words", word)
    return {"words": list(places)}


def _add_events(columns: Columns, recording: Recording, prefix: str) -> dict[str, Any]:
    """Add the events, (n,) each: row of the step, kind, index of the entity; return their words and colors."""
    kinds, entities = recording.ragged("/events", "kind"), recording.ragged("/events", "entity")
    rows = np.repeat(np.arange(len(kinds)), [len(one) for one in kinds])
    none = np.zeros(0, dtype=np.int64)
    for name, numbers in (("row", rows), ("kind", np.concatenate([none, *kinds])),
                          ("entity", np.concatenate([none, *entities]))):  # fmt: skip
        columns.add(f"{prefix}events.{name}", numbers)
    lines = list(event_lines(recording))
    rgb = {str(kind): line.rgb for kind, line in zip(np.concatenate([none, *kinds]).tolist(), lines, strict=True)}
    return {"events": [line.text for line in lines], "eventRgb": rgb}
