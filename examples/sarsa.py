"""SARSA in tables over a PettingZoo environment: bit for bit the team that `fireworld train` makes.

    python examples/sarsa.py && fireworld run quick --policy sarsa.npz

Each brigade learns a table, (states, actions), from the eight features that it sees. The agents choose one after
another, explore as fireworld's own method does, and play the same episodes; so the tables are the same to the last bit,
which is checked at the end. (If brigades die they may differ: in the environment, who is dead gets no reward.)
"""

from __future__ import annotations

import argparse
import math
import sys

import numpy as np

import fireworld as fw
from fireworld import envs

FEATURES = (5, 3, 3, 6, 2, 2, 2, 2)  # how many values each of the eight has; together they are the number of a state
ALPHA, GAMMA, EPSILON_DECAY, N_UNCHANGED = 0.7, 0.5, 0.9, 20


def play(env: envs.TurnsEnv, tables: np.ndarray, visits: np.ndarray, *, seed: int, epsilon: float, last: int) -> None:
    """Learn from an episode; if it is truncated, also from what the brigades would do in the step after the last."""
    waiting: dict[
        int, tuple
    ] = {}  # of each brigade: its last choice, the reward since, the discount of what comes next

    def learn(brigade: int, value: float) -> None:
        if brigade in waiting:
            choice, reward, discount = waiting.pop(brigade)
            tables[choice] += ALPHA * (reward + discount * value - tables[choice])
            visits[choice] += 1

    env.reset(options={"world_seed": seed})
    for name in env.agent_iter():
        view, reward, terminated, _, info = env.last()
        brigade, step, action = env.possible_agents.index(name), info["step"] + 1, 0
        if step > last + 1:
            return
        if brigade in waiting:
            choice, so_far, discount = waiting[brigade]
            waiting[brigade] = choice, so_far + discount * reward, discount * GAMMA
        if terminated:
            learn(brigade, 0.0)
            action = None
        elif view["action_mask"][1]:  # it has a choice: it lives, does not refill, and something burns
            state = int(np.ravel_multi_index(view["observation"], FEATURES))
            action = envs.explored(seed, brigade, step, epsilon=epsilon)
            if action is None:
                action = int(tables[brigade, state].argmax())
            learn(brigade, tables[brigade, state, action])
            waiting[brigade] = (brigade, state, action), 0.0, 1.0
        env.step(action)


def train(scenario: str, *, n_episodes: int, seed: int) -> fw.TableTeam:
    """Learn until no greedy action has changed for 20 episodes, or there were enough."""
    last = fw.world(scenario, seed=0).scenario.steps
    env = envs.turns(scenario, reward="stock", steps=last + 1)
    tables = np.zeros((len(env.possible_agents), math.prod(FEATURES), 4))
    visits, epsilon, n_unchanged = np.zeros(tables.shape, dtype=np.int64), 1.0, 0
    for episode in range(n_episodes):
        before = tables.argmax(axis=2)
        play(env, tables, visits, seed=envs.episode_seed(seed, 0, episode), epsilon=epsilon, last=last)
        epsilon *= EPSILON_DECAY
        n_unchanged = n_unchanged + 1 if (tables.argmax(axis=2) == before).all() else 0
        if n_unchanged == N_UNCHANGED:
            break
    return fw.TableTeam(tables, visits, {"made by": "examples/sarsa.py"})


def main() -> int:
    """Learn, write the team, and compare it with fireworld's own; return 0 if they are equal."""
    parser = argparse.ArgumentParser(description="Learn tables by SARSA.")
    parser.add_argument("--scenario", default="quick", help="by name; its team has two brigades or more")
    parser.add_argument("--episodes", type=int, default=130, help="at most")
    parser.add_argument("--seed", type=int, default=1, help="of all random draws")
    parser.add_argument("-o", "--output", default="sarsa.npz", help="the team file to write")
    given = parser.parse_args()
    try:
        import pettingzoo  # noqa: F401 - the environment needs it
    except ImportError:
        print("skipped: PettingZoo is not installed; try pip install 'fireworld[gym]'")
        return 0
    team = train(given.scenario, n_episodes=given.episodes, seed=given.seed)
    team.save(given.output, force=True)
    own = fw.train(given.scenario, method="paper", seed=given.seed, set={"n_episodes_max": given.episodes})
    equal = team.digest == own.digest and (team.visits == own.visits).all()
    print(f"{'equal' if equal else 'different'}: {team.digest}, by fireworld {own.digest}")
    print(f"wrote {given.output}; try `fireworld run {given.scenario} --policy {given.output}`")
    return 0 if equal else 1


if __name__ == "__main__":
    sys.exit(main())
