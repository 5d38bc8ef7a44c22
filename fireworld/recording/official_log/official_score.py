"""The score by the kernel's own function, with the factors of its configuration: to compare fireworld's with."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fireworld import scores
from fireworld.recording.official_log import names
from fireworld.recording.official_log.city import FULL_HP
from fireworld.recording.official_log.parts import Entity
from fireworld.recording.official_log.world import World, total
from fireworld.records import Array, StepRecord

FUNCTION: Final = "score.function"
"""Key of the configuration; its value is the name of a Java class."""
_LEGACY, _TODAY = "LegacyScoreFunction", "RSL21ScoreFunction"
_FACTORS: Final = (
    "", "heating", "burning", "inferno", "water-damage", "minor-damage", "moderate-damage", "severe-damage",
    "burnt-out",
)  # fmt: skip
"""Ends of the keys of the factors, by fieryness code; unburnt counts 1."""


@dataclass(frozen=True)
class OfficialScore:
    """What the kernel would have printed.

    Attributes:
        function: the score function that the configuration names.
        value: what it gives; None for a function that is not known here.
        ours: the score of the recording that follows the same rule.
    """

    function: str
    value: float | None
    ours: float | None


def official_score(
    record: StepRecord, world: World, buildings: Sequence[Entity], settings: Mapping[str, str]
) -> OfficialScore | None:
    """Return the score after a step by the kernel's configuration; None if that names no function.

    The legacy function weighs the total area of each building by its importance, and takes factors from the
    configuration; fireworld's rule takes the usual factors, and importance as 1.
    """
    function = settings.get(FUNCTION, "").rpartition(".")[2]
    if not function:
        return None
    hp = world.people[names.CIVILIAN].hp
    n_alive, healthy = int((hp > 0).sum()), int(hp.sum(dtype=np.int64)) / (len(hp) * FULL_HP) if len(hp) else 1.0
    if function == _TODAY:
        return OfficialScore(function, n_alive * math.exp(-scores.unhealth(healthy)), record.score.score_now)
    factors = _factors(settings)
    if function != _LEGACY or factors is None:
        return OfficialScore(function, None, None)
    area = np.array([_weighted_area(one) for one in buildings], dtype=np.float64)
    if not area.sum():
        return OfficialScore(function, None, None)
    saved = total(area * factors[world.fieryness])
    return OfficialScore(function, scores.paper_score(n_alive, healthy, saved, total(area)), record.score.score)


def _factors(settings: Mapping[str, str]) -> Array | None:
    """Return what part of a building counts as saved, by code; None if the configuration does not say."""
    try:
        given = [float(settings[f"score.standard.building-fire.{end}"]) for end in _FACTORS[1:]]
    except (KeyError, ValueError):
        return None
    return np.array([1.0, *given])


def _weighted_area(building: Entity) -> float:
    area, importance = building.properties.get(names.TOTAL_AREA), building.properties.get(names.IMPORTANCE)
    return float(area * (importance if isinstance(importance, int) else 1)) if isinstance(area, int) else 0.0
