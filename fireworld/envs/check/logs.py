"""Every form, given the recorded decisions of a log, does what is recorded: states, rewards and outcome."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np

from fireworld import envs
from fireworld.envs.check.checks import Check
from fireworld.envs.many_worlds import Worlds
from fireworld.kernels.arrays import COUNTS, Array
from fireworld.outcome import outcome_of
from fireworld.policy.names import find_policy
from fireworld.policy.protocol import Action
from fireworld.recording.replay import recorded_scenario
from fireworld.records import Decisions, MemoryRecording, Recording, RunHeader, StepRecord
from fireworld.scenario import Scenario
from fireworld.simulation.built import build_scenario
from fireworld.simulation.placement import CITY_ATTACHMENT
from fireworld.simulation.prepared_run import prepare_run

OWN_TARGETS: Final = 64
"""So many burning buildings may a fire site have in a log that is followed."""
POLICIES: Final = ("best", "random", "planner")
Ending = tuple[bool, bool]
"""Whether a world is terminated, truncated."""


def checks_of_logs(scenario: Scenario) -> Iterator[Check]:
    """Yield checks that follow runs of a scenario."""
    for form in FOLLOWERS:
        for policy in POLICIES:
            if form != "brigade" or policy != "planner":  # it looks at the steps before
                yield Check(f"follows a log of {policy}", form, partial(_follow_new, form, scenario, policy))


def _follow_new(form: str, scenario: Scenario, policy: str) -> str:
    """Follow a run that is made for it."""
    choices = "in-turn" if form in {"turns", "brigade"} else "simultaneous"
    built = build_scenario(scenario.with_values({"choices": choices}))
    run = prepare_run(built, find_policy(policy), seed=5, n_steps_max=60)
    return f"{follow(form, MemoryRecording(run.header, run.city, list(run)))} steps"


def follow(form: str, run: Recording) -> int:
    """Raise AssertionError unless a form, given the decisions of a run, does what is recorded.

    Args:
        form: of FOLLOWERS; those in which all choose at once follow runs with `choices: simultaneous`, `turns` those in
            turn. `brigade` takes the decisions of the middle brigade; those of the others come from the policy.
        run: of a policy that is known by its name, if the form is `brigade`.

    Returns:
        How many steps were followed.

    Raises:
        LogError: the run was recorded without its scenario.
    """
    start, *records = run
    with TemporaryDirectory() as folder:
        follower = FOLLOWERS[form](_with_city(run.header, Path(folder)), run)
    _compare(start, follower.worlds)
    for record in records:
        reward, ending = follower.act(record)
        assert reward == record.rewards.total, f"step {record.step}: its reward is {reward}"
        assert ending == (record.terminated, record.truncated), f"step {record.step}: it ends otherwise"
        _compare(record, follower.worlds)
    assert follower.worlds.world(0).outcome == outcome_of(records[-1], run.city), "its outcome is another one"
    return len(records)


class Follower:
    """A form that acts as records say; world 0 is the one that is followed."""

    def __init__(self, scenario: Scenario, run: Recording) -> None:
        kind = scenario.reward if isinstance(scenario.reward, str) else scenario.reward.of
        options = {"reward": kind, "own_targets": OWN_TARGETS, "steps": run.header.n_steps_max}
        self.n_brigades, self.header = len(run.city.brigade_tank_litres), run.header
        self.env = self.make(scenario, options)
        self.worlds: Worlds = getattr(self.env, "worlds", self.env)
        self.begin(run.header.seed)

    def make(self, scenario: Scenario, options: Mapping[str, Any]) -> Any:
        """Make the form."""
        raise NotImplementedError

    def begin(self, world_seed: int) -> None:
        """Reset it to the episode of a world's seed."""
        self.env.reset(options={"world_seed": world_seed})

    def act(self, record: StepRecord) -> tuple[float, Ending]:
        """Do what is recorded of a step; return its reward and how it leaves the world."""
        raise NotImplementedError

    def actions(self, decisions: Decisions) -> list[int]:
        """Return the actions of the recorded decisions, (b,)."""
        own = self.worlds.observe()["own"][0]
        return [_action(decisions, brigade, own[brigade]) for brigade in range(self.n_brigades)]


class _OfWorlds(Follower):
    def make(self, scenario: Scenario, options: Mapping[str, Any]) -> Any:
        return envs.worlds(scenario, 2, **options)

    def begin(self, world_seed: int) -> None:
        self.env.reset(world_seeds=[world_seed, world_seed])

    def act(self, record: StepRecord) -> tuple[float, Ending]:
        done = self.env.step([self.actions(record.decisions)] * 2)
        return float(done.reward[0]), (bool(done.terminated[0]), bool(done.truncated[0]))


class _OfVector(Follower):
    def make(self, scenario: Scenario, options: Mapping[str, Any]) -> Any:
        return envs.TeamVectorEnv(2, scenario, **options)

    def begin(self, world_seed: int) -> None:
        self.env.reset(options={"world_seeds": [world_seed, world_seed]})

    def act(self, record: StepRecord) -> tuple[float, Ending]:
        _, reward, terminated, truncated, _ = self.env.step(np.array([self.actions(record.decisions)] * 2))
        return float(reward[0]), (bool(terminated[0]), bool(truncated[0]))


class _OfWholeTeam(Follower):
    def make(self, scenario: Scenario, options: Mapping[str, Any]) -> Any:
        return envs.WholeTeamEnv(scenario, **options)

    def act(self, record: StepRecord) -> tuple[float, Ending]:
        _, reward, terminated, truncated, _ = self.env.step(np.array(self.actions(record.decisions)))
        return reward, (terminated, truncated)


