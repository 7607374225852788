"""Models: import, agreement with the definition, round trips, refusals."""

from __future__ import annotations

import contextlib
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from ambulo import Controller, Model, ModelError, _core, load_model
from ambulo.cli import cli
from ambulo.holden import JOINTS, import_holden
from conftest import follower

SHAPES = {
    "W0": (512, 342), "W1": (512, 512), "W2": (311, 512),
    "b0": (512,), "b1": (512,), "b2": (311,),
}  # fmt: skip


def raw(folder: Path, name: str) -> np.ndarray:
    return np.fromfile(folder / f"{name}.bin", "<f4").astype(np.float64)


def reference(folder: Path, slices: list[int], x: np.ndarray, phase: float) -> np.ndarray:
    """The published network at one phase in float64, from the authors' files alone.

    Every slice is a sample of a closed Catmull-Rom spline through four points at phases 0, π/2, π
    and 3π/2; the spline in the Bernstein-free textbook form, written out here a second time so
    that nothing of ours is used.
    """

    def basis(at: float) -> np.ndarray:
        k, m = int(at) % 4, at - int(at)
        row = np.zeros(4)
        row[(k + 3) % 4] += m * (-0.5 + m * (1.0 - 0.5 * m))
        row[k] += 1.0 + m * m * (-2.5 + 1.5 * m)
        row[(k + 1) % 4] += m * (0.5 + m * (2.0 - 1.5 * m))
        row[(k + 2) % 4] += m * m * (-0.5 + 0.5 * m)
        return row

    rows = np.array([basis(4.0 * i / 50.0) for i in slices])
    here = basis(4.0 * (phase % (2.0 * np.pi)) / (2.0 * np.pi))
    weights = {}
    for name, shape in SHAPES.items():
        values = np.stack([raw(folder, f"{name}_{i:03d}") for i in slices])
        points = np.linalg.lstsq(rows, values, rcond=None)[0]
        weights[name] = (here @ points).reshape(shape)
    h = (x - raw(folder, "Xmean")) / raw(folder, "Xstd")
    for layer in range(3):
        h = weights[f"W{layer}"] @ h + weights[f"b{layer}"]
        if layer < 2:
            h = np.where(h > 0.0, h, np.exp(np.minimum(h, 0.0)) - 1.0)
    return h * raw(folder, "Ystd") + raw(folder, "Ymean")


def plausible_inputs(folder: Path, count: int) -> np.ndarray:
    """Inputs spread as the training data were (the down-weighted joints' spread undone)."""
    rng = np.random.default_rng(1)
    std = raw(folder, "Xstd").copy()
    std[120:306] = np.minimum(std[120:306] * 0.1, 20.0)
    return raw(folder, "Xmean") + std * rng.standard_normal((count, 342))


SLICES = list(range(0, 50, 5))


def test_predict_agrees_with_the_published_network_in_float64(network: Path) -> None:
    model = load_model(network)
    rng = np.random.default_rng(2)
    x = plausible_inputs(network, 24).astype(np.float32)
    phase = rng.uniform(0.0, 2.0 * np.pi, 24).astype(np.float32)
    phase[:4] = [0.0, np.pi / 2, 2.0 * np.pi - 1e-4, 7.5]
    y = model.predict(x, phase)
    assert y.dtype == np.float32 and y.shape == (24, 311)
    y_std = raw(network, "Ystd")
    worst = 0.0
    for row, p, got in zip(x.astype(np.float64), phase.astype(np.float64), y, strict=True):
        ref = reference(network, SLICES, row, p)
        worst = max(worst, float((np.abs(got - ref) / np.maximum(np.abs(ref), y_std)).max()))
    print(f"largest |y - ref| / max(|ref|, Ystd): {worst:.2e}")
    assert worst <= 1e-5


