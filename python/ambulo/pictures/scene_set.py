"""What stands in a scene as boxes with colours: objects, walls, and flat pieces of ground."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ambulo.pictures.drawing import Array
from ambulo.pictures.solids import CORNERS, Boxes, boxes, rotation_rows
from ambulo.pictures.stage import between
from ambulo.recording import Flat, Floats, Heights
from ambulo.scene_recording import GroundPatch, ScenePart, SceneRecording, Wall

# Patterns.
PLAIN, CRATE, LEAF, PARCEL, TERRAIN = range(5)

WALL = (0.865, 0.862, 0.850)
FRAME = (0.600, 0.455, 0.330)
WOOD = (0.700, 0.520, 0.350)
METAL = (0.360, 0.375, 0.400)
SEAT = (0.310, 0.455, 0.500)
CHAIR = (0.680, 0.530, 0.380)
BOX = (0.790, 0.640, 0.445)
POST = (0.560, 0.580, 0.610)
RED = (0.860, 0.200, 0.150)
GROUND = (0.800, 0.788, 0.768)

HANDLE = 1.02  # metres: how high a door's handles are where nobody says
BOTTOM = 0.02  # metres that pieces of ground reach below what they stand on


@dataclass(frozen=True)
class Prop:
    """A part of an object as boxes in its own frame."""

    part: ScenePart
    shape: Boxes


class Props:
    """All that stands in a scene; owners 0..W - 1 are walls, then parts, -1 is the ground."""

    def __init__(self, recording: SceneRecording) -> None:
        self.recording = recording
        self.first = len(recording.walls)
        props = [_prop(part, self.first + i) for i, part in enumerate(recording.parts)]
        self.moving = [prop for prop in props if prop.part.moves and _moved(prop.part)]
        standing = [p for p in props if p not in self.moving]
        self.still = Boxes.joined(
            [
                Boxes.none(),
                *(_wall(wall, i) for i, wall in enumerate(recording.walls)),
                *(_placed(p.shape, _at(p.part, 0.0)) for p in standing),
            ]
        )
        self.ground, self.level, self.rest = _ground(recording.patches, recording.heights)

    def movers(self, frame: float) -> Boxes:
        """What moves, at a fractional frame."""
        placed = [_placed(prop.shape, _at(prop.part, frame)) for prop in self.moving]
        return Boxes.joined([Boxes.none(), *placed])

    def tall(self) -> set[int]:
        """Owners that a camera may have to look through: walls and doors."""
        parts = enumerate(self.recording.parts, self.first)
        return set(range(self.first)) | {i for i, part in parts if part.kind == "door"}

    def owned(self) -> dict[str, list[int]]:
        """The owners that make up each object, by its name."""
        out: dict[str, list[int]] = {}
        for owner, part in enumerate(self.recording.parts, self.first):
            out.setdefault(part.object, []).append(owner)
        return out


def _moved(part: ScenePart) -> bool:
    """Whether it ever leaves its first place."""
    return float(np.ptp(np.asarray(part.transforms), axis=0).max()) > 1e-5


def _at(part: ScenePart, frame: float) -> Array:
    """(7,) its frame in the world at a fractional frame."""
    if not part.moves:
        return np.asarray(part.transforms, np.float64)
    rows = np.asarray(part.transforms)
    low = min(max(int(frame), 0), len(rows) - 1)
    near = np.array(rows[low : low + 2], np.float64)
    if len(near) > 1 and near[0, 3:] @ near[1, 3:] < 0.0:
        near[1, 3:] *= -1.0  # the same turn, the short way
    at = between(near, np.array([min(frame - low, 1.0)]))[0]
    at[3:] /= np.linalg.norm(at[3:])
    return at


def _placed(shape: Boxes, at: Array) -> Boxes:
    """`shape` moved by a transform (7,)."""
    turn = rotation_rows(at[None, 3:])[0]
    return replace(
        shape,
        corners=shape.corners @ turn + at[:3],
        centre=shape.centre @ turn + at[:3],
        axes=shape.axes @ turn,
    )


# Objects ------------------------------------------------------------------------------------


def _prop(part: ScenePart, owner: int) -> Prop:
    """A part with colours, and with the handles and knobs that its solids leave out."""
    solids = part.solids
    centre = np.array([s.centre for s in solids], np.float64).reshape(-1, 3)
    half = np.array([s.half for s in solids], np.float64).reshape(-1, 3)
    upright = np.broadcast_to(np.eye(3), (len(solids), 3, 3))
    colour, look = _material(part, half)
    shape = boxes(centre, upright, half, colour, PLAIN, owner)
    shape = replace(shape, look=np.full(len(solids), look))
    more = [shape]
    if part.kind == "door" and part.part == "leaf":
        more += [_handle(part, h, owner) for h in _handles(part)]
    if part.kind == "lever" and part.part == "arm" and len(solids):
        more.append(_knob(part, owner))
    return Prop(part, Boxes.joined([Boxes.none(), *more]))


def _material(part: ScenePart, half: Array) -> tuple[Array, int]:
    """Colours (N, 3) of a part's solids, and the pattern on them."""
    kind, name = part.kind, part.part
    if kind == "chair":
        # What is wide and thin is upholstered; legs are bare.
        wide = (np.sort(half, axis=1)[:, 1] > 0.08)[:, None]
        return np.where(wide, np.array(SEAT), np.array(CHAIR)), PLAIN
    if kind == "door":
        leaf = name == "leaf"
        return np.tile(WOOD if leaf else FRAME, (len(half), 1)), LEAF if leaf else PLAIN
    if kind == "box":
        large = len(half) > 0 and float(half.max()) > 0.3
        return np.tile(BOX, (len(half), 1)), CRATE if large else PARCEL
    if kind == "button":
        return np.tile(RED if name == "cap" else POST, (len(half), 1)), PLAIN
    return np.tile(METAL if name == "arm" else POST, (len(half), 1)), PLAIN


