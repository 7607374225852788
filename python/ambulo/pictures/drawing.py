"""A small software renderer of rounded cones, in numpy alone, and the camera that it uses.

A body is a heap of rounded cones (the hull of two spheres), each of which may be squashed along one
axis; a ray meets one in closed form. The camera looks level and frames the picture by shifting the
lens, as an architect's camera does: uprights stay upright, and a picture row is one depth of level
ground, which is what keeps the ground cheap. Colours are display values in 0..1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Pixels = NDArray[np.floating]

SUPERSAMPLE = 2
NEAR = 0.2  # metres: nothing nearer than this is drawn
BLEND = 0.018  # metres: surfaces this close in depth melt into each other

SUN = np.array([-0.55, -1.0, 0.62])  # the way sunlight travels, camera axes: from behind, right

AMBIENT_BOUNCE_KEY = ((0.36, 0.15, 0.76), (0.38, 0.14, 0.73), (0.43, 0.12, 0.67))  # r, g, b


def unit(v: ArrayLike) -> Array:
    """`v` (..., 3) scaled to length 1; a zero vector stays zero."""
    v = np.asarray(v, np.float64)
    return v / np.maximum(np.sqrt((v * v).sum(-1, keepdims=True)), 1e-9)


@dataclass(frozen=True)
class Camera:
    """A level camera with a shifted lens."""

    eye: Array
    """(3,) metres."""
    yaw: float
    """Looks along (sin yaw, 0, cos yaw), radians."""
    focal: float
    """Pixels: a metre one metre away is this wide."""
    horizon: float
    """The picture row, in pixels from the top, of things at eye height."""
    size: tuple[int, int]
    """Width, height in pixels."""

    @property
    def axes(self) -> Array:
        """(3, 3) rows: right, up, forward in the world."""
        s, c = np.sin(self.yaw), np.cos(self.yaw)
        return np.array([[-c, 0.0, s], [0.0, 1.0, 0.0], [s, 0.0, c]])

    @property
    def sun(self) -> Array:
        """(3,) the way the light of a lamp fixed to this camera travels, in the world."""
        return unit(SUN) @ self.axes

    def to_camera(self, points: ArrayLike) -> Array:
        """World points (..., 3) as (right, up, depth) from the eye, metres."""
        return (np.asarray(points, np.float64) - self.eye) @ self.axes.T

    def project(self, points: ArrayLike) -> Array:
        """World points (..., 3) as (column, row, depth): pixels, pixels, metres."""
        p = self.to_camera(points)
        depth = np.maximum(p[..., 2], 1e-6)
        column = 0.5 * self.size[0] + self.focal * p[..., 0] / depth
        row = self.horizon - self.focal * p[..., 1] / depth
        return np.stack([column, row, p[..., 2]], -1)


@dataclass(frozen=True)
class Cones:
    """N rounded cones in the world, metres."""

    a: Array
    """(N, 3) centre of the first sphere."""
    b: Array
    """(N, 3) centre of the second."""
    ra: Array
    """(N,) radius of the first."""
    rb: Array
    """(N,) radius of the second."""
    axis: Array
    """(N, 3) unit axis that the cone is squashed along."""
    squash: Array
    """(N,) thickness along `axis` as a part of the round one; 1 is round."""
    colour: Array
    """(N, 3)"""


class Hit:
    """Where the rays of one screen box first meet one cone."""

    def __init__(self, box: tuple[slice, slice], t: Pixels, normal: list[Pixels]) -> None:
        self.box = box
        self.t = t  # metres along the ray; inf where it misses
        self.normal = normal  # three planes, camera axes, unit


def intersect(rays: list[Pixels], a: Array, b: Array, ra: float, rb: float) -> tuple:
    """Unit rays from the origin against a rounded cone.

    `rays` are three planes x, y, z of one shape. Returns the distance (inf where missed) and three
    planes of the normal, which is not yet unit. The quadric is Quilez's "rounded cone".
    """
    ba = b - a
    rr = ra - rb
    m0, m1, m5, m7 = float(ba @ ba), float(-(ba @ a)), float(a @ a), float(b @ b)
    d2 = m0 - rr * rr
    x, y, z = rays
    m3 = -(x * a[0] + y * a[1] + z * a[2])
    if d2 <= 1e-9:  # one sphere swallows the other
        r, centre = (ra, a) if ra >= rb else (rb, b)
        m3 = -(x * centre[0] + y * centre[1] + z * centre[2])
        h = m3 * m3 - (float(centre @ centre) - r * r)
        t = np.where(h >= 0.0, -m3 - np.sqrt(np.maximum(h, 0.0)), np.inf)
        safe = np.where(h >= 0.0, t, 0.0)
        return t, [x * safe - centre[0], y * safe - centre[1], z * safe - centre[2]]
    m2 = x * ba[0] + y * ba[1] + z * ba[2]
    k2 = np.maximum(d2 - m2 * m2, 1e-12)
    k1 = d2 * m3 - m2 * (m1 - rr * ra)
    k0 = d2 * m5 - m1 * m1 + m1 * rr * ra * 2.0 - m0 * ra * ra
    h = k1 * k1 - k0 * k2
    side = (-np.sqrt(np.maximum(h, 0.0)) - k1) / k2
    along = m1 - ra * rr + side * m2  # 0 at the first sphere's rim, d2 at the second's
    on_side = (along > 0.0) & (along < d2)
    h1 = m3 * m3 - (m5 - ra * ra)
    m6 = m3 - m2
    h2 = m6 * m6 - (m7 - rb * rb)
    t1 = np.where(h1 >= 0.0, -m3 - np.sqrt(np.maximum(h1, 0.0)), np.inf)
    t2 = np.where(h2 >= 0.0, -m6 - np.sqrt(np.maximum(h2, 0.0)), np.inf)
    t = np.where(on_side, side, np.minimum(t1, t2))
    t = np.where(h >= 0.0, t, np.inf)
    # The normal points from the axis point that is the centre of the touching sphere.
    s = np.where(on_side, along / d2, (t2 < t1).astype(along.dtype))
    safe = np.where(np.isfinite(t), t, 0.0)
    return t, [r * safe - (p + s * q) for r, p, q in zip(rays, a, ba, strict=True)]


@lru_cache(maxsize=4)
def _ray_planes(width: int, height: int, focal: float, horizon: float) -> tuple:
    """Unit camera-space rays through the supersampled pixels: planes x, y, z."""
    n = SUPERSAMPLE
    x = ((np.arange(width * n) + 0.5) / n - 0.5 * width) / focal
    y = (horizon - (np.arange(height * n) + 0.5) / n) / focal
    z = 1.0 / np.sqrt(1.0 + x[None, :] ** 2 + y[:, None] ** 2)
    return x[None, :] * z, y[:, None] * z, z


def _boxes(camera: Camera, a: Array, b: Array, ra: Array, rb: Array) -> NDArray[np.int64]:
    """(N, 4) left, top, right, bottom of each cone on the supersampled picture, clipped."""
    n, (width, height) = SUPERSAMPLE, camera.size
    low, high = [], []
    for centre, radius in ((a, ra), (b, rb)):
        depth = np.maximum(centre[:, 2] - radius, NEAR)
        mid = np.stack([centre[:, 0], -centre[:, 1]], -1) / np.maximum(centre[:, 2:], NEAR)
        reach = (radius / depth)[:, None] * np.sqrt(1.0 + mid * mid) * 1.05
        low.append(mid - reach)
        high.append(mid + reach)
    offset = np.array([0.5 * width, camera.horizon])
    first = np.floor((np.minimum(*low) * camera.focal + offset) * n).astype(np.int64)
    last = np.ceil((np.maximum(*high) * camera.focal + offset) * n).astype(np.int64) + 1
    limit = np.array([width * n, height * n])
    return np.concatenate([np.clip(first, 0, limit), np.clip(last, 0, limit)], -1)


def _trace(camera: Camera, cones: Cones) -> tuple[list[Hit], list[int]]:
    """Every cone's hits in its screen box, and the indices of the cones that are in view."""
    a, b = camera.to_camera(cones.a), camera.to_camera(cones.b)
    axis = cones.axis @ camera.axes.T
    boxes = _boxes(camera, a, b, cones.ra, cones.rb)
    planes = _ray_planes(*camera.size, camera.focal, camera.horizon)
    hits, seen = [], []
    for i, (left, top, right, bottom) in enumerate(boxes):
        behind = min(a[i, 2] - cones.ra[i], b[i, 2] - cones.rb[i]) < NEAR
        if behind or left >= right or top >= bottom:
            continue
        box = (slice(top, bottom), slice(left, right))
        rays = [plane[box] for plane in planes]
        t, normal = _trace_squashed(rays, a[i], b[i], cones, i, axis[i])
        hits.append(Hit(box, t, normal))
        seen.append(i)
    return hits, seen


