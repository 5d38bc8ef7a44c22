"""PPO in plain PyTorch: a small network learns to rank targets, and is a team that `fireworld compare` judges.

    python examples/ppo.py && fireworld compare chief ppo.npz --seeds 20

All brigades share the network. It values each of the four targets that the paper's actions name, from the 13 features
that rankings weigh; the values are the logits of the four actions. It learns in the eight training scenarios and in
larger fires at the same places, 64 worlds at once, rewarded with the change of the score. While it learns it is better
at some times than at others, so the team that is kept is the one that saves most of those fires, without exploration.
"""

from __future__ import annotations

import argparse
import sys
from collections import deque

import numpy as np

try:
    import torch
    from torch import nn
except ImportError as error:
    print(f"skipped: {error}; try pip install 'fireworld[learn]'")
    sys.exit()

import fireworld as fw
from fireworld import envs

LARGER = 2
"""Burning buildings more than in a training scenario."""
N_WORLDS, N_STEPS = 64, 64
GAMMA, LAMBDA, CLIP = 0.99, 0.95, 0.2
EPOCHS, PARTS = 4, 8
RATE, ENTROPY, VALUE_COST, NORM_MAX = 1e-3, 0.003, 0.5, 0.5
REWARD_SCALE = 50.0

Batch = dict[str, torch.Tensor]
"""What is learned from: what was seen and done, its log probability, advantage, the critic's target; a row a choice."""


def network(n_inputs: int) -> nn.Sequential:
    """Return a network with one output."""
    return nn.Sequential(nn.Linear(n_inputs, 32), nn.Tanh(), nn.Linear(32, 32), nn.Tanh(), nn.Linear(32, 1))


class Learner:
    """The ranking, the critic of what a brigade sees, and what trains them."""

    def __init__(self, seed: int) -> None:
        torch.manual_seed(seed)
        self.ranking, self.critic = network(13), network(4 * 13 + 6)
        self.parameters = [*self.ranking.parameters(), *self.critic.parameters()]
        self.optimizer = torch.optim.Adam(self.parameters, lr=RATE, eps=1e-5)

    def logits(self, seen: torch.Tensor) -> torch.Tensor:
        """Return the logits of the actions; `seen`: (..., 58), four targets and the team."""
        return self.ranking(seen[..., :52].unflatten(-1, (4, 13))).squeeze(-1)

    def values(self, seen: torch.Tensor) -> torch.Tensor:
        """Return what is expected from here on."""
        return self.critic(seen).squeeze(-1)

    def update(self, batch: Batch, progress: float) -> None:
        """Learn from the choices of a stretch, each one row."""
        self.optimizer.param_groups[0]["lr"] = RATE * (1.0 - progress)
        n = len(batch["action"])
        for _ in range(EPOCHS):
            for part in torch.randperm(n).chunk(PARTS):
                seen, action, before, advantage, target = (batch[name][part] for name in batch)
                chosen = torch.distributions.Categorical(logits=self.logits(seen))
                ratio = (chosen.log_prob(action) - before).exp()
                advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
                gain = torch.min(ratio * advantage, ratio.clamp(1 - CLIP, 1 + CLIP) * advantage).mean()
                error = (self.values(seen) - target).square().mean()
                self.optimizer.zero_grad()
                (VALUE_COST * error - gain - ENTROPY * chosen.entropy().mean()).backward()
                nn.utils.clip_grad_norm_(self.parameters, NORM_MAX)
                self.optimizer.step()


def seen_of(observation: dict[str, np.ndarray]) -> torch.Tensor:
    """Return what every brigade sees, (n, b, 58)."""
    targets, team = observation["targets"], observation["team"]
    n, b = targets.shape[:2]
    both = (targets.reshape(n, b, 52), np.broadcast_to(team[:, None], (n, b, 6)))
    return torch.from_numpy(np.concatenate(both, axis=2))


def advantages(*, reward: torch.Tensor, value: torch.Tensor, after: torch.Tensor, ended: torch.Tensor) -> torch.Tensor:
    """Return generalised advantages, (t, n, b); `after`: the value of what each step led to, 0 where it terminated."""
    found, last = torch.zeros_like(value), torch.zeros_like(value[0])
    for t in reversed(range(len(value))):
        last = reward[t] + GAMMA * after[t] - value[t] + GAMMA * LAMBDA * (~ended[t]) * last
        found[t] = last
    return found


