"""Decisions that are given: for loops that others own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fireworld.errors import PolicyError, expected
from fireworld.policy.protocol import Observation, Policy


class Given(Policy):
    """Decides as given, (b,): of each brigade an action or a Decision; None of one that decides nothing."""

    def __init__(self, actions: Sequence[Any]) -> None:
        self._actions = actions

    def decide(self, observation: Observation) -> Any:
        """Return what is given for this brigade."""
        action = self._actions[observation.brigade]
        if action is None:
            where = f"step {observation.step}, brigade {observation.brigade}"
            raise PolicyError(expected("step", where, "an action: this brigade decides", None))
        return action
