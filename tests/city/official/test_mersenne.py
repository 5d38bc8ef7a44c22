"""The official generator, against published numbers and numbers worked out by hand."""

from __future__ import annotations

import random

import pytest

from fireworld.city.formats.official.mersenne import MersenneTwister, _init_by_array, _key
from fireworld.errors import CityError


def test_the_state_is_the_one_of_the_authors():
    generator = random.Random()
    generator.setstate((3, (*_init_by_array([0x123, 0x234, 0x345, 0x456]), 624), None))
    assert [generator.getrandbits(32) for _ in range(3)] == [1067595299, 955945823, 477289528]


def test_seeds_are_read_as_hexadecimal_bytes():
    assert _key("3", "x") == [0x03000000, 0, 0, 0]
    assert _key("1023", "x") == [0x10230000, 0, 0, 0]
    assert _key("ff", "x") == [0x00FF0000, 0, 0, 0]  # a leading zero byte, else it were negative
    assert _key("-1", "x") == [0xFF000000, 0, 0, 0]


@pytest.mark.parametrize("seed", ["", "abcx", "0x10", "1 2", "-", "f" * 40])
def test_other_seeds_are_refused(seed):
    with pytest.raises(CityError, match=r"here: random\.seed: expected a hexadecimal number"):
        MersenneTwister(seed, where="here")


def test_numbers_stay_below_their_bound():
    generator = MersenneTwister("3", where="here")
    assert {generator.next_int(4) for _ in range(200)} == {0, 1, 2, 3}
    assert {generator.next_int(100) for _ in range(5000)} == set(range(100))
