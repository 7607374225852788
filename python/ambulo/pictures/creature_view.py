"""Where creatures are drawn: the window on their flat world, its ground and marks, and letters.

A canvas is bytes (H, W, 3) and is changed in place; only the patch that something covers is ever
computed. x runs to the right and y up, in metres; pictures have rows that run down.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw

from ambulo.pictures.creature_body import Array
from ambulo.pictures.stage import ACCENT, INK, QUIET, Picture, font

Tone = NDArray[np.float32]
"""(3,) a colour, 0 to 255."""
Rgb = tuple[int, int, int]

SKY = (247, 245, 240)  # one colour: in a GIF the slightest change of it would show as bands
SOIL = ((214, 207, 195), (233, 228, 219))  # surface, 90 pixels of a 360 pixel picture below
SURFACE = (150, 142, 130)
MARK = (134, 127, 117)


@dataclass(frozen=True)
class View:
    """A level window on the world."""

    size: tuple[int, int]
    """Width, height in pixels."""
    scale: float
    """Pixels a metre."""
    left: float
    """x at the left edge, metres."""
    top: float
    """y at the top edge, metres."""
    unit: float
    """Pixels of letters, lines and marks to one in a picture 360 pixels high."""

    def project(self, points: ArrayLike) -> Array:
        """Column, row (..., 2) in pixels, of the picture's corner, of points x, y (..., 2)."""
        points = np.asarray(points, np.float64)
        flip = self.scale * np.array([1.0, -1.0])
        return (points[..., :2] - (self.left, self.top)) * flip

    @property
    def span(self) -> tuple[float, float]:
        """X of the left and the right edge, metres."""
        return self.left, self.left + self.size[0] / self.scale

    def moved(self, left: int, top: int, size: tuple[int, int]) -> View:
        """The part of it that begins at column `left` and row `top`."""
        x, y = self.left + left / self.scale, self.top - top / self.scale
        return View(size, self.scale, x, y, self.unit)


def unit_of(size: tuple[int, int]) -> float:
    """`View.unit` of a picture of `size`."""
    return max(min(size[1], 0.75 * size[0]) / 360.0, 0.4)


def tone(colour: ArrayLike) -> Tone:
    """A colour 0 to 255 to calculate with."""
    return np.asarray(colour, np.float32)


def mix(a: ArrayLike, b: ArrayLike, part: float) -> Tone:
    """`a` with `part` (0..1) of `b` in it."""
    return tone(tone(a) * (1.0 - part) + tone(b) * part)


# Ground -------------------------------------------------------------------------------------


def check_ground(ground: ArrayLike) -> Array:
    """(N, 2) or ValueError."""
    ground = np.asarray(ground, np.float64)
    if ground.ndim != 2 or ground.shape[1] != 2 or not len(ground):
        raise ValueError(f"ground must have shape (N, 2), N > 0, not {ground.shape}")
    if not np.isfinite(ground).all() or (np.diff(ground[:, 0]) < 0.0).any():
        raise ValueError("ground must run from left to right and be finite")
    return ground


def height(ground: Array, x: ArrayLike) -> Array:
    """Metres, of the outline `ground` (N, 2) at `x`; level beyond its ends."""
    return np.interp(np.asarray(x, np.float64), ground[:, 0], ground[:, 1])


@lru_cache(maxsize=16)
def _soil(rows: int, unit: float) -> Tone:
    """(rows, 3) colours by depth below the surface, in pixels."""
    part = np.minimum(np.arange(rows, dtype=np.float32) / np.float32(90.0 * unit), 1.0) ** 0.7
    return tone(tone(SOIL[0]) + part[:, None] * (tone(SOIL[1]) - tone(SOIL[0])))


