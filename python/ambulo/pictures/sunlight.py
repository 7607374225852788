"""Soft shadows between all things of a scene: what the sun reaches first, and what stands close.

The sun's map is a picture taken from the sun: each cell holds how near to the sun the first surface
is. A point is dark as far as surfaces around its own cell are nearer; the farther off what shades
it, the wider the look around, which is what makes a shadow soft.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ambulo.pictures.drawing import Array, Cones, Pixels, unit
from ambulo.pictures.solids import Boxes, Faces, Lattice, fill

BLOCK = 7  # cells: how coarsely it is first asked whether anything could shade a point
SPREAD = 0.045  # metres of softness a metre of way
SOFTEST = 0.12  # metres
GRAZING = 0.05  # sine of the sun's height over a surface below which it does not reach it
TAPS = 12
FIRST = [0, 9, 10, 11]  # of the taps, which run outward
MOST = 3_000_000  # cells
NOTHING = np.float32(-1e6)


@dataclass(frozen=True)
class SunMap:
    """How near the sun's first surfaces are."""

    near: Pixels
    """(R, C) metres towards the sun; very low where there is nothing."""
    coarse: Pixels
    """The greatest of each block of `near` and of the blocks around it: how much may be shaded."""
    least: Pixels
    """The least of them: how much surely is."""


