"""A data set on disk: opening it, its rows by name, and batches of it in bounded memory.

A folder with `dataset.json` and one float32 array of rows a clip under `shards/`. A row has the
columns that `dataset.json` names: the phase in cycles, the category, the root in the world (x,
height, z, yaw) and the layout's two vectors. Rows within one of a clip's runs are consecutive
frames. `ambulo dataset build` writes such folders.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ambulo import _core

FORMAT = 1
COLUMNS = (("phase", 1), ("category", 1), ("root", 4))
SPLITS = ("training", "validation")

Rows = NDArray[np.float32]
Side = Literal["inputs", "outputs"]


class DatasetError(ValueError):
    """A folder is not a data set that can be used; the message says what to do."""


@dataclass(frozen=True)
class Shard:
    """One clip's rows."""

    name: str
    path: Path
    split: str
    rows: int
    runs: tuple[tuple[int, int], ...]
    """(first row, rows): consecutive frames."""
    categories: tuple[int, ...]
    """Rows of each category."""

    def open(self) -> Rows:
        """The rows, memory-mapped; pages are given back when the array goes."""
        return np.load(self.path, mmap_mode="r", allow_pickle=False)


@dataclass(frozen=True)
class Statistics:
    """Of the training clips, a column at a time."""

    rows: int
    input_mean: Rows
    input_std: Rows
    output_mean: Rows
    output_std: Rows


@dataclass(frozen=True)
class Dataset:
    """An opened data set; nothing of the shards is in memory."""

    folder: Path
    layout: dict[str, Any]
    fps: float
    parts: dict[str, Any]
    licence: str
    provenance: dict[str, str]
    categories: tuple[str, ...]
    shards: tuple[Shard, ...]
    statistics: Statistics
    identity: str
    """Changes with anything in `dataset.json` and with the size of any shard."""
    blocks: dict[str, dict[str, slice]] = field(repr=False)
    """By side and name: where a block's numbers lie in its vector."""

    @property
    def widths(self) -> tuple[int, int]:
        """Lengths of the input and the output vector."""
        return (
            sum(size for _, size in self.layout["inputs"]),
            sum(size for _, size in self.layout["outputs"]),
        )

    @property
    def columns(self) -> dict[str, slice]:
        """Where phase, category, root, input and output lie in a row."""
        return spans([*COLUMNS, ("input", self.widths[0]), ("output", self.widths[1])])

    @property
    def row_bytes(self) -> int:
        """Bytes of a row."""
        return 4 * (sum(self.widths) + sum(size for _, size in COLUMNS))

    @property
    def frame(self) -> float:
        """One frame in the unit that the layout's velocities count in."""
        return 1.0 / (self.fps * self._table["rate_time"])

    @property
    def turn(self) -> float:
        """1 where a positive yaw rate turns towards +X, −1 where it turns away."""
        return self._table["yaw_sign"]

    @property
    def _table(self) -> Any:
        return _core.layout(self.layout["name"], len(self.joints))

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the skeleton's joints."""
        return tuple(joint["name"] for joint in self.parts["skeleton"])

    def of(self, split: str) -> list[Shard]:
        """The clips of a split."""
        return [shard for shard in self.shards if shard.split == split]

    def rows(self, split: str) -> int:
        """How many rows a split has."""
        return sum(shard.rows for shard in self.of(split))


def spans(table: list[tuple[str, int]]) -> dict[str, slice]:
    """Names and sizes, one after the other, as slices."""
    ends = np.cumsum([size for _, size in table]).tolist()
    return {name: slice(end - size, end) for (name, size), end in zip(table, ends, strict=True)}


# -- opening ----------------------------------------------------------------------------------


def open_dataset(folder: str | Path) -> Dataset:
    """Open a data set and check that it is whole.

    Raises:
        DatasetError: no data set, one of another version, or one that does not fit itself.
    """
    folder = Path(folder)
    path = folder / "dataset.json"
    try:
        text = path.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        raise DatasetError(
            f"{folder}: no dataset.json here; `ambulo dataset build` makes a data set from a "
            "folder of motion capture (it is written last, so a build that was stopped has none: "
            "build again, it goes on where it was)"
        ) from None
    try:
        manifest = json.loads(text)
        if manifest["format"] > FORMAT:
            raise DatasetError(
                f"{path}: of format {manifest['format']}, this version reads up to {FORMAT}: "
                "update Ambulo"
            )
        dataset = _dataset(folder, manifest)
    except (KeyError, TypeError, AttributeError, json.JSONDecodeError) as error:
        what = f"'{error.args[0]}' is missing" if isinstance(error, KeyError) else str(error)
        raise DatasetError(f"{path}: {what}; build the data set again") from error
    _check(path, dataset, manifest)
    return dataset


