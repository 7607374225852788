"""Boxes and wedges, and flat polygons filled on a lattice of samples, in numpy alone.

Whatever is linear on a flat face in space is linear in the picture if it is divided by the depth,
so that a face costs a few sums a sample. The same filling serves the camera (1 / depth) and the sun
(how near to it).
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ambulo.pictures.drawing import NEAR, SUPERSAMPLE, Array, Camera, Pixels, unit

# Corner 4 x + 2 y + z of a box, each 0 or 1; faces -x, +x, -y, +y, -z, +z, seen anticlockwise.
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
FACES = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)


@dataclass(frozen=True)
class Boxes:
    """N boxes, or wedges, in the world, metres."""

    corners: Array
    """(N, 8, 3) in the order of `CORNERS`."""
    centre: Array
    """(N, 3)"""
    axes: Array
    """(N, 3, 3) rows: the box's own axes in the world."""
    half: Array
    """(N, 3) along its own axes."""
    colour: Array
    """(N, 3) display values 0..1."""
    look: NDArray[np.int64]
    """(N,) which pattern is on it."""
    owner: NDArray[np.int64]
    """(N,) what it belongs to."""

    def __len__(self) -> int:
        return len(self.corners)

    def take(self, chosen: NDArray[np.generic]) -> Boxes:
        """Some of them, by a mask or indices."""
        return Boxes(*(getattr(self, f.name)[chosen] for f in fields(self)))

    @classmethod
    def joined(cls, several: list[Boxes]) -> Boxes:
        """All of them."""
        return cls(*(np.concatenate([getattr(b, f.name) for b in several]) for f in fields(cls)))

    @classmethod
    def none(cls) -> Boxes:
        """No box."""
        return boxes(np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3)), np.zeros((0, 3)))


def boxes(
    centre: Array, axes: Array, half: Array, colour: Array, look: int = 0, owner: int = -1
) -> Boxes:
    """N boxes of `centre` (N, 3), `axes` (N, 3, 3), `half` (N, 3) and `colour` (N, 3)."""
    count = len(centre)
    corners = centre[:, None] + (CORNERS * half[:, None]) @ axes
    same = np.full(count, 1, np.int64)
    return Boxes(corners, centre, axes, half, colour, look * same, owner * same)


@dataclass(frozen=True)
class Faces:
    """F flat faces in the world."""

    corners: Array
    """(F, 4, 3)"""
    normal: Array
    """(F, 3) unit, out of the box."""
    box: NDArray[np.int64]
    """(F,) whose face it is."""
    side: NDArray[np.int64]
    """(F,) which of its six."""


def faces_of(boxes: Boxes) -> Faces:
    """All faces that have an area."""
    corners = boxes.corners[:, FACES].reshape(-1, 4, 3)
    across = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    real = np.linalg.norm(across, axis=-1) > 1e-8
    box, side = np.divmod(np.arange(len(corners)), 6)
    return Faces(corners[real], unit(across[real]), box[real], side[real])


def rotation_rows(quaternions: Array) -> Array:
    """(N, 3, 3) rows: the axes in the world of frames turned by (N, 4) unit x, y, z, w."""
    x, y, z, w = np.moveaxis(np.asarray(quaternions, np.float64), -1, 0)
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)], -1),
            np.stack([2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)], -1),
            np.stack([2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)], -1),
        ],
        -2,
    )


# Filling ------------------------------------------------------------------------------------


class Lattice:
    """Places (u, v) of samples: rows of equal steps, each sample a little aside if `turned`.

    Two by two samples of a turned lattice have four different u and four different v: edges that
    are nearly level or upright get as many shades as slanted ones.
    """

    def __init__(
        self, shape: tuple[int, int], step: float, corner: Array, *, turned: bool = False
    ) -> None:
        rows, columns = shape
        self.shape, self.step, self.corner = shape, step, corner
        aside = 0.25 * step if turned else 0.0
        self.u = (corner[0] + step * (np.arange(columns) + 0.5)).astype(np.float32)
        self.v = (corner[1] + step * (np.arange(rows) + 0.5)).astype(np.float32)
        self.more_v = (aside * (1 - 2 * (np.arange(columns) % 2))).astype(np.float32)
        self.more_u = (aside * (2 * (np.arange(rows) % 2) - 1)).astype(np.float32)

    def linear(
        self, form: Array | tuple[float, float, float], rows: slice, columns: slice
    ) -> tuple[Pixels, Pixels]:
        """Two vectors whose outer sum is a u + b v + c, `form` = (a, b, c), in a window."""
        a, b, c = np.float32(form[0]), np.float32(form[1]), np.float32(form[2])
        across = a * self.u[columns] + b * self.more_v[columns]
        return across, a * self.more_u[rows] + b * self.v[rows] + c

    def window(self, low: Array, high: Array) -> tuple[slice, slice] | None:
        """Rows and columns between two corners (u, v), clipped; None if there are none."""
        rows, columns = self.shape
        u, v = self.corner
        left = max(int((low[0] - u) / self.step) - 1, 0)
        top = max(int((low[1] - v) / self.step) - 1, 0)
        right = min(int((high[0] - u) / self.step) + 2, columns)
        bottom = min(int((high[1] - v) / self.step) + 2, rows)
        return (slice(top, bottom), slice(left, right)) if left < right and top < bottom else None


