"""Every form, made and played in the same way: so that one check serves all of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from fireworld import envs
from fireworld.envs.setup import Scenarios
from fireworld.kernels.arrays import Array


@dataclass(frozen=True)
class Player:
    """Makes and plays a form.

    Attributes:
        make: returns one, of scenarios and with options.
        begin: resets it, and returns what that returns.
        act: lets it do `choose(mask)`, where the mask is that of the brigades that choose, and returns what comes of
            it; begins anew where an episode has ended.
    """

    make: Callable[..., Any]
    begin: Callable[[Any], Any]
    act: Callable[[Any, Callable[[Array], Array]], Any]


def randomly(seed: int) -> Callable[[Array], Array]:
    """Return a way to choose among the actions that a mask (..., actions) allows."""
    random = np.random.default_rng(seed)
    return lambda mask: (random.random(mask.shape) * mask).argmax(axis=-1)


def play(player: Player, env: Any, n: int, choose: Callable[[Array], Array]) -> list[Any]:
    """Let an environment act n times, and return what came of it, with its digest each time."""
    return [(player.act(env, choose), env.digest()) for _ in range(n)]


def exact(value: Any) -> Any:
    """Return nested values in a form in which they are equal only if they are to the last bit."""
    if isinstance(value, np.ndarray):
        if value.dtype == object:
            return [exact(item) for item in value.tolist()]
        return value.dtype.str, value.shape, value.tobytes()
    if isinstance(value, Mapping):
        return {name: exact(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [exact(item) for item in value]
    return exact(vars(value)) if hasattr(value, "__dict__") else (type(value).__name__, value)


def _masks(env: Any) -> Array:
    mask: Array = env.worlds.observe()["action_mask"]
    return mask


def _worlds(scenario: Scenarios, *, seed: int = 0, **options: Any) -> Any:
    return envs.worlds(scenario, 3, seeds=seed, **options)


def _act_worlds(worlds: Any, choose: Callable[[Array], Array]) -> Any:
    return worlds.step(choose(worlds.observe()["action_mask"]))


def _act_team(env: Any, choose: Callable[[Array], Array]) -> Any:
    actions = choose(_masks(env)[0]).tolist()
    done = env.step({name: actions[env.possible_agents.index(name)] for name in env.agents})
    return done if env.agents else (done, env.reset())


def _act_turns(env: Any, choose: Callable[[Array], Array]) -> Any:
    name = env.agent_selection
    last = env.last()
    left = env.terminations[name] or env.truncations[name]
    env.step(None if left else int(choose(_masks(env)[0, env.possible_agents.index(name)])))
    state = env.agents, env.rewards, env.infos, env.terminations, env.truncations
    if not env.agents:
        env.reset()
    return last, [dict(one) if isinstance(one, dict) else list(one) for one in state], env.agent_selection


def _act_brigade(env: Any, choose: Callable[[Array], Array]) -> Any:
    done = env.step(int(choose(_masks(env)[0, env.brigade])))
    return (done, env.reset()) if done[2] or done[3] else done


def _act_whole(env: Any, choose: Callable[[Array], Array]) -> Any:
    done = env.step(choose(_masks(env)[0]))
    return (done, env.reset()) if done[2] or done[3] else done


def _vector(scenario: Scenarios, **options: Any) -> Any:
    return envs.TeamVectorEnv(3, scenario, **options)


def _reset_turns(env: Any) -> Any:
    env.reset()
    return env.last()


PLAYERS: Final[Mapping[str, Player]] = {
    "worlds": Player(_worlds, lambda env: env.reset(), _act_worlds),
    "team": Player(envs.team, lambda env: env.reset(), _act_team),
    "turns": Player(envs.turns, _reset_turns, _act_turns),
    "brigade": Player(envs.brigade, lambda env: env.reset(), _act_brigade),
    "whole team": Player(envs.WholeTeamEnv, lambda env: env.reset(), _act_whole),
    "vector": Player(_vector, lambda env: env.reset(), lambda env, choose: env.step(choose(_masks(env)))),
}
"""By form."""
