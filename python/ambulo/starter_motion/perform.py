"""One clip: from wishes to a skeleton's motion and the labels that are known of it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ambulo._core import Clip
from ambulo.starter_motion import body
from ambulo.starter_motion.feet import Track, track
from ambulo.starter_motion.footsteps import Planner, Print
from ambulo.starter_motion.gait import Rhythm, rhythm
from ambulo.starter_motion.ground import Ground
from ambulo.starter_motion.hips import hips_over
from ambulo.starter_motion.intent import FPS, GAITS, Intent, Jump, Wish, follow
from ambulo.starter_motion.noise import Chance
from ambulo.starter_motion.pose import assembled, keep_in_reach, leg
from ambulo.starter_motion.rotations import Floats, smoothed
from ambulo.starter_motion.upper import arm, breathing, trunk_and_head

LEAD = 2.0  # seconds made before and after a clip and cut off


@dataclass(frozen=True)
class StarterClip:
    """A generated clip and what is known of it."""

    name: str
    clip: Clip
    """60 Hz, metres, +Y up, +Z forward, 22 joints; the rest pose is a T-pose."""
    onsets: tuple[Floats, Floats]
    """Seconds at which the left and the right foot come down."""
    gaits: tuple[tuple[float, float, str], ...]
    """Spans (start, end in seconds, gait), without gaps; the gaits are `intent.GAITS`."""
    contacts: Floats
    """(F, 4) left heel, left toe, right heel, right toe: 1 on the ground."""
    ground: Ground
    """What it was made on."""


def perform(name: str, wishes: list[Wish], ground: Ground, *seed: int) -> StarterClip:
    """The clip of these wishes; they begin and end with `LEAD` seconds that are cut off."""
    chance = Chance(*seed)
    intent = follow(wishes)
    pace = rhythm(intent)
    planner = Planner(intent, pace, ground, chance)
    prints = planner.plan()
    feet = (
        track(0, prints[0], prints[1], pace, ground, intent.time),
        track(1, prints[1], prints[0], pace, ground, intent.time),
    )
    jumps = _taken(prints)
    hips = hips_over(feet, prints, intent, pace, jumps, chance)
    for foot in feet:
        keep_in_reach(hips, foot)
    trunk = trunk_and_head(hips, intent, pace, _slope(intent, feet), chance)
    breath = breathing(pace, chance)
    legs = [leg(hips, foot) for foot in feet]
    arms = [arm(side, hips, pace, trunk["chest"], breath, chance) for side in (0, 1)]
    rotations = assembled(hips, trunk, legs + arms)
    keep = slice(round(LEAD * FPS), len(intent.time) - round(LEAD * FPS))
    clip = Clip.from_arrays(
        names=body.NAMES,
        parents=body.PARENTS,
        offsets=body.OFFSETS,
        fps=FPS,
        rotations=np.ascontiguousarray(rotations[keep]),
        root=np.ascontiguousarray(hips.place[keep]),
    )
    contacts = np.concatenate([foot.contacts for foot in feet], axis=1)[keep]
    until = intent.time[keep.stop - 1]
    onsets = tuple(
        np.array([p.on - LEAD for p in side if LEAD <= p.on <= until]) for side in prints
    )
    gaits = _spans(_gaits(intent, pace, jumps)[keep])
    return StarterClip(name, clip, (onsets[0], onsets[1]), gaits, contacts, ground)


def _taken(prints: tuple[list[Print], list[Print]]) -> list[Jump]:
    """Jumps off both feet as they were taken."""
    return [Jump(a.off, b.on - a.off) for a, b in pairwise(prints[0]) if a.bound]


def _slope(intent: Intent, feet: tuple[Track, Track]) -> Floats:
    """(F,) of the ground along the way of travel, radians, blurred."""
    level = smoothed(0.5 * (feet[0].height + feet[1].height), 10.0)
    gone = np.maximum(intent.speed, 0.4) / FPS
    return np.clip(smoothed(np.gradient(level) / gone, 10.0), -0.4, 0.4)


def _gaits(intent: Intent, pace: Rhythm, jumps: list[Jump]) -> np.ndarray:
    """(F,) index into `GAITS`, by what was wanted and how fast and where it went."""
    speed = pace.speed
    left, front = intent.local.T
    angle = np.abs(np.arctan2(left, front))
    gait = np.full(len(speed), GAITS.index("walk"))
    gait[angle > np.pi / 4] = GAITS.index("sideways")
    gait[angle > 3 * np.pi / 4] = GAITS.index("backward")
    fast = pace.running > 0.5
    gait[fast & (angle <= np.pi / 4)] = GAITS.index("jog")
    gait[fast & (angle <= np.pi / 4) & (speed >= 3.2)] = GAITS.index("run")
    gait[speed < 0.15] = GAITS.index("stand")
    gait[pace.crouch > 0.5] = GAITS.index("crouch")
    for jump in jumps:
        during = (intent.time > jump.start - 0.5) & (intent.time < jump.start + jump.flight + 0.4)
        gait[during] = GAITS.index("jump")
    for jump in intent.jumps:
        if float(intent.at(pace.running, jump.start)) > 0.5:
            during = (intent.time > jump.start) & (intent.time < jump.start + jump.flight + 0.5)
            gait[during] = GAITS.index("jump")
    return gait


def _spans(gait: np.ndarray) -> tuple[tuple[float, float, str], ...]:
    edges = np.concatenate([[0], np.flatnonzero(np.diff(gait)) + 1, [len(gait)]])
    return tuple(
        (a / FPS, b / FPS, GAITS[int(gait[a])])
        for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)
    )
