"""From trained weights to files: the bundle that the runtime loads, and ONNX for everything else.

Neither is written before it was compared with what it comes from.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ambulo import _core
from ambulo.data import Dataset, Rows
from ambulo.model import Model
from ambulo.normalisation import Normalisation, normalisation

if TYPE_CHECKING:
    import onnx

# Largest difference from the network that was trained, in deviations of an output.
PARITY = 1e-5
# Largest difference of the ONNX graph, relative to the number or to its deviation.
ONNX_PARITY = 1e-4
OPSET = 17
# Goes with opset 17, so that runtimes of that time read the file.
IR_VERSION = 8
# Inputs with a larger deviation are hidden from the network: see `normalisation.HIDDEN`.
_HIDDEN = 1e6

Params = Sequence[dict[str, NDArray[np.float32]]]
"""`models.pfnn.Params` as arrays: weight (inputs, 4 × outputs), bias (4 × outputs,)."""


class ExportError(ValueError):
    """A model cannot be written; the message says why."""


# -- the bundle -------------------------------------------------------------------------------


def bundle(
    params: Params,
    scale: Normalisation,
    dataset: Dataset,
    provenance: dict[str, str],
    tuning: dict[str, Any] | None = None,
) -> Model:
    """A model from weights, with everything the data set says that a runtime needs.

    Raises:
        ExportError: no licence, or something that the runtime refuses.
    """
    if not dataset.licence.strip():
        raise ExportError("the data set names no licence; a model without one is not written")
    header = {
        "format": 1,
        "kind": "pfnn",
        "activation": "elu",
        "fps": dataset.fps,
        "layout": dataset.layout,
        "licence": dataset.licence,
        "provenance": provenance,
        "parts": {**dataset.parts, **({"tuning": tuning} if tuning else {})},
    }
    layers = [(_points(layer["weight"]), layer["bias"].reshape(4, -1)) for layer in params]
    numbers = (scale.input_mean, scale.input_std, scale.output_mean, scale.output_std)
    try:
        core = _core.Model.build(json.dumps(header), layers, *numbers)
        # Skeleton, feet and tuning are read by the controller only.
        _core.Controller(core)
    except ValueError as error:
        raise ExportError(f"the runtime refuses such a model: {error}") from error
    return Model(core)


def check_exportable(dataset: Dataset, tuning: dict[str, Any]) -> None:
    """Find out before a training, not after it, that the runtime would refuse its model.

    Raises:
        ExportError: what `bundle` would raise.
    """
    inputs, outputs = dataset.widths
    nothing = [
        {
            "weight": np.zeros((inputs, 4 * outputs), np.float32),
            "bias": np.zeros(4 * outputs, np.float32),
        }
    ]
    bundle(nothing, normalisation(dataset), dataset, {}, tuning)


def _points(weight: NDArray[np.float32]) -> NDArray[np.float32]:
    """(inputs, 4 × outputs) as (4, outputs, inputs)."""
    wide = weight.reshape(len(weight), 4, -1)
    return np.ascontiguousarray(wide.transpose(1, 2, 0))


def parity(model: Model, params: Params, rows: Rows, dataset: Dataset) -> float:
    """Largest difference between the runtime and the network as it was trained.

    Args:
        model: from `bundle`.
        params: the weights it was made from.
        rows: (N, columns) of the data set.
        dataset: theirs.

    Returns:
        In deviations of an output; the trained network is run in float64.
    """
    import jax

    from ambulo.models import pfnn

    columns = dataset.columns
    x, cycles = rows[:, columns["input"]], rows[:, columns["phase"]][:, 0]
    phase = (2.0 * np.pi * cycles).astype(np.float32)
    got = model.predict(x, phase)
    n = model.core.normalisation()
    sides = ("input_mean", "input_std", "output_mean", "output_std")
    with jax.enable_x64():
        wide = jax.tree.map(lambda leaf: np.asarray(leaf, np.float64), list(params))
        scale = pfnn.Scale(*(np.asarray(n[side], np.float64) for side in sides))
        cycles = phase.astype(np.float64) / (2.0 * np.pi)
        expected = np.asarray(jax.jit(pfnn.predict)(wide, scale, x.astype(np.float64), cycles))
    # Beyond the rounding of the number itself: one that hardly changes has a tiny deviation.
    rounding = np.spacing(np.abs(expected).astype(np.float32))
    return float((np.maximum(np.abs(got - expected) - rounding, 0.0) / n["output_std"]).max())


def checked(
    params: Params,
    scale: Normalisation,
    dataset: Dataset,
    provenance: dict[str, str],
    rows: Rows,
    tuning: dict[str, Any] | None = None,
) -> Model:
    """`bundle`, after `parity` on rows of the data set.

    Raises:
        ExportError: the runtime's numbers are not the trained network's.
    """
    model = bundle(params, scale, dataset, provenance, tuning)
    off = parity(model, params, rows, dataset)
    if not off <= PARITY:
        raise ExportError(
            f"the runtime differs from the trained network by {off:.1e} deviations of an output "
            f"(allowed: {PARITY:.0e}); nothing is written. Please report it"
        )
    return model


# -- ONNX -------------------------------------------------------------------------------------


def onnx_model(model: Model) -> onnx.ModelProto:
    """The network as an ONNX graph: x (N, inputs) and phase (N,), radians, to y (N, outputs).

    Nothing is normalised outside. The phase function is inside the graph as in
    `models.pfnn`: one wide product a layer, blended by the shares of the four control points.
    """
    from onnx import TensorProto, checker, helper

    graph = _Graph()
    graph.shares()
    n = model.core.normalisation()
    h = graph.add("Div", graph.add("Sub", "x", graph.hold("x_mean", n["input_mean"])),
                  graph.hold("x_std", n["input_std"]))  # fmt: skip
    layers = model.core.layers()
    for index, (weights, biases) in enumerate(layers):
        h = graph.layer(index, h, weights, biases)
        if index < len(layers) - 1:
            h = graph.add("Elu", h)
    h = graph.add("Mul", h, graph.hold("y_std", n["output_std"]))
    graph.add("Add", h, graph.hold("y_mean", n["output_mean"]), name="y")
    value, number = helper.make_tensor_value_info, TensorProto.FLOAT
    made = helper.make_graph(
        graph.nodes, "pfnn",
        [value("x", number, ["N", model.inputs]), value("phase", number, ["N"])],
        [value("y", number, ["N", model.outputs])],
        graph.held,
    )  # fmt: skip
    opset = [helper.make_opsetid("", OPSET)]
    proto = helper.make_model(made, opset_imports=opset, producer_name="ambulo")
    proto.ir_version = IR_VERSION
    helper.set_model_props(proto, _told(model))
    checker.check_model(proto, full_check=True)
    return proto


def _told(model: Model) -> dict[str, str]:
    """The bundle's header as ONNX metadata; licence and layout also by themselves."""
    licence = model.header["licence"].strip()
    if not licence:
        raise ExportError("the model names no licence; an ONNX file without one is not written")
    return {
        "licence": licence,
        "layout": json.dumps(model.header["layout"]),
        "ambulo": json.dumps(model.header),
    }


