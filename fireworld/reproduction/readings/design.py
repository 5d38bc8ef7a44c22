"""Which readings are tried: a two-level fractional factorial of resolution IV, with its mirror image (foldover).

A full factorial of 32 runs in 5 basic columns has 16 products of an odd number of them, each a column of its own. Any
three of these multiply to another odd product, never to 1: no main effect is mixed up with an interaction of two. A
design of 32 runs has room for 16 choices; of 64, in 6 basic columns, for 32. It is its own foldover: the mirror of each
reading, with all levels exchanged, is in it too.

What a choice has of further levels is tried beside the design, each in a reading that is ours in everything else.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Final

import numpy as np

from fireworld.kernels.arrays import Array
from fireworld.reproduction.readings.choices import OpenChoice, Reading, read_as

N_BASIC: Final = {"screen": 6, "full": 7, "quick": 3}
"""Basic columns: 64 readings, or 128; and 8, of as many choices as there is room for, to see how it looks."""


def generators(n_choices: int, n_basic: int) -> list[tuple[int, ...]]:
    """Return the basic columns whose product is each choice's column: odd numbers of them, the shortest first."""
    odd = [columns for size in range(1, n_basic + 1, 2) for columns in combinations(range(n_basic), size)]
    return odd[:n_choices]


def design(n_choices: int, n_basic: int) -> Array:
    """Return the levels, -1 ours and 1 the other, as (2 ** n_basic, up to n_choices) int64."""
    runs = np.arange(2**n_basic)
    basic = np.array([1 - 2 * (runs >> column & 1) for column in range(n_basic)])
    signs = [-basic[list(columns)].prod(axis=0) for columns in generators(n_choices, n_basic)]
    return np.array(signs, dtype=np.int64).T


def further(choices: Sequence[OpenChoice]) -> list[Reading]:
    """Return the readings of the levels that no design varies, one for each: all else is read as ours."""
    return [
        read_as(choices, {choice.name: level})
        for choice in choices
        if choice.screen
        for level in choice.levels
        if level not in choice.screen
    ]


def designed(choices: Sequence[OpenChoice], *, kind: str) -> tuple[list[OpenChoice], Array, list[Reading]]:
    """Return the choices that a design varies, its levels (readings, choices), and the readings.

    Args:
        choices: all of them.
        kind: of N_BASIC; "quick" has room for the first four.
    """
    varied = [choice for choice in choices if choice.screen]
    signs_of = design(len(varied), N_BASIC[kind])
    varied = varied[: signs_of.shape[1]]
    readings = [
        read_as(choices, {choice.name: choice.screen[int(sign > 0)] for choice, sign in zip(varied, row, strict=True)})
        for row in signs_of
    ]
    return varied, signs_of, readings
