"""Paired comparison: hand-worked differences, verdicts at their borders, the gate, and what more seeds are promised."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld.evaluation.paired import N_SEEDS_MIN, compare_outcomes, judge, over_all
from fireworld.outcome import METRICS
from tests.evaluation import synthetic

SEEDS = range(8)
GROWING = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]


def runs(score, *, score_max=10, burnt_out=100, steps=200, completed=True):
    """Make outcomes of given scores, one a seed."""
    return synthetic.outcomes(
        range(len(score)), score=score, score_max=score_max, burnt_out=burnt_out, steps=steps, completed=completed
    )


def score_of(a, b, **more):
    """Compare two lists of scores of 10 in one scenario."""
    return compare_outcomes({"s": runs(a)}, {"s": runs(b)}, **more)[0]


def shifted(shift, n=8):
    return score_of(GROWING[:n], [value + shift for value in GROWING[:n]])


def test_random_draws_that_both_see_are_taken_out():
    found = shifted(1.0)
    assert (found.a.mean, found.b.mean) == pytest.approx((0.35, 0.45))
    assert found.a.interquartile_mean == pytest.approx((2 + 3 + 4 + 5) / 40)
    assert (found.difference.mean, found.difference.low, found.difference.high) == pytest.approx((0.1, 0.1, 0.1))
    assert found.improvement.mean == 1.0
    assert found.verdict == "better"
    assert shifted(-1.0).verdict == "worse"
    assert shifted(-1.0).improvement.mean == 0.0


def test_what_pairing_is_worth():
    """Sums of squares by hand: of 0 to 7 it is 42; of the differences 0, 1, 0, 1 ... it is 2, of the other side 48."""
    other = [value + k % 2 for k, value in enumerate(GROWING)]
    found = score_of(GROWING, other)
    assert found.pairing_worth == pytest.approx((42 + 48) / 2)
    assert found.to_dict()["pairing_worth"] == found.pairing_worth
    assert "45" in found.cells
    assert shifted(1.0).pairing_worth is None or shifted(1.0).pairing_worth > 1e20


def test_fewer_of_the_burnt_out_is_better_and_so_is_less_time():
    a = {"s": runs(GROWING, burnt_out=100, steps=200)}
    b = {"s": runs(GROWING, burnt_out=90, steps=201)}
    by_name = {pairing.metric.name: pairing for pairing in compare_outcomes(a, b)[: len(METRICS)]}
    assert by_name["burnt-out"].difference.mean == -10
    assert by_name["burnt-out"].verdict == "better"
    assert by_name["burnt-out"].improvement.mean == 1.0
    assert by_name["time"].difference.mean == 1
    assert by_name["time"].verdict == "worse"
    assert judge(by_name["burnt-out"]) == "not worse"
    assert judge(by_name["time"]) == "worse"
    assert judge(by_name["time"], margin=1.0) == "not worse"
    assert by_name["score"].verdict == "equal"


def test_over_all_every_scenario_counts_the_same():
    a = {"one": runs([0.0] * 8), "two": runs([0.0] * 8, score_max=20)}
    b = {"one": runs([10.0, 0.0] * 4), "two": runs([10.0] * 8, score_max=20)}
    found = compare_outcomes(a, b)
    assert [pairing.scenario for pairing in found] == ["one"] * 4 + ["two"] * 4 + [None] * 4
    total = over_all(found)
    assert total.differences.tolist() == [0.75, 0.25] * 4
    assert total.difference.mean == 0.5
    assert total.improvement.mean == (0.75 + 1.0) / 2, "a tie is half an improvement"
    assert total.b.mean == 0.5
    assert total.b.interquartile_mean == 0.5, "of all 16 runs: 4 zeros, 8 halves, 4 ones"
    assert 0.25 < total.difference.low < 0.5 < total.difference.high < 0.75


def test_what_the_runs_of_one_seed_share_stays_together():
    """A scenario that is there twice makes no interval narrower: the random draws are the same, not more of them."""
    a, b = runs([0.0] * 8), runs([10.0, 0.0, 0.0, 10.0, 5.0, 10.0, 10.0, 3.0])
    once = over_all(compare_outcomes({"s": a}, {"s": b})).difference
    twice = over_all(compare_outcomes({"s": a, "again": a}, {"s": b, "again": b})).difference
    assert (twice.low, twice.high) == (once.low, once.high)


def test_a_fire_that_is_not_out_is_counted():
    found = compare_outcomes({"s": runs(GROWING, completed=[True] * 5 + [False] * 3)}, {"s": runs(GROWING)})
    assert (over_all(found, "time").a.n_truncated, over_all(found, "time").b.n_truncated) == (3, 0)


def test_five_seeds_tell_nothing_however_clear():
    assert shifted(1.0, n=N_SEEDS_MIN - 1).verdict == "cannot tell"
    assert shifted(1.0, n=N_SEEDS_MIN).verdict == "better"
    few = score_of([0.0] * 10, [9.0] * 5 + [0.0] * 5)
    assert few.difference.low > 0
    assert few.verdict == "cannot tell", "five seeds that differ, and five that do not"
    assert few.more_seeds == 2, "twelve, so that six differ"


@pytest.mark.parametrize(("n", "more"), [(1, 5), (2, 4), (5, 1)])
def test_of_few_seeds_the_least_number_is_told(n, more):
    found = shifted(1.0, n=n)
    assert (found.verdict, found.more_seeds) == ("cannot tell", more)
    assert f"at least {more} more seeds" in found.reason
    assert judge(found) == "cannot tell"
    assert (found.difference.low, found.difference.high) == (found.difference.mean,) * 2 if n == 1 else True


def test_more_seeds_follow_from_mean_and_spread():
    found = score_of([0.0] * 8, [4.0, -3.0] * 4)
    assert found.verdict == "cannot tell"
    variance = 8 * 0.35**2 / 7
    assert found.more_seeds == np.ceil(7.849 * variance / 0.05**2) - 8
    assert found.reason == f"about {found.more_seeds} more seeds would tell"


def test_they_tell_four_times_in_five():
    draw, told = np.random.default_rng(1), 0
    n = int(np.ceil(7.849 / 0.5**2))
    for _ in range(30):
        told += score_of([0.0] * n, draw.normal(loc=0.5, size=n)).verdict == "better"
    assert 0.68 <= told / 30 <= 0.96


def test_equal_policies_are_seldom_told_apart():
    draw = np.random.default_rng(1)
    told = [score_of(draw.normal(size=40), draw.normal(size=40)).verdict for _ in range(50)]
    assert told.count("cannot tell") >= 44


def test_no_number_of_seeds_tells_what_does_not_differ():
    ties = score_of(GROWING, GROWING)
    assert (ties.verdict, ties.more_seeds, ties.reason) == ("equal", None, "")
    few = score_of(GROWING[: N_SEEDS_MIN - 1], GROWING[: N_SEEDS_MIN - 1])
    assert (few.verdict, few.reason) == ("cannot tell", "at least 1 more seeds are needed")
    assert ties.improvement.mean == 0.5
    assert judge(ties) == "not worse", "that much is told"
    balanced = score_of([0.0] * 8, [1.0, -1.0] * 4)
    assert (balanced.more_seeds, balanced.reason) == (None, "no number of seeds up to 10,000 would tell")
    hair = score_of([0.0] * 8, [1.0, -1.0] * 3 + [1.0, -0.9999])
    assert hair.reason == "no number of seeds up to 10,000 would tell"


def test_a_policy_and_itself():
    found = score_of([1.0], [1.0], same_policy=True)
    assert (found.verdict, found.reason, found.more_seeds) == ("the same policy", "", None)
    assert judge(found) == "not worse"


def test_the_gate_at_its_borders():
    worse = shifted(-1.0)
    assert worse.difference.high < 0
    assert judge(worse) == "worse"
    assert judge(worse, margin=0.05) == "worse", "all of it lies below zero, and below the margin"
    assert judge(worse, margin=0.11) == "not worse"
    unsure = score_of([0.0] * 8, [4.0, -3.0] * 4)
    assert judge(unsure) == "cannot tell"
    assert judge(unsure, margin=0.02) == "cannot tell"
    assert judge(unsure, margin=0.9) == "not worse"
    partly = score_of([0.0] * 8, [-1.0, -2.0] * 4)
    assert -0.2 < partly.difference.low < -0.15 < partly.difference.high < -0.1
    assert judge(partly, margin=0.15) == "worse", "below zero for sure; whether within the margin is not told"


def test_a_margin_needs_fewer_seeds():
    unsure = score_of([0.0] * 8, [3.0, -3.4] * 4)
    assert unsure.seeds_needed(margin=0.2) < unsure.seeds_needed()
    assert unsure.advice(margin=0.2) == f"about {unsure.seeds_needed(margin=0.2):,} more seeds would tell"


def test_the_same_runs_give_the_same_numbers():
    a, b = {"s": runs(GROWING)}, {"s": runs(GROWING[::-1])}
    one, other = compare_outcomes(a, b)[0], compare_outcomes(a, b)[0]
    assert (one.difference, one.improvement) == (other.difference, other.improvement)
