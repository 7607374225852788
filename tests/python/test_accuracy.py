"""`ambulo evaluate accuracy`: figures of models whose errors are known."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from ambulo import _core
from ambulo.cli import cli
from ambulo.evaluate import view as views
from ambulo.evaluate.accuracy import Clip, Settings, accuracy
from ambulo.evaluate.view import View, seen_from, world
from ambulo.files import write_atomic
from ambulo.loading import load_model
from ambulo.model import Model
from ambulo.starter_motion import Level, Wish, perform

FAST = Settings(every=7, windows=4, free_windows=1, threads=2)


@pytest.fixture(scope="module")
def walked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clip of somebody who walks and turns, as a file."""
    wishes = [Wish(6.0, "walk", 1.3), Wish(6.0, "walk", 1.2, turn=0.5), Wish(4.0, "stand")]
    clip = perform("walk", wishes, Level(), 3).clip
    path = tmp_path_factory.mktemp("walked") / "walk.bvh"
    _core.write_motion(str(path), clip.converted("ambulo", "cm"))
    return path


@pytest.fixture(scope="module")
def built(walked: Path) -> tuple[Model, np.ndarray, list[tuple[int, int]]]:
    """A model that fits the clip's skeleton, and the clip's rows."""
    folder = walked.parent / "set"
    manifest, _ = _core.dataset_plan([str(walked)], str(folder), "validation = 0.0")
    folder.mkdir()
    _core.dataset_build(str(folder), manifest)
    index = json.loads((folder / "dataset.json").read_text())
    model = constant_model(index)
    found = _core.clip_rows(model.core, str(walked))
    return model, found["rows"], found["runs"]


def constant_model(index: dict) -> Model:
    """Answers the mean of its data, whatever it is told."""
    layout, stats = index["layout"], index["statistics"]
    inputs, outputs = len(stats["input_mean"]), len(stats["output_mean"])
    header = {
        "format": 1,
        "kind": "pfnn",
        "activation": "elu",
        "fps": 60.0,
        "layout": layout,
        "licence": "none",
        "provenance": {},
        "parts": {**index["parts"], "tuning": {"pose_halflife": 0.0}},
    }
    zero = [
        (np.zeros((4, a, b), np.float32), np.zeros((4, a), np.float32))
        for a, b in ((8, inputs), (outputs, 8))
    ]
    mean = [np.array(stats[key], np.float32) for key in ("input_mean", "output_mean")]
    one = [np.ones(n, np.float32) for n in (inputs, outputs)]
    return Model(_core.Model.build(json.dumps(header), zero, mean[0], one[0], mean[1], one[1]))


def oracle(rows: np.ndarray, change: Callable[[View, np.ndarray], None]) -> Callable:
    """Knows the answer of every row by its trajectory, and changes it in a known way."""

    def predict(self: View, x: np.ndarray, cycles: np.ndarray, pool: object) -> np.ndarray:
        told = slice(0, self.inputs["direction_z"].stop)
        answers = {
            row[told].tobytes(): y
            for row, y in zip(self.input(rows), self.output(rows), strict=True)
        }
        y = np.stack([answers[np.ascontiguousarray(row[told]).tobytes()] for row in x])
        change(self, y)
        return y

    return predict


def measured(built: tuple, monkeypatch: pytest.MonkeyPatch, change: Callable) -> dict:
    model, rows, runs = built
    monkeypatch.setattr(views.View, "predict", oracle(rows, change))
    clip = Clip("walk", "clips", lambda: (rows, runs))
    return accuracy(model, [clip], FAST)["splits"]["clips"]


def test_who_knows_the_answer_makes_no_error(built, monkeypatch):
    found = measured(built, monkeypatch, lambda view, y: None)
    one, loop = found["one_step"], found["loop"]
    assert one["relative_error"] == one["position_cm_max"] == 0.0
    assert one["rotation_deg"] < 0.1 and one["contact_f1"] == 1.0
    assert one["baselines"]["last pose"]["relative_error"] > 0.005
    assert one["baselines"]["last pose + velocity"]["relative_error"] < 1e-5
    for seconds in (1, 2, 5):
        assert loop[f"{seconds} s"]["position_cm"] == 0.0
        assert loop[f"{seconds} s"]["phase_error"] < 0.01
        assert loop[f"{seconds} s"]["baselines_cm"]["last pose"] > 3.0
    assert loop["skate_ratio"] == pytest.approx(1.0, abs=1e-6)
    assert loop["jerk_ratio"] == pytest.approx(1.0, abs=1e-6)


