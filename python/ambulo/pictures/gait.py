"""The gait diagram of a creature's episode: which foot is down when, and what the joints do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw

from ambulo.pictures.creature_body import Array, Body, read_body
from ambulo.pictures.creature_sheet import check_rollout, check_window
from ambulo.pictures.creature_view import (
    Rgb,
    headline,
    length,
    mix,
    nice,
    paint_rectangle,
    write,
)
from ambulo.pictures.stage import INK, PAPER, QUIET, Picture
from ambulo.rollout import Rollout

FINE = 3  # lines are drawn this many times larger and reduced
BAR: Rgb = (72, 112, 130)
TRACK: Rgb = (236, 234, 229)  # behind the bars
GRID: Rgb = (226, 225, 222)
HUES: tuple[Rgb, ...] = (
    (47, 127, 150),
    (224, 138, 60),
    (184, 64, 106),
    (106, 154, 58),
    (122, 91, 176),
    (201, 162, 39),
    (74, 111, 196),
    (128, 110, 98),
)
FADED = 0.5  # the far one of a pair, mixed with paper


@dataclass(frozen=True)
class _Curve:
    values: Array
    colour: Rgb


@dataclass(frozen=True)
class _Lane:
    """A row of the diagram with curves in it."""

    name: str
    curves: tuple[_Curve, ...]
    note: str
    tall: float
    """Pixels at a width of 960."""


def draw_gait(
    rollout: Rollout,
    *,
    start: int = 0,
    stop: int | None = None,
    title: str = "",
    notes: Sequence[str] = (),
    period_s: float | None = None,
    width: int = 960,
) -> Picture:
    """The gait diagram of steps `start` to `stop`, (H, W, 3); its height follows what is in it.

    A row a foot, with a bar while it is on the ground; at the right its duty factor (the part of
    the time that it is down; of whole periods, where one is known) and, where `period_s` gives the
    gait's period in seconds, its phase: how far its touch-down lags behind that of the first foot,
    0 to 1 of a period. A creature without legs has a row for every part that touches the ground.
    Below are the angles of all driven joints in degrees, the far joint of a pair in a lighter
    shade, and the torso's height in metres and its angle in degrees from the start pose. The time
    axis is in seconds of the episode.

    `stop`: the last step if None; `title`: the creature's name if empty; `notes` are put under
    it; `width` in pixels. Raises ValueError for a window outside the episode and other arguments
    that cannot be drawn.
    """
    if not 320 <= width <= 8192:
        raise ValueError(f"width must be 320 to 8192 pixels, not {width}")
    if period_s is not None and not (np.isfinite(period_s) and period_s > 0.0):
        raise ValueError(f"period_s must be above 0 s, not {period_s}")
    body = read_body(rollout.creature)
    check_rollout(rollout, body)
    stop = check_window(rollout, start, stop)
    page = _Page(width / 960.0, width, start * rollout.dt, stop * rollout.dt)
    feet = _feet(rollout, body)
    angles = _angle_lanes(rollout, body, start, stop)
    torso = _torso_lanes(rollout, body, start, stop)
    words = list(notes)
    if period_s is not None:
        words.append(f"period {period_s:.2f} s")
    unit = page.unit
    tops = [96.0 * unit]  # where the sections begin
    tops.append(tops[0] + (len(feet) * 18.0 + 40.0) * unit)
    tops.append(tops[1] + (sum(lane.tall for lane in angles) + 36.0) * unit * bool(angles))
    bottom = tops[2] + sum(lane.tall for lane in torso) * unit
    canvas = np.empty((round(bottom + 44.0 * unit), width, 3), np.uint8)
    canvas[:] = PAPER
    page.grid(canvas, tops[0] - 4.0 * unit, bottom)
    # A touch is found by the step before it, so a row of `touching` stands for that step.
    touching = rollout.touching[start + 1 : stop + 1]
    duty, phase = gait_numbers(touching[:, [i for _, i in feet]], rollout.dt, period_s)
    _draw_feet(canvas, page, tops[0], rollout, body, touching, duty, phase)
    page.lanes(canvas, tops[1], "joint angles", angles)
    page.lanes(canvas, tops[2], "torso", torso)
    headline(canvas, unit, title or body.name, "  ·  ".join(words))
    return canvas


# Numbers ------------------------------------------------------------------------------------


def gait_numbers(touching: ArrayLike, dt: float, period_s: float | None) -> tuple[Array, Array]:
    """Duty factor (F,) and phase (F,) of feet that are down at `touching` (T, F), `dt` s a row.

    The phase is that of the touch-down behind the first foot's, 0 to 1 of `period_s` seconds; NaN
    where the period is None, or longer than the time given, or where this foot or the first
    touches never or always. It is read off the middle of the stance, which a bounce hardly shifts.
    """
    touching = np.asarray(touching, np.float64)
    steps, feet = touching.shape
    nothing: Array = np.full(feet, np.nan)
    if period_s is None or period_s > (steps + 0.5) * dt or not feet:
        return touching.mean(0) if steps else nothing, nothing
    whole = round(np.floor(steps * dt / period_s + 1e-6) * period_s / dt)
    touching = touching[-max(whole, 1) :]  # whole periods, the last ones
    duty = touching.mean(0)
    turn = np.exp(2.0j * np.pi * (np.arange(len(touching)) + 0.5) * dt / period_s)
    mean = (touching * turn[:, None]).mean(0)
    touch_down = np.angle(mean) / (2.0 * np.pi) - 0.5 * duty
    touch_down[np.abs(mean) < 0.02] = np.nan
    phase = np.mod(touch_down - touch_down[0], 1.0)
    # 0.999 is 0.00 to a reader.
    return duty, np.where(phase > 0.995, 0.0, phase)


# Feet ---------------------------------------------------------------------------------------


def _feet(rollout: Rollout, body: Body) -> list[tuple[str, int]]:
    """Name and part of every row."""
    if rollout.legs:
        return [(leg.name, leg.foot) for leg in rollout.legs]
    touched = np.flatnonzero(np.asarray(rollout.touching).any(0))
    return [(body.parts[i].name, int(i)) for i in touched]


def _draw_feet(
    canvas: Picture, page: _Page, top: float, rollout: Rollout, body: Body,
    touching: NDArray[np.bool_], duty: Array, phase: Array,
) -> None:  # fmt: skip
    unit = page.unit
    feet = _feet(rollout, body)
    phased = bool(np.isfinite(phase).any())
    heading = f"{'feet' if rollout.legs else 'parts'} on the ground"
    columns = (page.right + 50.0 * unit, page.right + 100.0 * unit)
    page.heading(canvas, top, heading)
    for name, column in zip(("duty", "phase"), columns, strict=True):
        if name == "duty" or phased:
            write(canvas, column, top - 10.0 * unit, name, QUIET, 10.5 * unit, "right")
    if not feet:
        write(canvas, page.left, top + 12.0 * unit, "nothing touches", QUIET, 11.0 * unit)
    for k, (name, part) in enumerate(feet):
        row = top + 18.0 * unit * k
        base = row + 12.5 * unit
        page.name(canvas, base, name)
        paint_rectangle(
            canvas, page.left, row + 3.0 * unit, page.right, row + 15.0 * unit, TRACK, 0.9
        )
        colour = _faded(BAR) if body.parts[part].far else BAR
        for first, end in _runs(touching[:, part]):
            a, b = (page.column(page.start + i * page.step(len(touching))) for i in (first, end))
            paint_rectangle(canvas, a, row + 3.0 * unit, b, row + 15.0 * unit, colour)
        write(canvas, columns[0], base, f"{100.0 * duty[k]:.0f} %", INK, 11.0 * unit, "right")
        if phased:
            text = f"{phase[k]:.2f}" if np.isfinite(phase[k]) else "-"
            write(canvas, columns[1], base, text, INK, 11.0 * unit, "right")


def _runs(down: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and end index of every run of True."""
    edge = np.diff(np.concatenate([[0], np.asarray(down, np.int8), [0]]))
    firsts, ends = np.flatnonzero(edge == 1), np.flatnonzero(edge == -1)
    return list(zip(firsts.tolist(), ends.tolist(), strict=True))