class Sun:
    """Parallel light, and the region in which it casts shadows."""

    def __init__(self, light: Array, points: Array) -> None:
        """`light` (3,): the way it travels; `points` (N, 3): what may cast a shadow lies there."""
        self.light = unit(light)
        first = unit(np.cross(self.light, [0.0, 0.0, 1.0]))
        self.axes = np.stack([first, np.cross(self.light, first)])
        flat = points @ self.axes.T
        low, high = flat.min(0) - 0.5, flat.max(0) + 0.5
        self.cell = max(0.02, float(np.sqrt(np.prod(high - low) / MOST)))
        columns, rows = (np.ceil((high - low) / self.cell / BLOCK).astype(int) * BLOCK).tolist()
        self.lattice = Lattice((rows, columns), self.cell, low)
        angle = np.arange(TAPS) * 2.39996
        self.taps = np.sqrt((np.arange(TAPS) + 0.5) / TAPS) * np.stack(
            [np.cos(angle), np.sin(angle)]
        )

    def empty(self) -> Pixels:
        """A map of nothing."""
        return np.full(self.lattice.shape, NOTHING, np.float32)

    def add_faces(self, near: Pixels, faces: Faces) -> None:
        """Enters the faces that look at the sun."""
        to_sun = -self.light
        for corners, normal in zip(faces.corners, faces.normal, strict=True):
            facing = float(normal @ to_sun)
            if facing < GRAZING:
                continue
            fill(self.lattice, corners @ self.axes.T, self._form(corners[0], normal), near)

    def _form(self, point: Array, normal: Array) -> Array:
        """(3,) a, b, c of nearness = a u + b v + c on a plane."""
        slope = self.slopes(normal[None])[0]
        at = self.axes @ point
        return np.array([*slope, float(-self.light @ point) - float(slope @ at)])

    def slopes(self, normal: Array) -> Array:
        """(N, 2) how nearness to the sun changes along u and v on surfaces of `normal` (N, 3)."""
        facing = normal @ -self.light
        facing = np.where(np.abs(facing) < GRAZING, np.copysign(GRAZING, facing), facing)
        return -(normal @ self.axes.T) / facing[:, None]

    def add_cones(self, near: Pixels, cones: Cones) -> None:
        """Enters rounded cones, as if they were round."""
        a, b = cones.a @ self.axes.T, cones.b @ self.axes.T
        up_a, up_b = cones.a @ -self.light, cones.b @ -self.light
        radius = np.maximum(cones.ra, cones.rb)[:, None]
        low, high = np.minimum(a, b) - radius, np.maximum(a, b) + radius
        for i in range(len(a)):
            window = self.lattice.window(low[i], high[i])
            if window is None:
                continue
            rows, columns = window
            px = self.lattice.u[columns][None, :] - np.float32(a[i, 0])
            py = self.lattice.v[rows][:, None] - np.float32(a[i, 1])
            bx, by = (b[i] - a[i]).tolist()
            s = np.clip((px * bx + py * by) / max(bx * bx + by * by, 1e-9), 0.0, 1.0)
            off = (px - s * bx) ** 2 + (py - s * by) ** 2
            r = cones.ra[i] + s * (cones.rb - cones.ra)[i]
            rise = up_a[i] + s * (up_b - up_a)[i] + np.sqrt(np.maximum(r * r - off, 0.0))
            target = near[window]
            np.maximum(target, np.where(off < r * r, rise, NOTHING), out=target)

    def finish(self, near: Pixels) -> SunMap:
        """The map, ready to be asked."""
        rows, columns = near.shape
        blocks = near.reshape(rows // BLOCK, BLOCK, columns // BLOCK, BLOCK)
        high = _around(blocks.max((1, 3)), np.maximum)
        return SunMap(near, high, _around(blocks.min((1, 3)), np.minimum))

    def shade(
        self, sun_map: SunMap, points: Pixels, slope: Pixels, facing: NDArray[np.bool_]
    ) -> Pixels:
        """(N,) 0 lit .. 1 dark at `points` (3, N), on surfaces of `slope` (2, N) there.

        `facing` (N,): which of them look at the sun; it is 0 for the others.
        """
        dark = np.zeros(points.shape[1], np.float32)
        if not dark.size:
            return dark
        x, y, z = points
        u, v = (
            (x * np.float32(e[0]) + y * np.float32(e[1]) + z * np.float32(e[2]) - np.float32(c))
            / np.float32(self.cell)
            - np.float32(0.5)
            for e, c in zip(self.axes, self.lattice.corner, strict=True)
        )
        lx, ly, lz = (np.float32(-value) for value in self.light)
        near = x * lx + y * ly + z * lz
        rows, columns = self.lattice.shape
        edge = np.float32(1.5 + SOFTEST / self.cell)
        inside = (u >= edge) & (u < columns - 1 - edge) & (v >= edge) & (v < rows - 1 - edge)
        ask = np.flatnonzero(inside & facing)
        block = (v.take(ask).astype(np.int32) // BLOCK) * (columns // BLOCK)
        block += u.take(ask).astype(np.int32) // BLOCK
        own = near.take(ask)
        way = sun_map.coarse.ravel().take(block) - own
        # No surface rises more than this as far as a look goes.
        sure = sun_map.least.ravel().take(block) - own > np.float32(0.15)
        sure &= np.abs(slope).max(0).take(ask) < 1.2
        dark[ask[sure]] = 1.0
        could = np.flatnonzero((way > 0.01) & ~sure)
        ask, way = ask.take(could), way.take(could)
        if not ask.size:
            return dark
        radius = np.clip(0.012 + SPREAD * way, 1.3 * self.cell, SOFTEST) / np.float32(self.cell)
        u, v, own = u.take(ask), v.take(ask), near.take(ask) + np.float32(0.008)
        slope = slope.take(ask, 1) * np.float32(self.cell)
        flat = sun_map.near.ravel()
        # A look at the middle and three at the rim settle most points.
        total = self._count(flat, columns, u, v, own, slope, radius, self.taps[:, FIRST])
        mixed = np.flatnonzero((total > 1e-3) & (total < len(FIRST) - 1e-3))
        total /= np.float32(len(FIRST))
        rest = np.setdiff1d(np.arange(TAPS), FIRST)
        more = self._count(
            flat, columns, u.take(mixed), v.take(mixed), own.take(mixed), slope.take(mixed, 1),
            radius.take(mixed), self.taps[:, rest],
        )  # fmt: skip
        part = len(FIRST) / TAPS
        total[mixed] = np.float32(part) * total[mixed] + more / np.float32(TAPS)
        dark[ask] = total
        return dark

    def _count(
        self, flat: Pixels, columns: int, u: Pixels, v: Pixels, near: Pixels, slope: Pixels,
        radius: Pixels, taps: Array,
    ) -> Pixels:  # fmt: skip
        """(N,) how many of `taps` (2, K) around u, v are shaded."""
        total = np.zeros(len(u), np.float32)
        for du, dv in taps.T:
            more_u, more_v = radius * np.float32(du), radius * np.float32(dv)
            total += self._nearer(
                flat, columns, u + more_u, v + more_v,
                near + slope[0] * more_u + slope[1] * more_v, slope,
            )  # fmt: skip
        return total

    @staticmethod
    def _nearer(
        flat: Pixels, columns: int, u: Pixels, v: Pixels, near: Pixels, slope: Pixels
    ) -> Pixels:
        """(N,) which part of the four cells around u, v is nearer to the sun than `near`."""
        c, r = u.astype(np.int32), v.astype(np.int32)
        fu, fv = u - c, v - r
        at = r * columns + c
        # The surface itself, at the first of the four cells and how it goes on from there.
        own = near - slope[0] * fu - slope[1] * fv
        right, down = own + slope[0], slope[1]
        rest = 1.0 - fu
        upper = (flat.take(at) > own) * rest + (flat[1:].take(at) > right) * fu
        at += columns
        lower = (flat.take(at) > own + down) * rest + (flat[1:].take(at) > right + down) * fu
        return upper + (lower - upper) * fv


def _around(blocks: Pixels, best: np.ufunc) -> Pixels:
    """The `best` of each block and of the eight around it."""
    wide = np.pad(blocks, 1, mode="edge")
    wide = best(best(wide[:, :-2], wide[:, 1:-1]), wide[:, 2:])
    return best(best(wide[:-2], wide[1:-1]), wide[2:])


# Contact ------------------------------------------------------------------------------------


class Contact:
    """How dim the ground is close to what stands on it: a map seen from above."""

    CELL = 0.04

    def __init__(self, low: Array, high: Array) -> None:
        """For the ground between two corners x, z, metres."""
        self.cell = max(self.CELL, float(np.sqrt(np.prod(high - low) / 1_000_000)))
        columns, rows = np.ceil((high - low) / self.cell).astype(int) + 1
        self.corner = low
        self.dim = np.zeros((rows, columns), np.float32)

    def copy(self) -> Contact:
        """Another one that can be added to."""
        other = object.__new__(Contact)
        other.cell, other.corner, other.dim = self.cell, self.corner, self.dim.copy()
        return other

    def add(self, boxes: Boxes, level: Array, strength: float = 0.55) -> None:
        """Enters boxes over ground of heights `level` (N,)."""
        for corners, ground in zip(boxes.corners, level, strict=True):
            rise = max(float(corners[:, 1].min() - ground), 0.0)
            tall = float(corners[:, 1].max() - ground)
            if rise > 0.6 or tall < 0.02:
                continue
            flat = corners[:, [0, 2]]
            soft = min(0.10 + 0.06 * tall, 0.22) + 0.5 * rise
            low = np.floor((flat.min(0) - soft - self.corner) / self.cell).astype(int)
            high = np.ceil((flat.max(0) + soft - self.corner) / self.cell).astype(int) + 1
            rows, columns = self.dim.shape
            c0, c1 = max(low[0], 0), min(high[0], columns)
            r0, r1 = max(low[1], 0), min(high[1], rows)
            if c0 >= c1 or r0 >= r1:
                continue
            x = (self.corner[0] + self.cell * np.arange(c0, c1))[None, :]
            z = (self.corner[1] + self.cell * np.arange(r0, r1))[:, None]
            away = _distance(flat, x, z)
            part = np.clip(1.0 - away / soft, 0.0, 1.0)
            weight = strength * np.exp(-rise / 0.25) * part * part
            target = self.dim[r0:r1, c0:c1]
            np.maximum(target, weight, out=target)

    def at(self, x: Pixels, z: Pixels) -> Pixels:
        """(N,) 0 .. 1 at ground points."""
        rows, columns = self.dim.shape
        u = np.clip((x - np.float32(self.corner[0])) / np.float32(self.cell), 0.0, columns - 1.001)
        v = np.clip((z - np.float32(self.corner[1])) / np.float32(self.cell), 0.0, rows - 1.001)
        c, r = u.astype(np.int32), v.astype(np.int32)
        fu, fv = u - c, v - r
        at, flat = r * columns + c, self.dim.ravel()
        upper = flat.take(at) * (1.0 - fu) + flat.take(at + 1) * fu
        at += columns
        return upper * (1.0 - fv) + (flat.take(at) * (1.0 - fu) + flat.take(at + 1) * fu) * fv


def _distance(points: Array, x: Array, z: Array) -> Array:
    """Metres from x, z to the hull of `points` (N, 2), 0 inside."""
    around = hull(points)
    if len(around) < 3:
        around = around[[0, -1, -1]]
    inside: NDArray[np.bool_] | bool = True
    best: Array | float = np.inf
    for a, b in zip(around, np.roll(around, -1, 0), strict=True):
        d = b - a
        px, pz = x - a[0], z - a[1]
        s = np.clip((px * d[0] + pz * d[1]) / max(float(d @ d), 1e-12), 0.0, 1.0)
        best = np.minimum(best, (px - s * d[0]) ** 2 + (pz - s * d[1]) ** 2)
        inside = inside & (d[0] * pz - d[1] * px >= 0.0)
    return np.where(inside, 0.0, np.sqrt(best))


def hull(points: Array) -> Array:
    """The convex hull (M, 2) of points (N, 2), anticlockwise (Andrew's monotone chain)."""
    order = sorted({(round(float(x), 5), round(float(z), 5)) for x, z in points})

    def half(path: list[tuple[float, float]]) -> list[tuple[float, float]]:
        out: list[tuple[float, float]] = []
        for p in path:
            while len(out) > 1:
                (ax, az), (bx, bz) = out[-2:]
                if (bx - ax) * (p[1] - az) - (bz - az) * (p[0] - ax) > 0.0:
                    break
                out.pop()
            out.append(p)
        return out[:-1]

    if len(order) < 3:
        return np.array(order)
    return np.array(half(order) + half(order[::-1]))
