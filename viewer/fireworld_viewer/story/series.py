"""A run in numbers: over its steps, what is plotted and what the brigades chose; and their choices counted.

A record leaves out what there is none of in its step; the tables have a row for every step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fireworld.outcome import QUANTITIES
from fireworld.records import ACTION_NAMES, ACTIONS, EVENT_KINDS, Array, CityRecord, Recording, name_of

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
_OWN_TARGET: Final = ACTION_NAMES.index("own-target")
_REFILLED: Final = EVENT_KINDS.index("refilled")


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
    action = chosen_actions(recording)
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
        target=chosen_targets(recording),
        explored=per_brigade(recording, "explored", missing=False),
        action_values=values,
        value=np.where(ranked, target_value, of_action),
        ranked=ranked,
    )


def chosen_actions(recording: Recording) -> NDArray[np.int64]:
    """Return the actions of all steps, (k, n_brigades): indices of names, which later versions may add to; -1 none."""
    actions: NDArray[np.int64] = np.maximum(per_brigade(recording, "action", missing=-1), -1)
    return actions


def chosen_targets(recording: Recording) -> NDArray[np.int64]:
    """Return the targets of all steps, (k, n_brigades): indices of buildings; -1 none, or one that there is not."""
    return existing(per_brigade(recording, "target", missing=-1), recording.city)


def existing(buildings: NDArray[Any], city: CityRecord) -> NDArray[Any]:
    """Return indices of buildings; -1 for those that are none of this city."""
    return np.where((buildings >= 0) & (buildings < len(city.building_id)), buildings, -1)


def action_name(action: int) -> str:
    """Return the name of an action, its number where only a later version knows it."""
    return name_of(ACTION_NAMES, action, "action")


def per_brigade(recording: Recording, name: str, *, missing: float, topic: str = "/decisions") -> NDArray[Any]:
    """Return one field over all steps, (k, n_brigades), of the type of `missing`, which stands where there is none."""
    n = len(recording.city.brigade_tank_litres)
    table = np.full((len(recording.steps), n), missing)
    for row, recorded in zip(table, recording.ragged(topic, name), strict=True):
        if len(recorded) == n:
            row[...] = recorded
    return table


def recorded(recording: Recording, field: str) -> bool:
    """Return whether a recording has a field, as in "brigades.activity", or a topic: an imported log may not."""
    return not recording.header.lacks(field)


def series(recording: Recording, field: str) -> NDArray[np.float64]:
    """Return a field over all steps, as in "score.n_burning": (k,) of a value, (k, width) of an array."""
    topic, _, name = field.partition(".")
    return np.asarray(recording.column(f"/{topic}", name), dtype=np.float64)


@dataclass(frozen=True, kw_only=True)
class OwnTarget:
    """A building that a policy named itself as the target of a brigade."""

    building: int  # its index
    n_steps: int
    first_step: int
    last_step: int


@dataclass(frozen=True, kw_only=True)
class Counts:
    """What one brigade chose and did in the steps in which brigades were asked for a decision."""

    brigade: int
    n_by_action: tuple[int, ...]  # steps by index into ACTION_NAMES
    n_without: int  # steps without a choice: refilling, dead, or nothing burns
    n_changes: int  # how often a choice differed from the one before; steps without a choice are ignored
    n_explored: int
    sprayed_litres: int
    driven_m: float
    n_refills: int
    own_targets: Sequence[OwnTarget]  # those pursued longest first


def count_choices(recording: Recording) -> list[Counts]:
    """Count what each brigade chose and did; steps in which no brigade was asked are left out."""
    asked = np.array([len(row) > 0 for row in recording.ragged("/decisions", "action")], dtype=bool)
    steps = np.asarray(recording.steps)[asked]
    choices = choices_of(recording)
    action, target, explored = choices.action[asked], choices.target[asked], choices.explored[asked]
    sprayed, driven = (
        np.asarray(recording.column("/brigades", name))[asked] for name in ("sprayed_litres", "driven_m")
    )
    kinds, entities = recording.ragged("/events", "kind"), recording.ragged("/events", "entity")
    refilled = [np.asarray(who)[np.asarray(kind) == _REFILLED] for kind, who in zip(kinds, entities, strict=True)]
    n_refills = _numbers(np.concatenate([np.zeros(0, dtype=np.int64), *refilled]), action.shape[1])
    return [
        Counts(
            brigade=brigade,
            n_by_action=tuple(_numbers(action[:, brigade], len(ACTION_NAMES))),
            n_without=int(np.count_nonzero(action[:, brigade] < 0)),
            n_changes=_changes(action[:, brigade], target[:, brigade]),
            n_explored=int(np.count_nonzero(explored[:, brigade])),
            sprayed_litres=int(sprayed[:, brigade].sum()),
            driven_m=float(driven[:, brigade].sum()),
            n_refills=n_refills[brigade],
            own_targets=_own_targets(steps, action[:, brigade], target[:, brigade]),
        )
        for brigade in range(action.shape[1])
    ]


def _numbers(codes: Array, n: int) -> list[int]:
    counts: list[int] = np.bincount(codes[codes >= 0].astype(np.int64), minlength=n)[:n].tolist()
    return counts


def _changes(action: Array, target: Array) -> int:
    """Count changes of the action, or of the target where that is what was chosen."""
    chosen = np.where(action == _OWN_TARGET, len(ACTION_NAMES) + target, action)[action >= 0]
    return int(np.count_nonzero(chosen[1:] != chosen[:-1]))


def _own_targets(steps: Array, action: Array, target: Array) -> list[OwnTarget]:
    own = (action == _OWN_TARGET) & (target >= 0)
    found = []
    for building in np.unique(target[own]).tolist():
        when = steps[own & (target == building)]
        found.append(OwnTarget(building=building, n_steps=len(when), first_step=int(when[0]), last_step=int(when[-1])))
    return sorted(found, key=lambda one: (-one.n_steps, one.first_step, one.building))
