"""Pictures and films of flat creatures: the body, an episode, a whole population.

Everything is drawn from plain arrays: a creature file as a dictionary and poses (x, y in metres,
angle in radians) of its parts. x runs to the right and y up; pictures are bytes (H, W, 3).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ambulo.pictures.creature_body import Array, Body, Joint, poses_at, read_body
from ambulo.pictures.creature_paint import (
    LINE,
    box_of,
    paint_body,
    paint_dot,
    paint_shadow,
    paint_trail,
)
from ambulo.pictures.creature_sheet import (
    check_rollout,
    check_size,
    check_window,
    write_creature_strip,
    write_training_picture,
)
from ambulo.pictures.creature_view import (
    View,
    check_ground,
    fields,
    height,
    length,
    nice,
    paint_marks,
    paint_rectangle,
    paint_start,
    paint_world,
    tone,
    unit_of,
    write,
)
from ambulo.pictures.encode import write_pictures
from ambulo.pictures.stage import ACCENT, INK, QUIET, Picture, smooth
from ambulo.rollout import Rollout

__all__ = [
    "draw_creature",
    "write_creature_film",
    "write_creature_strip",
    "write_training_picture",
]

GROUND = 0.80  # of the picture's height: where the ground is while nobody jumps
SMALLEST = 0.4  # of its usual size: how small a creature may be drawn for the sake of a jump
TRAIL = 3.0  # seconds of path behind the torso
BEAT = 0.1  # seconds from dot to dot of the path
FLAT = np.array([[-1.0, 0.0], [1.0, 0.0]])


# The body -----------------------------------------------------------------------------------


def draw_creature(creature: Mapping[str, Any], *, size: tuple[int, int] = (640, 400)) -> Picture:
    """The creature file's start pose on level ground, (H, W, 3), for `size` (W, H) in pixels.

    The torso has the accent's colour, feet are blue, the far leg of a pair is dim and drawn a
    little aside, where the near one does not hide it. A dot is a
    joint, a ring around it a motor, and a faint fan how far the joint may turn. A bar gives the
    scale. Raises ValueError for a size out of range and for a creature that cannot be read.
    """
    check_size(size)
    body = read_body(creature).standing()
    view = _portrait(size, *body.bounds(body.pose))
    canvas = paint_world(view, FLAT)
    pose = _aside(body)
    paint_shadow(canvas, view, body, pose, FLAT)
    layer = canvas.astype(np.float32)
    for joint in body.joints:
        _paint_range(layer, view, body, joint)
    canvas[:] = (layer + 0.5).astype(np.uint8)
    paint_body(canvas, view, body, pose, dots=False)
    layer = canvas.astype(np.float32)
    for joint in body.joints:
        if not body.parts[joint.child].far:  # hidden, as the leg itself would be
            _paint_joint(layer, view, body, joint)
    canvas[:] = (layer + 0.5).astype(np.uint8)
    _label(canvas, view, body)
    return canvas


def _portrait(size: tuple[int, int], low: Array, high: Array) -> View:
    """The view that shows all between `low` and `high`, and the ground, with room for words."""
    width, rows = size
    scale = min(0.56 * rows / high[1], 0.72 * width / (high[0] - low[0]))
    left = 0.5 * (low[0] + high[0]) - 0.5 * width / scale
    return View(size, float(scale), float(left), float(0.77 * rows / scale), unit_of(size))


def _label(canvas: Picture, view: View, body: Body) -> None:
    """Name, a quiet line of numbers, and the scale bar."""
    width, rows = view.size
    unit = view.unit
    driven = sum(joint.torque > 0.0 for joint in body.joints)
    facts = [
        f"{len(body.parts)} part{'s' * (len(body.parts) != 1)}",
        f"{len(body.joints)} joint{'s' * (len(body.joints) != 1)}",
        f"{driven} motor{'s' * (driven != 1)}",
        f"{body.mass:.3g} kg",
    ]
    left, base = 20.0 * unit, rows - 18.0 * unit
    paint_rectangle(canvas, left, base - 41.0 * unit, left + 2.5 * unit, base, 255.0 * ACCENT)
    write(canvas, left + 11.0 * unit, base - 24.0 * unit, body.name, INK, 18.0 * unit)
    write(canvas, left + 11.0 * unit, base - 1.5 * unit, "  ·  ".join(facts), QUIET, 12.0 * unit)
    metres = nice(0.4 * 90.0 * unit / view.scale)
    right, bar = width - 20.0 * unit, metres * view.scale
    for x in (right - bar, right):
        paint_rectangle(canvas, x - 0.6 * unit, base - 5.0 * unit, x + 0.6 * unit, base, QUIET)
    paint_rectangle(canvas, right - bar, base - 1.2 * unit, right, base, QUIET)
    middle = right - 0.5 * bar
    text = f"{metres:g} m" if metres >= 0.1 else f"{100.0 * metres:g} cm"
    middle = min(middle, right - 0.5 * length(text, 11.0 * unit))
    write(canvas, middle, base - 9.0 * unit, text, QUIET, 11.0 * unit, "middle")


def _aside(body: Body) -> Array:
    """The start pose (P, 3) with far legs a little aside, or the near ones would hide them."""
    pose = body.pose.copy()
    for i, part in enumerate(body.parts):
        if part.far:
            pose[i, 0] += 0.8 * part.thickness
    return pose


def _paint_range(layer: NDArray[np.float32], view: View, body: Body, joint: Joint) -> None:
    """A faint fan over the angles that the joint's child may take."""
    child, (x, y, angle) = body.parts[joint.child], body.pose[joint.child]
    if joint.limits is None or child.far:
        return
    low, high = joint.limits
    half = 0.5 * (high - low)
    arm = np.array([x, y]) - joint.place
    reach = float(np.hypot(*arm))
    rest = float(np.arctan2(arm[1], arm[0])) if reach > 1e-3 else float(angle) - 0.5 * np.pi
    # As far as the child's middle, or as far as the fan must be to look out behind a thick one.
    aside = float(np.sin(np.clip(max(abs(low), abs(high)), 0.2, 0.5 * np.pi)))
    away = max(1.15 * reach, min(1.6 * child.thickness / aside, 2.2 * reach), child.thickness)
    radius = away * view.scale
    box = box_of(view, joint.place - away, joint.place + away, 2.0)
    if box is None:
        return
    a, b, c, d = box
    column, row = view.project(joint.place).tolist()
    dx = np.arange(a, b) + 0.5 - column
    dy = row - (np.arange(c, d)[:, None] + 0.5)
    far = np.sqrt(dx * dx + dy * dy)
    off = np.arctan2(dy, dx) - (rest + 0.5 * (low + high))
    off = np.abs(np.remainder(off + np.pi, 2.0 * np.pi) - np.pi)
    within = np.clip((half - off) * far + 0.5, 0.0, 1.0)  # pixels inside the fan's sides
    disc = np.clip(radius + 0.5 - far, 0.0, 1.0)
    rim = np.clip(0.6 * view.unit + 0.5 - np.abs(far - radius), 0.0, 1.0)
    cover = within * np.maximum(0.12 * disc, 0.6 * rim)
    under = layer[c:d, a:b]
    under += cover.astype(np.float32)[..., None] * (tone(255.0 * ACCENT) - under)


