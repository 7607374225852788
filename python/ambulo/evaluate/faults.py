"""What may go wrong in a free run: freezes, explosions, broken poses.

Definitions, for frames at 60 Hz:

- *freeze*: for more than 3 s on end the character is asked to move (6 cm/s or more), and in no
  frame does any joint move more than 1 mm as seen from the root. A figure that slides along in one
  pose is frozen, too.
- *explosion*: a frame that the controller held because the network's answer was no body, a number
  that is not finite, or hips farther from the root than 1.5 times their mean height.
- *snap*: a joint turns by more than a radian in one frame against its parent. (In 14 minutes of
  LAFAN1 one does so once, and that is a flaw of the capture; 99.9 % of the frames have no joint
  that turns by more than 0.3.)
- *fall*: the joint that is highest in the mean pose is lower than a third of its mean height.
- *sink*: a joint is more than 15 cm below the ground.

Snaps, falls and sinks are broken poses.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ambulo import _core
from ambulo.evaluate.commands import FPS, Command
from ambulo.model import Model

Array = NDArray[np.floating]

STANDING = 0.06  # Metres a second: what the controller takes for standing.
STILL = 0.001  # Metres a frame.
FREEZE = 3.0  # Seconds.
SNAP = 1.0  # Radians a frame.
DEEP = 0.15  # Metres.
KINDS = ("freeze", "explosion", "snap", "fall", "sink")
# Faults that are told one by one; of more only the number is kept.
LISTED = 20


@dataclass(frozen=True)
class Moment:
    """One frame of a run on flat ground at height 0."""

    positions: Array
    """(J, 3) world, metres."""
    rotations: Array
    """(J, 4) local quaternions."""
    root: tuple[float, float, float, float]
    """x, y, z, yaw."""
    command: Command
    event: str | None


@dataclass
class Faults:
    """Watches a run frame by frame and counts."""

    model: Model
    frames: int = 0
    counts: dict[str, int] = field(default_factory=lambda: dict.fromkeys(KINDS, 0))
    """Spells of each kind: frames on end count once."""
    bad_frames: int = 0
    listed: list[dict[str, Any]] = field(default_factory=list)
    turns: list[float] = field(default_factory=list)
    """Of each frame the largest turn of a joint since the one before, radians."""

    def __post_init__(self) -> None:
        height = mean_heights(self.model)
        self._hips = float(height[0])
        self._top = int(height.argmax())
        self._top_height = float(height[self._top])
        self._before: tuple[Array, Array] | None = None
        self._still = 0
        self._last: set[str] = set()

    def watch(self, moment: Moment) -> None:
        """Take the next frame."""
        now = self._found(moment)
        for kind in sorted(now - self._last):
            self.counts[kind] += 1
            if len(self.listed) < LISTED:
                at, command = round(self.frames / FPS, 2), moment.command
                asked = {"gait": command.gait, "speed": round(command.speed, 2)}
                self.listed.append({"kind": kind, "at_s": at, **asked})
        self._last = now
        self.bad_frames += bool(now)
        self.frames += 1

    def _found(self, moment: Moment) -> set[str]:
        x, y, z, yaw = moment.root
        seen = inward(moment.positions - np.array([x, y, z]), yaw)
        if not np.isfinite(seen).all() or (moment.event or "").startswith("held"):
            return {"explosion"}
        found = set()
        if float(np.linalg.norm(seen[0])) > 1.5 * self._hips:
            found.add("explosion")
        if float(moment.positions[self._top, 1]) < self._top_height / 3.0:
            found.add("fall")
        if float(moment.positions[:, 1].min()) < -DEEP:
            found.add("sink")
        if self._before is not None:
            pose, rotations = self._before
            moved = float(np.linalg.norm(seen - pose, axis=-1).max())
            asked = moment.command.speed >= STANDING
            self._still = self._still + 1 if asked and moved <= STILL else 0
            if self._still > FREEZE * FPS:
                found.add("freeze")
            self.turns.append(float(turned(rotations, moment.rotations).max()))
            if self.turns[-1] > SNAP:
                found.add("snap")
        self._before = (seen, moment.rotations)
        return found


def mean_heights(model: Model) -> Array:
    """(J,) heights in metres of the joints in the network's mean pose, over its root's ground."""
    layout = _core.layout(model.header["layout"]["name"], len(model.names))
    sizes = dict(layout["outputs"])
    before = list(sizes).index("joint_position")
    start = sum(list(sizes.values())[:before])
    mean = model.core.normalisation()["output_mean"][start : start + sizes["joint_position"]]
    return mean.reshape(-1, 3)[:, 1].astype(float) / layout["units_per_metre"]


def inward(offsets: Array, yaw: float | Array) -> Array:
    """Offsets (..., 3) of the world as seen by a root of that yaw: +Z ahead, +X to its left."""
    s, c = np.sin(yaw), np.cos(yaw)
    x, y, z = np.moveaxis(offsets, -1, 0)
    return np.stack([c * x - s * z, y, s * x + c * z], axis=-1)


def turned(before: Array, after: Array) -> Array:
    """(J,) angles in radians from one frame's quaternions (J, 4) to the next one's."""
    cosine = np.abs((before.astype(float) * after.astype(float)).sum(axis=-1))
    return 2.0 * np.arccos(np.clip(cosine, 0.0, 1.0))


def total(faults: list[Faults]) -> dict[str, Any]:
    """Counts of several runs together, and what is known of each."""
    frames = sum(f.frames for f in faults)
    turns = np.concatenate([np.array(f.turns) for f in faults])
    often, most = np.quantile(turns, [0.999, 1.0]) if len(turns) else (0.0, 0.0)
    return {
        "minutes": frames / FPS / 60.0,
        **{kind: sum(f.counts[kind] for f in faults) for kind in KINDS},
        "turn_rad_per_frame": {"p99.9": float(often), "max": float(most)},
        "bad_frames": sum(f.bad_frames for f in faults),
        "bad_share": sum(f.bad_frames for f in faults) / max(frames, 1),
        "first": [{"seed": seed, **one} for seed, f in enumerate(faults) for one in f.listed][
            :LISTED
        ],
    }


def is_clean(totals: dict[str, Any]) -> bool:
    """Whether nothing at all went wrong."""
    return all(totals[kind] == 0 for kind in KINDS) and math.isfinite(totals["minutes"])
