"""Rankings: followed step by step and in whole episodes, recorded and replayed; and targets of a policy's own."""

from __future__ import annotations

import json

import numpy as np
import pytest
from fireworld_recorder.reader import open_log

from fireworld.kernels.choice import RANK_ALL, RANK_NAMED
from fireworld.kernels.ranking import N_TARGET_FEATURES, N_WEIGHTS
from fireworld.policy.kernel import from_rankings
from fireworld.policy.names import find_policy
from fireworld.policy.protocol import Action, Decision
from fireworld.policy.teams.ranking_team import RankingTeam
from fireworld.policy.teams.ranking_words import WEIGHTS
from fireworld.recording.replay import RecordedPolicy
from fireworld.records import MemoryRecording
from fireworld.simulation.observer import Observer
from tests.kernels.small import burn, make_city, make_world, square
from tests.simulation.town import begin, play, town_world

NAMES = [weight.name for weight in WEIGHTS]


def make_ranking(n_rows=2, *, own_targets=True, **provenance):
    weights = np.random.default_rng(8).normal(size=(n_rows, N_WEIGHTS))
    return RankingTeam(weights, own_targets, provenance)


@pytest.mark.parametrize(("own_targets", "kind"), [(False, RANK_NAMED), (True, RANK_ALL)])
def test_every_brigade_follows_its_row(own_targets, kind):
    ready = from_rankings(make_ranking().weights, own_targets=own_targets).for_brigades(5)
    assert ready.kind.tolist() == [kind] * 5
    assert ready.table_of.tolist() == [0, 1, 0, 1, 0], "more brigades than rows: in turn"


@pytest.mark.parametrize("own_targets", [False, True])
def test_a_step_tells_what_was_chosen_and_why(own_targets):
    """Of two brigades one likes hot buildings and the other cold ones."""
    weights = np.zeros((2, N_WEIGHTS))
    weights[:, NAMES.index("temperature")] = 1.0, -1.0
    policy = from_rankings(weights, own_targets=own_targets)
    world = make_world(make_city(*(square(60 * k, 0) for k in range(4)), links={0: [1], 1: [2]}), brigades=[3, 3])
    burn(world, 0, 1, 2)
    degrees = np.array([200.0, 300.0, 100.0])
    world.state.fire.energy[:3] = world.city_arrays.buildings.capacity[:3] * degrees
    hot, cold = world.step(begin(policy, world)).decisions
    if own_targets:
        assert [(one.action, one.target) for one in (hot, cold)] == [(4, 1), (4, 2)]
        assert (hot.value, cold.value) == pytest.approx((0.6, -0.2))
    else:  # easiest is 2; nearest to a civilian, of whom there is none, and to the center 0 and 1; nearest to me 2
        assert (hot.target, cold.target) == (None, None)
        assert hot.q_values == pytest.approx((0.2, 0.4, 0.6, 0.2))
        assert [hot.action, cold.action] == [2, 0]
        assert world.state.brigades.target.tolist() == [1, 2]
        assert hot.value == max(hot.q_values)
    assert not hot.explored


