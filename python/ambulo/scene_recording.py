"""What happened in a scene, frame by frame: a character, the parts of objects, walls and ground.

Right-handed frame, +Y up, +Z forward, metres, seconds, radians, unit quaternions as (x, y, z, w).
A yaw turns +Z towards +X. Plain data: whoever records fills it, pictures are drawn from it.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ambulo.recording import Flat, Floats, Heights, Recording

KINDS = ("door", "chair", "box", "button", "lever")
GROUND_KINDS = ("flat", "rugged", "slope", "steps")


@dataclass(frozen=True)
class Solid:
    """A box in its part's frame, its sides along the axes."""

    centre: Floats
    """(3,) metres."""
    half: Floats
    """(3,) half its extents, metres, each above 0."""

    def __post_init__(self) -> None:
        _shaped("Solid.centre", self.centre, (3,))
        _shaped("Solid.half", self.half, (3,))
        if not (np.asarray(self.half) > 0.0).all():
            raise ValueError(f"Solid.half must be above 0 m, not {np.asarray(self.half).tolist()}")


@dataclass(frozen=True)
class ScenePart:
    """A rigid part of an object."""

    object: str
    """The object's name."""
    part: str
    """The part's own name, as "leaf", "cap" or "arm"."""
    kind: str
    """What the object is: one of `KINDS`; it decides how the part looks."""
    solids: tuple[Solid, ...]
    """What it consists of."""
    transforms: Floats
    """(T, 7) its frame in the world, x y z qx qy qz qw, each frame; (7,) if it never moves."""
    grips: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    """(G, 3) in its frame, where hands take hold of it: a door's handles, a lever's end. A door
    leaf without any gets handles a metre up."""

    def __post_init__(self) -> None:
        whose = f"ScenePart {self.object!r}.{self.part!r}"
        if self.kind not in KINDS:
            raise ValueError(f"{whose}: kind must be one of {', '.join(KINDS)}, not {self.kind!r}")
        shape = np.shape(self.transforms)
        if shape != (7,) and (len(shape) != 2 or shape[1] != 7):
            raise ValueError(f"{whose}: transforms must have shape (T, 7) or (7,), not {shape}")
        _shaped(f"{whose}: transforms", self.transforms, shape)
        lengths = np.linalg.norm(np.asarray(self.transforms, np.float64)[..., 3:], axis=-1)
        if lengths.size and float(np.abs(lengths - 1.0).max()) > 0.01:
            raise ValueError(f"{whose}: the quaternions of transforms must have length 1")
        _shaped(f"{whose}: grips", self.grips, (len(self.grips), 3))

    @property
    def moves(self) -> bool:
        """Whether there is a transform for each frame."""
        return np.ndim(self.transforms) == 2


@dataclass(frozen=True)
class Wall:
    """An upright wall."""

    start: tuple[float, float]
    """x, z of one end, metres."""
    end: tuple[float, float]
    """x, z of the other end."""
    height: float
    """From `base` to its top, metres."""
    thickness: float = 0.1
    """Metres."""
    base: float = 0.0
    """Height of its foot, metres."""

    def __post_init__(self) -> None:
        _shaped("Wall.start", self.start, (2,))
        _shaped("Wall.end", self.end, (2,))
        if not np.isfinite([self.height, self.thickness, self.base]).all():
            raise ValueError("Wall: height, thickness and base must be finite")
        if not (self.height > 0.0 and self.thickness > 0.0):
            raise ValueError(
                f"Wall: height and thickness must be above 0 m, not {self.height} and "
                f"{self.thickness}"
            )
        if np.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1]) < 1e-3:
            raise ValueError(f"Wall: start and end must lie apart; both are {tuple(self.start)}")


@dataclass(frozen=True)
class GroundPatch:
    """A rectangular piece of ground.

    Planar pieces are drawn from here, with sharp edges; of a "rugged" one the heights themselves
    say what it looks like.
    """

    place: tuple[float, float]
    """x, z of its middle, metres."""
    size: tuple[float, float]
    """Along its own x and z, metres."""
    yaw: float = 0.0
    """How its axes are turned, radians."""
    kind: str = "flat"
    """One of `GROUND_KINDS`."""
    from_height: float = 0.0
    """Height where its own z is least, metres; of a flat piece all over, of a rugged the least."""
    to_height: float = 0.0
    """Height where its own z is greatest; not read for flat and rugged pieces."""
    count: int = 0
    """How many steps; 2 or more for "steps"."""

    def __post_init__(self) -> None:
        if self.kind not in GROUND_KINDS:
            kinds = ", ".join(GROUND_KINDS)
            raise ValueError(f"GroundPatch.kind must be one of {kinds}, not {self.kind!r}")
        _shaped("GroundPatch.place", self.place, (2,))
        _shaped("GroundPatch.size", self.size, (2,))
        if not min(self.size) > 0.0:
            raise ValueError(f"GroundPatch.size must be above 0 m, not {tuple(self.size)}")
        if not np.isfinite([self.yaw, self.from_height, self.to_height]).all():
            raise ValueError("GroundPatch: yaw and heights must be finite")
        if self.kind == "steps" and self.count < 2:
            raise ValueError(f"GroundPatch.count must be at least 2 for steps, not {self.count}")