class _OfBrigade(Follower):
    def make(self, scenario: Scenario, options: Mapping[str, Any]) -> Any:
        return envs.brigade(scenario, brigade=self.n_brigades // 2, others=self.header.policy, **options)

    def act(self, record: StepRecord) -> tuple[float, Ending]:
        action = self.actions(record.decisions)[self.env.brigade]
        _, reward, terminated, truncated, _ = self.env.step(action)
        return reward, (terminated, truncated)


class _OfAgents(Follower):
    def act(self, record: StepRecord) -> tuple[float, Ending]:
        living = list(self.env.agents)
        actions = dict(zip(self.env.possible_agents, self.actions(record.decisions), strict=True))
        rewards, terminated, truncated = self.step({name: actions[name] for name in living})
        (reward,) = {rewards[name] for name in living}
        over = not self.env.agents
        return reward, (over and all(terminated.values()), over and any(truncated.values()))

    def step(self, actions: Mapping[str, int]) -> tuple[Mapping[str, float], Mapping[str, bool], Mapping[str, bool]]:
        """Let all agents act, and return their rewards, and whether they are terminated and truncated."""
        raise NotImplementedError


class _OfTeam(_OfAgents):
    def make(self, scenario: Scenario, options: Mapping[str, Any]) -> Any:
        return envs.team(scenario, **options)

    def step(self, actions: Mapping[str, int]) -> tuple[Mapping[str, float], Mapping[str, bool], Mapping[str, bool]]:
        _, rewards, terminated, truncated, _ = self.env.step(actions)
        return rewards, terminated, truncated


class _OfTurns(_OfAgents):
    def make(self, scenario: Scenario, options: Mapping[str, Any]) -> Any:
        return envs.turns(scenario, **options)

    def step(self, actions: Mapping[str, int]) -> tuple[Mapping[str, float], Mapping[str, bool], Mapping[str, bool]]:
        for name, action in actions.items():
            assert self.env.agent_selection == name, f"{self.env.agent_selection} is to choose, not {name}"
            self.env.step(action)
        states = self.env.rewards, self.env.terminations, self.env.truncations
        rewards, terminated, truncated = (dict(state) for state in states)
        while self.env.agents and self._left():
            self.env.step(None)
        return rewards, terminated, truncated

    def _left(self) -> bool:
        name = self.env.agent_selection
        return bool(self.env.terminations[name] or self.env.truncations[name])


FOLLOWERS: Final[Mapping[str, type[Follower]]] = {
    "worlds": _OfWorlds,
    "team": _OfTeam,
    "turns": _OfTurns,
    "brigade": _OfBrigade,
    "whole team": _OfWholeTeam,
    "vector": _OfVector,
}
"""By form."""


def _with_city(header: RunHeader, folder: Path) -> Scenario:
    """Return a recorded scenario; the city file that is attached to the recording is put into a folder for it."""
    scenario, content = recorded_scenario(header), header.attachments.get(CITY_ATTACHMENT)
    if content is None:
        return scenario
    (folder / CITY_ATTACHMENT).write_bytes(content)
    return scenario.with_values({"city.file": str(folder / CITY_ATTACHMENT)})


def _action(decisions: Decisions, brigade: int, own: Array) -> int:
    """Return the action of a brigade's recorded decision; `own` (k,): the buildings that it may name, -1 none."""
    action = int(decisions.action[brigade])
    if action != Action.OWN_TARGET:
        return max(action, 0)
    if own.max() < 0:  # it stays with the target that it keeps
        return 0
    places = np.flatnonzero(own == decisions.target[brigade])
    assert len(places) == 1, f"brigade {brigade} cannot name building {decisions.target[brigade]}"
    return int(Action.OWN_TARGET + places[0])


def _compare(record: StepRecord, worlds: Worlds) -> None:
    """Raise AssertionError unless world 0 is in the state that is recorded after a step."""
    world, info, (action, target) = worlds.world(0), worlds.info(), worlds.decisions()
    fire, brigades, later = world.state.fire, world.state.brigades, world.city_arrays.buildings
    burnt = np.ones(len(fire.energy), dtype=np.bool_)
    burnt[later.later_building[later.later_step == record.step + 1]] = False  # these are lit already
    n = len(record.decisions.action)
    pairs: dict[str, tuple[Any, Any]] = {
        "step": (info["step"][0], record.step),
        "energy": (fire.energy[burnt], record.buildings.energy[burnt]),
        "fieryness": (fire.fieryness[burnt], record.buildings.fieryness[burnt]),
        "water": (fire.water, record.buildings.water_litres),
        "x": (brigades.x / 1000.0, record.brigades.x_m),
        "y": (brigades.y / 1000.0, record.brigades.y_m),
        "tank": (brigades.tank, record.brigades.tank_litres),
        "activity": (brigades.activity, record.brigades.activity),
        "health of brigades": (brigades.hp, record.brigades.hp),
        "health of civilians": (world.state.civilians.hp, record.civilians.hp),
        "action": (action[0, :n], record.decisions.action),
        "target": (target[0, :n], record.decisions.target),
        "score": (info["score"][0], record.score.score),
        **{name: (info[name][0], getattr(record.score, name)) for name in COUNTS},
    }
    for name, (ours, recorded) in pairs.items():
        assert np.array_equal(ours, recorded), f"step {record.step}: {name} is not what is recorded"
