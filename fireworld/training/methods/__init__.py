"""How teams learn: one module for each method, which is found by its name.

A module `NAME.py` here has a subclass of `fireworld.training.method.Method`, and as `METHOD` an instance of it with its
default hyperparameters. A method from elsewhere is registered by `METHODS["NAME"] = MyMethod()`.
"""

from __future__ import annotations

import importlib
import pkgutil
from typing import TYPE_CHECKING, Final

from fireworld.errors import TrainingError, expected

if TYPE_CHECKING:
    from fireworld.training.method import Method

ALIASES: Final = {"paper": "sarsa"}
"""Other names of modules: the paper's method is SARSA with its default hyperparameters."""
METHODS: Final[dict[str, Method]] = {}
"""Methods that are registered from elsewhere, by name."""


def method_names() -> list[str]:
    """Return the names of all methods; nothing is imported for it."""
    modules = (module.name for module in pkgutil.iter_modules(__path__))
    return [*ALIASES, *modules, *METHODS]


def find_method(name: str) -> Method:
    """Return a method by its name, with its default hyperparameters.

    Raises:
        TrainingError: no such method.
    """
    if name in METHODS:
        return METHODS[name]
    if name not in method_names():
        raise TrainingError(expected("--method", "", "one of " + ", ".join(method_names()), name))
    method: Method = importlib.import_module(f"{__name__}.{ALIASES.get(name, name)}").METHOD
    return method
