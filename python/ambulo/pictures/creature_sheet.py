"""Single pictures of many poses: the strobe of an episode, and a whole population at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from PIL import Image

from ambulo.files import replacing
from ambulo.pictures.creature_body import Array, Body, poses_at, read_body
from ambulo.pictures.creature_paint import paint_body, paint_shadow
from ambulo.pictures.creature_view import (
    View,
    check_ground,
    headline,
    height,
    paint_marks,
    paint_start,
    paint_world,
    unit_of,
    write,
)
from ambulo.pictures.stage import ACCENT, PAPER, QUIET, Picture, colour
from ambulo.rollout import Rollout

SMALLEST = 26.0  # pixels: no creature in a population is drawn lower than this
CROWD = (1240, 320)  # pixels: the picture of a population, at most
COLUMNS = 8  # cells in a row, unless told
OVERLAP = 0.30  # of the creature's width: poses closer than this are drawn in cells


def check_size(size: tuple[int, int]) -> None:
    """ValueError unless `size` is a width and height that can be drawn."""
    if len(size) != 2 or min(size) < 32 or max(size) > 8192:
        raise ValueError(f"size must be (width, height), each 32 to 8192 pixels, not {size}")


def check_rollout(rollout: Rollout, body: Body) -> None:
    """ValueError unless the poses are those of the rollout's own creature."""
    wanted = (rollout.steps + 1, len(body.parts), 3)
    if np.shape(rollout.poses) != wanted:
        raise ValueError(
            f"poses of {rollout.steps} steps of {body.name!r} must have shape {wanted}, "
            f"not {np.shape(rollout.poses)}"
        )
    if not np.isfinite(rollout.poses).all():
        raise ValueError("poses must be finite")
    if not rollout.dt > 0.0:
        raise ValueError(f"a step must last longer than 0 s, not {rollout.dt}")


def check_window(rollout: Rollout, start: int, stop: int | None) -> int:
    """The step that the window ends with; ValueError where it is not inside the episode."""
    stop = rollout.steps if stop is None else stop
    if not 0 <= start < stop <= rollout.steps:
        raise ValueError(
            f"steps {start} to {stop} are asked for; the episode has steps 0 to {rollout.steps}, "
            "and a window must end after it starts"
        )
    return stop


# The strobe ---------------------------------------------------------------------------------


def write_creature_strip(
    path: str | Path,
    rollout: Rollout,
    *,
    poses: int = 8,
    start: int = 0,
    stop: int | None = None,
    columns: int | None = None,
    title: str = "",
    width: int = 1240,
) -> Path:
    """Writes one PNG with `poses` poses, evenly spaced from step `start` to step `stop`.

    They stand in their places along the ground, the later the more opaque. Where they would hide
    each other, or would become too small, they get cells instead, `columns` in a row; a number
    there asks for cells. `stop`: the last step if None; `width` in pixels; `title`: the
    creature's name if empty. A file appears only when it is whole. Raises ValueError for
    arguments that cannot be drawn.
    """
    path = Path(path)
    if poses < 1:
        raise ValueError(f"poses must be at least 1, not {poses}")
    if columns is not None and columns < 1:
        raise ValueError(f"columns must be at least 1, not {columns}")
    check_size((width, width))
    body = read_body(rollout.creature)
    check_rollout(rollout, body)
    stop = check_window(rollout, start, stop)
    ground = check_ground(rollout.ground)
    rows = np.linspace(start, stop, poses) if poses > 1 else np.array([float(start)])
    shown = poses_at(rollout.poses, rows)
    x = shown[:, rollout.torso, 0]
    seconds = (rows - start) * rollout.dt
    whole = (stop - start) * rollout.dt
    ends = np.asarray(rollout.poses[[start, stop], rollout.torso, 0], np.float64)
    pace = (ends[1] - ends[0]) / whole
    line = f"{poses} poses in {whole:.2f} s  ·  {pace:.2f} m/s".replace("-0.00", "0.00")
    words = (title or body.name, line)
    view = _alongside(body, shown, x, ground, width) if columns is None else None
    if view is not None:
        sheet = _strobe(view, body, shown, x, seconds, ground, words)
    else:
        columns = columns or min(poses, COLUMNS)
        sheet = _cells(body, shown, x, seconds, ground, words, columns, width)
    with replacing(path) as part:
        Image.fromarray(sheet).save(part, "PNG", optimize=True)
    return path


