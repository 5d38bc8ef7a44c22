"""Networks: they choose as the ranking whose weights they have, step by step and at once, recorded and replayed."""

from __future__ import annotations

import numpy as np
import pytest
from fireworld_recorder.reader import open_log
from fireworld_viewer.story.narration import decision_lines
from fireworld_viewer.story.series import choices_of

import fireworld as fw
from fireworld.errors import TrainingError
from fireworld.kernels.ranking import N_WEIGHTS
from fireworld.policy.names import find_policy, note_on_team
from fireworld.policy.teams.network_layers import FEATURES, SEEN
from fireworld.policy.teams.network_team import NetworkTeam
from fireworld.policy.teams.ranking_team import RankingTeam
from fireworld.policy.teams.team import load_team
from fireworld.records import ACTIONS
from fireworld.scenario import load_scenario
from fireworld.simulation.built import build_scenario
from tests.networks import make_network, random_layers
from tests.reference import network as reference
from tests.simulation.town import play, town_world

NEAR = SEEN.index("others_near")


def as_network(ranking):
    """The network that has one layer with the weights of a ranking of one row."""
    reads = FEATURES if ranking.own_targets else SEEN[:N_WEIGHTS]
    layer = ranking.weights.T[: len(reads)], np.zeros(1)
    return NetworkTeam.from_layers([layer], features=reads, own_targets=ranking.own_targets)


def make_ranking(seed, *, own_targets, near=None):
    weights = np.random.default_rng(seed).normal(size=(1, N_WEIGHTS))
    weights[0, NEAR] = weights[0, NEAR] if near is None else near
    return RankingTeam(weights, own_targets)


