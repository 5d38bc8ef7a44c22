"""Method: how a team learns. The defaults are the paper's; everything else is a declared variant."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import TYPE_CHECKING, Any, Final, Literal

from fireworld.errors import TrainingError, expected
from fireworld.policy.team import COMMIT_MAX

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Rule = Literal["sarsa", "expected-sarsa", "q-learning"]
RULES: Final[tuple[Rule, ...]] = ("sarsa", "expected-sarsa", "q-learning")
CHOSEN: Final[Mapping[str, tuple[str, ...]]] = {
    "rule": RULES,
    "reward": ("stock", "change"),
    "choices": ("in-turn", "simultaneous"),
}
"""Figures that are one of a few words."""
N_EPISODES_MAX: Final = 1_000_000


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
        for name, most in (
            ("n_episodes_max", N_EPISODES_MAX),
            ("n_episodes_unchanged", N_EPISODES_MAX),
            ("commit", COMMIT_MAX),
        ):
            if not 1 <= getattr(self, name) <= most:
                wanted = f"a whole number from 1 to {most}"
                raise TrainingError(expected("method", name, wanted, getattr(self, name)))
        for name, words in CHOSEN.items():
            if getattr(self, name) not in words:
                raise TrainingError(expected("method", name, "one of " + ", ".join(words), getattr(self, name)))

    def as_dict(self) -> dict[str, Any]:
        """Return all figures by name."""
        return asdict(self)

    def with_settings(self, settings: Mapping[str, str]) -> Method:
        """Return the method with other figures.

        Args:
            settings: figures as text by name, as in {"alpha": "0.1", "shared_table": "true"}.

        Raises:
            TrainingError: no such figure, or not a value it can have.
        """
        return replace(self, **read_figures(settings, self))


PAPER: Final = Method()
METHODS: Final = {"paper": PAPER}
"""Methods by name."""
SEARCH: Final = "search"
"""The name of the other way to train: `fireworld.training.search`."""


def method_keys() -> list[str]:
    """Name the figures of a method."""
    return [item.name for item in fields(Method)]


def find_method(name: str) -> Method:
    """Return a method by name.

    Raises:
        TrainingError: no such method.
    """
    if name not in METHODS:
        raise TrainingError(expected("--method", "", "one of " + ", ".join((*METHODS, SEARCH)), name))
    return METHODS[name]


def read_figures(settings: Mapping[str, str], figures: DataclassInstance) -> dict[str, Any]:
    """Read figures that a user sets, each of the kind that it is of by now.

    Args:
        settings: figures as text by name.
        figures: what they belong to.

    Raises:
        TrainingError: no such figure, or not a value it can have.
    """
    names = [item.name for item in fields(figures)]
    for key in settings:
        if key not in names:
            raise TrainingError(expected("--set", key, "one of " + ", ".join(names), key))
    return {key: _read(key, text, getattr(figures, key)) for key, text in settings.items()}


def _read(key: str, text: str, default: object) -> object:
    """Read a figure of the kind that its default is of."""
    if isinstance(default, str):
        return text
    if isinstance(default, bool):
        if text not in {"true", "false"}:
            raise TrainingError(expected("--set", key, "true or false", text))
        return text == "true"
    try:
        return type(default)(text)  # type: ignore[call-arg]  # a number of one kind or the other
    except ValueError:
        wanted = "a whole number" if isinstance(default, int) else "a number"
        raise TrainingError(expected("--set", key, wanted, text)) from None
