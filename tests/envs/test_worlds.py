"""Worlds: when episodes begin, what a step is worth, what is seen of teams of several sizes, and every mistake."""

from __future__ import annotations

import numpy as np
import pytest

import fireworld as fw
from fireworld import envs
from fireworld.arguments import ArgumentError
from fireworld.errors import ScenarioError
from fireworld.kernels.arrays import TOTAL
from fireworld.training.curriculum import find_curriculum
from fireworld.training.seeds import Seeds
from tests.envs.towns import HOT, LATER, SMALL, built, by_table, reference, table_policy


def act(worlds, seen):
    return worlds.step(by_table(seen["features"], seen["alive"]))


def equal(one, other):
    return one.keys() == other.keys() and all(np.array_equal(one[name], other[name]) for name in one)


class Stories:
    """What is seen and rewarded in each world, in the order in which it happens there."""

    def __init__(self, n):
        self.of = [[] for _ in range(n)]

    def add(self, which, seen, info, reward):
        for index in which:
            self.of[index].append((seen["features"][index].tobytes(), int(info["seed"][index]), float(reward[index])))


def stories_with(mode):
    """Let the tables play 120 steps in three worlds."""
    worlds, every, nothing = envs.worlds([SMALL, LATER], 3, autoreset=mode, seeds=3), range(3), np.zeros(3)
    seen, stories = worlds.reset(), Stories(3)
    stories.add(every, seen, worlds.info(), nothing)
    for _ in range(120):
        done = act(worlds, seen)
        seen, over = done.observation, np.flatnonzero(done.terminated | done.truncated).tolist()
        if done.final_observation is None:
            stories.add(every, seen, done.info, done.reward)
        else:
            stories.add(every, done.final_observation, done.final_info, done.reward)
            stories.add(over, seen, done.info, nothing)
            assert (done.info["step"][over] == 0).all()
        assert (done.final_observation is not None) == (mode is envs.Autoreset.SAME_STEP and bool(over))
        if mode is envs.Autoreset.DISABLED and over:
            with pytest.raises(ArgumentError, match="expected one under way, got one that is not; reset it"):
                worlds.step(np.zeros((3, 5), dtype=int))
            seen = worlds.reset(indices=over)
            stories.add(over, seen, worlds.info(), nothing)
    return stories.of


def test_all_three_ways_to_begin_anew_play_the_same_episodes():
    next_step, same_step, disabled = map(stories_with, envs.Autoreset)
    for one, two, three in zip(next_step, same_step, disabled, strict=True):
        n = min(len(one), len(two), len(three))
        assert one[:n] == two[:n] == three[:n]
        assert len({seed for _, seed, _ in one}) > 2


def test_worlds_that_begin_anew_take_no_reward_from_the_others():
    worlds, alone = envs.worlds(SMALL, 7, seeds=5), [envs.worlds(SMALL, seeds=5, first_worker=k) for k in range(7)]
    seen, seen_alone = worlds.reset(), [one.reset() for one in alone]
    for _ in range(60):
        done = act(worlds, seen)
        seen = done.observation
        for index, one in enumerate(alone):
            step = act(one, seen_alone[index])
            seen_alone[index] = step.observation
            assert step.reward[0] == done.reward[index]
            assert (step.terminated[0], step.truncated[0]) == (done.terminated[index], done.truncated[index])


@pytest.mark.parametrize("kind", ["score", "stock", "change"])
def test_rewards_are_those_of_the_world(kind):
    worlds = envs.worlds(SMALL, 2, reward=kind, seeds=8)
    seen, seed = worlds.reset(), int(worlds.info()["seed"][1])
    alone = built({**SMALL, "reward": "stock" if kind == "score" else kind}).world(seed=seed)
    policy = table_policy(3)
    policy.begin(alone.city_arrays, 3, seed)
    before = alone.state.outcome.score[0]
    while not (alone.terminated or alone.truncated):
        done = act(worlds, seen)
        seen = done.observation
        alone.step(policy)
        score, best, _ = alone.state.outcome.score
        wanted = (score / best - before / best) if kind == "score" else alone.state.outcome.reward[TOTAL]
        assert done.reward[1] == wanted
        before = score


def test_the_score_rewards_add_up_to_its_share():
    worlds = envs.worlds(HOT, 2, seeds=4, autoreset="disabled")
    seen, total = worlds.reset(), worlds.info()["score_share"]
    while not worlds.ended().any():
        done = act(worlds, seen)
        seen, total = done.observation, total + done.reward
    assert total == pytest.approx(done.info["score_share"], abs=1e-12)