@dataclass(frozen=True)
class SceneRecording:
    """T frames of a character in a scene."""

    character: Recording
    """The character; of its fields only positions, tips, root and facing are drawn."""
    parts: tuple[ScenePart, ...] = ()
    walls: tuple[Wall, ...] = ()
    heights: Heights = field(default_factory=Flat)
    """The ground, all pieces together."""
    patches: tuple[GroundPatch, ...] = ()
    """The pieces that the ground consists of; none: it is drawn from `heights` alone."""
    events: tuple[tuple[float, str], ...] = ()
    """(seconds, text) in order of time, as (2.5, "sit: enter"); each is shown until the next."""
    targets: Mapping[str, Floats] = field(default_factory=dict)
    """By name (T, 3) points that limbs are led to, metres, NaN where there is none: small marks."""
    began: float = 0.0
    """Seconds at the first frame: what is written under pictures counts from there."""

    def __post_init__(self) -> None:
        frames = self.character.frames
        if frames < 1:
            raise ValueError("SceneRecording.character has no frames")
        if not np.isfinite(self.began):
            raise ValueError(f"SceneRecording.began must be finite, not {self.began}")
        for what in ("positions", "tips", "root", "facing"):
            _shaped(f"SceneRecording.character.{what}", getattr(self.character, what), None)
        seen: set[tuple[str, str]] = set()
        for part in self.parts:
            if (part.object, part.part) in seen:
                raise ValueError(f"SceneRecording has two parts {part.object!r}.{part.part!r}")
            seen.add((part.object, part.part))
            if part.moves and len(part.transforms) != frames:
                raise ValueError(
                    f"ScenePart {part.object!r}.{part.part!r} has {len(part.transforms)} "
                    f"transforms; the character has {frames} frames"
                )
        times = [time for time, _ in self.events]
        if not np.isfinite(times).all() or (np.diff(times) < 0.0).any():
            raise ValueError("SceneRecording.events must be in order of time, all finite")
        for name, points in self.targets.items():
            if np.shape(points) != (frames, 3):
                raise ValueError(
                    f"SceneRecording.targets[{name!r}] must have shape ({frames}, 3), "
                    f"not {np.shape(points)}"
                )

    @property
    def frames(self) -> int:
        """T."""
        return self.character.frames

    @property
    def fps(self) -> float:
        """Frames a second."""
        return self.character.fps

    @property
    def duration(self) -> float:
        """Seconds from the first frame to the last."""
        return (self.frames - 1) / self.fps

    def cut(self, start: float, stop: float) -> SceneRecording:
        """The frames of the seconds `start` to `stop`, as far as there are any."""
        first = min(max(round(start * self.fps), 0), self.frames - 1)
        last = min(max(round(stop * self.fps), first), self.frames - 1)
        rows, since = slice(first, last + 1), first / self.fps
        events = [(max(time - since, 0.0), text) for time, text in self.events
                  if time <= last / self.fps]  # fmt: skip
        over = sum(time <= 0.0 for time, _ in events)  # of those before only the last goes on
        return replace(
            self,
            character=self.character.cut(rows),
            parts=tuple(
                replace(part, transforms=part.transforms[rows]) if part.moves else part
                for part in self.parts
            ),
            events=tuple(events[max(over - 1, 0) :]),
            targets={name: points[rows] for name, points in self.targets.items()},
            began=self.began + since,
        )

    def targets_at(self, frame: float) -> NDArray[np.float64]:
        """(M, 3) the targets that there are at the frame nearest to `frame`."""
        row = min(max(round(frame), 0), self.frames - 1)
        points = np.array([rows[row] for rows in self.targets.values()], np.float64)
        points = points.reshape(-1, 3)
        return points[np.isfinite(points).all(1)]

    def event_at(self, time: float) -> str:
        """The event of a time in seconds; empty before the first."""
        at = bisect_right([when for when, _ in self.events], time + 1e-6)
        return self.events[at - 1][1] if at else ""


def _shaped(name: str, values: object, shape: tuple[int, ...] | None) -> None:
    """Refuses `values` of another shape, and any that are not finite."""
    array = np.asarray(values, np.float64)
    if shape is not None and array.shape != shape:
        raise ValueError(f"{name} must have shape {shape}, not {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite")
