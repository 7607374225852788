"""A creature's motion as keyframes, for a game without physics.

The parts' poses of one period of the gait, so that the end meets the beginning; or, of a motion
that does not repeat itself, of all of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ambulo.rollout import Rollout

FORMAT = 1
# Periods longer or shorter by this share are tried, too, for the best seam.
SLACK = 0.12

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Loop:
    """Where a motion repeats itself."""

    start: int
    """First step."""
    length: int
    """Steps."""
    seam: float
    """Metres: root mean square distance of the parts between start and end, the way forward taken
    out."""
    seam_angle: float
    """Radians: the same of their angles."""
    advance: float
    """Metres forward a loop."""


def _relative(rollout: Rollout) -> Array:
    """(T + 1, P, 3): poses with the torso's x taken out."""
    poses = rollout.poses.astype(np.float64)
    poses[..., 0] -= poses[:, rollout.torso : rollout.torso + 1, 0]
    return poses


def _difference(a: Array, b: Array) -> Array:
    """From a to b of poses (…, 3): b − a, angles the short way around."""
    out = b - a
    out[..., 2] = (out[..., 2] + np.pi) % (2.0 * np.pi) - np.pi
    return out


def find_loop(rollout: Rollout, period_s: float) -> Loop:
    """The stretch of about a period, in the second half, whose ends are nearest to each other.

    Raises:
        ValueError: the episode is shorter than two periods.
    """
    poses = _relative(rollout)
    period = period_s / rollout.dt
    lengths = range(max(round(period * (1.0 - SLACK)), 2), round(period * (1.0 + SLACK)) + 1)
    first, last = len(poses) // 2, len(poses) - lengths[-1] - 1
    if last <= first:
        raise ValueError(
            f"an episode of {rollout.steps} steps is too short for a loop of {period_s:.2f} s; "
            "give more --steps"
        )
    best: tuple[float, int, int] | None = None
    for length in lengths:
        starts = np.arange(first, last)
        # Velocities count, too: a loop whose ends only touch would jerk.
        gap = _difference(poses[starts], poses[starts + length])
        before = _difference(poses[starts - 1], poses[starts + length - 1])
        error = (gap**2).mean((1, 2)) + 4.0 * ((gap - before) ** 2).mean((1, 2))
        at = int(np.argmin(error))
        if best is None or error[at] < best[0]:
            best = (float(error[at]), int(starts[at]), length)
    assert best is not None
    _, start, length = best
    gap = _difference(poses[start], poses[start + length])
    torso = rollout.poses[:, rollout.torso, 0]
    return Loop(
        start=start,
        length=length,
        seam=float(np.sqrt((gap[:, :2] ** 2).sum(-1).mean())),
        seam_angle=float(np.sqrt((gap[:, 2] ** 2).mean())),
        advance=float(torso[start + length] - torso[start]),
    )


def _at(poses: Array, steps: Array) -> Array:
    """Poses (T + 1, …) at steps that need not be whole."""
    before = np.minimum(steps.astype(int), len(poses) - 2)
    part = (steps - before)[:, None, None]
    return (1.0 - part) * poses[before] + part * poses[before + 1]


def bake(rollout: Rollout, loop: Loop | None, *, every: int = 1) -> dict[str, Any]:
    """Keyframes of all parts: of a loop, its seam closed, or without one of the whole episode.

    The seam is closed by spreading what is left over the loop. Returns a JSON value: format,
    creature, fps, frames, loop (start_s, duration_s, advance, seam, seam_angle; null without one),
    and parts by name with x, y in metres and angle in radians, a number a frame. x is that of the
    world less where the torso is at the first frame; angles are continuous. A frame comes every so
    many steps; in a loop about so many, as its last frame is its end.
    """
    start, stop = (0, rollout.steps) if loop is None else (loop.start, loop.start + loop.length)
    poses = rollout.poses[start : stop + 1].astype(np.float64)
    poses[..., 2] = np.unwrap(poses[..., 2], axis=0)
    poses[..., 0] -= poses[0, rollout.torso, 0]
    if loop is not None:
        gap = _difference(poses[0], poses[-1])
        gap[:, 0] -= loop.advance
        poses -= np.linspace(0.0, 1.0, len(poses))[:, None, None] * gap
    frames, apart = poses[::every], float(every)
    if loop is not None:
        # Spread over the loop, so that the last one is its end, whatever its length.
        count = max(round(loop.length / every), 1)
        frames, apart = _at(poses, np.linspace(0.0, loop.length, count + 1)), loop.length / count
    names = [part["name"] for part in rollout.creature["parts"]]
    return {
        "format": FORMAT,
        "creature": rollout.creature["name"],
        "fps": 1.0 / (rollout.dt * apart),
        "frames": len(frames),
        "loop": None
        if loop is None
        else {
            "start_s": loop.start * rollout.dt,
            "duration_s": loop.length * rollout.dt,
            "advance": loop.advance,
            "seam": loop.seam,
            "seam_angle": loop.seam_angle,
        },
        "parts": {
            name: {
                key: [round(float(value), 5) for value in frames[:, index, axis]]
                for axis, key in enumerate(("x", "y", "angle"))
            }
            for index, name in enumerate(names)
        },
    }
