"""Statistics of a `holden` data set beside the authors' own normalisation vectors, block by block.

Builds a data set of the three published clips and their mirrors, as the authors' scripts would have
it: their layout, their labels, ground from their height map. Of every block that their
normalisation treats as one, the mean of its columns' deviations is printed beside the same number
from `Xstd.bin` and `Ystd.bin`, and their ratio. Theirs are of forty clips, ours of three, so a
third figure weighs our rows until their gaits are as frequent as the authors': what is left then is
not a matter of which gaits were recorded.

Also holds means: of the inputs for gaits, and of the two figures that tell pace, forward motion and
phase change per frame.

    python benches/holden_statistics.py
    python benches/holden_statistics.py --json
    python benches/holden_statistics.py --keep out/holden
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ambulo.cli.dataset import build_dataset, plan_dataset

CLIPS = ("LocomotionFlat04_000", "LocomotionFlat09_000", "NewCaptures10_000")
COPIES = 10
WINDOW = 12
GAITS = ("stand", "walk", "jog", "crouch", "jump", "bump")
# Joints whose inputs the authors' normalisation all but removes.
MASKED = (1, 6, 11, 14, 17, 21, 22, 23, 24, 28, 29, 30)
# The authors divide the deviation of joint inputs by this times 1, or times 1e-10 if masked.
JOINT_WEIGHT = 0.1
JOINTS = 31
WITHIN = 0.2

Vector = NDArray[np.float64]


def recordings() -> Path:
    """The folder of the published clips and network."""
    beside = Path(__file__).parents[1].parent / "shared" / "data"
    return Path(os.environ.get("AMBULO_DATA") or beside) / "holden-pfnn"


def blocks(joints: int) -> dict[str, tuple[str, slice]]:
    """Columns that the authors' normalisation treats as one, by name, with their side."""
    inputs = [
        ("trajectory x", WINDOW), ("trajectory z", WINDOW),
        ("direction x", WINDOW), ("direction z", WINDOW),
        ("gaits", 6 * WINDOW), ("joint positions", 3 * joints),
        ("joint velocities", 3 * joints), ("terrain", 3 * WINDOW),
    ]  # fmt: skip
    outputs = [
        ("root velocity", 2), ("root yaw", 1), ("phase change", 1), ("contacts", 4),
        ("next trajectory", WINDOW), ("next directions", WINDOW),
        ("joint positions out", 3 * joints), ("joint velocities out", 3 * joints),
        ("joint rotations out", 3 * joints),
    ]  # fmt: skip
    found: dict[str, tuple[str, slice]] = {}
    for side, table in (("input", inputs), ("output", outputs)):
        start = 0
        for name, size in table:
            found[name] = (side, slice(start, start + size))
            start += size
    return found


def published(folder: Path) -> dict[str, Vector]:
    """The authors' means and deviations, the weights of joint inputs taken out again."""
    names = {"input_mean": "Xmean", "input_std": "Xstd", "output_mean": "Ymean"}
    names["output_std"] = "Ystd"
    read = {
        ours: np.fromfile(folder / f"{theirs}.bin", np.float32).astype(float)
        for ours, theirs in names.items()
    }
    weights = np.ones((JOINTS, 3))
    weights[list(MASKED)] = 1e-10
    joints = slice(10 * WINDOW, 10 * WINDOW + 6 * JOINTS)
    read["input_std"][joints] *= JOINT_WEIGHT * np.tile(weights.ravel(), 2)
    return read


def build(data: Path, folder: Path) -> dict[str, Any]:
    """The data set of the three clips; returns its index."""
    height_map = data / "hmap_001_smooth.txt"
    settings = (
        f'layout = "holden"\nvalidation = 0.0\nlicence = "academic and non-commercial use"\n'
        f'[terrain]\nsource = "files"\nfiles = [{json.dumps(str(height_map))}]\ncopies = {COPIES}\n'
    )
    clips = [data / f"{name}.bvh" for name in CLIPS]
    folder.mkdir(parents=True, exist_ok=True)
    threads = os.cpu_count() or 1
    manifest, skipped = plan_dataset(clips, folder, settings, threads)
    if skipped:
        raise ValueError(f"clips are left out: {skipped}")
    build_dataset(folder, manifest, threads)
    return json.loads((folder / "dataset.json").read_bytes())


def rows(folder: Path, index: dict[str, Any]) -> tuple[Vector, Vector]:
    """All rows' two vectors, one copy of the ground in three: they hardly differ."""
    sizes = dict(index["columns"])
    first = sizes["phase"] + sizes["category"] + sizes["root"]
    shards = [np.load(folder / clip["file"], mmap_mode="r")[::3] for clip in index["clips"]]
    both = np.concatenate(shards)[:, first:].astype(float)
    return both[:, : sizes["input"]], both[:, sizes["input"] :]


