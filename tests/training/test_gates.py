"""Gates: the network chooses the ranking with the greatest gate and values targets by it; the rest is evolution's."""

from __future__ import annotations

import json
from itertools import pairwise

import numpy as np
import pytest

from fireworld.draws import WEIGHT
from fireworld.errors import TrainingError
from fireworld.executors import threads
from fireworld.kernels.draws import normal
from fireworld.kernels.network import value_by_network, widest
from fireworld.kernels.situation import N_SEEN
from fireworld.policy.protocol import Action, Decision, Policy
from fireworld.policy.seen_targets import seen_targets
from fireworld.policy.teams.network_layers import FEATURES, NUMBER_MAX, SEEN
from fireworld.policy.teams.network_team import NetworkTeam
from fireworld.policy.teams.ranking_words import AROUND
from fireworld.policy.teams.team import load_team, parse_team
from fireworld.records import ACTIONS
from fireworld.scenario import load_scenario
from fireworld.training.methods.gates import LARGEST, SITUATION, Gates
from tests.training.generations import CONDITIONS, SHORT_GATES, decisions, maker, read

IN_SITUATION = [SEEN.index(name) for name in SITUATION]
TWO_SITES = load_scenario("test-2").with_values(
    {
        "city.generated.seed": 43000,
        "fires": [
            {"at": [0.722, 0.322], "n_buildings": 6},
            {"at": [0.281, 0.378], "n_buildings": 5, "step": 4},
        ],
        "steps": 60,
    }
)
"""Four brigades, one fire, and a second one from step 4 on."""


@pytest.fixture(scope="module")
def fires(tmp_path_factory):
    return read(CONDITIONS, tmp_path_factory.mktemp("gates"))


@pytest.fixture(scope="module")
def make(fires):
    return maker(fires, Gates(**SHORT_GATES))


def parts_of(numbers, n_rankings):
    """Return rankings, (n, 13), biases of gates, (n,), and their weights, (n, 6), as the docs put the numbers."""
    rankings, gates = numbers[: 13 * n_rankings].reshape(-1, 13), numbers[13 * n_rankings :].reshape(-1, 7)
    return rankings, gates[:, 0], gates[:, 1:]


def weighed(weights, features):
    """Return a weighted sum, added up in the order of the features."""
    total = 0.0
    for weight, feature in zip(weights.tolist(), features.tolist(), strict=True):
        total += weight * feature
    return total


def values_of(network, seen):
    """Return the values of targets, as the kernels that teams follow compute them; `seen` is (targets, 30)."""
    work = np.zeros((2, widest(network)))
    return [value_by_network(network, row, work) for row in seen]


def random_numbers(random, n_rankings, *, scale=1.0):
    return random.normal(size=20 * n_rankings) * scale


@pytest.mark.parametrize("n_rankings", [2, 3, 4])
def test_the_ranking_with_the_greatest_gate_values_targets_to_the_last_bit(make, n_rankings):
    trainer, random = make(n_rankings=n_rankings), np.random.default_rng(n_rankings)
    chosen = []
    for draw in range(300):
        scale = 10.0 ** random.uniform(-3, 4)  # some are beyond what numbers count
        numbers = random_numbers(random, n_rankings, scale=scale)
        seen = random.exponential(2.0, size=(6, N_SEEN)) * (random.random((6, N_SEEN)) < 0.8)
        seen[:, IN_SITUATION] = seen[0, IN_SITUATION]
        rankings, biases, weights = parts_of(np.clip(numbers, -1000.0, 1000.0), n_rankings)
        gates = biases + weights @ seen[0, IN_SITUATION]
        best, second = np.argsort(-gates)[:2]
        of_all = [[weighed(ranking, row[:13]) for row in seen] for ranking in rankings]
        if (gates[best] - gates[second]) * 1e9 <= np.abs(of_all).max():
            continue
        chosen.append(best)
        values = values_of(trainer.network_of(numbers), seen)
        assert values == of_all[best], draw
        assert np.argmax(values) == np.argmax(seen[:, :13] @ rankings[best])
    assert len(chosen) > 290, "few draws have gates that are nearly equal"
    assert {*chosen} == {*range(n_rankings)}


