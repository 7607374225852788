"""Sky, gridded ground and the soft shadows on it, seen by a level camera, in numpy alone.

On level ground a picture row is one depth, so everything is in closed form; a height field is
walked column by column. Colours are display values in 0..1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ambulo.pictures.drawing import NEAR, Array, Camera, Cones, Pixels, unit
from ambulo.recording import Flat, Floats, Heights

FAR = 90.0  # metres: all fog from here
HAZE = 30.0  # metres: what is this far has kept 1 / e of its colour

SKY_TOP = np.array([0.720, 0.785, 0.850], np.float32)
HORIZON = np.array([0.905, 0.915, 0.920], np.float32)
GROUND = np.array([0.800, 0.788, 0.768], np.float32)
GRID = np.array([0.635, 0.622, 0.606], np.float32)
SHADOW = np.array([0.255, 0.262, 0.310], np.float32)


@dataclass(frozen=True)
class GroundView:
    """What each pixel of the picture sees of the ground."""

    picture: Pixels
    """(H, W, 3) sky and ground."""
    x: Pixels
    """(R, W) world x of the ground seen, metres; R rows from row `top` down."""
    z: Pixels
    """(R, W) world z."""
    y: Pixels
    """(R, W) or (1, 1) world height."""
    depth: Pixels
    """(R, W) or (R, 1) metres along the camera's forward axis."""
    top: int


def draw_ground(camera: Camera, terrain: Heights, sun: Array, *, grid: bool = True) -> GroundView:
    """Sky, ground and its metre grid; `sun` (3,) is the way the light travels."""
    if isinstance(terrain, Flat):
        x, y, z, depth, top = _level_points(camera, terrain.level)
        light = np.ones((1, 1, 1), np.float32)
    else:
        x, y, z, depth, slope_x, slope_z = field_points(camera, terrain)
        top = 0
        light = slope_light(slope_x, slope_z, sun)
    picture = np.empty((camera.size[1], camera.size[0], 3), np.float32)
    picture[:] = sky(camera)[:, None]
    fog = (1.0 - np.exp(-((depth / HAZE) ** 2)))[..., None].astype(np.float32)
    pool = 1.0 + 0.05 * np.exp(-((depth / 9.0) ** 2))[..., None].astype(np.float32)
    base = GROUND * light * pool
    if grid:
        lines = (grid_cover(camera, x, y, z, depth) * 0.75)[..., None]
        base = base + lines * (GRID * light - base)
    ground = base + fog * (HORIZON - base)
    if top == 0 and not isinstance(terrain, Flat):
        seen = (depth < FAR)[..., None]
        picture[:] = np.where(seen, ground, picture)
    else:
        picture[top:] = ground
    return GroundView(picture, x, z, y, depth, top)


def sky(camera: Camera) -> Pixels:
    """(H, 3) the sky's colour by row."""
    rows = np.arange(camera.size[1], dtype=np.float32) + 0.5
    up = np.clip((camera.horizon - rows) / camera.focal / 0.30, 0.0, 1.0)[:, None]
    return HORIZON + (up**0.8) * (SKY_TOP - HORIZON)


def _columns(camera: Camera) -> Pixels:
    """(W,) metres to the right, a metre of depth, of each picture column."""
    width = camera.size[0]
    return ((np.arange(width) + 0.5 - 0.5 * width) / camera.focal).astype(np.float32)


def _level_points(camera: Camera, level: float) -> tuple:
    """x, y, z, depth of the ground that each pixel sees, and the first row that sees any."""
    height = float(camera.eye[1]) - level
    rows = np.arange(camera.size[1]) + 0.5 - camera.horizon
    top = int(np.searchsorted(rows, camera.focal * height / FAR))
    depth = (camera.focal * height / rows[top:, None]).astype(np.float32)
    (rx, _, rz), _, (fx, _, fz) = camera.axes
    right = _columns(camera)
    x = np.float32(camera.eye[0]) + depth * (np.float32(fx) + right * np.float32(rx))
    z = np.float32(camera.eye[2]) + depth * (np.float32(fz) + right * np.float32(rz))
    return x, np.full((1, 1), level, np.float32), z, depth, top


