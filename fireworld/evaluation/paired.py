"""Two policies on the same scenarios and seeds, compared run by run: differences, verdicts, and the gate made of them.

B is the new policy, A the reference; every difference is B - A. Both see the same random draws (common random numbers),
so the pairs of runs are what is resampled. Over all scenarios, or those of a suite, a seed is drawn with its runs in
all of them: every scenario keeps its share of each resample, and what the runs of one seed share stays together.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import reduce
from operator import add
from typing import Any, Final, Literal

import numpy as np

from fireworld.evaluation.runs import Outcomes
from fireworld.evaluation.statistics import Estimate, estimate, interquartile_mean, mean, paired_difference
from fireworld.kernels.arrays import Array
from fireworld.outcome import METRICS, Metric

Verdict = Literal["better", "worse", "equal", "cannot tell", "the same policy"]
Judgement = Literal["not worse", "worse", "cannot tell"]

N_SEEDS_MIN: Final = 6
"""Seeds that must differ for a verdict: five all of one sign come by chance once in sixteen times."""
N_SEEDS_ENOUGH: Final = 20  # below it intervals are too narrow
N_SEEDS_MAX: Final = 10_000  # where more would be needed, the difference is too small for a verdict
_POWER: Final = 7.849
"""(1.960 + 0.842)^2: an interval of 95 % that leaves out zero four times in five."""


@dataclass(frozen=True)
class Side:
    """How one policy did."""

    mean: float
    interquartile_mean: float
    n_truncated: int
    """Runs in which the fire was not out at the last step, which stands for their time to complete."""


@dataclass(frozen=True, eq=False)
class Pairing:
    """One metric in one scenario or suite, or over all."""

    scenario: str | None  # or suite; None: over all
    metric: Metric
    a: Side
    b: Side
    differences: Array  # (n_seeds,) B - A; of a suite or over all: mean over the scenarios
    difference: Estimate
    improvement: Estimate
    """Probability that a run of B is better than its pair; a tie counts as half."""
    same_policy: bool
    pairing_worth: float | None = None
    """Variance of B - A with other seeds for either side, over that of the pairs; None: all pairs differ alike."""

    @property
    def verdict(self) -> Verdict:
        """What B is: better or worse where the interval leaves out zero and enough seeds differ, equal if none does."""
        if self.same_policy:
            return "the same policy"
        if not self.n_differing and len(self.differences) >= N_SEEDS_MIN:
            return "equal"
        low, high = self.interval_of_gain
        if self.n_differing < N_SEEDS_MIN:
            return "cannot tell"
        return "better" if low > 0.0 else "worse" if high < 0.0 else "cannot tell"

    @property
    def n_differing(self) -> int:
        """Seeds on which the two are not equal."""
        return int(np.count_nonzero(self.differences))

    @property
    def more_seeds(self) -> int | None:
        """Seeds still to be run until a verdict is likely; None: there is one, or no number would do."""
        return self.seeds_needed() if self.verdict == "cannot tell" else None

    @property
    def reason(self) -> str:
        """What it would take to reach a verdict, in words; empty where there is one."""
        return self.advice() if self.verdict == "cannot tell" else ""

    @property
    def interval_of_gain(self) -> tuple[float, float]:
        """Ends of the interval of the difference, with the sign that makes more better."""
        low, high = self.metric.gain(self.difference.low), self.metric.gain(self.difference.high)
        return min(low, high), max(low, high)

    @property
    def sentence(self) -> str:
        """Verdict, difference and probability in words."""
        reason = f", {self.reason}" if self.reason else ""
        difference = self.difference.text(digits=self.metric.digits, sign=True)
        return (
            f"{self.metric.label} {self.verdict}{reason}: {difference} {self.metric.unit}, "
            f"P(better) {self.improvement.mean:.2f}"
        )

    @property
    def cells(self) -> list[str]:
        """Cells of a table for people: metric, A, B, B - A, P, what pairing is worth, verdict."""
        digits = self.metric.digits
        difference = self.difference.text(digits=digits, sign=True)
        sides = (f"{side.mean:.{digits}f}" for side in (self.a, self.b))
        return [self.metric.label, *sides, difference, f"{self.improvement.mean:.2f}", self._worth, self.verdict]

    @property
    def _worth(self) -> str:
        worth = self.pairing_worth
        return "-" if worth is None else f"{worth:.{1 if worth < 10 else 0}f}"

    def to_dict(self) -> dict[str, Any]:
        """Return plain values (docs/comparing-policies.md)."""
        return {
            "scenario": self.scenario,
            "metric": self.metric.name,
            "unit": self.metric.unit,
            "higher_is_better": self.metric.higher_is_better,
            "a": asdict(self.a),
            "b": asdict(self.b),
            "difference": self.difference.ends(),
            "improvement": self.improvement.ends(),
            "pairing_worth": self.pairing_worth,
            "n_differing": self.n_differing,
            "verdict": self.verdict,
            "more_seeds": self.more_seeds,
            "reason": self.reason,
        }

    def seeds_needed(self, *, margin: float = 0.0) -> int | None:
        """Estimate how many more seeds would tell B from A, or from a loss of `margin`; None: no number would do.

        They do so four times in five, if the true difference is the one measured.
        """
        n, gain = len(self.differences), self.metric.gain(self.differences)
        middle = mean(gain)
        distance = max(abs(middle), middle + margin)
        if n == 1 or distance == 0.0:
            return N_SEEDS_MIN - n if n < N_SEEDS_MIN else None
        variance = math.fsum(((gain - middle) ** 2).tolist()) / (n - 1)
        n_of_which_enough_differ = n * N_SEEDS_MIN / self.n_differing if self.n_differing else 0.0
        needed = max(_POWER * variance / distance**2, n_of_which_enough_differ, N_SEEDS_MIN, n + 1)
        return math.ceil(needed) - n if needed <= N_SEEDS_MAX else None

    def advice(self, *, margin: float = 0.0) -> str:
        """Return in words how many more seeds would tell."""
        more = self.seeds_needed(margin=margin)
        if more is None:
            return f"no number of seeds up to {N_SEEDS_MAX:,} would tell"
        if len(self.differences) < N_SEEDS_MIN:
            return f"at least {more:,} more seeds are needed"
        return f"about {more:,} more seeds would tell"


def compare_outcomes(
    of_a: Mapping[str, Outcomes],
    of_b: Mapping[str, Outcomes],
    *,
    rows: Mapping[str, Sequence[str]] | None = None,
    same_policy: bool = False,
) -> list[Pairing]:
    """Compare the runs of two policies, of the same seeds: in each row, then over all, where every row counts the same.

    Args:
        of_a: the runs of A, by scenario.
        of_b: the runs of B.
        rows: the scenarios of each row; None: one in each.
        same_policy: A and B are one.
    """
    each = {name: [name] for name in of_a} if rows is None else rows
    everything = [*((name, [within]) for name, within in each.items()), (None, [*each.values()])]
    return [
        _pair(
            row,
            metric,
            *([[of[name] for name in within] for within in groups] for of in (of_a, of_b)),
            same_policy=same_policy,
        )
        for row, groups in everything
        for metric in METRICS
    ]


def over_all(pairings: Sequence[Pairing], metric: str = METRICS[0].name) -> Pairing:
    """Return the comparison of one metric over all scenarios."""
    return next(pairing for pairing in pairings if pairing.scenario is None and pairing.metric.name == metric)


def judge(pairing: Pairing, *, margin: float = 0.0) -> Judgement:
    """Judge whether B is not worse than A; `margin`, in the metric's unit, is a loss that does not matter.

    Not worse: the interval of the gain does not reach below -margin. Worse: it does, and lies wholly below zero.
    """
    if pairing.verdict == "the same policy":
        return "not worse"
    low, _ = pairing.interval_of_gain
    if len(pairing.differences) >= N_SEEDS_MIN and low >= -margin:
        return "not worse"
    return "worse" if pairing.verdict == "worse" else "cannot tell"


def _pair(
    row: str | None,
    metric: Metric,
    of_a: Sequence[Sequence[Outcomes]],
    of_b: Sequence[Sequence[Outcomes]],
    *,
    same_policy: bool,
) -> Pairing:
    """Compare one metric over groups of scenarios, each of which counts the same."""
    values_a, values_b = (
        [[getattr(outcomes, metric.attribute).astype(np.float64) for outcomes in group] for group in side]
        for side in (of_a, of_b)
    )
    mean_a, mean_b = _over_groups(values_a), _over_groups(values_b)
    chances = [
        [_chance(metric.gain(b - a)) for a, b in zip(group_a, group_b, strict=True)]
        for group_a, group_b in zip(values_a, values_b, strict=True)
    ]
    return Pairing(
        scenario=row,
        metric=metric,
        a=_side(of_a, values_a),
        b=_side(of_b, values_b),
        differences=(mean_b - mean_a)[0],
        difference=paired_difference(mean_b, mean_a),
        improvement=estimate(_over_groups(chances)),
        same_policy=same_policy,
        pairing_worth=_pairing_worth(mean_a[0], mean_b[0]),
    )


def _chance(gain: Array) -> Array:
    """Return for each pair whether B is better: 1, or 0; a half where it is equal."""
    return np.where(gain > 0.0, 1.0, np.where(gain == 0.0, 0.5, 0.0))


def _pairing_worth(a: Array, b: Array) -> float | None:
    """Return how many times as many runs would be needed without common random numbers, for the same precision."""
    paired = _squares(b - a)
    return (_squares(a) + _squares(b)) / paired if paired > 0.0 else None


def _squares(values: Array) -> float:
    """Return the sum of squared deviations from the mean."""
    middle = mean(values)
    return math.fsum(((values - middle) ** 2).tolist())


def _side(groups: Sequence[Sequence[Outcomes]], values: Sequence[Sequence[Array]]) -> Side:
    pooled = np.concatenate([each for group in values for each in group])
    n_truncated = sum(int(np.count_nonzero(~each.completed)) for group in groups for each in group)
    alike = len({len(group) for group in groups}) == 1
    middle = mean(pooled) if alike else mean(_over_groups(values))
    return Side(mean=middle, interquartile_mean=interquartile_mean(pooled), n_truncated=n_truncated)


def _over_groups(groups: Sequence[Sequence[Array]]) -> Array:
    """Return the mean over groups of the means over their scenarios, seed by seed: (1, n_seeds)."""
    return _middle([_middle(group) for group in groups])[np.newaxis]


def _middle(values: Sequence[Array]) -> Array:
    """Return the mean of arrays of one shape."""
    total: Array = reduce(add, values) / len(values)
    return total
