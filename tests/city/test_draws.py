"""Keyed draws: known answers, both twins alike, and the distributions they promise."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from fireworld import draws
from fireworld.city import lot_draws
from fireworld.kernels import draws as kernel

INT64 = st.integers(-(2**63), 2**63 - 1)


@njit
def many_normals(n, seed):
    drawn = np.empty(n)
    for entity in range(n):
        drawn[entity] = kernel.normal(seed, draws.BURN_RATE, entity, 41)
    return drawn


def test_mix_gives_the_published_first_words_of_splitmix64():
    assert draws.mix(0) == 0xE220A8397B1DCDAF
    assert draws.mix(draws.INCREMENT) == 0x6E789E6AA1B965F4


def test_keys_never_change():
    # Every recording hangs on these: another number here is another luck everywhere.
    assert draws.hash_key(1, draws.BURN_RATE, 369, 41) == 6595868356188710537
    assert draws.hash_key(-1, draws.CITY, 2**40, 0) == 16197928352812914666


def test_purposes_differ():
    purposes = {name: value for name, value in vars(draws).items() if name.isupper() and isinstance(value, int)}
    names = {*purposes} - {"MASK", "INCREMENT", "MULTIPLIER_1", "MULTIPLIER_2"}
    assert sorted(purposes[name] for name in names) == [*range(1, len(names) + 1)]


@given(INT64, st.integers(0, 20), st.lists(INT64, min_size=1, max_size=5), INT64, st.integers(1, 2**31))
def test_many_at_once_are_the_same_draws(seed, purpose, entities, step, bound):
    many = np.array(entities)
    each = [draws.hash_key(seed, purpose, entity, step) for entity in entities]
    assert lot_draws.hash_keys(seed, purpose, many, step).tolist() == each
    each = [draws.uniform(seed, purpose, entity, step) for entity in entities]
    assert lot_draws.uniforms(seed, purpose, many, step).tolist() == each
    each = [draws.below(seed, purpose, entity, step, bound=bound) for entity in entities]
    assert lot_draws.below(seed, purpose, many, step, bound=bound).tolist() == each
    assert lot_draws.below(seed, purpose, many, step, bound=np.full(len(many), bound)).tolist() == each


@given(INT64, st.integers(0, 20), INT64, INT64, st.integers(1, 2**31))
def test_both_twins_agree(seed, purpose, entity, step, bound):
    assert int(kernel.hash_key(seed, purpose, entity, step)) == draws.hash_key(seed, purpose, entity, step)
    assert kernel.uniform(seed, purpose, entity, step) == draws.uniform(seed, purpose, entity, step)
    below = draws.below(seed, purpose, entity, step, bound=bound)
    assert kernel.below(seed, purpose, entity, step, bound) == below
    assert 0 <= below < bound


@pytest.mark.parametrize("place", range(4))
def test_every_part_of_the_key_matters(place):
    key = [5, 6, 7, 8]
    plain = draws.hash_key(*key)
    key[place] += 1
    flipped = plain ^ draws.hash_key(*key)
    assert 10 < flipped.bit_count() < 54


def test_uniform_is_uniform():
    from scipy import stats

    drawn = [draws.uniform(3, draws.EXPLORE, entity, step) for entity in range(20) for step in range(500)]
    assert min(drawn) >= 0.0
    assert max(drawn) < 1.0
    assert stats.kstest(drawn, "uniform").pvalue > 1e-3


def test_uniform_takes_the_top_bits():
    assert kernel.uniform_of(np.uint64(2**64 - 1)) == 1.0 - 2.0**-53
    assert kernel.uniform_of(np.uint64(2047)) == 0.0
    assert kernel.uniform_of(np.uint64(2**63)) == 0.5


def test_normal_is_normal():
    from scipy import stats

    drawn = many_normals(100_000, 11)
    assert stats.kstest(drawn, "norm").pvalue > 1e-3
    assert abs(drawn.mean()) < 0.01
    assert abs(drawn.std() - 1.0) < 0.01
    assert stats.kstest(drawn[1:] * np.sign(drawn[:-1]), "norm").pvalue > 1e-3  # no tie between neighbours


def test_quantile_table_is_what_it_says():
    from scipy.special import ndtri

    table = kernel.NORMAL_QUANTILES
    n = len(table) - 1
    np.testing.assert_allclose(table[:-1], ndtri(0.5 + np.arange(n) / (2 * n)), rtol=1e-12, atol=1e-15)
    assert table[0] == 0.0
    # Between two quantiles the deviate is uniform; the sign is a coin, so the mean is exactly 0.
    variance = math.fsum(float(a * a + a * b + b * b) / 3 for a, b in pairwise(table)) / n
    assert abs(variance - 1.0) < 1e-12


def test_normal_reads_sign_interval_and_place_from_the_key():
    table = kernel.NORMAL_QUANTILES
    assert kernel.normal_of(np.uint64(5 << 1)) == table[5]
    assert kernel.normal_of(np.uint64(5 << 1 | 1)) == -table[5]
    middle = kernel.normal_of(np.uint64(1 << 63 | 2047 << 1))
    assert middle == pytest.approx((table[2047] + table[2048]) / 2)
