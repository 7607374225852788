"""The colours of what the pixels of a scene see: ground, walls and objects in sun and shade."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ambulo.pictures.drawing import AMBIENT_BOUNCE_KEY, Array, Camera, Pixels
from ambulo.pictures.ground import (
    FAR,
    GRID,
    GROUND,
    HAZE,
    HORIZON,
    SHADOW,
    Shadow,
    grid_cover,
    shadow_at,
    sky,
    slope_light,
)
from ambulo.pictures.scene_pattern import line, pattern
from ambulo.pictures.scene_set import TERRAIN, own_place
from ambulo.pictures.solids import Boxes, Faces
from ambulo.pictures.sunlight import GRAZING, Contact, SunMap
from ambulo.recording import Floats

if TYPE_CHECKING:
    from ambulo.pictures.scene_paint import Painter

SHADED = 0.60  # how far the ground goes towards the colour of shadow
FILL, KEY = 0.26, 0.82  # light from everywhere, and the part of the sun's, on flat faces
SUNLESS = 0.88  # how much of the sun's light a shadow takes from a thing
ALONG = {0: (2, 1), 1: (0, 2), 2: (0, 1)}  # the axes u, v of faces across x, y and z


@dataclass(frozen=True)
class Lit:
    """What takes light away at one moment."""

    sun: SunMap
    """Everything."""
    things: SunMap
    """All but the figure."""
    contact: Contact
    feet: Shadow | None
    """What the figure dims close below it."""
    level: float
    """Height of the ground under the figure, metres."""


class Setting:
    """All that the colour of a pixel depends on, as tables by what it sees.

    Row 0 of each table is the ground, row f + 1 the face f.
    """

    def __init__(
        self,
        painter: Painter,
        camera: Camera,
        boxes: Boxes,
        faces: Faces,
        forms: Array,
        field: tuple | None,
        lit: Lit,
    ) -> None:
        self.painter, self.camera, self.lit, self.field = painter, camera, lit, field
        self.boxes, self.faces, self.forms = boxes, faces, forms
        level = 1.0 / (camera.focal * max(float(camera.eye[1]) - painter.props.level, 1e-3))
        ground = np.array([[0.0, level, -level * camera.horizon]])
        self.form = _table(np.concatenate([ground, np.nan_to_num(forms, posinf=0.0, neginf=0.0)]))
        normal = np.concatenate([[[0.0, 1.0, 0.0]], faces.normal])
        self.slope = _table(painter.sun.slopes(normal))
        look = boxes.look[faces.box]
        self.looks = np.concatenate([[TERRAIN], look])
        self.is_ground = (self.looks == TERRAIN) & (normal[:, 1] > 0.3)
        light = painter.sun.light
        up = np.maximum(normal[:, 1], 0.05)
        self.brightness = slope_light(-normal[:, 0] / up, -normal[:, 2] / up, light)[:, 0]
        facing = normal @ -light
        self.faces_sun = facing > GRAZING
        # How far off a surface its shadows are looked for: the more the flatter the light.
        self.lifted = _table(
            (0.012 + 0.03 * np.clip(1.0 - facing, 0.0, 1.0) ** 4)[:, None] * normal
        )
        self.ambient, self.key = _lights(normal, light)
        colour = np.concatenate([GROUND[None], boxes.colour[faces.box]])
        self.colour = _table(colour)
        foot = boxes.corners[..., 1].min(-1)[faces.box]
        self.foot = np.concatenate([[-1e3], foot]).astype(np.float32)
        self.upright = np.concatenate([[False], np.abs(faces.normal[:, 1]) < 0.5])

    @cached_property
    def sky(self) -> Pixels:
        """(3, H) by row."""
        return np.ascontiguousarray(sky(self.camera).T)

    @cached_property
    def across(self) -> tuple[Pixels, Pixels]:
        """(8, F + 1) and (2, F + 1): u = (8 rows) . (x, y, z, 1), v likewise; half sizes."""
        faces, boxes = self.faces, self.boxes
        axis = faces.side // 2
        pick = np.array([ALONG[a] for a in range(3)])[axis]
        rows, halves = [], []
        for k in range(2):
            along = boxes.axes[faces.box, pick[:, k]]
            start = (along * boxes.centre[faces.box]).sum(-1)
            rows.append(np.concatenate([along, -start[:, None]], -1))
            halves.append(boxes.half[faces.box, pick[:, k]])
        table = np.concatenate([np.zeros((1, 8)), np.concatenate(rows, -1)])
        return _table(table), _table(np.concatenate([[[1.0, 1.0]], np.stack(halves, -1)]))


def _table(rows: Floats) -> Pixels:
    """(K, N) from (N, K), float32."""
    return np.ascontiguousarray(np.asarray(rows).T, np.float32)


def _lights(normal: Array, light: Array) -> tuple[Pixels, Pixels]:
    """(3, N) light that is everywhere, and what the sun adds, on surfaces of `normal` (N, 3)."""
    up = 0.5 + 0.5 * normal[:, 1]
    sun = np.clip(0.86 * (normal @ -light) + 0.06, 0.0, 1.0)
    ambient = [a * (0.35 + 0.65 * up) + b * (1.0 - up) + FILL for a, b, _ in AMBIENT_BOUNCE_KEY]
    key = [KEY * k * sun for _, _, k in AMBIENT_BOUNCE_KEY]
    return np.array(ambient, np.float32), np.array(key, np.float32)


@dataclass
class _Spots:
    """P places that pixels see."""

    ids: NDArray[np.intp]
    """(P,) row of the setting's tables."""
    depth: Pixels
    x: Pixels
    y: Pixels
    z: Pixels
    slopes: tuple[Pixels, Pixels] | None
    """How the ground rises along x and z; None where it is level or flat in pieces."""
    dark: Pixels
    """(P,) how much of the sun is hidden."""

    def take(self, some: NDArray[np.intp]) -> _Spots:
        """Some of them, without their slopes."""
        depth, x, y, z, dark = (
            plane.take(some) for plane in (self.depth, self.x, self.y, self.z, self.dark)
        )
        return _Spots(self.ids.take(some), depth, x, y, z, None, dark)