def test_a_function_rewards():
    kept = []

    def saved(result, before):
        kept.append((result, before))
        return -result.counts[:, 0] + before

    worlds = envs.worlds(SMALL, 2, reward=saved, seeds=4)
    seen, share = worlds.reset(), worlds.info()["score_share"]
    for _ in range(4):
        done = act(worlds, seen)
        assert np.array_equal(done.reward, -done.info["n_burning"] + share)
        seen, share = done.observation, done.info["score_share"]
    result, before = kept[0]
    result.counts[:] = before[:] = 7  # copies
    assert (worlds.info()["n_burning"] != 7).all()
    assert [one.step.tolist() for one, _ in kept] == [[1, 1], [2, 2], [3, 3], [4, 4]]


def test_a_smaller_team_leaves_nothing_of_a_larger_one():
    """World 0 plays teams of 5, 2 and 5 brigades."""
    worlds = envs.worlds([LATER, HOT], 1, observation="graph", own_targets=3, seeds=1, steps=4)
    flags = envs.worlds([LATER, HOT], 1, seeds=1, steps=4)
    worlds.reset()
    flags.reset()
    for _ in range(10):
        seen = worlds.step(np.zeros((1, 5), dtype=int)).observation
        known = flags.step(np.zeros((1, 5), dtype=int))
        present = 2 if known.info["episode_number"][0] % 2 else 5
        assert not seen["alive"][0, present:].any()
        assert not seen["brigades"][0, present:].any()
        assert not known.observation["features"][0, present:].any()
        assert (seen["own"][0, present:] == -1).all()
        assert seen["action_mask"][0, present:].sum(axis=1).tolist() == [1] * (5 - present)
        assert seen["alive"][0, :present].all()


@pytest.mark.parametrize("observation", ["features", "targets", "graph"])
def test_what_is_seen_is_a_copy(observation):
    worlds, other = (envs.worlds(SMALL, 2, observation=observation, seeds=1, own_targets=2) for _ in range(2))
    seen = worlds.reset()
    other.reset()
    for array in [*seen.values(), *worlds.info().values(), *worlds.decisions()]:
        array[...] = 1
    assert equal(worlds.observe(), other.observe())
    one, two = (every.step(np.zeros((2, 3), dtype=int)) for every in (worlds, other))
    assert equal(one.observation, two.observation)
    assert np.array_equal(one.reward, two.reward)


def test_later_steps_and_other_settings():
    worlds = envs.worlds("quick", 2, steps=3, set={"brigades.n": 6}, seeds=1)
    worlds.reset()
    done = [worlds.step(np.full((2, 6), 3)) for _ in range(3)]
    assert [one.truncated.tolist() for one in done] == [[False] * 2, [False] * 2, [True] * 2]
    assert not done[-1].terminated.any()
    assert done[-1].observation["team"][:, 0].tolist() == [0.0, 0.0]
    assert worlds.scenarios[0].choices == "simultaneous"


def test_a_last_step_without_fire_terminates():
    """The fire is out in the last step of a run: it has not been cut off."""
    alone = next(world for seed in range(50) if (world := reference(SMALL, seed)).terminated)
    worlds = envs.worlds(SMALL, 1, steps=alone.step_number, autoreset="disabled")
    seen = worlds.reset()
    worlds._bound.draw_anew(0, alone.seed)
    while not worlds.ended()[0]:
        done = act(worlds, seen)
        seen = done.observation
    assert done.info["step"][0] == alone.step_number
    assert (done.terminated[0], done.truncated[0]) == (True, False)


def test_the_graph_of_a_city():
    worlds = envs.worlds([SMALL, LATER], 1, observation="graph")
    graph, other = worlds.graph(), worlds.graph(1)
    n = len(graph["x"])
    assert (len(graph["link_ptr"]), len(graph["near_ptr"]), len(graph["y"])) == (n + 1, n + 1, n)
    assert graph["link_building"].max() < n
    assert len(graph["link_share"]) == graph["link_ptr"][-1]
    assert ((graph["x"] >= -0.2) & (graph["x"] <= 1.2)).all()
    assert len(other["x"]) != n
    graph["link_ptr"][:] = 0
    assert worlds.graph()["link_ptr"].any()


def test_worlds_say_what_they_are():
    assert repr(envs.worlds([SMALL, HOT], 3)) == "<Worlds 3 of small, hot: 3 brigades, features>"


