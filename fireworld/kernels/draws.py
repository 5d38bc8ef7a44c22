"""Keyed draws in compiled code: the twin of `fireworld.draws`, with normal deviates.

The normal deviate comes from a table of quantiles with linear interpolation: exact on every processor, because it
needs no logarithm, and far cheaper than the usual transforms. `tests/city/test_draws.py` makes the table.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from fireworld import draws
from fireworld.kernels.arrays import Array
from fireworld.kernels.jit import inner, kernel

_INCREMENT: Final = np.uint64(draws.INCREMENT)
_MULTIPLIER_1: Final = np.uint64(draws.MULTIPLIER_1)
_MULTIPLIER_2: Final = np.uint64(draws.MULTIPLIER_2)
# numba turns uint64 mixed with a signed integer into a float: every constant beside a key is a uint64.
_11, _12, _27, _30, _31, _32 = (np.uint64(n) for n in (11, 12, 27, 30, 31, 32))
_ONE: Final = np.uint64(1)
_INDEX_MASK: Final = np.uint64(2047)
_UNIT: Final = 2.0**-53

NORMAL_QUANTILES: Final = np.load(Path(__file__).with_name("normal_quantiles.npy"))
"""(2049,) float64: quantiles of |N(0, 1)| at k/2048. The last one, infinite in truth, makes the variance 1."""
NORMAL_QUANTILES.setflags(write=False)


@inner
def mix(word: np.uint64) -> np.uint64:
    """Scramble 64 bits one to one: the finaliser of SplitMix64 after its increment."""
    word = word + _INCREMENT
    word = (word ^ (word >> _30)) * _MULTIPLIER_1
    word = (word ^ (word >> _27)) * _MULTIPLIER_2
    return word ^ (word >> _31)


@inner
def hash_key(seed: int, purpose: int, entity: int, step: int) -> np.uint64:
    """Return the 64-bit key of one draw for a purpose, one of the constants of `fireworld.draws`.

    The entity comes last, so that the compiler lifts the rest of the chain out of a loop over entities.
    """
    word = mix(np.uint64(seed))
    word = mix(word ^ np.uint64(purpose))
    word = mix(word ^ np.uint64(step))
    return mix(word ^ np.uint64(entity))


@inner
def uniform_of(key: np.uint64) -> float:
    """Turn a key into a number in [0, 1), from its top 53 bits."""
    return np.float64(key >> _11) * _UNIT


@inner
def normal_of(key: np.uint64) -> float:
    """Turn a key into a deviate of N(0, 1).

    Bit 0 is the sign, bits 1 to 11 choose an interval of the table, the top 52 bits the place within it.
    """
    index = np.int64((key >> _ONE) & _INDEX_MASK)
    low = NORMAL_QUANTILES[index]
    deviate = low + (NORMAL_QUANTILES[index + 1] - low) * (np.float64(key >> _12) * (2.0 * _UNIT))
    return deviate * (1.0 - np.float64(key & _ONE) * 2.0)  # a branch would be mispredicted every other time


@inner
def uniform(seed: int, purpose: int, entity: int, step: int) -> float:
    """Draw a number in [0, 1)."""
    return uniform_of(hash_key(seed, purpose, entity, step))


@inner
def normal(seed: int, purpose: int, entity: int, step: int) -> float:
    """Draw a deviate of N(0, 1)."""
    return normal_of(hash_key(seed, purpose, entity, step))


@inner
def below(seed: int, purpose: int, entity: int, step: int, bound: int) -> np.int64:
    """Draw a whole number in [0, bound) from the top 32 bits of the key; 1 <= bound <= 2**31."""
    return np.int64(((hash_key(seed, purpose, entity, step) >> _32) * np.uint64(bound)) >> _32)


@kernel
def fill_normals(seed: int, purpose: int, step: int, out: Array) -> None:
    """Fill a float64 matrix with deviates of N(0, 1); the entity of each is its place, row after row."""
    rows, columns = out.shape
    for row in range(rows):
        for column in range(columns):
            out[row, column] = normal(seed, purpose, row * columns + column, step)
