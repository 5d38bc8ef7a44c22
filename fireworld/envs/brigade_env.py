"""One brigade as Gymnasium has it, in a team whose others follow a policy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Unpack

import gymnasium

from fireworld.arguments import ArgumentError, whole_number
from fireworld.envs.agents import agent_info, agent_view
from fireworld.envs.forms import DEFAULT, FormOptions, OneWorldForm, metadata_of, world_seed_in
from fireworld.envs.setup import Scenarios
from fireworld.envs.spaces import action_space, agent_space
from fireworld.errors import LogError, expected
from fireworld.kernels.arrays import Array
from fireworld.policy.names import find_policy
from fireworld.policy.protocol import Observation, Policy

AnyPolicy = str | Policy | type[Policy] | Callable[[Observation], Any]


class BrigadeEnv(OneWorldForm, gymnasium.Env[dict[str, Any], int]):
    """One brigade of a team, whose others follow a policy: a gymnasium.Env, `fireworld/Brigade-v0`.

    Choices are as the scenario says; in turn, the brigade sees what those before it have chosen. The reward is the
    team's. It is terminated if nothing burns any more, or if the brigade is dead. While it refills, it may do action 0
    only, which does nothing.
    """

    metadata = metadata_of("brigade")
    FORM = "brigade"

    def __init__(
        self,
        scenario: Scenarios = DEFAULT,
        *,
        brigade: int = 0,
        others: AnyPolicy = "best",
        **options: Unpack[FormOptions],
    ) -> None:
        named = find_policy(others)
        super().__init__(scenario, choices=None, others=named.policy, **options)
        least = min(built.brigades.n for built in self.worlds.scenarios)
        self.brigade = whole_number("brigade", brigade, least=0, most=least - 1)
        self._own = {"brigade": self.brigade, "others": named.digest}
        self.observation_space, self.action_space = agent_space(self.worlds), action_space(self.worlds)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin the next episode; with a seed, episode 0 of those that follow from it.

        Of the options, `world_seed` is the seed of its random draws, to play an episode again.

        Raises:
            PolicyError: the others' policy fails.
        """
        gymnasium.Env.reset(self, seed=seed, options=options)  # a generator that Gymnasium asks for; nothing uses it
        self.worlds.reset(seed=seed, world_seeds=world_seed_in(options))
        self._rendering.begin(self.worlds)
        self.worlds.begin_among_others(self.brigade)
        return self._beginning()

    def step(self, action: int) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Run one step.

        Raises:
            ArgumentError: there is no such action, the mask forbids it, or the episode is not under way.
            PolicyError: the others' policy fails.
        """
        self.worlds.check_under_way()
        if not self._lives():
            raise ArgumentError(expected("step", "", f"an episode in which brigade {self.brigade} lives", "none"))
        done = self.worlds.step_among_others(self.brigade, action)
        self._rendering.follow(self.worlds)
        lives = self._lives()
        terminated, truncated = bool(done.terminated[0]) or not lives, bool(done.truncated[0]) and lives
        view, info = self._beginning()
        return view, float(done.reward[0]), terminated, truncated, info

    def action_masks(self) -> Array:
        """Return which actions the brigade may take, (actions,) bool: where learners that mask look for it."""
        mask: Array = self.worlds.observe()["action_mask"][0, self.brigade]
        return mask

    def _lives(self) -> bool:
        return bool(self.worlds.observe()["alive"][0, self.brigade])

    def _beginning(self) -> tuple[dict[str, Any], dict[str, Any]]:
        seen = self.worlds.observe()
        view = agent_view(seen, self.brigade, self.worlds.setup.observation)
        return view, agent_info(self.worlds.info(), seen, self.brigade)

    def _own_state(self) -> dict[str, Any]:
        return self._own

    def _check_own(self, own: Any) -> None:
        if own != self._own:
            raise LogError(expected("snapshot", "own", f"brigade {self.brigade} and the same others", "others"))

    def _take_own(self, own: Any) -> None:
        del own
        self.worlds.begin_policy()


def brigade(
    scenario: Scenarios, *, brigade: int = 0, others: AnyPolicy = "best", **options: Unpack[FormOptions]
) -> BrigadeEnv:
    """Return one brigade, in a team whose others follow a policy, as a gymnasium.Env.

    Args:
        scenario: a shipped name, a YAML file, a Scenario, or the keys and values of one; or several, played in turn.
        brigade: its number.
        others: the policy of the other brigades: a name as for `--policy`, a policy, its class, or a function of the
            observation. One of your own that remembers earlier steps begins anew where a snapshot is restored.
        options: `FormOptions`.

    Raises:
        ScenarioError, CityError: the scenario cannot be had or built.
        PolicyError: there is no such policy.
        ArgumentError: an argument that makes no sense.
        ViewError: there is no view to render to.
    """
    return BrigadeEnv(scenario, brigade=brigade, others=others, **options)
