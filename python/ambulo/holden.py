"""The PFNN authors' trained network, from their files to a bundle.

A folder of raw float32 arrays: `W0_000.bin`, `b0_000.bin`, … at up to 50 slices of the phase
(slice i at 2π·i/50), and `Xmean.bin`, `Xstd.bin`, `Ymean.bin`, `Ystd.bin`. Every slice is the
closed Catmull-Rom blend of four control points (Holden et al. 2017, equation 7), so that four or
more slices give the control points back by least squares; with more than four, what is left over
shows whether the files belong together.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ambulo import _core
from ambulo.model import Model, ModelError

SLICES = 50
# As many as a layout takes.
MOST_JOINTS = 1000
LICENCE = (
    "Academic and non-commercial use only: weights by Daniel Holden, Taku Komura and Jun Saito "
    '("Phase-Functioned Neural Networks for Character Control", SIGGRAPH 2017)'
)
# Largest misfit of a slice, relative to the largest weight of its array. Float32 files that belong
# together stay below 1e-6.
TOLERANCE = 1e-5
# A unit of the authors' BVH files in metres: 5.6444 cm (= 1 / 0.45 inches).
BVH_UNIT = 0.056444

# The authors' 31 joints: CMU's names, and each one's parent.
JOINTS = (
    ("Hips", -1), ("LHipJoint", 0), ("LeftUpLeg", 1), ("LeftLeg", 2), ("LeftFoot", 3),
    ("LeftToeBase", 4), ("RHipJoint", 0), ("RightUpLeg", 6), ("RightLeg", 7), ("RightFoot", 8),
    ("RightToeBase", 9), ("LowerBack", 0), ("Spine", 11), ("Spine1", 12), ("Neck", 13),
    ("Neck1", 14), ("Head", 15), ("LeftShoulder", 13), ("LeftArm", 17), ("LeftForeArm", 18),
    ("LeftHand", 19), ("LeftFingerBase", 20), ("LeftHandIndex1", 21), ("LThumb", 20),
    ("RightShoulder", 13), ("RightArm", 24), ("RightForeArm", 25), ("RightHand", 26),
    ("RightFingerBase", 27), ("RightHandIndex1", 28), ("RThumb", 27),
)  # fmt: skip
# Heels and toes, and the heights of those joints above the ground that the terrain fit assumes.
FEET = {"joints": [4, 5, 9, 10], "heights": [0.05, 0.04, 0.05, 0.04]}

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Imported:
    """A model and how well the files fitted together."""

    model: Model
    slices: tuple[int, ...]
    residual: float | None
    """Largest misfit of a slice relative to the largest weight of its array; None with exactly
    four slices, which always fit."""
    amplification: float
    """Factor at most by which rounding of the files grows in the control points."""
    skeleton: str
    """Where the bones' lengths come from."""


def import_holden(folder: str | Path, skeleton: str | Path | None = None) -> Imported:
    """Read a folder of the authors' weights.

    Args:
        folder: with the network's files.
        skeleton: a BVH file with the rest pose; without it `rest.bvh` is looked for beside the
            files and in the folder above, and else the network's own poses give the bones.

    Raises:
        ModelError: a file is missing, has the wrong size or a number that is not finite, or the
            slices do not belong together; the message names it.
    """
    folder = Path(folder)
    slices = _slices(folder)
    x_mean, y_mean = (_read(folder / f"{side}mean.bin") for side in "XY")
    x_std = _read(folder / "Xstd.bin", len(x_mean))
    y_std = _read(folder / "Ystd.bin", len(y_mean))
    joints = _joints(folder, len(x_mean), len(y_mean))
    widths = [len(x_mean)]
    depth = len({p.name.split("_")[0] for p in folder.glob("b[0-9]_*.bin")})
    layers, residual = [], 0.0
    solve, amplification = _solver(folder, slices)
    for layer in range(depth):
        biases = _stack(folder, f"b{layer}", slices, None if layer < depth - 1 else len(y_mean))
        widths.append(biases.shape[1])
        weights = _stack(folder, f"W{layer}", slices, widths[-1] * widths[-2])
        solved = []
        for name, values in ((f"W{layer}", weights), (f"b{layer}", biases)):
            points, misfit = solve(name, values)
            residual = max(residual, misfit)
            solved.append(points.astype(np.float32))
        layers.append((solved[0].reshape(4, widths[-1], widths[-2]), solved[1]))
    checked = residual if len(slices) > 4 else None
    source, bones = _skeleton(folder, skeleton, joints)

    def build(bones: list[dict[str, Any]]) -> _core.Model:
        header = _header(joints, bones, slices, checked, source)
        return _core.Model.build(json.dumps(header), layers, x_mean, x_std, y_mean, y_std)

    try:
        if bones is None:
            names, parents = zip(*JOINTS, strict=True)
            draft = build(_described(names, parents, np.zeros((joints, 3))))
            bones = _described(names, parents, _core.drawn_offsets(draft).astype(float))
        core = build(bones)
    except ValueError as error:
        raise ModelError(f"{folder}: {error}") from error
    return Imported(Model(core), tuple(slices), checked, amplification, source)


