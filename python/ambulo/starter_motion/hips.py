"""The hips over the feet: path, bob, sway, and the turns of the pelvis.

Pelvis: it turns about 5 degrees with the forward leg and drops about 4 on the side of the swinging
one (Saunders, Inman & Eberhart 1953; Murray 1967); it sways over the standing foot by 2 cm or so.
The hips are lowered smoothly wherever a standing leg would have to be longer than it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ambulo.starter_motion.body import HIP_DROP, HIP_SIDE, HIPS_HEIGHT, LEFT, LEG, RIGHT, SIGNS
from ambulo.starter_motion.feet import Track
from ambulo.starter_motion.footsteps import Print
from ambulo.starter_motion.gait import GRAVITY, Rhythm, bob
from ambulo.starter_motion.intent import FPS, Intent, Jump
from ambulo.starter_motion.noise import Chance
from ambulo.starter_motion.rotations import (
    Floats,
    about,
    ease,
    heading,
    hermite,
    leftward,
    mix,
    product,
    rotated,
    smoothed,
    widened,
)

STRAIGHT = 0.9945 * LEG  # a leg never gets longer than this: 12 degrees of knee are left

CROUCH = 0.22  # lower than standing, metres
NEAR = 3  # frames before and after a stance


@dataclass
class Hips:
    """The hips and what the trunk and arms take from the legs, over F frames."""

    place: Floats
    """(F, 3)."""
    rotation: Floats
    """(F, 4)."""
    stride: Floats
    """(F,) metres that the left ankle is ahead of the right one, blurred."""
    load: Floats
    """(F,) -1 on the right foot, 1 on the left one, blurred."""
    idle: Floats
    """(F,) 1 in a rest on both feet."""
    push: Floats
    """(F, 2) acceleration to the left and forward, m/s2, blurred."""
    flight: Floats
    """(F,) around a jump: below 0 in the dip before it, above 0 in the air, about -1 to 1."""
    list: Floats
    """(F,) of the pelvis, left side up, radians."""


def joint_places(hips: Floats, rotation: Floats, side: int) -> Floats:
    """(F, 3) of the left or right hip joint."""
    return hips + rotated(rotation, np.array([SIGNS[side] * HIP_SIDE, -HIP_DROP, 0.0]))


def hips_over(
    feet: tuple[Track, Track],
    prints: tuple[list[Print], list[Print]],
    intent: Intent,
    pace: Rhythm,
    jumps: list[Jump],
    chance: Chance,
) -> Hips:
    """The hips for these feet."""
    frames = len(intent.time)
    forward, aside = heading(intent.yaw), leftward(intent.yaw)
    root = np.stack([intent.place[:, 0], np.zeros(frames), intent.place[:, 1]], axis=1)
    steps, takes = _steps(prints, intent.time)
    active = _activity(prints, intent.time)
    idle = 1.0 - active
    load = _load(feet)
    apart = ((feet[LEFT].ankle - feet[RIGHT].ankle) * forward).sum(axis=1)
    stride = smoothed(apart, 3.0)

    turning = steps - pace.duty
    amount = bob(1.0 / takes, pace.speed * takes, pace.running, pace.crouch) * active
    height = _standing_height(pace) + amount * np.cos(2.0 * np.pi * turning) - np.abs(amount)
    height += 2.0 * np.maximum(-amount, 0.0)
    leap, flight = _jumped(intent.time, jumps)
    surge = -0.010 * np.sin(2.0 * np.pi * turning) * np.minimum(pace.speed / 1.4, 1.0)
    level = smoothed(0.5 * (feet[LEFT].height + feet[RIGHT].height), 7.0)

    place = root + _sway(feet, root, aside, pace, idle, load, chance)[:, None] * aside
    place = place + (surge + idle * _rocking(frames, chance))[:, None] * forward
    place[:, 1] = level + height + leap
    lists = -0.050 * -load * mix(1.0, 0.6, pace.running)
    push = _push(intent)
    rotation = _pelvis(intent, pace, stride, lists, push, chance)
    place[:, 1] -= _overreach(place, rotation, feet)
    return Hips(place, rotation, stride, load, idle, push, flight, lists)


def _steps(prints: tuple[list[Print], list[Print]], time: Floats) -> tuple[Floats, Floats]:
    """Count of steps (F,), whole at each landing, and the seconds (F,) that a step takes."""
    landings = np.sort([p.on for foot in prints for p in foot])
    landings = np.unique(np.round(landings, 6))
    counts = np.arange(len(landings), dtype=np.float64)
    gaps = np.minimum(np.diff(landings), 0.9)
    middles = 0.5 * (landings[1:] + landings[:-1])
    takes = np.interp(time, middles, gaps) if len(gaps) else np.full(len(time), 0.5)
    return smoothed(np.interp(time, landings, counts), 2.5), smoothed(takes, 8.0)


def _activity(prints: tuple[list[Print], list[Print]], time: Floats) -> Floats:
    """(F,) 1 while stepping, 0 in a rest: between, smooth."""
    busy = np.zeros(len(time))
    for foot in prints:
        for here, there in pairwise(foot):
            busy[(time >= here.off - 0.2) & (time <= there.on + 0.2)] = 1.0
    return smoothed(busy, 9.0)


def _load(feet: tuple[Track, Track]) -> Floats:
    """(F,) share of the weight: -1 right, 1 left; carried over while in the air."""
    left, right = feet[LEFT].down, feet[RIGHT].down
    known = np.flatnonzero(left + right > 0.0)
    share = left[known] - right[known]
    return smoothed(np.interp(np.arange(len(left)), known, share), 5.5)


def _standing_height(pace: Rhythm) -> Floats:
    """(F,) of the hips at their highest in walking, at their middle in running."""
    walk = HIPS_HEIGHT - 0.008 - 0.005 * pace.speed
    run = HIPS_HEIGHT - 0.052 - 0.004 * pace.speed
    return mix(mix(walk, run, pace.running), HIPS_HEIGHT - CROUCH, pace.crouch)


def _sway(
    feet: tuple[Track, Track],
    root: Floats,
    aside: Floats,
    pace: Rhythm,
    idle: Floats,
    load: Floats,
    chance: Chance,
) -> Floats:
    """(F,) metres to the left: over the loaded foot, and from foot to foot in a rest."""
    offsets = [((foot.ankle - root) * aside).sum(axis=1) for foot in feet]
    over = 0.5 * (offsets[0] + offsets[1]) + 0.5 * load * (offsets[0] - offsets[1])
    # In sideways steps the body floats between the feet rather than over either.
    gain = 0.46 * mix(1.0, 0.6, pace.running)
    sway = smoothed(np.clip(gain * over, -0.07, 0.07), 5.0)
    shift = 0.030 * np.tanh(1.5 * chance.wander(len(root), 65.0))
    return sway + idle * (shift + 0.003 * chance.wander(len(root), 17.0))


def _rocking(frames: int, chance: Chance) -> Floats:
    """(F,) metres forward that a standing body drifts and rocks on its ankles."""
    return 0.008 * chance.wander(frames, 60.0) + 0.003 * chance.wander(frames, 18.0)


def _push(intent: Intent) -> Floats:
    """(F, 2) acceleration to the left and forward."""
    change = smoothed(np.gradient(intent.velocity, axis=0) * FPS, 6.0)
    sine, cosine = np.sin(intent.yaw), np.cos(intent.yaw)
    left = change[:, 0] * cosine - change[:, 1] * sine
    return np.stack([left, change[:, 0] * sine + change[:, 1] * cosine], axis=1)


def _pelvis(
    intent: Intent, pace: Rhythm, stride: Floats, lists: Floats, push: Floats, chance: Chance
) -> Floats:
    """(F, 4) in the world."""
    frames = len(stride)
    yaw = intent.yaw - mix(0.14, 0.13, pace.running) * stride
    yaw = yaw + 0.012 * chance.wander(frames, 50.0)
    pitch = 0.02 + 0.07 * pace.running + 0.22 * pace.crouch
    pitch = pitch + 0.35 * np.clip(push[:, 1] / GRAVITY, -0.3, 0.3)
    bank = -0.35 * np.clip(push[:, 0] / GRAVITY, -0.4, 0.4)
    return product(about(1, yaw), about(0, pitch), about(2, lists + bank))


def _overreach(place: Floats, rotation: Floats, feet: tuple[Track, Track]) -> Floats:
    """(F,) metres to lower the hips by, for the legs on the ground to reach it."""
    lower = np.zeros(len(place))
    # A few frames of the swing count as well: the leg leaves and arrives without a snap.
    bound = [widened(foot.down, NEAR) for foot in feet]
    for _ in range(3):
        lowered = place - lower[:, None] * np.array([0.0, 1.0, 0.0])
        excess = np.zeros(len(place))
        for foot, near in zip(feet, bound, strict=True):
            away = joint_places(lowered, rotation, foot.side) - foot.ankle
            flat = np.minimum(np.hypot(away[:, 0], away[:, 2]), 0.93 * STRAIGHT)
            most = np.sqrt(STRAIGHT**2 - flat**2)
            excess = np.maximum(excess, (away[:, 1] - most) * near)
        if excess.max() < 1e-4:
            break
        lower += smoothed(widened(excess, 4), 2.6)
    return lower


# -- jumps --------------------------------------------------------------------------------------


def _jumped(time: Floats, jumps: list[Jump]) -> tuple[Floats, Floats]:
    """Height (F,) that jumps off both feet add to the hips, and the phase of the jump (F,)."""
    height, phase = np.zeros(len(time)), np.zeros(len(time))
    for jump in jumps:
        rise, speed = 0.035, 0.5 * GRAVITY * jump.flight
        deep = -0.10 - 0.35 * jump.flight
        off, on = jump.start, jump.start + jump.flight
        keys = [
            (off - 0.75, 0.0, 0.0), (off - 0.27, deep, 0.0), (off, rise, speed),
            (on, rise, -speed), (on + 0.22, 0.8 * deep, 0.0), (on + 0.85, 0.0, 0.0),
        ]  # fmt: skip
        for (t0, h0, v0), (t1, h1, v1) in pairwise(keys):
            inside = slice(*np.searchsorted(time, [t0, t1]))
            share, seconds = (time[inside] - t0) / (t1 - t0), t1 - t0
            if t0 == off:
                since = time[inside] - t0
                height[inside] = rise + speed * since - 0.5 * GRAVITY * since**2
                continue
            height[inside] = hermite(
                share, seconds, np.array([h0]), np.array([h1]), np.array([v0]), np.array([v1])
            )[:, 0]
        phase += 1.1 * ease((time - off + 0.20) / 0.32) * (1.0 - ease((time - on + 0.12) / 0.45))
        phase -= ease((time - off + 0.70) / 0.40) * (1.0 - ease((time - off + 0.30) / 0.30))
    return height, phase
