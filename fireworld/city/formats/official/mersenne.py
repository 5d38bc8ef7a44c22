"""The Mersenne Twister of the official program, seeded from the text of `random.seed`."""

from __future__ import annotations

import random
from typing import Final

from fireworld.errors import CityError, expected

N_WORDS: Final = 624
MASK: Final = 0xFFFFFFFF
SEED_BYTES: Final = 16
BITS: Final = 31
"""Of a draw from which `next_int` makes a number."""


class MersenneTwister:
    """MT19937, its state filled by `init_by_array`; numbers below n are drawn as java.util.Random does.

    Args:
        seed: the text of `random.seed`.
        where: the file and key that errors name.
    """

    def __init__(self, seed: str, *, where: str) -> None:
        key = _key(seed, where)
        self._generator = random.Random()  # noqa: S311 - Python's own generator is the same one; only the seed differs
        self._generator.setstate((3, (*_init_by_array(key), N_WORDS), None))

    def next_int(self, bound: int) -> int:
        """Draw a whole number from 0 to bound - 1."""
        if bound & (bound - 1) == 0:  # a power of two: the high bits
            return (bound * self._generator.getrandbits(BITS)) >> BITS
        while True:
            bits = self._generator.getrandbits(BITS)
            value = bits % bound
            if bits - value + bound - 1 < 1 << BITS:  # else the last, incomplete round of numbers
                return value


def _key(seed: str, where: str) -> list[int]:
    """Return four words: the digits read as a hexadecimal number, its shortest two's complement, then zeros."""
    wanted = f"a hexadecimal number of at most {SEED_BYTES} bytes"
    digits = seed.removeprefix("-")
    if not digits or any(digit not in "0123456789abcdefABCDEF" for digit in digits):
        raise CityError(expected(where, "random.seed", wanted, seed or "no value"))
    number = int(seed, 16)
    magnitude = number if number >= 0 else -number - 1
    n_bytes = magnitude.bit_length() // 8 + 1
    if n_bytes > SEED_BYTES:
        raise CityError(expected(where, "random.seed", wanted, seed))
    content = number.to_bytes(n_bytes, "big", signed=True).ljust(SEED_BYTES, b"\0")
    return [int.from_bytes(content[at : at + 4], "big") for at in range(0, SEED_BYTES, 4)]


def _init_by_array(key: list[int]) -> list[int]:
    """Fill the state from a key, as the authors of the generator define it."""
    state = [19_650_218]
    for index in range(1, N_WORDS):
        state.append((1_812_433_253 * (state[-1] ^ (state[-1] >> 30)) + index) & MASK)
    at = 1
    for turn in range(N_WORDS):
        mixed = state[at] ^ ((state[at - 1] ^ (state[at - 1] >> 30)) * 1_664_525)
        state[at] = (mixed + key[turn % len(key)] + turn % len(key)) & MASK
        at = _after(state, at)
    for _ in range(N_WORDS - 1):
        mixed = state[at] ^ ((state[at - 1] ^ (state[at - 1] >> 30)) * 1_566_083_941)
        state[at] = (mixed - at) & MASK
        at = _after(state, at)
    state[0] = 1 << 31
    return state


def _after(state: list[int], at: int) -> int:
    """Return the word after one; behind the last comes the second, and the first becomes the last."""
    if at + 1 < N_WORDS:
        return at + 1
    state[0] = state[-1]
    return 1