def test_a_round_trip_through_a_bundle_changes_nothing(network: Path, tmp_path: Path) -> None:
    model = load_model(network)
    path = tmp_path / "model.safetensors"
    model.save(path)
    again = load_model(path)
    x = plausible_inputs(network, 8).astype(np.float32)
    phase = np.linspace(0.0, 6.0, 8, dtype=np.float32)
    assert np.array_equal(model.predict(x, phase), again.predict(x, phase))
    assert again.header == model.header
    again.save(tmp_path / "again.safetensors")
    assert path.read_bytes() == (tmp_path / "again.safetensors").read_bytes()
    for (w, b), (w2, b2) in zip(model.core.layers(), again.core.layers(), strict=True):
        assert np.array_equal(w, w2) and np.array_equal(b, b2)


def copy_network(network: Path, to: Path, slices: list[int]) -> Path:
    to.mkdir()
    for path in network.iterdir():
        if path.stem.endswith(("mean", "std")) or int(path.stem[-3:]) in slices:
            shutil.copy(path, to)
    shutil.copy(network.parent / "rest.bvh", to)
    return to


@pytest.mark.parametrize("slices", [[0, 15, 25, 40], [5, 10, 30, 35, 45]])
def test_any_four_or_more_slices_give_the_same_network(
    network: Path, tmp_path: Path, slices: list[int]
) -> None:
    few = import_holden(copy_network(network, tmp_path / "few", slices))
    assert few.slices == tuple(slices)
    assert (few.residual is None) == (len(slices) == 4)
    x = plausible_inputs(network, 4).astype(np.float32)
    phase = np.array([0.3, 2.0, 3.3, 5.9], np.float32)
    whole = load_model(network).predict(x, phase)
    difference = np.abs(few.model.predict(x, phase) - whole) / raw(network, "Ystd")
    assert difference.max() < 1e-4


def test_refuses_broken_folders_by_name(network: Path, tmp_path: Path) -> None:
    def refused(name: str, slices: list[int], change) -> str:
        folder = copy_network(network, tmp_path / name, slices)
        change(folder)
        with pytest.raises(ModelError) as error:
            load_model(folder)
        return str(error.value)

    def truncate(file: str):
        return lambda folder: (folder / file).write_bytes((folder / file).read_bytes()[:-5])

    def poison(folder: Path) -> None:
        values = np.fromfile(folder / "b1_010.bin", "<f4")
        values[7] = np.nan
        values.tofile(folder / "b1_010.bin")

    def swap(folder: Path) -> None:
        (folder / "W1_010.bin").write_bytes((folder / "W1_030.bin").read_bytes())

    def drop(file: str):
        return lambda folder: (folder / file).unlink()

    cut = refused("cut", SLICES, truncate("W1_020.bin"))
    assert "W1_020.bin: 1048571 bytes, expected 1048576 (262144 float32 numbers)" in cut
    assert "b1_010.bin: number 7 is nan" in refused("nan", SLICES, poison)
    assert "slices of W1 do not belong to one network: W1_010.bin" in refused("odd", SLICES, swap)
    assert "W2_025.bin: missing" in refused("gone", SLICES, drop("W2_025.bin"))
    assert "Xstd.bin: missing" in refused("std", SLICES, drop("Xstd.bin"))
    size = refused("size", SLICES, truncate("Ymean.bin"))
    assert "Ymean.bin: 1239 bytes are not a whole number" in size
    three = refused("three", [0, 15, 25], lambda folder: None)
    assert "3 slices (000, 015, 025), 4 or more are needed" in three
    (tmp_path / "empty").mkdir()
    with pytest.raises(ModelError, match="no PFNN weights here"):
        load_model(tmp_path / "empty")


def test_slices_that_lie_too_close_are_refused(network: Path, tmp_path: Path) -> None:
    folder = copy_network(network, tmp_path / "close", [0, 5, 10, 15])
    for new, old in ((1, 5), (2, 10), (3, 15)):
        for path in list(folder.glob(f"*_{old:03d}.bin")):
            path.rename(folder / path.name.replace(f"_{old:03d}", f"_{new:03d}"))
    with pytest.raises(ModelError, match="too close together"):
        load_model(folder)


