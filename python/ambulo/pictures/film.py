"""Films and filmstrips of a recording: a mannequin on gridded ground, followed by a quiet camera.

`write_film` makes a GIF, or an MP4 where ffmpeg is on the PATH; `write_filmstrip` makes one PNG
with a row of poses a shot. A shot is (first frame, end frame, title) in frames of the recording;
the end frame is not part of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from PIL import Image, ImageDraw

from ambulo.files import replacing
from ambulo.pictures.drawing import Array, Camera, Pixels
from ambulo.pictures.encode import write_pictures
from ambulo.pictures.stage import (
    ACCENT,
    INK,
    PAPER,
    QUIET,
    Picture,
    Stage,
    between,
    caption,
    colour,
    follow,
    font,
    to_bytes,
)
from ambulo.recording import Flat, Floats, Heights, Recording

Shot = tuple[int, int, str]
Progress = Callable[[int, int], object]


# Films --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Take:
    """One picture of a film, not yet painted."""

    frame: float
    camera: Camera
    sun: Array
    title: str
    seconds: float


def write_film(
    path: str | Path,
    recording: Recording,
    shots: Sequence[Shot],
    *,
    terrain: Heights | None = None,
    waypoints: ArrayLike = (),
    size: tuple[int, int] = (640, 360),
    fps: int = 25,
    view: float = 0.9,
    progress: Progress | None = None,
) -> Path:
    """Writes the `shots` of `recording` as one film, `.gif` or `.mp4` by the name of `path`.

    `waypoints` (M, 2 or more): x, z in metres, indexed by `recording.leg`. `view`: the camera
    stands this many radians to the left of where the character faces. `progress(done, total)` is
    called after every picture. A file appears only when it is whole. Raises ValueError for
    arguments that cannot be filmed and RuntimeError where ffmpeg is needed and fails or is absent.
    """
    path = Path(path)
    terrain = Flat() if terrain is None else terrain
    _check_shots(recording, shots)
    check_size(size)
    stage = Stage(recording, terrain, _points(waypoints))
    takes = _plan(recording, shots, stage, size, fps, view)

    def paint(k: int) -> Picture:
        take = takes[k]
        fields = _fields(stage, take)
        return caption(to_bytes(stage.paint(take.frame, take.camera, take.sun)), take.title, fields)

    return write_pictures(path, len(takes), paint, size=size, fps=fps, progress=progress)


def _plan(
    recording: Recording,
    shots: Sequence[Shot],
    stage: Stage,
    size: tuple[int, int],
    fps: int,
    view: float,
) -> list[_Take]:
    """Every picture of the film in order; the sun stands still during a shot."""
    if fps <= 0:
        raise ValueError(f"fps must be above 0, not {fps}")
    takes = []
    for start, end, title in shots:
        count = max(int((end - start) / recording.fps * fps + 1e-6), 1)
        frames = start + np.arange(count) * (recording.fps / fps)
        cameras = follow(recording, frames, stage.mannequin.stature, stage.terrain, size, view)
        sun = cameras[len(cameras) // 2].sun
        takes += [
            _Take(float(f), c, sun, title, float(f) / recording.fps)
            for f, c in zip(frames, cameras, strict=True)
        ]
    return takes


def _fields(stage: Stage, take: _Take) -> list[tuple[str, str]]:
    """The labelled values under a picture."""
    recording, frame = stage.recording, int(take.frame)
    asked = float(np.hypot(*recording.asked[frame, :2]))
    return [
        ("time", f"{take.seconds:.1f} s"),
        ("asked", f"{asked:.2f} m/s"),
        ("speed", f"{stage.speed[frame]:.2f} m/s"),
        ("gait", recording.gait_names[int(recording.gait[frame])]),
    ]


def _check_shots(recording: Recording, shots: Sequence[Shot]) -> None:
    if not shots:
        raise ValueError("no shots: give at least one (start frame, end frame, title)")
    for start, end, title in shots:
        if not 0 <= start < end <= recording.frames:
            raise ValueError(
                f"shot {title!r} runs from {start} to {end}; the recording has frames "
                f"0 to {recording.frames} and a shot must end after it starts"
            )


def check_size(size: tuple[int, int]) -> None:
    """ValueError unless `size` is a width and height that can be drawn."""
    if len(size) != 2 or min(size) < 32 or max(size) > 8192:
        raise ValueError(f"size must be (width, height), each 32 to 8192 pixels, not {size}")


def _points(waypoints: ArrayLike) -> Array:
    """(M, 2) from (M, 2 or more); M may be 0."""
    points = np.asarray(waypoints, np.float64)
    if points.size == 0:
        return np.zeros((0, 2))
    if points.ndim != 2 or points.shape[1] < 2:
        raise ValueError(f"waypoints must have shape (M, 2 or more), not {points.shape}")
    return points[:, :2]


# Filmstrips ---------------------------------------------------------------------------------


def write_filmstrip(
    path: str | Path,
    recording: Recording,
    shots: Sequence[Shot],
    *,
    terrain: Heights | None = None,
    poses: int = 8,
    cell: tuple[int, int] = (180, 270),
) -> Path:
    """Writes one PNG: a row a shot, `poses` side views evenly spaced over one gait cycle.

    The character goes from left to right in cells of `cell` pixels; where no cycle is found (a
    turn, a stop) the middle 1.6 s of the shot are shown. A file appears only when it is whole.
    """
    path = Path(path)
    terrain = Flat() if terrain is None else terrain
    _check_shots(recording, shots)
    check_size(cell)
    if poses < 1:
        raise ValueError(f"poses must be at least 1, not {poses}")
    stage = Stage(recording, terrain, np.zeros((0, 2)))
    unit = cell[1] / 270.0
    margin, gap, head = round(24 * unit), round(12 * unit), round(190 * unit)
    width = head + poses * cell[0] + margin
    height = 2 * margin + len(shots) * cell[1] + (len(shots) - 1) * gap
    sheet = Image.new("RGB", (width, height), PAPER)
    for row, (start, end, title) in enumerate(shots):
        top = margin + row * (cell[1] + gap)
        first, span = _cycle(stage, start, end)
        frames = first + np.arange(poses) * span / poses
        _label(sheet, (margin, top), head, unit, title, stage, first, span)
        for k, frame in enumerate(frames):
            picture = _pose(stage, frames, float(frame), cell)
            image = Image.fromarray(to_bytes(picture))
            time = f"{(frame - first) / recording.fps:.2f} s"
            place = (0.5 * cell[0], cell[1] - 8.0 * unit)
            ImageDraw.Draw(image).text(place, time, QUIET, font(12.0 * unit), "ms")
            sheet.paste(image, (head + k * cell[0], top))
    with replacing(path) as part:
        sheet.save(part, "PNG", optimize=True)
    return path


def _label(
    sheet: Image.Image,
    corner: tuple[int, int],
    head: int,
    unit: float,
    title: str,
    stage: Stage,
    first: float,
    span: float,
) -> None:
    """A row's title, broken into lines, with its gait, speed and length below."""
    draw, large, small = ImageDraw.Draw(sheet), font(21.0 * unit), font(13.5 * unit)
    (x, y), room = corner, head - corner[0] - 14.0 * unit
    lines: list[str] = []
    for word in title.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and large.getlength(longer) <= room:
            lines[-1] = longer
        else:
            lines.append(word)
    fps = stage.recording.fps
    inside = slice(int(first), int(first + span) + 1)
    facts = [f"{stage.speed[inside].mean():.2f} m/s", f"{span / fps:.2f} s shown"]
    y += round(14 * unit)
    draw.rectangle((x, y, x + 26 * unit, y + 3 * unit), fill=colour(ACCENT))
    y += round(18 * unit)
    for line in lines:
        draw.text((x, y), line, INK, large, "lt")
        y += round(26 * unit)
    y += round(6 * unit)
    for fact in facts:
        draw.text((x, y), fact, QUIET, small, "lt")
        y += round(19 * unit)