def test_nearly_equal_gates_by_hand(make):
    """Ranking 0 values by the temperature, ranking 1 by minus the volume; the gate of ranking 0 is ahead."""
    trainer, seen = make(), np.zeros((1, N_SEEN))
    seen[0, :2] = 3.0, 5.0

    def value(ahead):
        numbers = np.zeros(40)
        numbers[0], numbers[13 + 1], numbers[26] = 1.0, -1.0, ahead
        return values_of(trainer.network_of(numbers), seen)[0]

    assert value(0.0) == 3.0 - 5.0, "where gates are equal: the sum of both"
    assert value(2e-9) == pytest.approx(3.0 - 3.0), "2e-9 x 1e9 of the 5 is left out"
    assert value(5e-9) == pytest.approx(3.0)
    assert value(6e-9) == value(1.0) == 3.0
    assert value(-2e-9) == pytest.approx(1.0 - 5.0)
    assert value(-1.0) == -5.0


def test_what_all_gates_have_alike_changes_nothing(make):
    trainer, random = make(n_rankings=3), np.random.default_rng(5)
    numbers, seen = random_numbers(random, 3), random.exponential(2.0, size=(9, N_SEEN))
    alike = numbers.copy()
    _, biases, weights = parts_of(alike, 3)
    biases += 4.0
    weights += random.integers(-3, 3, size=6)
    assert values_of(trainer.network_of(alike), seen) == values_of(trainer.network_of(numbers), seen)


def test_numbers_of_any_size_make_a_team(make):
    """A team file holds no number above 1e9 in size."""
    trainer, random = make(n_rankings=4), np.random.default_rng(6)
    numbers = random_numbers(random, 4, scale=1e12)
    trainer.progress.kept = numbers
    team = parse_team(trainer.team().to_bytes(), source="t.npz")
    assert max(np.abs(array).max() for array in team.arrays().values()) == NUMBER_MAX
    assert np.abs(team.layers[1].weights[:13]).max() == LARGEST
    assert np.abs(team.layers[0].weights).max() == 2 * LARGEST


class Watching(Policy):
    """Does what the ranking `best` does, and keeps what each brigade saw of its targets."""

    def __init__(self):
        self.policy, self.found = load_team("best-2026").policy(), []
        self.policy.begin(None, TWO_SITES.brigades.n, 0)

    def decide(self, observation):
        self.found.append(seen_targets(observation)[1])
        return self.policy.decide(observation)


def test_gates_read_what_is_the_same_for_all_targets_of_a_site():
    """All of it, but whether the site is another one: where brigades stay at their site, that is 0."""
    watching = Watching()
    decisions(watching, TWO_SITES)
    found = [seen for seen in watching.found if len(seen)]
    assert all((seen >= 0.0).all() for seen in found), "so relu hands it on"
    alike = {name for name in SEEN if all(np.ptp(seen[:, SEEN.index(name)]) == 0.0 for seen in found)}
    assert alike - {*ACTIONS} == {*SITUATION, "other_site"}
    for name in SITUATION:
        assert len({seen[0, SEEN.index(name)] for seen in found}) > 1, "it is worth reading"
    assert {*SITUATION} < {weight.name for weight in AROUND}


@pytest.mark.parametrize("n_rankings", [2, 3, 4])
@pytest.mark.parametrize("name", ["quick", "test-2"])
def test_it_starts_with_what_the_best_ranking_does(make, n_rankings, name):
    trainer, scenario = make(n_rankings=n_rankings), load_scenario(name)
    team = trainer.team()
    assert isinstance(team, NetworkTeam)
    assert team.widths == (19, 13 + n_rankings * (n_rankings - 1), 2 * n_rankings, 1)
    assert team.features == (*FEATURES, *SITUATION)
    rankings, *gates = parts_of(trainer.progress.mean, n_rankings)
    assert (rankings == load_team("best-2026").weights[0, :13]).all()
    assert not any(gate.any() for gate in gates)
    assert decisions(team.policy(), scenario) == decisions(load_team("best-2026").policy(), scenario)