MISTAKES = {
    "names of observations": (lambda: envs.worlds(SMALL, observation="feature"), "one of features, targets, graph"),
    "no observation": (lambda: envs.worlds(SMALL, observation=3), "observation: expected one of"),
    "names of rewards": (lambda: envs.worlds(SMALL, reward="scores"), "or a function, got 'scores'; try score"),
    "rewards that cannot be looked up": (lambda: envs.worlds(SMALL, reward=[]), "reward: expected one of score"),
    "modes": (lambda: envs.worlds(SMALL, autoreset="sometimes"), "autoreset: expected one of Autoreset.NEXT_STEP"),
    "too many": (lambda: envs.worlds(SMALL, 2049), "n: expected a whole number from 1 to 2048, got 2049"),
    "no scenario": (lambda: envs.worlds([], 1), "scenarios: expected one at least, got 'none'"),
    "no step": (lambda: envs.worlds(SMALL, steps=0), "steps: expected a whole number from 1 to 100000, got 0"),
    "a seed": (lambda: envs.worlds(SMALL, seeds=-1), "seeds: expected a whole number from 0 to 4294967295, got -1"),
    "own targets": (lambda: envs.worlds(SMALL, own_targets=-1), "own_targets: expected a whole number"),
    "no room": (lambda: envs.worlds(SMALL, n_burning_max=0), "n_burning_max: expected a whole number from 1"),
    "no thread": (lambda: envs.worlds(SMALL, threads=0), "threads: expected a whole number from 1 to 64, got 0"),
    "a worker too many": (lambda: envs.worlds(SMALL, 2000, first_worker=100), "first_worker: expected .* to 48, got"),
    "in turn": (lambda: envs.worlds(SMALL, set={"choices": "in-turn"}), "choices: expected .*; try envs.turns"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_of_making(name):
    make, message = MISTAKES[name]
    with pytest.raises(ArgumentError, match=message):
        make()


def test_curricula_are_all_of_their_scenarios(tmp_path):
    learned = find_curriculum("paper")
    (tmp_path / "mine.yaml").write_text("stages: [{name: one, cooperation: true, scenarios: [quick, train-1]}]\n")
    for given, names in (
        (["quick", "paper"], ["quick", *(scenario.name for scenario in learned.scenarios)]),
        (tmp_path / "mine.yaml", ["quick", "train-1"]),
    ):
        worlds = envs.worlds(given, 2, set={"steps": 7})
        assert [scenario.name for scenario in worlds.scenarios] == names
        assert {scenario.steps for scenario in worlds.scenarios} == {7}
    assert len(envs.worlds(learned.only([learned.stages[-1].name])).scenarios) == len(learned.stages[-1].scenarios)


def test_scenarios_that_are_not_there():
    with pytest.raises(ScenarioError, match="expected the name of a scenario"):
        envs.worlds(["quick", "nowhere"])
    with pytest.raises(TypeError, match="unexpected keyword argument 'observations'"):
        envs.worlds(SMALL, observations="graph")


def actions(*rows, dtype=int):
    return np.array(rows, dtype=dtype)


STEPS = {
    "one world too few": (actions([0, 0, 0]), r"actions: expected whole numbers \(2, 3\), got int64 \(1, 3\)"),
    "fractions": (actions([0, 0, 0], [0, 0, 0], dtype=float), "expected whole numbers .*, got float64"),
    "truths": (actions([0, 0, 0], [0, 0, 0], dtype=bool), "expected whole numbers .*, got bool"),
    "ragged rows": ([[0, 0, 0], [0]], "actions: expected whole numbers"),
    "a name": ([["easiest"] * 3] * 2, "actions: expected whole numbers"),
    "too high": (actions([0, 0, 0], [0, 6, 0]), "world 1, brigade 1: expected an action from 0 to 5, got 6"),
    "too low": (actions([0, -1, 0], [0, 0, 0]), "world 0, brigade 1: expected an action from 0 to 5, got -1"),
    "immense": (actions([2**64 - 1, 0, 0], [0, 0, 0], dtype=np.uint64), "world 0, brigade 0: expected an action"),
}


@pytest.mark.parametrize("name", STEPS)
def test_mistakes_in_a_step_change_nothing(name):
    wrong, message = STEPS[name]
    worlds = envs.worlds(SMALL, 2, own_targets=2)
    worlds.reset()
    before = worlds.digest()
    with pytest.raises(ArgumentError, match=message):
        worlds.step(wrong)
    assert worlds.digest() == before
    assert not worlds.step(actions([0, 1, 2], [3, 0, 1])).terminated.any()


def test_what_the_mask_forbids():
    worlds = envs.worlds(HOT, 1, own_targets=100)
    seen = worlds.reset()
    n_own = int(seen["action_mask"][0, 1, 4:].sum())
    assert n_own == 8
    with pytest.raises(ArgumentError, match="brigade 1: expected an action that its action_mask allows, got 12"):
        worlds.step([[0, 4 + n_own]])
    worlds.step([[0, 4 + n_own - 1]])


def test_brigades_that_choose_nothing_may_be_given_anything():
    worlds = envs.worlds({**HOT, "parameters": {"brigades": {"tank_litres": 500}}}, 1, own_targets=40)
    seen, idle = worlds.reset(), 0
    for _ in range(20):
        mask = seen["action_mask"][0]
        idle += int((~mask[:, 1]).sum())
        seen = worlds.step(np.where(mask[:, 1], 0, 43)[None]).observation
        assert (worlds.decisions()[0][0] == np.where(mask[:, 1], 0, -1)).all()
    assert idle > 3


def test_nothing_is_stepped_before_a_reset():
    worlds = envs.worlds(SMALL, 2)
    with pytest.raises(ArgumentError, match="world 0: expected one under way, got one that is not; reset it"):
        worlds.step(actions([0, 0, 0], [0, 0, 0]))
    worlds.reset(indices=[0])
    with pytest.raises(ArgumentError, match="world 1: expected one under way"):
        worlds.step(actions([0, 0, 0], [0, 0, 0]))


@pytest.mark.parametrize(("indices", "got"), [([2], 2), ([-1], -1), (["a"], "'a'")])
def test_worlds_that_there_are_not(indices, got):
    worlds = envs.worlds(SMALL, 2)
    with pytest.raises(ArgumentError, match=f"index: expected a whole number from 0 to 1, got {got}"):
        worlds.reset(indices=indices)
    assert worlds.episode_number.tolist() == [-1, -1]


def test_resets_of_some():
    worlds = envs.worlds(SMALL, 3, seeds=7)
    worlds.reset()
    worlds.reset(indices=[1, 1])
    assert worlds.episode_number.tolist() == [0, 1, 0]
    worlds.reset(seed=9, indices=[2])
    assert worlds.seeds == Seeds(9)
    assert worlds.episode_number.tolist() == [0, 1, 0]
    wanted = [Seeds(7).seed(0, 0), Seeds(7).seed(1, 1), Seeds(9).seed(2, 0)]
    assert worlds.info()["seed"].tolist() == wanted
    assert worlds.reset(seed=7)["features"].shape == (3, 3, 8)
    assert worlds.info()["seed"].tolist() == [Seeds(7).seed(index, 0) for index in range(3)]


@pytest.mark.parametrize("wrong", [1.0, ["a", "b"], None])
def test_rewards_that_are_no_numbers(wrong):
    worlds = envs.worlds(SMALL, 2, reward=lambda *_: wrong)
    worlds.reset()
    with pytest.raises(ArgumentError, match=r"reward: expected \(2,\) numbers, got"):
        worlds.step(actions([0, 0, 0], [0, 0, 0]))


def test_a_reward_that_fails_takes_no_step_twice():
    """The step is done; worlds that ended in it are reset as ever."""

    def sometimes(result, before):
        return before if result.step[0] != 2 else "nothing"

    worlds = envs.worlds(SMALL, 2, reward=sometimes, steps=2)
    worlds.reset()
    worlds.step(actions([0, 0, 0], [0, 0, 0]))
    with pytest.raises(ArgumentError, match="reward: expected"):
        worlds.step(actions([0, 0, 0], [0, 0, 0]))
    assert worlds.ended().all()
    assert worlds.info()["step"].tolist() == [2, 2]
    worlds.step(actions([0, 0, 0], [0, 0, 0]))
    assert worlds.info()["step"].tolist() == [0, 0]


def test_a_scenario_in_which_nothing_burns_is_refused(monkeypatch):
    monkeypatch.setattr("fireworld.simulation.world.World.terminated", property(lambda _: True))
    with pytest.raises(ArgumentError, match="scenario: quick: expected one in which something burns, got 'none'"):
        envs.worlds("quick")


def test_scenarios_of_every_kind():
    scenario = fw.Scenario.from_dict(HOT)
    for given in (HOT, scenario, [scenario], "quick"):
        assert envs.worlds(given).n == 1