def _handles(part: ScenePart) -> Array:
    """(G, 3) where the handles of a leaf are, in its frame."""
    if len(part.grips):
        return np.asarray(part.grips, np.float64)
    if not part.solids:
        return np.zeros((0, 3))
    solid = max(part.solids, key=lambda s: float(np.prod(s.half)))
    centre, half = np.asarray(solid.centre, np.float64), np.asarray(solid.half, np.float64)
    free = centre[0] + np.copysign(max(half[0] - 0.07, 0.0), centre[0])  # the hinge is at 0
    up = min(centre[1] - half[1] + HANDLE, centre[1] + 0.5 * half[1])
    out = half[2] + 0.07
    return np.array([[free, up, centre[2] + out], [free, up, centre[2] - out]])


def _handle(part: ScenePart, grip: Array, owner: int) -> Boxes:
    """A plate, a spindle and a bar towards the hinge, at a grip beside a leaf."""
    solid = max(part.solids, key=lambda s: float(np.prod(s.half)))
    centre, half = np.asarray(solid.centre, np.float64), np.asarray(solid.half, np.float64)
    out = 1.0 if grip[2] >= centre[2] else -1.0
    face = centre[2] + out * half[2]
    to_hinge = -np.sign(centre[0]) if abs(centre[0]) > 1e-6 else 1.0
    x, y, _ = grip
    centres = np.array(
        [
            [x, y, face + out * 0.005],
            [x, y, face + out * 0.030],
            [x + to_hinge * 0.055, y, face + out * 0.055],
        ]
    )
    halves = np.array([[0.022, 0.075, 0.005], [0.010, 0.010, 0.030], [0.067, 0.011, 0.010]])
    return boxes(
        centres, np.broadcast_to(np.eye(3), (3, 3, 3)), halves, np.tile(METAL, (3, 1)),
        PLAIN, owner,
    )  # fmt: skip


def _knob(part: ScenePart, owner: int) -> Boxes:
    """A red grip at the end of a lever's arm."""
    solid = part.solids[0]
    centre, half = np.asarray(solid.centre, np.float64), np.asarray(solid.half, np.float64)
    end = centre + np.array([0.0, half[1], 0.0])
    if len(part.grips):
        end = np.asarray(part.grips[0], np.float64)
    halves = np.array([[0.028, 0.055, 0.028]])
    return boxes(
        end[None] - np.array([0.0, 0.04, 0.0]), np.eye(3)[None], halves, np.array([RED]),
        PLAIN, owner,
    )  # fmt: skip


