"""How fast BVH files are read, in MB/s on one thread, beside other readers from PyPI.

Reads the same files with every reader in turn, and the whole again `--repeats` times, so that a
machine that slows down slows all of them. Each reader is measured as its users call it: from a path
to what it hands over. Ours: local quaternions, and its guesses at axes and unit. pybvh 0.9: Euler
angles as arrays, and its guess at the up axis. bvhio 1.5: `readAsBvh`, a pose a joint and frame. A
reader that refuses a folder's first file is named with its reason and not measured there.

    python benches/motion_formats.py
    python benches/motion_formats.py --files 115 --readers ambulo --repeats 9
    python benches/motion_formats.py captures/ --json
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import importlib.metadata
import json
import os
import platform
import statistics
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

READERS = {
    "ambulo": ("ambulo", "read_motion"),
    "pybvh": ("pybvh", "read_bvh_file"),
    "bvhio": ("bvhio", "readAsBvh"),
}


def recordings() -> list[Path]:
    """The folders of the recordings that hold BVH files with one person, if they are there."""
    beside = Path(__file__).parents[1].parent / "shared" / "data"
    data = Path(os.environ.get("AMBULO_DATA") or beside)
    folders = [data / "lafan1", data / "holden-pfnn"]
    return [folder for folder in folders if folder.is_dir()]


def find(names: Sequence[str]) -> dict[str, Callable[[str], Any]]:
    """The readers that are installed; of the others it is said that they are not."""
    found = {}
    for name in names:
        module, function = READERS[name]
        try:
            found[name] = getattr(importlib.import_module(module), function)
        except ImportError:
            print(f"{name}: not installed (requirements/bench.txt has it)", file=sys.stderr)
    return found


def seconds(read: Callable[[str], Any], files: Sequence[Path]) -> float:
    """Time to read all files, one after the other."""
    with warnings.catch_warnings(), open(os.devnull, "w") as null:
        warnings.simplefilter("ignore")
        with contextlib.redirect_stdout(null):
            start = time.perf_counter()
            for file in files:
                read(str(file))
            return time.perf_counter() - start


def refusals(readers: dict[str, Callable[[str], Any]], file: Path) -> dict[str, str]:
    """Why readers refuse a file; those that take it are warm afterwards."""
    refused = {}
    for name, read in readers.items():
        try:
            seconds(read, [file])
        except Exception as error:  # Whatever another program raises.
            refused[name] = str(error.__cause__ or error)
    return refused


def measure(
    readers: dict[str, Callable[[str], Any]], files: Sequence[Path], repeats: int
) -> dict[str, list[float]]:
    """MB/s of every reader in every round."""
    megabytes = sum(len(file.read_bytes()) for file in files) / 1e6
    rates: dict[str, list[float]] = {name: [] for name in readers}
    for _ in range(repeats):
        for name, read in readers.items():
            rates[name].append(megabytes / seconds(read, files))
    return rates


def cpu() -> str:
    """The processor's name, where the system tells it."""
    with contextlib.suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def report(folder: Path, files: Sequence[Path], options: argparse.Namespace) -> dict[str, Any]:
    """Measure a folder: what was measured, on what."""
    found = find(options.readers)
    refused = refusals(found, files[0])
    taken = {name: read for name, read in found.items() if name not in refused}
    rates = measure(taken, files, max(options.repeats, 1))
    readers = {}
    for name, values in rates.items():
        readers[name] = {
            "version": importlib.metadata.version(name),
            "median_mb_s": statistics.median(values),
            "lowest_mb_s": min(values),
            "highest_mb_s": max(values),
        }
    return {
        "folder": folder.name,
        "files": len(files),
        "megabytes": sum(file.stat().st_size for file in files) / 1e6,
        "repeats": options.repeats,
        "threads": 1,
        "machine": f"{cpu()}, {platform.system()}, Python {platform.python_version()}",
        "readers": readers,
        "refused": refused,
    }


def show(result: dict[str, Any]) -> None:
    """Print a table."""
    size = f"{result['files']} files, {result['megabytes']:.1f} MB"
    print(f"{result['folder']}: {size}, {result['repeats']} rounds")
    print(f"{result['machine']}, one thread\n")
    print(f"{'reader':<16}{'median':>12}{'lowest':>12}{'highest':>12}   MB/s")
    for name, reader in result["readers"].items():
        label = f"{name} {reader['version']}"
        figures = (reader[f"{what}_mb_s"] for what in ("median", "lowest", "highest"))
        print(f"{label:<16}" + "".join(f"{figure:>12.2f}" for figure in figures))
    for name, reason in result["refused"].items():
        print(f"{name} refuses these files: {reason}")
    print()


def main() -> int:
    """Measure and print; exit code 2 where there is nothing to measure."""
    parser = argparse.ArgumentParser(description="Measure how fast BVH files are read.")
    parser.add_argument("folders", nargs="*", type=Path, help="default: those of $AMBULO_DATA")
    parser.add_argument("--files", type=int, default=5, help="the first N files (default: 5)")
    parser.add_argument("--repeats", type=int, default=5, help="rounds (default: 5)")
    parser.add_argument("--readers", nargs="+", choices=READERS, default=list(READERS))
    parser.add_argument("--json", action="store_true", help="print JSON")
    options = parser.parse_args()

    folders = options.folders or recordings()
    if not folders:
        print("skipped: no recordings; name a folder of BVH files, or set AMBULO_DATA")
        return 0
    if hasattr(os, "sched_setaffinity"):
        # Whatever threads a reader starts, they share one core.
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    results = []
    for folder in folders:
        files = sorted(folder.glob("*.bvh"))[: max(options.files, 0)]
        if not files:
            print(f"{folder}: no BVH file", file=sys.stderr)
            return 2
        results.append(report(folder, files, options))
        if not options.json:
            show(results[-1])
    if options.json:
        print(json.dumps(results, indent=2))
    return 0


if __name__ == "__main__":
    sys.exit(main())
