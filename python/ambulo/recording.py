"""What a controller did, frame by frame: the one thing that films, charts and measures read.

Right-handed frame, +Y up, +Z forward, metres, seconds, radians; the character's left is +X when it
faces +Z.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating]
Ints = NDArray[np.integer]


class Heights(Protocol):
    """The ground as a height field."""

    def height(self, x: Floats, z: Floats) -> Floats:
        """Heights in metres above the points `x`, `z` (metres, any one shape), in that shape."""
        ...


@dataclass(frozen=True)
class Flat:
    """Level ground at `level` metres."""

    level: float = 0.0

    def height(self, x: Floats, z: Floats) -> Floats:
        """`level` everywhere."""
        return np.full(np.broadcast(x, z).shape, self.level, dtype=np.float32)


@dataclass(frozen=True)
class Recording:
    """T frames of a character with J joints and K end sites, all in the world frame."""

    fps: float
    """Frames a second."""
    names: tuple[str, ...]
    """(J,) joint names."""
    parents: tuple[int, ...]
    """(J,) index of each joint's parent, -1 for the root; a parent comes before its children."""
    positions: Floats
    """(T, J, 3) joint positions, metres."""
    tips: Floats
    """(T, K, 3) end-site positions, metres; K may be 0."""
    tip_joints: tuple[int, ...]
    """(K,) the joint that each end site hangs on."""
    root: Floats
    """(T, 2) ground position x, z of the character, metres."""
    facing: Floats
    """(T,) yaw, radians: forward = (sin yaw, 0, cos yaw)."""
    gait: Ints
    """(T,) index into `gait_names`."""
    gait_names: tuple[str, ...]
    leg: Ints
    """(T,) index of the waypoint being walked to."""
    lap: Ints
    """(T,) laps completed."""
    contacts: Floats
    """(T, 4) left heel, left toe, right heel, right toe: 0 in the air, 1 on the ground."""
    asked: Floats
    """(T, 3) asked velocity x, z in m/s and asked facing yaw in radians (NaN: none asked)."""

    def __post_init__(self) -> None:
        if not self.fps > 0.0:
            raise ValueError(f"Recording.fps must be above 0, not {self.fps}")
        joints, frames = len(self.names), len(self.positions)
        if len(self.parents) != joints:
            raise ValueError(f"Recording has {joints} names but {len(self.parents)} parents")
        bad = [i for i, parent in enumerate(self.parents) if not -1 <= parent < i]
        if bad:
            raise ValueError(
                f"Recording.parents[{bad[0]}] is {self.parents[bad[0]]}: a parent must come "
                "before its child"
            )
        if any(not 0 <= joint < joints for joint in self.tip_joints):
            raise ValueError(f"Recording.tip_joints must lie in 0..{joints - 1}")
        shapes: dict[str, tuple[int, ...]] = {
            "positions": (frames, joints, 3),
            "tips": (frames, len(self.tip_joints), 3),
            "root": (frames, 2),
            "facing": (frames,),
            "gait": (frames,),
            "leg": (frames,),
            "lap": (frames,),
            "contacts": (frames, 4),
            "asked": (frames, 3),
        }
        for name, shape in shapes.items():
            found = np.shape(getattr(self, name))
            if found != shape:
                raise ValueError(f"Recording.{name} must have shape {shape}, not {found}")

    @property
    def frames(self) -> int:
        """T."""
        return len(self.positions)

    def cut(self, rows: slice) -> Recording:
        """Some of its frames."""
        per_frame = (
            "positions", "tips", "root", "facing", "gait", "leg", "lap", "contacts", "asked",
        )  # fmt: skip
        return replace(self, **{name: getattr(self, name)[rows] for name in per_frame})

    def without_joints(self) -> Recording:
        """The same path with no joints and no tips."""
        none: dict[str, Any] = {"names": (), "parents": (), "tip_joints": ()}
        return replace(self, positions=self.positions[:, :0], tips=self.tips[:, :0], **none)

    @classmethod
    def joined(cls, recordings: Sequence[Recording]) -> Recording:
        """One after the other, paths only: what maps are drawn from."""
        paths = [recording.without_joints() for recording in recordings]
        per_frame = ("positions", "tips", "root", "facing", "gait", "leg", "lap", "contacts")
        whole = {
            name: np.concatenate([getattr(path, name) for path in paths])
            for name in (*per_frame, "asked")
        }
        return replace(paths[0], **whole)
