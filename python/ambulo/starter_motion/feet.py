"""The feet frame by frame: rolling over their prints, swinging from one to the next.

On the ground a foot turns about its heel until it is flat, lies still, and turns about the toe
joint until it leaves (the three rockers of Perry 1992); the toes stay on the ground all the while.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ambulo.starter_motion.body import ANKLE, SIGNS, TO_HEEL, TO_TIP, TO_TOE
from ambulo.starter_motion.footsteps import Print
from ambulo.starter_motion.gait import GRAVITY, Rhythm
from ambulo.starter_motion.ground import Ground
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

TINY = 1e-4  # seconds, for velocities
CLEARANCE = 0.022


@dataclass
class Track:
    """One foot over F frames."""

    side: int
    ankle: Floats
    """(F, 3) metres."""
    yaw: Floats
    slope: Floats
    """(F, 2) pitch and roll of the ground below it, radians."""
    pitch: Floats
    """(F,) against the ground, toes up above 0."""
    flex: Floats
    """(F,) of the toes against the foot, up above 0."""
    down: Floats
    """(F,) 1 while any part is on the ground."""
    height: Floats
    """(F,) of the ground below the foot, blended during a swing."""

    @property
    def rotation(self) -> Floats:
        """(F, 4) of the foot in the world."""
        return _turned(self.yaw, self.slope, self.pitch)

    @property
    def contacts(self) -> Floats:
        """(F, 2) whether heel and toe are on the ground."""
        on = self.down > 0.5
        return np.stack([on & (self.pitch > -0.008), on & (self.pitch < 0.008)], axis=1).astype(
            float
        )


def _turned(yaw: Floats, slope: Floats, pitch: Floats) -> Floats:
    ground = product(about(1, yaw), about(0, -slope[..., 0]), about(2, slope[..., 1]))
    return product(ground, about(0, -pitch))


def track(
    side: int, prints: list[Print], others: list[Print], pace: Rhythm, ground: Ground, time: Floats
) -> Track:
    """The foot that leaves these prints, among those of the other foot."""
    frames = len(time)
    foot = Track(
        side,
        np.zeros((frames, 3)),
        np.zeros(frames),
        np.zeros((frames, 2)),
        np.zeros(frames),
        np.zeros(frames),
        np.zeros(frames),
        np.zeros(frames),
    )
    for index, here in enumerate(prints):
        on = slice(*np.searchsorted(time, [here.on, here.off]))
        if on.stop > on.start:
            _stand(foot, on, here, time[on])
        if index + 1 < len(prints):
            there = prints[index + 1]
            up = slice(*np.searchsorted(time, [here.off, there.on]))
            if up.stop > up.start:
                _swing(foot, up, here, there, time[up], pace)
                _avoid(foot, up, others, time[up])
                _clear(foot, up, ground, time[up], here.off, there.on)
    return foot


# -- on the ground ----------------------------------------------------------------------------


def _rolled(here: Print, time: Floats) -> tuple[Floats, Floats]:
    """Ankle (F, 3) and pitch (F,) of a foot on its print."""
    stance = here.off - here.on
    settle, rise = min(0.2 * stance, 0.11), min(0.52 * stance, 0.34)
    if here.bound:
        rise = min(rise, 0.20)
    landing = 1.0 - ease((time - here.on) / settle)
    leaving = np.clip((time - here.off + rise) / rise, 0.0, None) ** 2.4
    pitch = here.land * landing + here.leave * leaving
    yaw = np.full(len(time), here.yaw)
    slope = np.broadcast_to(np.array([here.pitch, here.roll]), (len(time), 2))
    flat, turned = _turned(yaw, slope, np.zeros(len(time))), _turned(yaw, slope, pitch)
    ankle = np.array(here.place) + rotated(flat, np.array([0.0, ANKLE, 0.0]))
    pivot = np.where(pitch[:, None] > 0.0, TO_HEEL, TO_TOE)
    return ankle + rotated(flat, pivot) - rotated(turned, pivot), pitch


def _stand(foot: Track, on: slice, here: Print, time: Floats) -> None:
    foot.ankle[on], foot.pitch[on] = _rolled(here, time)
    foot.yaw[on] = here.yaw
    foot.slope[on] = here.pitch, here.roll
    foot.flex[on] = np.maximum(-foot.pitch[on], 0.0)
    foot.down[on] = 1.0
    foot.height[on] = here.place[1]


# -- in the air -------------------------------------------------------------------------------


def _swing(foot: Track, up: slice, here: Print, there: Print, time: Floats, pace: Rhythm) -> None:
    """From the pose on one print to that on the next, without a jerk at either end."""
    seconds = there.on - here.off
    share = (time - here.off) / seconds
    off, on = np.array([here.off - TINY, here.off]), np.array([there.on, there.on + TINY])
    (a, pitch_a), (b, pitch_b) = _rolled(here, off), _rolled(there, on)
    v0, v1 = (a[1] - a[0]) / TINY, (b[1] - b[0]) / TINY
    v1 = v1 + _arrival(here, there, pace, up)
    if here.bound:
        v0[1], v1[1] = 0.5 * GRAVITY * seconds, -0.5 * GRAVITY * seconds
    foot.ankle[up] = hermite(share, seconds, a[1], b[0], v0, v1)
    foot.ankle[up] -= _late(share)[:, None] * (b[0] - a[1]) * np.array([1.0, 0.0, 1.0])
    foot.ankle[up, 1] += _lift(share, here, pace, up)
    turns = np.array([[pitch_a[1], max(-pitch_a[1], 0.0)], [pitch_b[0], max(-pitch_b[0], 0.0)]])
    rate = (pitch_a[1] - pitch_a[0]) / TINY
    v0, v1 = np.array([rate, -0.4 * rate]), np.zeros(2)
    # The foot is held ready well before it comes down.
    ready = 0.8
    turned = hermite(np.minimum(share / ready, 1.0), ready * seconds, turns[0], turns[1], v0, v1)
    foot.pitch[up], foot.flex[up] = turned.T
    foot.flex[up] += 0.12 * 16.0 * (share * (1.0 - share)) ** 2
    even = ease(share)
    foot.yaw[up] = mix(here.yaw, there.yaw, even)
    foot.slope[up, 0] = mix(here.pitch, there.pitch, even)
    foot.slope[up, 1] = mix(here.roll, there.roll, even)
    foot.height[up] = mix(here.place[1], there.place[1], even)


def _arrival(here: Print, there: Print, pace: Rhythm, up: slice) -> Floats:
    """(3,) velocity that a foot still has when it touches the ground, m/s.

    A heel strikes at some 0.4 m/s in a walk (Winter 1992), faster in a run.
    """
    way = np.subtract(there.place, here.place) * np.array([1.0, 0.0, 1.0])
    speed = float(pace.speed[up.stop - 1]) * mix(0.16, 0.24, there.running)
    down = np.array(
        [0.0, mix(0.10, 0.45, there.running) + 0.06 * float(pace.speed[up.stop - 1]), 0]
    )
    return way / max(float(np.linalg.norm(way)), 0.3) * speed - down


def _late(share: Floats) -> Floats:
    """What a swing that brakes only at its end is behind one of least jerk, share of the way."""
    return 2.4 * share**3 * (1.0 - share) ** 2


def _lift(share: Floats, here: Print, pace: Rhythm, up: slice) -> Floats:
    """How much higher than the passage from pose to pose the ankle swings, metres.

    In a run the heel is folded up towards the seat, the more the faster.
    """
    middle = (up.start + up.stop) // 2
    running, speed = float(pace.running[middle]), float(pace.speed[middle])
    walk = 0.022 + 0.03 * (1.0 - abs(float(pace.ahead[middle]))) + 0.02 * float(pace.crouch[middle])
    run = 0.02 + 0.052 * min(speed, 5.0)
    early = share**1.6 * (1.0 - share) ** 2.4 / (0.4**1.6 * 0.6**2.4)
    return mix(walk, run, running) * early


def _avoid(foot: Track, up: slice, others: list[Print], time: Floats) -> None:
    """Bends the swing outwards round the other foot, where that one stands in the way."""
    for other in others:
        if other.off <= time[0] or other.on >= time[-1]:
            continue
        middle = len(time) // 2
        yaw = foot.yaw[up][middle]
        aside = leftward(yaw) * SIGNS[foot.side]
        away = foot.ankle[up] - np.array(other.place)
        room = 0.105 * np.clip(1.5 - np.abs(away @ heading(yaw)) / 0.2, 0.0, 1.0)
        share = np.linspace(0.0, 1.0, len(time) + 2)[1:-1]
        shape = 16.0 * (share * (1.0 - share)) ** 2
        lacking = np.where(shape > 0.4, (room - away @ aside) / np.maximum(shape, 0.4), 0.0)
        outward = float(np.clip(lacking.max(), 0.0, 0.14))
        foot.ankle[up] += outward * shape[:, None] * aside


def _clear(foot: Track, up: slice, ground: Ground, time: Floats, off: float, on: float) -> None:
    """Lifts the swing where heel, ball or toes would scrape along the ground."""
    share = (time - off) / (on - off)
    need = CLEARANCE * np.clip(16.0 * (share * (1.0 - share)) ** 2 * 1.4, 0.0, 1.0)
    lacking = np.maximum(need - sole_heights(foot, up, ground).min(axis=1), 0.0)
    if not lacking.any():
        return
    span = max(len(time) // 12, 1)
    padded = np.pad(lacking, 6 * span)
    raise_ = smoothed(widened(padded, 3 * span), 1.5 * span)[6 * span : -6 * span]
    ends = ease(np.minimum(share, 1.0 - share) / 0.15)
    foot.ankle[up, 1] += raise_ * ends


def sole_heights(foot: Track, frames: slice, ground: Ground) -> Floats:
    """(F, 3) of heel, ball and tip of the toes above the ground, metres."""
    ankle, turned = foot.ankle[frames], foot.rotation[frames]
    toe = ankle + rotated(turned, TO_TOE)
    toes = product(turned, about(0, -foot.flex[frames]))
    below = np.array([0.0, TO_TIP[1], 0.0])
    points = np.stack(
        [ankle + rotated(turned, TO_HEEL), toe + rotated(toes, below), toe + rotated(toes, TO_TIP)],
        axis=1,
    )
    return points[..., 1] - ground.height(points[..., 0], points[..., 2])
