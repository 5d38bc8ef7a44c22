"""Networks of ONNX models, of those that are nothing but layers of weighted sums with Relu or Tanh between them."""

from __future__ import annotations

import importlib
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from fireworld.arguments import path_of
from fireworld.errors import TrainingError, described, expected, shown
from fireworld.files import read_input
from fireworld.kernels.arrays import Array
from fireworld.policy.teams.network_layers import N_LAYERS_MAX, WIDTH_MAX

BYTES_MAX: Final = 1 << 27
"""Of a model, and of a file with its weights: above the largest network in double precision."""
MISSING: Final = "ONNX: the package onnx, which reads models, is not installed; try pip install 'fireworld[onnx]'"
AFTER_SUMS: Final = {"Relu": "relu", "Tanh": "tanh"}
KNOWN: Final = ("Gemm", "MatMul", "Add", *AFTER_SUMS, "Constant")


class OnnxModel(NamedTuple):
    """What a model consists of."""

    layers: Sequence[tuple[Array, Array]]
    """Weights (inputs, outputs) and biases (outputs,) of each layer."""
    activations: Sequence[str]
    """What comes after each layer but the last."""
    producer: str
    """What wrote the model, as it says."""


def read_onnx(path: str | os.PathLike[str]) -> OnnxModel:
    """Read a model; files with weights that it names are beside it.

    Raises:
        TrainingError: the package onnx is not installed, the file is no ONNX model, or there is something else in it:
            its node is named.
    """
    file = path_of("model", path)
    content = read_input(file, what="an ONNX model", n_bytes_max=BYTES_MAX, error=TrainingError)
    onnx = _onnx()
    errors = importlib.import_module("google.protobuf.message")
    try:
        model = onnx.ModelProto.FromString(content)
    except (errors.DecodeError, ValueError) as error:
        raise TrainingError(expected(str(file), "", "an ONNX model", described(error))) from None
    producer = " ".join(filter(None, (model.producer_name, model.producer_version)))
    return OnnxModel(*_Chain(file, onnx, model.graph).read(), producer)


def _onnx() -> Any:
    """Import the package onnx."""
    try:
        return importlib.import_module("onnx")
    except ImportError:
        raise TrainingError(MISSING) from None