# Curves -------------------------------------------------------------------------------------


def _angle_lanes(rollout: Rollout, body: Body, start: int, stop: int) -> list[_Lane]:
    """A lane for every driven joint, or for both joints of a pair."""
    degrees = np.degrees(np.asarray(rollout.angles[start : stop + 1], np.float64))
    names = list(rollout.joint_names)
    parts = {joint.name: body.parts[joint.child] for joint in body.joints}
    groups: list[list[int]] = []
    partner = {a: b for pair in _pairs(rollout, names) for a, b in (pair, pair[::-1])}
    for i in range(len(names)):
        if not any(i in group for group in groups):
            other = partner.get(i)
            groups.append([i] if other is None else sorted((i, other)))
    tall = 34.0 if len(groups) <= 6 else 26.0 if len(groups) <= 12 else 20.0
    lanes = []
    for k, group in enumerate(groups):
        hue = HUES[k % len(HUES)]
        far = [names[i] in parts and parts[names[i]].far for i in group]
        order = sorted(range(len(group)), key=lambda m: not far[m])  # the near one on top
        curves = tuple(_Curve(degrees[:, group[m]], _faded(hue) if far[m] else hue) for m in order)
        lanes.append(_Lane(_joined([names[i] for i in group]), curves, _range(curves, "°"), tall))
    return lanes


