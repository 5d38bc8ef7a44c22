"""Rollouts: the world's own rules, on luck that is not the run's, without a trace in the world."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fireworld.planning.planner import BURNING_COST, FIRST_SEED, FOLLOW, Forecast, PlannerOptions
from fireworld.policy.kernel import KernelPolicy, always
from fireworld.policy.names import find_policy
from fireworld.policy.protocol import Decision
from fireworld.simulation.state import copy_world, named_arrays
from tests.simulation.town import play, town_world

ASSIGNMENT = (2, 3, 1)


class Asked:
    """Remembers the observation of one step; takes action 3."""

    def __init__(self, step):
        self.step, self.moment, self.before = step, None, None

    def decide(self, observation):
        if observation.step == self.step and self.moment is None:
            self.moment, self.before = observation, copy_world(observation.world)
        return Decision(3)


def moment_of(world, step):
    asked = Asked(step)
    while world.step_number < step:
        world.step(asked)
    assert asked.moment is not None, "nobody was asked in that step"
    for (_, array), (_, held) in zip(named_arrays(world.state), named_arrays(asked.before), strict=True):
        array[...] = held  # back to where the observation was made
    return asked.moment


@pytest.mark.parametrize(("step", "horizon"), [(1, 1), (1, 25), (3, 12)])
def test_a_rollout_is_what_the_world_would_do_with_that_luck(step, horizon):
    world = town_world(seed=3)
    forecast = Forecast(moment_of(world, step), copy_world(world.state), PlannerOptions(horizon, 1, 1))
    twin = town_world(seed=3, n_steps_max=step - 1 + horizon)
    play(twin, always(3), to=step - 1)
    twin.seed = FIRST_SEED + step
    twin.run(KernelPolicy((0,) * 3, ASSIGNMENT, (0,) * 3, np.zeros((1, 1, 4))).for_brigades(3))
    outcome = twin.state.outcome
    assert forecast.value(ASSIGNMENT) == outcome.score[0] / outcome.score[1] - BURNING_COST * outcome.counts[0]


def test_the_value_is_the_mean_over_rollouts_of_other_luck():
    world = town_world(seed=3, n_fires=8)
    moment = moment_of(world, 2)
    room = copy_world(world.state)
    mean = Forecast(moment, room, PlannerOptions(20, 1, 2)).value(ASSIGNMENT)
    parts = []
    for rollout in range(2):
        twin = town_world(seed=3, n_fires=8, n_steps_max=21)
        play(twin, always(3), to=1)
        twin.seed = FIRST_SEED + 2 * 2 + rollout
        twin.run(KernelPolicy((0,) * 3, ASSIGNMENT, (0,) * 3, np.zeros((1, 1, 4))).for_brigades(3))
        outcome = twin.state.outcome
        parts.append(float(outcome.score[0] / outcome.score[1] - BURNING_COST * outcome.counts[0]))
    assert parts[0] != parts[1]
    assert mean == (parts[0] + parts[1]) / 2


def test_rollouts_leave_the_world_alone():
    world = town_world(seed=3)
    moment = moment_of(world, 2)
    before = copy_world(world.state)
    forecast = Forecast(moment, copy_world(world.state), PlannerOptions(20, 1, 2))
    forecast.value(ASSIGNMENT)
    forecast.value((0, 0, 0))
    for (name, array), (_, held) in zip(named_arrays(world.state), named_arrays(before), strict=True):
        assert np.array_equal(array, held), name


def test_a_value_depends_neither_on_what_was_tried_before_nor_on_the_seed_of_the_run():
    world = town_world(seed=3)
    moment = moment_of(world, 1)
    fresh = Forecast(moment, copy_world(world.state), PlannerOptions(20, 1, 1))
    used = Forecast(replace(moment, seed=12345), copy_world(world.state), PlannerOptions(20, 1, 1))
    used.value((0, 0, 0))
    used.value((1, 1, 1))
    assert used.value(ASSIGNMENT) == fresh.value(ASSIGNMENT) == used.value(ASSIGNMENT)


def test_brigades_follow_a_policy_in_rollouts():
    world = town_world(seed=3)
    moment, room, options = moment_of(world, 2), copy_world(world.state), PlannerOptions(12, 1, 1)
    plain, over_me = Forecast(moment, room, options), Forecast(moment, room, options, always(3))
    assert over_me.value((2, FOLLOW, 1)) == plain.value((2, 3, 1))
    best = find_policy("best").policy
    twin = town_world(seed=3, n_steps_max=13)
    play(twin, always(3), to=1)
    twin.seed = FIRST_SEED + 2
    twin.run(best.for_brigades(3))
    outcome = twin.state.outcome
    value = Forecast(moment, room, options, best).value((FOLLOW,) * 3)
    assert value == outcome.score[0] / outcome.score[1] - BURNING_COST * outcome.counts[0]
