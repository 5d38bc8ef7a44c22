"""Many teams as Gymnasium has them: a vector environment whose worlds are stepped in one call."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Unpack

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from fireworld.arguments import ArgumentError, whole_number
from fireworld.envs.autoreset import autoreset_of
from fireworld.envs.forms import DEFAULT, Form, metadata_of, seeds_of
from fireworld.envs.many_worlds import Worlds
from fireworld.envs.rendering import Rendering
from fireworld.envs.setup import Scenarios, SetupOptions, setup_of
from fireworld.envs.spaces import in_int8, team_actions, team_space
from fireworld.errors import expected
from fireworld.kernels.arrays import Array
from fireworld.training.seeds import WORKERS_MAX, Seeds

Seen = dict[str, Array]


class TeamVectorEnv(Form, VectorEnv[Seen, Array, Array]):
    """Many teams, each as one agent: a gymnasium.vector.VectorEnv, `gymnasium.make_vec("fireworld/Team-v0")`."""

    FORM = "team-vector"

    def __init__(
        self,
        num_envs: int = 1,
        scenario: Scenarios = DEFAULT,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int = 1,
        seed: int | Seeds | None = None,
        worker: int = 0,
        render_mode: str | None = None,
        view_url: str | None = None,
        **options: Unpack[SetupOptions],
    ) -> None:
        """Make the worlds.

        Args:
            num_envs: how many, up to 2048.
            scenario: one or several; world i plays number (worker + i + episode) modulo their number.
            autoreset_mode: Gymnasium's, ours, or its name.
            threads: that step the worlds.
            seed: as of `FormOptions`, here and below.
            worker: the number of the first world among those that share a base.
            render_mode: "rgb_array" draws all worlds, "rerun" shows the first one.
            view_url: the same.
            options: `SetupOptions`.
        """
        mode, n = autoreset_of(autoreset_mode), whole_number("num_envs", num_envs, least=1, most=WORKERS_MAX)
        self._rendering, self.render_mode = Rendering(render_mode, view_url), render_mode
        self.worlds = Worlds(
            setup_of(scenario, choices="simultaneous", **options),
            n,
            autoreset=mode,
            threads=whole_number("threads", threads, least=1, most=64),
            seeds=seeds_of(seed),
            first_worker=whole_number("worker", worker, least=0, most=WORKERS_MAX - n),
        )
        self.num_envs, self.metadata = n, {**metadata_of("team"), "autoreset_mode": AutoresetMode(mode.value)}
        self.single_observation_space, self.single_action_space = team_space(self.worlds), team_actions(self.worlds)
        self.observation_space = batch_space(self.single_observation_space, n)
        self.action_space = batch_space(self.single_action_space, n)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Seen, dict[str, Any]]:
        """Begin the next episode of worlds, and return what is seen of all and known of those that were reset.

        Args:
            seed: begin with episode 0 again, and seeds that follow from this base; None: with the next episode.
            options: `reset_mask`, (num_envs,) bool, the worlds to reset, all if it is left out; `world_seeds`, the
                seeds of their random draws, to play episodes again.

        Raises:
            ArgumentError: an argument that makes no sense.
        """
        VectorEnv.reset(self, seed=seed, options=options)  # a generator that Gymnasium asks for; nothing uses it
        mask = self._mask(options or {})
        self.worlds.reset(seed=seed, indices=np.flatnonzero(mask), world_seeds=(options or {}).get("world_seeds"))
        self._rendering.begin(self.worlds)
        return in_int8(self.worlds.observe()), self._infos(self.worlds.info(), mask)

    def step(self, actions: Array) -> tuple[Seen, Array, Array, Array, dict[str, Any]]:
        """Run one step of every world.

        Args:
            actions: (num_envs, n_brigades) whole numbers.

        Returns:
            What is seen, rewards, whether worlds are terminated and truncated, and what is known besides: arrays by
            name, each with a mask `_name` of the worlds that it is known of.

        Raises:
            ArgumentError: other actions, one that the mask forbids, or a world that is not under way.
        """
        done = self.worlds.step(actions)
        self._rendering.follow(self.worlds)
        infos = self._infos(done.info, np.ones(self.num_envs, dtype=np.bool_))
        if done.final_observation is not None and done.final_info is not None:
            ended, final = done.terminated | done.truncated, in_int8(done.final_observation)
            last_seen = np.full(self.num_envs, None, dtype=object)
            for index in np.flatnonzero(ended).tolist():
                last_seen[index] = {name: array[index].copy() for name, array in final.items()}
            infos |= {"final_obs": last_seen, "final_info": self._infos(done.final_info, ended)}
            infos |= {"_final_obs": ended.copy(), "_final_info": ended.copy()}
        return in_int8(done.observation), done.reward, done.terminated, done.truncated, infos

    def fork(self, source: int, target: int, *, seed: int | None = None) -> None:
        """Bring world `target` into the state of world `source`; as `Worlds.fork`."""
        self.worlds.fork(source, target, seed=seed)
        self._rendering.begin(self.worlds)

    def render(self) -> Any:
        """Return a picture of every world, (height, width, 3) uint8 each; errors as for one world."""
        return self._rendering.pictures(self.worlds)

    def close(self, **kwargs: Any) -> None:
        """End threads and view; called again, it does nothing."""
        del kwargs
        if "worlds" in vars(self):  # Gymnasium closes what is thrown away, even if it could not be made
            Form.close(self)
        self.closed = True

    def _beginning(self) -> tuple[Seen, dict[str, Any]]:
        begun = self.worlds.episode_number >= 0
        return in_int8(self.worlds.observe()), self._infos(self.worlds.info(), begun)

    def _infos(self, info: Mapping[str, Array], known: Array) -> dict[str, Any]:
        """Return what is known of some worlds, (num_envs,) bool, as Gymnasium has it: 0 of the others, and masks."""
        values = {name: np.where(known, array, 0).astype(array.dtype) for name, array in info.items()}
        return values | {f"_{name}": known.copy() for name in info}

    def _mask(self, options: Mapping[str, Any]) -> Array:
        mask: Array = options.get("reset_mask", np.ones(self.num_envs, dtype=np.bool_))
        fits = isinstance(mask, np.ndarray) and mask.shape == (self.num_envs,) and mask.dtype == np.bool_
        if not fits or not mask.any():
            wanted = f"({self.num_envs},) bool, one of them true"
            raise ArgumentError(expected("reset", "reset_mask", wanted, getattr(mask, "shape", mask)))
        return mask
