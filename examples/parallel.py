"""A PettingZoo loop: brigades at random and by a rule on the same fires, every episode recorded.

    python examples/parallel.py
    fireworld diff random.mcap rule.mcap

An episode is recorded as its seed and its actions, a few bytes a step. Any of them can be replayed in full, verified
and looked at; what is printed last says how.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

try:
    from fireworld.envs import team
except ImportError as error:
    print(f"skipped: {error}")
    sys.exit()

NEAREST_TO_CIVILIAN, NEAREST_TO_ME = 1, 3


def at_random(brigade: int, n_brigades: int, mask: np.ndarray, random: np.random.Generator) -> int:
    """Return one of the actions that the mask allows."""
    del brigade, n_brigades
    return int(random.choice(np.flatnonzero(mask)))


def by_rule(brigade: int, n_brigades: int, mask: np.ndarray, random: np.random.Generator) -> int:
    """Let half of the brigades protect civilians, and the others fight what is near."""
    del random
    wanted = NEAREST_TO_CIVILIAN if brigade < n_brigades // 2 else NEAREST_TO_ME
    return wanted if mask[wanted] else 0


def play(scenario: str, choose: Callable[..., int], *, n_episodes: int, seed: int, record: str) -> list[float]:
    """Play episodes, and return the score of each as a share of the best there is."""
    Path(record).unlink(missing_ok=True)
    env, random, shares = team(scenario, record=record, seed=seed), np.random.default_rng(seed), []
    for _ in range(n_episodes):
        views, infos = env.reset()
        while env.agents:
            actions = {}
            for number, name in enumerate(env.possible_agents):
                if name in env.agents:
                    actions[name] = choose(number, env.max_num_agents, views[name]["action_mask"], random)
            views, _rewards, _terminated, _truncated, infos = env.step(actions)
        shares.append(next(iter(infos.values()))["score_share"])
    env.close()
    return shares


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Play at random and by a rule.")
    parser.add_argument("--scenario", default="default", help="by name, or a file")
    parser.add_argument("--episodes", type=int, default=10, help="of each")
    parser.add_argument("--seed", type=int, default=1, help="of all random draws")
    given = parser.parse_args()
    for name, choose in (("random", at_random), ("rule", by_rule)):
        record = f"{name}.mcap"
        shares = play(given.scenario, choose, n_episodes=given.episodes, seed=given.seed, record=record)
        print(f"{name:6} score {np.mean(shares):.3f} of 1, {min(shares):.3f} to {max(shares):.3f}, in {record}")
    print("to see the last episode, step by step:")
    print("  fireworld replay rule.mcap --episode -1 -o episode.mcap && fireworld view episode.mcap")
