"""The names that Gymnasium knows environments by, registered as soon as there is a Gymnasium to register them with."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Mapping, Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Final

GYMNASIUM: Final = "gymnasium"
NAMES: Final[Mapping[str, Mapping[str, str]]] = {
    "fireworld/Team-v0": {
        "entry_point": "fireworld.envs.team_env:WholeTeamEnv",
        "vector_entry_point": "fireworld.envs.vector_env:TeamVectorEnv",
    },
    "fireworld/Brigade-v0": {"entry_point": "fireworld.envs.brigade_env:BrigadeEnv"},
}
"""What makes each of them."""


def register() -> None:
    """Register all names that are not yet known; Gymnasium is imported for that."""
    import gymnasium

    for name, points in NAMES.items():
        if name not in gymnasium.registry:
            gymnasium.register(name, **points)  # type: ignore[arg-type]  # they are as many as there may be


def register_with_gymnasium() -> None:
    """Register all names now if Gymnasium is imported, else as soon as somebody imports it: that takes a while."""
    if GYMNASIUM in sys.modules:
        register()
    elif not any(isinstance(finder, _AfterGymnasium) for finder in sys.meta_path):
        sys.meta_path.insert(0, _AfterGymnasium())


class _AfterGymnasium(MetaPathFinder):
    """Finds nothing itself: lets Gymnasium be found as ever, and names be registered once it has been run."""

    def __init__(self) -> None:
        self._looking = False

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return where Gymnasium is found, None of all else; many only ask, and import nothing."""
        del path, target
        if fullname != GYMNASIUM or self._looking:
            return None
        self._looking = True
        try:
            spec = importlib.util.find_spec(GYMNASIUM)
        finally:
            self._looking = False
        if spec is not None and spec.loader is not None:
            run = spec.loader.exec_module

            def run_and_register(module: ModuleType) -> None:
                run(module)
                sys.meta_path.remove(self)
                register()

            spec.loader.exec_module = run_and_register  # type: ignore[method-assign]  # of this one import
        return spec