def field_points(camera: Camera, terrain: Heights) -> tuple:
    """x, y, z, depth and slopes of the height field at every pixel; depth is FAR for sky.

    A picture column is a vertical plane (the camera looks level), so each column is walked from
    near to far once; what a hill hides is what does not rise above all that came before it.
    """
    count = 240
    depths = np.geomspace(0.5, FAR, count)[:, None]
    (rx, _, rz), _, (fx, _, fz) = camera.axes
    right = _columns(camera)[None, :].astype(np.float64)
    x, z = camera.eye[0] + depths * (fx + right * rx), camera.eye[2] + depths * (fz + right * rz)
    y = np.asarray(terrain.height(x, z), np.float64)
    rows = camera.horizon - camera.focal * (y - camera.eye[1]) / depths
    highest = np.minimum.accumulate(rows, 0) - 1e-7 * np.arange(count)[:, None]
    wanted = np.arange(camera.size[1]) + 0.5
    place = np.empty((len(wanted), camera.size[0]))
    order = np.arange(count - 1, -1, -1, dtype=np.float64)
    for i in range(camera.size[0]):
        place[:, i] = np.interp(wanted, highest[::-1, i], order, left=count - 1, right=0.0)
    step = 0.05
    slope_x = (terrain.height(x + step, z) - y) / step
    slope_z = (terrain.height(x, z + step) - y) / step
    low = np.minimum(place.astype(np.int64), count - 2)
    part, column = place - low, np.arange(camera.size[0])[None, :]
    y, slope_x, slope_z = (
        (v[low, column] * (1.0 - part) + v[low + 1, column] * part).astype(np.float32)
        for v in (y, slope_x, slope_z)
    )
    depth = 0.5 * (FAR / 0.5) ** (place / (count - 1))
    depth = np.where(place >= count - 1.5, FAR, depth).astype(np.float32)
    right = right.astype(np.float32)
    x = np.float32(camera.eye[0]) + depth * (np.float32(fx) + right * np.float32(rx))
    z = np.float32(camera.eye[2]) + depth * (np.float32(fz) + right * np.float32(rz))
    return x, y, z, depth, slope_x, slope_z


def slope_light(slope_x: Pixels, slope_z: Pixels, light: Array) -> Pixels:
    """(R, W, 1) brightness of sloping ground; level ground is 1."""
    sun = unit(-light)
    size = np.sqrt(1.0 + slope_x * slope_x + slope_z * slope_z)
    towards = (sun[1] - sun[0] * slope_x - sun[2] * slope_z) / size
    return np.clip(1.0 + 0.55 * (towards - sun[1]), 0.5, 1.15).astype(np.float32)[..., None]


def grid_cover(camera: Camera, x: Pixels, y: Pixels, z: Pixels, depth: Pixels) -> Pixels:
    """(R, W) how much of each pixel is covered by the lines of the metre grid.

    The line pattern is integrated over the pixel's footprint (a box filter in closed form), so
    that it fades to its mean instead of shimmering.
    """
    (rx, _, rz), _, (fx, _, fz) = camera.axes
    across = depth / camera.focal
    drop = np.maximum(camera.eye[1] - y, 0.05)
    along = np.minimum(depth * across / drop, 4.0)
    width_x = np.hypot(across * rx, along * fx).astype(np.float32)
    width_z = np.hypot(across * rz, along * fz).astype(np.float32)
    lines_x, lines_z = _lines(x, width_x), _lines(z, width_z)
    return lines_x + lines_z - lines_x * lines_z


def _lines(p: Pixels, width: Pixels, thick: float = 0.024) -> Pixels:
    """Part of the interval of `width` around `p` that lies within `thick` / 2 of a whole number."""
    half = 0.5 * np.maximum(width, 0.004).astype(np.float32)
    shift = np.float32(0.5 * thick)
    first, last = p - half + shift, p + half + shift
    low, high = np.floor(first), np.floor(last)
    t = np.float32(thick)
    covered = (high - low) * t + np.minimum(last - high, t) - np.minimum(first - low, t)
    return covered / (2.0 * half)


@dataclass(frozen=True)
class Shadow:
    """How much light a heap of cones takes away, on a plane square to the light."""

    axes: Array
    """(2, 3) the plane's axes in the world."""
    origin: Array
    """(2,) plane coordinates of the centre of cell 0, 0."""
    cell: float
    """Metres."""
    mask: Pixels
    """(rows, columns) 0 lit .. 1 dark; row along `axes[1]`."""
    corners: Array
    """(4, 3) where the corners of the mask fall on level ground."""