def _alongside(body: Body, shown: Array, x: Array, ground: Array, width: int) -> View | None:
    """The view of all poses in place, or None if they would overlap or be too small."""
    low, high = body.bounds(shown)
    across, unit = float(np.median(high[:, 0] - low[:, 0])), width / 1240.0
    steps = np.abs(np.diff(x))
    if len(steps) and float(steps.min()) < OVERLAP * across:
        return None
    left, right = float(low[:, 0].min()), float(high[:, 0].max())
    floor = height(ground, np.linspace(left, right, 200))
    bottom, top = min(float(floor.min()), float(low[:, 1].min())), float(high[:, 1].max())
    scale = min((width - 72.0 * unit) / (right - left), 300.0 * unit / (top - bottom))
    if scale * float(np.median(high[:, 1] - low[:, 1])) < 34.0 * unit:
        return None
    above, below = 86.0 * unit, 62.0 * unit
    size = (width, round(above + (top - bottom) * scale + below))
    return View(size, scale, 0.5 * (left + right) - 0.5 * width / scale, top + above / scale, unit)


def _strobe(
    view: View, body: Body, shown: Array, x: Array, seconds: Array, ground: Array,
    words: tuple[str, str],
) -> Picture:  # fmt: skip
    """All poses in place, the first the faintest."""
    unit = view.unit
    canvas = paint_world(view, ground)
    paint_marks(canvas, view, ground)
    paint_start(canvas, view, ground, ceiling=66.0 * unit)
    for pose in shown:
        paint_shadow(canvas, view, body, pose, ground)
    strength = np.linspace(0.25, 1.0, len(shown)) if len(shown) > 1 else np.ones(1)
    floor = view.project(np.stack([x, height(ground, x)], -1))[:, 1].max()
    for pose, at, time, alpha in zip(shown, x, seconds, strength, strict=True):
        paint_body(canvas, view, body, pose, alpha=float(alpha))
        column = float(view.project((at, 0.0))[0])
        row = min(floor + 40.0 * unit, view.size[1] - 10.0 * unit)
        write(canvas, column, row, f"{time:.2f} s", QUIET, 11.0 * unit, "middle")
    headline(canvas, unit, *words)
    return canvas


