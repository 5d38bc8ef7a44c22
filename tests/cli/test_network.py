"""`fireworld policy` of networks: shown, compared, imported."""

from __future__ import annotations

import json

import numpy as np
import pytest

from fireworld.policy.teams.network_layers import FEATURES
from fireworld.policy.teams.network_team import NetworkTeam
from fireworld.policy.teams.team import load_team
from tests.networks import make_network, random_layers


@pytest.fixture
def here(here):
    """Also some networks."""
    make_network().save(here / "mine.npz")
    origin = {"producer": "pytorch 2.9", "by\nwhom": "me"}
    make_network(2, 1, features=["mine", "volume"], own_targets=True, provenance=origin).save(here / "own.npz")
    (first, biases), *others = random_layers(13, 7, 5, 1)
    first[2, 3] += 0.5
    biases[1] -= 0.25
    NetworkTeam.from_layers([(first, biases), *others], activation=["tanh", "relu"]).save(here / "other.npz")
    return here


def lines(done):
    assert (done.code, done.err) == (0, "")
    return done.out.splitlines()


def test_a_network_of_the_four_targets(here, fireworld):
    shown = lines(fireworld("policy", "show", "mine.npz"))
    assert shown[:2] == [
        "mine.npz: a network that values the targets of the paper's four actions, one for all brigades",
        f"digest {make_network().digest}",
    ]
    table = [line.split() for line in shown if line[:1].isdigit()]
    assert [row[:4] for row in table] == [["0", "13", "7", "tanh"], ["1", "7", "5", "tanh"], ["2", "5", "1", "none"]]
    assert table[2][4] == f"{np.abs(make_network().layers[2].weights).max():.3f}"
    assert [line.split()[0] for line in shown if line.split()[:1] and line.split()[0] in FEATURES] == list(FEATURES)


def test_a_network_of_own_targets(here, fireworld):
    shown = lines(fireworld("policy", "show", "own.npz"))
    assert shown[0] == "own.npz: a network that values all burning buildings of the fire site, one for all brigades"
    assert shown[1:3] == [r"by\nwhom 'me'", "producer 'pytorch 2.9'"]
    told = json.loads(fireworld("policy", "show", "own.npz", "--json").out)
    assert (told["features"], told["own_targets"], told["activations"]) == (["mine", "volume"], True, [])
    assert (told["widths"], told["n_numbers"], told["provenance"]["producer"]) == ([2, 1], 3, "pytorch 2.9")


def test_networks_compared(here, fireworld):
    same = fireworld("policy", "diff", "mine.npz", "mine.npz")
    assert (same.code, same.out) == (0, "the same: 3 layers\n")
    done = fireworld("policy", "diff", "mine.npz", "other.npz")
    assert (done.code, done.err) == (1, "")
    assert done.out.splitlines()[:2] == ["activations: tanh, tanh; in B tanh, relu", "1 layer differs"]
    assert done.out.splitlines()[-1].split() == ["0", "13-7", "13-7", "2", "0.5"]
    told = json.loads(fireworld("policy", "diff", "mine.npz", "other.npz", "--json").out)
    assert (told["same"], told["n_layers"], told["activations"]) == (False, 3, [["tanh", "tanh"], ["tanh", "relu"]])
    assert told["changed"] == [{"layer": 0, "shape_a": "13-7", "shape_b": "13-7", "n_changed": 2, "largest": 0.5}]


def test_networks_of_other_widths_compared(here, fireworld):
    done = fireworld("policy", "diff", "mine.npz", "own.npz")
    assert (done.code, done.err) == (1, "")
    shown = done.out.splitlines()
    assert shown[0] == "A values the targets of the paper's four actions, B all burning buildings of the fire site"
    assert shown[1].startswith("features: temperature, volume, ")
    assert shown[1].endswith("; in B mine, volume")
    assert shown[2:4] == ["activations: tanh, tanh; in B none", "3 layers differ"]
    rows = [line.split() for line in shown if line[:1].isdigit() and "layers" not in line]
    assert rows == [["0", "13-7", "2-1", "-", "-"], ["1", "7-5", "-", "-", "-"], ["2", "5-1", "-", "-", "-"]]