def cast_shadow(
    cones: Cones,
    light: Array,
    level: float,
    *,
    spread: float,
    sharp: float = 0.012,
    fade: float = np.inf,
) -> Shadow:
    """The shadow that `cones` cast along `light` (3,), for ground near height `level`.

    The edge of a part that is h metres above the ground is `sharp + spread * h` metres soft, and
    its weight is exp(-h / fade).
    """
    cell = 0.025
    light = unit(light)
    rise_a = np.maximum(cones.a[:, 1] - cones.ra - level, 0.0)
    rise_b = np.maximum(cones.b[:, 1] - cones.rb - level, 0.0)
    first = unit(np.cross(light, [0.0, 0.0, 1.0]))
    axes = np.stack([first, np.cross(light, first)])
    a, b = cones.a @ axes.T, cones.b @ axes.T
    soft_a, soft_b = sharp + spread * rise_a, sharp + spread * rise_b
    margin = (np.maximum(cones.ra, cones.rb) + np.maximum(soft_a, soft_b))[:, None]
    low, high = np.minimum(a, b) - margin, np.maximum(a, b) + margin
    origin = low.min(0) - 2.0 * cell
    columns, rows = np.ceil((high.max(0) - origin) / cell).astype(int) + 3
    mask = np.zeros((rows, columns), np.float32)
    for i in range(len(a)):
        if min(rise_a[i], rise_b[i]) > 3.0 * fade:
            continue  # too high to be seen
        c0, r0 = np.floor((low[i] - origin) / cell).astype(int)
        c1, r1 = np.ceil((high[i] - origin) / cell).astype(int) + 1
        px = (origin[0] + cell * np.arange(c0, c1))[None, :] - a[i, 0]
        py = (origin[1] + cell * np.arange(r0, r1))[:, None] - a[i, 1]
        bx, by = b[i] - a[i]
        s = np.clip((px * bx + py * by) / max(bx * bx + by * by, 1e-9), 0.0, 1.0)
        away = np.hypot(px - s * bx, py - s * by) - (cones.ra[i] + s * (cones.rb - cones.ra)[i])
        soft = soft_a[i] + s * (soft_b - soft_a)[i]
        part = np.clip(0.5 - 0.5 * away / soft, 0.0, 1.0)
        weight = np.exp(-(rise_a[i] + s * (rise_b - rise_a)[i]) / fade)
        box = (slice(r0, r1), slice(c0, c1))
        np.maximum(mask[box], weight * part * part * (3.0 - 2.0 * part), out=mask[box])
    ends = origin + cell * np.array([[0, 0], [columns, 0], [0, rows], [columns, rows]])
    flat = ends @ axes
    corners = flat - light * ((flat[:, 1:2] - level) / light[1])
    return Shadow(axes, origin, cell, mask, corners)


def lay_shadow(ground: GroundView, camera: Camera, shadow: Shadow, strength: float) -> None:
    """Darkens `ground.picture` by `shadow`, in place."""
    width, height = camera.size
    seen = camera.project(shadow.corners)
    if (seen[:, 2] < NEAR).any():
        left, top, right, bottom = 0, ground.top, width, height
    else:
        margin = 0 if ground.y.size == 1 else 40  # hills move a shadow up or down the picture
        left, top = np.floor(seen[:, :2].min(0)).astype(int) - margin
        right, bottom = np.ceil(seen[:, :2].max(0)).astype(int) + margin
        left, right = np.clip([left, right], 0, width)
        top, bottom = np.clip([top, bottom], ground.top, height)
    if left >= right or top >= bottom:
        return
    box = (slice(top - ground.top, bottom - ground.top), slice(left, right))
    y = ground.y if ground.y.size == 1 else ground.y[box]
    dark = strength * shadow_at(shadow, ground.x[box], y, ground.z[box])[..., None]
    target = ground.picture[top:bottom, left:right]
    target += dark * (SHADOW - target)


def shadow_at(shadow: Shadow, x: Pixels, y: Pixels, z: Pixels) -> Pixels:
    """0 lit .. 1 dark at points of one shape, metres."""
    u, v = (x * e[0] + z * e[2] + (y * e[1] - o) for e, o in zip(*_in_cells(shadow), strict=True))
    return _bilinear(shadow.mask, v, u)


def _in_cells(shadow: Shadow) -> tuple[Pixels, Pixels]:
    """The mask's axes (2, 3) and origin (2,) in cells, as float32."""
    axes, origin = shadow.axes / shadow.cell, shadow.origin / shadow.cell
    return axes.astype(np.float32), origin.astype(np.float32)


def _bilinear(mask: Pixels, row: Floats, column: Floats) -> Pixels:
    """`mask` at fractional cells; 0 outside it."""
    rows, columns = mask.shape
    inside = (row >= 0.0) & (row < rows - 1) & (column >= 0.0) & (column < columns - 1)
    row, column = np.where(inside, row, 0.0), np.where(inside, column, 0.0)
    r, c = row.astype(np.int32), column.astype(np.int32)
    fr, fc = (row - r).astype(np.float32), (column - c).astype(np.float32)
    flat, at = mask.ravel(), r * columns + c
    upper = flat.take(at) * (1.0 - fc) + flat.take(at + 1) * fc
    lower = flat.take(at + columns) * (1.0 - fc) + flat.take(at + columns + 1) * fc
    return np.where(inside, upper * (1.0 - fr) + lower * fr, 0.0).astype(np.float32)
