"""How a character, or a captured person, moves under one command: speed, skate, jerk, sway."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ambulo.evaluate import metrics
from ambulo.evaluate.commands import FPS, Steady
from ambulo.pictures.mannequin import landmarks

Array = NDArray[np.floating]

# Seconds over which a speed on a curve is measured: long enough for the hips' own sway.
CHORD = 0.5
SIDES = ("left", "right")
# A floor is the median of so many frames of contact or more.
FLOOR_FRAMES = 10


@dataclass(frozen=True)
class Body:
    """Which joints of a skeleton are looked at."""

    toes: tuple[int, int]
    """Left and right."""
    toe_heights: tuple[float, float]
    """Metres above the ground in contact, where it cannot be measured."""
    chest: int | None
    """Where both arms hang; None where no arms are found by name."""

    @classmethod
    def of(cls, parts: dict[str, Any]) -> Body:
        """From a bundle's or a data set's parts."""
        joints, feet = parts["skeleton"], parts["feet"]
        parents = [-1 if joint["parent"] is None else joint["parent"] for joint in joints]
        marks = landmarks(tuple(joint["name"] for joint in joints))
        arms = [marks[f"{side} shoulder"] for side in SIDES if f"{side} shoulder" in marks]
        return cls(
            toes=(feet["joints"][1], feet["joints"][3]),
            toe_heights=(feet["heights"][1], feet["heights"][3]),
            chest=_meeting(parents, *arms) if len(arms) == 2 else None,
        )


def _meeting(parents: Sequence[int], a: int, b: int) -> int:
    """The joint nearest to two joints that both hang on."""
    above = {a}
    while parents[a] >= 0:
        a = parents[a]
        above.add(a)
    while b not in above:
        b = parents[b]
    return b


@dataclass(frozen=True)
class Motion:
    """T consecutive frames at 60 Hz."""

    positions: Array
    """(T, J, 3) world, metres."""
    root: Array
    """(T, 2) x, z, metres."""
    yaw: Array
    """(T,) radians."""
    toes_above: Array
    """(T, 2) heights of the left and the right toe joint above the ground, metres."""
    touching: NDArray[np.bool_]
    """(T, 2) whether they are in contact."""

    @property
    def frames(self) -> int:
        """T."""
        return len(self.root)


def figures(motions: Sequence[Motion], body: Body, fall_back: Array) -> dict[str, float]:
    """Skate in cm a frame, the toes' floor that it is measured over in cm, jerk in m/s³.

    The floor (2,) in metres is `fall_back` where the toes are hardly ever in contact.
    """
    floor = floors(motions, fall_back)
    slides = [
        metrics.skate(m.positions[:, body.toes], m.toes_above - floor, FPS).mean(axis=-1)
        for m in motions
    ]
    jerks = [metrics.jerk(m.positions, FPS) for m in motions]
    return {
        "skate_cm_per_frame": _mean(slides),
        "floor_cm": float(floor.mean()) * 100.0,
        "jerk_m_per_s3": _mean(jerks),
    }


def sways(motions: Sequence[Motion], body: Body) -> dict[str, Array]:
    """How far hips and chest move about their means, cm, one number a window of 2 s."""

    def of(places: Sequence[Array]) -> Array:
        return 100.0 * np.concatenate([metrics.sway(p, FPS) for p in places] or [np.zeros(0)])

    hips = [m.positions[:, 0] for m in motions]
    found = {"hips_sway_cm": of(hips)}
    if body.chest is not None:
        # Of the chest as the hips carry it: breathing and the trunk's own balance.
        chests = [m.positions[:, body.chest] for m in motions]
        found["chest_sway_cm"] = of([c - h for c, h in zip(chests, hips, strict=True)])
    return found


def floors(motions: Sequence[Motion], fall_back: Array) -> Array:
    """(2,) median heights of the toe joints in contact, metres; see `figures`."""
    above = np.concatenate([m.toes_above for m in motions])
    touching = np.concatenate([m.touching for m in motions])
    enough = touching.sum(axis=0) >= FLOOR_FRAMES
    medians = [np.median(above[touching[:, i], i]) if enough[i] else fall_back[i] for i in (0, 1)]
    return np.array(medians)


def reached(motions: Sequence[Motion], steady: Steady, headings: Sequence[float]) -> dict[str, Any]:
    """What was reached of the asked speed and turn, as shares, and how much that differs by run.

    On a straight way the speed is that along the asked direction. In a turn it is that along the
    path: chords over half a second, made longer by as much as an arc of the reached turn is.
    """
    speeds, turns = [], []
    for motion, heading in zip(motions, headings, strict=True):
        seconds = (motion.frames - 1) / FPS
        turn = float(np.unwrap(motion.yaw)[-1] - np.unwrap(motion.yaw)[0]) / seconds
        if steady.turn:
            turns.append(turn / steady.turn)
            speeds.append(_path_speed(motion.root, turn) / steady.speed)
        elif steady.speed:
            move = heading + steady.aside
            along = np.array([math.sin(move), math.cos(move)])
            gone = float((motion.root[-1] - motion.root[0]).astype(float) @ along)
            speeds.append(gone / seconds / steady.speed)
    found: dict[str, Any] = {}
    if speeds:
        found |= {"speed_ratio": float(np.mean(speeds)), "speed_ratio_sd": float(np.std(speeds))}
    if turns:
        found["turn_ratio"] = float(np.mean(turns))
    if not steady.speed:
        gone = [np.linalg.norm((m.root[-1] - m.root[0]).astype(float)) for m in motions]
        drifts = [way / (m.frames - 1) for way, m in zip(gone, motions, strict=True)]
        found["drift_cm_per_s"] = float(np.mean(drifts)) * 100.0 * FPS
    return found


def _path_speed(root: Array, turn: float) -> float:
    """Mean speed in m/s along a path (T, 2) that turns by `turn` radians a second."""
    reach = min(round(CHORD * FPS), len(root) - 1)
    chord = np.linalg.norm((root[reach:] - root[:-reach]).astype(float), axis=-1).mean()
    half = 0.5 * abs(turn) * reach / FPS
    return float(chord * (half / math.sin(half) if half > 1e-6 else 1.0) * FPS / reach)


def _mean(parts: Sequence[Array]) -> float:
    whole = np.concatenate([part for part in parts if len(part)] or [[np.nan]])
    return float(whole.mean())
