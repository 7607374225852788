"""What is wanted of the person, as a player would ask for it, and the smooth path that follows.

A script is a list of wishes, each with its facing, direction and speed; every change of a wish
blends in over a time that grows with the change, so that accelerations stay a person's.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ambulo import _core
from ambulo.starter_motion.rotations import Floats, ease, mix

FPS = 60.0
GAITS = tuple(_core.dataset_categories())
"""Names of the labels: categories of a data set."""

RUNS = ("jog", "run")
# Seconds that a change takes, at once and for each m/s or radian of it. A start to 1.4 m/s takes
# two steps (Breniere & Do 1986), about 0.8 s here; 4.5 m/s take 1.7 s, with a peak of 5 m/s2.
SPEED_CHANGE = (0.40, 0.28)
TURN_CHANGE = (0.45, 0.35)
TURN_RATE_CHANGE = 0.2
GAIT_CHANGE = 0.6


@dataclass(frozen=True)
class Wish:
    """What is wanted for `seconds`."""

    seconds: float
    gait: str = "walk"
    """stand, walk, jog, run or crouch; the direction makes it backward or sideways."""
    speed: float = 0.0
    """Metres a second."""
    bend: float = 0.0
    """Radians that the facing changes by at once, to the left."""
    turn: float = 0.0
    """Radians a second that the facing goes on turning, to the left."""
    side: float = 0.0
    """Direction of travel from the facing, radians to the left; pi is backwards."""
    jump: float = 0.0
    """Seconds in the air of a jump half-way through the wish; 0 for none."""


@dataclass(frozen=True)
class Jump:
    """A jump off both feet, or a leap off one while running."""

    start: float
    """Seconds at which the feet leave the ground (a leap: from which on the next step is one)."""
    flight: float
    """Seconds in the air."""


@dataclass(frozen=True)
class Intent:
    """The path of the person over the ground, frame by frame (F)."""

    time: Floats
    place: Floats
    """(F, 2) x, z in metres."""
    velocity: Floats
    """(F, 2) world, m/s."""
    yaw: Floats
    """(F,) facing, radians, without jumps of a full turn."""
    turn: Floats
    """(F,) rad/s."""
    running: Floats
    """(F,) 0 walking, 1 jogging or running."""
    crouch: Floats
    """(F,) 0 upright, 1 low."""
    jumps: tuple[Jump, ...] = field(default=())

    @property
    def speed(self) -> Floats:
        """(F,) m/s."""
        return np.hypot(self.velocity[:, 0], self.velocity[:, 1])

    @property
    def local(self) -> Floats:
        """(F, 2) velocity to the left and forward of the facing, m/s."""
        sine, cosine = np.sin(self.yaw), np.cos(self.yaw)
        x, z = self.velocity.T
        return np.stack([x * cosine - z * sine, x * sine + z * cosine], axis=1)

    def at(self, signal: Floats, time: float) -> Floats:
        """A signal (F,) or (F, n) at any time; the ends are held."""
        position = min(max(time * FPS, 0.0), len(signal) - 1.0)
        low = min(int(position), len(signal) - 2)
        return mix(signal[low], signal[low + 1], position - low)


def follow(wishes: list[Wish]) -> Intent:
    """The path that these wishes make, from the origin, facing +Z."""
    starts = np.concatenate([[0.0], np.cumsum([wish.seconds for wish in wishes])])
    path = _Path(np.arange(round(starts[-1] * FPS)) / FPS)
    for wish, start in zip(wishes, starts[:-1].tolist(), strict=True):
        path.add(wish, start)
    return path.intent()


class _Path:
    """The sum of the changes from wish to wish, each eased in; they may overlap."""

    def __init__(self, time: Floats) -> None:
        self.time = time
        self.velocity, self.yaw = np.zeros((len(time), 2)), np.zeros(len(time))
        self.running, self.crouch = np.zeros(len(time)), np.zeros(len(time))
        self.jumps: list[Jump] = []
        self.facing, self.before = 0.0, Wish(0.0, "stand")
        self.old_velocity, self.old_yaw = self.velocity.copy(), self.yaw.copy()

    def add(self, wish: Wish, start: float) -> None:
        """Goes over to this wish from `start` on."""
        since, before = self.time - start, self.before
        self.facing += wish.bend + before.turn * before.seconds
        yaw = self.facing + wish.turn * since
        way = yaw + wish.side
        velocity = wish.speed * np.stack([np.sin(way), np.cos(way)], axis=1)
        frame = min(round(start * FPS), len(since) - 1)
        change = float(np.linalg.norm(velocity[frame] - self.old_velocity[frame]))
        speeding, turning = _durations(wish, before, change)
        # The shorter turn sits in the middle of the change of speed: braking, turning, going on.
        late = max(0.5 * (speeding - turning), 0.0)
        self.velocity += _ramp(since, speeding, start)[:, None] * (velocity - self.old_velocity)
        self.yaw += _ramp(since - late, turning, start) * (yaw - self.old_yaw)
        shift = _ramp(since, GAIT_CHANGE, start)
        self.running += shift * (float(wish.gait in RUNS) - float(before.gait in RUNS))
        self.crouch += shift * (float(wish.gait == "crouch") - float(before.gait == "crouch"))
        if wish.jump > 0.0:
            self.jumps.append(Jump(start + 0.5 * (wish.seconds - wish.jump), wish.jump))
        self.before, self.old_velocity, self.old_yaw = wish, velocity, yaw

    def intent(self) -> Intent:
        """All of it, with the place that the velocity leads to."""
        speed = np.hypot(*self.velocity.T)
        # Nobody runs at a crawl, or walks or creeps faster than a walk can be.
        running = np.clip(self.running, 0.0, 1.0) * ease((speed - 1.1) / 0.9)
        running = np.maximum(running, ease((speed - 2.15) / 0.6))
        crouch = self.crouch * (1.0 - ease((speed - 1.4) / 1.2))
        place = np.cumsum(self.velocity, axis=0) / FPS
        turn = np.gradient(self.yaw) * FPS
        return Intent(
            self.time, place - place[0], self.velocity, self.yaw, turn, running, crouch,
            tuple(self.jumps),
        )  # fmt: skip


def _durations(wish: Wish, before: Wish, change: float) -> tuple[float, float]:
    """Seconds that a change of speed by `change` m/s and a turn of the facing take."""
    veers = TURN_CHANGE[0] + TURN_RATE_CHANGE * abs(wish.turn - before.turn)
    speeding = SPEED_CHANGE[0] + SPEED_CHANGE[1] * change
    turning = TURN_CHANGE[0] + TURN_CHANGE[1] * abs(wish.bend)
    return max(speeding, veers), max(turning, veers)


def _ramp(since: Floats, takes: float, start: float) -> Floats:
    """0 before a change, 1 after it; a clip begins in the middle of its first wish."""
    return ease(since / takes) if start > 0.0 else np.ones_like(since)
