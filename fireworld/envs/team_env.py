"""A team as Gymnasium has it: all its brigades as one agent."""

from __future__ import annotations

from typing import Any, Unpack

import gymnasium

from fireworld.envs.forms import DEFAULT, FormOptions, OneWorldForm, metadata_of, world_seed_in
from fireworld.envs.setup import Scenarios
from fireworld.envs.spaces import in_int8, team_actions, team_space
from fireworld.kernels.arrays import Array


class WholeTeamEnv(OneWorldForm, gymnasium.Env[dict[str, Any], Array]):
    """A team as one agent, which chooses for all brigades at once: a gymnasium.Env, `fireworld/Team-v0`.

    It sees and does what each world of the vector environment of that name does.
    """

    metadata = metadata_of("whole_team")
    FORM = "whole-team"

    def __init__(self, scenario: Scenarios = DEFAULT, **options: Unpack[FormOptions]) -> None:
        super().__init__(scenario, choices="simultaneous", **options)
        self.observation_space, self.action_space = team_space(self.worlds), team_actions(self.worlds)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin the next episode; with a seed, episode 0 of those that follow from it.

        Of the options, `world_seed` is the seed of its random draws, to play an episode again.
        """
        gymnasium.Env.reset(self, seed=seed, options=options)  # a generator that Gymnasium asks for; nothing uses it
        self.worlds.reset(seed=seed, world_seeds=world_seed_in(options))
        self._rendering.begin(self.worlds)
        return self._beginning()

    def step(self, action: Array) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Run one step.

        Args:
            action: (n_brigades,) whole numbers.

        Raises:
            ArgumentError: other actions, one that the mask forbids, or an episode that is not under way.
        """
        done = self.worlds.step([action])  # type: ignore[list-item]  # whatever it is, it is checked there
        self._rendering.follow(self.worlds)
        view, info = self._beginning()
        return view, float(done.reward[0]), bool(done.terminated[0]), bool(done.truncated[0]), info

    def action_masks(self) -> Array:
        """Return which actions each brigade may take, (n_brigades * actions,) bool, one brigade after another."""
        mask: Array = self.worlds.observe()["action_mask"][0].ravel()
        return mask

    def _beginning(self) -> tuple[dict[str, Any], dict[str, Any]]:
        seen, info = in_int8(self.worlds.observe()), self.worlds.info()
        return {name: array[0] for name, array in seen.items()}, {name: array[0] for name, array in info.items()}
