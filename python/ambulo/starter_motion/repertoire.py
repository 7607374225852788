"""What is performed: short studies of one gait each, and long mixed clips like a player's."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from ambulo.starter_motion.ground import Ground, Level, Slopes, Stairs
from ambulo.starter_motion.intent import Wish
from ambulo.starter_motion.noise import Chance
from ambulo.starter_motion.perform import LEAD, StarterClip, perform

MINUTES = 18.0
MIXED_SECONDS = 60.0
SHORTEST = 6.0
PI = float(np.pi)


@dataclass(frozen=True)
class Study:
    """A kind of clip: how many, how long, what is done, on what."""

    name: str
    count: int
    seconds: float
    wishes: Callable[[Chance], Iterator[Wish]]
    ground: Callable[[Chance], Ground] = lambda _: Level()


@dataclass(frozen=True)
class Planned:
    """A clip to be made."""

    name: str
    seconds: float
    study: Study


def clips(seed: int = 0, minutes: float = MINUTES) -> Iterator[StarterClip]:
    """The starter motion, clip by clip: the same for the same seed and length.

    About two fifths are studies (one gait or change each), the rest mixed clips of a minute.
    `minutes` is the total; each study takes at least six seconds, so that below some four minutes
    it comes out longer.
    """
    if not minutes > 0.0 or not np.isfinite(minutes):
        raise ValueError(f"the minutes of starter motion must be above 0, not {minutes}")
    if seed < 0:
        raise ValueError(f"the seed of the starter motion must be 0 or more, not {seed}")
    for index, entry in enumerate(plan(minutes)):
        chance = Chance(seed, index, 1)
        ground = entry.study.ground(chance)
        wishes = _fitted(entry.study.wishes(chance), entry.seconds + 2.0 * LEAD)
        yield perform(entry.name, wishes, ground, seed, index, 2)


def plan(minutes: float = MINUTES) -> list[Planned]:
    """Every clip that `clips` makes of so many minutes."""
    scale = min(minutes / MINUTES, 1.5)
    planned: list[Planned] = []
    for study in STUDIES:
        seconds = max(study.seconds * scale, SHORTEST)
        planned += [Planned(f"{study.name}_{n:02}", seconds, study) for n in range(study.count)]
    left = minutes * 60.0 - sum(entry.seconds for entry in planned)
    count = max(round(left / MIXED_SECONDS), 1)
    length = min(max(left / count, SHORTEST), 1.5 * MIXED_SECONDS)
    for n in range(count):
        kind = MIXED[n % len(MIXED)]
        number = sum(entry.study is kind for entry in planned)
        planned.append(Planned(f"{kind.name}_{number:02}", length, kind))
    return planned


def _fitted(wishes: Iterator[Wish], seconds: float) -> list[Wish]:
    """As many wishes as fill the time, the last one cut."""
    taken: list[Wish] = []
    left = seconds
    for wish in wishes:
        taken.append(replace(wish, seconds=min(wish.seconds, left)))
        left -= wish.seconds
        if left <= 1e-6:
            return taken
    return [*taken, Wish(left, "stand")]


# -- studies --------------------------------------------------------------------------------------


def _steady(
    gait: str, low: float, high: float, bend: float, side: float = 0.0
) -> Callable[[Chance], Iterator[Wish]]:
    """One gait at slowly changing speeds, straight (`bend` 0) or on curves up to `bend` rad/s."""

    def wishes(chance: Chance) -> Iterator[Wish]:
        way = chance.choice((-1.0, 1.0))
        while True:
            turn = way * chance.uniform(0.35, 1.0) * bend
            yield Wish(
                chance.uniform(2.5, 5.0), gait, chance.uniform(low, high), turn=turn, side=side
            )
            way = -way if chance.happens(0.6) else way

    return wishes


def _stand(chance: Chance) -> Iterator[Wish]:
    while True:
        yield Wish(chance.uniform(20.0, 30.0), "stand")


def _crouch_idle(chance: Chance) -> Iterator[Wish]:
    while True:
        yield Wish(chance.uniform(4.0, 8.0), "crouch")
        yield Wish(chance.uniform(1.5, 3.0), "crouch", chance.uniform(0.4, 0.9))
        yield Wish(chance.uniform(3.0, 6.0), "crouch")
        yield Wish(chance.uniform(2.0, 4.0), "stand")


def _diagonal(chance: Chance) -> Iterator[Wish]:
    while True:
        side = chance.choice((0.25, -0.25, 0.75, -0.75)) * PI
        yield Wish(chance.uniform(2.5, 4.0), "walk", chance.uniform(0.5, 1.1), side=side)
        yield Wish(chance.uniform(0.8, 1.6), "stand")


def _on_the_spot(chance: Chance) -> Iterator[Wish]:
    way = chance.choice((-1.0, 1.0))
    while True:
        if chance.happens(0.5):
            yield Wish(chance.uniform(1.2, 3.0), "walk", turn=way * chance.uniform(0.7, 2.1))
            yield Wish(chance.uniform(0.8, 2.0), "stand")
        else:
            angle = way * chance.choice((0.25, 0.5, 0.5, 0.75, 1.0)) * PI
            rate = chance.uniform(1.4, 2.4)
            yield Wish(abs(angle) / rate, "walk", turn=float(np.sign(angle)) * rate)
            yield Wish(chance.uniform(1.0, 2.5), "stand")
        way = -way if chance.happens(0.7) else way


def _start_stop(chance: Chance) -> Iterator[Wish]:
    while True:
        gait, speed = chance.choice(
            (("walk", 0.7), ("walk", 1.1), ("walk", 1.4), ("walk", 1.7), ("jog", 2.5), ("run", 3.8))
        )
        yield Wish(chance.uniform(0.8, 2.0), "stand")
        yield Wish(chance.uniform(1.6, 3.2), gait, speed * chance.uniform(0.92, 1.08))


def _transitions(chance: Chance) -> Iterator[Wish]:
    ladder = (("stand", 0.0), ("walk", 0.8), ("walk", 1.4), ("jog", 2.5), ("run", 4.0))
    rung = 0
    while True:
        others = [i for i in range(len(ladder)) if i != rung]
        near = [2.0 if abs(i - rung) == 1 else 1.0 for i in others]
        rung = chance.choice(others, near)
        gait, speed = ladder[rung]
        yield Wish(chance.uniform(1.6, 3.4), gait, speed * chance.uniform(0.9, 1.15))


def _reversals(chance: Chance) -> Iterator[Wish]:
    while True:
        gait, speed = chance.choice((("walk", 1.0), ("walk", 1.5), ("jog", 2.4), ("run", 3.6)))
        yield Wish(chance.uniform(1.8, 3.2), gait, speed)
        bend = chance.choice((-1.0, 1.0)) * chance.uniform(0.8, 1.0) * PI
        yield Wish(chance.uniform(1.8, 3.2), gait, speed, bend=bend)


def _sharp_turns(gait: str, low: float, high: float) -> Callable[[Chance], Iterator[Wish]]:
    """Straight on, then off another way at once: braked, turned, sped up again; both sides."""

    def wishes(chance: Chance) -> Iterator[Wish]:
        while True:
            speed = chance.uniform(low, high)
            bend = chance.choice((-1.0, 1.0)) * chance.uniform(0.25, 1.0) * PI
            yield Wish(chance.uniform(1.7, 2.8), gait, speed, bend=bend)

    return wishes


def _back_and_forth(chance: Chance) -> Iterator[Wish]:
    """Forward, back and sideways with the facing kept: as when aiming."""
    while True:
        side = chance.choice((0.0, 0.5, -0.5, 1.0)) * PI
        yield Wish(chance.uniform(1.2, 2.6), "walk", chance.uniform(0.5, 1.15), side=side)
        if chance.happens(0.35):
            yield Wish(chance.uniform(0.6, 1.5), "stand")


def _jumps(chance: Chance) -> Iterator[Wish]:
    while True:
        yield Wish(chance.uniform(0.6, 1.5), "stand")
        yield Wish(2.2, "stand", jump=chance.uniform(0.28, 0.46))


def _leaps(chance: Chance) -> Iterator[Wish]:
    while True:
        gait, speed = chance.choice((("jog", 2.8), ("run", 3.6), ("run", 4.2)))
        yield Wish(chance.uniform(1.5, 2.5), gait, speed)
        yield Wish(2.0, gait, speed, jump=chance.uniform(0.30, 0.45))


def _straight_on(chance: Chance) -> Iterator[Wish]:
    """Up and down the stairs, straight ahead, with rests."""
    while True:
        yield Wish(chance.uniform(5.0, 9.0), "walk", chance.uniform(0.6, 1.0))
        if chance.happens(0.3):
            yield Wish(chance.uniform(0.8, 1.5), "stand")


def _rambling(chance: Chance) -> Iterator[Wish]:
    while True:
        gait, speed = chance.choice(
            (("walk", 1.2), ("walk", 0.8), ("walk", 1.5), ("jog", 2.4), ("stand", 0.0)),
            (3.0, 2.0, 2.0, 1.5, 0.6),
        )
        turn = chance.uniform(-0.8, 0.8) if speed else 0.0
        yield Wish(chance.uniform(1.5, 4.0), gait, speed * chance.uniform(0.85, 1.15), turn=turn)


# -- like a player --------------------------------------------------------------------------------

_PLAYED = (("stand", 0.14), ("walk", 0.30), ("jog", 0.20), ("run", 0.11), ("crouch", 0.08),
           ("aim", 0.17))  # fmt: skip


def _played(chance: Chance) -> Iterator[Wish]:
    """Somebody with a stick: new directions and speeds every second or two, sometimes aiming."""
    yield Wish(chance.uniform(2.0, 3.0), "stand")
    kinds, shares = [kind for kind, _ in _PLAYED], [share for _, share in _PLAYED]
    while True:
        kind = chance.choice(kinds, shares)
        for _ in range(int(chance.uniform(1.0, 4.0))):
            yield _stick(chance, kind)


def _stick(chance: Chance, kind: str) -> Wish:
    seconds = chance.uniform(0.7, 3.2)
    if kind == "stand":
        if chance.happens(0.35):
            return Wish(seconds, "walk", turn=chance.choice((-1.0, 1.0)) * chance.uniform(0.8, 2.2))
        return Wish(seconds, "stand")
    if kind == "aim":
        side = chance.choice((0.0, 0.25, -0.25, 0.5, -0.5, 0.75, -0.75, 1.0)) * PI
        turn = chance.choice((0.0, chance.uniform(-0.8, 0.8)))
        most = 1.25 if abs(side) < 2.0 else 1.3
        return Wish(seconds, "walk", chance.uniform(0.4, most), turn=turn, side=side)
    low, high = {"walk": (0.4, 2.0), "jog": (2.0, 3.2), "run": (3.2, 5.0), "crouch": (0.0, 1.1)}[
        kind
    ]
    speed = chance.uniform(low, high)
    if kind == "crouch" and speed < 0.3:
        return Wish(seconds, "crouch")
    if chance.happens(0.45):
        most = 2.1 if speed < 3.2 else 1.4
        return Wish(seconds, kind, speed, turn=chance.uniform(-most, most))
    bend = chance.choice((0.0, chance.about(0.8), chance.uniform(-PI, PI)), (0.35, 0.35, 0.3))
    return Wish(seconds, kind, speed, bend=float(bend))


STUDIES = (
    Study("stand", 1, 24.0, _stand),
    Study("walk_slow", 1, 14.0, _steady("walk", 0.4, 0.9, 0.0)),
    Study("walk", 1, 16.0, _steady("walk", 1.0, 1.5, 0.0)),
    Study("walk_fast", 1, 14.0, _steady("walk", 1.5, 2.0, 0.0)),
    Study("walk_turn", 2, 14.0, _steady("walk", 0.8, 1.6, 2.1)),
    Study("jog", 1, 14.0, _steady("jog", 2.0, 3.2, 0.0)),
    Study("jog_turn", 1, 16.0, _steady("jog", 2.0, 3.0, 2.1)),
    Study("run", 1, 12.0, _steady("run", 3.2, 5.0, 0.0)),
    Study("run_turn", 1, 12.0, _steady("run", 3.2, 4.5, 1.2)),
    Study("backward", 2, 14.0, _steady("walk", 0.4, 1.3, 0.4, PI)),
    Study("strafe_left", 1, 14.0, _steady("walk", 0.4, 1.2, 0.3, 0.5 * PI)),
    Study("strafe_right", 1, 14.0, _steady("walk", 0.4, 1.2, 0.3, -0.5 * PI)),
    Study("diagonal", 1, 16.0, _diagonal),
    Study("turn_in_place", 1, 20.0, _on_the_spot),
    Study("start_stop", 1, 24.0, _start_stop),
    Study("transitions", 1, 24.0, _transitions),
    Study("reversal", 1, 20.0, _reversals),
    Study("sharp_turn_walk", 2, 34.0, _sharp_turns("walk", 0.9, 1.7)),
    Study("sharp_turn_jog", 2, 26.0, _sharp_turns("jog", 2.0, 3.0)),
    Study("back_and_forth", 1, 20.0, _back_and_forth),
    Study("crouch_walk", 1, 16.0, _steady("crouch", 0.4, 1.1, 0.6)),
    Study("crouch_idle", 1, 16.0, _crouch_idle),
    Study("jump", 1, 22.0, _jumps),
    Study("leap", 1, 16.0, _leaps),
    Study("slope_walk", 2, 20.0, _rambling, Slopes.random),
    Study("steps_walk", 2, 18.0, _straight_on, lambda chance: Stairs.random(chance, 40.0)),
)

_LEVEL = Study("mixed", 1, MIXED_SECONDS, _played)
MIXED = (_LEVEL, _LEVEL, Study("mixed_slope", 1, MIXED_SECONDS, _played, Slopes.random))
