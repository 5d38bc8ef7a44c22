"""Kept targets: a brigade stays with what it chose while its target burns, whoever lets it decide."""

from __future__ import annotations

import numpy as np
import pytest

import fireworld as fw
from fireworld.errors import LogError
from fireworld.policy.kernel import given
from fireworld.scenario import Scenario
from fireworld.simulation.built import BuiltScenario, build_scenario
from fireworld.simulation.state import named_arrays
from fireworld.simulation.world import World
from fireworld.training.log.reader import open_training
from fireworld.training.log.verify import verify_training
from tests.simulation.town import POLICIES, Asked, begin, play, policy_named

TWO_FIRES = {
    "name": "two-fires",
    "city": {"generated": {"columns": 9, "rows": 7, "seed": 5, "hydrant_share": 0.5}},
    "fires": [{"at": [0.1, 0.1], "n_buildings": 7}, {"at": [0.9, 0.9], "n_buildings": 5}],
    "civilians": {"n": 4, "seed": 3},
    "brigades": {"n": 4, "targets": "kept"},
    "parameters": {"brigades": {"tank_litres": 9000, "power_litres": 3000}},
    "steps": 60,
}

CURRICULUM = """
stages:
  - name: together
    cooperation: true
    base: quick
    set: {brigades.targets: kept}
    vary: {steps: [30, 40]}
"""
FEW = {
    "paper": {"n_episodes_max": 8, "n_episodes_unchanged": 5},
    "targets": {"n_lessons": 2, "n_fights": 4},
}


def built_with(**values: object) -> BuiltScenario:
    return build_scenario(Scenario.from_dict(TWO_FIRES).with_values(values))


def assert_same_state(world: World, other: World) -> None:
    assert world.step_number == other.step_number
    for (name, array), (_, expected) in zip(named_arrays(world.state), named_arrays(other.state), strict=True):
        assert array.tobytes() == expected.tobytes(), name


@pytest.mark.parametrize("choices", ["in-turn", "simultaneous"])
@pytest.mark.parametrize("name", POLICIES)
def test_whole_episodes_single_steps_questions_and_given_decisions_agree(name, choices):
    built, policy = built_with(choices=choices), policy_named(name)
    whole, stepped, asked, told = (built.world(seed=6) for _ in range(4))
    whole.run(policy.for_brigades(4))
    play(stepped, policy)
    assert_same_state(stepped, whole)
    made, asking = [], Asked(begin(policy, asked))
    while not (asked.terminated or asked.truncated):
        asked.step(asking)
        made.append((asked.state.brigades.action.copy(), asked.state.brigades.target.copy()))
    assert_same_state(asked, whole)
    team = given(4)
    bound = told.bound(team)
    for action, target in made:
        team.action[:], team.table_of[:] = np.maximum(action, 0), target
        told.step_number = bound.run(told.seed, told.step_number, told.step_number + 1)
    assert told.digest() == whole.digest()


def test_a_target_is_kept_while_it_burns_and_no_longer():
    """A random team would leave it at once; a brigade that refills lets go."""
    world, policy = built_with().world(seed=6), policy_named("random")
    kept = renamed = let_go = 0
    while not (world.terminated or world.truncated):
        ahead = world.copy()
        ahead.look()
        before, burning = ahead.state.brigades, ahead.state.sites.place.copy()
        numbers, asked = ahead.state.sites.number, [seen is not None for seen in world.observe()]
        world.step(policy)
        for brigade, (action, target) in enumerate(zip(before.action, before.target, strict=True)):
            made = world.state.brigades.action[brigade], world.state.brigades.target[brigade]
            refills = before.refilling[brigade] or before.hp[brigade] <= 0
            there = target >= 0 and burning[target] >= 0 and numbers[burning[target]] == before.site[brigade]
            if refills or made[0] < 0:
                let_go += int(target >= 0)
                assert made == (-1, -1)
            elif action >= 0 and there:
                assert made == (action, target)
                assert not asked[brigade]
                kept += 1
            else:
                assert asked[brigade]
                renamed += 1
    assert min(kept, renamed, let_go) > 0


def test_a_run_is_recorded_and_replayed_and_a_kept_decision_cannot_be_changed(tmp_path):
    path = tmp_path / "a.mcap"
    scenario = Scenario.from_dict(TWO_FIRES)
    run = fw.run(scenario, policy="paper-cooperative", record=path)
    assert run.digest != fw.run(scenario.with_values({"brigades.targets": "anew"}), policy="paper-cooperative").digest
    assert fw.verify(path).same
    log = fw.open_log(path)
    targets = np.array([log.step(step).decisions.target for step in range(1, len(log))])
    step = next(row for row in range(1, len(targets)) if targets[row, 0] == targets[row - 1, 0] >= 0)
    with pytest.raises(LogError, match=r"stays with building .* while that burns; brigades\.targets is kept"):
        fw.fork(path, at=step, decide={0: "nearest-to-me"})


@pytest.mark.slow
@pytest.mark.parametrize("method", ["paper", "targets"])
def test_a_training_is_verified(method, tmp_path):
    """The tables learn from choices that last; so does the network, whose choices last by themselves."""
    curriculum = tmp_path / "small.yaml"
    curriculum.write_text(CURRICULUM)
    path = tmp_path / "a.mcap"
    team = fw.train(curriculum, method=method, set=FEW[method], record=path)
    assert verify_training(open_training(path)).same
    assert open_training(path).team().digest == team.digest
