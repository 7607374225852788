"""A creature file as pictures need it: outlines, masses, and who is behind whom.

Every shape is a convex core with a rounded skin: a capsule is a line and its radius, a circle a
point, a box a smaller box with a little rounding. One distance function then draws them all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

ROUNDING = 0.22  # of a box's or polygon's smallest half width: corners that a hand could hold


@dataclass(frozen=True)
class Part:
    """One rigid part, in its own frame, metres."""

    name: str
    core: Array
    """(K, 2) corners of the core, counter-clockwise; a capsule's or circle's coincide."""
    half: tuple[float, float] | None
    """Half width and height of a core that is a box, a line or a point; None for a polygon."""
    radius: float
    """Of the skin around the core."""
    thickness: float
    """Half the smallest width of the whole part."""
    mass: float
    """Kilograms, from the density in kg/m²."""
    role: str
    """"torso", "foot" or "limb"; tags say which."""
    far: bool
    """It belongs to the far leg of a pair."""


@dataclass(frozen=True)
class Joint:
    """A hinge between two parts."""

    name: str
    parent: int
    child: int
    anchor: Array
    """(2,) in the child's own frame, metres."""
    place: Array
    """(2,) in the start pose, metres."""
    limits: tuple[float, float] | None
    """Radians from the start pose; None where it turns freely."""
    torque: float
    """Newton metres; 0 without a motor."""


@dataclass(frozen=True)
class Body:
    """All parts of a creature, from the farthest to the nearest."""

    name: str
    parts: tuple[Part, ...]
    joints: tuple[Joint, ...]
    pose: Array
    """(P, 3) the start pose: x, y in metres, angle in radians."""
    torso: int

    @property
    def mass(self) -> float:
        """Kilograms."""
        return sum(part.mass for part in self.parts)

    def standing(self) -> Body:
        """The same with its start pose moved up or down until it touches the ground at y = 0."""
        up = np.array([0.0, -float(self.bounds(self.pose)[0][1])])
        joints = tuple(replace(joint, place=joint.place + up) for joint in self.joints)
        return replace(self, joints=joints, pose=self.pose + np.array([0.0, up[1], 0.0]))

    def bounds(self, poses: ArrayLike) -> tuple[Array, Array]:
        """Lowest and highest x, y (..., 2) of everything at `poses` (..., P, 3)."""
        poses = np.asarray(poses, np.float64)
        low, high = [], []
        for i, part in enumerate(self.parts):
            corners = place(part.core, poses[..., i, :])
            low.append(corners.min(-2) - part.radius)
            high.append(corners.max(-2) + part.radius)
        return np.min(low, axis=0), np.max(high, axis=0)


def place(points: Array, pose: ArrayLike) -> Array:
    """Points (K, 2) of a part's own frame in the world, (..., K, 2), at its `pose` (..., 3)."""
    pose = np.asarray(pose, np.float64)[..., None, :]
    s, c = np.sin(pose[..., 2]), np.cos(pose[..., 2])
    x, y = points[:, 0], points[:, 1]
    return np.stack([pose[..., 0] + c * x - s * y, pose[..., 1] + s * x + c * y], -1)


def read_body(creature: Mapping[str, Any]) -> Body:
    """The body of a creature file (format 1); ValueError names the part or joint that is wrong."""
    raw = creature.get("parts")
    if not isinstance(raw, Sequence) or not raw:
        raise ValueError("a creature needs a list 'parts' with at least one part")
    names = [str(part.get("name", i)) for i, part in enumerate(raw)]
    pose = np.zeros((len(raw), 3))
    for i, part in enumerate(raw):
        with_angle = [*_numbers(part.get("position"), 2, f"part {names[i]!r}: position")]
        pose[i] = [*with_angle, float(part.get("angle", 0.0))]
    joints = _joints(creature.get("joints", ()), names, pose)
    feet = _feet(raw, joints)
    parts = []
    for i, part in enumerate(raw):
        tags = part.get("tags", ())
        role = "torso" if "torso" in tags else "foot" if i in feet else "limb"
        parts.append(_part(part, names[i], role, False))
    for i in _far(creature, joints, parts):
        parts[i] = replace(parts[i], far=True)
    torso = next((i for i, part in enumerate(parts) if part.role == "torso"), 0)
    return Body(str(creature.get("name", "creature")), tuple(parts), joints, pose, torso)


