"""Imitating a planner: what it made of the options, who leads the fights, what is learned of it."""

from __future__ import annotations

from threading import Event

import numpy as np
import pytest

from fireworld.errors import TrainingError
from fireworld.executors import threads
from fireworld.planning.planner import FOLLOW, Planner
from fireworld.policy.protocol import named_target
from fireworld.policy.teams.team import load_team
from fireworld.training.methods.imitation import Imitation
from fireworld.training.plans import follow_and_plan
from tests.training.generations import CONDITIONS, SHORT_IMITATION, maker, read

HORIZON, INTERVAL, STEPS = 8, 4, 30


@pytest.fixture(scope="module")
def make(tmp_path_factory):
    return maker(read(CONDITIONS, tmp_path_factory.mktemp("imitation")), Imitation(**SHORT_IMITATION))


@pytest.fixture(scope="module")
def fought(make):
    """Fight a fire: the world at its end, and the decisions; `leads`: the planner says what the brigades do."""
    trainer = make()
    built = trainer._cities.build(trainer.curriculum.scenarios[-1])

    def fight(*, leads, stop=None):
        world = built.world(seed=5, n_steps_max=STEPS)
        over = trainer.policy_of(trainer.newest)
        planner = Planner(horizon=HORIZON, interval=INTERVAL, over=over)
        team = None if leads else load_team("paper-cooperative").policy()
        return world, planner, follow_and_plan(world, planner, team, stop or Event())

    fight.built = built
    return fight


def in_steps(world, policy):
    """Fight with a policy to the end; the digest."""
    policy.begin(world.city_arrays, world.n_brigades, world.seed)
    while not (world.terminated or world.truncated):
        world.step(policy)
    return world.digest()


def test_a_planner_that_leads_fights_as_it_does_alone(fought):
    world, planner, found = fought(leads=True)
    alone = Planner(horizon=HORIZON, interval=INTERVAL, over=load_team("best-2026").policy())
    assert world.digest() == in_steps(fought.built.world(seed=5, n_steps_max=STEPS), alone)
    assert len(found) > 5
    assert 0 < planner.planned_at <= world.step_number


def test_a_team_that_leads_fights_as_it_does_alone(fought):
    world, _, found = fought(leads=False)
    team = load_team("paper-cooperative").policy()
    assert world.digest() == in_steps(fought.built.world(seed=5, n_steps_max=STEPS), team)
    assert len(found) > 5


@pytest.mark.parametrize("leads", [True, False])
def test_what_is_followed_comes_first_and_is_worth_nothing_more(fought, leads):
    _, _, found = fought(leads=leads)
    weights = load_team("best-2026").weights[0, :13]
    for decision in found:
        assert decision.worth[0] == 0.0
        assert decision.seen.shape == (len(decision.worth), 30)
        assert 2 <= len(decision.worth) <= 5
        assert len({row.tobytes() for row in decision.seen}) == len(decision.worth), "every target once"
    values = [decision.seen[:, :13] @ weights for decision in found]
    preferred = sum(value[0] >= value.max() - 1e-9 for value in values)
    assert preferred == len(found), "the team that is followed prefers its target"
    assert leads or any(decision.worth.max() > 0 for decision in found)


def test_the_worth_is_that_of_the_plan(fought, monkeypatch):
    """The worth of options by their targets, from what the planner says of itself."""
    noted = []
    plan = Planner._make_plan

    def planned(self, observation):
        plan(self, observation)
        noted.append(self.values)

    monkeypatch.setattr(Planner, "_make_plan", planned)
    _, _, found = fought(leads=True)
    differences = {one - other for values in noted for own in values for one in own.values() for other in own.values()}
    worths = {worth for decision in found for worth in decision.worth.tolist()}
    assert len(worths) > 5
    assert worths <= differences
    assert max(worths) <= max(max(own.values()) - own[FOLLOW] for values in noted for own in values)


def test_an_action_may_name_what_does_not_burn(make, tmp_path):
    heated = CONDITIONS.replace("set: {brigades.n: 4}", "set: {brigades.n: 1, observation.easiest: heated}")
    assert heated != CONDITIONS
    trainer = maker(read(heated, tmp_path), Imitation(**SHORT_IMITATION))(lead=1.0)
    built, named = trainer._cities.build(trainer.curriculum.scenarios[-1]), []

    class Noting(Planner):
        def decide(self, observation):
            target = named_target(observation.brigade, 0, observation.city, observation.world, observation.constants)
            named.append(target in observation.burning)
            return super().decide(observation)

    over = trainer.policy_of(trainer.newest)
    planner = Noting(horizon=HORIZON, interval=INTERVAL, over=over)
    assert len(follow_and_plan(built.world(seed=5, n_steps_max=STEPS), planner, None, Event())) > 5
    assert not all(named)


def test_a_fight_is_left(fought):
    stop = Event()
    stop.set()
    world, _, found = fought(leads=True, stop=stop)
    assert (world.step_number, found) == (0, [])


def test_other_seeds_and_hyperparameters_another_network(make):
    changes = ({"lead": 0.0}, {"lead": 1.0}, {"horizon": 3}, {"interval": 2}, {"n_rollouts": 2}, {"start": "none"})
    changes += ({"rate": 0.1}, {"n_epochs": 2}, {"temperature": 1.0}, {"cooperation": False})

    def improved(trainer):
        list(trainer.run(threads(1)))
        return trainer.newest.tobytes()

    networks = [improved(make()), improved(make(seed=2)), *(improved(make(**one)) for one in changes)]
    assert len({*networks}) == len(networks)


def test_who_leads(make):
    """All fights of one that always leads come out as the planner alone would have them; the others as the team."""
    scores = {}
    for lead in (0.0, 1.0):
        trainer = make(lead=lead, n_generations=1)
        list(trainer)
        (record,) = trainer.records()
        scores[lead] = record
    assert np.array_equal(scores[0.0].fire, scores[1.0].fire)
    assert np.array_equal(scores[0.0].seed, scores[1.0].seed)
    trainer = make()
    for lead, policy in ((0.0, lambda over: over), (1.0, lambda over: Planner(horizon=8, over=over))):
        record = scores[lead]
        for fire, seed, score in zip(record.fire.tolist(), record.seed.tolist(), record.score.tolist(), strict=True):
            built = trainer._cities.build(trainer.curriculum.scenarios[fire])
            world = built.world(seed=seed, n_steps_max=25)
            in_steps(world, policy(trainer.policy_of(trainer.newest)))
            assert world.outcome.score_share == score


def test_the_team_begins_as_what_the_planner_is_over(make):
    trainer = make(start="best", hidden=72)
    assert trainer.team().digest == load_team("best").digest
    assert Imitation().trainer(trainer.curriculum, seed=1).team().digest == load_team("best").digest


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"lead": 1.5}, "lead: expected a number from 0 to 1, got 1.5"),
        ({"horizon": 1001}, "horizon: expected a whole number from 1 to 1000, got 1001"),
        ({"interval": 0}, "interval: expected a whole number from 1 to 1000, got 0"),
        ({"n_rollouts": 0}, "n_rollouts: expected a whole number from 1 to 1000, got 0"),
        ({"start": "paper"}, "start: expected one of best-2026, best, none, got 'paper'"),
    ],
)
def test_hyperparameters_that_make_no_imitation(changes, message):
    with pytest.raises(TrainingError, match=f"^method: {message}"):
        Imitation().with_settings(changes)