def test_a_known_error_is_found_to_the_millimetre(built, monkeypatch):
    def lift(view: View, y: np.ndarray) -> None:
        y[:, view.outputs["joint_position"]].reshape(len(y), -1, 3)[:, :, 1] += 0.02
        y[:, view.outputs["phase_rate"]] += 0.05
        y[:, view.outputs["contacts"]] = 1.0 - y[:, view.outputs["contacts"]]

    found = measured(built, monkeypatch, lift)
    one, loop = found["one_step"], found["loop"]
    assert one["position_cm"] == pytest.approx(2.0, abs=1e-3)
    assert one["position_cm_p95"] == pytest.approx(2.0, abs=1e-3)
    assert one["contact_f1"] == 0.0
    assert loop["1 s"]["position_cm"] == pytest.approx(2.0, abs=1e-3)
    # A phase that runs 0.05 cycles a second too fast is off by as much after each second.
    assert loop["1 s"]["phase_error"] == pytest.approx(0.05, abs=0.01)
    assert loop["2 s"]["phase_error"] == pytest.approx(0.10, abs=0.01)


def test_what_is_fed_back_is_what_was_predicted(built, monkeypatch):
    """A model that repeats the pose it is told stays at the first pose of each window."""
    model, rows, runs = built

    def repeat(self: View, x: np.ndarray, cycles: np.ndarray, pool: object) -> np.ndarray:
        y = np.zeros((len(x), self.core.outputs), np.float32)
        for block in ("joint_position", "joint_velocity"):
            y[:, self.outputs[block]] = x[:, self.inputs[block]]
        return y

    monkeypatch.setattr(views.View, "predict", repeat)
    found = accuracy(model, [Clip("walk", "clips", lambda: (rows, runs))], FAST)
    loop = found["splits"]["clips"]["loop"]
    for seconds in (1, 2, 5):
        at = loop[f"{seconds} s"]
        assert at["position_cm"] == pytest.approx(at["baselines_cm"]["last pose"], rel=1e-4)


def test_frames_of_reference_are_each_others_inverse():
    rng = np.random.default_rng(0)
    poses, roots = rng.normal(size=(5, 3, 3)), rng.normal(size=(5, 4))
    assert np.allclose(seen_from(world(poses, roots), roots), poses)
    # Facing +X, what is ahead of the root lies along +X and its left along −Z.
    root = np.array([[1.0, 0.5, 2.0, np.pi / 2]])
    ahead, left = np.array([[[0.0, 0.0, 1.0]]]), np.array([[[1.0, 0.0, 0.0]]])
    assert np.allclose(world(ahead, root), [[[2.0, 0.5, 2.0]]])
    assert np.allclose(world(left, root), [[[1.0, 0.5, 1.0]]])


def test_the_command_reads_files_and_says_what_is_wrong(built, walked, tmp_path):
    model, _, _ = built
    path = tmp_path / "model.safetensors"
    model.save(path)
    assert load_model(path).tuning == {"pose_halflife": 0.0}
    run = CliRunner().invoke(
        cli, ["evaluate", "accuracy", str(path), str(walked), "--windows", "5", "--json"]
    )
    assert run.exit_code == 0, run.output
    found = json.loads(run.output)["splits"]["clips"]
    base = found["one_step"]["baselines"]["mean pose"]
    assert found["one_step"]["position_cm"] == pytest.approx(base["position_cm"], rel=1e-4)
    free = found["free"]
    assert free["path_error_m"]["5"] > 0.0
    # It answers the mean pose, whatever it is asked: as far off as the mean pose is.
    assert free["position_cm"]["mean"] == pytest.approx(free["baselines_cm"]["mean pose"], rel=0.05)
    assert free["position_cm"]["max"] >= free["position_cm"]["p95"] > 0.0
    broken = tmp_path / "broken.bvh"
    write_atomic(broken, "HIERARCHY\nROOT nobody\n")
    run = CliRunner().invoke(cli, ["evaluate", "accuracy", str(path), str(broken)])
    assert run.exit_code == 1 and "broken.bvh" in run.output and "no clip" in run.output