def _paint_joint(layer: NDArray[np.float32], view: View, body: Body, joint: Joint) -> None:
    """A dot, and a ring around it where a motor is."""
    child, parent, unit = body.parts[joint.child], body.parts[joint.parent], view.unit
    thick = min(child.thickness, parent.thickness) * view.scale
    radius = float(np.clip(0.26 * thick, 1.3 * unit, 2.4 * unit))
    paint_dot(layer, view, joint.place, radius, LINE)
    if joint.torque > 0.0:
        ring = float(np.clip(0.62 * thick, radius + 2.0 * unit, 6.0 * unit))
        paint_dot(layer, view, joint.place, ring, LINE, 0.9, ring=1.1 * unit)


# Films --------------------------------------------------------------------------------------


def write_creature_film(
    path: str | Path,
    rollout: Rollout,
    *,
    size: tuple[int, int] = (640, 360),
    fps: int = 25,
    title: str = "",
    start: int = 0,
    stop: int | None = None,
    speed: float = 1.0,
    progress: Callable[[int, int], object] | None = None,
) -> Path:
    """Writes the steps `start` to `stop` of `rollout` as a film, `.gif` or `.mp4` by `path`.

    `size` in pixels; `fps` pictures a second, for a GIF a divisor of 100; `title`: the creature's
    name if empty; `stop`: the last step if None; `speed`: 1 is real time, 0.25 a slow motion.
    `progress(done, total)` is called after every picture. Pictures are drawn one at a time, so a
    long episode needs no more memory than a short one. A file appears only when it is whole.
    Raises ValueError for arguments that cannot be filmed and RuntimeError where ffmpeg is needed
    and fails or is absent.
    """
    path = Path(path)
    check_size(size)
    if fps <= 0:
        raise ValueError(f"fps must be above 0, not {fps}")
    if not (np.isfinite(speed) and speed > 0.0):
        raise ValueError(f"speed must be above 0, not {speed}")
    body = read_body(rollout.creature)
    check_rollout(rollout, body)
    stop = check_window(rollout, start, stop)
    film_of = _Film(rollout, body, size, title or body.name, speed)
    count = max(int((stop - start) * rollout.dt * fps / speed + 1e-6), 1)
    rows: Array = start + np.arange(count, dtype=np.float64) * (speed / (fps * rollout.dt))
    views = _follow(rollout, body, rows, speed / fps, size)

    def paint(k: int) -> Picture:
        return film_of.paint(float(rows[k]), views[k])

    return write_pictures(path, count, paint, size=size, fps=fps, progress=progress)