@pytest.mark.parametrize("own_targets", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_one_layer_chooses_as_the_ranking(own_targets, seed):
    """A ranking adds up two of its terms first, so that values may differ in their last bits; choices do not."""
    ranking = make_ranking(seed, own_targets=own_targets)
    runs = [fw.run("test-1", policy=team, seed=seed, steps=120) for team in (ranking, as_network(ranking))]
    for of_ranking, of_network in zip(*runs, strict=True):
        assert of_ranking.decisions.target.tolist() == of_network.decisions.target.tolist()
        assert of_ranking.decisions.action.tolist() == of_network.decisions.action.tolist()
        for name in ("target_value", "q_values"):
            values = [getattr(one.decisions, name) for one in (of_ranking, of_network)]
            np.testing.assert_allclose(*values, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("own_targets", [False, True])
def test_one_layer_is_the_ranking_where_the_sums_are(own_targets):
    """To the last bit of every recorded value: without a weight, its term is no matter."""
    ranking = make_ranking(1, own_targets=own_targets, near=0.0)
    runs = [fw.run("test-1", policy=team, seed=3) for team in (ranking, as_network(ranking))]
    assert runs[0].digest == runs[1].digest


def test_the_best_team_as_a_network():
    best = load_team("best-2026")
    network = as_network(best)
    for name in ("default", "test-3-brigades-8"):
        ends = []
        for team in (best, network):
            world = build_scenario(load_scenario(name)).world(seed=1)
            world.run(team.policy().for_brigades(world.n_brigades))
            ends.append(world.state.fire.energy.tobytes() + world.state.brigades.x.tobytes())
        assert ends[0] == ends[1]


AROUND_TOO = [name for name in SEEN if name not in ACTIONS]


@pytest.mark.parametrize("own_targets", [False, True])
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("features", [FEATURES, AROUND_TOO])
def test_step_by_step_and_at_once_are_the_same(own_targets, seed, features):
    widths = len(features), 9, 6, 1
    policy = make_network(*widths, seed=seed, own_targets=own_targets, features=features).policy()
    stepped, run = (town_world(seed=seed, n_fires=6) for _ in range(2))
    assert play(stepped, policy) == run.run(policy.for_brigades(3))
    for name in ("energy", "water"):
        assert getattr(stepped.state.fire, name).tobytes() == getattr(run.state.fire, name).tobytes()
    for name in ("action", "target", "x", "tank"):
        assert getattr(stepped.state.brigades, name).tolist() == getattr(run.state.brigades, name).tolist()


class InNumpy(fw.Policy):
    """What a learner's own code would do with the same network."""

    def __init__(self, network):
        self.network = network

    def decide(self, observation):
        rows = observation.target_features
        values = [reference.value(self.network, np.append(row, np.eye(4)[k])) for k, row in enumerate(rows)]
        return fw.Decision(int(np.argmax(values)), q_values=values, value=max(values))


@pytest.mark.parametrize("activation", ["relu", "tanh"])
def test_a_policy_in_python_with_the_same_network_does_the_same(activation):
    team = make_network(13, 16, 16, 1, activation=activation)
    ours, theirs = (fw.run("quick", policy=policy, seed=2) for policy in (team, InNumpy(team.policy().network)))
    for one, other in zip(ours, theirs, strict=True):
        assert one.decisions.action.tolist() == other.decisions.action.tolist()
        np.testing.assert_allclose(one.decisions.q_values, other.decisions.q_values, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(one.decisions.target_value, other.decisions.target_value, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(("activation", "digest"), [("tanh", "4a0b2aa6df3d621b"), ("relu", "2e121537bb26972e")])
def test_a_run_is_the_same_on_every_machine(activation, digest):
    """With weights that no generator draws."""
    numbers = (np.arange(13 * 8 + 8 + 8).reshape(8, 15) * 7 % 31 - 15) / 8.0
    layers = [(numbers[:, :13].T, numbers[:, 13]), (numbers[:, 14:], np.zeros(1))]
    team = NetworkTeam.from_layers(layers, activation=activation)
    assert fw.run("quick", policy=team, steps=60).digest[:16] == digest


def test_equal_values_go_to_the_first():
    """The lowest action, the lowest id: as rankings have it."""
    nothing = [(np.zeros((13, 1)), np.ones(1))]
    run = fw.run("quick", policy=NetworkTeam.from_layers(nothing), steps=30)
    assert set(np.concatenate([one.decisions.action for one in run]).tolist()) <= {-1, 0}
    own = NetworkTeam.from_layers(nothing, own_targets=True)
    ranking = RankingTeam(np.zeros((1, N_WEIGHTS)), True)
    for one, other in zip(*(fw.run("quick", policy=team, steps=30) for team in (own, ranking)), strict=True):
        assert one.decisions.target.tolist() == other.decisions.target.tolist()


def test_the_digest_tells_networks_apart():
    layers = random_layers(13, 4, 1)
    changed = [(weights.copy(), biases.copy()) for weights, biases in layers]
    changed[1][1][0] += 1e-12
    teams = [
        make_network(13, 4, 1),
        make_network(13, 4, 1, activation="relu"),
        make_network(13, 4, 1, own_targets=True),
        make_network(13, 4, 1, features=FEATURES[::-1]),
        make_network(13, 4, 1, seed=9),
        make_network(13, 4, 4, 1),
        NetworkTeam.from_layers(changed, activation="tanh"),
    ]
    assert len({team.digest for team in teams}) == len(teams)
    assert len({team.policy().digest for team in teams}) == len(teams)
    assert make_network(13, 4, 1, provenance={"seed": 5}).digest == teams[0].digest, "of what is followed alone"


def test_every_command_follows_it(here, fireworld):
    """By its file: run, verify, compare, diff, fork, explain, golden."""
    make_network().save(here / "mine.npz")
    content = (here / "mine.npz").read_bytes()
    words = ("run", "quick", "--policy", "mine.npz", "--steps", 12)
    assert fireworld(*words, "--record", "a.mcap").code == 0
    assert fireworld("run", "quick", "--policy", "chief", "--steps", 12, "--record", "b.mcap").code == 0
    log = open_log(here / "a.mcap")
    assert log.header.attachments["policy.npz"] == content
    decided = log.step(1).decisions
    assert (decided.target_value == decided.q_values.reshape(2, 4).max(axis=1)).all()
    assert decided.action.tolist() == decided.q_values.reshape(2, 4).argmax(axis=1).tolist()
    assert fireworld("golden", "add", "quick", "--policy", "mine.npz", "--steps", 12, "--dir", "golden").code == 0
    assert fireworld("golden", "check", "golden").code == 0
    (here / "mine.npz").rename(here / "moved.npz")
    assert fireworld("verify", "a.mcap").code == 0
    assert fireworld("diff", "a.mcap", "b.mcap").code == 1
    assert fireworld("fork", "a.mcap", "--at", 3, "--policy", "moved.npz", "--record", "c.mcap").code == 0
    assert fw.open_log(here / "c.mcap").digest == fw.open_log(here / "a.mcap").digest, "it goes on as it was"
    done = fireworld("compare", "chief", "moved.npz", "--scenarios", "quick", "--seeds", 2, "--jobs", 1)
    assert (done.code, "moved.npz" in done.out) == (0, True)
    done = fireworld("explain", "a.mcap", "b.mcap", "--budget", 4)
    assert done.code == 0, done.err


def test_a_view_names_the_values(here):
    fw.run("quick", policy=make_network(), steps=2, record="a.mcap")
    log = open_log("a.mcap")
    choices = choices_of(log)
    lines = [line.text for line in decision_lines(log, choices, np.ones_like(choices.ranked)) if line.step == 1]
    for line, value in zip(lines, log.step(1).decisions.target_value, strict=True):
        assert f"value {value:.4g}" in line


def test_it_is_a_policy_by_its_path(tmp_path):
    path, team = tmp_path / "mine.npz", make_network()
    team.save(path)
    named = find_policy(str(path))
    assert (named.name, named.digest, named.trained_choices) == ("mine.npz", team.policy().digest, "")
    assert named.attachments == {"policy.npz": path.read_bytes()}
    assert note_on_team(named, 5) == "", "one network is for all"


def values_of(team, seen):
    """What a network makes of targets."""
    network = team.policy().network
    return np.array([reference.value(network, one) for one in seen])


@pytest.mark.parametrize("widths", [(13, 1), (13, 4, 1), (13, 6, 4, 1), (13, 3, 5, 2, 1)])
@pytest.mark.parametrize("n", [1, 2, 3])
def test_a_mean_values_targets_by_the_mean(widths, n):
    teams = [make_network(*widths, seed=seed) for seed in range(n)]
    mean, seen = NetworkTeam.mean_of(teams), np.random.default_rng(1).normal(size=(40, 13))
    assert mean.widths == (13, *(n * width for width in widths[1:-1]), 1)
    assert values_of(mean, seen) == pytest.approx(sum(values_of(team, seen) for team in teams) / n)
    if n == 1:
        assert mean.digest == teams[0].digest
    assert [one["digest"] for one in mean.provenance["mean_of"]] == [team.digest for team in teams]


def test_where_a_mean_comes_from():
    mean = NetworkTeam.mean_of(
        [
            load_team("best"),
            make_network(26, 4, 1, features=load_team("best").features, activation="relu", own_targets=True),
        ]
    )
    lines = mean.origin
    assert lines[0] == f"mean of {load_team('best').digest[:12]}"
    assert lines[1].startswith("  trained in conditions, ")
    assert len(mean.short_provenance["mean_of"][0]["curriculum"]) == 2
    again = NetworkTeam.mean_of([mean])
    assert again.origin[1:] == [f"  {line}" for line in lines]


@pytest.mark.parametrize("found", [3, [3], [], "mean", None])
def test_a_mean_of_strangers_is_not_taken_for_one(found):
    team = make_network(provenance={"mean_of": found})
    assert team.origin == []
    assert team.short_provenance == {"mean_of": found}
    assert repr(team)


@pytest.mark.parametrize(
    ("others", "message"),
    [
        ([], r"teams\[1\]: expected a network, got a ranking of targets"),
        (
            [make_network(activation="relu")],
            r"teams\[1\]: activations: expected as in teams\[0\], \['tanh', 'tanh'\], got ",
        ),
        ([make_network(own_targets=True)], r"teams\[1\]: own_targets: expected as in teams\[0\], False, got True"),
    ],
)
def test_what_has_no_mean(others, message):
    teams = [make_network(), *(others or [load_team("best-2026")])]
    with pytest.raises(TrainingError, match=f"^{message}"):
        NetworkTeam.mean_of(teams)


def test_means_of_nothing_and_too_wide_ones():
    with pytest.raises(TrainingError, match=r"^mean: teams: expected one at least, got 0"):
        NetworkTeam.mean_of([])
    with pytest.raises(TrainingError, match=r"^mean: weights_0: "):
        NetworkTeam.mean_of([make_network(13, 600, 1), make_network(13, 600, 1)])
