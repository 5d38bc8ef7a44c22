"""PPO of Stable-Baselines3 learns a network that is a team, which `fireworld compare` judges.

    python examples/stable_baselines.py && fireworld compare chief stable-baselines.npz --seeds 20

Stable-Baselines3 knows one agent in each environment. Here every brigade of 32 worlds counts as one, so that all learn
with one network. It values each of the four targets that the actions name, from 13 features; the values are the logits
of the actions.
"""

from __future__ import annotations

import argparse
import sys
from typing import Any

import numpy as np

try:
    import torch
    from gymnasium.spaces import Box, Discrete
    from stable_baselines3 import PPO
    from stable_baselines3.common.policies import ActorCriticPolicy
    from stable_baselines3.common.vec_env import VecEnv
    from torch import nn
except ImportError as error:
    print(f"skipped: {error}; try pip install 'fireworld[learn]'")
    sys.exit()

import fireworld as fw
from fireworld import envs

N_WORLDS, N_STEPS, N_PARTS = 32, 128, 16
N_TARGETS, N_FEATURES, N_TEAM = 4, 13, 6
REWARD_SCALE = 50.0


class Brigades(VecEnv):
    """Every brigade of many worlds as an environment of Stable-Baselines3: it sees its targets, and the team."""

    def __init__(self, worlds: envs.Worlds) -> None:
        self.worlds, self.render_mode = worlds, None
        seen = Box(-np.inf, np.inf, (N_TARGETS * N_FEATURES + N_TEAM,), np.float32)
        super().__init__(worlds.n * worlds.n_brigades, seen, Discrete(N_TARGETS))

    def reset(self) -> np.ndarray:
        return self._rows(self.worlds.reset())

    def step_async(self, actions: np.ndarray) -> None:
        self.actions = actions.reshape(self.worlds.n, self.worlds.n_brigades)

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        done, b = self.worlds.step(self.actions), self.worlds.n_brigades
        truncated, over = np.repeat(done.truncated, b), np.repeat(done.terminated | done.truncated, b)
        infos: list[dict[str, Any]] = [{} for _ in over]
        if done.final_observation is not None:
            last = self._rows(done.final_observation)
            for k in np.flatnonzero(over):
                infos[k] = {"terminal_observation": last[k], "TimeLimit.truncated": bool(truncated[k])}
        reward = np.repeat(REWARD_SCALE * done.reward, b).astype(np.float32)
        return self._rows(done.observation), reward, over, infos

    def close(self) -> None:
        self.worlds.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        return [getattr(self, attr_name)] * len(self._get_indices(indices))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        raise NotImplementedError

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        raise NotImplementedError

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        del wrapper_class
        return [False] * len(self._get_indices(indices))

    def _rows(self, seen: dict[str, np.ndarray]) -> np.ndarray:
        n, b = seen["targets"].shape[:2]
        team = np.broadcast_to(seen["team"][:, None], (n, b, N_TEAM))
        return np.concatenate([seen["targets"].reshape(n, b, -1), team], axis=2).reshape(n * b, -1)


class Networks(nn.Module):
    """One network that values targets one by one, and a critic that sees all of them and the team."""

    latent_dim_pi, latent_dim_vf = N_TARGETS, 32

    def __init__(self, n_seen: int) -> None:
        super().__init__()
        self.ranking = nn.Sequential(
            nn.Linear(N_FEATURES, 32), nn.Tanh(), nn.Linear(32, 32), nn.Tanh(), nn.Linear(32, 1)
        )
        self.critic = nn.Sequential(nn.Linear(n_seen, 32), nn.Tanh(), nn.Linear(32, 32), nn.Tanh())

    def forward(self, seen: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        return self.forward_actor(seen), self.forward_critic(seen)

    def forward_actor(self, seen: torch.Tensor) -> torch.Tensor:
        return self.ranking(seen[:, :-N_TEAM].unflatten(1, (N_TARGETS, N_FEATURES))).squeeze(2)

    def forward_critic(self, seen: torch.Tensor) -> torch.Tensor:
        return self.critic(seen)


class Policy(ActorCriticPolicy):
    """A policy whose logits are the values of the targets."""

    def _build_mlp_extractor(self) -> None:
        self.mlp_extractor = Networks(self.features_dim)

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)
        self.action_net = nn.Identity()
        self.optimizer = self.optimizer_class(self.parameters(), lr=lr_schedule(1), **self.optimizer_kwargs)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Learn by PPO of Stable-Baselines3.")
    parser.add_argument("--decisions", type=int, default=2_000_000, help="to learn from")
    parser.add_argument("--seed", type=int, default=1, help="of all random draws")
    parser.add_argument("-o", "--output", default="stable-baselines.npz", help="the team file to write")
    given = parser.parse_args()
    torch.set_num_threads(1)
    scenarios = [f"train-{k}" for k in range(1, 9)]
    worlds = envs.worlds(scenarios, N_WORLDS, observation="targets", autoreset="SAME_STEP", seeds=given.seed)
    brigades = Brigades(worlds)
    learner = PPO(
        Policy,
        brigades,
        n_steps=N_STEPS,
        batch_size=brigades.num_envs * N_STEPS // N_PARTS,
        n_epochs=4,
        learning_rate=lambda left: 1e-3 * left,
        ent_coef=0.003,
        seed=given.seed,
        device="cpu",
        verbose=1,
    )
    learner.learn(given.decisions, log_interval=20)
    linear = [layer for layer in learner.policy.mlp_extractor.ranking if isinstance(layer, nn.Linear)]
    layers = [(layer.weight.detach().numpy().T, layer.bias.detach().numpy()) for layer in linear]
    origin = {"method": "PPO of Stable-Baselines3", "decisions": given.decisions, "seed": given.seed}
    fw.NetworkTeam.from_layers(layers, activation="tanh", provenance=origin).save(given.output, force=True)
    print(f"wrote {given.output}")