@pytest.mark.parametrize("own_targets", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_step_by_step_and_at_once_are_the_same(own_targets, seed):
    weights = np.random.default_rng(seed).normal(size=(3, N_WEIGHTS))
    policy = from_rankings(weights, own_targets=own_targets)
    stepped, run = (town_world(seed=seed, n_fires=6) for _ in range(2))
    assert play(stepped, policy) == run.run(policy.for_brigades(3))
    for name in ("energy", "water"):
        assert getattr(stepped.state.fire, name).tobytes() == getattr(run.state.fire, name).tobytes()
    for name in ("action", "target", "x", "tank"):
        assert getattr(stepped.state.brigades, name).tolist() == getattr(run.state.brigades, name).tolist()


def end_of_four_fires(weights, *, own_targets):
    """What all buildings are like in the end."""
    ends = []
    for seed in (2, 3, 5, 6):
        world = town_world(seed=seed, n_fires=7)
        world.run(from_rankings(weights, own_targets=own_targets).for_brigades(3))
        ends.append(world.state.fire.energy.tobytes())
    return ends


@pytest.mark.parametrize(("own_targets", "n_counted"), [(True, N_TARGET_FEATURES), (False, N_WEIGHTS)])
def test_every_weight_counts(own_targets, n_counted):
    """Those of the actions only where the actions are chosen among."""
    weights = make_ranking(1).weights
    before = end_of_four_fires(weights, own_targets=own_targets)
    counts = []
    for k in range(N_WEIGHTS):
        changes = (weights + change * np.eye(N_WEIGHTS)[k] for change in (5.0, -5.0))
        counts.append(any(end_of_four_fires(changed, own_targets=own_targets) != before for changed in changes))
    assert counts == [True] * n_counted + [False] * (N_WEIGHTS - n_counted)


def test_the_digest_tells_rankings_apart():
    weights = make_ranking().weights
    other = weights.copy()
    other[1, 16] += 1e-12
    policies = [from_rankings(rows, own_targets=own) for rows in (weights, other, weights[:1]) for own in (True, False)]
    assert len({policy.digest for policy in policies}) == 6
    rankings = [RankingTeam(rows, own) for rows in (weights, other, weights[:1]) for own in (True, False)]
    assert len({ranking.digest for ranking in rankings}) == 6
    assert RankingTeam(weights.copy(), True, {"seed": 5}).digest == rankings[0].digest, "of what is followed alone"
    assert rankings[0].policy().digest == policies[0].digest


@pytest.fixture
def here(here):
    """The current folder, with a file of each kind of ranking."""
    for name, own_targets in (("all.npz", True), ("named.npz", False)):
        make_ranking(own_targets=own_targets).save(here / name)
    return here


@pytest.mark.parametrize("name", ["all.npz", "named.npz"])
def test_a_recording_of_a_ranking_is_replayed_from_itself(here, fireworld, name):
    run = fireworld("run", "quick", "--policy", name, "--record", "a.mcap", "--json")
    assert (run.code, run.err) == (0, "")
    log = open_log(here / "a.mcap")
    assert log.header.attachments["policy.npz"] == (here / name).read_bytes()
    (here / name).unlink()
    assert fireworld("verify", "a.mcap").code == 0
    first = log.step(1).decisions
    assert first.target_value.shape == (2,)
    assert (first.target_value != 0).all()
    assert len(first.q_values) == 8
    if name == "all.npz":
        assert set(first.action) == {4}
        assert (first.target_value >= first.q_values.reshape(2, 4).max(axis=1)).all(), "the best of all is best"
    else:
        assert set(first.action) <= {0, 1, 2, 3}
        assert (first.target_value == first.q_values.reshape(2, 4).max(axis=1)).all()


def test_other_weights_are_another_run(here, fireworld):
    changed = make_ranking()
    changed.weights[0, 0] -= 3.0
    changed.save(here / "other.npz")
    digests = [
        json.loads(fireworld("run", "quick", "--policy", name, "--json").out)["digest"]
        for name in ("all.npz", "other.npz", "all.npz")
    ]
    assert digests[0] == digests[2] != digests[1]


def test_what_is_written_is_what_was_recorded(here, fireworld):
    """The values of a log are those of the run, bit by bit."""
    fireworld("run", "quick", "--policy", "all.npz", "--record", "a.mcap", "--steps", 9)
    from fireworld.scenario import load_scenario
    from fireworld.simulation.built import build_scenario
    from fireworld.simulation.prepared_run import prepare_run

    built = build_scenario(load_scenario("quick"))
    records = list(prepare_run(built, find_policy("all.npz"), seed=1, n_steps_max=9))
    for told, read in zip(records, open_log(here / "a.mcap"), strict=True):
        assert told.decisions.target_value.tolist() == read.decisions.target_value.tolist()
        assert told.decisions.action.tolist() == read.decisions.action.tolist()
    assert len(records[0].decisions.target_value) == 0
    assert len(records[9].decisions.target_value) == 2


class Stubborn:
    """Names the burning building with the highest index, and keeps to it while it burns."""

    def __init__(self):
        self.asked = []

    def decide(self, observation):
        self.asked.append((observation.step, observation.brigade))
        return Decision(Action.OWN_TARGET, target=max(observation.burning))

    def keeps(self, brigade, last_action, step):
        return last_action == Action.OWN_TARGET


def chain_world():
    """Four burning buildings, each linked to the next: one site while all burn."""
    outlines = [*(square(60 * k, 0) for k in range(4)), square(0, 2000)]
    world = make_world(make_city(*outlines, links={k: [k + 1] for k in range(3)}, refuges=[4]), brigades=[4])
    set_fire(world, 0, 1, 2, 3)
    return world


def set_fire(world, *burning):
    """Let these burn for long, and no others, whatever happened in the step."""
    fire = world.state.fire
    fire.energy[:] = 0.0
    fire.fuel[:] = 0.0
    fire.fuel[list(burning)] = world.city_arrays.buildings.initial_fuel[list(burning)]
    fire.energy[list(burning)] = world.city_arrays.buildings.capacity[list(burning)] * 300.0
    fire.fieryness[:] = 8
    fire.fieryness[list(burning)] = 1


def test_an_own_target_is_kept_while_it_burns():
    world, policy = chain_world(), Stubborn()
    targets = []
    for burning in ((0, 1, 2, 3), (0, 1, 2, 3), (0, 1, 2), (0, 1, 2), (0, 1, 2, 3), (0,)):
        set_fire(world, *burning)
        decision = world.step(policy).decisions[0]
        assert decision.action == Action.OWN_TARGET
        assert decision.target == world.state.brigades.target[0]
        targets.append(decision.target)
    assert targets == [3, 3, 2, 2, 2, 0], "asked anew when it is out, and not before"
    assert [step for step, _ in policy.asked] == [1, 3, 6]


class Watcher:
    """Brigade b names the b-th burning building, and remembers what it knew of the others."""

    def __init__(self):
        self.known = []

    def decide(self, observation):
        self.known.append(observation.known_targets.tolist())
        return Decision(Action.OWN_TARGET, target=int(observation.burning[observation.brigade]), value=2.5)


@pytest.mark.parametrize(
    ("in_turn", "known"), [(True, [[-1, -1], [0, -1], [0, 1], [0, 1]]), (False, [[-1, -1], [-1, -1], [0, 1], [0, 1]])]
)
def test_what_the_others_go_for_is_seen(in_turn, known):
    """In turn a brigade knows what those before it name in this step."""
    world = make_world(make_city(square(0, 0), square(60, 0), square(0, 900), links={0: [1]}), brigades=[2, 2])
    observation = world.constants.observation._replace(in_turn=in_turn)
    world.constants = world.constants._replace(observation=observation)
    policy, observer = Watcher(), Observer(world)
    for _ in range(2):
        set_fire(world, 0, 1)
        record = observer.record(world.step(policy))
        assert record.decisions.target_value.tolist() == [2.5, 2.5]
    assert policy.known == known


def test_a_kept_target_is_replayed_after_its_site_split():
    def walk(policy):
        world = chain_world()
        observer = Observer(world)
        records = [observer.record()]
        for burning in ((0, 1, 2, 3), (0, 1, 3), (0, 1, 3)):
            set_fire(world, *burning)
            records.append(observer.record(world.step(policy)))
        return records

    records = walk(Stubborn())
    replayed = walk(RecordedPolicy(MemoryRecording(None, None, records)))
    told, again = ([record.decisions.target.tolist() for record in some] for some in (records, replayed))
    assert told == again