def play(worlds: envs.Worlds, seen: torch.Tensor, learner: Learner) -> tuple[Batch, torch.Tensor, list[float]]:
    """Play a stretch of steps.

    Returns:
        What was chosen, each choice one row; what is seen now; the scores of the episodes that ended.
    """
    choices: dict[str, list[torch.Tensor]] = {name: [] for name in ("seen", "action", "before", "chose")}
    course: dict[str, list[torch.Tensor]] = {name: [] for name in ("reward", "value", "after", "ended")}
    scores: list[float] = []
    for _ in range(N_STEPS):
        with torch.no_grad():
            chosen = torch.distributions.Categorical(logits=learner.logits(seen))
            action, value = chosen.sample(), learner.values(seen)
        chose = torch.from_numpy(worlds.observe()["action_mask"][:, :, 1])  # else it refills, or is dead
        for name, new in zip(choices, (seen, action, chosen.log_prob(action), chose), strict=True):
            choices[name].append(new)
        step = worlds.step(action.numpy())
        seen, ended = seen_of(step.observation), step.terminated | step.truncated
        with torch.no_grad():
            after = learner.values(seen if step.final_observation is None else seen_of(step.final_observation))
        after[torch.from_numpy(step.terminated)] = 0.0
        reward = torch.from_numpy(step.reward * REWARD_SCALE).float()[:, None].expand_as(value)
        for name, new in zip(course, (reward, value, after, torch.from_numpy(ended)[:, None]), strict=True):
            course[name].append(new)
        if step.final_info is not None:
            scores += step.final_info["score_share"][ended].tolist()
    stacked = {name: torch.stack(several) for name, several in course.items()}
    advantage, chose = advantages(**stacked), torch.stack(choices.pop("chose"))
    batch = {name: torch.stack(several)[chose] for name, several in choices.items()}
    return batch | {"advantage": advantage[chose], "target": (advantage + stacked["value"])[chose]}, seen, scores


def fires() -> list[fw.Scenario]:
    """Return the fires to learn from."""
    found = []
    for scenario in (fw.world(f"train-{k}").scenario for k in range(1, 9)):
        n = scenario.fires[0].n_buildings + LARGER
        found += [scenario, scenario.with_values({"name": f"{scenario.name}-larger", "fires.0.n_buildings": n})]
    return found


def better(one: fw.NetworkTeam, other: fw.NetworkTeam, scenarios: list[fw.Scenario]) -> fw.NetworkTeam:
    """Return which of two teams saves more, over all scenarios."""
    table = fw.compare([one, other], scenarios=scenarios, seeds=3, executor="threads").table
    overall = next(row for row in table if row["metric"] == "score" and row["scenario"] is None)
    return other if overall["difference"]["mean"] > 0.0 else one


def team_of(learner: Learner, origin: dict[str, float | str]) -> fw.NetworkTeam:
    """Return the team whose brigades follow the ranking."""
    linear = [layer for layer in learner.ranking if isinstance(layer, nn.Linear)]
    layers = [(layer.weight.detach().numpy().T, layer.bias.detach().numpy()) for layer in linear]
    return fw.NetworkTeam.from_layers(layers, activation="tanh", provenance=origin)


def train(n_updates: int, seed: int) -> fw.NetworkTeam:
    """Learn from so many batches, and return the team."""
    torch.set_num_threads(1)
    scenarios, best, origin = fires(), None, {"method": "PPO", "updates": n_updates, "seed": seed}
    worlds = envs.worlds(scenarios, N_WORLDS, observation="targets", autoreset="SAME_STEP", seeds=seed)
    learner, seen = Learner(seed), seen_of(worlds.reset())
    recent: deque[float] = deque(maxlen=200)
    for n in range(1, n_updates + 1):
        progress = (n - 1) / n_updates
        batch, seen, scores = play(worlds, seen, learner)
        learner.update(batch, progress)
        recent.extend(scores)
        if n % 10 == 0 and progress > 0.5:
            team = team_of(learner, origin)
            best = team if best is None else better(best, team, scenarios)
        if n % 10 == 0:
            print(
                f"{progress:4.0%}  {n} updates, score of the last {len(recent)} episodes {np.mean(recent):.3f}",
                flush=True,
            )
    return team_of(learner, origin) if best is None else best


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Learn a team by PPO.")
    parser.add_argument("--updates", type=int, default=250, help="batches to learn from; 80 to 130 take a minute")
    parser.add_argument("--seed", type=int, default=1, help="of all random draws")
    parser.add_argument("-o", "--output", default="ppo.npz", help="the team file to write")
    given = parser.parse_args()
    train(given.updates, given.seed).save(given.output, force=True)
    print(f"wrote {given.output}")