def paint_world(view: View, ground: Array) -> Picture:
    """A new canvas of `view` with sky and ground."""
    width, rows = view.size
    canvas = np.empty((rows, width, 3), np.uint8)
    canvas[:] = SKY
    # Four columns a pixel, so that slopes and steps have soft edges.
    x = view.left + (np.arange(4 * width) + 0.5) / (4.0 * view.scale)
    fine = (view.top - height(ground, x)) * view.scale
    level = fine.reshape(width, 4).mean(1)
    soil, unit = _soil(rows + 2, view.unit), view.unit
    first = int(np.clip(np.floor(fine.min() - 1.0), 0, rows))
    last = int(np.clip(np.ceil(fine.max() + 1.0), first, rows))
    if last < rows:
        depth = np.arange(last, rows)[:, None] - level
        if np.ptp(level) < 1e-6:
            shades = soil[np.clip(depth[:, 0], 0, rows).astype(np.int64)][:, None]
        else:
            shades = soil[np.clip(depth, 0, rows).astype(np.int64)]
        canvas[last:] = (shades + 0.5).astype(np.uint8)
    if first < last:
        row = np.arange(first, last)[:, None] + 0.5
        cover = np.clip(row + 0.5 - fine, 0.0, 1.0).reshape(len(row), width, 4).mean(-1)
        depth = np.clip(row - level, 0, rows).astype(np.int64)
        lay(canvas[first:last], cover, soil[depth])
    _paint_edge(canvas, view, fine, 1.3 * unit)
    return canvas


def _paint_edge(canvas: Picture, view: View, fine: Array, width: float) -> None:
    """The line of the surface, whose row is `fine` at four columns a pixel."""
    first = int(np.clip(np.floor(fine.min() - 1.0), 0, view.size[1]))
    last = int(np.clip(np.ceil(fine.max() + width + 1.0), first, view.size[1]))
    if first == last:
        return
    row = np.arange(first, last)[:, None]
    inside = np.minimum(row + 1.0, fine + width) - np.maximum(row, fine)
    cover = np.clip(inside, 0.0, 1.0).reshape(len(row), view.size[0], 4).mean(-1)
    lay(canvas[first:last], 0.55 * cover, tone(SURFACE))


def lay(patch: Picture, cover: Array, colour: Tone) -> None:
    """Lays `colour` (3,) or (h, w, 3) over `patch` (h, w, 3) with `cover` (h, w) of 0..1."""
    under = patch.astype(np.float32)
    under += cover.astype(np.float32)[..., None] * (colour - under)
    patch[:] = (under + 0.5).astype(np.uint8)


def paint_rectangle(
    canvas: Picture, left: float, top: float, right: float, bottom: float, colour: ArrayLike,
    alpha: float = 1.0,
) -> None:  # fmt: skip
    """An upright rectangle in pixels, with soft edges where it ends between pixels."""
    rows, columns, _ = canvas.shape
    a, b = max(int(np.floor(left)), 0), min(int(np.ceil(right)), columns)
    c, d = max(int(np.floor(top)), 0), min(int(np.ceil(bottom)), rows)
    if a >= b or c >= d:
        return
    i, j = np.arange(a, b), np.arange(c, d)[:, None]
    across = np.clip(np.minimum(i + 1, right) - np.maximum(i, left), 0.0, 1.0)
    down = np.clip(np.minimum(j + 1, bottom) - np.maximum(j, top), 0.0, 1.0)
    lay(canvas[c:d, a:b], alpha * across * down, tone(colour))


def paint_marks(canvas: Picture, view: View, ground: Array) -> None:
    """A tick a metre along the ground, numbered where there is room, and less in a closer view."""
    unit, (left, right) = view.unit, view.span
    every = nice(46.0 * unit / view.scale)  # metres from number to number
    if right - left > 2.5:
        every = max(every, 1.0)
    finer = [every / parts for parts in (10, 5, 2) if view.scale * every / parts > 20.0 * unit]
    step = finer[0] if finer else every
    x = np.arange(np.floor(left / step), np.ceil(right / step) + 1.0) * step
    places = view.project(np.stack([x, height(ground, x)], -1))
    for at, (column, row) in zip(x.tolist(), places.tolist(), strict=True):
        numbered = abs(at / every - round(at / every)) < 1e-6
        long, strength = (6.5 * unit, 0.85) if numbered else (3.5 * unit, 0.5)
        half = 0.6 * unit
        paint_rectangle(canvas, column - half, row, column + half, row + long, MARK, strength)
        if numbered:
            text = f"{round(at, 3) + 0.0:g} m"
            write(canvas, column, row + 17.5 * unit, text, MARK, 9.5 * unit, "gliding")


def paint_start(canvas: Picture, view: View, ground: Array, *, ceiling: float = 0.0) -> None:
    """The starting line at x = 0: dashes that rise from the ground, to row `ceiling`, and fade."""
    unit, (left, right) = view.unit, view.span
    if not left - 1.0 < 0.0 < right + 1.0:
        return
    column, row = view.project((0.0, float(height(ground, 0.0)))).tolist()
    dash, gap = 7.0 * unit, 5.0 * unit
    count = int(min(12.0, (row - ceiling + gap) / (dash + gap)))
    colour, half = 255.0 * ACCENT, 0.7 * unit
    for k in range(count):
        low = row - k * (dash + gap)
        fade = 0.8 * (1.0 - k / count)
        paint_rectangle(canvas, column - half, low - dash, column + half, low, colour, fade)


