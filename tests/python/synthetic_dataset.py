"""A data set folder made in code: a toy body whose limbs swing with the phase along a winding path.

What is there to learn is smooth and has no chance in it: the pose follows from phase and speed, the
trajectory from the path. Frames, roots and blocks fit each other as those of real clips do, so that
loops closed over them must come out right.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ambulo import _core
from ambulo.presets import preset
from conftest import JOINTS

CATEGORIES = ["stand", "walk", "jog", "run", "crouch", "jump", "backward", "sideways"]
OFFSETS = np.arange(-60, 60, 10)
LICENCE = "none: made by a test"
# Settings that learn from it: small, quick to compile, and with everything in them.
SMALL: dict[str, Any] = {
    **preset("default"),
    "hidden": [16], "steps": 24, "every": 6, "batch": 32, "warmup": 4, "learning_rate": 3e-3,
    "judge_windows": 8, "judge_frames": 10, "dropout_hidden": 0.1, "dropout_input": 0.1,
    "stages": [{"share": 0.5, "age": 1, "age_end": 8}, {"frames": 3, "share": 0.5, "age": 12}],
}  # fmt: skip


Array = np.ndarray


@dataclass
class Path3:
    """A root's way: everything a frame, metres and radians; 61 frames more on both sides."""

    x: Array
    z: Array
    height: Array
    yaw: Array
    speed: Array
    phase: Array


def way(rng: np.random.Generator, rows: int, slope: float) -> Path3:
    frames = np.arange(rows + 122) / 60.0
    speed = 1.4 + 0.6 * np.sin(2 * np.pi * (frames / rng.uniform(3, 6) + rng.random()))
    yaw = rng.uniform(-3, 3) + 0.8 * np.sin(2 * np.pi * (frames / rng.uniform(4, 8) + rng.random()))
    x, z = np.cumsum(np.sin(yaw) * speed / 60), np.cumsum(np.cos(yaw) * speed / 60)
    phase = rng.random() + np.cumsum((0.5 + 0.3 * speed) / 60)
    return Path3(x, z, slope * np.sin(0.7 * x) * np.cos(0.9 * z), yaw, speed, phase)


def turned(yaw: Array, x: Array, z: Array) -> tuple[Array, Array]:
    """From a root's frame to the world's."""
    return x * np.cos(yaw) + z * np.sin(yaw), z * np.cos(yaw) - x * np.sin(yaw)


def stance() -> Array:
    points = np.zeros((len(JOINTS), 3))
    for joint, (_, parent, offset) in enumerate(JOINTS):
        points[joint] = np.array(offset) + (points[parent] if parent >= 0 else (0.0, 0.98, 0.0))
    return points


def world_pose(path: Path3) -> Array:
    """(frames, J, 3): every joint swings about its place, further at speed."""
    base = stance()
    lag = np.linspace(0.0, 1.0, len(base), endpoint=False)
    swing = np.sin(2 * np.pi * (path.phase[:, None] + lag)) * path.speed[:, None]
    local = np.repeat(base[None], len(path.x), axis=0)
    local[:, 1:, 2] += 0.12 * swing[:, 1:]
    local[:, :, 1] += 0.02 * np.cos(4 * np.pi * path.phase)[:, None]
    x, z = turned(path.yaw[:, None], local[..., 0], local[..., 2])
    moved = (x + path.x[:, None], local[..., 1] + path.height[:, None], z + path.z[:, None])
    return np.stack(moved, axis=-1)


def seen_from(path: Path3, at: Array, points: Array, height: Array) -> Array:
    """World points (N, J, 3) in the roots of frames `at`, heights from `height`."""
    dx, dz = points[..., 0] - path.x[at][:, None], points[..., 2] - path.z[at][:, None]
    x, z = turned(-path.yaw[at][:, None], dx, dz)
    return np.stack([x, points[..., 1] - height[:, None], z], axis=-1)


def vector_from(path: Path3, at: Array, vectors: Array) -> Array:
    x, z = turned(-path.yaw[at][:, None], vectors[..., 0], vectors[..., 2])
    return np.stack([x, vectors[..., 1], z], axis=-1)