def _joints(raw: Any, names: list[str], pose: Array) -> tuple[Joint, ...]:
    joints = []
    for i, joint in enumerate(raw):
        name = str(joint.get("name", i))
        ends = []
        for end in ("parent", "child"):
            if joint.get(end) not in names:
                raise ValueError(f"joint {name!r}: its {end} {joint.get(end)!r} is no part")
            ends.append(names.index(joint[end]))
        at = np.array(_numbers(joint.get("anchor"), 2, f"joint {name!r}: anchor"))
        x, y, angle = pose[ends[1]]
        s, c = np.sin(angle), np.cos(angle)
        local = np.array([[c, s], [-s, c]]) @ (at - (x, y))
        limits = joint.get("limits")
        if limits is not None:
            low, high = _numbers(limits, 2, f"joint {name!r}: limits")
            limits = (low, high)
        torque = float(joint.get("torque", 0.0))
        joints.append(Joint(name, ends[0], ends[1], local, at, limits, torque))
    return tuple(joints)


def beyond(joints: Sequence[Joint], first: int) -> list[int]:
    """Indices of the joint `first` and of all that hang from its child, in order."""
    found, parts = [first], {joints[first].child}
    grown = True
    while grown:  # the file may name a child before its parent
        grown = False
        for i, joint in enumerate(joints):
            if joint.parent in parts and i not in found:
                found.append(i)
                parts.add(joint.child)
                grown = True
    return sorted(found)


def _far(creature: Mapping[str, Any], joints: tuple[Joint, ...], parts: Sequence[Part]) -> set[int]:
    """Parts of the far leg of each pair: of the one that the file lists first.

    Only of pairs that lie behind each other: legs that hang side by side are all near.
    """
    by_name = {joint.name: i for i, joint in enumerate(joints)}
    far: set[int] = set()
    for pair in creature.get("pairs", ()):
        known = [by_name[name] for name in pair if name in by_name]
        if len(known) != 2:
            continue
        apart = np.linalg.norm(joints[known[0]].place - joints[known[1]].place)
        if apart > 2.0 * max(parts[joints[i].child].thickness for i in known):
            continue
        behind = min(known, key=lambda i: joints[i].child)
        far |= {joints[i].child for i in beyond(joints, behind)}
    return far


def _feet(raw: Sequence[Mapping[str, Any]], joints: tuple[Joint, ...]) -> set[int]:
    """Parts tagged foot, and the last segments of the legs that have none."""
    feet = {i for i, part in enumerate(raw) if "foot" in part.get("tags", ())}
    legs = {i for i, part in enumerate(raw) if "leg" in part.get("tags", ())}
    parent = {joint.child: joint.parent for joint in joints}
    without = legs - set(parent.values())
    for last in list(without):
        at: int | None = last
        for _ in raw:
            at = parent.get(at) if at is not None else None
            if at in feet:
                without.discard(last)
    return feet | without


# Shapes -------------------------------------------------------------------------------------


