"""Means, intervals and paired comparisons: hand-worked numbers, coverage, and the same answer every time."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from fireworld.evaluation.statistics import (
    estimate,
    interquartile_mean,
    mean,
    paired_difference,
    probability_of_improvement,
)

tables = arrays(np.float64, st.tuples(st.integers(1, 4), st.integers(1, 5)), elements=st.floats(-1e6, 1e6))


def test_the_interquartile_mean_leaves_out_a_quarter_at_either_end():
    assert interquartile_mean(np.array([100.0, 3.0, 1.0, 2.0, 4.0, 5.0, 6.0, -90.0])) == 3.5
    assert interquartile_mean(np.array([1.0, 2.0, 6.0])) == 3.0


def test_the_mean_is_rounded_once():
    assert mean(np.array([1e16, 1.0, 1.0, -1e16])) == 0.5


def test_one_value_is_its_own_interval():
    found = estimate(np.array([[7.0]]))
    assert (found.mean, found.low, found.high, found.interquartile_mean) == (7.0, 7.0, 7.0, 7.0)
    assert (found.n_repetitions, found.n_seeds) == (1, 1)


@pytest.mark.parametrize("value", [0.0, 10.787, 8.795, 1e-9])
def test_equal_values_have_an_interval_of_no_width(value):
    found = estimate(np.full((7, 11), value))
    assert found.mean == value
    assert found.low <= value <= found.high
    assert found.high - found.low <= 1e-12 * value


@given(tables)
def test_the_interval_lies_within_the_values(values):
    found = estimate(values)
    slack = 1e-9 * max(1.0, np.abs(values).max())
    assert values.min() - slack <= found.low <= found.high <= values.max() + slack


def test_spread_between_repetitions_counts_though_every_seed_repeats_it():
    """Four repetitions of many equal runs are four values, not four hundred."""
    repetitions = np.repeat(np.array([[0.0], [0.0], [1.0], [1.0]]), 100, axis=1)
    found = estimate(repetitions)
    assert found.mean == 0.5
    assert found.low <= 0.1
    assert found.high >= 0.9


def test_the_interval_covers_the_truth_about_as_often_as_it_says():
    draw = np.random.default_rng(1)
    hits = 0
    for _ in range(100):
        values = draw.normal(size=(12, 1)) + draw.normal(size=(1, 12)) + draw.normal(size=(12, 12))
        found = estimate(values)
        hits += found.low <= 0.0 <= found.high
    assert 88 <= hits <= 99


def test_pairs_take_luck_out():
    luck = np.array([[0.0, 10.0, 20.0, 30.0]])
    better = np.array([[1.0, 11.0, 21.0, 31.0], [2.0, 12.0, 22.0, 32.0]])
    found = paired_difference(better, luck)
    assert (found.mean, found.low, found.high) == (1.5, 1.0, 2.0)
    assert found.above_zero
    assert paired_difference(luck, better).below_zero
    assert probability_of_improvement(better, luck).mean == 1.0


def test_a_tie_is_half_an_improvement():
    assert probability_of_improvement(np.array([[1.0, 2.0, 3.0, 4.0]]), np.array([[1.0, 1.0, 9.0, 4.0]])).mean == 0.5


def test_equal_values_equal_estimates():
    values = np.arange(12.0).reshape(3, 4) ** 2
    found = estimate(values)
    assert found == estimate(values.copy())
    # Drawn once and kept: other numbers here mean that published intervals change.
    assert (found.mean, found.low, found.high) == (pytest.approx(506 / 12), 3.75, pytest.approx(265 / 3))
