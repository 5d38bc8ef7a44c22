"""Teams as PettingZoo has them: who sees what of whom, who leaves and when, and how an episode ends."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld.arguments import ArgumentError
from fireworld.errors import LogError, ScenarioError
from tests.envs.extra import MISSING, needs_extra
from tests.envs.towns import HOT, LATER, SMALL, deadly

pytestmark = needs_extra()

if not MISSING:
    import pettingzoo

    from fireworld import envs
    from fireworld.envs.snapshots import pack, unpack

DRY = {**HOT, "parameters": {"brigades": {"tank_litres": 500}}}
"""Tanks are empty after one step."""


def step_of(env, action=0):
    """Let all agents do one thing, and return what each of them then sees and gets."""
    if isinstance(env, pettingzoo.ParallelEnv):
        return env.step(dict.fromkeys(env.agents, action))
    agents, step = list(env.agents), env.worlds.info()["step"][0]
    for name in agents:
        assert env.agent_selection == name
        env.step(action)
    assert env.worlds.info()["step"][0] == step + 1
    states = env.rewards, env.terminations, env.truncations, env.infos
    results = {name: env.observe(name) for name in agents}, *(dict(state) for state in states)
    while env.agents and (env.terminations[env.agent_selection] or env.truncations[env.agent_selection]):
        env.step(None)
    return results


FORMS = ["team", "turns"]


def made(form, scenario, **options):
    env = getattr(envs, form)(scenario, **{"seed": 1, **options})
    env.reset()
    return env


@pytest.mark.parametrize("form", FORMS)
def test_a_brigade_that_dies_leaves(form, tmp_path):
    env, random = made(form, deadly(tmp_path), steps=40), np.random.default_rng(1)
    names, left = list(env.agents), []
    assert names == env.possible_agents == ["brigade_0", "brigade_1", "brigade_2"]
    while env.agents:
        before = list(env.agents)
        views, rewards, terminated, truncated, infos = step_of(env, int(random.integers(4)))
        assert before == list(views) == list(rewards) == list(terminated) == list(truncated) == list(infos)
        assert len(set(rewards.values())) == 1, "what it dies of is worth as much to all"
        hp = env.worlds.world(0).state.brigades.hp
        for name in before:
            dead = hp[names.index(name)] == 0
            over = infos[name]["step"] == 40
            assert terminated[name] == dead
            assert truncated[name] == (over and not dead)
            assert (name in env.agents) == (not dead and not over)
            if dead:
                left.append((name, infos[name]["step"]))
                assert views[name]["action_mask"].tolist() == [1, 0, 0, 0]
    assert len({name for name, _ in left}) == len(left) >= 2
    assert len({step for _, step in left}) >= 2


@pytest.mark.parametrize("form", FORMS)
def test_a_brigade_that_refills_stays(form):
    env, idle = made(form, DRY), 0
    for _ in range(12):
        views, _, _, _, infos = step_of(env, 3)
        assert list(views) == env.agents == env.possible_agents
        for name, view in views.items():
            brigade = env.possible_agents.index(name)
            refills = env.worlds.world(0).state.brigades.refilling[brigade]
            assert view["action_mask"].tolist() == ([1, 0, 0, 0] if refills else [1, 1, 1, 1])
            assert view["action_mask"].tolist() == infos[name]["action_mask"].tolist()
            idle += int(refills)
    assert idle > 6


def test_in_turn_each_sees_what_those_before_it_chose():
    env = made("turns", HOT)

    def flags(name):
        return env.observe(name)["observation"][4:].tolist()

    assert flags("brigade_1") == [0, 0, 0, 0]
    env.step(2)
    assert env.agent_selection == "brigade_1"
    assert flags("brigade_1") == [0, 0, 1, 0]
    assert env.last()[0]["observation"][4:].tolist() == [0, 0, 1, 0]
    env.step(1)
    assert env.agent_selection == "brigade_0"
    assert (flags("brigade_0"), flags("brigade_1")) == ([0, 1, 0, 0], [0, 0, 1, 0])
    env.step(3)
    assert (flags("brigade_0"), flags("brigade_1")) == ([0, 1, 0, 0], [0, 0, 0, 1])


def test_at_once_each_sees_what_the_others_did_in_the_last_step():
    env = made("team", HOT)
    views, *_ = env.step({"brigade_0": 2, "brigade_1": 1})
    assert views["brigade_0"]["observation"][4:].tolist() == [0, 1, 0, 0]
    assert views["brigade_1"]["observation"][4:].tolist() == [0, 0, 1, 0]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("kind", ["features", "targets", "graph"])
def test_the_last_observation_is_of_the_end(form, kind):
    """Cut off or done: what is seen last is what a world shows that was stepped the same way."""
    ends = set()
    for seed in range(6):
        env = made(form, SMALL, observation=kind, seed=seed)
        while env.agents:
            views, _, terminated, truncated, infos = step_of(env, 0)
        for name in env.possible_agents:
            brigade = env.possible_agents.index(name)
            seen, (ended, cut) = env.worlds.observe(), (terminated[name], truncated[name])
            mine = views[name]["observation"]
            shown = mine["buildings"] if kind == "graph" else mine
            wanted = seen["buildings"][0] if kind == "graph" else seen[kind][0, brigade]
            assert np.array_equal(shown, wanted)
            assert ended != cut
            assert infos[name]["n_burning"] == 0 if ended else infos[name]["step"] == 25
        ends.add((ended, cut))
    assert ends == {(True, False), (False, True)}


@pytest.mark.parametrize("form", FORMS)
def test_an_episode_is_played_again_by_its_world_seed(form):
    env, again = made(form, SMALL), made(form, SMALL, seed=2)
    step_of(env)
    while env.agents:
        last = step_of(env)
    seed = last[-1]["brigade_0"]["seed"]
    again.reset(options={"world_seed": seed})
    while again.agents:
        other = step_of(again)
    assert other[-1]["brigade_0"]["seed"] == seed
    assert again.worlds.digest() == env.worlds.digest()
    assert other[1] == last[1]
    env.reset()
    assert env.worlds.info()["seed"][0] != seed


@pytest.mark.parametrize("form", FORMS)
def test_without_a_seed_no_two_are_the_same(form):
    one, other = (getattr(envs, form)(SMALL) for _ in range(2))
    one.reset()
    other.reset()
    assert one.worlds.info()["seed"] != other.worlds.info()["seed"]
    for env in (one, other):
        env.reset(seed=3)
    assert one.worlds.info()["seed"] == other.worlds.info()["seed"]


@pytest.mark.parametrize("form", FORMS)
def test_several_scenarios_are_played_in_turn(form):
    env = made(form, [LATER, HOT], steps=2)
    assert len(env.possible_agents) == 5
    for n in (5, 2, 5):
        assert env.agents == [f"brigade_{k}" for k in range(n)]
        for _ in range(2):
            views, *_ = step_of(env)
        assert len(views) == n
        assert env.agents == []
        env.reset()


@pytest.mark.parametrize("form", FORMS)
def test_own_targets(form):
    env = made(form, HOT, observation="graph", own_targets=9)
    views = env._views(env.worlds.observe(), env.agents)
    own = views["brigade_0"]["observation"]["own"]
    assert own.tolist()[8:] == [-1]
    assert views["brigade_0"]["action_mask"].tolist() == [1] * 12 + [0]
    _, _, _, _, infos = step_of(env, 4 + 5)
    assert env.worlds.decisions()[1][0].tolist() == [own[5]] * 2
    assert set(infos["brigade_0"]["own"].tolist()) >= set(own.tolist()) - {-1} or infos["brigade_0"]["n_burning"] < 8


def test_what_is_known_besides():
    env = made("team", SMALL, seed=4)
    *_, infos = step_of(env)
    info = infos["brigade_2"]
    assert {key: type(value) for key, value in info.items() if key != "action_mask"} == {
        "seed": int, "episode_number": int, "step": int, "score": float, "score_share": float, "n_burning": int,
        "n_water_damaged": int, "n_burnt_out": int, "n_civilians_alive": int,
    }  # fmt: skip
    assert info["seed"] == envs.Seeds(4).seed(0, 0)
    assert (info["episode_number"], info["step"]) == (0, 1)


def test_all_that_a_team_sees():
    for kind, n in (("features", 24), ("targets", 3 * 52), ("graph", 18 + 64 * 7)):
        env = made("team", SMALL, observation=kind)
        assert env.state().shape == env.state_space.shape == (6 + n,)
        assert env.state() in env.state_space


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"brigade_0": 0}, "step: brigade_1: expected an action, got 'none'"),
        ({"brigade_0": 0, "brigade_1": 4}, "brigade 1: expected an action from 0 to 3, got 4"),
        ({"brigade_0": 0, "brigade_1": 1.5}, "expected whole numbers"),
        ({"brigade_0": 0, "brigade_1": None}, "expected whole numbers"),
        ({"brigade_0": 0, "brigade_1": 0, "brigade_2": 0}, "agents that live: brigade_0, brigade_1, got 'brigade_2'"),
        ({"brigade_0": 0, "brigade1": 0}, "got 'brigade1'; try brigade_1"),
    ],
)
def test_mistakes_in_a_step_at_once(wrong, message):
    env = made("team", HOT)
    before = env.digest()
    with pytest.raises(ArgumentError, match=message):
        env.step(wrong)
    assert env.digest() == before


@pytest.mark.parametrize(("wrong", "got"), [(4, "4"), (-1, "-1"), (1.5, "1.5"), (None, "None"), ("easiest", "'easi")])
def test_mistakes_in_a_turn(wrong, got):
    env = made("turns", HOT)
    env.step(1)
    before = env.digest()
    with pytest.raises(ArgumentError, match=f"brigade 1: action: expected a whole number from 0 to 3, got {got}"):
        env.step(wrong)
    assert (env.digest(), env.agent_selection) == (before, "brigade_1")


def test_what_a_mask_forbids_in_a_turn():
    env = made("turns", HOT, own_targets=20)
    with pytest.raises(ArgumentError, match="brigade 0: expected an action that its action_mask allows, got 12"):
        env.step(12)


@pytest.mark.parametrize("form", FORMS)
def test_an_episode_that_is_over(form):
    env = getattr(envs, form)(SMALL, steps=1)
    for _ in range(2):
        with pytest.raises(ArgumentError, match="reset it"):
            env.step({} if form == "team" else 0)
        env.reset()
        step_of(env)
        assert env.agents == []


def test_agents_that_have_left_do_nothing():
    env = made("turns", HOT, steps=1)
    for _ in range(2):
        env.step(0)
    with pytest.raises(ArgumentError, match="brigade_0: expected None of an agent that has left, got 0"):
        env.step(0)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"seed": -1}, ArgumentError, "seed: expected a whole number"),
        ({"worker": 2048}, ArgumentError, "worker: expected a whole number from 0 to 2047"),
        ({"render_mode": "human"}, ArgumentError, "render_mode: expected None or one of rgb_array, rerun, got 'human'"),
        ({"view_url": "rerun+http://127.0.0.1:9876/proxy"}, ArgumentError, "view_url: expected None without"),
        ({"set": {"brigades.n": 0}}, ScenarioError, "brigades.n: expected"),
    ],
)
def test_mistakes_of_making(form, options, error, message):
    with pytest.raises(error, match=message):
        getattr(envs, form)(SMALL, **options)


@pytest.mark.parametrize(("form", "choices"), [("team", "in-turn"), ("turns", "simultaneous")])
def test_other_choices_are_another_form(form, choices):
    other = {"team": "turns", "turns": "team"}[form]
    with pytest.raises(ArgumentError, match=f"choices: expected .*, got '{choices}'; try envs.{other}"):
        getattr(envs, form)(SMALL, set={"choices": choices})


def test_wrong_world_seeds():
    for form in FORMS:
        with pytest.raises(ArgumentError, match="world_seeds: expected a whole number"):
            getattr(envs, form)(SMALL).reset(options={"world_seed": -1})


def test_a_turn_half_done_is_kept():
    """The first brigade has chosen when the state is saved: the second sees it, and the step comes out the same."""
    env, other = made("turns", SMALL), made("turns", SMALL, seed=77)
    env.step(2)
    saved, digest = env.snapshot(), env.digest()
    other.restore(saved)
    assert (other.agent_selection, other.digest()) == ("brigade_1", digest)
    for one in (env, other):
        for action in (1, 3, 0, 0):
            one.step(action)
    assert env.digest() == other.digest()
    assert env.infos["brigade_0"]["step"] == other.infos["brigade_0"]["step"] == 1


def test_snapshots_of_turns_that_make_no_sense():
    env = made("turns", SMALL)
    head, held = unpack("fireworld-turns/1", env.snapshot())
    own = head["own"]
    odd = [None, [], {}, {**own, "agents": ["brigade_7"]}, {**own, "agent_selection": "x"}, {**own, "rewards": {}}]
    odd += [{**own, "terminations": dict.fromkeys(env.agents, 1)}, {**own, "agents": 3}]
    for wrong in odd:
        with pytest.raises(LogError, match="snapshot: own: expected agents of these scenarios"):
            env.restore(pack("fireworld-turns/1", {"own": wrong}, held))
    with pytest.raises(LogError, match="snapshot: worlds: expected the bytes of worlds"):
        env.restore(pack("fireworld-turns/1", {"own": own}, {}))
    with pytest.raises(LogError, match="snapshot: format: expected fireworld-turns/1, got 'fireworld-team/1'"):
        env.restore(made("team", SMALL).snapshot())
    with pytest.raises(LogError, match="snapshot: own: expected nothing"):
        made("team", SMALL).restore(pack("fireworld-team/1", {"own": own}, held))