def test_bones_come_from_the_rest_pose_or_the_network_itself(network: Path, tmp_path: Path) -> None:
    folder = copy_network(network, tmp_path / "net", SLICES)
    rest = import_holden(folder)
    assert rest.skeleton == "offsets of rest.bvh"
    assert rest.model.names == tuple(name for name, _ in JOINTS), "the table is the authors'"
    assert rest.model.parents == tuple(parent for _, parent in JOINTS)
    (folder / "rest.bvh").unlink()
    drawn = import_holden(folder)
    assert drawn.skeleton == "the network's own poses"

    def thigh(model: Model) -> float:
        joints = model.header["parts"]["skeleton"]
        return float(np.linalg.norm(joints[model.names.index("LeftLeg")]["offset"]))

    # The network's own bones are a little shorter than the skeleton it was trained on.
    assert 0.93 < thigh(drawn.model) / thigh(rest.model) < 1.0


def test_predict_refuses_what_does_not_fit(toy: Model) -> None:
    with pytest.raises(ValueError, match=r"expected x of shape \(N, 222\)"):
        toy.predict(np.zeros(222), np.zeros(1))
    with pytest.raises(ValueError, match="x has 3 columns, expected 222"):
        toy.predict(np.zeros((1, 3)), np.zeros(1))
    with pytest.raises(ValueError, match="x has 2 rows, phase 1 numbers"):
        toy.predict(np.zeros((2, 222)), np.zeros(1))
    with pytest.raises(ValueError, match=r"phase\[0\] is inf"):
        toy.predict(np.zeros((1, 222)), [np.inf])
    assert toy.predict(np.zeros((0, 222)), np.zeros(0)).shape == (0, toy.outputs)
    # Float64, lists and strided arrays are taken too.
    wide = np.zeros((4, 444))
    assert np.array_equal(toy.predict(wide[::2, ::2], [0, 0]), toy.predict(wide[:2, :222], [0, 1]))


def scaled(model: Model, factor: float) -> Model:
    """The same with every weight of the layers times `factor`."""
    core, n = model.core, model.core.normalisation()
    layers = [((w * np.float32(factor)), b) for w, b in core.layers()]
    return Model(_core.Model.build(core.header_json(), layers, **n))


def test_half_precision_is_what_numpy_makes_of_it(toys: Model, tmp_path: Path) -> None:
    odd = scaled(toys, 1.0 / 3.0)
    whole, half = tmp_path / "whole.safetensors", tmp_path / "half.safetensors"
    odd.save(whole)
    odd.save(half, half=True)
    back = load_model(half)
    for (w, b), (w2, b2) in zip(odd.core.layers(), back.core.layers(), strict=True):
        assert np.array_equal(w.astype(np.float16).astype(np.float32), w2) and (w != w2).any()
        assert np.array_equal(b.astype(np.float16).astype(np.float32), b2)
    assert back.header == odd.header
    n = odd.core.normalisation()
    assert all(np.array_equal(n[key], value) for key, value in back.core.normalisation().items())
    assert (odd.info()["precision"], back.info()["precision"]) == ("float32", "float16")
    for path, model in ((whole, odd), (half, back)):
        assert model.info()["bytes"] == path.stat().st_size
    assert half.stat().st_size < 0.6 * whole.stat().st_size
    with pytest.raises(
        ModelError, match=r"tensor 'layers.0.weight': number \d+ is .*, beyond half"
    ):
        scaled(toys, 1e6).save(tmp_path / "none.safetensors", half=True)
    assert not (tmp_path / "none.safetensors").exists()


