"""Learning in plain Python: what docs/training.md says of a method, for a table of each brigade."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fireworld.city.city import Array, Float64Array


@dataclass
class Choice:
    """A choice that a brigade waits for the consequences of."""

    state: int
    action: int
    reward: float = 0.0
    discount: float = 1.0


@dataclass
class Learner:
    """Tables that learn; brigade b has table b modulo their number."""

    tables: Float64Array  # (tables, 4320 or 270, 4)
    rule: str
    alpha: float
    alpha_decay: float
    gamma: float
    epsilon: float
    waiting: dict[int, Choice] = field(default_factory=dict)
    visits: Array = field(init=False)

    def __post_init__(self) -> None:
        """Begin without a visit."""
        self.visits = np.zeros(self.tables.shape, dtype=np.int64)

    def hear(self, who: int, state: int, action: int, *, bound: bool) -> None:
        """Learn from a brigade's last choice, now that it chooses an action in a state or is bound to its last."""
        row = state if self.tables.shape[1] == 4320 else state // 16
        values = self.tables[who % len(self.tables), row]
        if bound or self.rule == "sarsa":
            worth = values[action]
        elif self.rule == "q-learning":
            worth = values.max()
        else:
            worth = (1.0 - self.epsilon) * values.max() + self.epsilon * sum(values) / 4
        self.learn(who, worth)
        if not bound:
            self.waiting[who] = Choice(row, action)

    def take(self, reward: float) -> None:
        """Note the reward of a step for all that wait."""
        for choice in self.waiting.values():
            choice.reward += choice.discount * reward
            choice.discount *= self.gamma

    def end(self) -> None:
        """Learn from everybody's last choice, after which nothing comes."""
        for who in sorted(self.waiting):
            self.learn(who, 0.0)

    def learn(self, who: int, worth: float) -> None:
        """Move the value of a brigade's last choice towards what came of it and what comes next."""
        if who not in self.waiting:
            return
        choice = self.waiting[who]
        place = who % len(self.tables), choice.state, choice.action
        rate = self.alpha / (1.0 + self.alpha_decay * self.visits[place])
        self.tables[place] += rate * (choice.reward + choice.discount * worth - self.tables[place])
        self.visits[place] += 1
