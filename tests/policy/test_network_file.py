"""Files of networks, and networks made of arrays: written and read again, and every fault in one line."""

from __future__ import annotations

import json

import numpy as np
import pytest

import fireworld as fw
from fireworld.errors import TrainingError
from fireworld.policy.names import find_policy
from fireworld.policy.teams.network_layers import FEATURES
from fireworld.policy.teams.network_team import NetworkTeam
from fireworld.policy.teams.team import FORMAT, load_team, parse_team, read_team, write_team
from tests.networks import make_network, random_layers


def test_written_and_read_again(tmp_path):
    origin = {"seed": 4, "method": {"name": "ppo", "choices": "in-turn"}}
    team = make_network(provenance=origin, features=FEATURES[::-1], own_targets=True)
    for name in ("a.npz", "b.npz"):
        team.save(tmp_path / name)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    read = fw.load_team(tmp_path / "a.npz")
    assert isinstance(read, fw.NetworkTeam)
    assert (read.digest, read.provenance, read.choices) == (team.digest, origin, "in-turn")
    assert (read.features, read.activations, read.own_targets) == (FEATURES[::-1], ("tanh", "tanh"), True)
    assert read.policy().digest == team.policy().digest
    with np.load(tmp_path / "a.npz") as opened:
        assert sorted(opened) == ["biases_0", "biases_1", "biases_2", "header", "weights_0", "weights_1", "weights_2"]
        np.testing.assert_array_equal(opened["weights_1"], team.layers[1].weights)


def test_it_may_hold_more_arrays(tmp_path):
    write_team(make_network(), tmp_path / "a.npz", extra={"optimizer": np.ones(17)})
    team, more = read_team(tmp_path / "a.npz")
    assert (list(more), team.digest) == (["optimizer"], make_network().digest)


def write(path, *, left_out=(), arrays=None, **header):
    """Write the file of a network with something else in it."""
    good = make_network()
    told = {"format": FORMAT, "kind": "network", "provenance": {}, **good.header(), **header}
    told = {key: value for key, value in told.items() if key not in left_out}
    held = {**good.arrays(), **(arrays or {}), "header": np.frombuffer(json.dumps(told).encode(), dtype=np.uint8)}
    np.savez(path, **{name: array for name, array in held.items() if f"array {name}" not in left_out})


def with_number(number):
    weights = make_network().layers[1].weights.copy()
    weights[2, 3] = number
    return {"weights_1": weights}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"left_out": ("features",)}, "features: expected a list of names, as temperature, volume, got None$"),
        ({"features": "temperature"}, "features: expected a list of names, .*, got 'temperature'$"),
        ({"features": []}, r"features: expected a list of names, .*, got \[\]$"),
        ({"features": [*FEATURES[:-1], 3]}, "features: expected a list of names, "),
        ({"features": [*FEATURES[:-1], "smell"]}, "features: expected temperature, .*, site_others, got 'smell'$"),
        ({"features": [*FEATURES[:-1], "Volume"]}, "got 'Volume'; try volume$"),
        ({"features": [*FEATURES[:-1], "volume"]}, "features: expected every one once, got volume twice$"),
        (
            {"features": [*FEATURES[:-1], "easiest"], "own_targets": True},
            "features: expected no actions where targets are a brigade's own, got 'easiest'$",
        ),
        (
            {"features": list(FEATURES[:-1])},
            r"weights_0: expected float64 weights of shape \(12, 1 to 1024\), a row for each input, got float64 ",
        ),
        ({"own_targets": 1}, "own_targets: expected true or false, got 1$"),
        ({"left_out": ("own_targets",)}, "own_targets: expected true or false, got None$"),
        ({"activations": "tanh"}, "activations: expected a list, got 'tanh'$"),
        ({"activations": ["tanh", "gelu"]}, "activations: expected one of relu, tanh, got 'gelu'$"),
        ({"activations": ["tanh", ["tanh"]]}, r"activations: expected one of relu, tanh, got \['tanh'\]$"),
        ({"activations": ["tanh"] * 8}, "expected a network of 1 to 8 layers, got 9 of them$"),
        ({"activations": ["tanh"] * 3}, "expected a team file, got no biases_3, weights_3 in it$"),
        ({"activations": ["tanh"]}, "(weights|biases)_2: expected the arrays of 2 layers, got "),
        ({"smell": 1}, "smell: expected features, activations, own_targets and nothing else, got 'smell'$"),
        ({"left_out": ("array biases_1",)}, "expected a team file, got no biases_1 in it$"),
        ({"arrays": {"weights_3": np.zeros((1, 1))}}, "weights_3: expected the arrays of 3 layers, got 'weights_3'$"),
        ({"arrays": {"weights_0": np.zeros((13, 7), "<f4")}}, r"weights_0: .*, got float32 \(13, 7\)$"),
        ({"arrays": {"weights_0": np.zeros((7, 13))}}, r"got float64 \(7, 13\); torch .*, take weight.T$"),
        ({"arrays": {"weights_0": np.zeros((13, 0))}}, r"got float64 \(13, 0\)$"),
        ({"arrays": {"weights_0": np.zeros((13, 1025))}}, r"got float64 \(13, 1025\)$"),
        ({"arrays": {"weights_0": np.zeros(13)}}, r"got float64 \(13,\)$"),
        ({"arrays": {"weights_2": np.zeros((5, 2))}}, r"weights of shape \(5, 1\), .* got float64 \(5, 2\)$"),
        ({"arrays": {"biases_0": np.zeros((7, 1))}}, r"biases_0: expected float64 biases of shape \(7,\), got "),
        ({"arrays": {"biases_0": np.zeros(7, "<i8")}}, r"biases_0: .*, got int64 \(7,\)$"),
        ({"arrays": with_number(np.nan)}, r"weights_1\[2, 3\]: expected a finite number, got nan$"),
        ({"arrays": {"biases_1": np.full(5, np.inf)}}, r"biases_1\[0\]: expected a finite number, got inf$"),
        ({"arrays": with_number(-2e9)}, r"weights_1: expected numbers of at most 1e\+09 in size, got 2000000000.0$"),
        ({"arrays": {"weights_1": np.array([{}])}}, "ValueError: Object arrays cannot be loaded"),
        ({"kind": "networks"}, "kind: expected one of network, ranking, tables, got 'networks'"),
    ],
)
def test_what_is_wrong_with_a_file(tmp_path, changes, message):
    write(tmp_path / "bad.npz", **changes)
    for read in (
        lambda: parse_team((tmp_path / "bad.npz").read_bytes(), source="bad"),
        lambda: find_policy(str(tmp_path / "bad.npz")),
    ):
        with pytest.raises(TrainingError, match=message) as caught:
            read()
        assert "bad" in str(caught.value).partition(":")[0]
        assert "\n" not in str(caught.value)


