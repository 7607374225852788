"""What a film of a recording shows: the following camera, the painted picture and its caption."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw, ImageFont

from ambulo.pictures.drawing import NEAR, Array, Camera, Cones, Pixels, draw_cones
from ambulo.pictures.ground import HAZE, HORIZON, GroundView, cast_shadow, draw_ground, lay_shadow
from ambulo.pictures.mannequin import Mannequin
from ambulo.recording import Floats, Heights, Recording

Picture = NDArray[np.uint8]

ACCENT = np.array([0.925, 0.330, 0.220], np.float32)
INK = (46, 50, 58)
QUIET = (112, 116, 124)
PAPER = (246, 246, 245)

FIELD_OF_VIEW = np.radians(35.0)  # of the picture's height
FIGURE = 0.54  # the character's part of the picture's height
TRAIL = 4.0  # seconds of path behind the character


# Cameras ------------------------------------------------------------------------------------


def smooth(values: ArrayLike, halflife: float, dt: float) -> Array:
    """`values` (T, ...) through a critically damped spring, forth and back: smooth, without lag.

    `halflife` in seconds; `dt` seconds a row.
    """
    values = np.asarray(values, np.float64)
    # Mirrored through its ends, so that a moving thing is already followed in the first picture.
    spare = int(np.ceil(6.0 * halflife / dt))
    around = [(spare, spare)] + [(0, 0)] * (values.ndim - 1)
    out = np.pad(values, around, mode="reflect", reflect_type="odd")
    rate = 2.0 * np.log(2.0) / halflife  # the spring of Holden's damper with this half-life
    decay = np.exp(-rate * dt)
    for rows in (out, out[::-1]):
        at, speed = rows[0].copy(), np.zeros_like(rows[0])
        for i in range(1, len(rows)):
            off = at - rows[i]
            pull = speed + off * rate
            at = rows[i] + decay * (off + pull * dt)
            speed = decay * (speed - pull * rate * dt)
            rows[i] = at
    return out[spare : spare + len(values)]


def place_camera(
    target: ArrayLike,
    yaw: float,
    size: tuple[int, int],
    *,
    distance: float,
    rise: float,
    middle: float,
) -> Camera:
    """A camera `distance` m from `target` (3,), a point of the ground, looking along `yaw`.

    The eye is `rise` m above the target; what is `middle` m above it is at half picture height.
    """
    focal = 0.5 * size[1] / np.tan(0.5 * FIELD_OF_VIEW)
    forward = np.array([np.sin(yaw), 0.0, np.cos(yaw)])
    eye = np.asarray(target, np.float64) - distance * forward + np.array([0.0, rise, 0.0])
    horizon = 0.5 * size[1] - focal * (rise - middle) / distance
    return Camera(eye, float(yaw), float(focal), float(horizon), size)


def follow(
    recording: Recording,
    frames: ArrayLike,
    stature: float,
    terrain: Heights,
    size: tuple[int, int],
    view: float,
) -> list[Camera]:
    """One camera a (fractional) frame, from `view` radians to the left of where it faces."""
    frames = np.asarray(frames, np.float64)
    dt = float(frames[1] - frames[0]) / recording.fps if len(frames) > 1 else 1.0
    root = smooth(between(recording.root, frames), 0.15, dt)
    facing = np.unwrap(np.asarray(recording.facing, np.float64))
    yaw = smooth(between(facing, frames), 0.8, dt) + view + np.pi
    ground = smooth(heights(terrain, between(recording.root, frames)), 0.5, dt)
    distance = stature / (FIGURE * 2.0 * np.tan(0.5 * FIELD_OF_VIEW))
    behind = np.stack([np.sin(yaw), np.cos(yaw)], -1)
    # On a slope the eye may not sink into the hill that it stands on.
    floor = heights(terrain, root - distance * behind) + 0.35 * stature - ground
    rise = smooth(np.maximum(floor, 0.83 * stature), 0.5, dt)
    return [
        place_camera(
            (x, y, z), float(a), size, distance=distance, rise=float(r), middle=0.53 * stature
        )
        for (x, z), y, a, r in zip(root, ground, yaw, rise, strict=True)
    ]


def between(values: ArrayLike, frames: Floats) -> Array:
    """`values` (T, ...) at fractional frames (N,), linearly."""
    values = np.asarray(values)
    low = np.clip(np.floor(frames).astype(np.int64), 0, len(values) - 1)
    high = np.minimum(low + 1, len(values) - 1)
    part = (frames - low).reshape(-1, *([1] * (values.ndim - 1)))
    return values[low] * (1.0 - part) + values[high] * part


def heights(terrain: Heights, points: Floats) -> Array:
    """Heights (N,) at ground points x, z (N, 2)."""
    return np.asarray(terrain.height(points[:, 0], points[:, 1]), np.float64)


# Painting -----------------------------------------------------------------------------------


@dataclass
class Stage:
    """Everything that stays the same from picture to picture."""

    recording: Recording
    terrain: Heights
    waypoints: Array
    """(M, 2) x, z; M may be 0."""

    def __post_init__(self) -> None:
        self.mannequin = Mannequin(self.recording, self.terrain)
        self.speed = _speeds(self.recording)

    def paint(
        self,
        frame: float,
        camera: Camera,
        sun: Array,
        *,
        figure: bool = True,
        extras: bool = True,
    ) -> Pixels:
        """The picture (H, W, 3) at a fractional frame; `extras`: grid, path and waypoint."""
        recording = self.recording
        at = np.array([frame])
        x, z = between(recording.root, at)[0]
        level = float(self.terrain.height(np.array([x]), np.array([z]))[0])
        body = self.mannequin.cones(
            between(recording.positions, at)[0], between(recording.tips, at)[0]
        )
        post = self._post(frame, camera) if extras else None
        ground = draw_ground(camera, self.terrain, sun, grid=extras)
        if extras:
            self._mark_ground(ground, camera, frame)
        if post is not None:
            shadow = cast_shadow(post, sun, float(post.a[0, 1]), spread=0.07)
            lay_shadow(ground, camera, shadow, 0.60)
        if figure:
            _lay(ground, camera, body, sun, level)
        things = ([body] if figure else []) + ([post] if post is not None else [])
        things.sort(key=lambda c: -float(camera.to_camera(c.a[0])[2]))
        for cones in things:
            draw_cones(ground.picture, camera, cones, sun)
        return ground.picture

    def _target(self, frame: float) -> Array | None:
        """(3,) the foot of the waypoint being walked to."""
        if not len(self.waypoints):
            return None
        x, z = self.waypoints[int(self.recording.leg[int(frame)]) % len(self.waypoints)]
        return np.array([x, float(self.terrain.height(np.array([x]), np.array([z]))[0]), z])

    def _post(self, frame: float, camera: Camera) -> Cones | None:
        """A post with a ball on it at the waypoint being walked to."""
        foot = self._target(frame)
        if foot is None:
            return None
        depth = float(camera.to_camera(foot)[2])
        haze = 1.0 - np.exp(-((max(depth, 0.0) / HAZE) ** 2))
        colour = ACCENT + haze * (HORIZON - ACCENT)
        top = foot + np.array([0.0, 1.0, 0.0])
        side = np.array([[1.0, 0.0, 0.0]] * 2)
        return Cones(
            np.stack([foot, top]), np.stack([top, top]), np.array([0.018, 0.075]),
            np.array([0.018, 0.075]), side, np.ones(2), np.stack([colour, colour]),
        )  # fmt: skip

    def _mark_ground(self, ground: GroundView, camera: Camera, frame: float) -> None:
        """The path walked and a ring around the waypoint, painted on the ground."""
        width, height = camera.size
        mask = Image.new("L", (2 * width, 2 * height), 0)
        draw = ImageDraw.Draw(mask)
        first = max(frame - TRAIL * self.recording.fps, 0.0)
        count = max(int((frame - first) / self.recording.fps * 12.0), 1) + 1
        path = between(self.recording.root, np.linspace(first, frame, count))
        for k, corners in enumerate(_ribbon(path, 0.03)):
            self._fill(draw, ground, camera, corners, int(190 * (k + 1) / count))
        foot = self._target(frame)
        if foot is not None:
            angle = np.linspace(0.0, 2.0 * np.pi, 49)
            circle = np.stack([np.sin(angle), np.cos(angle)], -1)
            for corners in _ribbon(foot[[0, 2]] + 0.40 * circle, 0.025):
                self._fill(draw, ground, camera, corners, 200)
        box = mask.getbbox()
        if box is None:
            return
        left, top = box[0] // 2, box[1] // 2
        right, bottom = -(-box[2] // 2), -(-box[3] // 2)
        part = mask.crop((2 * left, 2 * top, 2 * right, 2 * bottom)).reduce(2)
        alpha = np.asarray(part, np.float32)[..., None] / 255.0
        target = ground.picture[top:bottom, left:right]
        target += alpha * (ACCENT - target)

    def _fill(
        self,
        draw: ImageDraw.ImageDraw,
        ground: GroundView,
        camera: Camera,
        corners: Array,
        alpha: int,
    ) -> None:
        """Fills a small ground quad (4, 2) unless it is out of view or behind a hill."""
        seen = camera.project(
            np.stack([corners[:, 0], heights(self.terrain, corners), corners[:, 1]], -1)
        )
        if (seen[:, 2] < NEAR).any() or (np.abs(seen[:, :2]) > 4.0 * max(camera.size)).any():
            return
        column, row, depth = seen.mean(0)
        row, column = int(row) - ground.top, int(column)
        if ground.depth.shape[1] > 1 and 0 <= row < len(ground.depth):
            hidden = 0 <= column < camera.size[0] and ground.depth[row, column] < depth - 0.5
            if hidden:
                return
        draw.polygon([(2.0 * c, 2.0 * r) for c, r, _ in seen.tolist()], fill=alpha)


def _ribbon(path: Array, half: float) -> Iterator[Array]:
    """Quads (4, 2) along `path` (N, 2), `half` m to each side; none where it stands still."""
    step = np.gradient(path, axis=0)
    size = np.linalg.norm(step, axis=-1, keepdims=True)
    side = half * np.stack([step[:, 1], -step[:, 0]], -1) / np.maximum(size, 1e-6)
    for i in range(len(path) - 1):
        if size[i] > 1e-4 and size[i + 1] > 1e-4:
            yield np.stack(
                [path[i] + side[i], path[i + 1] + side[i + 1],
                 path[i + 1] - side[i + 1], path[i] - side[i]]
            )  # fmt: skip


def _lay(ground: GroundView, camera: Camera, cones: Cones, sun: Array, level: float) -> None:
    """The sun's shadow of `cones`, and the dimness under whatever is close to the ground."""
    lay_shadow(ground, camera, cast_shadow(cones, sun, level, spread=0.07), 0.60)
    down = np.array([1e-3, -1.0, 0.0])
    near = cast_shadow(cones, down, level, spread=0.6, sharp=0.035, fade=0.25)
    lay_shadow(ground, camera, near, 0.60)


