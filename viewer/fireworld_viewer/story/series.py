"""A run as tables over its steps: what is plotted and its labels, and what the brigades chose.

A record leaves out what there is none of in its step; the tables have a row for every step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fireworld.outcome import QUANTITIES
from fireworld.records import ACTIONS, Recording

REWARD_TERMS: Final = ("rewards.water_damaged", "rewards.burning", "rewards.burnt_out", "rewards.civilians")

LABELS: Final[Mapping[str, str]] = {
    **{one.field: one.label.removeprefix("still ") for one in QUANTITIES if one.field},
    "score.score_max": "greatest",
    "score.score_now": "by today's rule",
    **{term: term.removeprefix("rewards.") for term in REWARD_TERMS},
    "rewards.water_damaged": "water-damaged",
    "rewards.burnt_out": "burnt out",
    "rewards.total": "total",
}
"""What curves are called, by field; what is still burning after the last step is burning before."""


@dataclass(frozen=True)
class ChoiceTables:
    """Choices of k steps and n brigades; NaN where there is no value."""

    action: NDArray[np.int64]  # (k, n), -1 no choice
    target: NDArray[np.int64]  # (k, n) index of a building, -1 none
    explored: NDArray[np.bool_]  # (k, n)
    action_values: NDArray[np.float64]  # (k, n, 4) of the paper's actions
    value: NDArray[np.float64]  # (k, n) of the choice: the target's where targets are ranked, else the action's
    ranked: NDArray[np.bool_]  # (k, n) targets are ranked


def choices_of(recording: Recording) -> ChoiceTables:
    """Read the choices of all steps of a recording."""
    action = per_brigade(recording, "action", missing=-1)
    k, n = action.shape
    values = np.full((k, n, len(ACTIONS)), np.nan)
    for row, recorded in zip(values, recording.ragged("/decisions", "q_values"), strict=True):
        if len(recorded) == row.size:
            row[...] = np.asarray(recorded).reshape(row.shape)
    # A rule has no values: it gives 1 to the action that it names, 0 to the others.
    of_rule = np.all((values == 0) | (values == 1), axis=-1) & (np.sum(values == 1, axis=-1) == 1)
    values[of_rule | (action < 0)] = np.nan
    target_value = per_brigade(recording, "target_value", missing=np.nan)
    ranked = ~np.isnan(target_value) & (action >= 0)
    of_action = np.full((k, n), np.nan)
    known = (action >= 0) & (action < len(ACTIONS))
    of_action[known] = values[known, action[known]]
    return ChoiceTables(
        action=action,
        target=per_brigade(recording, "target", missing=-1),
        explored=per_brigade(recording, "explored", missing=False),
        action_values=values,
        value=np.where(ranked, target_value, of_action),
        ranked=ranked,
    )


def per_brigade(recording: Recording, name: str, *, missing: float, topic: str = "/decisions") -> NDArray[Any]:
    """Return one field over all steps, (k, n_brigades), of the type of `missing`, which stands where there is none."""
    n = len(recording.city.brigade_tank_litres)
    table = np.full((len(recording.steps), n), missing)
    for row, recorded in zip(table, recording.ragged(topic, name), strict=True):
        if len(recorded) == n:
            row[...] = recorded
    return table


def series(recording: Recording, field: str) -> NDArray[np.float64]:
    """Return a field over all steps, as in "score.n_burning": (k,) of a value, (k, width) of an array."""
    topic, _, name = field.partition(".")
    return np.asarray(recording.column(f"/{topic}", name), dtype=np.float64)
