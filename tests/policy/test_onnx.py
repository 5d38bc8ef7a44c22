"""Networks of ONNX models: what plain ones come to, and what is refused, with the name of its node."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from fireworld.arguments import ArgumentError
from fireworld.errors import TrainingError
from fireworld.policy.teams import onnx_file
from fireworld.policy.teams.network_layers import FEATURES
from fireworld.policy.teams.network_team import NetworkTeam
from tests.networks import random_layers

onnx = pytest.importorskip("onnx")
helper, numpy_helper = onnx.helper, onnx.numpy_helper

LAYERS = [(weights.astype("<f4"), biases.astype("<f4")) for weights, biases in random_layers(13, 6, 1)]


def node(kind, inputs, output, **attributes):
    return helper.make_node(kind, inputs.split(), [output], name=f"{kind}-{output}", **attributes)


GEMMS = [
    node("Gemm", "x w0 b0", "1", transB=1),
    node("Tanh", "1", "2"),
    node("Gemm", "2 w1 b1", "y", alpha=1.0, beta=1.0, transB=1),
]
SUMS = [
    node("MatMul", "x w0", "1"),
    node("Add", "1 b0", "2"),
    node("Relu", "2", "3"),
    node("MatMul", "3 w1", "4"),
    node("Add", "b1 4", "y"),
]


def make(nodes, *, turned=False, inputs=("x",), outputs=("y",), arrays=None, **others):
    """A model with the constants w0, b0, w1 and b1."""
    held = {}
    for k, (weights, biases) in enumerate(LAYERS):
        held |= {f"w{k}": weights.T if turned else weights, f"b{k}": biases}
    held |= arrays or {}
    values = [helper.make_tensor_value_info(name, onnx.TensorProto.FLOAT, [None, 13]) for name in (*inputs, *outputs)]
    tensors = [numpy_helper.from_array(np.ascontiguousarray(array), name) for name, array in held.items()]
    graph = helper.make_graph(nodes, "net", values[: len(inputs)], values[len(inputs) :], tensors)
    return helper.make_model(graph, producer_name="pytorch", producer_version="2.9", **others)


def saved(path, model):
    path.write_bytes(model.SerializeToString())
    return path


def assert_same(team, activation):
    assert team.digest == NetworkTeam.from_layers(LAYERS, activation=activation).digest


def test_gemms_as_torch_writes_them(tmp_path):
    team = NetworkTeam.from_onnx(saved(tmp_path / "net.onnx", make(GEMMS, turned=True)))
    assert_same(team, "tanh")
    assert team.provenance == {"producer": "pytorch 2.9"}
    assert team.features == FEATURES


def test_matrix_products_and_sums(tmp_path):
    assert_same(NetworkTeam.from_onnx(saved(tmp_path / "net.onnx", make(SUMS))), "relu")
    wide = {"b0": LAYERS[0][1][None], "w0": LAYERS[0][0].astype("<f8")}
    assert_same(NetworkTeam.from_onnx(str(saved(tmp_path / "net.onnx", make(SUMS, arrays=wide)))), "relu")


def test_layers_without_biases(tmp_path):
    nodes = [node("MatMul", "x w0", "1"), node("Relu", "1", "2"), node("Gemm", "2 w1", "y")]
    team = NetworkTeam.from_onnx(saved(tmp_path / "net.onnx", make(nodes)))
    assert [layer.biases.tolist() for layer in team.layers] == [[0.0] * 6, [0.0]]


def test_constants_that_are_nodes(tmp_path):
    tensor = numpy_helper.from_array(LAYERS[0][0], "any")
    nodes = [node("Constant", "", "c", value=tensor), node("MatMul", "x c", "1"), *SUMS[1:]]
    assert_same(NetworkTeam.from_onnx(saved(tmp_path / "net.onnx", make(nodes))), "relu")


@pytest.mark.parametrize("opset", [7, 9, 13, 18, 21])
def test_of_any_opset(tmp_path, opset):
    model = make(SUMS, opset_imports=[helper.make_opsetid("", opset)])
    assert_same(NetworkTeam.from_onnx(saved(tmp_path / "net.onnx", model)), "relu")


def test_weights_in_a_file_of_their_own(tmp_path):
    """As newer versions of torch write them."""
    (tmp_path / "far").mkdir()
    path = tmp_path / "far" / "net.onnx"
    onnx.save_model(make(SUMS), path, save_as_external_data=True, location="net.onnx.data", size_threshold=0)
    assert (path.parent / "net.onnx.data").stat().st_size > 300
    assert_same(NetworkTeam.from_onnx(path), "relu")
    data = (path.parent / "net.onnx.data").read_bytes()
    (path.parent / "net.onnx.data").write_bytes(data[:100])
    with pytest.raises(TrainingError, match=r"node 'MatMul-1' \(MatMul\): expected the numbers of 'w0', got "):
        NetworkTeam.from_onnx(path)
    (path.parent / "net.onnx.data").unlink()
    with pytest.raises(TrainingError, match=r"net.onnx.data: expected a file with the weights of an ONNX model, got "):
        NetworkTeam.from_onnx(path)


@pytest.mark.parametrize(
    ("location", "offset"), [("/etc/passwd", "0"), ("../w", "0"), ("", "0"), ("..", "0"), ("w", "-1"), ("w", "x")]
)
def test_weights_elsewhere_are_refused(tmp_path, location, offset):
    model = make(SUMS)
    tensor = model.graph.initializer[0]
    tensor.data_location = onnx.TensorProto.EXTERNAL
    for key, value in (("location", location), ("offset", offset)):
        tensor.external_data.add(key=key, value=value)
    with pytest.raises(TrainingError, match="expected the name of a file beside the model, and an offset, got "):
        NetworkTeam.from_onnx(saved(tmp_path / "net.onnx", model))


def test_what_it_reads_and_values(tmp_path):
    path = saved(tmp_path / "net.onnx", make(SUMS))
    team = NetworkTeam.from_onnx(path, features=FEATURES[::-1], own_targets=True, provenance={"seed": 3})
    assert (team.features, team.own_targets) == (FEATURES[::-1], True)
    assert team.provenance == {"producer": "pytorch 2.9", "seed": 3}
    with pytest.raises(TrainingError, match=r"net.onnx: weights_0: expected float64 weights of shape \(2, 1 to 1024\)"):
        NetworkTeam.from_onnx(path, features=["volume", "mine"])


DEEP = [one for k in range(9) for one in (node("MatMul", f"{k}r v", f"{k}"), node("Relu", f"{k}", f"{k + 1}r"))]
IDENTITY = {"v": np.eye(13, dtype="<f4")}


@pytest.mark.parametrize(
    ("nodes", "changes", "message"),
    [
        (
            [*SUMS[:2], node("Gelu", "2", "3"), *SUMS[3:]],
            {},
            r"node 'Gelu-3' \(Gelu\): expected one of Gemm, .*'Gelu'$",
        ),
        ([node("Sub", "x b0", "0"), *SUMS], {}, r"node 'Sub-0' \(Sub\): "),
        ([helper.make_node("Relu", ["x"], ["1"], domain="my.own")], {}, r"node '1' \(Relu\): .*, got 'my.own.Relu'$"),
        (SUMS[1:], {}, r"node 'Add-2' \(Add\): expected the output of the node before, 'x', as its input, got "),
        ([*SUMS[:3], node("Add", "3 x", "4")], {}, r"node 'Add-4' \(Add\): expected a MatMul before it, got 'Add'$"),
        ([*SUMS, node("Add", "y y", "z")], {}, r"node 'Add-z' \(Add\): expected a MatMul before it"),
        ([node("Add", "x b0", "y")], {}, r"node 'Add-y' \(Add\): expected a MatMul before it"),
        ([node("Relu", "x", "y")], {}, r"node 'Relu-y' \(Relu\): expected a layer before it"),
        ([*SUMS[:3], node("Tanh", "3", "4")], {}, r"node 'Tanh-4' \(Tanh\): expected a layer before it"),
        (
            [*SUMS[:2], node("MatMul", "2 w1", "y")],
            {},
            r"'MatMul-y' \(MatMul\): expected Relu or Tanh between two layers",
        ),
        (SUMS[:3], {"outputs": ("3",)}, r"node 'Relu-3' \(Relu\): expected no activation after the last layer"),
        (SUMS, {"outputs": ("3",)}, r"node 'Add-y' \(Add\): expected the model's output, '3', got 'y'$"),
        (SUMS, {"inputs": ("x", "z")}, "expected an ONNX model with one input and one output, got 2 and 1$"),
        (SUMS, {"outputs": ("y", "3")}, "expected an ONNX model with one input and one output, got 1 and 2$"),
        ([], {}, "expected an ONNX model with a Gemm or MatMul, got none of them$"),
        ([node("MatMul", "x x", "y")], {}, r"\(MatMul\): expected weights and biases that are constants, got 'x'$"),
        ([node("Gemm", "x w0 b0", "y", alpha=0.5)], {}, r"\(Gemm\): expected alpha 1, .*, got alpha 0.5$"),
        ([node("Gemm", "x w0 b0", "y", transA=1)], {}, r"\(Gemm\): expected alpha 1, .*, got transA 1$"),
        ([node("Gemm", "x w0 b1", "y")], {}, r"\(Gemm\): expected biases of shape \(6,\), got \(1,\)$"),
        ([node("Gemm", "x", "y")], {}, r"\(Gemm\): expected alpha 1, .*, and weights, got 1 inputs$"),
        ([node("MatMul", "x b0", "y")], {}, r"\(MatMul\): expected weights of two dimensions, got \(6,\)$"),
        (
            SUMS,
            {"arrays": {"w0": LAYERS[0][0].astype("<i8")}},
            r"node 'MatMul-1' .*: expected float or double numbers, ",
        ),
        (
            SUMS,
            {"arrays": {"w0": np.zeros((13, 1025), "<f4")}},
            r"expected float or double numbers, at most 1024 x 1024",
        ),
        (
            SUMS,
            {"arrays": {"w0": np.zeros((13, 6, 1), "<f4")}},
            r"expected float or double numbers, at most 1024 x 1024",
        ),
        (SUMS, {"arrays": {"w0": np.full((13, 6), np.nan, "<f4")}}, r"weights_0\[0, 0\]: expected a finite number"),
        (SUMS, {"arrays": {"w1": np.zeros((6, 2), "<f4")}}, r"node 'Add-y' \(Add\): expected biases of shape \(2,\)"),
        ([node("Constant", "", "c", value_float=1.0), *SUMS], {}, r"\(Constant\): expected a constant with one value"),
        (DEEP, {"inputs": ("0r",), "arrays": IDENTITY}, r"node 'MatMul-8' \(MatMul\): expected at most 8 layers"),
    ],
)
def test_what_is_refused(tmp_path, nodes, changes, message):
    path = saved(tmp_path / "net.onnx", make(nodes, **changes))
    with pytest.raises(TrainingError, match=message) as caught:
        NetworkTeam.from_onnx(path)
    assert str(caught.value).startswith(str(path))
    assert str(caught.value).isprintable()


@pytest.mark.parametrize("content", [b"\x00", b"PK\x03\x04 and more", b"no model", b"\xff" * 40])
def test_other_files(tmp_path, content):
    (tmp_path / "net.onnx").write_bytes(content)
    with pytest.raises(TrainingError, match=r"net.onnx: expected an ONNX model"):
        NetworkTeam.from_onnx(tmp_path / "net.onnx")


def test_no_file(tmp_path):
    with pytest.raises(TrainingError, match=r"net\.onnx: expected an ONNX model, got No such file or directory$"):
        NetworkTeam.from_onnx(tmp_path / "net.onnx")
    with pytest.raises(TrainingError, match=r"expected an ONNX model, got Is a directory$"):
        NetworkTeam.from_onnx(tmp_path)
    with pytest.raises(ArgumentError, match=r"model: expected the path of a file, got None$"):
        NetworkTeam.from_onnx(None)


def test_a_model_that_is_too_large(tmp_path, monkeypatch):
    monkeypatch.setattr(onnx_file, "BYTES_MAX", 100)
    with pytest.raises(TrainingError, match="expected an ONNX model of at most 100 bytes, got "):
        NetworkTeam.from_onnx(saved(tmp_path / "net.onnx", make(SUMS)))


def test_without_the_package(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "onnx", None)
    with pytest.raises(
        TrainingError, match=r"the package onnx, .* is not installed; try pip install 'fireworld\[onnx\]'"
    ):
        NetworkTeam.from_onnx(saved(tmp_path / "net.onnx", make(SUMS)))
