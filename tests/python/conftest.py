"""Shared fixtures: real data where it is, and a model that needs none."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest

import creature_runs
from ambulo import Model, _core

JOINTS = (
    ("Hips", -1, (0.0, 0.0, 0.0)),
    ("LeftUpLeg", 0, (0.1, -0.05, 0.0)),
    ("LeftLeg", 1, (0.0, -0.42, 0.0)),
    ("LeftFoot", 2, (0.0, -0.42, 0.0)),
    ("LeftToeBase", 3, (0.0, -0.05, 0.13)),
    ("RightUpLeg", 0, (-0.1, -0.05, 0.0)),
    ("RightLeg", 5, (0.0, -0.42, 0.0)),
    ("RightFoot", 6, (0.0, -0.42, 0.0)),
    ("RightToeBase", 7, (0.0, -0.05, 0.13)),
    ("Spine", 0, (0.0, 0.2, 0.0)),
    ("Head", 9, (0.0, 0.4, 0.0)),
)


def data_folder() -> Path | None:
    """Where real motion capture is, if anywhere."""
    default = Path(__file__).parents[3] / "shared" / "data"
    folder = Path(os.environ.get("AMBULO_DATA") or default)
    return folder if folder.is_dir() else None


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of real motion capture; the test is skipped without it."""
    folder = data_folder()
    if folder is None:
        pytest.skip("no motion capture: set $AMBULO_DATA to a folder that has it")
    return folder


@pytest.fixture(scope="session")
def network(data: Path) -> Path:
    """The PFNN authors' weights."""
    folder = data / "holden-pfnn" / "network"
    if not folder.is_dir():
        pytest.skip(f"no network at {folder}")
    return folder


def follower(layout_name: str = "holden", **parts: object) -> Model:
    """A network of one affine layer that foresees what it is told and walks along it.

    `parts` are put into the bundle beside its skeleton and feet.
    """
    layout = _core.layout(layout_name, len(JOINTS))
    metre, published = layout["units_per_metre"], layout_name == "holden"
    # A tenth of the way to the sample ten frames ahead; and a cycle a second.
    pace, turn, cycles = (0.1, -0.1, 1.0 / 60.0) if published else (6.0, 6.0, 1.0)
    starts = {
        side: dict(zip((n for n, _ in table), np.cumsum([0] + [s for _, s in table]), strict=False))
        for side, table in (("in", layout["inputs"]), ("out", layout["outputs"]))
    }
    inputs = sum(size for _, size in layout["inputs"])
    outputs = sum(size for _, size in layout["outputs"])
    weights, bias = np.zeros((outputs, inputs)), np.zeros(outputs)
    for name in ("trajectory_x", "trajectory_z", "direction_x", "direction_z"):
        for k in range(6):
            weights[starts["out"][name] + k, starts["in"][name] + 6 + k] = 1.0
    out = starts["out"]
    weights[out["root_velocity"], starts["in"]["trajectory_x"] + 7] = pace
    weights[out["root_velocity"] + 1, starts["in"]["trajectory_z"] + 7] = pace
    weights[out["root_yaw"], starts["in"]["direction_x"] + 7] = turn
    bias[out["phase_rate"]] = cycles
    bias[out["contacts"] : out["contacts"] + 4] = 0.9
    stance = np.zeros((len(JOINTS), 3))
    for joint, (_, parent, offset) in enumerate(JOINTS):
        stance[joint] = np.array(offset) + (stance[parent] if parent >= 0 else (0.0, 0.98, 0.0))
    bias[out["joint_position"] :][: stance.size] = metre * stance.ravel()
    if not published:
        axes = np.tile([1.0, 0.0, 0.0, 0.0, 1.0, 0.0], len(JOINTS))
        bias[out["joint_rotation"] :][: axes.size] = axes
    header = {
        "format": 1,
        "kind": "pfnn",
        "activation": "elu",
        "fps": 60.0,
        "layout": {key: layout[key] for key in ("name", "hash", "inputs", "outputs")},
        "licence": "none: made by a test",
        "provenance": {},
        "parts": {
            "skeleton": [
                {"name": n, "parent": None if p < 0 else p, "offset": o} for n, p, o in JOINTS
            ],
            "feet": {"joints": [3, 4, 7, 8], "heights": [0.09, 0.04, 0.09, 0.04]},
            **parts,
        },
    }
    mean = bias.astype(np.float32)
    layer = (
        np.repeat(weights[None], 4, axis=0).astype(np.float32),
        np.zeros((4, outputs), np.float32),
    )
    core = _core.Model.build(
        json.dumps(header),
        [layer],
        np.zeros(inputs, np.float32),
        np.ones(inputs, np.float32),
        mean,
        np.ones(outputs, np.float32),
    )
    return Model(core)


@pytest.fixture(scope="session")
def toy() -> Model:
    """See `follower`."""
    return follower()


@pytest.fixture(scope="session", params=["holden", "ambulo"])
def toys(request: pytest.FixtureRequest) -> Model:
    """One of each layout."""
    return follower(request.param)


@pytest.fixture(scope="session")
def small_config(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Settings of a search that is over in a blink."""
    path = tmp_path_factory.mktemp("config") / "small.toml"
    path.write_text(creature_runs.TOML)
    return path


@pytest.fixture(scope="session")
def finished_run(tmp_path_factory: pytest.TempPathFactory, small_config: Path) -> Path:
    """The folder of a finished run: `creature_runs.SMALL`, of Biped 1. Not to be changed."""
    folder = tmp_path_factory.mktemp("evolved") / "run"
    run = creature_runs.ambulo("evolve", "biped1", "run", "-o", folder, "--config", small_config)
    assert run.exit_code == 0, run.output
    return folder
