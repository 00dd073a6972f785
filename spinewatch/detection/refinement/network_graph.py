"""The layers of ball networks, and their evaluation by ONNX Runtime, without the interpreter lock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from onnx import GraphProto, NodeProto, TensorProto, ValueInfoProto, helper, numpy_helper
from onnxruntime import InferenceSession, SessionOptions

from spinewatch.arrays import Single
from spinewatch.detection.refinement.lighting import N_INPUTS

_OPERATORS, _FORMAT = 17, 8
"""Versions of ONNX's set of operators and of its format: all that is used here has been in them since 2022."""


@dataclass(frozen=True, eq=False)
class Layer:
    """A convolution without padding.

    Attributes
    ----------
    weights
        Shape (h, w, channels in, channels out).
    bias
        Shape (channels out,).
    stride
        Step between windows, samples.
    lighting
        Added to the bias per input of the light, shape (k, channels out); None where it is no input.
    """

    weights: Single
    bias: Single
    stride: int
    lighting: Single | None = None


class NetworkGraph:
    """A network that ONNX Runtime is ready to evaluate.

    It has no thread of its own: it may be made before a process is forked, and several threads may call it at the same
    time. Equal calls give equal results, bit for bit, on the same processor.

    Parameters
    ----------
    layers
        Layers, first to last; the last has a single window.
    size
        Samples per side of a patch.

    Examples
    --------
    >>> mean = Layer(np.full((2, 2, 1, 1), 0.25, np.float32), np.zeros(1, np.float32), 1)
    >>> NetworkGraph([mean], 2)(np.array([[[[1, 2], [3, 4]]]], np.float32), np.zeros(7, np.float32))
    array([[2.5]], dtype=float32)
    """

    def __init__(self, layers: Sequence[Layer], size: int) -> None:
        options = SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        model = helper.make_model(
            _graph(layers, size), opset_imports=[helper.make_opsetid("", _OPERATORS)], ir_version=_FORMAT
        )
        providers = ["CPUExecutionProvider"]
        self._session = InferenceSession(model.SerializeToString(), options, providers=providers)
        self._channels = len(layers[-1].bias)

    def __call__(self, patches: Single, lighting: Single) -> Single:
        """Return the outputs of patches.

        Parameters
        ----------
        patches
            Images of each patch, shape (n, channels in, size, size).
        lighting
            Inputs of the light, shape (k,), or of the light of each patch, shape (n, k).

        Returns
        -------
        Single
            Channels of the last layer, shape (n, k).
        """
        if not len(patches):  # some of ONNX Runtime's operators refuse empty arrays
            return np.empty((0, self._channels), np.float32)
        inputs = {"patches": patches, "lighting": np.atleast_2d(lighting)[..., None, None]}
        (outputs,) = self._session.run(None, inputs)
        return np.asarray(outputs)


def _graph(layers: Sequence[Layer], size: int) -> GraphProto:
    """Return the graph of a network for patches (n, channels in, size, size) and the light (1 or n, k, 1, 1).

    Layers whose window is all of their input are products of matrices, which take half the time of convolutions.
    """
    nodes: list[NodeProto] = []
    constants: list[TensorProto] = []

    def node(operator: str, *inputs: str, **attributes: Any) -> str:
        """Append a node; return the name of its output."""
        name = f"{operator} {len(nodes)}"
        nodes.append(helper.make_node(operator, inputs, [name], **attributes))
        return name

    def constant(values: NDArray[np.float32]) -> str:
        name = f"constant {len(constants)}"
        constants.append(numpy_helper.from_array(np.ascontiguousarray(values), name))
        return name

    x, side = "patches", size
    for layer in layers:
        kernel, bias = layer.weights.transpose(3, 2, 0, 1), constant(layer.bias)
        covered = side == len(layer.weights)
        if covered:
            x = node("Gemm", node("Flatten", x), constant(kernel.reshape(len(kernel), -1)), bias, transB=1)
        else:
            x = node("Conv", x, constant(kernel), bias, strides=[layer.stride] * 2)
        side = (side - len(layer.weights)) // layer.stride + 1
        if layer.lighting is not None:
            shift = node("Conv", "lighting", constant(layer.lighting.T[:, :, None, None]))
            x = node("Add", x, node("Flatten", shift) if covered else shift)
        if layer is not layers[-1]:
            x = node("Relu", x)
    nodes.append(helper.make_node("Flatten", [x], ["outputs"]))

    def value(name: str, *shape: int | str) -> ValueInfoProto:
        return helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)

    inputs = [
        value("patches", "n", layers[0].weights.shape[2], size, size),
        value("lighting", "m", N_INPUTS, 1, 1),
    ]
    return helper.make_graph(nodes, "ball", inputs, [value("outputs", "n", "k")], constants)
