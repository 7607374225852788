"""Trunk, head and arms on top of the legs.

The shoulders turn against the pelvis and the arms swing with the opposite legs (Murray, Sepic &
Barnard 1967; Elftman 1939); the elbows bend more the faster one goes. The head looks ahead, level,
a little into the turn that is to come (Grasso et al. 1996).
"""

from __future__ import annotations

import numpy as np

from ambulo.starter_motion.body import LEFT, SIGNS
from ambulo.starter_motion.gait import GRAVITY, Rhythm
from ambulo.starter_motion.hips import Hips
from ambulo.starter_motion.intent import FPS, Intent
from ambulo.starter_motion.noise import Chance
from ambulo.starter_motion.rotations import (
    Floats,
    about,
    exp,
    inverse,
    log,
    mix,
    product,
    smoothed,
)

BREATHS = 0.24  # a second, at rest


def trunk_and_head(
    hips: Hips, intent: Intent, pace: Rhythm, slope: Floats, chance: Chance
) -> dict[str, Floats]:
    """Local rotations (F, 4) of spine, neck and head by joint name, and "chest" in the world."""
    frames = len(intent.time)
    breath = breathing(pace, chance)
    lead = _lead(intent.yaw, 0.25)
    yaw = intent.yaw + mix(0.10, 0.17, pace.running) * _delayed(hips.stride, 2.0)
    yaw += 0.3 * lead + 0.03 * hips.idle * chance.wander(frames, 70.0)
    pitch = 0.065 + 0.035 * np.minimum(pace.speed, 2.0) * np.maximum(pace.ahead, -0.5)
    pitch = mix(pitch, 0.18 + 0.025 * pace.speed, pace.running) + 0.42 * pace.crouch
    pitch = pitch + 0.55 * np.clip(hips.push[:, 1] / GRAVITY, -0.35, 0.35)
    pitch = pitch + 0.35 * np.maximum(-hips.flight, 0.0) - 0.012 * breath + 0.5 * slope
    roll = -0.75 * np.clip(hips.push[:, 0] / GRAVITY, -0.5, 0.5) - 0.35 * hips.list
    roll = roll + 0.012 * chance.wander(frames, 60.0)
    yaw, pitch, roll = (
        angle + 0.010 * hips.idle * chance.wander(frames, 20.0) for angle in (yaw, pitch, roll)
    )
    chest = product(about(1, yaw), about(0, pitch), about(2, roll))
    third = exp(log(product(inverse(hips.rotation), chest)) / 3.0)
    look = _gaze(intent, hips, pace, chance)
    turned = log(product(inverse(chest), look))
    return {
        "chest": chest,
        "Spine": third,
        "Spine1": third,
        "Spine2": third,
        "Neck": exp(0.4 * turned),
        "Head": exp(0.6 * turned),
    }


def breathing(pace: Rhythm, chance: Chance) -> Floats:
    """(F,) -1 breathed out, 1 breathed in; faster after exertion."""
    rate = BREATHS + 0.10 * smoothed(np.minimum(pace.speed, 4.0), 120.0)
    return np.sin(2.0 * np.pi * (np.cumsum(rate) / FPS + chance.uniform(0.0, 1.0)))


def _lead(yaw: Floats, seconds: float) -> Floats:
    """(F,) how far the facing will have turned by then, blurred."""
    shift = round(seconds * FPS)
    later = np.concatenate([yaw[shift:], np.full(min(shift, len(yaw)), yaw[-1])])[: len(yaw)]
    return smoothed(later - yaw, 6.0)


def _delayed(signal: Floats, frames: float) -> Floats:
    index = np.arange(len(signal), dtype=np.float64)
    return np.interp(index - frames, index, signal)


def _gaze(intent: Intent, hips: Hips, pace: Rhythm, chance: Chance) -> Floats:
    """(F, 4) of the head in the world: level and ahead; at rest it looks round."""
    frames = len(intent.time)
    wander = np.clip(chance.wander(frames, 38.0), -1.9, 1.9)
    yaw = intent.yaw + np.clip(0.8 * _lead(intent.yaw, 0.4), -0.6, 0.6)
    yaw = yaw + wander * mix(0.05, 0.30, smoothed(hips.idle, 20.0))
    pitch = 0.06 + 0.08 * pace.crouch + 0.035 * chance.wander(frames, 45.0)
    roll = -0.2 * np.clip(hips.push[:, 0] / GRAVITY, -0.5, 0.5)
    return product(about(1, yaw), about(0, pitch), about(2, roll))


def arm(
    side: int, hips: Hips, pace: Rhythm, chest: Floats, breath: Floats, chance: Chance
) -> dict[str, Floats]:
    """Local rotations (F, 4) of one shoulder, arm, forearm and hand by bare joint name."""
    frames, sign = len(breath), SIGNS[side]
    own = 1.0 + 0.06 * chance.wander(frames, 90.0)
    reach = mix(0.50, 0.56, pace.running) * np.clip(0.45 + 0.45 * pace.speed, 0.0, 1.0)
    swing = -sign * reach * own * _delayed(hips.stride, 1.0 if side == LEFT else 1.5)
    swing *= mix(1.0, 0.6, pace.crouch)
    jump = np.clip(hips.flight, -1.0, 1.2)
    # The arms hang from a leaning chest; y of the chest's forward axis is its lean.
    lean = np.arcsin(np.clip(-_forward_height(chest), -0.9, 0.9))
    raised = 0.04 + 0.75 * lean + swing - 0.26 * pace.running
    raised = raised + 0.9 * jump * (jump > 0.0) + 0.7 * jump * (jump <= 0.0)
    raised = raised + 0.03 * chance.wander(frames, 30.0)
    away = 0.20 + 0.08 * pace.running + 0.22 * pace.crouch + 0.35 * np.maximum(jump, 0.0)
    away = away + 0.015 * breath * hips.idle + 0.02 * chance.wander(frames, 70.0)
    forwards = np.maximum(swing, 0.0)
    elbow = mix(0.40 + 0.06 * pace.speed + 0.60 * forwards, 1.60 + 0.50 * swing, pace.running)
    elbow = elbow + 0.65 * pace.crouch + 0.3 * np.abs(jump) + 0.04 * chance.wander(frames, 60.0)
    inward = 0.08 + 0.42 * pace.running + 0.10 * pace.crouch
    hang = 0.5 * np.pi - away
    lifted = 0.012 * breath + 0.03 * np.maximum(jump, 0.0) + 0.02 * pace.running
    return {
        "Shoulder": product(about(1, -sign * 0.12 * swing), about(2, sign * lifted)),
        "Arm": product(about(0, -raised), about(2, -sign * hang), about(0, inward)),
        "ForeArm": about(1, -sign * np.maximum(elbow, 0.08)),
        "Hand": product(about(0, np.full(frames, 0.25)), about(2, -sign * (0.08 + 0.05 * swing))),
    }


def _forward_height(q: Floats) -> Floats:
    """(F,) height of the tip of the turned Z axis."""
    x, y, z, w = q.T
    return 2.0 * (y * z - x * w)
