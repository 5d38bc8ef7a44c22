"""Brigades as agents: what each is called, what it is shown, what is known besides."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from fireworld.envs.forms import OneWorldForm
from fireworld.envs.spaces import action_space, agent_space, state_space
from fireworld.kernels.arrays import Array

ByAgent = dict[str, Any]
"""Something of every agent, by its name."""
_GRAPH: Final = ("burning", "buildings", "brigades", "team")


def agent_name(brigade: int) -> str:
    """Return the name of a brigade as an agent."""
    return f"brigade_{brigade}"


def agent_view(seen: dict[str, Array], brigade: int, kind: str) -> dict[str, Any]:
    """Return what a brigade of a single world sees, in arrays of its own.

    Args:
        seen: what is seen of the world: `Worlds.observe`.
        brigade: its number.
        kind: of observation.

    Returns:
        `observation`, of "features" (8,), of "targets" (4, 13), of "graph" arrays by name, and `action_mask`
        (actions,) int8, 1 of those that it may take.
    """
    mask = seen["action_mask"][0, brigade].astype(np.int8)
    if kind != "graph":
        return {"observation": seen[kind][0, brigade].copy(), "action_mask": mask}
    graph: dict[str, Any] = {name: seen[name][0].copy() for name in _GRAPH}
    if "own" in seen:
        graph["own"] = seen["own"][0, brigade].copy()
    return {"observation": {**graph, "brigade": np.int64(brigade)}, "action_mask": mask}


def agent_info(info: dict[str, Array], seen: dict[str, Array], brigade: int) -> dict[str, Any]:
    """Return what is known besides of a single world: plain numbers, and the mask and own targets of a brigade."""
    own = {"own": seen["own"][0, brigade].copy()} if "own" in seen else {}
    mask = seen["action_mask"][0, brigade].astype(np.int8)
    return {**{name: array[0].item() for name, array in info.items()}, "action_mask": mask, **own}


def whole_view(seen: dict[str, Array], kind: str) -> Array:
    """Return all that is seen of a single world in one row of float32: the team, then what its brigades see."""
    shown = [seen["team"]]
    shown += [seen["brigades"], seen["buildings"]] if kind == "graph" else [seen[kind]]
    return np.concatenate([array[0].ravel() for array in shown], dtype=np.float32)


class AgentsForm(OneWorldForm):
    """Brigades as agents, each with a name and spaces of its own.

    Attributes:
        possible_agents: the names of all.
        agents: of those that live, while their world is under way.
    """

    possible_agents: list[str]
    agents: list[str]

    def _name_agents(self) -> None:
        names = [agent_name(brigade) for brigade in range(self.worlds.n_brigades)]
        self.possible_agents, self.agents = names, []
        self._observation_space = {name: agent_space(self.worlds) for name in names}
        self._action_space = {name: action_space(self.worlds) for name in names}
        self.state_space = state_space(len(self.state()))

    def observation_space(self, agent: str) -> Any:
        """Return what an agent sees."""
        return self._observation_space[agent]

    def action_space(self, agent: str) -> Any:
        """Return what an agent can do."""
        return self._action_space[agent]

    def state(self) -> Array:
        """Return all that the team sees in one row, float32: `TEAM`, then what is seen of or by its brigades."""
        return whole_view(self.worlds.observe(), self.worlds.setup.observation)

    def _living(self, seen: dict[str, Array]) -> list[str]:
        return [name for name, alive in zip(self.possible_agents, seen["alive"][0].tolist(), strict=True) if alive]

    def _views(self, seen: dict[str, Array], agents: list[str]) -> ByAgent:
        """Return what agents see."""
        kind = self.worlds.setup.observation
        return {name: agent_view(seen, self.possible_agents.index(name), kind) for name in agents}

    def _infos(self, seen: dict[str, Array], agents: list[str]) -> ByAgent:
        """Return what is known besides, of each agent."""
        info = self.worlds.info()
        return {name: agent_info(info, seen, self.possible_agents.index(name)) for name in agents}