def _wall(wall: Wall, owner: int) -> Boxes:
    """A wall as one box."""
    start, end = np.asarray(wall.start, np.float64), np.asarray(wall.end, np.float64)
    along = end - start
    length = float(np.hypot(*along))
    x, z = along / length
    axes = np.array([[x, 0.0, z], [0.0, 1.0, 0.0], [-z, 0.0, x]])
    middle = 0.5 * (start + end)
    centre = np.array([middle[0], wall.base + 0.5 * wall.height, middle[1]])
    half = np.array([0.5 * length, 0.5 * wall.height, 0.5 * wall.thickness])
    return boxes(centre[None], axes[None], half[None], np.array([WALL]), PLAIN, owner)


# Ground -------------------------------------------------------------------------------------


class Rolling:
    """Only what is hilly of a ground; level elsewhere, where sharp pieces are drawn instead."""

    def __init__(self, heights: Heights, pieces: Sequence[GroundPatch], level: float) -> None:
        self.heights, self.pieces, self.level = heights, pieces, level

    def height(self, x: Floats, z: Floats) -> Floats:
        """Heights above points, as `Heights` wants them."""
        x, z = np.broadcast_arrays(x, z)
        inside = np.zeros(x.shape, bool)
        for piece in self.pieces:
            u, v = own_place(piece, x, z)
            inside |= (np.abs(u) < 0.5 * piece.size[0]) & (np.abs(v) < 0.5 * piece.size[1])
        out = np.full(x.shape, self.level)
        if inside.any():
            out[inside] = self.heights.height(x[inside], z[inside])
        return out


def own_place(piece: GroundPatch, x: Floats, z: Floats) -> tuple[Floats, Floats]:
    """World x, z in a piece's own axes, from its middle."""
    c, s = np.cos(piece.yaw).astype(x.dtype), np.sin(piece.yaw).astype(x.dtype)
    dx, dz = x - x.dtype.type(piece.place[0]), z - x.dtype.type(piece.place[1])
    return dx * c - dz * s, dx * s + dz * c


def _ground(
    patches: Sequence[GroundPatch], heights: Heights
) -> tuple[Boxes, float, Heights | None]:
    """Planar pieces that rise over the lowest level as solids, that level, and what is hilly."""
    if not patches:
        flat = isinstance(heights, Flat)
        level = heights.level if flat else 0.0
        return Boxes.none(), level, None if flat else heights
    ends = [
        (p.from_height, p.to_height if p.kind in ("slope", "steps") else p.from_height)
        for p in patches
    ]
    level = min(min(pair) for pair in ends)
    solids = [Boxes.none()]
    for piece, (low, high) in zip(patches, ends, strict=True):
        if piece.kind == "steps":
            rises = np.linspace(low, high, piece.count)
            parts = np.linspace(-0.5, 0.5, piece.count + 1) * piece.size[1]
            solids += [
                _block(piece, (a, b), (rise, rise), level)
                for a, b, rise in zip(parts, parts[1:], rises, strict=False)
                if rise > level + 1e-4
            ]
        elif piece.kind != "rugged" and max(low, high) > level + 1e-4:
            span = (-0.5 * piece.size[1], 0.5 * piece.size[1])
            solids.append(_block(piece, span, (low, high), level))
    hilly = [piece for piece in patches if piece.kind == "rugged"]
    return Boxes.joined(solids), level, Rolling(heights, hilly, level) if hilly else None


def _block(
    piece: GroundPatch, span: tuple[float, float], tops: tuple[float, float], level: float
) -> Boxes:
    """The ground of a piece between two of its own z, as high as `tops` there."""
    wide, middle = 0.5 * piece.size[0], 0.5 * (span[0] + span[1])
    c, s = np.cos(piece.yaw), np.sin(piece.yaw)
    axes = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
    half = np.array([wide, 0.5 * (max(tops) - level), 0.5 * (span[1] - span[0])])
    own = CORNERS * half
    own[:, 1] = np.where(
        CORNERS[:, 1] > 0, np.where(CORNERS[:, 2] > 0, tops[1], tops[0]), level - BOTTOM
    )
    own[:, 2] += middle
    place = np.array([piece.place[0], 0.0, piece.place[1]])
    centre = place + np.array([[0.0, 0.5 * (max(tops) + level), middle]]) @ axes
    out = boxes(centre, axes[None], half[None], np.array([GROUND]), TERRAIN)
    return replace(out, corners=(own @ axes + place)[None])
