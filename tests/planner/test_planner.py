"""The planner as a policy: when it plans, what it tells, that it can be recorded and replayed, and that it is good."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from fireworld_recorder.diff import compare

import fireworld
from fireworld.errors import PolicyError
from fireworld.planning.planner import Planner, PlannerOptions
from fireworld.policy.asking import begin, name_of
from fireworld.policy.kernel import always
from fireworld.policy.names import find_policy, with_file
from fireworld.recording.replay import Replay
from fireworld.records import MemoryRecording
from fireworld.scenario import load_scenario
from fireworld.simulation.built import build_scenario
from fireworld.simulation.prepared_run import prepare_run
from fireworld.testing import PolicyConformance
from tests.simulation.town import town_world

SHORT = {"horizon": 6, "interval": 3}


@pytest.mark.slow
class TestConformance(PolicyConformance):
    def make_policy(self):
        return Planner(**SHORT)


@pytest.fixture(scope="module")
def built():
    return build_scenario(load_scenario("quick"))


def decisions_of(world, policy, *, n_steps):
    begin(policy, world.city_arrays, n_brigades=world.n_brigades, seed=world.seed)
    return [world.step(policy).decisions for _ in range(n_steps)]


@pytest.mark.parametrize("interval", [1, 3, 4])
def test_it_plans_once_a_period_and_keeps_to_the_plan(built, interval):
    made = decisions_of(built.world(seed=3), Planner(horizon=5, interval=interval), n_steps=12)
    asked = [step for step, decisions in enumerate(made, start=1) if any(each.action >= 0 for each in decisions)]
    planned = [step for step, decisions in enumerate(made, start=1) if any(each.q_values for each in decisions)]
    assert planned == [
        min(step for step in asked if step // interval == k) for k in sorted({s // interval for s in asked})
    ]
    for before, after, step in zip(made, made[1:], range(2, 13), strict=False):
        if step not in planned:
            assert all(
                old.action == new.action
                for old, new in zip(before, after, strict=True)
                if min(old.action, new.action) >= 0
            )


def test_its_q_values_say_why(built):
    made = decisions_of(built.world(seed=3), Planner(horizon=10, interval=1), n_steps=6)
    explained = [each for decisions in made for each in decisions if each.q_values is not None]
    assert len({each.q_values for each in explained}) > 1
    assert all(each.q_values[each.action] == max(each.q_values) for each in explained)


def test_a_brigade_that_comes_back_in_between_follows_the_plan():
    world, policy = town_world(seed=3, n_fires=12, n_brigades=2), Planner(horizon=5, interval=1000)
    begin(policy, world.city_arrays, n_brigades=2, seed=world.seed)
    world.state.brigades.refilling[0] = 1
    assert world.step(policy).decisions[0].action == -1
    world.state.brigades.refilling[0] = 0
    returned = world.step(policy).decisions[0]
    assert 0 <= returned.action < 4
    assert returned.q_values is None


@pytest.mark.parametrize("n_brigades", [1, 8])
def test_teams_of_any_size(n_brigades):
    made = decisions_of(town_world(seed=3, n_fires=12, n_brigades=n_brigades), Planner(**SHORT), n_steps=4)
    assert all(len(decisions) == n_brigades for decisions in made)


def test_a_recorded_run_of_it_replays(built):
    run = prepare_run(built, find_policy("planner:horizon=8"), seed=4, n_steps_max=20)
    recording = MemoryRecording(run.header, run.city, list(run))
    difference = compare(recording, Replay(recording))
    assert difference.same
    again = MemoryRecording(
        run.header, run.city, list(prepare_run(built, find_policy("planner:horizon=8"), seed=4, n_steps_max=20))
    )
    assert compare(recording, again).same


def test_it_does_better_than_every_fixed_action(built):
    def score(play):
        world = built.world(seed=4)
        play(world)
        return float(world.state.outcome.score[0])

    def plan(world):
        policy = Planner()
        while not (world.terminated or world.truncated):
            world.step(policy)

    fixed = [score(lambda world, a=action: world.run(always(a).for_brigades(world.n_brigades))) for action in range(4)]
    assert score(plan) >= max(fixed)


def test_names():
    assert find_policy("planner").policy.options == PlannerOptions(horizon=30, interval=4, rollouts=1)
    named = find_policy("planner:rollouts=2,horizon=50")
    assert named.name == "planner:rollouts=2,horizon=50"
    assert named.policy.options == PlannerOptions(horizon=50, interval=4, rollouts=2)
    names = ("planner", "planner:horizon=31", "planner:interval=5", "planner:rollouts=2")
    digests = {find_policy(name).digest for name in names}
    assert len(digests) == 4
    assert find_policy("planner:horizon=31").digest == find_policy("planner", parameters={"horizon": 31}).digest
    assert find_policy("planner:horizon=30").digest == find_policy("planner").digest == Planner().digest
    assert Planner().digest == "e24cd65692ed9895d57e9199d94e9ad1c06e3d8be068955e1133774f449f7188", (
        "a promise to old logs"
    )
    over = {find_policy(name).digest for name in ("planner:over=best", "planner:over=chief", "planner:milliseconds=5")}
    assert len(over - digests) == 3
    assert Planner(over=find_policy("best")).digest == find_policy("planner:over=best").digest


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("horizn=3", "planner: expected parameters horizon, .*, over, milliseconds, got 'horizn'; try horizon"),
        ("horizon=", "--policy: planner:horizon: expected a whole number from 1 to 1000, got ''"),
        ("horizon=0", "from 1 to 1000, got 0"),
        ("interval=-1", "planner:interval: expected a whole number from 1 to 1000, got -1"),
        ("rollouts=1.5", "got 1.5"),
        ("rollouts=true", "got True"),
        ("rollouts=[1]", r"got \[1\]"),
        ("rollouts=\u0663", "expected a whole number"),
        ("horizon=99999999999999999999", "from 1 to 1000"),
        ("horizon=3,horizon=4", "--policy: planner: expected every parameter once, got horizon twice"),
        ("milliseconds=-1", "planner:milliseconds: expected a whole number from 0 to 60000, got -1"),
        ("over=planner", "planner:over: expected a rule, a team or a network, which kernels follow, got 'planner'"),
        ("over=besst", "expected one of .*, got 'besst'; try best"),
        ("horizon=3,", "--policy: planner: expected parameters as in k=3,near=true, got 'horizon=3,'"),
    ],
)
def test_what_is_wrong_with_parameters(text, message):
    with pytest.raises(PolicyError, match=message) as caught:
        find_policy(f"planner:{text}")
    assert "\n" not in str(caught.value)


def test_a_module_of_that_name_is_still_ones_own(tmp_path, monkeypatch):
    source = "class Mine:\n    def decide(self, observation):\n        return None\n"
    (tmp_path / "planner.py").write_text(source)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", sys.path.copy())
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    assert name_of(find_policy("planner:Mine").policy) == "planner:Mine"
    del sys.modules["planner"]


def test_it_is_over_a_file_too(tmp_path, monkeypatch):
    content = (Path(fireworld.__file__).parent / "shipped/teams/best.npz").read_bytes()
    (tmp_path / "teams").mkdir()
    (tmp_path / "teams" / "mine.npz").write_bytes(content)
    monkeypatch.chdir(tmp_path)
    named = find_policy("planner:horizon=5,over=teams/mine.npz,interval=2")
    assert named.digest == find_policy("planner:over=best,horizon=5,interval=2").digest
    moved = with_file(named.name, lambda path: f"up/{path}")
    assert moved == "planner:horizon=5,over=up/teams/mine.npz,interval=2"
    assert with_file("planner:over=best", lambda path: f"up/{path}") == "planner:over=best"


def test_what_it_is_over_decides_where_no_action_is_better(built):
    """With a horizon of a step nothing tells the options apart, and the first is to follow."""
    best, over = decisions_of(built.world(seed=3), find_policy("best").policy, n_steps=1), []
    over = decisions_of(built.world(seed=3), Planner(horizon=1, over="best"), n_steps=1)
    assert [(each.action, each.target) for each in over[0]] == [(each.action, each.target) for each in best[0]]
    assert all(len(each.q_values) == 4 for each in over[0] if each.action >= 0)


def test_over_a_team_it_is_better_than_the_team(built):
    scores = {}
    for name in ("nearest-to-center", "planner:over=nearest-to-center,horizon=10"):
        last = list(prepare_run(built, find_policy(name), seed=4, n_steps_max=60))[-1]
        scores[name] = last.score.score
    assert scores["planner:over=nearest-to-center,horizon=10"] > scores["nearest-to-center"]
