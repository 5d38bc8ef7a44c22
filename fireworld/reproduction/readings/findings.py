"""What a study of readings found, in words written from its numbers."""

from __future__ import annotations

from collections.abc import Iterable

from fireworld.reproduction.readings.effects import TRAININGS_LEAST, Effect, over_trainings
from fireworld.reproduction.readings.study import ReadingsStudy


def findings_text(study: ReadingsStudy) -> list[str]:
    """Return what was found, a sentence each, written from the numbers."""
    found, n = study.estimates, study.n_designed
    said = [
        f"Over {n} readings cooperation adds {study.mean.text()} of the greatest score on the mean; the paper: +0.60.",
        _intervals_text(study),
        f"That no reading matters has p = {study.p:.3f} (main effects together, {len(study.choices)} choices).",
    ]
    sure = _sure(study.effects)
    said.append(
        f"Choices that change what cooperation adds: {sure}."
        if sure
        else "No choice by itself changes what cooperation adds by an amount that is off 0."
    )
    for team, effects in (("with", study.level_effects), ("without", study.control_effects)):
        if sure := _sure(effects):
            said.append(f"On the level of the team {team} cooperation: {sure}.")
    if len(found) > n:
        further = (f"{study.named(number)} {found[number].text()}" for number in range(n, len(found)))
        said.append(f"Further levels, all else ours, where it adds {found[0].text()}: " + "; ".join(further) + ".")
    for number, values in study.confirmed.items():
        again, first = over_trainings(values), found[number]
        word = "holds" if again.above_zero else "does not hold" if again.can_tell else "can be neither held nor denied"
        said.append(
            f"Reading {number} ({study.named(number)}): {first.text()} first, {again.text()} in {len(values)} fresh "
            f"trainings; the claim {word} there."
        )
    if study.size.design == "quick" or study.size.trainings < 2:
        said.append("This was too little to claim anything: it shows how it looks.")
    return said


def _sure(effects: Iterable[Effect]) -> str:
    """Return those effects that are off 0, in words."""
    return "; ".join(f"{one.choice} {one.text()}" for one in effects if one.above_zero or one.below_zero)


def _intervals_text(study: ReadingsStudy) -> str:
    """Say in how many readings the interval lies off 0."""
    found = study.estimates[: study.n_designed]
    if not all(one.can_tell for one in found):
        return (
            f"With {study.size.trainings} trainings of each nobody can say of a single reading whether it adds "
            f"anything: that takes {TRAININGS_LEAST} at least."
        )
    above, below = (
        100 * sum(getattr(one, side) for one in found) / len(found) for side in ("above_zero", "below_zero")
    )
    return f"In {above:.0f} % of the readings the interval lies above 0, in {below:.0f} % below."
