"""Figures of a recording. Each function says what it prints and in which unit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ambulo.evaluate.track import Track
from ambulo.recording import Heights, Recording

Array = NDArray[np.floating]
Flags = NDArray[np.bool_]

# Height above which a foot counts as off the ground (Zhang et al. 2018, MANN, section 8), metres.
SKATE_HEIGHT = 0.025


def contact_floor(recording: Recording, terrain: Heights, joints: list[int]) -> Array | None:
    """(feet,) median height in metres of each foot's joint above the ground while in contact.

    `joints` are the left and the right toe, whose contacts are the recording's. What counts as
    zero differs by skeleton and clip by centimetres, which is as much as feet lift; so it is
    measured. None if a foot is never in contact (above one half).
    """
    height = _above_ground(recording, terrain, joints)
    touching = recording.contacts[:, [1, 3]] > 0.5
    if not touching.any(axis=0).all():
        return None
    return np.array([np.median(height[touching[:, i], i]) for i in range(2)])


def foot_skate(recording: Recording, terrain: Heights, joints: list[int], floor: Array) -> float:
    """Mean foot skate in centimetres per 60 Hz frame, weighted by height as MANN does.

    Per foot and frame s = v · (2 − 2^(h / H)) while h < H = 2.5 cm, else 0: v is the joint's
    horizontal displacement per 1/60 s and h its height above the ground, less its `floor` (metres,
    one a foot); below that h counts as 0. The mean is over frames and feet.
    """
    above = _above_ground(recording, terrain, joints) - floor
    return float(skate(recording.positions[:, joints], above, recording.fps).mean())


def skate(feet: Array, above: Array, fps: float) -> Array:
    """(T − 1, feet) foot skate in centimetres per 60 Hz frame, as `foot_skate` defines it.

    `feet` (T, feet, 3) are places in the world, `above` (T, feet) heights over the floor; metres.
    """
    h = np.clip(above, 0.0, None)[1:]
    step = np.diff(feet[..., [0, 2]].astype(float), axis=0)
    v = np.hypot(step[..., 0], step[..., 1]) * fps / 60.0
    weight = np.clip(2.0 - 2.0 ** (h / SKATE_HEIGHT), 0.0, None)
    return v * weight * 100.0


def planted_slide(recording: Recording, planted: Flags, joints: list[int]) -> float:
    """Mean slide of a planted foot in centimetres per 60 Hz frame.

    `joints` are the balls (toe joints) of the left and the right foot, `planted` (T, 2) says in
    which frames each foot stands. What counts is the joint's horizontal displacement per 1/60 s
    between two frames in both of which its foot stands; the mean is over those and over the feet.
    0 where no foot ever stands for two frames.
    """
    step = np.diff(recording.positions[:, joints][..., [0, 2]].astype(float), axis=0)
    stands = planted[1:] & planted[:-1]
    if not stands.any():
        return 0.0
    v = np.hypot(step[..., 0], step[..., 1]) * recording.fps / 60.0
    return float(v[stands].mean() * 100.0)


def jerk(positions: Array, fps: float) -> Array:
    """(T − 3,) mean over joints of the third difference of places (T, J, 3), metres / s³."""
    third = np.diff(positions.astype(float), 3, axis=0)
    return np.linalg.norm(third, axis=-1).mean(axis=-1) * fps**3


def sway(places: Array, fps: float, window: float = 2.0) -> Array:
    """(windows,) how far a point (T, 3) moves about its mean in windows of `window` seconds.

    The root of the summed variances of x, y and z, metres; windows start every half window and
    there are none where the motion is shorter.
    """
    length = round(window * fps)
    starts = range(0, len(places) - length + 1, max(length // 2, 1))
    spreads = [places[i : i + length].astype(float).var(axis=0).sum() ** 0.5 for i in starts]
    return np.array(spreads)


def _above_ground(recording: Recording, terrain: Heights, joints: list[int]) -> Array:
    feet = recording.positions[:, joints].astype(float)
    return feet[..., 1] - terrain.height(feet[..., 0], feet[..., 2])


def path_error(root: Array, track: Track) -> float:
    """Mean distance in metres from the root (T, 2) to the nearest point of the closed track."""
    return float(_from_track(root, track).mean())


def path_error_max(root: Array, track: Track) -> float:
    """Largest distance in metres from the root (T, 2) to the nearest point of the closed track."""
    return float(_from_track(root, track).max())


def _from_track(root: Array, track: Track) -> Array:
    points = np.array([w.position for w in track.waypoints])
    starts, ends = np.roll(points, 1, axis=0), points
    distances = [_to_segment(root, a, b) for a, b in zip(starts, ends, strict=True)]
    return np.min(distances, axis=0)


def _to_segment(points: Array, start: Array, end: Array) -> Array:
    along = end - start
    t = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
    return np.linalg.norm(points - (start + t[:, None] * along), axis=1)


def heading_error(recording: Recording) -> float:
    """Mean angle in degrees between asked and actual facing."""
    asked = recording.asked[:, 2]
    difference = np.angle(np.exp(1j * (asked - recording.facing)))
    return float(np.degrees(np.abs(difference)).mean())


def speed_ratio(recording: Recording) -> float:
    """Mean over frames of the root's speed over the asked speed."""
    step = np.diff(recording.root.astype(float), axis=0)
    speed = np.hypot(step[:, 0], step[:, 1]) * recording.fps
    asked = np.hypot(recording.asked[1:, 0], recording.asked[1:, 1])
    return float((speed / asked).mean())
