"""Where and when the feet come down: footprints along a known path.

A foot is planted where the body will be in the middle of its stance, beside the path by half the
width of the gait. That one rule walks forwards, backwards, sideways and round bends; in sideways
and turning steps the leading foot reaches out and the other closes up, so that they never cross.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ambulo.starter_motion.body import LEFT, RIGHT, SIGNS, TO_HEEL, TO_TIP, TO_TOE
from ambulo.starter_motion.gait import GRAVITY, Rhythm
from ambulo.starter_motion.ground import Ground
from ambulo.starter_motion.intent import FPS, Intent, Jump
from ambulo.starter_motion.noise import Chance
from ambulo.starter_motion.rotations import Floats, leftward

STAND_WIDTH, WALK_WIDTH, RUN_WIDTH, CLOSED = 0.105, 0.058, 0.042, 0.075  # half of each, metres
TOE_OUT = 0.12  # radians
FOREVER = 1e9
# A foot this far from where it would stand at rest takes a step, metres and radians.
SHORTEST_STANCE = 0.14  # seconds
ASTRAY, TWISTED = 0.06, 0.28


@dataclass(frozen=True)
class Print:
    """One foot on the ground, from `on` to `off` (seconds)."""

    side: int
    on: float
    off: float
    place: tuple[float, float, float]
    """The point of the ground below the ankle, metres."""
    yaw: float
    pitch: float
    """Slope of the ground along the foot, radians, toes up above 0."""
    roll: float
    """Slope of the ground across the foot, radians about its own Z axis."""
    land: float
    """Pitch of the foot against the ground as it comes down: toes up above 0, radians."""
    leave: float
    """Pitch of the foot as it leaves."""
    running: float
    bound: bool = False
    """Whether the foot leaves for a jump off both feet."""


class Planner:
    """Lays the footprints of one clip, one after the other."""

    def __init__(self, intent: Intent, pace: Rhythm, ground: Ground, chance: Chance) -> None:
        self.intent, self.pace, self.ground, self.chance = intent, pace, ground, chance
        self.end = float(intent.time[-1])
        self.counted = np.concatenate([[0.0], np.cumsum(pace.rate[:-1])]) / FPS
        self.prints: tuple[list[Print], list[Print]] = ([], [])
        self.jumps = list(intent.jumps)
        self.home = self._new_home()

    def plan(self) -> tuple[list[Print], list[Print]]:
        """Footprints of the left and the right foot, in order of time, over the whole clip."""
        for side in (LEFT, RIGHT):
            self.prints[side].append(self._stood(side, -1.0, 0.0))
        last, time, rested = self.chance.choice((LEFT, RIGHT)), 0.0, True
        while time < self.end:
            if self.jumps and time >= self.jumps[0].start - 1.1 and not self._running(time):
                time, rested = self._hop(time, self.jumps.pop(0)), True
                continue
            if self._moving(time):
                last, time = 1 - last, self._step(1 - last, time, rested)
                rested = False
            elif (side := self._astray(last, time)) is not None:
                last, time = side, self._gather(side, time)
            else:
                time, rested = self._rest(time), True
                last = self._first(last, time)
        return self.prints

    # -- deciding -------------------------------------------------------------------------------

    def _at(self, signal: Floats, time: float) -> float:
        return float(self.intent.at(signal, time))

    def _running(self, time: float) -> bool:
        return self._at(self.pace.running, time) > 0.5

    def _moving(self, time: float) -> bool:
        return max(self._at(self.pace.moving, time + d) for d in (0.0, 0.15)) > 0.0

    def _rest(self, time: float) -> float:
        """The next moment at which something has to be done."""
        frame = min(int(time * FPS), len(self.pace.moving) - 1)
        ahead = np.flatnonzero(self.pace.moving[frame:])
        wake = (frame + int(ahead[0])) / FPS - 0.15 if len(ahead) else self.end + 1.0
        if self.jumps:
            wake = min(wake, self.jumps[0].start - 1.0)
        fidget = time + self.chance.uniform(5.0, 16.0)
        if fidget < wake - 2.0:
            self.home = self._new_home()
            return fidget
        return max(wake, time + 1.0 / FPS)

    def _first(self, last: int, time: float) -> int:
        """The foot that did *not* step last, if it is the better one to start with."""
        soon = time + 0.5
        left = float(self.intent.at(self.intent.local, soon)[0])
        lean = left + 0.3 * self._at(self.intent.turn, soon)
        if abs(lean) > 0.1:
            return RIGHT if lean > 0.0 else LEFT
        return last

    def _new_home(self) -> tuple[float, float, float, float]:
        """A stance of one's own: how far the left foot is ahead, wider, and both turned out."""
        c = self.chance
        return c.about(0.035), c.about(0.015), c.about(0.07), c.about(0.07)

    def _resting(self, side: int, time: float) -> tuple[Floats, float]:
        """Where a foot stands at rest: x, z and yaw."""
        ahead, wider, out_left, out_right = self.home
        sign = SIGNS[side]
        yaw = self._at(self.intent.yaw, time)
        forward = np.array([np.sin(yaw), np.cos(yaw)])
        aside = leftward(yaw)[[0, 2]] * sign * (STAND_WIDTH + wider)
        place = np.asarray(self.intent.at(self.intent.place, time)) + aside
        out = out_left if side == LEFT else out_right
        return place + forward * ahead * sign, yaw + sign * (TOE_OUT + out)

    def _astray(self, last: int, time: float) -> int | None:
        """A foot that has to be brought home after a stop, the one that is due first."""
        for side in (1 - last, last):
            place, yaw = self._resting(side, time + 0.25)
            foot = self.prints[side][-1]
            distance = np.hypot(*(place - np.array(foot.place)[[0, 2]]))
            if distance > ASTRAY or abs(yaw - foot.yaw) > TWISTED:
                return side
        return None

    # -- stepping -------------------------------------------------------------------------------

    def _step(self, side: int, time: float, rested: bool) -> float:
        """The next step of a gait; gives the moment at which it lands."""
        rate = self._at(self.pace.rate, time)
        lands = self._lands(time, 1.0 + self.chance.about(0.018))
        if self.jumps and self._running(time) and time >= self.jumps[0].start:
            lands = time + 2.0 * self._at(self.pace.duty, time) / rate + self.jumps.pop(0).flight
        duty = self._at(self.pace.duty, lands)
        step = 1.0 / self._at(self.pace.rate, lands)
        foot = self.prints[side][-1]
        lift = lands - (1.0 - duty) * 2.0 * step
        # A walking foot leaves after the other one is down; out of a rest, the weight shifts first.
        earliest = time + (0.1 if rested else 0.03 - 0.4 * step * self._at(self.pace.running, lift))
        lift = self._early(side, max(lift, earliest, foot.on + 0.12))
        lands = max(lands, lift + 0.24)
        gone = self.intent.at(self.intent.place, lands) - np.array(foot.place)[[0, 2]]
        lands = max(lands, lift + 0.19 + 0.08 * float(np.hypot(*gone)))
        self._leave(side, lift)
        self._land(side, lands, step, duty)
        return lands

    def _lands(self, time: float, steps: float) -> float:
        """The moment at which so many more steps are done."""
        wanted = self._at(self.counted, time) + steps
        if wanted >= self.counted[-1]:
            return self.end + (wanted - float(self.counted[-1])) / float(self.pace.rate[-1])
        return float(np.interp(wanted, self.counted, self.intent.time))

    def _early(self, side: int, lift: float) -> float:
        """An earlier moment to leave the ground, where the foot would be out of reach by then."""
        foot = self.prints[side][-1]
        reach = 0.56 + 0.16 * self._at(self.pace.running, lift)
        spot = np.array(foot.place)[[0, 2]]
        while lift > foot.on + SHORTEST_STANCE:
            if np.hypot(*(self.intent.at(self.intent.place, lift) - spot)) < reach:
                break
            lift -= 1.0 / FPS
        return lift

    def _leave(self, side: int, lift: float) -> None:
        """Sets when and how the foot leaves its last print."""
        foot = self.prints[side][-1]
        ahead = self._at(self.pace.ahead, lift)
        speed = self._at(self.pace.speed, lift)
        running = self._at(self.pace.running, lift)
        crouch = self._at(self.pace.crouch, lift)
        brisk = min(speed / 1.4, 1.3)
        forwards = -(0.45 + 0.62 * min(brisk, 1.0) + 0.10 * running) * (1.0 - 0.35 * crouch)
        leave = forwards * max(ahead, 0.0) + 0.16 * max(-ahead, 0.0)
        leave += -0.38 * (1.0 - abs(ahead))
        self.prints[side][-1] = replace(foot, off=lift, leave=leave * self._vary(0.06))

    def _land(self, side: int, time: float, step: float, duty: float) -> None:
        """Puts a print where the body will be in the middle of its stance."""
        ahead, speed = self._at(self.pace.ahead, time), self._at(self.pace.speed, time)
        running = self._at(self.pace.running, time)
        share = (0.58 - 0.02 * duty) * (1.0 - abs(ahead)) + abs(ahead) * (0.50 - 0.06 * ahead)
        share = share * (1.0 - running) + 0.62 * duty * running
        middle = time + share * step
        width, lead = self._width(side, middle, step, running)
        sign = SIGNS[side]
        yaw = self._at(self.intent.yaw, middle)
        aside = leftward(yaw)[[0, 2]]
        place = np.asarray(self.intent.at(self.intent.place, middle)) + sign * width * aside
        place = place + self._banked(middle)
        home, home_yaw = self._resting(side, middle)
        calm = 1.0 - min(self._at(self.pace.speed, middle) / 0.35, 1.0)
        calm *= 1.0 - min(abs(self._at(self.intent.turn, middle)) / 0.6, 1.0)
        place = place + calm * (home - place)
        place = place + np.array([self.chance.about(0.008), self.chance.about(0.008)])
        turned = yaw + sign * TOE_OUT * (1.0 - 0.6 * running) + lead + self.chance.about(0.03)
        turned += calm * (home_yaw - turned)
        place = self._apart(side, place, yaw)
        place = self._within(place, time + SHORTEST_STANCE, 0.56 + 0.12 * running)
        place = self._within(place, time, 0.44 + 0.08 * running)
        land = self._landing(ahead, speed, running, time) * self._vary(0.06)
        self._put(side, time, place, turned, land, running)

    def _landing(self, ahead: float, speed: float, running: float, time: float) -> float:
        """Pitch of the foot at touch-down: heel first forwards, ball first backwards."""
        crouch = self._at(self.pace.crouch, time)
        walking = (0.08 + 0.20 * min(speed / 1.4, 1.2)) * (1.0 - 0.6 * crouch)
        forwards = walking * (1.0 - running) + (0.16 - 0.03 * (speed - 2.0)) * running
        return forwards * max(ahead, 0.0) - 0.34 * max(-ahead, 0.0) - 0.12 * (1.0 - abs(ahead))

    def _width(self, side: int, time: float, step: float, running: float) -> tuple[float, float]:
        """Half the width of the gait there, and how far the foot is turned beyond the body."""
        sideways = abs(float(self.intent.at(self.intent.local, time)[0]))
        turn = self._at(self.intent.turn, time)
        narrow = WALK_WIDTH * (1.0 - running) + RUN_WIDTH * running
        narrow += 0.03 * self._at(self.pace.crouch, time)
        closed = max(narrow, CLOSED * min(sideways / 0.3, 1.0))
        width = (
            closed + 0.5 * min(sideways, 1.4) * step * (1.0 - running) + self.chance.about(0.006)
        )
        width += 0.03 * min(abs(turn) / 2.0, 1.0) * (1.0 - running)
        leads = 1.0 if SIGNS[side] * turn > 0.0 else -1.0
        slow = 1.0 - min(self._at(self.pace.speed, time) / 1.5, 1.0)
        return width, 0.5 * leads * turn * step * slow

    def _banked(self, time: float) -> Floats:
        """(2,) how far the feet are put away from below the hips: towards where forces push.

        Half of what a rigid body would need; the trunk leans for the rest.
        """
        h = 0.12
        change = self.intent.at(self.intent.velocity, time + h) - self.intent.at(
            self.intent.velocity, time - h
        )
        shift = -0.42 * np.asarray(change) / (2.0 * h) / GRAVITY
        length = float(np.hypot(*shift))
        return shift * min(1.0, 0.13 / max(length, 1e-9))

    def _within(self, place: Floats, time: float, reach: float) -> Floats:
        """A print no farther from below the body at `time` than the leg can reach."""
        below = np.asarray(self.intent.at(self.intent.place, time))
        far = float(np.hypot(*(place - below)))
        return below + (place - below) * min(1.0, reach / max(far, 1e-9))

    def _apart(self, side: int, place: Floats, yaw: float) -> Floats:
        """Moves a print aside where it would come too near to the other foot, or across it."""
        other = np.array(self.prints[1 - side][-1].place)[[0, 2]]
        aside = leftward(yaw)[[0, 2]] * SIGNS[side]
        forward = np.array([np.sin(yaw), np.cos(yaw)])
        away = place - other
        near = max(1.0 - abs(float(away @ forward)) / 0.6, 0.0)
        lacking = 0.135 * near - float(away @ aside)
        return place + max(lacking, 0.0) * near**0.5 * aside

    def _gather(self, side: int, time: float) -> float:
        """One calm step that brings a foot home after a stop."""
        lift = max(time + 0.12, self.prints[side][-1].on + 0.3)
        lands = lift + 0.42 * self._vary(0.08)
        foot = self.prints[side][-1]
        self.prints[side][-1] = replace(foot, off=lift, leave=-0.42 * self._vary(0.1))
        place, yaw = self._resting(side, lands)
        self._put(side, lands, place, yaw, -0.05, 0.0)
        return lands

    def _hop(self, time: float, jump: Jump) -> float:
        """A jump off both feet, onto both feet."""
        start = max(jump.start, time + 0.6)
        lands = start + jump.flight
        for side in (LEFT, RIGHT):
            foot = self.prints[side][-1]
            self.prints[side][-1] = replace(foot, off=start, leave=-1.0, bound=True)
        for side in (LEFT, RIGHT):
            place, yaw = self._resting(side, lands + 0.1)
            self._put(side, lands + 0.008 * side, place, yaw, -0.42, 0.0)
        return lands + 0.35

    def _put(
        self, side: int, time: float, place: Floats, yaw: float, land: float, running: float
    ) -> None:
        x, z, height, pitch, roll = self._level(place, yaw)
        place3 = (float(x), float(height), float(z))
        self.prints[side].append(
            Print(side, time, FOREVER, place3, yaw, pitch, roll, land, -0.5, running)
        )

    def _stood(self, side: int, time: float, running: float) -> Print:
        place, yaw = self._resting(side, time)
        self._put(side, time, place, yaw, 0.0, running)
        return self.prints[side].pop()

    def _vary(self, spread: float) -> float:
        return 1.0 + self.chance.about(spread)

    # -- ground ---------------------------------------------------------------------------------

    def _level(self, place: Floats, yaw: float) -> tuple[float, float, float, float, float]:
        """The best spot near `place` for a whole sole: x, z, height, pitch and roll of the ground.

        On a slope that is the place itself; on stairs the foot moves back or forth until heel and
        ball are on one tread.
        """
        forward = np.array([np.sin(yaw), np.cos(yaw)])
        aside = np.array([np.cos(yaw), -np.sin(yaw)])
        shifts = np.linspace(-0.21, 0.21, 29)
        spots = place + shifts[:, None] * forward
        along = np.array([TO_HEEL[2] - 0.045, 0.05, TO_TOE[2], TO_TOE[2] + TO_TIP[2] + 0.015])
        points = spots[:, None] + along[:, None] * forward
        heights = self.ground.height(points[..., 0], points[..., 1])
        pitch = np.arctan2(heights[:, 2] - heights[:, 0], along[2] - along[0])
        line = heights[:, :1] + np.tan(pitch)[:, None] * (along - along[0])
        rough = np.abs(heights - line).max(axis=1) + 0.15 * np.abs(pitch)
        best = int(np.argmin(np.maximum(rough, 0.012) + 0.02 * np.abs(shifts)))
        spot = spots[best]
        sides = spot + np.array([[0.05], [-0.05]]) * aside
        tilt = self.ground.height(sides[:, 0], sides[:, 1])
        roll = float(np.arctan2(tilt[0] - tilt[1], 0.1))
        base = float(heights[best, 0] - np.tan(pitch[best]) * along[0])
        return (
            float(spot[0]),
            float(spot[1]),
            base,
            float(pitch[best]),
            float(np.clip(roll, -0.3, 0.3)),
        )
