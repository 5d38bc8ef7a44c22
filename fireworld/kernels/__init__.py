"""Compiled kernels: plain functions of arrays, and the folder where their machine code is kept."""

from __future__ import annotations

import numba

from fireworld.kernels import cache

numba.config.SLP_VECTORIZE = 1  # turns four sums side by side into vector instructions; never reorders arithmetic


def is_cold() -> bool:
    """Return whether nothing is compiled yet, so that the first call will take a while."""
    return cache.STORE.is_empty()