def _pose(stage: Stage, frames: Floats, frame: float, cell: tuple[int, int]) -> Pixels:
    """One cell of a strip: the pose at `frame`, travel to the right."""
    recording, stature = stage.recording, stage.mannequin.stature
    ends = between(recording.root, np.array([frames[0], frames[-1]]))
    travel = ends[1] - ends[0]
    heading = float(np.arctan2(travel[0], travel[1]))
    if np.hypot(*travel) < 0.3 * stature:
        heading = float(between(np.unwrap(recording.facing), np.array([frame]))[0])
    # Four legs go before and behind the hips, which is where the root is.
    human = stage.mannequin.human
    middle = recording.root if human else recording.positions.mean(axis=1)[:, [0, 2]]
    x, z = between(middle, np.array([frame]))[0]
    y = float(stage.terrain.height(np.array([x]), np.array([z]))[0])
    yaw = heading + 0.5 * np.pi  # then the picture's right is the heading
    forward = np.array([np.sin(yaw), 0.0, np.cos(yaw)])
    distance, rise = 5.0 * stature, 0.95 * stature
    size = 0.72 * cell[1] if human else min(0.72 * cell[1], 0.9 * cell[0])
    focal = size * distance / stature  # a long lens: no pose is seen from aside
    eye = np.array([x, y + rise, z]) - distance * forward
    feet = 0.845 * cell[1]
    camera = Camera(eye, yaw, focal, feet - focal * rise / distance, cell)
    sun = np.array([-0.16, -1.0, 0.45]) @ camera.axes
    return stage.paint(frame, camera, sun, extras=False)


def _cycle(stage: Stage, start: int, end: int) -> tuple[float, float]:
    """First frame and length in frames of the gait cycle nearest to the middle of a shot.

    The cycle is the lag at which the feet's distance along the facing best repeats itself.
    """
    recording, marks = stage.recording, stage.mannequin.marks
    fps = recording.fps
    fall_back = min(1.6 * fps, float(end - start - 1))
    middle = 0.5 * (start + end - 1)
    still = (middle - 0.5 * fall_back, fall_back)
    if "left ankle" not in marks or "right ankle" not in marks:
        return still
    left, right = (recording.positions[:, marks[f"{side} ankle"]] for side in ("left", "right"))
    apart = left - right
    facing = np.asarray(recording.facing, np.float64)
    signal = apart[:, 0] * np.sin(facing) + apart[:, 2] * np.cos(facing)
    signal = np.asarray(signal[start:end], np.float64)
    signal -= signal.mean()
    lags = np.arange(round(0.4 * fps), min(round(1.8 * fps), len(signal) // 2))
    if not len(lags) or np.ptp(signal) < 0.1 * stage.mannequin.stature:
        return still
    power = float(signal @ signal) / len(signal)
    match = np.array([signal[k:] @ signal[:-k] / (len(signal) - k) for k in lags]) / power
    peaks = [i for i in range(1, len(lags) - 1) if match[i] >= max(match[i - 1], match[i + 1])]
    peaks = [i for i in peaks if match[i] > 0.5]
    if not peaks:
        return still
    span = float(lags[peaks[0]])
    # Starts on the left heel's strike: the left foot is farthest ahead.
    low = int(max(middle - start - span, 0.0))
    high = int(min(low + span, len(signal) - span))
    return float(start + low + int(np.argmax(signal[low : max(high, low + 1)]))), span