def weights_for(inputs: Vector, wanted: Vector) -> Vector:
    """Weights of rows that make the mean of their gaits now the wanted one.

    Exponential tilting: the weights nearest to even ones (in relative entropy) with these means,
    by Newton's method. A gait that our rows show less than a third as often as wanted is left out:
    a few rows cannot stand for many.
    """
    now = 4 * WINDOW + np.arange(6) * WINDOW + WINDOW // 2
    means = inputs[:, now].mean(axis=0)
    shown = np.flatnonzero(means > wanted / 3.0)
    # The shares of the last one follow from the others.
    features, wanted = inputs[:, now[shown[:-1]]], wanted[shown[:-1]] / wanted[shown].sum()
    wanted = wanted * means[shown].sum()
    tilt, weights = np.zeros(len(wanted)), np.full(len(inputs), 1.0 / len(inputs))
    for _ in range(100):
        off = wanted - weights @ features
        spread = (features * weights[:, None]).T @ features
        spread -= np.outer(weights @ features, weights @ features)
        tilt += 0.5 * np.linalg.lstsq(spread, off, rcond=1e-9)[0]
        weights = np.exp(features @ tilt)
        weights /= weights.sum()
    return weights


def deviations(values: Vector, weights: Vector) -> Vector:
    """Weighted deviation of every column."""
    mean = weights @ values
    return np.sqrt(np.maximum(weights @ (values - mean) ** 2, 0.0))


def compare(folder: Path, index: dict[str, Any], data: Path) -> dict[str, Any]:
    """Everything that is printed."""
    theirs = published(data / "network")
    statistics = {key: np.asarray(value) for key, value in index["statistics"].items()}
    inputs, outputs = rows(folder, index)
    now = slice(4 * WINDOW + WINDOW // 2, 10 * WINDOW, WINDOW)
    even = np.full(len(inputs), 1.0 / len(inputs))
    weights = weights_for(inputs, theirs["input_mean"][now])
    weighed = {"input": deviations(inputs, weights), "output": deviations(outputs, weights)}
    table = {}
    for name, (side, where) in blocks(JOINTS).items():
        ours = float(np.abs(statistics[f"{side}_std"][where]).mean())
        published_mean = float(np.abs(theirs[f"{side}_std"][where]).mean())
        table[name] = {
            "ours": ours,
            "published": published_mean,
            "ratio": ours / published_mean,
            "ratio_same_gaits": float(weighed[side][where].mean()) / published_mean,
        }
    return {
        "rows": int(statistics["rows"]),
        "blocks": table,
        "gaits": {
            name: {"ours": float(ours), "published": float(published_mean)}
            for name, ours, published_mean in zip(
                GAITS, even @ inputs[:, now], theirs["input_mean"][now], strict=True
            )
        },
        "means": {
            name: {
                "ours": float(statistics["output_mean"][column]),
                "same_gaits": float(weights @ outputs[:, column]),
                "published": float(theirs["output_mean"][column]),
            }
            for name, column in (("root z, cm a frame", 1), ("phase change a frame", 3))
        },
    }


def show(found: dict[str, Any]) -> None:
    """Print tables."""
    print(f"{found['rows']} rows\n")
    print(f"{'mean deviation':22}{'ours':>10}{'published':>11}{'ratio':>8}{'same gaits':>12}")
    for name, row in found["blocks"].items():
        mark = "" if abs(row["ratio"] - 1.0) <= WITHIN else "  beyond 20 %"
        print(
            f"{name:22}{row['ours']:10.4f}{row['published']:11.4f}{row['ratio']:8.2f}"
            f"{row['ratio_same_gaits']:12.2f}{mark}"
        )
    print(f"\n{'share of gaits':22}{'ours':>10}{'published':>11}")
    for name, row in found["gaits"].items():
        print(f"{name:22}{row['ours']:10.3f}{row['published']:11.3f}")
    print(f"\n{'mean':22}{'ours':>10}{'published':>11}{'same gaits':>12}")
    for name, row in found["means"].items():
        print(f"{name:22}{row['ours']:10.4f}{row['published']:11.4f}{row['same_gaits']:12.4f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--keep", type=Path, help="build the data set here and leave it")
    parser.add_argument("--json", action="store_true", help="print as JSON")
    options = parser.parse_args()
    data = recordings()
    if not (data / "network").is_dir():
        print(f"no published clips and network at {data}: set AMBULO_DATA", file=sys.stderr)
        return
    with tempfile.TemporaryDirectory() as scratch:
        folder = options.keep or Path(scratch)
        found = compare(folder, build(data, folder), data)
    if options.json:
        print(json.dumps(found, indent=2))
    else:
        show(found)


if __name__ == "__main__":
    main()
