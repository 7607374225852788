"""What a free run asks of a character: random commands, and steady ones to measure by."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

FPS = 60
# Metres a second between which random commands ask for a gait; with `auto` for all of them.
SPEEDS = {
    "walk": (0.6, 1.8),
    "jog": (2.2, 3.4),
    "run": (3.8, 5.0),
    "crouch": (0.5, 1.2),
    "auto": (0.6, 5.0),
}
# Of strafing: backward and sideways nobody is quick.
STRAFE_SPEEDS = (0.5, 1.2)
STRAFED = ("walk", "crouch")


@dataclass(frozen=True)
class Command:
    """One moment's wishes."""

    velocity: tuple[float, float]
    """x, z, metres a second."""
    gait: str = "walk"
    facing: tuple[float, float] | None = None
    """Direction (x, z) to face instead of the movement's."""

    @property
    def speed(self) -> float:
        """Metres a second."""
        return math.hypot(*self.velocity)


@dataclass(frozen=True)
class Steady:
    """A command that is held for long enough to be measured."""

    name: str
    gait: str = "walk"
    speed: float = 0.0
    """Metres a second."""
    aside: float = 0.0
    """Yaw in radians from the facing to the movement: half a turn is backward."""
    turn: float = 0.0
    """Radians a second, positive to the left."""

    def at(self, seconds: float, heading: float) -> Command:
        """The command at a moment, for a character that began by facing the yaw `heading`."""
        facing = heading + self.turn * seconds
        move = facing + self.aside
        velocity = (self.speed * math.sin(move), self.speed * math.cos(move))
        look = (math.sin(facing), math.cos(facing)) if self.aside else None
        return Command(velocity, self.gait, look)


QUARTER = math.pi / 2
CLASSES = (
    Steady("stand"),
    Steady("walk", "walk", 1.4),
    Steady("jog", "jog", 2.8),
    Steady("run", "run", 4.5),
    Steady("crouch", "crouch", 0.9),
    Steady("back", "walk", 1.0, aside=math.pi),
    Steady("left", "walk", 1.0, aside=QUARTER),
    Steady("right", "walk", 1.0, aside=-QUARTER),
    Steady("turn left", "walk", 1.2, turn=QUARTER),
    Steady("turn right", "walk", 1.2, turn=-QUARTER),
)


def classes_with(speeds: dict[str, float]) -> tuple[Steady, ...]:
    """The steady commands, some at speeds (metres a second) of one's own.

    Raises:
        ValueError: a name that no class has, or a speed that is none.
    """
    known = {steady.name for steady in CLASSES if steady.speed > 0.0}
    for name, speed in speeds.items():
        if name not in known:
            raise ValueError(f"no command is called '{name}'; known: {', '.join(sorted(known))}")
        if not 0.06 < speed <= 20.0:
            raise ValueError(f"{name}: expected a speed of 0.06 to 20 m/s, not {speed:g}")
    return tuple(replace(steady, speed=speeds.get(steady.name, steady.speed)) for steady in CLASSES)


def random_commands(seed: int, gaits: Sequence[str]) -> Iterator[Command]:
    """A player who never rests: a command a frame at 60 Hz, without end.

    Every 0.5 to 4 s something new: standing (one in seven), else a gait, a speed, a direction (any,
    or near the last one) and half of the time a steady turn of the stick of up to 2 rad/s; a third
    of the walks and crouches look elsewhere than they go. The same seed gives the same commands.
    """
    rng = np.random.default_rng(seed)
    heading = float(rng.uniform(-math.pi, math.pi))
    while True:
        frames = round(float(rng.uniform(0.5, 4.0)) * FPS)
        if rng.random() < 1 / 7:
            yield from (Command((0.0, 0.0)) for _ in range(frames))
            continue
        gait = str(rng.choice(list(gaits)))
        anew = rng.random() < 0.5
        heading = float(rng.uniform(-math.pi, math.pi) if anew else rng.normal(heading, 0.5))
        turn = float(rng.uniform(-2.0, 2.0)) if rng.random() < 0.5 else 0.0
        aside = 0.0
        low, high = SPEEDS[gait]
        if gait in STRAFED and rng.random() < 1 / 3:
            aside = float(rng.choice([math.pi, QUARTER, -QUARTER, rng.uniform(-math.pi, math.pi)]))
            low, high = STRAFE_SPEEDS
        steady = Steady("random", gait, float(rng.uniform(low, high)), aside, turn)
        yield from (steady.at(frame / FPS, heading - aside) for frame in range(frames))
        heading += turn * frames / FPS
