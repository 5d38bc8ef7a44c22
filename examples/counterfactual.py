"""What was each choice worth? Every brigade's other actions are tried in one step, on the same random draws.

    python examples/counterfactual.py && fireworld verify counterfactual.mcap

A team plays up to a step. From there on it has several futures, each with random draws of its own. In each of them, for
every brigade and every action, the team goes back to that step, the brigade does this, the others do what they did, and
all follow their rule after that; the table has the change of the final score. Futures are compared one by one, so that
chance cancels out.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from fireworld import envs

ACTIONS = ("easiest", "nearest-to-civilian", "nearest-to-center", "nearest-to-me")
RECORD = "counterfactual.mcap"


def rule(worlds: envs.Worlds) -> np.ndarray:
    """Return what the brigades of n worlds do, (n, b): half protect civilians, the others fight what is near."""
    b = worlds.n_brigades
    return np.tile(np.where(np.arange(b) < b // 2, 1, 3), (worlds.n, 1))


def play_on(worlds: envs.Worlds, actions: np.ndarray) -> np.ndarray:
    """Do something now, follow the rule after that, and return the final scores, (n,), as shares of the best one."""
    share, over = np.zeros(worlds.n), np.zeros(worlds.n, dtype=bool)
    while not over.all():
        done = worlds.step(actions)
        ends = (done.terminated | done.truncated) & ~over  # those that have ended before are in another episode by now
        share[ends], over = done.info["score_share"][ends], over | ends
        actions = rule(worlds)
    return share


def advantages(worlds: envs.Worlds, step: int) -> np.ndarray:
    """Return what every action of every brigade adds to the score in every future, (b, 4, n); nan for what it did."""
    worlds.reset()
    for _ in range(step):
        if worlds.step(rule(worlds)).terminated[0]:
            raise SystemExit(f"nothing burns any more after step {step}")
    for future in range(1, worlds.n):
        worlds.fork(0, future, seed=future)
    did, now = rule(worlds), worlds.snapshot()
    share = play_on(worlds, did)
    found = np.full((worlds.n_brigades, len(ACTIONS), worlds.n), np.nan)
    for brigade, action in np.argwhere(np.arange(len(ACTIONS)) != did[0, :, None]).tolist():
        worlds.restore(now)
        instead = did.copy()
        instead[:, brigade] = action
        found[brigade, action] = play_on(worlds, instead) - share
    return found


def cell(changes: np.ndarray) -> str:
    """Return the mean of changes, (n,), and its standard error."""
    if np.isnan(changes).all():
        return "what it did"
    return f"{changes.mean():+.3f} +- {changes.std(ddof=1) / len(changes) ** 0.5:.3f}" if changes.any() else "no change"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Try what each brigade could have done in one step.")
    parser.add_argument("--scenario", default="default", help="by name, or a file")
    parser.add_argument("--step", type=int, default=5, help="the step before the choices")
    parser.add_argument("--futures", type=int, default=32, help="sets of random draws to try, two or more")
    parser.add_argument("--seed", type=int, default=1, help="of the steps before")
    given = parser.parse_args()
    Path(RECORD).unlink(missing_ok=True)
    worlds = envs.worlds(given.scenario, given.futures, seeds=given.seed, record=RECORD)
    found = 100 * advantages(worlds, given.step)
    worlds.close()
    print(f"after step {given.step} of {given.scenario}: change of the score in % of the best one, +- standard error")
    print("brigade " + "".join(f"{name:>22}" for name in ACTIONS))
    for brigade, row in enumerate(found):
        print(f"{brigade:7} " + "".join(f"{cell(changes):>22}" for changes in row))
    print(f"every future is in {RECORD}; try `fireworld verify {RECORD}` and `fireworld info {RECORD}`")
