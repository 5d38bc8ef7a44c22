"""Method: how a team learns. The defaults are the paper's; everything else is a declared variant."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from typing import Any, Final, Literal

from fireworld.errors import TrainingError, expected

Rule = Literal["sarsa", "expected-sarsa", "q-learning"]
RULES: Final[tuple[Rule, ...]] = ("sarsa", "expected-sarsa", "q-learning")


@dataclass(frozen=True, kw_only=True)
class Method:
    """How a team learns."""

    rule: Rule = "sarsa"
    alpha: float = 0.7
    """Learning rate."""
    alpha_decay: float = 0.0
    """The n-th visit of a state and action learns at alpha / (1 + alpha_decay * (n - 1))."""
    gamma: float = 0.5
    """Discount of the next step."""
    epsilon_decay: float = 0.9
    """Episode k of a scenario explores with probability epsilon_decay ** k, k from 0."""
    n_episodes_max: int = 130
    """Episodes of a scenario at most."""
    n_episodes_unchanged: int = 20
    """A scenario ends when no greedy action has changed for so many episodes."""
    shared_table: bool = False
    """All brigades learn into one table."""
    fixed_noise: bool = False
    """Every episode of a scenario meets the same luck."""
    reward: Literal["stock", "change"] = "stock"
    """The state's cost at every step, as in the paper; or how it changed."""
    choices: Literal["in-turn", "simultaneous"] = "in-turn"
    """Whether brigades see what those before them chose in this step."""
    commit: int = 1
    """Steps that a choice is kept for."""

    def __post_init__(self) -> None:
        """Refuse figures that make no method."""
        for name in ("alpha", "gamma", "epsilon_decay"):
            value = getattr(self, name)
            if not (math.isfinite(value) and 0.0 <= value <= 1.0):
                raise TrainingError(expected("method", name, "a number from 0 to 1", value))
        if not (math.isfinite(self.alpha_decay) and self.alpha_decay >= 0.0):
            raise TrainingError(expected("method", "alpha_decay", "a number >= 0", self.alpha_decay))
        for name in ("n_episodes_max", "n_episodes_unchanged", "commit"):
            if getattr(self, name) < 1:
                raise TrainingError(expected("method", name, "a whole number >= 1", getattr(self, name)))
        if self.rule not in RULES:
            raise TrainingError(expected("method", "rule", "one of " + ", ".join(RULES), self.rule))

    def as_dict(self) -> dict[str, Any]:
        """Return all figures by name."""
        return asdict(self)


PAPER: Final = Method()
METHODS: Final = {"paper": PAPER}
"""Methods by name."""


def method_keys() -> list[str]:
    """Name the figures of a method."""
    return [item.name for item in fields(Method)]