class _Film:
    """What stays the same from picture to picture."""

    def __init__(
        self, rollout: Rollout, body: Body, size: tuple[int, int], title: str, speed: float
    ) -> None:
        self.rollout, self.body, self.title, self.speed = rollout, body, title, speed
        self.ground = check_ground(rollout.ground)
        torso = np.asarray(rollout.poses[:, rollout.torso, 0], np.float64)
        reach = max(round(0.25 / rollout.dt), 1)  # the speed shown is that of half a second
        index = np.arange(len(torso))
        low, high = np.maximum(index - reach, 0), np.minimum(index + reach, len(torso) - 1)
        self.pace = (torso[high] - torso[low]) / (np.maximum(high - low, 1) * rollout.dt)
        self.origin = torso[0]

    def paint(self, row: float, view: View) -> Picture:
        """The picture at a fractional row of the poses."""
        rollout, pose = self.rollout, poses_at(self.rollout.poses, [row])[0]
        canvas = paint_world(view, self.ground)
        paint_marks(canvas, view, self.ground)
        paint_start(canvas, view, self.ground)
        paint_shadow(canvas, view, self.body, pose, self.ground)
        self._trail(canvas, row, view)
        paint_body(canvas, view, self.body, pose)
        away = pose[rollout.torso, 0] - self.origin
        values = [
            ("time", f"{row * rollout.dt:.1f} s"),
            ("distance", f"{away:.1f} m"),
            ("speed", f"{self.pace[min(int(row + 0.5), len(self.pace) - 1)]:.1f} m/s"),
        ]
        if abs(self.speed - 1.0) > 1e-9:
            values.append(("film", f"{self.speed:g}x"))
        values = [(name, "0" + v[2:] if v.startswith("-0.0 ") else v) for name, v in values]
        fields(canvas, view.unit, self.title, values)
        return canvas

    def _trail(self, canvas: Picture, row: float, view: View) -> None:
        """Where the torso was, a dot a beat: far apart is fast."""
        now = row * self.rollout.dt
        beats = np.arange(np.ceil(max(now - TRAIL, 0.0) / BEAT), np.floor(now / BEAT + 1e-9) + 1.0)
        if not len(beats):
            return
        torso = self.rollout.poses[:, [self.rollout.torso]]
        path = poses_at(torso, beats * (BEAT / self.rollout.dt))[:, 0, :2]
        fade = np.clip(1.0 - (now - beats * BEAT) / TRAIL, 0.0, 1.0)
        paint_trail(canvas, view, path, 0.7 * fade**1.3, 255.0 * ACCENT)