def _speeds(recording: Recording) -> Array:
    """(T,) ground speed in m/s over half a second around each frame."""
    root = np.asarray(recording.root, np.float64)
    reach = max(round(0.25 * recording.fps), 1)
    index = np.arange(len(root))
    low, high = np.maximum(index - reach, 0), np.minimum(index + reach, len(root) - 1)
    seconds = np.maximum(high - low, 1) / recording.fps
    return np.linalg.norm(root[high] - root[low], axis=-1) / seconds


def to_bytes(picture: Pixels) -> Picture:
    """(H, W, 3) colours 0..1 as bytes."""
    return (np.clip(picture, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)


def caption(picture: Picture, title: str, fields: Sequence[tuple[str, str]]) -> Picture:
    """`picture` with a title and labelled values at the lower left."""
    image = Image.fromarray(picture)
    draw = ImageDraw.Draw(image)
    unit = picture.shape[0] / 360.0
    left, base = 20.0 * unit, picture.shape[0] - 18.0 * unit
    label, value = font(10.5 * unit), font(15.0 * unit)
    draw.rectangle((left, base - 58 * unit, left + 2.5 * unit, base), fill=colour(ACCENT))
    left += 11.0 * unit
    draw.text((left, base - 59 * unit), title, INK, font(18.0 * unit), "lt")
    for name, text in fields:
        draw.text((left, base - 17 * unit), name, QUIET, label, "ls")
        draw.text((left, base), text, INK, value, "ls")
        # Columns keep their place while the numbers in them change.
        widest = max(value.getlength("0.00 m/s"), value.getlength(text))
        left += widest + 16.0 * unit
    return np.array(image)


def font(size: float) -> ImageFont.FreeTypeFont:
    """Pillow's own typeface, `size` in pixels."""
    font = ImageFont.load_default(size=max(size, 6.0))
    assert isinstance(font, ImageFont.FreeTypeFont), "Pillow was built without FreeType"
    return font


def colour(colour: Floats) -> tuple[int, int, int]:
    """A colour (3,) of 0..1 as bytes."""
    r, g, b = (int(255.0 * c + 0.5) for c in colour)
    return r, g, b