class _Graph:
    """Nodes and constants of a graph; every node has one output, named after it."""

    def __init__(self) -> None:
        self.nodes: list[Any] = []
        self.held: list[Any] = []

    def add(self, operation: str, *inputs: str, name: str = "", **attributes: Any) -> str:
        from onnx import helper

        name = name or f"{operation.lower()}_{len(self.nodes)}"
        self.nodes.append(helper.make_node(operation, list(inputs), [name], name, **attributes))
        return name

    def hold(self, name: str, values: Any, kind: Any = np.float32) -> str:
        from onnx import numpy_helper

        self.held.append(numpy_helper.from_array(np.asarray(values, kind), name))
        return name

    def shares(self) -> None:
        """`shares` (N, 4, 1) from `phase`: see `models.pfnn.phase_shares`."""
        add, hold = self.add, self.hold
        one = hold("one", 1.0)
        cycles = add("Div", "phase", hold("turn", 2.0 * np.pi))
        at = add("Mul", add("Sub", cycles, add("Floor", cycles)), hold("four", 4.0))
        at = add("Reshape", at, hold("column", [-1, 1], np.int64))
        away = add("Add", add("Sub", at, hold("points", [[0.0, 1.0, 2.0, 3.0]])), hold("two", 2.0))
        rounds = add("Mul", add("Floor", add("Div", away, "four")), "four")
        d = add("Abs", add("Sub", add("Sub", away, rounds), "two"))

        def cubic(name: str, *factors: float) -> str:
            value = hold(f"{name}_3", factors[0])
            for power, factor in zip((2, 1, 0), factors[1:], strict=True):
                value = add("Add", add("Mul", value, d), hold(f"{name}_{power}", factor))
            return value

        near, far = cubic("near", 1.5, -2.5, 0.0, 1.0), cubic("far", -0.5, 2.5, -4.0, 2.0)
        share = add("Where", add("Less", d, one), near, far)
        add("Reshape", share, hold("blend", [-1, 4, 1], np.int64), name="shares")

    def layer(self, index: int, x: str, weights: NDArray[Any], biases: NDArray[Any]) -> str:
        """One affine layer from (4, outputs, inputs) and (4, outputs)."""
        points, outputs, inputs = weights.shape
        wide = weights.transpose(2, 0, 1).reshape(inputs, points * outputs)
        y = self.add("MatMul", x, self.hold(f"W{index}", wide))
        y = self.add("Add", y, self.hold(f"b{index}", biases.reshape(-1)))
        y = self.add("Reshape", y, self.hold(f"shape{index}", [-1, points, outputs], np.int64))
        y = self.add("Mul", y, "shares")
        return self.add("ReduceSum", y, self.hold(f"axis{index}", [1], np.int64), keepdims=0)


def checked_onnx(model: Model, rows: int = 512) -> tuple[bytes, float]:
    """The ONNX file, after it was run beside the runtime.

    Returns:
        The file's bytes, and the largest difference relative to the number or its deviation.

    Raises:
        ExportError: onnxruntime's numbers are not the runtime's.
    """
    import onnxruntime

    content = onnx_model(model).SerializeToString()
    rng = np.random.default_rng(0)
    n = model.core.normalisation()
    std = np.where(n["input_std"] < _HIDDEN, n["input_std"], 0.0)
    x = (n["input_mean"] + std * rng.standard_normal((rows, model.inputs))).astype(np.float32)
    phase = rng.uniform(-10.0, 10.0, rows).astype(np.float32)
    phase[:5] = np.array([0.0, 0.5, 1.0, 1.5, 2.0], np.float32) * np.float32(np.pi)
    session = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])
    (got,) = session.run(["y"], {"x": x, "phase": phase})
    expected = model.predict(x, phase)
    size = np.maximum(np.abs(expected), n["output_std"])
    off = float((np.abs(np.asarray(got) - expected) / size).max())
    if not off <= ONNX_PARITY:
        raise ExportError(
            f"the ONNX graph differs from the model by {off:.1e} (allowed: {ONNX_PARITY:.0e}); "
            "nothing is written. Please report it"
        )
    return content, off
