"""A team as PettingZoo has it: brigades that choose one after another, each seeing what those before it chose."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, Unpack

from pettingzoo.utils.env import AECEnv

from fireworld.arguments import ArgumentError
from fireworld.envs.agents import AgentsForm, ByAgent, agent_view
from fireworld.envs.forms import FormOptions, metadata_of, world_seed_in
from fireworld.envs.setup import Scenarios
from fireworld.errors import LogError, expected

_NUMBER: Final = (int, float)  # PettingZoo clears rewards to a whole 0
_BY_AGENT: Final[Mapping[str, tuple[type, ...]]] = {
    "rewards": _NUMBER,
    "_cumulative_rewards": _NUMBER,
    "terminations": (bool,),
    "truncations": (bool,),
}
"""What is remembered of every agent, by the names that PettingZoo gives it, and its types."""
_SELECTED: Final = ("agent_selection", "_skip_agent_selection")


class TurnsEnv(AgentsForm, AECEnv):  # type: ignore[misc]  # pettingzoo has no types
    """A team whose brigades choose one after another: a pettingzoo.AECEnv.

    A step of the world is run when the last one has chosen, as in a run with `choices: in-turn`. Its reward is the
    team's, the same for all. A brigade that dies is terminated; one that refills takes its turn, and may do action 0
    only, which does nothing.
    """

    metadata = metadata_of("turns")
    FORM = "turns"

    def __init__(self, scenario: Scenarios, **options: Unpack[FormOptions]) -> None:
        super().__init__(scenario, choices="in-turn", **options)
        self._name_agents()
        self._start([])

    def reset(self, seed: int | None = None, options: Mapping[str, Any] | None = None) -> None:
        """Begin the next episode; with a seed, episode 0 of those that follow from it.

        Of the options, `world_seed` is the seed of its random draws, to play an episode again.
        """
        self.worlds.reset(seed=seed, world_seeds=world_seed_in(options))
        self._rendering.begin(self.worlds)
        self._start(self._living(self.worlds.observe()))
        self._select_from(0)

    def step(self, action: Any) -> None:
        """Let the selected agent choose; None for one that is terminated or truncated, which then leaves.

        Raises:
            ArgumentError: there is no such action, the mask forbids it, or nothing is under way.
        """
        if not self.agents:
            raise ArgumentError(expected("step", "", "an episode under way", "none", "reset it"))
        name = self.agent_selection
        if self._has_left(name):
            if action is not None:
                raise ArgumentError(expected("step", name, "None of an agent that has left", action))
            self._was_dead_step(None)
            return
        brigade = self.possible_agents.index(name)
        self.worlds.take_turn(brigade, action)
        self._cumulative_rewards[name] = 0.0
        self._clear_rewards()
        if not self._select_from(brigade + 1):
            self._run_step()

    def observe(self, agent: str) -> dict[str, Any]:
        """Return what an agent sees now."""
        brigade = self.possible_agents.index(agent)
        if not self.worlds.over:
            self.worlds.look(brigade)
        return agent_view(self.worlds.observe(), brigade, self.worlds.setup.observation)

    def _start(self, agents: list[str]) -> None:
        """Begin with agents of which none has left."""
        self.agents = agents
        self.agent_selection: str = self.possible_agents[0]
        self._skip_agent_selection: str | None = None
        self.rewards, self._cumulative_rewards = (dict.fromkeys(agents, 0.0) for _ in range(2))
        self.terminations, self.truncations = (dict.fromkeys(agents, False) for _ in range(2))
        self._inform()

    def _inform(self) -> None:
        self.infos: ByAgent = self._infos(self.worlds.observe(), self.agents)

    def _has_left(self, name: str) -> bool:
        return bool(self.terminations[name] or self.truncations[name])

    def _select_from(self, first: int) -> bool:
        """Select the first agent that lives from a brigade on, the dead ones before it doing nothing; False: none."""
        for brigade in range(first, self.worlds.built(0).n_brigades):
            name = self.possible_agents[brigade]
            if name in self.agents and not self._has_left(name):
                self.agent_selection = name
                return True
            self.worlds.take_turn(brigade, 0)
        return False

    def _run_step(self) -> None:
        """Run the step of the world in which all have chosen, and select who is next."""
        done = self.worlds.finish_turns()
        self._rendering.follow(self.worlds)
        terminated, truncated = bool(done.terminated[0]), bool(done.truncated[0])
        living = self._living(done.observation)
        for name in self.agents:
            self.rewards[name] = float(done.reward[0])
            self.terminations[name] = terminated or name not in living
            self.truncations[name] = truncated and name in living
        self._accumulate_rewards()
        self._inform()
        if not self.worlds.over:
            self._select_from(0)
        self._deads_step_first()

    def _own_state(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in ("agents", *_SELECTED, *_BY_AGENT)}

    def _check_own(self, own: Any) -> None:
        try:
            agents, (selected, skipped) = own["agents"], (own[name] for name in _SELECTED)
            known = set(self.possible_agents)
            fits = set(agents) <= known and selected in known and skipped in known | {None}
            fits = fits and all(
                list(own[table]) == agents and all(isinstance(value, kind) for value in own[table].values())
                for table, kind in _BY_AGENT.items()
            )
        except (KeyError, TypeError, AttributeError):
            fits = False
        if not fits:
            raise LogError(expected("snapshot", "own", "agents of these scenarios", "others"))

    def _take_own(self, own: Any) -> None:
        for name in ("agents", *_SELECTED, *_BY_AGENT):
            setattr(self, name, own[name])

    def _beginning(self) -> None:
        self._inform()


def turns(scenario: Scenarios, **options: Unpack[FormOptions]) -> TurnsEnv:
    """Return a team whose brigades choose one after another, as a pettingzoo.AECEnv.

    Args:
        scenario: a shipped name, a YAML file, a Scenario, or the keys and values of one; or several, played in turn.
            Choices are in turn, whatever it says; `team` is for simultaneous ones.
        options: `FormOptions`.

    Raises:
        ScenarioError, CityError: the scenario cannot be had or built.
        ArgumentError: an argument that makes no sense.
        ViewError: there is no view to render to.
    """
    return TurnsEnv(scenario, **options)