def nice(at_least: float) -> float:
    """The smallest of 1, 2, 5 times a power of ten that is no smaller."""
    power = 10.0 ** np.floor(np.log10(max(at_least, 1e-9)))
    for step in (1.0, 2.0, 5.0, 10.0):
        if step * power >= at_least * (1.0 - 1e-9):
            return float(step * power)
    raise AssertionError


# Text ---------------------------------------------------------------------------------------


SHARP = 4  # letters are set this many times larger, so that their spaces are not rounded


@lru_cache(maxsize=512)
def _letters(text: str, size: float) -> tuple[Array, int, int]:
    """Coverage 0..1 of `text`, and its corner's columns and rows from the start of its line."""
    face = font(SHARP * size)
    left, top, right, bottom = (edge / SHARP for edge in face.getbbox(text, anchor="ls"))
    corner = int(np.floor(left)) - 1, int(np.floor(top)) - 1
    width, rows = int(np.ceil(right)) - corner[0] + 2, int(np.ceil(bottom)) - corner[1] + 2
    image = Image.new("L", (SHARP * width, SHARP * rows), 0)
    place = (-SHARP * corner[0], -SHARP * corner[1])
    ImageDraw.Draw(image).text(place, text, 255, face, "ls")
    cover = np.asarray(image.reduce(SHARP), np.float64) / 255.0
    return cover**0.85, *corner  # thin strokes would look paler than they are


def length(text: str, size: float) -> float:
    """Pixels from the start to the end of `text`."""
    return float(font(SHARP * size).getlength(text)) / SHARP


def write(
    canvas: Picture, column: float, row: float, text: str, colour: Rgb, size: float,
    align: str = "left",
) -> None:  # fmt: skip
    """`text` whose line stands on `row`; `align`: left, middle or right of `column`.

    "gliding" is the middle to a fraction of a pixel, for what moves with the ground.
    """
    if not text:
        return
    part = {"left": 0.0, "middle": 0.5, "gliding": 0.5, "right": 1.0}[align]
    column -= part * length(text, size)
    if align != "gliding":
        column = round(column)
    mask, dx, dy = _letters(text, round(size, 2))
    whole = int(np.floor(column))
    part = column - whole
    if part:
        mask = mask * (1.0 - part) + np.pad(mask, ((0, 0), (1, 0)))[:, :-1] * part
    top, left = round(row) + dy, whole + dx
    rows, columns, _ = canvas.shape
    a, b = max(left, 0), min(left + mask.shape[1], columns)
    c, d = max(top, 0), min(top + mask.shape[0], rows)
    if a < b and c < d:
        lay(canvas[c:d, a:b], mask[c - top : d - top, a - left : b - left], tone(colour))


def headline(canvas: Picture, unit: float, title: str, line: str) -> None:
    """A title with the accent beside it and a quiet line under it, at the upper left."""
    left, top = 20.0 * unit, 18.0 * unit
    tall = (39.0 if line else 19.0) * unit
    paint_rectangle(canvas, left, top, left + 2.5 * unit, top + tall, 255.0 * ACCENT)
    write(canvas, left + 11.0 * unit, top + 15.5 * unit, title, INK, 18.0 * unit)
    write(canvas, left + 11.0 * unit, top + 36.5 * unit, line, QUIET, 12.0 * unit)


def fields(canvas: Picture, unit: float, title: str, values: Sequence[tuple[str, str]]) -> None:
    """A title with the accent beside it and labelled values under it, at the upper left."""
    left, top = 20.0 * unit, 18.0 * unit
    paint_rectangle(canvas, left, top, left + 2.5 * unit, top + 56.0 * unit, 255.0 * ACCENT)
    left += 11.0 * unit
    write(canvas, left, top + 15.5 * unit, title, INK, 18.0 * unit)
    for name, text in values:
        write(canvas, left, top + 37.0 * unit, name, QUIET, 10.5 * unit)
        write(canvas, left, top + 55.0 * unit, text, INK, 15.0 * unit)
        # Columns keep their place while the numbers in them change.
        left += max(length("00.0 m/s", 15.0 * unit), length(text, 15.0 * unit)) + 12.0 * unit
