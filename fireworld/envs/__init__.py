"""Environments for learners: many worlds at once, and the forms that Gymnasium and PettingZoo take.

    from fireworld import envs

    worlds = envs.worlds("test-1", 64)                # numpy alone
    env = envs.team("test-1")                         # PettingZoo, all at once
    env = envs.turns("test-1")                        # PettingZoo, one after another
    env = envs.brigade("test-1", others="best")       # Gymnasium, one brigade
    vector = gymnasium.make_vec("fireworld/Team-v0", num_envs=64)

Everything but `worlds` needs `pip install 'fireworld[gym]'`. Names are imported when they are first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fireworld.envs.worlds import Autoreset as Autoreset
    from fireworld.envs.worlds import Worlds as Worlds
    from fireworld.envs.worlds import worlds as worlds
    from fireworld.training.seeds import Seeds as Seeds

_ROOMS = {"Autoreset": "worlds", "Seeds": "worlds", "Worlds": "worlds", "worlds": "worlds"}

__all__ = [*sorted(_ROOMS)]  # noqa: PLE0604 - the names are those of the table


if not TYPE_CHECKING:

    def __getattr__(name: str) -> Any:
        """Import a name from the module it lives in, at its first use."""
        if name not in _ROOMS:
            raise AttributeError(f"module 'fireworld.envs' has no attribute {name!r}; there are {', '.join(__all__)}")
        from importlib import import_module

        found = getattr(import_module(f"fireworld.envs.{_ROOMS[name]}"), name)
        globals()[name] = found
        return found


def __dir__() -> list[str]:
    return [*__all__]