def _pairs(rollout: Rollout, names: list[str]) -> list[tuple[int, int]]:
    """Columns of `angles` that are paired by the file, or hang alike from joints that are."""
    wanted = [list(pair) for pair in rollout.creature.get("pairs", ())]
    found = [(names.index(a), names.index(b)) for a, b in wanted if a in names and b in names]
    paired = {i for pair in found for i in pair}
    legs = {i: leg.joints for leg in rollout.legs for i in leg.joints}
    for a, b in list(found):
        for c, d in zip(legs.get(a, ()), legs.get(b, ()), strict=False):
            if c != d and c not in paired and d not in paired:
                found.append((c, d))
                paired |= {c, d}
    return found


def _torso_lanes(rollout: Rollout, body: Body, start: int, stop: int) -> list[_Lane]:
    pose = np.asarray(rollout.poses[start : stop + 1, rollout.torso], np.float64)
    angle = np.unwrap(pose[:, 2] - body.pose[rollout.torso, 2])
    angle -= 2.0 * np.pi * np.round(angle[0] / (2.0 * np.pi))
    rise = (_Curve(pose[:, 1], INK),)
    turn = (_Curve(np.degrees(angle), INK),)
    return [
        _Lane("height", rise, _range(rise, " m"), 40.0),
        _Lane("angle", turn, _range(turn, "°"), 40.0),
    ]


def _joined(names: list[str]) -> str:
    """Both names of a pair in short: hip a, b."""
    if len(names) == 2:
        first, second = (name.rsplit(" ", 1) for name in names)
        if len(first) == len(second) == 2 and first[0] == second[0]:
            return f"{names[0]}, {second[1]}"
    return ", ".join(names)


def _range(curves: Sequence[_Curve], unit: str) -> str:
    low = min(float(curve.values.min()) for curve in curves)
    high = max(float(curve.values.max()) for curve in curves)
    digits = 2 if "m" in unit else 0
    # The typeface has no minus sign. Adding 0 makes -0 a 0.
    return f"{round(low, digits) + 0.0:.{digits}f} … {round(high, digits) + 0.0:.{digits}f}{unit}"


def _faded(colour: Rgb) -> Rgb:
    r, g, b = mix(colour, PAPER, FADED).round().astype(int).tolist()
    return r, g, b


