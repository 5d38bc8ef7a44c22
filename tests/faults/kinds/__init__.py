"""The kinds of faults: a module each, with its NAME, its SHARE of the time, and `run`, which tries one case."""

from __future__ import annotations

import random
from typing import Final, Protocol

from tests.faults.bench import Bench
from tests.faults.kinds import crowds, damage, disks, fuzzed, kills, policies, surroundings
from tests.faults.outcomes import Outcome


class Kind(Protocol):
    """A kind of faults."""

    NAME: str
    SHARE: float

    @staticmethod
    def run(generator: random.Random, bench: Bench) -> Outcome:
        """Try one case, whatever the generator draws; return what came of it."""


KINDS: Final[dict[str, Kind]] = {
    kind.NAME: kind for kind in (kills, damage, fuzzed, policies, disks, crowds, surroundings)
}