def _trace_squashed(rays: list, a: Array, b: Array, cones: Cones, i: int, axis: Array) -> tuple:
    """`intersect` in the space in which the cone is round; unit normals outside it."""
    gain = 1.0 / cones.squash[i] - 1.0
    if gain == 0.0:
        t, normal = intersect(rays, a, b, cones.ra[i], cones.rb[i])
    else:
        along = gain * (rays[0] * axis[0] + rays[1] * axis[1] + rays[2] * axis[2])
        rays = [r + along * u for r, u in zip(rays, axis, strict=True)]
        stretch = 1.0 / np.sqrt(sum(r * r for r in rays))
        a, b = a + gain * (a @ axis) * axis, b + gain * (b @ axis) * axis
        t, normal = intersect([r * stretch for r in rays], a, b, cones.ra[i], cones.rb[i])
        t = t * stretch
        along = gain * (normal[0] * axis[0] + normal[1] * axis[1] + normal[2] * axis[2])
        normal = [n + along * u for n, u in zip(normal, axis, strict=True)]
    scale = 1.0 / np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2 + 1e-18)
    return t, [n * scale for n in normal]


@dataclass(frozen=True)
class Surface:
    """What a window of the picture sees of a heap of cones, on its samples."""

    rows: slice
    """Of the picture, in pixels."""
    columns: slice
    t: Array
    """(h, w) samples: metres along the ray, inf where it misses."""
    normal: Pixels
    """(3, h, w) unit, camera axes."""
    colour: Pixels
    """(3, h, w)"""
    rays: list[Pixels]
    """Three planes (h, w): unit rays, camera axes."""