def blocks(path: Path3, rows: int, layout: str) -> tuple[dict[str, Array], dict[str, Array]]:
    """Input and output blocks of all rows; metres and seconds but for `holden`'s."""
    i = np.arange(rows) + 60
    scale, rate = (100.0, 1.0) if layout == "holden" else (1.0, 60.0)
    pose = world_pose(path)
    step = np.diff(pose, axis=0)
    now = path.height[i]

    def trail(at: Array, offsets: Array) -> dict[str, Array]:
        there = at[:, None] + offsets
        points = np.stack([path.x[there], path.height[there], path.z[there]], axis=-1)
        seen = seen_from(path, at, points, path.height[at])
        turn = path.yaw[there] - path.yaw[at][:, None]
        return {
            "trajectory_x": scale * seen[..., 0], "trajectory_z": scale * seen[..., 2],
            "direction_x": np.sin(turn), "direction_z": np.cos(turn),
            "height": scale * seen[..., 1],
        }  # fmt: skip

    ahead = trail(i, OFFSETS)
    x = {name: ahead[name] for name in list(ahead)[:4]}
    x |= {f"gait_{g}": np.zeros((rows, 12)) for g in ("stand", "jog", "crouch", "jump", "bump")}
    x |= {"gait_walk": np.minimum(2.0 - path.speed[i[:, None] + OFFSETS], 1.0)}
    x["gait_run"] = 1.0 - x["gait_walk"]
    x["joint_position"] = scale * seen_from(path, i - 1, pose[i - 1], now)
    x["joint_velocity"] = scale * rate * vector_from(path, i - 1, step[i - 1])
    for side in ("left", "centre", "right"):
        x[f"terrain_{side}"] = ahead["height"]
    coming = trail(i + 1, OFFSETS[6:])
    roots = np.stack([path.x, path.height, path.z], axis=-1)
    root = seen_from(path, i, roots[i + 1][:, None], now)
    turn = path.yaw[i + 1] - path.yaw[i]
    y = {name: coming[name] for name in list(coming)[:4]}
    y["root_velocity"] = scale * rate * root[:, 0, [0, 2]]
    y["root_yaw"] = (-rate if layout == "holden" else rate) * turn
    y["phase_rate"] = rate * (path.phase[i + 1] - path.phase[i])
    swing = np.sin(2 * np.pi * path.phase[i])
    y["contacts"] = (np.stack([-swing, -swing, swing, swing], axis=1) > 0).astype(float)
    y["joint_position"] = scale * seen_from(path, i, pose[i], now)
    y["joint_velocity"] = scale * rate * vector_from(path, i, step[i])
    axes = [0.0] * 3 if layout == "holden" else [1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
    y["joint_rotation"] = np.tile(axes, (rows, len(JOINTS)))
    return x, y


def clip_rows(rng: np.random.Generator, rows: int, layout: str, slope: float) -> Array:
    path = way(rng, rows, slope)
    i = np.arange(rows) + 60
    x, y = blocks(path, rows, layout)
    table = _core.layout(layout, len(JOINTS))
    head = np.stack(
        [path.phase[i] % 1.0, np.where(path.speed[i] > 1.7, 3, 1),
         path.x[i], path.height[i], path.z[i], path.yaw[i]], axis=1,
    )  # fmt: skip
    parts = [head]
    for side, values in (("inputs", x), ("outputs", y)):
        parts += [values[name].reshape(rows, size) for name, size in table[side]]
    return np.concatenate(parts, axis=1).astype(np.float32)


def write_dataset(
    folder: Path,
    *,
    layout: str = "ambulo",
    clips: int = 4,
    rows: int = 400,
    validation: int = 1,
    slope: float = 0.0,
    seed: int = 0,
    licence: str = LICENCE,
) -> Path:
    """Write a data set; its last `validation` clips are for validation; each clip is two runs."""
    (folder / "shards").mkdir(parents=True)
    rng = np.random.default_rng(seed)
    table = _core.layout(layout, len(JOINTS))
    listed, training = [], []
    for number in range(clips):
        values = clip_rows(rng, rows, layout, slope)
        name = f"clip{number}"
        np.save(folder / "shards" / f"{name}.npy", values)
        split = "validation" if number >= clips - validation else "training"
        if split == "training":
            training.append(values)
        listed.append(described(name, split, values))
    stats = statistics(np.concatenate(training), table)
    manifest = {
        "format": 1,
        "layout": {key: table[key] for key in ("name", "hash", "inputs", "outputs")},
        "fps": 60.0,
        "parts": parts(),
        "licence": licence,
        "provenance": {"source": "a test"},
        "categories": CATEGORIES,
        "columns": [["phase", 1], ["category", 1], ["root", 4], *stats.pop("columns")],
        "clips": listed,
        "statistics": stats,
    }
    (folder / "dataset.json").write_text(json.dumps(manifest))
    return folder


def described(name: str, split: str, values: Array) -> dict[str, Any]:
    rows = len(values)
    cut = rows // 2
    return {
        "name": name, "file": f"shards/{name}.npy", "source": f"{name}.bvh", "take": name,
        "mirrored": False, "split": split, "rows": rows, "runs": [[0, cut], [cut, rows - cut]],
        "categories": np.bincount(values[:, 1].astype(int), minlength=len(CATEGORIES)).tolist(),
    }  # fmt: skip


def statistics(values: Array, table: Any) -> dict[str, Any]:
    nx, ny = (sum(size for _, size in table[side]) for side in ("inputs", "outputs"))
    x, y = values[:, 6 : 6 + nx].astype(np.float64), values[:, 6 + nx :].astype(np.float64)
    return {
        "rows": len(values), "columns": [["input", nx], ["output", ny]],
        "input_mean": x.mean(0).tolist(), "input_std": x.std(0).tolist(),
        "output_mean": y.mean(0).tolist(), "output_std": y.std(0).tolist(),
    }  # fmt: skip


def parts() -> dict[str, Any]:
    return {
        "skeleton": [
            {"name": name, "parent": None if parent < 0 else parent, "offset": list(offset)}
            for name, parent, offset in JOINTS
        ],
        "feet": {"joints": [3, 4, 7, 8], "heights": [0.09, 0.04, 0.09, 0.04]},
    }


def spoiled(folder: Path, tmp_path: Path, change: Any) -> Path:
    """A copy whose manifest was changed."""
    copy = tmp_path / "copy"
    (copy / "shards").mkdir(parents=True)
    for shard in (folder / "shards").iterdir():
        (copy / "shards" / shard.name).symlink_to(shard)
    manifest = json.loads((folder / "dataset.json").read_text())
    change(manifest, copy)
    (copy / "dataset.json").write_text(json.dumps(manifest))
    return copy
