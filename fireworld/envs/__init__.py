"""Environments for learners: many worlds at once, and the forms that Gymnasium and PettingZoo take.

    from fireworld import envs

    worlds = envs.worlds("test-1", 64)                # numpy alone
    env = envs.team("test-1")                         # PettingZoo, all at once
    env = envs.turns("test-1")                        # PettingZoo, one after another
    env = envs.brigade("test-1", others="best")       # Gymnasium, one brigade
    vector = gymnasium.make_vec("fireworld/Team-v0", num_envs=64, scenario="test-1")

Everything but `worlds` needs `pip install 'fireworld[gym]'`. Names are imported when they are first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fireworld.envs.registration import register_with_gymnasium

if TYPE_CHECKING:
    from fireworld.envs.aec_env import TurnsEnv as TurnsEnv
    from fireworld.envs.aec_env import turns as turns
    from fireworld.envs.autoreset import Autoreset as Autoreset
    from fireworld.envs.brigade_env import BrigadeEnv as BrigadeEnv
    from fireworld.envs.brigade_env import brigade as brigade
    from fireworld.envs.keyed import episode_seed as episode_seed
    from fireworld.envs.keyed import explored as explored
    from fireworld.envs.many_worlds import Worlds as Worlds
    from fireworld.envs.many_worlds import worlds as worlds
    from fireworld.envs.parallel_env import TeamEnv as TeamEnv
    from fireworld.envs.parallel_env import team as team
    from fireworld.envs.team_env import WholeTeamEnv as WholeTeamEnv
    from fireworld.envs.vector_env import TeamVectorEnv as TeamVectorEnv
    from fireworld.training.seeds import Seeds as Seeds

_ROOMS = {
    "Autoreset": "autoreset",
    "BrigadeEnv": "brigade_env",
    "Seeds": "many_worlds",
    "TeamEnv": "parallel_env",
    "TeamVectorEnv": "vector_env",
    "TurnsEnv": "aec_env",
    "WholeTeamEnv": "team_env",
    "Worlds": "many_worlds",
    "brigade": "brigade_env",
    "episode_seed": "keyed",
    "explored": "keyed",
    "team": "parallel_env",
    "turns": "aec_env",
    "worlds": "many_worlds",
}
"""The module that each name lives in; none has the name of a function, or it would take its place."""
_EXTRA = ("gymnasium", "pettingzoo")

__all__ = [*sorted(_ROOMS)]  # noqa: PLE0604 - the names are those of the table

register_with_gymnasium()


if not TYPE_CHECKING:

    def __getattr__(name: str) -> Any:
        """Import a name from the module it lives in, at its first use."""
        if name not in _ROOMS:
            raise AttributeError(f"module 'fireworld.envs' has no attribute {name!r}; there are {', '.join(__all__)}")
        from importlib import import_module

        try:
            module = import_module(f"fireworld.envs.{_ROOMS[name]}")
        except ModuleNotFoundError as error:
            if error.name not in _EXTRA:
                raise
            from fireworld.errors import LibraryError

            hint = "try pip install 'fireworld[gym]'"
            raise LibraryError(f"fireworld.envs.{name}: {error.name} is not installed; {hint}") from None
        found = globals()[name] = getattr(module, name)
        return found


def __dir__() -> list[str]:
    return [*__all__]
