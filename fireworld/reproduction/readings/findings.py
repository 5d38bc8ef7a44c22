"""What a study of readings found, in words written from its numbers."""

from __future__ import annotations

from statistics import fmean

from fireworld.reproduction.readings.effects import TRAININGS_LEAST, over_trainings
from fireworld.reproduction.readings.study import ReadingsStudy


def findings_text(study: ReadingsStudy) -> list[str]:
    """Return what was found, a sentence each, written from the numbers."""
    found, n = study.estimates, study.n_designed
    mean = fmean(one.mean for one in found[:n])
    said = [
        f"Over {n} readings cooperation adds {mean:+.2f} of the greatest score on the mean; the paper: +0.60.",
        _intervals_text(study),
        f"That no reading matters has p = {study.p:.3f} (main effects together, {len(study.choices)} choices).",
    ]
    sure = [one for one in study.effects if one.above_zero or one.below_zero]
    said.append(
        "Choices that change what cooperation adds: " + "; ".join(f"{one.choice} {one.text()}" for one in sure) + "."
        if sure
        else "No choice by itself changes what cooperation adds by an amount that is off 0."
    )
    sure = [one for one in study.level_effects if one.above_zero or one.below_zero]
    if sure:
        said.append("On the cooperative team's level: " + "; ".join(f"{one.choice} {one.text()}" for one in sure) + ".")
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