def _slices(folder: Path) -> list[int]:
    """Slices of which any file is there; that all are is checked when they are read."""
    found = {
        int(match[1])
        for path in folder.iterdir()
        if (match := re.fullmatch(r"[Wb]\d_(\d{3})\.bin", path.name))
    }
    if not found:
        raise ModelError(
            f"{folder}: no PFNN weights here (W0_000.bin …); expected the authors' network folder, "
            "or name a .safetensors file"
        )
    beyond = [i for i in found if i >= SLICES]
    if beyond:
        raise ModelError(f"{folder}: slice {min(beyond):03d} is beyond the authors' {SLICES}")
    if len(found) < 4:
        listed = ", ".join(f"{i:03d}" for i in sorted(found))
        raise ModelError(f"{folder}: {len(found)} slices ({listed}), 4 or more are needed")
    return sorted(found)


def _read(path: Path, count: int | None = None) -> NDArray[np.float32]:
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise ModelError(f"{path}: missing") from None
    if count is not None and len(data) != 4 * count:
        raise ModelError(
            f"{path}: {len(data)} bytes, expected {4 * count} ({count} float32 numbers)"
        )
    if not data or len(data) % 4:
        raise ModelError(f"{path}: {len(data)} bytes are not a whole number of float32 numbers")
    values = np.frombuffer(data, "<f4")
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        raise ModelError(f"{path}: number {bad[0]} is {values[bad[0]]}, expected a finite number")
    return values.astype(np.float32)


def _stack(folder: Path, name: str, slices: list[int], count: int | None) -> Array:
    rows = []
    for i in slices:
        rows.append(_read(folder / f"{name}_{i:03d}.bin", count))
        count = len(rows[0])
    return np.stack(rows).astype(np.float64)


def _joints(folder: Path, inputs: int, outputs: int) -> int:
    one, two = (_widths(joints)[0] for joints in (1, 2))
    joints = max(1 + (inputs - one) // (two - one), 1)
    if joints > MOST_JOINTS or _widths(joints) != (inputs, outputs):
        raise ModelError(
            f"{folder}: Xmean.bin has {inputs} numbers and Ymean.bin {outputs}, expected "
            "156 + 6·J and 32 + 9·J for J joints (342 and 311 for 31)"
        )
    return joints


def _widths(joints: int) -> tuple[int, int]:
    """Lengths of the layout's two vectors."""
    layout = _core.layout("holden", joints)
    return sum(n for _, n in layout["inputs"]), sum(n for _, n in layout["outputs"])


def _solver(folder: Path, slices: list[int]):
    """The least-squares solution, as a function of an array's slices."""
    matrix = _core.phase_shares([i / SLICES for i in slices])
    inverse = np.linalg.pinv(matrix)
    amplification = float(np.abs(inverse).sum(axis=1).max())
    # Float32 rounding of 6e-8, grown by this, must stay well below what is visible.
    if not amplification < 1000:
        listed = ", ".join(f"{i:03d}" for i in slices)
        raise ModelError(
            f"{folder}: slices {listed} lie too close together to give the control points "
            f"(rounding would grow {amplification:.0f} times); add slices from the rest"
        )

    def solve(name: str, values: Array) -> tuple[Array, float]:
        points = inverse @ values
        scale = np.abs(values).max() or 1.0
        misfits = np.abs(matrix @ points - values).max(axis=1) / scale
        worst = int(misfits.argmax())
        if misfits[worst] > TOLERANCE:
            raise ModelError(
                f"{folder}: the slices of {name} do not belong to one network: "
                f"{name}_{slices[worst]:03d}.bin fits worst, off by {misfits[worst]:.1e} of the "
                f"largest weight (allowed: {TOLERANCE:.0e})"
            )
        return points, float(misfits[worst])

    return solve, amplification


def _skeleton(
    folder: Path, given: str | Path | None, joints: int
) -> tuple[str, list[dict[str, Any]] | None]:
    """Where the bones come from, and the skeleton in metres if that is a file."""
    beside = [folder / "rest.bvh", folder.parent / "rest.bvh"]
    path = Path(given) if given else next((p for p in beside if p.is_file()), None)
    if path is not None:
        clip, _ = _core.read_motion(str(path))
        if len(clip.names) != joints:
            raise ModelError(f"{path}: {len(clip.names)} joints, the network has {joints}")
        offsets = np.asarray(clip.offsets) * BVH_UNIT
        return f"offsets of {path.name}", _described(clip.names, clip.parents, offsets)
    if joints != len(JOINTS):
        raise ModelError(
            f"{folder}: {joints} joints are not the authors' {len(JOINTS)}; name the skeleton's "
            "rest pose as a BVH file (--skeleton)"
        )
    return "the network's own poses", None


def _described(names: Any, parents: Any, offsets: Array) -> list[dict[str, Any]]:
    # The hips' offset is replaced by every pose.
    offsets = np.where(np.arange(len(offsets))[:, None] == 0, 0.0, offsets)
    return [
        {"name": name, "parent": None if parent < 0 else int(parent), "offset": offset.tolist()}
        for name, parent, offset in zip(names, parents, offsets, strict=True)
    ]


def _header(
    joints: int, parts: list[dict[str, Any]], slices: list[int], residual: float | None, source: str
) -> dict[str, Any]:
    layout = _core.layout("holden", joints)
    return {
        "format": 1,
        "kind": "pfnn",
        "activation": "elu",
        "fps": layout["fps"],
        "layout": {key: layout[key] for key in ("name", "hash", "inputs", "outputs")},
        "licence": LICENCE,
        "provenance": {
            "source": "the PFNN authors' published weights",
            "slices": " ".join(f"{i:03d}" for i in slices),
            "residual": "not checked (4 slices)" if residual is None else f"{residual:.2e}",
            "skeleton": source,
        },
        "parts": {"skeleton": parts, "feet": FEET},
    }
