"""Keyed random draws in plain Python: a pure function of (seed, purpose, entity, step).

Nothing here depends on the order in which things are drawn: a building added far away changes no other building's
draws, and two policies on one seed see the same random draws (common random numbers). `fireworld.kernels.draws` is
the compiled twin and gives the same numbers; this one serves code that must not import numba.
"""

from __future__ import annotations

from typing import Final

BURN_RATE: Final = 1
"""Purpose: how fast a building burns in a step. Entity: building."""
DAMAGE: Final = 2
"""Purpose: whether fire hurts a person in a step. Entity: person."""
DAMAGE_NOISE: Final = 3
"""Purpose: the noise of a hurt person's damage. Entity: person."""
EXPLORE: Final = 4
"""Purpose: whether a brigade explores in a step. Entity: brigade."""
ACTION: Final = 5
"""Purpose: which action a brigade takes at random. Entity: brigade."""
RAY: Final = 6
"""Purpose: where a radiation ray starts and leads. Entity: ray."""
CITY: Final = 7
"""Purpose: the making of a city. Entity: lot; step: which property of it."""
PLACEMENT: Final = 8
"""Purpose: where civilians, brigades and fires are placed. Entity: what is placed."""
STEP: Final = 9
"""Purpose: the key that names all the draws of a step. Entity: 0."""
TABLE: Final = 10
"""Purpose: which brigade's table is taken over between scenarios. Entity: scenario."""
EPISODE: Final = 11
"""Purpose: the seed of an episode of training. Entity: scenario; step: episode or generation."""
FIRE: Final = 12
"""Purpose: which fires a generation of a search meets. Entity: scenario; step: generation."""
WEIGHT: Final = 13
"""Purpose: the noise of a candidate's weights. Entity: candidate and weight; step: generation."""
BEGINNING: Final = 14
"""Purpose: the first weights of a network that evolves. Entity: weight."""
CHECK: Final = 15
"""Purpose: the seed of a fight by which it is decided which team of a training is kept. Entity: scenario."""
MOMENT: Final = 16
"""Purpose: whether options are tried out in a step of a training. Entity: 0."""
OPTION: Final = 17
"""Purpose: whose options are tried out in a step, and which. Entity: brigade, or brigades + building."""
ROLLOUT: Final = 18
"""Purpose: the seeds by which options are tried out in a step. Entity: rollout."""
SHUFFLE: Final = 19
"""Purpose: the order in which a network learns from decisions. Entity: decision; step: epoch of all."""

MASK: Final = (1 << 64) - 1
INCREMENT: Final = 0x9E3779B97F4A7C15
MULTIPLIER_1: Final = 0xBF58476D1CE4E5B9
MULTIPLIER_2: Final = 0x94D049BB133111EB


def mix(word: int) -> int:
    """Scramble 64 bits one to one: the finaliser of SplitMix64 after its increment."""
    word = (word + INCREMENT) & MASK
    word = ((word ^ (word >> 30)) * MULTIPLIER_1) & MASK
    word = ((word ^ (word >> 27)) * MULTIPLIER_2) & MASK
    return word ^ (word >> 31)


def hash_key(seed: int, purpose: int, entity: int, step: int) -> int:
    """Return the 64-bit key of one draw.

    Negative numbers count as their 64-bit two's complement.
    """
    word = mix(seed & MASK)
    word = mix(word ^ (purpose & MASK))
    word = mix(word ^ (step & MASK))
    return mix(word ^ (entity & MASK))


def uniform(seed: int, purpose: int, entity: int, step: int) -> float:
    """Draw a number in [0, 1) from the top 53 bits of the key."""
    return (hash_key(seed, purpose, entity, step) >> 11) * 2.0**-53


def below(seed: int, purpose: int, entity: int, step: int, *, bound: int) -> int:
    """Draw a whole number in [0, bound) from the top 32 bits of the key; 1 <= bound <= 2**31."""
    return ((hash_key(seed, purpose, entity, step) >> 32) * bound) >> 32