@dataclass
class _Chain:
    """The nodes of a graph, each of which takes what comes out of the one before."""

    file: Path
    onnx: Any
    graph: Any
    layers: list[tuple[Array, Array | None]] = field(default_factory=list)
    activations: list[str] = field(default_factory=list)
    at: str = ""
    """What the output of the last node is called."""
    constants: dict[str, Any] = field(default_factory=dict)

    def read(self) -> tuple[list[tuple[Array, Array]], list[str]]:
        """Go through the graph; return its layers and what comes between them."""
        self.constants = {tensor.name: tensor for tensor in self.graph.initializer}
        inputs = [one.name for one in self.graph.input if one.name not in self.constants]
        if len(inputs) != 1 or len(self.graph.output) != 1:
            found = f"{len(inputs)} and {len(self.graph.output)}"
            raise TrainingError(expected(str(self.file), "", "an ONNX model with one input and one output", found))
        self.at = inputs[0]
        for node in self.graph.node:
            self._take(node)
        if not self.layers:
            raise TrainingError(expected(str(self.file), "", "an ONNX model with a Gemm or MatMul", "none of them"))
        last, output = self.graph.node[-1], self.graph.output[0].name
        if self._is_between:
            raise self._wrong(last, "no activation after the last layer", last.op_type)
        if output != self.at:
            raise self._wrong(last, f"the model's output, {shown(output)}", self.at)
        none = [np.zeros(weights.shape[1]) for weights, _ in self.layers]
        pairs = zip(self.layers, none, strict=True)
        return [(weights, zeros if biases is None else biases) for (weights, biases), zeros in pairs], self.activations

    @property
    def _is_between(self) -> bool:
        """Whether the next node begins a layer."""
        return len(self.activations) == len(self.layers)

    def _take(self, node: Any) -> None:
        """Take one node, which continues the chain."""
        kind = node.op_type if node.domain in ("", "ai.onnx") else f"{node.domain}.{node.op_type}"
        if kind not in KNOWN:
            raise self._wrong(node, f"one of {', '.join(KNOWN)}", kind)
        if kind == "Constant":
            self._keep(node)
            return
        inputs = list(node.input)
        if kind == "Add" and self.at in inputs[1:]:
            inputs.reverse()
        if len(node.output) != 1 or not inputs or inputs[0] != self.at:
            raise self._wrong(node, f"the output of the node before, {shown(self.at)}, as its input", inputs)
        if kind in AFTER_SUMS:
            if self._is_between:
                raise self._wrong(node, "a layer before it", kind)
            self.activations.append(AFTER_SUMS[kind])
        elif kind == "Add":
            self._add_biases(node, inputs)
        else:
            self._add_layer(node, inputs, is_gemm=kind == "Gemm")
        self.at = node.output[0]

    def _add_biases(self, node: Any, inputs: list[str]) -> None:
        """Give the layer of a MatMul its biases."""
        if self._is_between or self.layers[-1][1] is not None:
            raise self._wrong(node, "a MatMul before it", node.op_type)
        weights, _ = self.layers[-1]
        self.layers[-1] = weights, self._biases(node, inputs[1:], weights.shape[1])

    def _add_layer(self, node: Any, inputs: list[str], *, is_gemm: bool) -> None:
        """Add the layer of a Gemm or MatMul."""
        if not self._is_between:
            raise self._wrong(node, "Relu or Tanh between two layers", node.op_type)
        if len(self.layers) == N_LAYERS_MAX:
            raise self._wrong(node, f"at most {N_LAYERS_MAX} layers", "one more")
        how = {one.name: one.f if one.name in ("alpha", "beta") else one.i for one in node.attribute}
        turned = is_gemm and how.pop("transB", 0) != 0
        plain = {"alpha": 1.0, "beta": 1.0, "transA": 0}
        odd = [f"{name} {value}" for name, value in how.items() if value != plain.get(name)]
        if odd or not 2 <= len(inputs) <= 2 + is_gemm:
            wanted = "alpha 1, beta 1, transA 0, and weights" if is_gemm else "weights"
            raise self._wrong(node, wanted, ", ".join(odd) or f"{len(inputs)} inputs")
        weights = self._constant(node, inputs[1])
        if weights.ndim != 2:
            raise self._wrong(node, "weights of two dimensions", weights.shape)
        weights = weights.T if turned else weights
        biases = self._biases(node, inputs[2:], weights.shape[1]) if any(inputs[2:]) else None
        self.layers.append((weights, biases))

    def _biases(self, node: Any, names: list[str], n_outputs: int) -> Array:
        biases = self._constant(node, names[0] if len(names) == 1 else "")
        if biases.shape not in ((n_outputs,), (1, n_outputs)):
            raise self._wrong(node, f"biases of shape ({n_outputs},)", biases.shape)
        return biases.reshape(n_outputs)

    def _keep(self, node: Any) -> None:
        """Note the value of a Constant."""
        if len(node.output) != 1 or len(node.attribute) != 1 or node.attribute[0].name != "value":
            raise self._wrong(node, "a constant with one value, a tensor", [one.name for one in node.attribute])
        self.constants[node.output[0]] = node.attribute[0].t

    def _constant(self, node: Any, name: str) -> Array:
        """Return a constant that a node takes."""
        tensor, types = self.constants.get(name), self.onnx.TensorProto
        if tensor is None:
            raise self._wrong(node, "weights and biases that are constants", name)
        sizes = {types.FLOAT: 4, types.DOUBLE: 8}
        shape = tuple(tensor.dims)
        if tensor.data_type not in sizes or len(shape) > 2 or not all(1 <= size <= WIDTH_MAX for size in shape):
            wanted = f"float or double numbers, at most {WIDTH_MAX} x {WIDTH_MAX}"
            raise self._wrong(node, wanted, f"{shown(name)} of type {tensor.data_type}, shape {shape}")
        if tensor.data_location == types.EXTERNAL:
            tensor = self._beside(node, tensor, int(np.prod(shape)) * sizes[tensor.data_type])
        try:
            return np.asarray(self.onnx.numpy_helper.to_array(tensor))
        except (ValueError, TypeError) as error:
            raise self._wrong(node, f"the numbers of {shown(name)}", described(error)) from None

    def _beside(self, node: Any, tensor: Any, n_bytes: int) -> Any:
        """Return a tensor with its numbers, which are in a file beside the model."""
        entries = {one.key: one.value for one in tensor.external_data}
        name, offset = entries.get("location", ""), entries.get("offset", "0")
        if not name or name in (".", "..") or set(name) & set("/\\\0") or not (offset.isascii() and offset.isdigit()):
            raise self._wrong(node, "the name of a file beside the model, and an offset", f"{shown(name)}, {offset}")
        what = "a file with the weights of an ONNX model"
        content = read_input(self.file.parent / name, what=what, n_bytes_max=BYTES_MAX, error=TrainingError)
        numbers = content[int(offset[:20]) :][:n_bytes]
        return self.onnx.TensorProto(dims=tensor.dims, data_type=tensor.data_type, raw_data=numbers)

    def _wrong(self, node: Any, wanted: str, got: object) -> TrainingError:
        """Return the error of a node."""
        name = node.name or (node.output[0] if node.output else "")
        return TrainingError(expected(str(self.file), f"node {shown(name)} ({shown(node.op_type)[1:-1]})", wanted, got))