# The page -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Page:
    """Where things are on the picture, in pixels, and when, in seconds."""

    unit: float
    width: int
    start: float
    stop: float

    @property
    def left(self) -> float:
        return 128.0 * self.unit

    @property
    def right(self) -> float:
        return self.width - 124.0 * self.unit

    def column(self, seconds: float) -> float:
        part = (seconds - self.start) / (self.stop - self.start)
        return self.left + part * (self.right - self.left)

    def step(self, count: int) -> float:
        """Seconds of one of `count` equal steps."""
        return (self.stop - self.start) / count

    def heading(self, canvas: Picture, top: float, text: str) -> None:
        write(canvas, self.left, top - 10.0 * self.unit, text, QUIET, 10.5 * self.unit)

    def name(self, canvas: Picture, base: float, text: str) -> None:
        """The name of a row, cut to the room that it has."""
        size, room = 11.0 * self.unit, self.left - 24.0 * self.unit
        whole = text
        while text and length(text if text == whole else text + "…", size) > room:
            text = text[:-1]
        text = text if text == whole else text + "…"
        write(canvas, self.left - 12.0 * self.unit, base, text, INK, size, "right")

    def grid(self, canvas: Picture, top: float, bottom: float) -> None:
        """Upright lines at round times, and the axis below."""
        every = nice((self.stop - self.start) * 60.0 * self.unit / (self.right - self.left))
        unit, half = self.unit, 0.5 * self.unit
        first = np.ceil(self.start / every - 1e-6)
        for k in np.arange(first, np.floor(self.stop / every + 1e-6) + 1.0):
            x = self.column(k * every)
            paint_rectangle(canvas, x - half, top, x + half, bottom + 6.0 * unit, GRID)
            text = f"{round(float(k) * every, 6) + 0.0:g}"
            write(canvas, x, bottom + 20.0 * unit, text, QUIET, 10.5 * unit, "middle")
        paint_rectangle(canvas, self.left, bottom, self.right, bottom + unit, (190, 188, 184))
        write(canvas, self.right + 12.0 * unit, bottom + 20.0 * unit, "s", QUIET, 10.5 * unit)

    def lanes(self, canvas: Picture, top: float, heading: str, lanes: Sequence[_Lane]) -> None:
        if not lanes:
            return
        unit = self.unit
        self.heading(canvas, top, heading)
        for lane in lanes:
            tall = lane.tall * unit
            base = top + 0.5 * tall + 4.0 * unit
            self.name(canvas, base, lane.name)
            write(canvas, self.right + 12.0 * unit, base, lane.note, QUIET, 10.5 * unit)
            self._curves(canvas, lane, top, tall)
            top += tall

    def _curves(self, canvas: Picture, lane: _Lane, top: float, tall: float) -> None:
        """The curves of one lane, between its lowest and its highest value."""
        low = min(float(curve.values.min()) for curve in lane.curves)
        high = max(float(curve.values.max()) for curve in lane.curves)
        inner = 0.14 * tall
        scale = (tall - 2.0 * inner) / max(high - low, 1e-9) if high - low > 1e-6 else 0.0
        middle = 0.5 * (low + high)

        def row(value: Array | float) -> Array:
            return np.asarray(0.5 * tall - (np.asarray(value) - middle) * scale)

        if low < 0.0 < high:
            y = top + float(row(0.0))
            paint_rectangle(canvas, self.left, y - 0.5, self.right, y + 0.5, GRID)
        a, b = int(self.left) - 2, int(self.right) + 3
        c, d = int(top), int(np.ceil(top + tall))
        image = Image.fromarray(np.ascontiguousarray(canvas[c:d, a:b]))
        image = image.resize((FINE * (b - a), FINE * (d - c)), Image.Resampling.NEAREST)
        draw = ImageDraw.Draw(image)
        line = max(round(1.35 * self.unit * FINE), 1)
        for curve in lane.curves:
            x = np.linspace(self.left - a, self.right - a, len(curve.values))
            y = row(curve.values) + (top - c)
            points = (FINE * np.stack([x, y], -1)).round().astype(int)
            draw.line(list(map(tuple, points.tolist())), curve.colour, line, "curve")
        canvas[c:d, a:b] = np.asarray(image.reduce(FINE))
