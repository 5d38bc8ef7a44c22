"""Keyed draws for many entities at once: the last scrambling of `fireworld.draws.hash_key` as numpy operations."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

import fireworld
from fireworld import draws
from fireworld.city.city import Array, Float64Array

QUANTILES: Final = np.load(Path(fireworld.__file__).parent / "kernels" / "normal_quantiles.npy")
"""(2049,) quantiles of |N(0, 1)| at k/2048."""
INTERVALS: Final = list(zip(QUANTILES[:-1].tolist(), np.diff(QUANTILES).tolist(), strict=True))
FEW: Final = 24
"""Up to so many draws a plain loop is faster than arrays."""


def keys(seed: int, purpose: int, entities: Array, step: int) -> Array:
    """(k,) uint64: the keys of one purpose and step for (k,) entities."""
    begun = draws.mix(draws.mix(draws.mix(seed & draws.MASK) ^ purpose) ^ (step & draws.MASK))
    if len(entities) <= FEW:
        return np.array([draws.mix(begun ^ entity) for entity in entities.tolist()], dtype=np.uint64)
    word = entities.astype(np.uint64) ^ np.uint64(begun)
    word += draws.INCREMENT
    word ^= word >> 30
    word *= draws.MULTIPLIER_1
    word ^= word >> 27
    word *= draws.MULTIPLIER_2
    word ^= word >> 31
    return word


def uniforms(seed: int, purpose: int, entities: Array, step: int) -> Float64Array:
    """(k,) numbers in [0, 1), from the top 53 bits of the keys."""
    return (keys(seed, purpose, entities, step) >> 11) * 2.0**-53


def normals(seed: int, purpose: int, entities: Array, step: int) -> Float64Array:
    """(k,) deviates of N(0, 1): bit 0 is the sign, bits 1 to 11 the interval, the top 52 bits the place within it."""
    found = keys(seed, purpose, entities, step)
    if len(found) <= FEW:
        return np.array([normal_of(key) for key in found.tolist()])
    interval = ((found >> 1) & 2047).astype(np.int64)
    low = QUANTILES[interval]
    size = low + (QUANTILES[interval + 1] - low) * ((found >> 12) * 2.0**-52)
    return np.where(found & 1, -size, size)


def normal_of(key: int) -> float:
    """Turn one key into a deviate of N(0, 1)."""
    low, width = INTERVALS[key >> 1 & 2047]
    size = low + width * ((key >> 12) * 2.0**-52)
    return -size if key & 1 else size