def fill(
    lattice: Lattice,
    corners: Array,
    form: Array,
    values: Pixels,
    ids: NDArray[np.int16] | None = None,
    number: int = 0,
) -> None:
    """Fills a convex polygon (E, 2) where its value a u + b v + c is above that in `values`.

    `ids`, if given, becomes `number` there.
    """
    window = lattice.window(corners.min(0), corners.max(0))
    if window is None:
        return
    places = corners.tolist()
    ends = [*places[1:], places[0]]
    area = sum(u0 * v1 - v0 * u1 for (u0, v0), (u1, v1) in zip(places, ends, strict=True))
    if abs(area) < 1e-9:
        return
    turn = 1.0 if area > 0.0 else -1.0
    rows, columns = window
    across, down = lattice.linear(form, rows, columns)
    value = across[None, :] + down[:, None]
    target = values[window]
    hit = value > target
    for (u, v), (u1, v1) in zip(places, ends, strict=True):
        du, dv = turn * (u1 - u), turn * (v1 - v)
        if abs(du) + abs(dv) < 1e-9:
            continue
        across, down = lattice.linear((-dv, du, dv * u - du * v), rows, columns)
        hit &= across[None, :] >= -down[:, None]
    np.copyto(target, value, where=hit)
    if ids is not None:
        np.copyto(ids[window], np.int16(number), where=hit)


def picture_lattice(size: tuple[int, int]) -> Lattice:
    """The samples of a picture of `size` (W, H), u and v in pixels from the upper left."""
    n = SUPERSAMPLE
    return Lattice((size[1] * n, size[0] * n), 1.0 / n, np.zeros(2), turned=True)


def seen_forms(camera: Camera, faces: Faces) -> Array:
    """(F, 3) a, b, c of 1 / depth = a column + b row + c on each face; NaN if seen edge-on."""
    axes = camera.axes
    normal = faces.normal @ axes.T
    away = ((faces.corners[:, 0] - camera.eye) * faces.normal).sum(-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        n = normal / away[:, None]
    a, b = n[:, 0] / camera.focal, -n[:, 1] / camera.focal
    c = n[:, 2] - a * 0.5 * camera.size[0] - b * camera.horizon
    return np.stack([a, b, c], -1)


def draw_faces(
    camera: Camera,
    lattice: Lattice,
    faces: Faces,
    forms: Array,
    chosen: NDArray[np.bool_],
    inverse: Pixels,
    ids: NDArray[np.int16],
    first: int,
) -> None:
    """Draws the `chosen` (F,) faces that look at the camera: 1 / depth, and `first` + index."""
    towards = ((camera.eye - faces.corners[:, 0]) * faces.normal).sum(-1) > 1e-6
    points = camera.to_camera(faces.corners)
    depth = points[..., 2]
    for i in np.flatnonzero(towards & chosen & (depth.max(-1) > NEAR)):
        polygon = points[i]
        if depth[i].min() < NEAR:
            polygon = _beyond(polygon)
        scale = camera.focal / polygon[:, 2]
        corners = np.stack(
            [0.5 * camera.size[0] + scale * polygon[:, 0], camera.horizon - scale * polygon[:, 1]],
            -1,
        )
        fill(lattice, corners, forms[i], inverse, ids, first + int(i))


def _beyond(polygon: Array) -> Array:
    """The part of a polygon (E, 3), camera axes, that is at least `NEAR` away."""
    out = []
    for a, b in zip(polygon, np.roll(polygon, -1, 0), strict=True):
        if a[2] >= NEAR:
            out.append(a)
        if (a[2] >= NEAR) != (b[2] >= NEAR):
            out.append(a + (b - a) * ((NEAR - a[2]) / (b[2] - a[2])))
    return np.array(out)