def test_without_a_start_all_targets_are_worth_the_same(make):
    trainer = make(start="none")
    assert not trainer.progress.mean.any()
    assert "start" not in trainer.identity
    assert make().identity["start"] == load_team("best-2026").digest


class InNumpy(Policy):
    """What the docs say that a team with such numbers does."""

    def __init__(self, numbers, n_rankings):
        self.rankings, self.biases, self.weights = parts_of(numbers, n_rankings)
        self.chosen = []

    def decide(self, observation):
        burning, seen = seen_targets(observation)
        if not burning:
            return Decision(Action.EASIEST)
        best = int(np.argmax(self.biases + self.weights @ seen[0, IN_SITUATION]))
        self.chosen.append(best)
        values = [weighed(self.rankings[best], row[:13]) for row in seen]
        ids = observation.city.buildings.building_id
        place = max(range(len(burning)), key=lambda k: (values[k], -ids[burning[k]]))
        return Decision(Action.OWN_TARGET, target=burning[place])


def test_a_team_fights_by_the_ranking_that_its_gates_choose(make):
    """The second ranking goes for what the first one avoids, while the tank is rather full."""
    numbers = make().progress.mean.copy()
    rankings, biases, weights = parts_of(numbers, 2)
    rankings[1] *= -1.0
    biases[:] = 0.5, 0.0
    weights[1, SITUATION.index("sprays_left")] = 1.0
    policy = InNumpy(numbers, 2)
    assert decisions(make().policy_of(numbers), TWO_SITES) == decisions(policy, TWO_SITES)
    turns = {one for one in pairwise(policy.chosen) if one[0] != one[1]}
    assert turns == {(0, 1), (1, 0)}, "both rankings had their turns"


def test_noise_of_gates_is_what_makes_them_differ(make):
    trainer = make(n_rankings=3, noise=0.5)
    noise, candidates = trainer.candidates()
    drawn = np.array([[normal(1, WEIGHT, row * 60 + k, 0) for k in range(60)] for row in range(2)])
    for mine, raw in zip(noise, drawn, strict=True):
        rankings, *gates = parts_of(mine, 3)
        raw_rankings, *raw_gates = parts_of(raw, 3)
        assert rankings.tolist() == raw_rankings.tolist()
        for gate, raw_gate in zip(gates, raw_gates, strict=True):
            assert gate.sum(axis=0) == pytest.approx(0.0, abs=1e-12)
            assert gate - gate[0] == pytest.approx(raw_gate - raw_gate[0])
    start = trainer.progress.mean
    assert (candidates == np.concatenate([start + 0.5 * noise, start - 0.5 * noise])).all()


def test_gates_and_rankings_move(make):
    trainer = make(n_generations=4, n_steps_max=100)
    start = trainer.progress.mean.copy()
    list(trainer.run(threads(2)))
    before, after = (parts_of(numbers, 2) for numbers in (start, trainer.progress.mean))
    for one, other in zip(before, after, strict=True):
        assert (one != other).all()
    _, biases, weights = after
    assert biases.sum() == pytest.approx(0.0, abs=1e-12), "what all gates have alike stays"
    assert weights.sum(axis=0) == pytest.approx(0.0, abs=1e-12)


def test_other_seeds_and_hyperparameters_another_training(make):
    variants = ({}, {"seed": 2}, {"n_rankings": 3}, {"start": "none"}, {"noise": 0.2}, {"n_pairs": 3})
    means = []
    for variant in variants:
        trainer = make(**variant)
        list(trainer)
        means.append(trainer.progress.mean.tobytes())
    assert len({*means}) == len(variants)