def see_cones(camera: Camera, cones: Cones) -> Surface | None:
    """The nearest surface of `cones`; None if none is in view."""
    hits, seen = _trace(camera, cones)
    if not hits:
        return None
    n = SUPERSAMPLE
    top = min(h.box[0].start for h in hits) // n
    bottom = -(-max(h.box[0].stop for h in hits) // n)
    left = min(h.box[1].start for h in hits) // n
    right = -(-max(h.box[1].stop for h in hits) // n)
    boxes = [_moved(h.box, top * n, left * n) for h in hits]
    depth = np.full(((bottom - top) * n, (right - left) * n), np.inf)
    for hit, box in zip(hits, boxes, strict=True):
        np.minimum(depth[box], hit.t, out=depth[box])
    normal, colour = _melt(depth, hits, boxes, cones.colour[seen])
    window = (slice(top * n, bottom * n), slice(left * n, right * n))
    rays = [plane[window] for plane in _ray_planes(*camera.size, camera.focal, camera.horizon)]
    return Surface(slice(top, bottom), slice(left, right), depth, normal, colour, rays)


def draw_cones(picture: Pixels, camera: Camera, cones: Cones, sun: Array) -> None:
    """Draws `cones` over `picture` (H, W, 3), in place; `sun` (3,) is the way its light travels."""
    surface = see_cones(camera, cones)
    if surface is not None:
        lay_surface(picture, camera, surface, sun, np.isfinite(surface.t))


def lay_surface(
    picture: Pixels,
    camera: Camera,
    surface: Surface,
    sun: Array,
    inside: NDArray[np.bool_],
    bright: Pixels | None = None,
) -> None:
    """Lays the samples `inside` (h, w) of a surface over `picture` (H, W, 3), in place.

    `bright`: (P,) what the light of each of those samples is multiplied by, for shadows.
    """
    n = SUPERSAMPLE
    view = np.stack([plane[inside] for plane in surface.rays]).astype(np.float32)
    layer = np.zeros((4, *inside.shape), np.float32)
    to_sun = camera.axes @ unit(-sun)
    light = _shade(surface.normal[:, inside], view, surface.colour[:, inside], to_sun)
    layer[:3, inside] = light if bright is None else light * bright
    layer[3, inside] = 1.0
    height, width = inside.shape[0] // n, inside.shape[1] // n
    layer = layer.reshape(4, height, n, width, n)
    small = sum(layer[:, :, i, :, j] for i in range(n) for j in range(n)) / np.float32(n * n)
    small = np.moveaxis(np.asarray(small), 0, -1)
    target = picture[surface.rows, surface.columns]
    target *= 1.0 - small[..., 3:]
    target += small[..., :3]


def _melt(
    depth: Array, hits: list[Hit], boxes: list[tuple[slice, slice]], colours: Array
) -> tuple[Pixels, Pixels]:
    """Unit normals and colours (3, h, w): of the nearest surface, melting where two cones meet.

    `depth` (h, w) is the nearest hit. Each hit counts by exp(-metres behind it / BLEND).
    """
    total = np.zeros((7, *depth.shape), np.float32)
    for hit, box, colour in zip(hits, boxes, colours, strict=True):
        with np.errstate(invalid="ignore"):  # inf - inf where nothing is hit
            behind = (hit.t - depth[box]) * (-1.0 / BLEND)
        weight = np.exp(np.where(behind > -8.0, behind, -80.0)).astype(np.float32)
        total[0][box] += weight
        for k in range(3):
            total[1 + k][box] += weight * hit.normal[k]
            total[4 + k][box] += weight * np.float32(colour[k])
    normal, colour = total[1:4], total[4:7]
    normal /= np.sqrt(_dot(normal, normal) + np.float32(1e-12))
    colour /= np.maximum(total[0], np.float32(1e-12))
    return normal, colour


def _dot(a: Pixels, b: Pixels | Array) -> Pixels:
    """Dot product along the first axis, which has length 3."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _moved(box: tuple[slice, slice], top: int, left: int) -> tuple[slice, slice]:
    """`box` counted from another corner."""
    rows, columns = box
    return (
        slice(rows.start - top, rows.stop - top),
        slice(columns.start - left, columns.stop - left),
    )


def _shade(normal: Pixels, view: Pixels, colour: Pixels, to_sun: Array) -> Pixels:
    """Colours (3, P) of P surface points; `normal`, `view` (3, P), `to_sun` (3,): camera axes."""
    towards = to_sun.astype(np.float32)[:, None]
    sun = _dot(normal, towards)
    lit = np.clip(0.80 * sun + 0.20, 0.0, 1.0)  # wrapped: skin and felt have no hard terminator
    sky = 0.5 + 0.5 * normal[1]
    facing = np.clip(-_dot(normal, view), 0.0, 1.0)
    rim = (1.0 - facing) ** 3 * (0.35 + 0.65 * sky)
    half = towards - view
    gloss = np.clip(_dot(normal, half) / np.sqrt(_dot(half, half) + 1e-9), 0.0, 1.0) ** 24
    fill = 0.20 * facing  # from the camera: nothing is ever black
    light = np.stack(
        [
            ambient * (0.35 + 0.65 * sky) + bounce * (1.0 - sky) + key * lit + fill
            for ambient, bounce, key in AMBIENT_BOUNCE_KEY
        ]
    )
    light *= 0.70 + 0.30 * facing  # edges turn into themselves: reads as round
    return np.clip(colour * light + (0.16 * rim + 0.07 * gloss), 0.0, 1.0)
