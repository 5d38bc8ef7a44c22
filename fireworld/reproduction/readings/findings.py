"""What a study of readings found, in words written from its numbers."""

from __future__ import annotations

from statistics import fmean

from fireworld.evaluation.statistics import estimate
from fireworld.reproduction.readings.study import ReadingsStudy


def findings_text(study: ReadingsStudy) -> list[str]:
    """Return what was found, a sentence each, written from the numbers."""
    found = study.estimates
    n_above, n_below = sum(one.above_zero for one in found), sum(one.below_zero for one in found)
    mean = fmean(one.mean for one in found)
    said = [
        (
            f"Over {len(found)} readings cooperation adds {mean:+.2f} of the greatest score on the mean; in "
            f"{100 * n_above / len(found):.0f} % of them the interval lies above 0, in "
            f"{100 * n_below / len(found):.0f} % below. In the paper it adds +0.60."
        ),
        f"That no reading matters has p = {study.p:.3f} (main effects together, {len(study.choices)} choices).",
    ]
    sure = [one for one in study.effects if one.low > 0 or one.high < 0]
    said.append(
        "Choices that change what cooperation adds: " + "; ".join(f"{one.choice} {one.text()}" for one in sure) + "."
        if sure
        else "No choice by itself changes what cooperation adds by an amount that is off 0."
    )
    sure = [one for one in study.level_effects if one.low > 0 or one.high < 0]
    if sure:
        said.append("On the cooperative team's level: " + "; ".join(f"{one.choice} {one.text()}" for one in sure) + ".")
    for number, values in study.confirmed.items():
        again, first = estimate(values), found[number]
        word = "holds" if again.above_zero else "does not hold"
        said.append(
            f"Reading {number} ({study.named(number)}): {first.text(sign=True)} first, {again.text(sign=True)} in "
            f"fresh trainings; the claim {word} there."
        )
    if study.size.design == "quick" or study.size.trainings < 2:
        said.append("This was too little to claim anything: it shows how it looks.")
    return said
