"""Keyed random draws for many entities at once: the numbers of `fireworld.draws`, as numpy operations."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fireworld import draws
from fireworld.city.city import Array, Float64Array, Int64Array

UInt64Array = NDArray[np.uint64]


def hash_keys(seed: int, purpose: int, entities: Array, step: int) -> UInt64Array:
    """Return the 64-bit keys, (k,), of one draw for each of (k,) entities."""
    word = draws.mix(draws.mix(draws.mix(seed & draws.MASK) ^ purpose) ^ (step & draws.MASK))
    keys: UInt64Array = entities.astype(np.uint64) ^ np.uint64(word)
    keys += np.uint64(draws.INCREMENT)
    for shift, multiplier in ((30, draws.MULTIPLIER_1), (27, draws.MULTIPLIER_2)):
        keys = (keys ^ (keys >> np.uint64(shift))) * np.uint64(multiplier)
    return keys ^ (keys >> np.uint64(31))


def uniforms(seed: int, purpose: int, entities: Array, step: int) -> Float64Array:
    """Draw numbers in [0, 1), (k,), from the top 53 bits of the keys."""
    return (hash_keys(seed, purpose, entities, step) >> np.uint64(11)).astype(np.float64) * 2.0**-53


def below(seed: int, purpose: int, entities: Array, step: int, *, bound: Any) -> Int64Array:
    """Draw whole numbers in [0, bound), (k,); `bound` is one number or (k,) of them, 1 <= bound <= 2**31."""
    keys = hash_keys(seed, purpose, entities, step)
    drawn = (keys >> np.uint64(32)) * np.asarray(bound).astype(np.uint64) >> np.uint64(32)
    return drawn.astype(np.int64)