def _cells(
    body: Body, shown: Array, x: Array, seconds: Array, ground: Array, words: tuple[str, str],
    columns: int, width: int,
) -> Picture:  # fmt: skip
    """A cell a pose, the torso in the middle of each."""
    unit = width / 1240.0
    margin, gap, head = round(20 * unit), max(round(6 * unit), 1), round(76 * unit)
    across = (width - 2 * margin - (columns - 1) * gap) // columns
    low, high = body.bounds(shown)
    floor = height(ground, x)
    reach = float(np.maximum(x - low[:, 0], high[:, 0] - x).max())
    tall = float((high[:, 1] - floor).max())
    scale = min(0.44 * across / reach, 260.0 * unit / tall)
    deep = 50.0 * unit
    size = (max(across, 8), round(tall * scale + deep + 34.0 * unit))
    count = -(-len(shown) // columns)
    sheet = np.empty((head + count * (size[1] + gap) - gap + margin, width, 3), np.uint8)
    sheet[:] = PAPER
    for k, (pose, at, time) in enumerate(zip(shown, x, seconds, strict=True)):
        base = float(floor[k]) + (size[1] - deep) / scale
        view = View(size, scale, float(at) - 0.5 * size[0] / scale, base, 0.85 * unit)
        cell = paint_world(view, ground)
        paint_marks(cell, view, ground)
        paint_start(cell, view, ground)
        paint_shadow(cell, view, body, pose, ground)
        paint_body(cell, view, body, pose)
        row = size[1] - 12.0 * unit
        write(cell, 0.5 * size[0], row, f"{time:.2f} s", QUIET, 11.0 * unit, "middle")
        top = head + (k // columns) * (size[1] + gap)
        left = margin + (k % columns) * (size[0] + gap)
        sheet[top : top + size[1], left : left + size[0]] = cell
    headline(sheet, unit, *words)
    return sheet


# A population -------------------------------------------------------------------------------


def write_training_picture(
    path: str | Path,
    creature: Mapping[str, Any] | Sequence[Mapping[str, Any]],
    poses: ArrayLike,
    fitness: ArrayLike,
    ground: ArrayLike,
    title: str = "",
    *,
    size: tuple[int, int] | None = None,
) -> Path:
    """Writes one PNG of a whole population, half transparent, with the best one highlighted.

    `creature`: what all are, or N with parts of the same names whose measures differ.
    `poses` (N, P, 3): x, y in metres and angle of every part of each of N creatures; `fitness`
    (N,), higher is better; `ground` (N, 2): its outline from left to right in metres; `size` in
    pixels, if None 1240 wide and as high as is needed. All are in view unless they would become
    too small to see; then the best is, and the number of those outside is told. A file appears
    only when it is whole. Raises ValueError for arrays that do not fit together.
    """
    path = Path(path)
    check_size(size or CROWD)
    one = isinstance(creature, Mapping)
    bodies = [read_body(file) for file in ([creature] if one else creature)]
    body, ground = bodies[0], check_ground(ground)
    poses, fitness = np.asarray(poses, np.float64), np.asarray(fitness, np.float64)
    if poses.ndim != 3 or not len(poses) or poses.shape[1:] != (len(body.parts), 3):
        raise ValueError(
            f"poses must have shape (N, {len(body.parts)}, 3), N > 0, not {poses.shape}"
        )
    if not np.isfinite(poses).all():
        lost = int(np.flatnonzero(~np.isfinite(poses).all((1, 2)))[0])
        raise ValueError(f"poses must be finite; those of creature {lost} are not")
    if fitness.shape != (len(poses),):
        raise ValueError(
            f"fitness must have one number a creature ({len(poses)}), not shape {fitness.shape}"
        )
    bodies = bodies * len(poses) if one else bodies
    if len(bodies) != len(poses):
        raise ValueError(f"{len(bodies)} creatures, but poses of {len(poses)}")
    worst_first = np.argsort(np.where(np.isnan(fitness), -np.inf, fitness), kind="stable")
    best = int(worst_first[-1])
    body = bodies[best]
    view, outside = _crowd(body, poses, best, ground, size or CROWD)
    view = view if size else _cropped(view, body, poses)
    canvas = paint_world(view, ground)
    paint_marks(canvas, view, ground)
    paint_shadow(canvas, view, body, poses[best], ground)
    alpha = float(np.clip(1.6 / np.sqrt(len(poses)), 0.10, 0.45))
    for i in worst_first[:-1]:
        paint_body(canvas, view, bodies[i], poses[i], alpha=alpha, accent=False, dots=False)
    paint_start(canvas, view, ground, ceiling=64.0 * view.unit)
    paint_body(canvas, view, body, poses[best])
    _crown(canvas, view, body, poses[best])
    facts = [f"{len(poses)} creature{'s' * (len(poses) > 1)}", f"best {fitness[best]:.3g}"]
    if np.isfinite(fitness).all() and len(poses) > 2:
        facts.append(f"median {np.median(fitness):.3g}")
    if outside:
        facts.append(f"{outside} out of view")
    headline(canvas, view.unit, title or body.name, "  ·  ".join(facts))
    with replacing(path) as part:
        Image.fromarray(canvas).save(part, "PNG", optimize=True)
    return path


def _cropped(view: View, body: Body, poses: Array) -> View:
    """`view` without the sky that neither words nor creatures are in."""
    top = float(body.bounds(poses)[1][:, 1].max())
    spare = max(int(float(view.project((0.0, top))[1]) - round(92.0 * view.unit)), 0)
    return view.moved(0, spare, (view.size[0], view.size[1] - spare))


def _crown(canvas: Picture, view: View, body: Body, pose: Array) -> None:
    """A word over the best one."""
    low, high = body.bounds(pose)
    column, row = view.project((0.5 * (low[0] + high[0]), high[1])).tolist()
    size = 11.0 * view.unit
    write(canvas, column, row - 9.0 * view.unit, "best", colour(ACCENT), size, "middle")


def _crowd(
    body: Body, poses: Array, best: int, ground: Array, size: tuple[int, int]
) -> tuple[View, int]:
    """The view of a population, and how many of it are not in it."""
    width, tall = size
    low, high = body.bounds(poses)
    start_low, start_high = body.bounds(body.pose)
    stature = float(start_high[1] - start_low[1])
    left, right = min(float(low[:, 0].min()), 0.0), max(float(high[:, 0].max()), 0.0)
    base = height(ground, np.linspace(left, right, 200))
    top = float(np.quantile(high[:, 1], 0.98))
    top = max(top, float(high[best, 1]), float(base.max()) + stature)
    bottom = float(base.min())
    unit = unit_of(size)
    room = tall - 122.0 * unit
    scale = min((width - 60.0 * unit) / (right - left), room / max(top - bottom, 1e-3))
    scale = min(scale, 0.36 * tall / stature)
    scale = max(scale, SMALLEST * unit / stature)
    span = width / scale
    centre = 0.5 * (left + right)
    if span < right - left:  # too many metres: the best and what is near it
        edge = 30.0 * unit / scale
        at = float(np.clip(poses[best, body.torso, 0], left + edge, right - edge))
        centre = float(np.clip(at, left + 0.5 * span - edge, right - 0.5 * span + edge))
    high_edge = bottom + (tall - 44.0 * unit) / scale
    view = View(size, float(scale), centre - 0.5 * span, high_edge, unit)
    a, b = view.span
    outside = int(((high[:, 0] < a) | (low[:, 0] > b) | (low[:, 1] > view.top)).sum())
    return view, outside