def test_the_file_that_is_altered_there_is_good(tmp_path):
    write(tmp_path / "good.npz")
    assert load_team(tmp_path / "good.npz").digest == make_network().digest


def test_damaged_files(tmp_path):
    make_network().save(tmp_path / "a.npz")
    good = (tmp_path / "a.npz").read_bytes()
    n_refused = 0
    for place in range(40, len(good) - 40, 23):
        bad = bytearray(good)
        bad[place] ^= 0x5A
        try:
            read = parse_team(bytes(bad), source="a")
        except TrainingError:
            n_refused += 1
        else:
            assert read.digest == make_network().digest, "damaged where nothing is told"
    assert n_refused > 20


@pytest.mark.parametrize("kind", ["<f2", "<f4", "<f8", ">f4"])
def test_floats_of_any_kind_become_doubles(kind):
    layers = [(weights.astype(kind), biases.astype(kind)) for weights, biases in random_layers(13, 4, 1)]
    team = NetworkTeam.from_layers(layers, activation=["relu"])
    for made, given in zip(team.layers, layers, strict=True):
        assert [array.dtype for array in made] == [np.float64] * 2
        assert [array.tolist() for array in made] == [array.tolist() for array in given]
    listed = [(weights.tolist(), biases.tolist()) for weights, biases in layers]
    assert NetworkTeam.from_layers(listed, activation="relu").digest == team.digest


def test_what_was_given_can_change_afterwards():
    layers = random_layers(13, 4, 1)
    team = NetworkTeam.from_layers(layers, activation="relu")
    before = team.digest
    layers[0][0][:] = 0.0
    assert team.digest == before


class Attached:
    """A tensor that a gradient hangs on."""

    def __array__(self, dtype=None, copy=None):
        raise RuntimeError("Can't call numpy() on Tensor that requires grad.\nUse tensor.detach().numpy() instead.")


GOOD = random_layers(13, 4, 1)


@pytest.mark.parametrize(
    ("layers", "more", "message"),
    [
        (GOOD, {}, r"activations: expected one of relu, tanh for each of 2 layers but the last, got \(\)$"),
        (GOOD, {"activation": "gelu"}, "activations: expected one of relu, tanh, got 'gelu'$"),
        (GOOD, {"activation": ["relu", "relu"]}, "activations: expected one of relu, tanh for each of 2 layers"),
        (GOOD, {"activation": None}, "activations: expected .*, got None$"),
        (GOOD[:1], {"activation": "relu"}, r"weights_0: .* of shape \(13, 1\), .*, got float64 \(13, 4\)$"),
        (GOOD[1:], {"activation": "gelu"}, "got 'gelu'$"),
        ([], {}, "NetworkTeam: expected a network of 1 to 8 layers, got 0 of them$"),
        (GOOD[0][0], {}, "layers: expected a list of pairs: weights, biases, got 'ndarray'$"),
        (GOOD * 5, {"activation": "relu"}, "got 10 of them$"),
        (
            [GOOD[0][0], GOOD[1]],
            {"activation": "relu"},
            r"layers\[0\]: expected a pair: weights, biases, got 'ndarray'$",
        ),
        ([(GOOD[0][0].T, GOOD[0][1]), GOOD[1]], {"activation": "relu"}, "take weight.T$"),
        ([GOOD[0], (Attached(), GOOD[1][1])], {"activation": "relu"}, "weights_1: .*, got RuntimeError: Can't call "),
        ([GOOD[0], ([["a"]], [1.0])], {"activation": "relu"}, "weights_1: expected an array of float16, .*, got <U1 "),
        ([GOOD[0], ([[1], [2, 3]], [1.0])], {"activation": "relu"}, "weights_1: expected an array of float16"),
        ([([[1]] * 13, [0.5])], {}, r"weights_0: expected an array of float16, .*, got int64 \(13, 1\)$"),
        (GOOD, {"activation": "relu", "features": "volume"}, "features: expected a list of names"),
        (GOOD, {"activation": "relu", "own_targets": None}, "own_targets: expected true or false, got None$"),
        (GOOD, {"activation": "relu", "provenance": {"by": object()}}, "provenance: expected keys and plain values, "),
    ],
)
def test_what_is_wrong_with_arrays(layers, more, message):
    with pytest.raises(TrainingError, match=message) as caught:
        NetworkTeam.from_layers(layers, **more)
    assert str(caught.value).startswith("NetworkTeam: ")
    assert "\n" not in str(caught.value)
