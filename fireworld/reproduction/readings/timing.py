"""How long the trials of a study took, and how long they would take on more workers."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

MANY: Final = 64
"""Workers for which the time is predicted."""


@dataclass
class Timing:
    """Times of trials.

    Attributes:
        n_workers: trials at a time.
        parts: seconds of each trial, in the parts of the study, which wait for one another.
        computing: likewise, the seconds in which it had a core.
        elapsed: seconds that all parts took.
    """

    n_workers: int = 1
    parts: list[list[float]] = field(default_factory=list)
    computing: list[list[float]] = field(default_factory=list)
    elapsed: float = 0.0

    def add(self, seconds: Iterable[float], computing: Iterable[float], elapsed: float) -> None:
        """Note a part of the study."""
        self.parts.append([*seconds])
        self.computing.append([*computing])
        self.elapsed += elapsed

    @property
    def total(self) -> float:
        """Seconds of all trials."""
        return math.fsum(one for part in self.parts for one in part)

    def predicted(self, n_workers: int) -> float:
        """Return the seconds on so many workers that have a core each: in each part the longest trial first."""
        return math.fsum(longest_first(part, n_workers) for part in self.computing)

    @property
    def text(self) -> str:
        """All of this in a line; empty where nothing was tried."""
        if not self.total:
            return ""
        share, n = self.total / self.n_workers, sum(map(len, self.parts))
        computing = math.fsum(one for part in self.computing for one in part)
        return (
            f"{n} trials took {self.total:.0f} s added up ({computing:.0f} s of computing), {share:.0f} s for each of "
            f"{self.n_workers} workers; all of it took {self.elapsed:.0f} s, {self.elapsed / share:.2f} times as long. "
            f"On {MANY} workers with a core each it would take {self.predicted(MANY):.0f} s: predicted from the "
            "computing of each trial, the longest first."
        )


def longest_first(seconds: Iterable[float], n_workers: int) -> float:
    """Return when the last of some tasks is done, each given to the worker that is free first, the longest first."""
    free = [0.0] * n_workers
    for one in sorted(seconds, reverse=True):
        heapq.heapreplace(free, free[0] + one)
    return max(free)