def test_a_model_imported(here, fireworld):
    onnx = pytest.importorskip("onnx")
    from tests.policy.test_onnx import LAYERS, SUMS, make, saved

    assert onnx.__version__
    saved(here / "net.onnx", make(SUMS))
    done = fireworld("policy", "import", "net.onnx", "-o", "team.npz")
    team = NetworkTeam.from_layers(LAYERS, activation="relu")
    assert lines(done) == [f"team.npz: a network of 13-6-1 for the paper's actions, digest {team.digest[:12]}"]
    assert load_team(here / "team.npz").digest == team.digest
    assert fireworld("run", "quick", "--policy", "team.npz", "--steps", 3).code == 0
    done = fireworld("policy", "import", "net.onnx", "-o", "team.npz")
    assert (done.code, "expected a name that is free" in done.err) == (2, True)
    reads = ", ".join(FEATURES[::-1])
    words = ("--force", "--own-targets", "--features", reads)
    assert "for own targets" in lines(fireworld("policy", "import", "net.onnx", "-o", "team.npz", *words))[0]
    assert load_team(here / "team.npz").header() == {
        "features": list(FEATURES[::-1]),
        "activations": ["relu"],
        "own_targets": True,
    }


def test_a_mean_of_networks(here, fireworld):
    make_network(seed=3).save(here / "second.npz")
    done = fireworld("policy", "mean", "mine.npz", "second.npz", "-o", "mean.npz")
    team = NetworkTeam.mean_of([make_network(), make_network(seed=3)])
    assert lines(done) == [f"mean.npz: a network of 13-14-10-1 for the paper's actions, digest {team.digest[:12]}"]
    assert load_team(here / "mean.npz").digest == team.digest
    shown = lines(fireworld("policy", "show", "mean.npz"))
    assert shown[1:3] == [f"mean of {make_network(seed=seed).digest[:12]}" for seed in (8, 3)]
    assert fireworld("run", "quick", "--policy", "mean.npz", "--steps", 3).code == 0
    done = fireworld("policy", "mean", "mine.npz", "second.npz", "-o", "mean.npz")
    assert (done.code, "expected a name that is free" in done.err) == (2, True)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("mean", "mine.npz", "best-2026", "-o", "a.npz"), "fireworld: best-2026: expected a network, got a ranking"),
        (
            ("mean", "mine.npz", "own.npz", "-o", "a.npz"),
            "fireworld: own.npz: features: expected as in mine.npz, ['temp",
        ),
        (("mean", "mine.npz", "-o", "mine.npz", "--force"), "mine.npz"),
        (("show", "mine.npz", "1193"), "fireworld: STATE: expected none: a network has no states, got '1193'"),
        (
            ("diff", "mine.npz", "best-2026"),
            "fireworld: best-2026: expected a network, as in mine.npz, got a ranking of targets",
        ),
        (
            ("diff", "best-2026", "mine.npz"),
            "fireworld: mine.npz: expected a ranking of targets, as in best-2026, got a network",
        ),
        (
            ("diff", "mine.npz", "mine.npz", "--actions-only"),
            "fireworld: --actions-only: expected two teams with tables of actions, got two networks",
        ),
        (
            ("import", "absent.onnx", "-o", "a.npz"),
            "absent.onnx: expected an ONNX model, got No such file or directory",
        ),
        (("import", "mine.npz", "-o", "a.npz"), "mine.npz: expected an ONNX model, got "),
        (("import", "mine.npz", "-o", "mine.npz"), "mine.npz: expected "),
        (("import", "mine.npz", "-o", "absent/a.npz"), "absent"),
    ],
)
def test_what_cannot_be_done(here, fireworld, words, message):
    done = fireworld("policy", *words)
    assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
    assert message in done.err
    assert not (here / "a.npz").exists()
