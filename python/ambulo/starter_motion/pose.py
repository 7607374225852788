"""From hips and feet to the rotations of all joints: the legs by two-bone inverse kinematics."""

from __future__ import annotations

import numpy as np

from ambulo.starter_motion.body import NAMES, SHANK, SIDES, THIGH, joint
from ambulo.starter_motion.feet import Track
from ambulo.starter_motion.hips import NEAR, STRAIGHT, Hips, joint_places
from ambulo.starter_motion.rotations import (
    Floats,
    about,
    cross,
    from_axes,
    inverse,
    product,
    rotated,
    smoothed,
    unit,
    widened,
)

FOLDED = 0.30  # metres from hip to ankle: 140 degrees of knee


def keep_in_reach(hips: Hips, foot: Track) -> None:
    """Draws a swinging foot towards the hip where the leg could not reach it."""
    hip = joint_places(hips.place, hips.rotation, foot.side)
    away = foot.ankle - hip
    far = np.linalg.norm(away, axis=1)
    over = np.maximum(far - STRAIGHT, 0.0)
    # Near the ground the hips give way instead (`hips._overreach`), so the draw fades out there.
    free = np.clip(np.minimum(*_since_ground(foot.down)) / NEAR, 0.0, 1.0)
    draw = np.maximum(smoothed(widened(over * free, 2), 1.5) * free, over * (1.0 - foot.down))
    # Nor does a heel come nearer to the seat than a knee can fold.
    draw = np.minimum(draw, 0.3 * far) - smoothed(np.maximum(FOLDED - far, 0.0), 1.5)
    foot.ankle = hip + away * (1.0 - draw / far)[:, None]


def _since_ground(down: Floats) -> tuple[Floats, Floats]:
    """Frames (F,) since the foot left the ground and until it comes back."""
    frames = np.arange(len(down), dtype=np.float64)
    before = np.maximum.accumulate(np.where(down > 0.5, frames, -1e3))
    after = np.minimum.accumulate(np.where(down > 0.5, frames, 1e9)[::-1])[::-1]
    return frames - before, after - frames


def leg(hips: Hips, foot: Track) -> dict[str, Floats]:
    """Local rotations (F, 4) of one leg by bare joint name."""
    hip = joint_places(hips.place, hips.rotation, foot.side)
    down = foot.ankle - hip
    length = np.linalg.norm(down, axis=1, keepdims=True)
    along = down / length
    # The knee points where the pelvis and the foot do, between the two.
    pelvis = rotated(hips.rotation, np.array([0.0, 0.0, 1.0]))
    ahead = unit(pelvis + rotated(foot.rotation, np.array([0.0, 0.35, 0.6])))
    left = unit(cross(ahead, along))
    front = cross(along, left)
    part = (THIGH**2 - SHANK**2 + length**2) / (2.0 * length)
    bend = np.sqrt(np.maximum(THIGH**2 - part**2, 0.0))
    knee = hip + along * part + front * bend
    thigh = _bone(hip, knee, left)
    shank = _bone(knee, foot.ankle, left)
    return {
        "UpLeg": product(inverse(hips.rotation), thigh),
        "Leg": product(inverse(thigh), shank),
        "Foot": product(inverse(shank), foot.rotation),
        "Toe": about(0, -foot.flex),
    }


def _bone(top: Floats, bottom: Floats, left: Floats) -> Floats:
    """(F, 4) of a bone that hangs from `top` to `bottom`, its X axis to the left."""
    up = unit(top - bottom)
    return from_axes(left, up, cross(left, up))


def assembled(hips: Hips, trunk: dict[str, Floats], limbs: list[dict[str, Floats]]) -> Floats:
    """Local rotations (F, 22, 4); `limbs` are left and right leg, left and right arm."""
    rotations = np.zeros((len(hips.place), len(NAMES), 4))
    rotations[..., 3] = 1.0
    rotations[:, joint("Hips")] = hips.rotation
    for name, turned in trunk.items():
        if name in NAMES:
            rotations[:, joint(name)] = turned
    for index, limb in enumerate(limbs):
        for name, turned in limb.items():
            rotations[:, joint(name, index % len(SIDES))] = turned
    return rotations / np.linalg.norm(rotations, axis=-1, keepdims=True)
