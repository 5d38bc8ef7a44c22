"""SARSA over the features of targets: what is learned, that it is the same again, and that it is worth it."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld.errors import TrainingError
from fireworld.executors import threads
from fireworld.policy.teams.network_layers import OF_OTHERS, pack
from fireworld.policy.teams.network_team import NetworkTeam
from fireworld.policy.teams.team import load_team
from fireworld.simulation.built import build_scenario
from fireworld.training.curriculum import load_curriculum
from fireworld.training.log.reader import open_training
from fireworld.training.methods.targets import Targets
from fireworld.training.train import train

SHORT = {"n_lessons": 3, "n_fights": 4, "n_steps_max": 12, "hidden": 3}
FIRES = """\
stages:
  - name: fires
    cooperation: true
    base: test-2
    set: {steps: 60, brigades.n: 4}
    vary: {fires.0.n_buildings: [8, 10], civilians.seed: [1, 2]}
"""


@pytest.fixture(scope="module")
def fires(tmp_path_factory):
    path = tmp_path_factory.mktemp("targets") / "fires.yaml"
    path.write_text(FIRES)
    return load_curriculum(path)


def trained(fires, *, seed=1, **settings):
    trainer = Targets(**{**SHORT, **settings}).trainer(fires, seed=seed)
    list(trainer)
    return trainer


def numbers(trainer):
    team = trainer.team()
    return pack(team.layers, team.activations, team.features).number


def test_the_same_seed_gives_the_same_team(fires):
    one, same, other = trained(fires), trained(fires), trained(fires, seed=2)
    assert one.team().digest == same.team().digest != other.team().digest
    assert (numbers(one) == one.progress.numbers).all()


def test_it_is_the_same_on_every_machine(fires):
    assert trained(fires).team().digest[:16] == "124f9f56a575e2f4"


def test_a_training_goes_on_where_it_stood(fires):
    whole = trained(fires)
    first = Targets(**SHORT).trainer(fires, seed=1)
    lessons = first.run(threads(1))
    next(lessons)
    second = Targets(**SHORT).trainer(fires, seed=1)
    second.restore(first.team(), first.state(), source="t.npz")
    list(second)
    assert second.team().digest == whole.team().digest
    assert (second.progress.state_weights == whole.progress.state_weights).all()


@pytest.mark.parametrize("cooperation", [True, False])
@pytest.mark.parametrize("around", [True, False])
def test_what_it_reads(fires, around, cooperation):
    team = trained(fires, around=around, cooperation=cooperation).team()
    assert (
        len(team.features)
        == {(True, True): 26, (True, False): 21, (False, True): 13, (False, False): 10}[around, cooperation]
    )
    assert OF_OTHERS.isdisjoint(team.features) != cooperation
    assert team.widths == (len(team.features), 3, 1)
    assert team.own_targets


def test_without_a_hidden_layer_the_value_is_one_sum(fires):
    assert trained(fires, hidden=0).team().widths == (26, 1)


def test_rates_fall_in_even_steps(fires):
    trainer = trained(fires)
    assert [trainer.epsilon(k) for k in range(3)] == pytest.approx([0.3, 0.2, 0.1])
    assert [trainer.share_left(k) for k in range(3)] == pytest.approx([1.0, 2 / 3, 1 / 3])


def test_who_stops_leaves_the_lesson_as_if_it_had_not_begun(fires):
    workers, trainer = threads(1), Targets(**SHORT).trainer(fires, seed=1)
    lessons = trainer.run(workers)
    next(lessons)
    before = trainer.team().digest
    workers.stop.set()
    assert list(lessons) == []
    assert trainer.team().digest == before


@pytest.mark.parametrize(
    ("broken", "wanted"),
    [
        ({"lesson": np.array([9])}, "lesson: expected a whole number up to 3"),
        ({"lesson": np.array([1.0])}, "lesson: expected a whole number up to 3"),
        ({"state_weights": np.zeros(3)}, "state_weights: expected 30 numbers, got float64"),
        ({"state_weights": np.full(30, np.nan)}, "state_weights"),
    ],
)
def test_a_checkpoint_that_makes_no_sense(fires, broken, wanted):
    trainer = trained(fires)
    with pytest.raises(TrainingError, match="t.npz.*" + wanted.replace("(", r"\(")):
        trainer.restore(trainer.team(), {**trainer.state(), **broken}, source="t.npz")
    other = trained(fires, hidden=5)
    with pytest.raises(TrainingError, match="expected a network of 26-3-1, got"):
        trainer.restore(other.team(), other.state(), source="t.npz")


def test_numbers_that_grow_without_end_are_an_error(fires):
    with pytest.raises(TrainingError, match=r"lesson \d+: the network's numbers grow without end; a smaller alpha"):
        trained(fires, alpha=1e6, n_lessons=40, hidden=0)


def test_many_brigades_learn_in_one_network():
    """At the full rate each, twelve to sixteen would move the network so far that its numbers grow without end."""
    fires = load_curriculum("conditions").only(["official-like"])
    trainer = trained(fires, n_lessons=1, n_fights=12, n_steps_max=200, hidden=16)
    assert np.abs(numbers(trainer)).max() < 10


def test_it_is_recorded_and_a_team_file_is_written(fires, tmp_path):
    path = tmp_path / "t.npz"
    train(fires, method="targets", set=SHORT, output=path, record=tmp_path / "t.mcap")
    team = load_team(path)
    assert isinstance(team, NetworkTeam)
    assert team.digest == trained(fires).team().digest == open_training(tmp_path / "t.mcap").team().digest


def share_of_score(team, scenarios):
    shares = []
    for scenario in scenarios:
        world = build_scenario(scenario).world(seed=41)
        world.run(team.policy().for_brigades(world.n_brigades))
        shares.append(world.outcome.score_share)
    return float(np.mean(shares))


@pytest.mark.heavy
def test_learning_is_worth_it():
    """After 1800 fights the greedy team saves far more than the one that has learned nothing."""
    fires = load_curriculum("contested")
    untrained = Targets().trainer(fires, seed=1).team()
    team = trained(fires, hidden=16, n_lessons=12, n_fights=150, n_steps_max=150).team()
    before, after = (share_of_score(one, fires.scenarios[::8]) for one in (untrained, team))
    assert after > before + 0.1, (before, after)
