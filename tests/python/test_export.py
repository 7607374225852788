"""From trained weights to files: bundle and ONNX are compared with what they come from."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import jax
import numpy as np
import onnx
import onnxruntime
import pytest
from click.testing import CliRunner

from ambulo import Controller, Model, _core, load_model
from ambulo import export as exporting
from ambulo.cli.train import export as command
from ambulo.data import Dataset, open_dataset, windows
from ambulo.export import ExportError, bundle, checked, checked_onnx, onnx_model, parity
from ambulo.models import pfnn
from ambulo.normalisation import normalisation
from synthetic_dataset import LICENCE, write_dataset

ORIGIN = {"dataset": "made by a test", "seed": "0"}


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return open_dataset(write_dataset(tmp_path_factory.mktemp("export") / "data", slope=0.1))


def drawn(dataset: Dataset, hidden: tuple[int, ...] = (64, 64)) -> list[dict[str, Any]]:
    """Weights as training has them, biases included."""
    widths = [dataset.widths[0], *hidden, dataset.widths[1]]
    rng = np.random.default_rng(0)
    return [
        {
            "weight": np.asarray(layer["weight"]),
            "bias": rng.standard_normal(layer["bias"].shape).astype(np.float32),
        }
        for layer in pfnn.init(jax.random.key(0), widths)
    ]


@pytest.fixture(scope="module")
def params(dataset: Dataset) -> list[dict[str, Any]]:
    return drawn(dataset)


@pytest.fixture(scope="module")
def rows(dataset: Dataset) -> np.ndarray:
    return windows(dataset, "validation", 1, 256)[:, 0]


@pytest.fixture(scope="module")
def model(dataset: Dataset, params: Any, rows: np.ndarray) -> Model:
    scale = normalisation(dataset, joint_weight=0.1, masked_joints=("Spine",))
    return checked(params, scale, dataset, ORIGIN, rows, {"pose_halflife": 0.0})


# -- the bundle -------------------------------------------------------------------------------


def test_a_bundle_carries_what_the_data_set_says(
    model: Model, dataset: Dataset, tmp_path: Path
) -> None:
    model.save(tmp_path / "m.safetensors")
    again = load_model(tmp_path / "m.safetensors")
    assert again.header["licence"] == LICENCE
    assert again.header["provenance"] == ORIGIN
    assert again.header["parts"] == {**dataset.parts, "tuning": {"pose_halflife": 0.0}}
    assert again.header["layout"]["hash"] == dataset.layout["hash"]
    assert again.names == dataset.joints and again.core.widths == [*again.core.widths]
    character = Controller(again)
    character.step(1 / 60, velocity=(0.0, 1.0))
    assert np.isfinite(character.positions()).all()


def test_the_runtime_computes_what_was_trained(
    model: Model, params: Any, rows: np.ndarray, dataset: Dataset
) -> None:
    off = parity(model, params, rows, dataset)
    print(f"largest difference: {off:.1e} deviations")
    assert off <= 1e-5
    # The float32 forward pass of training, too, though with rounding of its own.
    columns = dataset.columns
    x, cycles = rows[:, columns["input"]], rows[:, columns["phase"]][:, 0]
    n = model.core.normalisation()
    scale = pfnn.Scale(*(n[f"{a}_{b}"] for a in ("input", "output") for b in ("mean", "std")))
    single = np.asarray(pfnn.predict(params, scale, x, cycles))
    runtime = model.predict(x, (2 * np.pi * cycles).astype(np.float32))
    size = np.maximum(np.abs(runtime), n["output_std"])
    assert (np.abs(single - runtime) / size).max() < 1e-5


@pytest.mark.parametrize("layer", [0, 1, 2])
@pytest.mark.parametrize("part", ["weight", "bias"])
def test_a_difference_is_found_and_nothing_written(
    dataset: Dataset, params: Any, rows: np.ndarray, layer: int, part: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """Two control points changed places between training and file."""
    made = bundle

    def spoiled(given: Any, *others: Any) -> Model:
        swapped = [dict(one) for one in given]
        wide = swapped[layer][part].reshape(-1, 4, swapped[layer][part].shape[-1] // 4)
        swapped[layer][part] = wide[:, [1, 0, 2, 3]].reshape(swapped[layer][part].shape)
        return made(swapped, *others)

    monkeypatch.setattr(exporting, "bundle", spoiled)
    with pytest.raises(ExportError, match=r"differs from the trained network .*nothing is written"):
        checked(params, normalisation(dataset), dataset, ORIGIN, rows)


def test_a_bundle_without_a_licence_is_not_made(dataset: Dataset, params: Any) -> None:
    for licence in ("", " \n"):
        with pytest.raises(ExportError, match="names no licence"):
            bundle(params, normalisation(dataset), replace(dataset, licence=licence), ORIGIN)


@pytest.mark.parametrize(
    ("parts", "tuning", "says"),
    [
        ({}, {"pose_halflif": 1.0}, "pose_halflif"),
        ({"feet": {"joints": [0, 1, 2, 99], "heights": [0, 0, 0, 0]}}, None, "feet"),
        ({"skeleton": []}, None, "skeleton"),
    ],
)
def test_what_the_controller_cannot_use_is_not_made(
    dataset: Dataset, params: Any, parts: Any, tuning: Any, says: str
) -> None:
    spoiled = replace(dataset, parts={**dataset.parts, **parts})
    with pytest.raises(ExportError, match=f"the runtime refuses .*{says}"):
        bundle(params, normalisation(dataset), spoiled, ORIGIN, tuning)


def test_weights_that_are_no_numbers_are_not_made(dataset: Dataset, params: Any) -> None:
    spoiled = [dict(layer) for layer in params]
    spoiled[1]["weight"] = spoiled[1]["weight"] * np.float32(np.nan)
    with pytest.raises(ExportError, match=r"layers\.1\.weight"):
        bundle(spoiled, normalisation(dataset), dataset, ORIGIN)


# -- ONNX -------------------------------------------------------------------------------------


def run_onnx(content: bytes, x: np.ndarray, phase: np.ndarray) -> np.ndarray:
    session = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])
    return np.asarray(session.run(None, {"x": x, "phase": phase})[0])


def test_an_onnx_graph_takes_plain_numbers_and_any_phase(
    model: Model, dataset: Dataset, rows: np.ndarray
) -> None:
    content, off = checked_onnx(model)
    assert off <= 1e-4
    x = rows[:, dataset.columns["input"]]
    n = model.core.normalisation()
    for phase in (
        2 * np.pi * rows[:, 0],
        np.linspace(-30.0, 30.0, len(x)),
        np.arange(len(x)) * np.pi / 2,
    ):
        phase = phase.astype(np.float32)
        ours, theirs = model.predict(x, phase), run_onnx(content, x, phase)
        size = np.maximum(np.abs(ours), n["output_std"])
        assert (np.abs(ours - theirs) / size).max() <= 1e-4
    assert run_onnx(content, x[:1], phase[:1]).shape == (1, model.outputs)


def test_an_onnx_file_tells_licence_and_layout(model: Model) -> None:
    proto = onnx_model(model)
    told = {entry.key: entry.value for entry in proto.metadata_props}
    assert told["licence"] == LICENCE
    assert json.loads(told["layout"])["outputs"][0] == ["root_velocity", 2]
    assert json.loads(told["ambulo"]) == model.header
    assert [i.name for i in proto.graph.input] == ["x", "phase"]
    assert proto.opset_import[0].version == 17 and proto.ir_version == 8
    onnx.checker.check_model(proto, full_check=True)


def test_the_published_network_as_onnx(network: Path, tmp_path: Path) -> None:
    content, off = checked_onnx(load_model(network))
    print(f"largest difference: {off:.1e}")
    assert off <= 1e-4 and len(content) < 12e6


def test_an_onnx_graph_that_differs_is_refused(
    model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    shares = exporting._Graph.shares

    def late(self: Any) -> None:
        """A phase that is a quarter cycle late."""
        shares(self)
        points = next(i for i, held in enumerate(self.held) if held.name == "points")
        values = np.array([[3.0, 0.0, 1.0, 2.0]], np.float32)
        self.held[points] = onnx.numpy_helper.from_array(values, "points")

    monkeypatch.setattr(exporting._Graph, "shares", late)
    with pytest.raises(ExportError, match="the ONNX graph differs from the model"):
        checked_onnx(model)


def test_an_onnx_file_without_a_licence_is_not_made(model: Model) -> None:
    header = {**model.header, "licence": " "}
    n = model.core.normalisation()
    numbers = (n[f"{a}_{b}"] for a in ("input", "output") for b in ("mean", "std"))
    core = _core.Model.build(json.dumps(header), model.core.layers(), *numbers)
    with pytest.raises(ExportError, match="names no licence"):
        onnx_model(Model(core))


def test_the_command_writes_what_was_checked(model: Model, tmp_path: Path) -> None:
    path, output = tmp_path / "m.safetensors", tmp_path / "m.onnx"
    model.save(path)

    def invoke(*arguments: str) -> Any:
        return CliRunner().invoke(command, ["onnx", str(path), "-o", str(output), *arguments])

    dry = invoke("--dry-run")
    assert dry.exit_code == 0 and "nothing written" in dry.output and not output.exists()
    done = invoke("--json")
    assert done.exit_code == 0, done.output
    report = json.loads(done.output)
    assert report["licence"] == LICENCE and report["difference"] <= 1e-4
    assert report["bytes"] == output.stat().st_size
    refused = invoke()
    assert refused.exit_code == 1 and "--overwrite replaces it" in refused.output
    assert "largest difference" in invoke("--overwrite").output


def test_without_onnx_it_says_how_to_get_it(
    model: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model.save(tmp_path / "m.safetensors")
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    arguments = ["onnx", str(tmp_path / "m.safetensors"), "-o", str(tmp_path / "m.onnx")]
    run = CliRunner().invoke(command, arguments)
    assert run.exit_code == 1 and "pip install 'ambulo[onnx]'" in run.output
