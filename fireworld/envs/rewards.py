"""What learners are rewarded with: the change of the score, a scenario's terms, or what a function makes of a step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from fireworld.arguments import ArgumentError
from fireworld.errors import expected, nearest
from fireworld.kernels.arrays import TOTAL, Array
from fireworld.kernels.batch import Result
from fireworld.rewards import KINDS, share_gained
from fireworld.scenario import Scenario
from fireworld.scenario.document import with_kind

SCORE: Final = "score"


@dataclass(frozen=True)
class Rewards:
    """A reward: "score", "stock", "change", or a function.

    A function is called with `result` and `before`, copies that it may keep, and returns (n,) numbers:
    `result.score` (n, 3), `result.counts` (n, 4) and `result.reward` (n, 6) of the step just done, as
    `fireworld.kernels.arrays` has them, and `before` (n,), score / maximal score before it. What it returns for worlds
    that ran no step is not used.
    """

    kind: str | Callable[..., Any]

    def scenario(self, scenario: Scenario) -> Scenario:
        """Return a scenario with this reward, so that a recording has it too."""
        return with_kind(scenario, self.kind) if self.kind in KINDS else scenario

    def of(self, result: Result, before: Array) -> Array:
        """Return the rewards of a step, (n,) float64; `before` (n,): score / maximal score before it.

        Raises:
            ArgumentError: a function that returns anything else.
        """
        if callable(self.kind):
            given = Result(*(array.copy() for array in result))
            found = np.asarray(self.kind(given, before.copy()))
            if found.shape != before.shape or found.dtype.kind not in "fiu":
                got = f"{found.dtype} {found.shape}"
                raise ArgumentError(expected("reward", "", f"{before.shape} numbers", got))
            return found.astype(np.float64)
        if self.kind == SCORE:
            return share_gained(result.score[:, 0], result.score[:, 1], before)
        return result.reward[:, TOTAL].copy()


def score_share(result: Result) -> Array:
    """Return score / maximal score, (n,)."""
    share: Array = result.score[:, 0] / result.score[:, 1]
    return share


def reward_of(value: object) -> Rewards:
    """Return a reward by its name, or of a function.

    Raises:
        ArgumentError: there is none of that name.
    """
    names = (SCORE, *KINDS)
    if callable(value) or (isinstance(value, str) and value in names):
        return Rewards(value)
    hint = nearest(value, names) if isinstance(value, str) else ""
    raise ArgumentError(expected("reward", "", f"one of {', '.join(names)}, or a function", value, hint))
