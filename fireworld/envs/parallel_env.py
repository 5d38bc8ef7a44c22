"""A team as PettingZoo has it: brigades that all choose at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Unpack

from pettingzoo.utils.env import ParallelEnv

from fireworld.arguments import ArgumentError
from fireworld.envs.agents import AgentsForm, ByAgent
from fireworld.envs.forms import FormOptions, metadata_of, world_seed_in
from fireworld.envs.setup import Scenarios
from fireworld.errors import expected, nearest


class TeamEnv(AgentsForm, ParallelEnv):  # type: ignore[misc]  # pettingzoo has no types
    """A team whose brigades choose at once: a pettingzoo.ParallelEnv.

    The reward is the team's, the same for all. A brigade that dies is terminated and leaves; one that refills stays,
    and may do action 0 only, which does nothing.
    """

    metadata = metadata_of("team")
    FORM = "team"

    def __init__(self, scenario: Scenarios, **options: Unpack[FormOptions]) -> None:
        super().__init__(scenario, choices="simultaneous", **options)
        self._name_agents()

    def reset(self, seed: int | None = None, options: Mapping[str, Any] | None = None) -> tuple[ByAgent, ByAgent]:
        """Begin the next episode; with a seed, episode 0 of those that follow from it.

        Of the options, `world_seed` is the seed of its random draws, to play an episode again.
        """
        self.worlds.reset(seed=seed, world_seeds=world_seed_in(options))
        self._rendering.begin(self.worlds)
        return self._beginning()

    def step(self, actions: Mapping[str, Any]) -> tuple[ByAgent, ByAgent, ByAgent, ByAgent, ByAgent]:
        """Run one step.

        Args:
            actions: a whole number for every agent.

        Returns:
            What the agents see, their rewards, whether they are terminated and truncated, and what is known besides.

        Raises:
            ArgumentError: an agent or action that there is not, or that is missing; or the world is not under way.
        """
        agents = self.agents
        self.worlds.check_under_way()
        done = self.worlds.step([self._actions(actions)])
        self._rendering.follow(self.worlds)
        terminated, truncated, living = (
            bool(done.terminated[0]),
            bool(done.truncated[0]),
            self._living(done.observation),
        )
        self.agents = [] if terminated or truncated else living
        return (
            self._views(done.observation, agents),
            dict.fromkeys(agents, float(done.reward[0])),
            {name: terminated or name not in living for name in agents},
            {name: truncated and name in living for name in agents},
            self._infos(done.observation, agents),
        )

    def _actions(self, actions: Mapping[str, Any]) -> list[Any]:
        """Return the actions of all brigades, 0 of those that are dead."""
        for name in actions:
            if name not in self.agents:
                wanted = "the agents that live: " + ", ".join(self.agents)
                raise ArgumentError(expected("step", "actions", wanted, name, nearest(str(name), self.agents)))
        for name in self.agents:
            if name not in actions:
                raise ArgumentError(expected("step", name, "an action", "none"))
        return [actions.get(name, 0) for name in self.possible_agents]

    def _beginning(self) -> tuple[ByAgent, ByAgent]:
        seen = self.worlds.observe()
        self.agents = [] if self.worlds.over else self._living(seen)
        return self._views(seen, self.agents), self._infos(seen, self.agents)


def team(scenario: Scenarios, **options: Unpack[FormOptions]) -> TeamEnv:
    """Return a team whose brigades choose at once, as a pettingzoo.ParallelEnv.

    Args:
        scenario: a shipped name, a YAML file, a Scenario, or the keys and values of one; or several, played in turn.
            Choices are simultaneous, whatever it says; `turns` is for those in turn.
        options: `FormOptions`.

    Raises:
        ScenarioError, CityError: the scenario cannot be had or built.
        ArgumentError: an argument that makes no sense.
        ViewError: there is no view to render to.
    """
    return TeamEnv(scenario, **options)
