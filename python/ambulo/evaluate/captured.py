"""The same figures of motion capture, from motion files or a data set that was built of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ambulo import _core
from ambulo.data import COLUMNS, Dataset, spans
from ambulo.evaluate.commands import FPS, Steady
from ambulo.evaluate.faults import inward
from ambulo.evaluate.steady import Body, Motion, figures, floors, sways
from ambulo.model import Model

Array = NDArray[np.floating]
Mask = NDArray[np.bool_]
Clip = tuple[Array, Sequence[tuple[int, int]]]
"""Rows as in a data set's shard, and the runs (first row, rows) of consecutive ones."""

# What counts as the same gait at the same speed: a fifth more or less; turns are rare, so a third.
NEAR, NEAR_IN_TURNS = 0.2, 1 / 3
STRAIGHT, TURNING = np.radians(30.0), np.radians([60.0, 120.0])
STANDING = 0.15  # Metres a second; people who stand shift their weight.
# Ground is level where its samples differ by less, metres.
LEVEL = 0.02
# Runs shorter than this tell nothing of jerk, frames.
SHORTEST = 12
# Of a row, as the builder numbers them.
CATEGORIES = tuple(_core.dataset_categories())
CATEGORY = {
    "stand": "stand", "walk": "walk", "jog": "jog", "run": "run", "crouch": "crouch",
    "back": "backward", "left": "sideways", "right": "sideways",
    "turn left": "walk", "turn right": "walk",
}  # fmt: skip


@dataclass(frozen=True)
class Capture:
    """Somebody's motion, clip by clip, in the rows of one layout."""

    layout: dict[str, Any]
    """`name`, and `inputs` and `outputs` as lists of name and size."""
    parts: dict[str, Any]
    """`skeleton` and `feet`, as in a bundle."""
    clips: Sequence[Callable[[], Clip]]
    """Each reads one clip, or raises ValueError with the reason why it cannot be used."""
    categories: tuple[str, ...] = CATEGORIES

    @classmethod
    def of_dataset(cls, dataset: Dataset) -> Capture:
        """All clips of a data set, training and validation."""
        shards = dataset.shards
        return cls(
            layout=dataset.layout,
            parts=dataset.parts,
            clips=[lambda s=shard: (np.asarray(s.open()), s.runs) for shard in shards],
            categories=dataset.categories,
        )

    @classmethod
    def of_files(cls, model: Model, files: Iterable[Path]) -> Capture:
        """Motion files of somebody with the model's skeleton, and their mirror images."""

        def reader(file: Path, mirrored: bool) -> Callable[[], Clip]:
            def read() -> Clip:
                found = _core.clip_rows(model.core, str(file), mirrored=mirrored)
                return found["rows"], found["runs"]

            return read

        clips = [reader(file, mirrored) for file in files for mirrored in (False, True)]
        return cls(model.header["layout"], model.header["parts"], clips)


@dataclass
class _Sum:
    """Figures of many stretches, weighted by their frames; sways one a window."""

    frames: int = 0
    totals: dict[str, float] = field(default_factory=dict)
    sways: dict[str, list[Array]] = field(default_factory=dict)

    def add(self, motions: Sequence[Motion], body: Body, floor: Array, standing: bool) -> None:
        frames = sum(m.frames for m in motions)
        self.frames += frames
        for key, value in figures(motions, body, floor).items():
            self.totals[key] = self.totals.get(key, 0.0) + frames * value
        if standing:
            for key, values in sways(motions, body).items():
                self.sways.setdefault(key, []).append(values)

    def result(self) -> dict[str, float]:
        if not self.frames:
            return {"seconds": 0.0}
        means = {key: total / self.frames for key, total in self.totals.items()}
        pooled = {key: np.concatenate(values) for key, values in self.sways.items()}
        medians = {key: float(np.median(values)) for key, values in pooled.items() if len(values)}
        return {"seconds": self.frames / FPS, **means, **medians}


def measure_capture(
    capture: Capture, classes: Sequence[Steady]
) -> tuple[dict[str, dict[str, float]], list[str]]:
    """By class, the figures of the frames in which somebody does the same on level ground.

    `seconds` says how much was found; with none there are no figures. One clip is in memory at a
    time. The second list has the reasons why clips could not be used.

    Raises:
        ValueError: none could.
    """
    body, table = Body.of(capture.parts), _Table(capture)
    sums = {steady.name: _Sum() for steady in classes}
    skipped: dict[str, None] = {}
    used = 0
    for read in capture.clips:
        try:
            rows, runs = read()
        except (ValueError, OSError) as error:
            skipped[str(error)] = None
            continue
        used += 1
        clip = _Clip(table, rows, runs, body)
        for steady in classes:
            motions = list(clip.motions(clip.doing(steady)))
            if motions:
                sums[steady.name].add(motions, body, clip.floor, not steady.speed)
    if not used:
        reason = next(iter(skipped), "there is none")
        raise ValueError(f"no motion capture can be compared with the model: {reason}")
    return {name: found.result() for name, found in sums.items()}, list(skipped)