def _dataset(folder: Path, manifest: dict[str, Any]) -> Dataset:
    layout = manifest["layout"]
    tables = {side: [(str(n), int(s)) for n, s in layout[side]] for side in ("inputs", "outputs")}
    shards = tuple(_shard(folder, clip) for clip in manifest["clips"])
    sizes = [[s.name, s.path.stat().st_size if s.path.is_file() else -1] for s in shards]
    content = json.dumps([manifest, sizes], sort_keys=True).encode()
    numbers = manifest["statistics"]
    sides = ("input_mean", "input_std", "output_mean", "output_std")
    return Dataset(
        folder=folder,
        layout={"name": layout["name"], "hash": layout["hash"], **tables},
        fps=float(manifest["fps"]),
        parts=manifest["parts"],
        licence=str(manifest["licence"]),
        provenance={str(k): str(v) for k, v in manifest["provenance"].items()},
        categories=tuple(manifest["categories"]),
        shards=shards,
        statistics=Statistics(
            int(numbers["rows"]), *(np.asarray(numbers[side], np.float32) for side in sides)
        ),
        identity=hashlib.sha256(content).hexdigest()[:16],
        blocks={side: spans(table) for side, table in tables.items()},
    )


def _shard(folder: Path, clip: dict[str, Any]) -> Shard:
    return Shard(
        name=str(clip["name"]),
        path=folder / clip["file"],
        split=str(clip["split"]),
        rows=int(clip["rows"]),
        runs=tuple((int(first), int(rows)) for first, rows in clip["runs"]),
        categories=tuple(int(rows) for rows in clip["categories"]),
    )


def _check(path: Path, dataset: Dataset, manifest: dict[str, Any]) -> None:
    """Refuse what would only show as nonsense much later."""
    nx, ny = dataset.widths
    expected = [list(column) for column in (*COLUMNS, ("input", nx), ("output", ny))]
    if manifest["columns"] != expected:
        raise DatasetError(
            f"{path}: columns {manifest['columns']}, expected {expected}; build the data set again"
        )
    if not dataset.licence.strip():
        raise DatasetError(
            f"{path}: the licence is empty; say there what the motion may be used for, the model "
            "will carry it"
        )
    stats = dataset.statistics
    for name, width in (("input", nx), ("output", ny)):
        for kind in ("mean", "std"):
            values = getattr(stats, f"{name}_{kind}")
            if values.shape != (width,) or not np.isfinite(values).all():
                raise DatasetError(
                    f"{path}: statistics.{name}_{kind} is not {width} finite numbers; build the "
                    "data set again"
                )
    for shard in dataset.shards:
        _check_shard(shard, dataset)
    if not dataset.rows("training"):
        raise DatasetError(f"{path}: no clip is for training; change the split and build again")


def _check_shard(shard: Shard, dataset: Dataset) -> None:
    where = f"{shard.path}: "
    if shard.split not in SPLITS:
        raise DatasetError(f"{where}split '{shard.split}', expected one of {', '.join(SPLITS)}")
    try:
        rows = shard.open()
    except (OSError, ValueError) as error:
        raise DatasetError(
            f"{where}cannot be read ({error}); building the data set again restores it"
        ) from error
    shape = (shard.rows, dataset.row_bytes // 4)
    if rows.shape != shape or rows.dtype != np.float32:
        raise DatasetError(
            f"{where}{rows.dtype} numbers of shape {rows.shape}, expected float32 {shape}; build "
            "the data set again"
        )
    at = 0
    for first, count in shard.runs:
        if first < at or count < 1 or first + count > shard.rows:
            raise DatasetError(
                f"{where}run of {count} rows from row {first} does not fit; build again"
            )
        at = first + count


# -- windows ----------------------------------------------------------------------------------


def windows(dataset: Dataset, split: str, frames: int, count: int) -> Rows:
    """At most `count` windows of consecutive rows, spread evenly over a split.

    Returns:
        (windows, frames, columns); no window at all if no run is that long.
    """
    shards = dataset.of(split)
    runs = [(shard, *run) for shard in shards for run in shard.runs if run[1] >= frames]
    ends = np.cumsum([rows - frames + 1 for _, _, rows in runs], dtype=np.int64)
    total = int(ends[-1]) if runs else 0
    picked = np.unique(np.linspace(0, max(total - 1, 0), count).astype(np.int64))[:total]
    found = np.empty((len(picked), frames, dataset.row_bytes // 4), np.float32)
    for start, window in zip(picked, found, strict=True):
        index = int(np.searchsorted(ends, start, side="right"))
        shard, first, rows = runs[index]
        row = first + int(start - ends[index]) + rows - frames + 1
        window[:] = shard.open()[row : row + frames]
    return found