def shade_pixels(setting: Setting, pixels: NDArray[np.intp], ids: NDArray[np.int16]) -> Pixels:
    """(3, P) colours of `pixels` (P,), counted along rows, if they see `ids` (P,)."""
    out = np.empty((3, len(pixels)), np.float32)
    row = (pixels // setting.camera.size[0]).astype(np.int32)
    column = (pixels - row * setting.camera.size[0]).astype(np.float32)
    number = ids.astype(np.intp)
    ground = setting.is_ground.take(number)
    for kind, chosen in (
        (None, number < 0),
        (_ground, ground & (number >= 0)),
        (_things, ~ground & (number >= 0)),
    ):
        some = np.flatnonzero(chosen)
        if not some.size:
            continue
        if kind is None:
            _put(out, some, setting.sky.take(row.take(some), 1))
            continue
        spots = _spots(setting, pixels.take(some), row.take(some), column.take(some),
                       number.take(some))  # fmt: skip
        colours = kind(setting, spots)
        fog = 1.0 - np.exp(-((spots.depth * np.float32(1.0 / HAZE)) ** 2))
        for plane, far in zip(colours, HORIZON, strict=True):
            plane += fog * (far - plane)
        _put(out, some, colours)
    return out


def _put(out: Pixels, some: NDArray[np.intp], colours: Pixels) -> None:
    for plane, values in zip(out, colours, strict=True):
        plane[some] = values


def _spots(
    setting: Setting,
    pixels: NDArray[np.intp],
    row: NDArray[np.int32],
    column: Pixels,
    number: NDArray[np.intp],
) -> _Spots:
    """The places that pixels see."""
    camera = setting.camera
    column, level = column + np.float32(0.5), row.astype(np.float32) + np.float32(0.5)
    a, b, c = (plane.take(number) for plane in setting.form)
    depth = 1.0 / np.maximum(a * column + b * level + c, np.float32(0.9 / FAR))
    slope, slopes = setting.slope.take(number, 1), None
    if setting.field is not None:
        slopes = _hills(setting, pixels, number, depth, slope)
    (rx, _, rz), _, (fx, _, fz) = (axis.astype(np.float32) for axis in camera.axes)
    ex, ey, ez = (np.float32(value) for value in camera.eye)
    right = (column - np.float32(0.5 * camera.size[0])) * np.float32(1.0 / camera.focal)
    rise = (np.float32(camera.horizon) - level) * np.float32(1.0 / camera.focal)
    x, y, z = ex + depth * (fx + right * rx), ey + depth * rise, ez + depth * (fz + right * rz)
    points = setting.lifted.take(number, 1)
    points += np.stack([x, y, z])
    facing = setting.faces_sun.take(number)
    dark = setting.painter.sun.shade(setting.lit.sun, points, slope, facing)
    return _Spots(number, depth, x, y, z, slopes, dark)


def _hills(
    setting: Setting, pixels: NDArray[np.intp], number: NDArray[np.intp], depth: Pixels,
    slope: Pixels,
) -> tuple[Pixels, Pixels]:  # fmt: skip
    """Corrects `depth` and `slope` where the ground is seen; the ground's own slopes."""
    assert setting.field is not None
    hills = np.flatnonzero(number == 0)
    at = pixels.take(hills)
    depth[hills] = setting.field[3].ravel().take(at)
    slope_x, slope_z = np.zeros_like(depth), np.zeros_like(depth)
    slope_x[hills] = setting.field[4].ravel().take(at)
    slope_z[hills] = setting.field[5].ravel().take(at)
    normal = np.stack([-slope_x[hills], np.ones(len(hills), np.float32), -slope_z[hills]], -1)
    normal /= np.sqrt((normal * normal).sum(-1, keepdims=True))
    slope[:, hills] = setting.painter.sun.slopes(normal).T
    return slope_x, slope_z


# Ground -------------------------------------------------------------------------------------


def _ground(setting: Setting, at: _Spots) -> Pixels:
    """(3, P) gridded ground, with the borders of its pieces, in sun and shade."""
    light = setting.brightness.take(at.ids)
    if at.slopes is not None:
        sloped = slope_light(*at.slopes, setting.painter.sun.light)[..., 0]
        light = np.where(at.ids == 0, sloped, light)
    pool = 1.0 + 0.05 * np.exp(-((at.depth * np.float32(1.0 / 9.0)) ** 2))
    base = GROUND[:, None] * (light * pool)
    lines = grid_cover(setting.camera, at.x, at.y, at.z, at.depth) * np.float32(0.75)
    lines = np.maximum(lines, np.float32(0.9) * _borders(setting, at))
    base += lines * (GRID[:, None] * light - base)
    contact = setting.lit.contact.at(at.x, at.z)
    feet = setting.lit.feet
    if feet is not None:
        near = np.flatnonzero(np.abs(at.y - np.float32(setting.lit.level)) < 0.45)
        more = 0.6 * shadow_at(feet, at.x[near], at.y[near], at.z[near])
        contact[near] = np.maximum(contact[near], more)
    dark = np.float32(SHADED) * at.dark
    dark += (1.0 - dark) * np.float32(0.8) * contact
    base += dark * (SHADOW[:, None] - base)
    return base


def _borders(setting: Setting, at: _Spots) -> Pixels:
    """(P,) how much of each pixel the borders of pieces of ground cover."""
    cover = np.zeros(len(at.depth), np.float32)
    size = at.depth * np.float32(1.0 / setting.camera.focal)
    drop = np.maximum(setting.camera.eye[1] - at.y, np.float32(0.3)).astype(np.float32)
    along = np.minimum(size * np.maximum(at.depth / drop, 1.0), 0.5)
    half = np.float32(0.022)
    raised = np.flatnonzero(at.ids)  # edges of steps and platforms
    if raised.size:
        u, v, hu, hv, size_there = _on_face(setting, at.take(raised))
        edge = np.minimum(hu - np.abs(u), hv - np.abs(v))
        cover[raised] = line(edge, 0.018, np.maximum(size_there, 0.6 * along.take(raised)))
    for piece in setting.painter.recording.patches:
        if max(piece.size) > 40.0:
            continue
        u, v = own_place(piece, at.x, at.z)
        out = np.maximum(
            np.abs(u) - np.float32(0.5 * piece.size[0]), np.abs(v) - np.float32(0.5 * piece.size[1])
        )
        part = np.clip((half - np.abs(out)) / along + 0.5, 0.0, 1.0)
        part *= np.minimum(2.0 * half / along, 1.0)
        np.maximum(cover, part, out=cover)
    return cover


# Things -------------------------------------------------------------------------------------


def _things(setting: Setting, at: _Spots) -> Pixels:
    """(3, P) walls, objects, and the upright sides of the ground."""
    colour = setting.colour.take(at.ids, 1) * pattern(
        setting.looks.take(at.ids), *_on_face(setting, at)
    )
    above = np.maximum(at.y - setting.foot.take(at.ids), 0.0)
    dim = np.where(setting.upright.take(at.ids), np.exp(above * np.float32(-1.0 / 0.14)), 0.0)
    sun = setting.key.take(at.ids, 1) * (1.0 - np.float32(SUNLESS) * at.dark)
    light = setting.ambient.take(at.ids, 1) + sun
    return np.minimum(colour * light * (1.0 - np.float32(0.22) * dim), 1.0)


def _on_face(setting: Setting, at: _Spots) -> tuple[Pixels, Pixels, Pixels, Pixels, Pixels]:
    """(P,) places u, v from each face's middle, half its sizes along them, and a pixel's size."""
    table, halves = setting.across
    rows = table.take(at.ids, 1)
    u = rows[0] * at.x + rows[1] * at.y + rows[2] * at.z + rows[3]
    v = rows[4] * at.x + rows[5] * at.y + rows[6] * at.z + rows[7]
    hu, hv = halves.take(at.ids, 1)
    return u, v, hu, hv, at.depth * np.float32(1.3 / setting.camera.focal)