class _Table:
    """Where the numbers of a row lie, and their units."""

    def __init__(self, capture: Capture) -> None:
        layout = capture.layout
        sides = {side: spans(list(map(tuple, layout[side]))) for side in ("inputs", "outputs")}
        widths = {side: max(at.stop for at in blocks.values()) for side, blocks in sides.items()}
        columns = spans([*COLUMNS, *widths.items()])
        self.category, self.root = columns["category"], columns["root"]
        self.blocks = {
            (side, name): slice(columns[side].start + at.start, columns[side].start + at.stop)
            for side, blocks in sides.items()
            for name, at in blocks.items()
        }
        self.categories = np.array(capture.categories)
        joints = len(capture.parts["skeleton"])
        table = _core.layout(layout["name"], joints)
        self.metre, self.left = table["units_per_metre"], table["yaw_sign"]
        self.rate = 1.0 / table["rate_time"]


class _Clip:
    """One clip's rows as places in the world, and what is done in each."""

    def __init__(
        self, table: _Table, rows: Array, runs: Sequence[tuple[int, int]], body: Body
    ) -> None:
        def block(side: str, name: str) -> Array:
            return rows[:, table.blocks[side, name]].astype(float)

        self.runs = runs
        root = rows[:, table.root].astype(float)
        self.root, self.yaw = root[:, [0, 2]], root[:, 3]
        pose = block("outputs", "joint_position").reshape(len(rows), -1, 3) / table.metre
        self.positions = inward(pose, -self.yaw[:, None]) + root[:, None, :3]
        ground = block("inputs", "terrain_centre") / table.metre
        self.toes_above = pose[:, body.toes, 1] - ground[:, [ground.shape[1] // 2]]
        self.touching = block("outputs", "contacts")[:, [1, 3]] > 0.5
        level = np.ptp(ground, axis=1) < LEVEL
        # Motion on hills alone is still better than none.
        self.level = level if level.any() else np.ones(len(rows), bool)
        self.velocity = block("outputs", "root_velocity") * table.rate / table.metre
        self.turn = table.left * table.rate * block("outputs", "root_yaw")[:, 0]
        self.category = table.categories[rows[:, table.category][:, 0].astype(int)]
        whole = list(self.motions(np.ones(len(rows), bool)))
        heights = np.array(body.toe_heights)
        self.floor = floors(whole, heights) if whole else heights

    def doing(self, steady: Steady) -> Mask:
        """(rows,) whether this is what a command asks for, on level ground."""
        of_kind = (self.category == CATEGORY[steady.name]) & self.level
        speed, turn = _smoothed(np.hypot(*self.velocity.T)), _smoothed(self.turn)
        if not steady.speed:
            return of_kind & (speed < STANDING)
        near = NEAR_IN_TURNS if steady.turn else NEAR
        of_kind &= np.abs(speed - steady.speed) < near * steady.speed
        if steady.turn:
            least, most = TURNING
            return of_kind & (turn * np.sign(steady.turn) > least) & (np.abs(turn) < most)
        if steady.name in ("left", "right"):
            of_kind &= self.velocity[:, 0] * np.sign(steady.aside) > 0.0
        return of_kind & (np.abs(turn) < STRAIGHT)

    def motions(self, wanted: Mask) -> Iterator[Motion]:
        """The longest stretches of consecutive frames that are all wanted."""
        for first, rows in self.runs:
            inside = np.zeros(rows + 2, bool)
            inside[1:-1] = wanted[first : first + rows]
            edges = np.flatnonzero(np.diff(inside.astype(int))) + first
            for start, end in edges.reshape(-1, 2):
                if end - start >= SHORTEST:
                    yield self._motion(slice(start, end))

    def _motion(self, at: slice) -> Motion:
        return Motion(
            self.positions[at], self.root[at], self.yaw[at], self.toes_above[at], self.touching[at]
        )


def _smoothed(values: Array, seconds: float = 0.5) -> Array:
    """The mean over `seconds` around each row."""
    reach = max(round(0.5 * seconds * FPS), 1)
    total = np.cumsum(np.pad(values.astype(float), (reach + 1, reach), mode="edge"))
    width = 2 * reach + 1
    return (total[width:] - total[:-width]) / width
