"""ONNX models, altered or made up: only complaints come out, or a network."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fireworld.policy.teams.network_team import NetworkTeam
from tests.fuzz.support import FUZZ, altered, file_of, only_complaints, target
from tests.fuzz.test_networks import use

onnx = pytest.importorskip("onnx")
pytestmark = pytest.mark.slow
helper = onnx.helper

FEATURES = ["mine", "volume"]
KINDS = ["Gemm", "MatMul", "Add", "Relu", "Tanh", "Constant", "Identity", "If"]


def model(nodes, tensors, *, inputs=("x",), outputs=("y",)) -> bytes:
    """A model of nodes and constants."""
    values = [helper.make_tensor_value_info(name, 1, [None, 2]) for name in (*inputs, *outputs)]
    graph = helper.make_graph(nodes, "net", values[: len(inputs)], values[len(inputs) :], tensors)
    return helper.make_model(graph).SerializeToString()


def tensor(name, *shape):
    return onnx.numpy_helper.from_array(np.linspace(-1, 1, int(np.prod(shape)), dtype="<f4").reshape(shape), name)


GOOD = model(
    [
        helper.make_node("Gemm", ["x", "w", "b"], ["1"], "first", transB=1),
        helper.make_node("Relu", ["1"], ["2"], "relu"),
        helper.make_node("MatMul", ["2", "v"], ["y"], "second"),
    ],
    [tensor("w", 3, 2), tensor("b", 3), tensor("v", 3, 1)],
)


def use_model(data: bytes) -> None:
    path = file_of(data, "net.onnx")
    with only_complaints():
        use(NetworkTeam.from_onnx(path, features=FEATURES))


@target
@FUZZ
@given(altered(GOOD))
def test_onnx_bytes(data):
    use_model(data)


names = st.sampled_from(["x", "1", "2", "y", "w", "b", "v", ""])
values = st.one_of(st.integers(-1, 2), st.floats(allow_nan=False), st.just("a"), st.just(tensor("c", 2, 2)))
attributes = st.dictionaries(st.sampled_from(["alpha", "beta", "transA", "transB", "value", "to"]), values, max_size=2)
nodes = st.builds(
    lambda kind, given, made, more: helper.make_node(kind, given, made, **more),
    st.sampled_from(KINDS),
    st.lists(names, max_size=3),
    st.lists(names, max_size=2),
    attributes,
)


@target
@FUZZ
@given(st.lists(nodes, max_size=6), st.lists(names, max_size=2), st.lists(names, max_size=2))
def test_onnx_nodes(made, inputs, outputs):
    use_model(model(made, [tensor("w", 2, 2), tensor("b", 2), tensor("v", 2, 1)], inputs=inputs, outputs=outputs))


shapes = st.lists(st.sampled_from([-1, 0, 1, 2, 3, 1024, 2**31, 2**62]), max_size=3)
places = st.dictionaries(
    st.sampled_from(["location", "offset", "length", "odd"]),
    st.sampled_from(["net.onnx", "..", "/dev/zero", "absent", "0", "-1", "9" * 5000, "\u0663", ""]),
)


@target
@FUZZ
@given(shapes, st.integers(0, 30), st.binary(max_size=40), places, st.booleans())
def test_onnx_tensors(shape, kind, raw, places, beside):
    weights = onnx.TensorProto(name="w", dims=shape, data_type=kind, raw_data=raw)
    if beside:
        weights.data_location = onnx.TensorProto.EXTERNAL
    for key, value in places.items():
        weights.external_data.add(key=key, value=value)
    use_model(model([helper.make_node("MatMul", ["x", "w"], ["y"])], [weights]))


def test_the_good_model_is_read():
    use(NetworkTeam.from_onnx(file_of(GOOD, "net.onnx"), features=FEATURES))
