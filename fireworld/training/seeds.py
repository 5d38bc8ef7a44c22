"""Seeds of worlds: one for each episode of each worker, no two the same, and none of a test in a training."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from fireworld.arguments import seed_of, whole_number
from fireworld.draws import CHECK, EPISODE, hash_key

WORKERS_MAX: Final = 1 << 11
EPISODES_MAX: Final = 1 << 20
TEST_BIT: Final = 1 << 31
_HALF_BITS: Final = 16
_HALF: Final = (1 << _HALF_BITS) - 1
_ROUNDS: Final = 4


def episode_seed(base: int, scenario_number: int, episode: int) -> int:
    """Return the seed of an episode of a training of fireworld's own, 0 to 2**63 - 1.

    Args:
        base: the training's own seed.
        scenario_number: its scenario's, counted through the curriculum from 0.
        episode: its number in the scenario, from 0.
    """
    return hash_key(base, EPISODE, scenario_number, episode) >> 1


def fight_seed(base: int, number: int, round_number: int) -> int:
    """Return the seed of a fight of a training that learns from many, 0 to 2**32 - 1.

    Args:
        base: the training's own seed.
        number: of the fire, or of the lesson.
        round_number: of the generation, or of the fight in its lesson.
    """
    return hash_key(base, EPISODE, number, round_number) >> 32


def check_seed(base: int, number: int) -> int:
    """Return the seed of a fight by which a training decides what to keep, 0 to 2**32 - 1; arguments as above."""
    return hash_key(base, CHECK, number, 0) >> 32


@dataclass(frozen=True)
class Seeds:
    """The seeds that follow from one base.

    Attributes:
        base: of all of them, from 0 to 2**32 - 1.
        test: seeds to test with: they have the highest of 32 bits, which no seed to learn with has.

    Two episodes of one base never have the same seed, whoever plays them: number and worker are shuffled one to one.
    """

    base: int = 0
    test: bool = False

    def __post_init__(self) -> None:
        """Raise ArgumentError for a base out of bounds."""
        object.__setattr__(self, "base", seed_of(self.base, name="base"))  # a plain number, as snapshots keep it

    def seed(self, worker: int, episode: int) -> int:
        """Return the seed of an episode.

        Args:
            worker: who plays it, as 0 up to the number of worlds; below 2048.
            episode: its number among those of the worker; below 2**20.

        Raises:
            ArgumentError: a number out of bounds.
        """
        worker = whole_number("worker", worker, least=0, most=WORKERS_MAX - 1)
        episode = whole_number("episode", episode, least=0, most=EPISODES_MAX - 1)
        word = self._shuffled(episode * WORKERS_MAX + worker)
        while word >= TEST_BIT:  # of the 32 bits that are shuffled, one is not for numbers
            word = self._shuffled(word)
        return word | (TEST_BIT if self.test else 0)

    def _shuffled(self, word: int) -> int:
        """Return another number of 32 bits for each: a Feistel network."""
        left, right = word >> _HALF_BITS, word & _HALF
        for number in range(_ROUNDS):
            left, right = right, left ^ (hash_key(self.base, EPISODE, right, number) & _HALF)
        return left << _HALF_BITS | right
