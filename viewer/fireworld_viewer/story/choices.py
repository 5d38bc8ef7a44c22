"""What brigades chose, as tables over all steps; a record leaves out what there is none of in its step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import overload

import numpy as np
from numpy.typing import NDArray

from fireworld.records import ACTIONS, Recording


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
    values[action < 0] = np.nan
    values[is_rule(values)] = np.nan
    target_value = per_brigade(recording, "target_value", missing=np.nan)
    ranked = ~np.isnan(target_value) & (action >= 0)
    of_action = np.full((k, n), np.nan)
    known = (action >= 0) & (action < len(ACTIONS))
    of_action[known] = values[known, action[known]]
    return ChoiceTables(
        action=action,
        target=per_brigade(recording, "target", missing=-1),
        explored=per_brigade(recording, "explored", missing=0).astype(bool),
        action_values=values,
        value=np.where(ranked, target_value, of_action),
        ranked=ranked,
    )


def is_rule(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return whether values, (..., 4), are those of a rule: 1 for the action that it names, 0 for the others."""
    rule: NDArray[np.bool_] = np.all((values == 0) | (values == 1), axis=-1) & (np.sum(values == 1, axis=-1) == 1)
    return rule


@overload
def per_brigade(recording: Recording, name: str, *, missing: int, topic: str = ...) -> NDArray[np.int64]: ...
@overload
def per_brigade(recording: Recording, name: str, *, missing: float, topic: str = ...) -> NDArray[np.float64]: ...
def per_brigade(
    recording: Recording, name: str, *, missing: float, topic: str = "/decisions"
) -> NDArray[np.int64] | NDArray[np.float64]:
    """Return one field over all steps, (k, n_brigades), even where some steps have none of it.

    Args:
        recording: the steps.
        name: of the field.
        missing: stands where there is none; an int makes a table of whole numbers, a float one of floats.
        topic: of the field.
    """
    n = len(recording.city.brigade_tank_litres)
    kind = np.float64 if isinstance(missing, float) else np.int64
    table = np.full((len(recording.steps), n), missing, dtype=kind)
    for row, recorded in zip(table, recording.ragged(topic, name), strict=True):
        if len(recorded) == n:
            row[...] = recorded
    return table
