"""What each brigade of a run chose and did, counted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fireworld.records import ACTION_NAMES, ACTIVITIES, EVENT_KINDS, Array, Recording
from fireworld_viewer.story.series import choices_of

_OWN_TARGET: Final = ACTION_NAMES.index("own-target")
_REFILLED: Final = EVENT_KINDS.index("refilled")


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
    n_by_activity: tuple[int, ...]  # steps by index into ACTIVITIES
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
    activity, sprayed, driven = (
        np.asarray(recording.column("/brigades", name))[asked] for name in ("activity", "sprayed_litres", "driven_m")
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
            n_by_activity=tuple(_numbers(activity[:, brigade], len(ACTIVITIES))),
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
