"""What the brigades saw and decided in a step, and why, whether policies were asked or kernels followed them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Final, NamedTuple, Self

import numpy as np

from fireworld.kernels.arrays import Array, BrigadeState, PolicyArrays, Seen
from fireworld.policy.kernel import noted_decisions
from fireworld.policy.protocol import Decision

NO_VALUES: Final = np.zeros(0)
NO_ACTION_VALUES: Final = (0.0, 0.0, 0.0, 0.0)


class Reasons(NamedTuple):
    """Why the brigades chose what they did, as `fireworld.records.Decisions` has it; b brigades."""

    explored: Array  # (b,) uint8
    q_values: Array  # (4 b,) float64, or none if nobody has any
    epsilon: float
    target_value: Array  # (b,) float64, or none if nobody has any


class Made(NamedTuple):
    """What the decisions of a step change, copied before them; b brigades."""

    action: Array  # (b,) int32
    target: Array  # (b,) int32
    site: Array  # (b,) int32

    @classmethod
    def of(cls, brigades: BrigadeState) -> Self:
        """Copy it."""
        return cls(*(getattr(brigades, name).copy() for name in cls._fields))

    def put_back(self, brigades: BrigadeState) -> None:
        """Let the brigades have decided nothing since."""
        for name, array in self._asdict().items():
            getattr(brigades, name)[:] = array


class Choices:
    """What the brigades saw and decided in a step."""

    def __init__(self, features: Array, state_index: Array, site: Array, decisions: Sequence[Decision] = ()) -> None:
        self.features = features
        """(b, 8) int64."""
        self.state_index = state_index
        """(b,) int64, -1 none."""
        self.site = site
        """(b,) int32, the number of the fire site that each belonged to before it decided, 0 none."""
        self._decisions = tuple(decisions)

    @property
    def decisions(self) -> tuple[Decision, ...]:
        """What each brigade decided, (b,)."""
        return self._decisions

    @property
    def reasons(self) -> Reasons:
        """Why."""
        decisions = self._decisions
        known = any(decision.q_values is not None for decision in decisions)
        ranked = any(decision.value is not None for decision in decisions)
        values = [decision.q_values or NO_ACTION_VALUES for decision in decisions] if known else []
        targets = [decision.value or 0.0 for decision in decisions] if ranked else []
        return Reasons(
            explored=np.array([decision.explored for decision in decisions], dtype=np.uint8),
            q_values=np.array(values, dtype=np.float64).ravel(),
            epsilon=max((float(decision.epsilon) for decision in decisions), default=0.0),
            target_value=np.array(targets, dtype=np.float64),
        )


class NotedChoices(Choices):
    """The same of a step that a kernel ran: decisions are made of what it noted if somebody asks.

    Args:
        policy: the policy's arrays.
        seen: what the kernel noted, copied.
        action: (b,), what the brigades do.
        target: (b,), what they go for.
        last_target: (b,), what they went for in the step before.
    """

    def __init__(self, policy: PolicyArrays, seen: Seen, action: Array, target: Array, last_target: Array) -> None:
        self.features, self.state_index, self.site = seen.features, seen.state, seen.site
        self._policy, self._seen, self._made = policy, seen, (action, target, last_target)

    @cached_property
    def decisions(self) -> tuple[Decision, ...]:
        """What each brigade decided, (b,)."""
        return noted_decisions(self._policy, self._seen, *self._made)

    @property
    def reasons(self) -> Reasons:
        """Why."""
        seen = self._seen
        by_table, by_rank = seen.valued.tolist()
        return Reasons(
            explored=seen.explored,
            q_values=seen.action_values.ravel() if by_table or by_rank else NO_VALUES,
            epsilon=float(self._policy.epsilon[0]) if by_table else 0.0,
            target_value=seen.target_value if by_rank else NO_VALUES,
        )
