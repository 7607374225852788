"""How fast motion files become a data set: seconds and frames a second, on one thread and more.

A build reads the files, labels them, mirrors them, and writes every row to disk, into a fresh
folder each time; the manifest is planned before and counted apart. Builds with different numbers of
threads take turns, so that a machine that slows down slows all of them. Then the same folder is
built again with nothing to do. Frames count at the data set's rate, mirror images too. Without
recordings the clips of the starter motion are taken.

    python benches/dataset.py
    python benches/dataset.py --threads 1 2 8 --repeats 9
    python benches/dataset.py captures/ --json
"""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import os
import platform
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

from ambulo import _core, write_motion
from ambulo.cli.motion import motion_files
from ambulo.starter_motion import clips


def recordings(scratch: Path) -> Path:
    """The folder of LAFAN1's clips, or one with made clips."""
    beside = Path(__file__).parents[1].parent / "shared" / "data"
    folder = Path(os.environ.get("AMBULO_DATA") or beside) / "lafan1"
    if folder.is_dir():
        return folder
    made = scratch / "starter-motion"
    made.mkdir()
    for clip in clips():
        write_motion(made / f"{clip.name}.bvh", clip.clip)
    return made


def build(folder: Path, manifest: str, threads: int) -> float:
    """Seconds of one build."""
    start = time.perf_counter()
    _core.dataset_build(str(folder), manifest, threads=threads)
    return time.perf_counter() - start


def measure(source: Path, options: argparse.Namespace, scratch: Path) -> dict[str, Any]:
    """Everything that is printed."""
    files = [str(file) for file in motion_files(source)]
    most = max(options.threads)
    # Beside the folders that are built, so that its relative paths hold in all of them.
    start = time.perf_counter()
    manifest, skipped = _core.dataset_plan(files, str(scratch / "0"), threads=most)
    planning = time.perf_counter() - start
    seconds: dict[int, list[float]] = {threads: [] for threads in options.threads}
    again: list[float] = []
    found: dict[str, Any] = {}
    for _ in range(max(options.repeats, 1)):
        for threads in options.threads:
            with tempfile.TemporaryDirectory(dir=scratch) as name:
                folder = Path(name)
                seconds[threads].append(build(folder, manifest, threads))
                again.append(build(folder, manifest, threads))
                if not found:
                    found = described(folder)
    frames = found["frames"]
    return {
        "source": source.name,
        "files": len(files) - len(skipped),
        **found,
        "repeats": options.repeats,
        "planning_s": planning,
        "building_again_s": statistics.median(again),
        "threads": {
            str(threads): {
                "median_s": statistics.median(values),
                "lowest_s": min(values),
                "highest_s": max(values),
                "median_frames_s": frames / statistics.median(values),
            }
            for threads, values in seconds.items()
        },
        "version": importlib.metadata.version("ambulo"),
        "machine": f"{platform.machine()}, {os.cpu_count()} processors",
    }


def described(folder: Path) -> dict[str, Any]:
    """What a data set holds."""
    clips = json.loads((folder / "dataset.json").read_bytes())["clips"]
    return {
        "shards": len(clips),
        "frames": sum(clip["frames"] for clip in clips),
        "rows": sum(clip["rows"] for clip in clips),
        "megabytes": sum((folder / clip["file"]).stat().st_size for clip in clips) / 1e6,
    }


def show(found: dict[str, Any]) -> None:
    """Print a table."""
    print(
        f"{found['source']}: {found['files']} files, {found['frames']} frames with their mirror "
        f"images, {found['rows']} rows, {found['megabytes']:.0f} MB; {found['machine']}"
    )
    print(f"{'threads':>8}{'median s':>10}{'lowest':>8}{'highest':>9}{'frames/s':>10}")
    for threads, row in found["threads"].items():
        print(
            f"{threads:>8}{row['median_s']:10.2f}{row['lowest_s']:8.2f}{row['highest_s']:9.2f}"
            f"{row['median_frames_s']:10.0f}"
        )
    print(f"planning {found['planning_s']:.2f} s, building again {found['building_again_s']:.2f} s")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("source", nargs="?", type=Path, help="file or folder; default: LAFAN1")
    parser.add_argument("--threads", nargs="+", type=int, default=[1, 2])
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--json", action="store_true", help="print as JSON")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        scratch = Path(name)
        found = measure(options.source or recordings(scratch), options, scratch)
    if options.json:
        print(json.dumps(found, indent=2))
    else:
        show(found)


if __name__ == "__main__":
    main()