def test_half_command(toy: Model, tmp_path: Path) -> None:
    run = CliRunner().invoke
    whole, half = tmp_path / "whole.safetensors", tmp_path / "half.safetensors"
    odd = scaled(toy, 1.0 / 3.0)
    odd.save(whole)
    arguments = ["model", "half", str(whole), "-o", str(half)]
    dry = run(cli, [*arguments, "--dry-run"])
    assert dry.exit_code == 0 and "nothing written" in dry.output and not half.exists()
    done = run(cli, [*arguments, "--json"])
    assert done.exit_code == 0, done.output
    report = json.loads(done.stdout)
    assert report["bytes"] == half.stat().st_size < 0.6 * report["bytes_before"]
    assert report["bytes_before"] == whole.stat().st_size
    assert 0.0 < report["largest_change_sd"] < 0.01
    assert run(cli, arguments).exit_code == 1, "not over an existing file"
    shown = run(cli, ["model", "info", str(half)]).output
    assert "precision  float16" in shown and f"{half.stat().st_size:,}" in shown
    scaled(toy, 1e6).save(whole)
    refused = run(cli, [*arguments, "--overwrite"])
    assert refused.exit_code == 1 and "beyond half precision" in refused.output


def test_a_model_carries_its_tuning(tmp_path: Path) -> None:
    path = tmp_path / "tuned.safetensors"
    follower("ambulo", tuning={"stand_freedom": 1.0, "speed_limit": [0.8, 1.25]}).save(path)
    model = load_model(path)
    assert model.tuning == {"stand_freedom": 1.0, "speed_limit": [0.8, 1.25]}
    info = CliRunner().invoke(cli, ["model", "info", str(path)])
    assert "tuning  speed_limit [0.8, 1.25], stand_freedom 1.0" in info.output
    plain = CliRunner().invoke(cli, ["model", "info", str(path), "--json"])
    assert json.loads(plain.stdout)["tuning"] == model.tuning
    Controller(model)
    broken = follower("ambulo", tuning={"stand_freedom": 2.0})
    with pytest.raises(ModelError, match="'tuning' part is broken: a number that is out of range"):
        Controller(broken)
    with pytest.raises(ModelError, match="'tuning' part is broken"):
        follower(tuning=[1]).info()


def test_files_that_are_no_models_are_refused_by_name(toy: Model, tmp_path: Path) -> None:
    path = tmp_path / "model.safetensors"
    toy.save(path)
    whole = path.read_bytes()
    for at in (0, 7, 9, len(whole) // 2):
        path.write_bytes(whole[:at])
        with pytest.raises(ModelError, match=r"model\.safetensors: "):
            load_model(path)
    rng = np.random.default_rng(0)
    for _ in range(300):
        broken = bytearray(whole)
        for at in rng.integers(0, min(len(whole), 4000), 3):
            broken[at] = rng.integers(0, 256)
        path.write_bytes(broken)
        with contextlib.suppress(ModelError):
            load_model(path)
    with pytest.raises(FileNotFoundError):
        load_model(tmp_path / "nothing.safetensors")


def test_import_command(network: Path, tmp_path: Path) -> None:
    run = CliRunner().invoke
    output = tmp_path / "holden.safetensors"
    dry = run(cli, ["import", "holden", str(network), "-o", str(output), "--dry-run"])
    assert dry.exit_code == 0 and not output.exists(), dry.output
    done = run(cli, ["import", "holden", str(network), "-o", str(output), "--json"])
    assert done.exit_code == 0, done.output
    report = json.loads(done.stdout)
    assert report["slices"] == SLICES and report["residual"] < 1e-6
    assert "non-commercial" in report["licence"]
    assert output.stat().st_size < 10_000_000, "four control points, not fifty slices"
    again = run(cli, ["import", "holden", str(network), "-o", str(output)])
    assert again.exit_code == 1 and "--overwrite" in again.output
    info = run(cli, ["model", "info", str(output), "--json"])
    assert json.loads(info.stdout)["widths"] == [342, 512, 512, 311]
    missing = run(cli, ["model", "info", str(tmp_path / "none")])
    assert missing.exit_code == 2
