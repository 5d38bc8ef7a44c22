"""One brigade among others: they do what their policy does in a run, in turn or at once, compiled or in Python."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from fireworld.arguments import ArgumentError
from fireworld.errors import LogError, PolicyError
from fireworld.policy.kernel import from_tables
from fireworld.policy.protocol import Policy
from tests.envs.extra import MISSING, needs_extra
from tests.envs.towns import HOT, SMALL, built, deadly, looked, pickled
from tests.simulation.town import POLICIES, policy_named

pytestmark = needs_extra()

if not MISSING:
    import gymnasium

    from fireworld import envs

CHOICES = ["in-turn", "simultaneous"]


class Asked(Policy):
    """Does what a policy of ours does, but kernels do not know it."""

    def __init__(self, policy):
        self.policy = policy

    def begin(self, city, n_brigades, seed):
        self.policy.begin(city, n_brigades, seed)

    def decide(self, observation):
        return self.policy.decide(observation)

    def keeps(self, brigade, last_action, step):
        return self.policy.keeps(brigade, last_action, step)


class Split(Policy):
    """One brigade does one thing, the others follow a policy."""

    def __init__(self, brigade, policy):
        self.brigade, self.policy = brigade, policy

    def begin(self, city, n_brigades, seed):
        self.policy.begin(city, n_brigades, seed)

    def decide(self, observation):
        return observation.step % 4 if observation.brigade == self.brigade else self.policy.decide(observation)

    def keeps(self, brigade, last_action, step):
        return brigade != self.brigade and self.policy.keeps(brigade, last_action, step)


@pytest.mark.parametrize("brigade", [0, 1, 2])
@pytest.mark.parametrize("choices", CHOICES)
@pytest.mark.parametrize("name", POLICIES)
def test_the_others_do_what_they_do_in_a_run(name, choices, brigade):
    """What is seen is what this brigade sees in a run with the same decisions; so is every state."""
    policy = policy_named(name)
    policies = {"compiled": policy, "asked": Asked(policy)}
    made = {
        how: envs.brigade(SMALL, brigade=brigade, others=others, seed=5, set={"choices": choices}, reward="stock")
        for how, others in policies.items()
    }
    for _ in range(2):
        seen = {how: env.reset()[0] for how, env in made.items()}
        seed = int(made["asked"].worlds.info()["seed"][0])
        world, split = built({**SMALL, "reward": "stock"}, choices).world(seed=seed), Split(brigade, policy)
        split.begin(world.city_arrays, world.n_brigades, seed)
        over = False
        while not over:
            action = (world.step_number + 1) % 4
            choices_made = world.step(split)
            for how, env in made.items():
                assert seen[how]["observation"].tolist() == choices_made.features[brigade].tolist()
                seen[how], reward, terminated, truncated, _ = env.step(action)
                assert reward == world.state.outcome.reward[4]
                assert (terminated, truncated) == (world.terminated, world.truncated)
                before, target = env.worlds.decisions()
                assert before[0].tolist() == world.state.brigades.action.tolist()
                assert target[0].tolist() == world.state.brigades.target.tolist()
                if terminated or truncated:
                    assert env.worlds.world(0).digest() == looked(world).digest()
            over = world.terminated or world.truncated


def test_kept_choices_are_kept_here_too():
    """A policy that chooses every third step; with two brigades of it and one of ours."""
    policy = from_tables(np.random.default_rng(3).normal(size=(3, 4320, 4)), commit=3)
    one, other = (envs.brigade(SMALL, brigade=1, others=others, seed=2) for others in (policy, Asked(policy)))
    for env in (one, other):
        env.reset()
    for step in range(9):
        assert one.step(step % 4)[1:4] == other.step(step % 4)[1:4]
        assert one.worlds.digest() == other.worlds.digest()


def test_a_brigade_that_dies_is_terminated(tmp_path):
    env = envs.brigade(deadly(tmp_path), others="random", seed=3, steps=60)
    for _ in range(3):
        env.reset()
        over = False
        while not over:
            _, reward, terminated, truncated, info = env.step(0)
            over = terminated or truncated
        dead = env.worlds.world(0).state.brigades.hp[0] == 0
        if dead:
            break
    assert dead
    assert (terminated, truncated) == (True, False)
    assert isinstance(reward, float)
    assert info["n_burning"] > 0
    assert not env.worlds.over
    with pytest.raises(ArgumentError, match="step: expected an episode in which brigade 0 lives"):
        env.step(0)
    env.reset()
    env.step(0)


def test_a_brigade_that_refills_may_do_nothing():
    env, idle = envs.brigade({**HOT, "parameters": {"brigades": {"tank_litres": 500}}}, brigade=1, seed=1), 0
    env.reset()
    for _ in range(12):
        seen, *_ = env.step(3)
        refills = bool(env.worlds.world(0).state.brigades.refilling[1])
        assert seen["action_mask"].tolist() == ([1, 0, 0, 0] if refills else [1, 1, 1, 1])
        assert env.action_masks().tolist() == (seen["action_mask"] == 1).tolist()
        idle += refills
    assert idle > 3


def test_others_are_found_as_policies_are():
    one, other = (envs.brigade(HOT, others=others, seed=1) for others in (lambda _: 3, "nearest-to-me"))
    for env in (one, other):
        env.reset()
        for _ in range(5):
            env.step(1)
    assert one.worlds.digest() == other.worlds.digest()
    with pytest.raises(PolicyError, match="expected one of easiest"):
        envs.brigade(HOT, others="nobody")


def test_mistakes_of_making():
    with pytest.raises(ArgumentError, match="brigade: expected a whole number from 0 to 1, got 2"):
        envs.brigade(HOT, brigade=2)
    with pytest.raises(ArgumentError, match="brigade: expected a whole number from 0 to 1, got 2"):
        envs.brigade([SMALL, HOT], brigade=2)
    assert envs.brigade([SMALL, HOT], brigade=1).brigade == 1


class Failing(Policy):
    """Fails when it is asked for some brigade in some step, as often as it is asked."""

    def __init__(self, brigade, step, times):
        self.at, self.times = (brigade, step), times

    def decide(self, observation):
        if (observation.brigade, observation.step) == self.at and self.times > 0:
            self.times -= 1
            raise ValueError("I cannot decide")
        return 1


@pytest.mark.parametrize("choices", CHOICES)
def test_a_policy_that_fails_after_this_brigade(choices):
    """Nothing has happened: the step can be tried again, and comes out as if nothing had been."""
    options = {"brigade": 1, "seed": 2, "set": {"choices": choices}}
    env, other = (
        envs.brigade(SMALL, others=Failing(2, 3, 1), **options),
        envs.brigade(SMALL, others=Failing(2, 99, 1), **options),
    )
    for one in (env, other):
        one.reset()
        one.step(0)
        one.step(2)
    before = env.worlds.digest()
    with pytest.raises(PolicyError, match="step 3, brigade 2: ValueError: I cannot decide"):
        env.step(3)
    assert env.worlds.digest() == before
    assert env.step(3)[1] == other.step(3)[1]
    assert env.worlds.digest() == other.worlds.digest()


def test_a_policy_that_fails_before_this_brigade():
    """The step is done, and the next one cannot begin: only a reset helps."""
    env = envs.brigade(SMALL, brigade=1, others=Failing(0, 3, 1), seed=2)
    env.reset()
    env.step(0)
    with pytest.raises(PolicyError, match="step 3, brigade 0: ValueError: I cannot decide"):
        env.step(0)
    with pytest.raises(ArgumentError, match="one under way, got one that is not; reset it"):
        env.step(0)
    env.reset()
    env.step(0)
    with pytest.raises(PolicyError, match="step 1, brigade 0"):
        envs.brigade(SMALL, brigade=1, others=Failing(0, 1, 9), seed=2).reset()


class Counting(Policy):
    """Remembers how often it began, and decides by how often it was asked."""

    def __init__(self):
        self.begun, self.asked = 0, 0

    def begin(self, city, n_brigades, seed):
        self.begun, self.asked = self.begun + 1, 0

    def decide(self, observation):
        self.asked += 1
        return self.asked * 7 % 4


def test_a_policy_begins_with_every_episode_and_is_copied_with_its_memory():
    policy = Counting()
    env = envs.brigade(HOT, others=policy, seed=1)
    env.reset()
    for action in (1, 2, 3):
        env.step(action)
    assert (policy.begun, policy.asked) == (1, 3)
    others = [copy.deepcopy(env), env.fork()]
    for action in (0, 2):
        results = [exact_step(one, action) for one in (env, *others)]
        assert results[0] == results[1] == results[2]
    assert policy.asked == 5, "a copy asks a copy"
    env.reset()
    assert (policy.begun, policy.asked) == (2, 0)
    again = pickled(env)
    assert exact_step(again, 1) == exact_step(env, 1)


def exact_step(env, action):
    seen, reward, terminated, truncated, _ = env.step(action)
    return seen["observation"].tolist(), reward, terminated, truncated, env.digest()


def test_a_snapshot_of_other_others_is_foreign():
    env = envs.brigade(HOT, others="chief", seed=1)
    env.reset()
    saved = env.snapshot()
    assert envs.brigade(HOT, others="chief").restore(saved)[1]["step"] == 0
    for other in (envs.brigade(HOT, others="random"), envs.brigade(HOT, brigade=1, others="chief")):
        with pytest.raises(LogError, match=r"snapshot: own: expected brigade \d and the same others"):
            other.restore(saved)


def test_it_is_made_by_its_name():
    env = gymnasium.make("fireworld/Brigade-v0", scenario="quick", brigade=1, others="chief", seed=3)
    assert env.unwrapped.brigade == 1
    _, info = env.reset()
    assert info["seed"] == envs.Seeds(3).seed(0, 0)
    assert env.spec.id == "fireworld/Brigade-v0"
    assert gymnasium.make("fireworld/Brigade-v0").unwrapped.worlds.scenarios[0].name == "default"
    several = gymnasium.make_vec("fireworld/Brigade-v0", num_envs=3, scenario="quick")
    assert len(set(several.reset(seed=1)[1]["seed"].tolist())) == 3
    assert len(set(several.reset()[1]["seed"].tolist())) == 3