def _follow(
    rollout: Rollout, body: Body, rows: ArrayLike, dt: float, size: tuple[int, int]
) -> list[View]:
    """One view a row, `dt` seconds apart: beside the torso, and upwards only as far as needed."""
    rows, ground = np.asarray(rows, np.float64), check_ground(rollout.ground)
    low, high = body.bounds(body.pose)
    width, tall = size
    scale = float(min(0.40 * tall / (high[1] - low[1]), 0.38 * width / (high[0] - low[0])))
    x, bottom, top = _extent(rollout, body, rows)
    # A high jump is seen from farther away, and followed as far as that is not enough.
    over = float((top - height(ground, x)).max())
    scale = max(min(scale, (GROUND - 0.08) * tall / over), SMALLEST * scale)
    # There is more room on the side that it goes to.
    lead = 0.07 * width / scale * np.sign(x[-1] - x[0])
    middle = smooth(x, 0.6, dt) + lead
    # The level of the ground around it, by the median: a hole or a step does not move the camera.
    around = np.linspace(-0.3, 0.3, 13) * width / scale
    level = np.median(height(ground, x[:, None] + around), axis=1)
    up = smooth(level, 0.8, dt) if np.ptp(level) > 0.0 else level
    room, below = (GROUND - 0.08) * tall / scale, 0.05 * tall / scale
    up = _within(up, top - room, bottom + below, dt)
    tops = up + GROUND * tall / scale
    lefts = middle - 0.5 * width / scale
    unit = unit_of(size)
    return [View(size, scale, float(a), float(b), unit) for a, b in zip(lefts, tops, strict=True)]


def _extent(rollout: Rollout, body: Body, rows: Array) -> tuple[Array, Array, Array]:
    """The torso's x, and the lowest and highest y of the creature, metres, (N,) each."""
    found = []
    for chunk in np.array_split(rows, max(len(rows) // 256, 1)):
        poses = poses_at(rollout.poses, chunk)
        low, high = body.bounds(poses)
        found.append((poses[:, rollout.torso, 0], low[:, 1], high[:, 1]))
    x, bottom, top = (np.concatenate(part) for part in zip(*found, strict=True))
    return x, bottom, top


def _within(level: Array, low: Array, high: Array, dt: float) -> Array:
    """`level` (N,), moved as smoothly as possible to stay between `low` and `high` (N,).

    The sooner a jump takes it from one to the other, the less time there is to be smooth.
    """
    for seconds in (1.0, 0.5, 0.25, 0.12, 0.06):
        out = _lifted(level, low, seconds, dt)
        out = -_lifted(-out, -high, seconds, dt)
        slack = 0.06 * (high - low)
        if (out >= low - slack).all() and (out <= high + slack).all():
            return out
    return np.clip(level, low, np.maximum(low, high))


def _lifted(level: Array, needed: Array, seconds: float, dt: float) -> Array:
    """`level` (N,), raised smoothly to `needed` (N,) around the times when that is higher."""
    lift = np.maximum(needed - level, 0.0)
    if not lift.any():
        return level
    reach = max(round(seconds / dt), 1)
    padded = np.pad(lift, reach, mode="edge")
    # What is needed within `seconds` is prepared for; smoothing then cuts no peak.
    wide = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1).max(-1)
    return level + np.maximum(smooth(wide, 0.25 * seconds, dt), 0.0)