def test_the_command_line_trains_records_and_resumes(here, fireworld):
    words = ["train", "tiny.yaml", "--method", "gates", "--set", "n_rankings=3"]
    words += [word for name, value in SHORT_GATES.items() for word in ("--set", f"{name}={value}")]
    done = fireworld(*words, "-o", "a.npz", "--record", "a.mcap", "--log", "a.csv")
    assert done.code == 0, done.err
    team = load_team("a.npz")
    assert done.out == f"a.npz: seed 1, {team.summary}, digest {team.digest}\n"
    assert team.summary == "a network of 19-19-6-1 for own targets"
    assert len(json.dumps(team.provenance)) < 1000
    assert done.err.splitlines()[-1].startswith("seed 1: generation 2 of 2, score ")
    assert fireworld(*words, "-o", "b.npz", "--stages", "alone", "--set", "start=none", "--record", "b.mcap").code == 0
    assert fireworld("verify", "a.mcap", "--team", "a.npz").code == 0
    shown = fireworld("info", "a.mcap")
    assert (shown.code, "gates: start best-2026, " in shown.out, "n_rankings 3\n" in shown.out) == (0, True, True)
    assert fireworld("report", "a.mcap", "-o", "a.html").code == 0
    assert fireworld("diff", "a.mcap", "b.mcap").code == 1
    assert fireworld("export", "a.mcap", "--csv", "tables").code == 0
    assert {path.name for path in (here / "tables").iterdir()} >= {"evolved.csv", "evolved_fights.csv"}
    shown = fireworld("policy", "show", "a.npz").out
    assert "trained in tiny, 2 generations, seed 1\n" in shown
    assert "site_others" in shown
    assert fireworld("policy", "diff", "a.npz", "b.npz").code == 1
    assert fireworld("run", "quick", "--policy", "a.npz", "--steps", 12).code == 0
    (here / "a.npz").unlink()
    assert fireworld(*words, "-o", "a.npz", "--record", "a.mcap", "--log", "c.csv", "--resume").code == 0
    assert load_team("a.npz").digest == team.digest, "made again of its log"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"n_rankings": 1}, "n_rankings: expected a whole number from 2 to 4, got 1"),
        ({"n_rankings": 5}, "n_rankings: expected a whole number from 2 to 4, got 5"),
        ({"n_rankings": 2.5}, "n_rankings: expected a whole number from 2 to 4, got 2.5"),
        ({"start": "paper"}, "start: expected one of best-2026, none, got 'paper'"),
        ({"noise": 0.0}, "noise: expected a number > 0, got 0.0"),
        ({"n_pairs": 0}, "n_pairs: expected a whole number from 1"),
    ],
)
def test_hyperparameters_that_make_no_gates(changes, message):
    with pytest.raises(TrainingError, match=f"^method: {message}"):
        Gates(**changes)


def test_it_has_no_hidden_units_to_choose():
    with pytest.raises(TrainingError, match=r"^--set: hidden: expected one of start, .*, n_rankings, got 'hidden'$"):
        Gates().with_settings({"hidden": 12})


@pytest.mark.parametrize(
    ("broken", "wanted"),
    [
        ({"kept": np.zeros(3)}, r"kept: expected 40 numbers, got float64 \(3,\)"),
        ({"kept": np.full(40, np.nan)}, "kept"),
        ({"kept": np.ones(40)}, "kept: expected the numbers of its team, got those of another"),
        ({"mean": np.zeros(3)}, r"mean: expected 40 numbers, got float64 \(3,\)"),
    ],
)
def test_a_checkpoint_that_makes_no_sense(make, broken, wanted):
    trainer = make()
    with pytest.raises(TrainingError, match=f"^t.npz: {wanted}"):
        trainer.restore(trainer.team(), {**trainer.state(), **broken}, source="t.npz")


def test_a_checkpoint_without_the_numbers_of_its_team(make):
    trainer = make()
    state = trainer.state()
    del state["kept"]
    with pytest.raises(TrainingError, match="no kept in it"):
        trainer.restore(trainer.team(), state, source="t.npz")