def _part(raw: Mapping[str, Any], name: str, role: str, far: bool) -> Part:
    shape = raw.get("shape")
    if not isinstance(shape, Mapping) or len(shape) != 1:
        raise ValueError(f"part {name!r}: its shape must be one of box, capsule, circle, polygon")
    kind, size = next(iter(shape.items()))
    where = f"part {name!r}: {kind}"
    if kind == "capsule":
        length, radius = (_above(size, key, where) for key in ("length", "radius"))
        area, half = 2.0 * radius * length + np.pi * radius**2, (0.0, 0.5 * length)
        thickness = radius
    elif kind == "circle":
        radius = thickness = _above(size, "radius", where)
        area, half = np.pi * radius**2, (0.0, 0.0)
    elif kind == "box":
        width, height = (_above(size, key, where) for key in ("width", "height"))
        thickness = 0.5 * min(width, height)
        radius = ROUNDING * thickness
        area, half = width * height, (0.5 * width - radius, 0.5 * height - radius)
    elif kind == "polygon":
        core, radius, thickness, area = _polygon(size, where)
        return Part(name, core, None, radius, thickness, _density(raw) * area, role, far)
    else:
        raise ValueError(f"part {name!r}: no shape {kind!r}; box, capsule, circle and polygon are")
    core = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
    return Part(name, core, half, radius, thickness, _density(raw) * area, role, far)


def _polygon(size: Any, where: str) -> tuple[Array, float, float, float]:
    """Core corners, rounding, thickness and area of a convex polygon."""
    try:
        points = np.array(size["points"], np.float64)
    except (KeyError, TypeError, ValueError):
        raise ValueError(f"{where}: needs 'points', a list of [x, y]") from None
    if points.ndim != 2 or points.shape[1] != 2 or len(points) < 3:
        raise ValueError(f"{where}: needs at least 3 points [x, y], not shape {points.shape}")
    ahead = np.roll(points, -1, axis=0)
    area = 0.5 * float((points[:, 0] * ahead[:, 1] - points[:, 1] * ahead[:, 0]).sum())
    if area < 0.0:
        points, area = points[::-1], -area
    normals, offsets = edges(points)
    middle = points.mean(0)
    thickness = float((offsets - normals @ middle).min())
    if thickness <= 0.0:
        raise ValueError(f"{where}: its points must go round a convex shape")
    radius = ROUNDING * thickness
    # The core's corners are where neighbouring edges meet once all have moved inwards.
    inner = offsets - radius
    core = [
        np.linalg.solve(np.stack([normals[i - 1], normals[i]]), [inner[i - 1], inner[i]])
        for i in range(len(points))
    ]
    return np.array(core), radius, thickness, area


def edges(corners: Array) -> tuple[Array, Array]:
    """Outward normals (K, 2) and offsets (K,) of the edges from each corner to the next."""
    along = np.roll(corners, -1, axis=0) - corners
    normals = np.stack([along[:, 1], -along[:, 0]], -1)
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-12)
    return normals, (normals * corners).sum(-1)


def _density(raw: Mapping[str, Any]) -> float:
    return float(raw.get("density", 0.0))


def _above(size: Any, key: str, where: str) -> float:
    value = size.get(key) if isinstance(size, Mapping) else None
    if not isinstance(value, int | float) or not value > 0.0:
        raise ValueError(f"{where}: {key} must be a number above 0 m, not {value!r}")
    return float(value)


def _numbers(value: Any, count: int, where: str) -> tuple[float, ...]:
    good = isinstance(value, list | tuple | np.ndarray) and len(value) == count
    if not good or not np.isfinite(np.asarray(value, np.float64)).all():
        raise ValueError(f"{where} must be {count} numbers, not {value!r}")
    return tuple(float(v) for v in value)


def poses_at(poses: ArrayLike, rows: ArrayLike) -> Array:
    """Poses (N, P, 3) at fractional `rows` (N,) of `poses` (T, P, 3); angles turn the short way."""
    poses, rows = np.asarray(poses), np.asarray(rows, np.float64)
    low = np.clip(np.floor(rows).astype(np.int64), 0, len(poses) - 1)
    high = np.minimum(low + 1, len(poses) - 1)
    out = poses[low].astype(np.float64)
    change = poses[high].astype(np.float64) - out
    change[..., 2] = np.remainder(change[..., 2] + np.pi, 2.0 * np.pi) - np.pi
    return out + change * (rows - low)[:, None, None]
