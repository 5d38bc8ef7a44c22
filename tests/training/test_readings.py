"""Every switch of what the paper leaves open changes a run or a training, which is replayed and verified as ever."""

from __future__ import annotations

import numpy as np
import pytest

import fireworld as fw
from fireworld.errors import ScenarioError
from fireworld.kernels.learning import UNTRIED
from fireworld.policy.kernel import each_another, from_rankings
from fireworld.scenario import load_scenario
from fireworld.simulation.built import build_scenario
from fireworld.training.curriculum import load_curriculum
from fireworld.training.log.reader import open_training
from fireworld.training.log.verify import verify_training
from fireworld.training.methods.sarsa import Sarsa, SarsaTrainer

CURRICULUM = """
stages:
  - name: alone
    cooperation: false
    base: quick
    set: {brigades.n: 1, steps: 40}
    vary: {fires.0.n_buildings: [1, 2]}
  - name: together
    cooperation: true
    scenarios: [quick, quick]
"""
SHORT = {"n_episodes_max": 8, "n_episodes_unchanged": 5}
OF_THE_METHOD = (
    {"untried": "ignored"},
    {"epsilon_first": 0.5},
    {"epsilon_schedule": "compounding"},
    {"epsilon_schedule": "training"},
    {"draw_last": True},
    {"reward": "own"},
)
OF_THE_SCENARIO = (
    {"flags": "target"},
    {"flags": "spraying"},
    {"flags_of": "all"},
    {"free_edges": "city"},
    {"free_edges": "streets"},
    {"easiest": "heated"},
    {"center_shares": [0.1, 0.3]},
    {"civilian_m": [50, 120]},
    {"volume_growth": 3},
)

RANKING = from_rankings(np.eye(1, 17, 13), own_targets=False)
"""Of the targets that the four actions name, values that of `easiest` most."""


@pytest.fixture
def curriculum(tmp_path):
    path = tmp_path / "small.yaml"
    path.write_text(CURRICULUM)
    return load_curriculum(path)


@pytest.mark.slow
@pytest.mark.parametrize("change", OF_THE_METHOD, ids=str)
def test_trainings_with_a_switch_are_recorded_and_verified(change, curriculum, tmp_path):
    path = tmp_path / "a.mcap"
    team = fw.train(curriculum, method=Sarsa(**SHORT, **change), record=path)
    assert team.digest != fw.train(curriculum, method=Sarsa(**SHORT)).digest
    assert team.provenance["method"].items() >= change.items()
    assert verify_training(open_training(path)).same
    assert open_training(path).team().digest == team.digest


@pytest.mark.slow
@pytest.mark.parametrize("change", OF_THE_METHOD, ids=str)
def test_a_training_with_a_switch_continues_from_its_checkpoint(change, curriculum):
    method = Sarsa(**SHORT, **change)
    whole, halves = SarsaTrainer(curriculum, method, seed=1), SarsaTrainer(curriculum, method, seed=1)
    assert len([*whole]) > 20
    for _, _ in zip(range(13), halves, strict=False):
        pass
    again = SarsaTrainer(curriculum, method, seed=1)
    again.restore(halves.team(), halves.state(), source="a")
    assert len([*again]) > 0
    assert again.team().digest == whole.team().digest


@pytest.mark.slow
@pytest.mark.parametrize("change", OF_THE_SCENARIO, ids=str)
def test_runs_of_scenarios_with_a_switch_are_replayed(change, tmp_path):
    path = tmp_path / "a.mcap"
    scenario = load_scenario("test-1").with_values({f"observation.{key}": value for key, value in change.items()})
    run = fw.run(scenario, policy="paper-cooperative", record=path)
    plain = fw.run("test-1", policy="paper-cooperative")
    assert run.digest != plain.digest
    assert fw.verify(path).same
    assert_asked_alike(scenario, fw.load_team("paper-cooperative").policy())


def assert_asked_alike(scenario, policy):
    """Asked one by one, the brigades see the same and go for the same as in the compiled episode."""
    built = build_scenario(scenario)
    whole, steps = built.world(seed=1), built.world(seed=1)
    whole.run(policy.for_brigades(4))

    class Asked(fw.Policy):
        def begin(self, city, n_brigades, seed):
            policy.begin(city, n_brigades, seed)

        def decide(self, observation):
            return policy.decide(observation)

    asked = Asked()
    asked.begin(None, 4, 1)
    while not (steps.terminated or steps.truncated):
        steps.step(asked)
    assert steps.outcome == whole.outcome


@pytest.mark.slow
@pytest.mark.parametrize("policy", [each_another(), RANKING], ids=["rules", "ranking"])
def test_policies_of_every_kind_go_for_heated_buildings_alike(policy, tmp_path):
    path = tmp_path / "a.mcap"
    scenario = load_scenario("test-1").with_values({"observation.easiest": "heated", "steps": 60})
    run = fw.run(scenario, policy=policy, record=path)
    assert run.digest != fw.run("test-1", policy=policy, steps=60).digest
    assert fw.verify(path).same
    assert_asked_alike(scenario, policy)


def test_the_schedules_of_epsilon():
    assert [Sarsa().epsilon(k, before=100) for k in range(3)] == [1.0, 0.9, 0.9 * 0.9]
    compounding = Sarsa(epsilon_schedule="compounding", epsilon_first=0.5)
    assert [round(compounding.epsilon(k, before=9), 9) for k in range(4)] == [0.5, 0.45, 0.3645, 0.2657205]
    assert Sarsa(epsilon_schedule="training").epsilon(1, before=2) == Sarsa().epsilon(3, before=0)


@pytest.mark.slow
def test_what_was_never_tried_is_ignored_until_its_first_visit_sets_it(curriculum):
    trainer = SarsaTrainer(curriculum.only(["alone"]), Sarsa(**SHORT, untried="ignored"), seed=1)
    assert (trainer.team().tables == UNTRIED).all()
    assert len([*trainer]) > 0
    team = trainer.team()
    tried = team.tables > UNTRIED
    assert tried.any()
    assert not tried.all()
    assert (np.abs(team.tables[tried]) < 1e9).all()
    assert (team.visits[~tried] == 0).all()
    seen = tried.any(axis=2)
    assert (np.take_along_axis(tried, team.tables.argmax(axis=2)[..., None], axis=2)[seen]).all()


def test_after_the_last_scenario_one_table_is_drawn_for_all(curriculum):
    drawn, kept = (
        SarsaTrainer(curriculum, Sarsa(n_episodes_max=2, draw_last=draw_last), seed=1) for draw_last in (True, False)
    )
    for trainer in (drawn, kept):
        assert len([*trainer]) == 8
    assert (drawn.team().tables == drawn.team().tables[0]).all()
    assert any((drawn.team().tables[0] == table).all() for table in kept.team().tables)


def test_thresholds_come_in_order():
    with pytest.raises(ScenarioError, match=r"observation.civilian_m: expected the lower threshold before the higher"):
        load_scenario("quick").with_values({"observation.civilian_m": [80, 30]})
    with pytest.raises(ScenarioError, match=r"observation.flags"):
        load_scenario("quick").with_values({"observation.flags": "smoke"})
