"""Painting a creature: coverage from signed distances, so that no edge needs supersampling."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ambulo.pictures.creature_body import Array, Body, Part, edges, place
from ambulo.pictures.creature_view import Tone, View, height, lay, mix, tone
from ambulo.pictures.stage import Picture

LINE = (62, 58, 56)  # outlines
FILLS = {
    "torso": (232, 108, 80),
    "pale torso": (226, 196, 182),
    "limb": (252, 248, 240),
    "foot": (190, 205, 211),
}
HAZE = (226, 220, 210)  # what far legs fade into
FAR = 0.52


def paint_shadow(canvas: Picture, view: View, body: Body, pose: Array, ground: Array) -> None:
    """A soft dimness of the ground under every part, the fainter the higher the part is."""
    width, rows = view.size
    columns = np.arange(width) + 0.5
    light = np.ones(width)
    deep = 7.0 * view.unit
    for part, at in zip(body.parts, pose, strict=True):
        corners = place(part.core, at)
        low, high = corners[:, 0].min() - part.radius, corners[:, 0].max() + part.radius
        above = corners[:, 1].min() - part.radius - float(height(ground, at[0]))
        above = max(above, 0.0) * view.scale
        soft = 3.0 * view.unit + 0.35 * above
        a, b = (np.array([low, high]) - view.left) * view.scale
        rise = np.clip((columns - a) / soft + 0.5, 0.0, 1.0)
        fall = np.clip((b - columns) / soft + 0.5, 0.0, 1.0)
        light *= 1.0 - 0.5 * np.exp(-above / (28.0 * view.unit)) * rise * fall
    dark = 1.0 - light
    found = np.flatnonzero(dark > 0.01)
    if not len(found):
        return
    x = view.left + (found + 0.5) / view.scale
    surface = (view.top - height(ground, x)) * view.scale
    count = int(np.ceil(deep)) + 1
    row = np.floor(surface).astype(np.int64) + np.arange(count)[:, None]
    down = row + 0.5 - surface
    weight = np.clip(down + 0.5, 0.0, 1.0) * np.exp(-((np.maximum(down, 0.0) / (0.5 * deep)) ** 2))
    inside = (row >= 0) & (row < rows)
    weight = np.where(inside, 0.42 * weight * dark[found], 0.0)
    row, column = np.clip(row, 0, rows - 1), np.broadcast_to(found, row.shape)
    under = canvas[row, column].astype(np.float32)
    under *= 1.0 - weight[..., None].astype(np.float32)
    # Rows that were clipped would write to the edge more than once.
    canvas[row[inside], column[inside]] = (under[inside] + 0.5).astype(np.uint8)


def paint_body(
    canvas: Picture, view: View, body: Body, pose: ArrayLike, *, alpha: float = 1.0,
    accent: bool = True, dots: bool = True,
) -> None:  # fmt: skip
    """Lays the creature at `pose` (P, 3) over the canvas, as one thing of opacity `alpha`.

    `accent`: the torso has the accent's colour; `dots`: joints are shown.
    """
    pose = np.asarray(pose, np.float64)
    low, high = body.bounds(pose)
    box = box_of(view, low, high, 3.0)
    if box is None:
        return
    a, b, c, d = box
    before = canvas[c:d, a:b].astype(np.float32)
    patch = before.copy() if alpha < 1.0 else before
    shown = view.moved(a, c, (b - a, d - c))
    hinges: dict[int, list[Array]] = {}
    for joint in body.joints:
        # On the child, or on the parent where that is in front of it.
        front = max(joint.child, joint.parent)
        spot = place(joint.anchor[None], pose[joint.child])[0]
        hinges.setdefault(front, []).append(spot)
    for i, part in enumerate(body.parts):
        outline, fill = _colours(part, accent)
        _paint_part(patch, shown, part, pose[i], outline, fill, view.unit)
        for spot in hinges.get(i, ()) if dots else ():
            radius = np.clip(0.3 * part.thickness * view.scale, 1.1 * view.unit, 2.2 * view.unit)
            paint_dot(patch, shown, spot, float(radius), outline, 0.85)
    if alpha < 1.0:
        patch = before + np.float32(alpha) * (patch - before)
    canvas[c:d, a:b] = (patch + 0.5).astype(np.uint8)


@lru_cache(maxsize=32)
def _tones(role: str, far: bool, accent: bool) -> tuple[Tone, Tone]:
    fill = FILLS[role if accent or role != "torso" else "pale torso"]
    outline = mix(LINE, fill, 0.12)
    if far:
        return mix(outline, HAZE, FAR), mix(fill, HAZE, 0.8 * FAR)
    return outline, tone(fill)


def _colours(part: Part, accent: bool) -> tuple[Tone, Tone]:
    """Of outline and inside."""
    return _tones(part.role, part.far, accent)


def box_of(view: View, low: Array, high: Array, margin: float) -> tuple[int, int, int, int] | None:
    """Columns from, to and rows from, to of a piece of the world; None if out of view."""
    (left, bottom), (right, top) = view.project(low).tolist(), view.project(high).tolist()
    a, b = max(int(left - margin), 0), min(int(right + margin) + 1, view.size[0])
    c, d = max(int(top - margin), 0), min(int(bottom + margin) + 1, view.size[1])
    return (a, b, c, d) if a < b and c < d else None


def _paint_part(
    patch: NDArray[np.float32], view: View, part: Part, pose: Array, outline: Tone, fill: Tone,
    unit: float,
) -> None:  # fmt: skip
    corners = place(part.core, pose)
    box = box_of(view, corners.min(0) - part.radius, corners.max(0) + part.radius, 2.0)
    if box is None:
        return
    a, b, c, d = box
    far = distances(view, part, pose, box)
    thick = part.thickness * view.scale
    line = np.float32(min(1.3 * unit, 0.4 * thick))
    under = patch[c:d, a:b]
    edge = np.clip(0.5 - far, 0.0, 1.0)[..., None]
    inside = np.clip(0.5 - line - far, 0.0, 1.0)[..., None]
    # Light from above: the slope of the distance says which way the surface leans.
    lean = np.empty_like(far)
    lean[1:-1] = 0.5 * (far[2:] - far[:-2])
    lean[[0, -1]] = 0.0
    deep = np.float32(max(min(0.9 * thick, 9.0 * unit), 1.0))
    near_edge = np.clip(1.0 + far / deep, 0.0, 1.0)
    shade = 1.0 - 0.13 * near_edge * near_edge * np.clip(lean, -0.3, 1.0)
    shade *= np.linspace(1.03, 0.93, d - c, dtype=np.float32)[:, None]
    under += edge * (outline - under)
    under += inside * (np.minimum(fill * shade[..., None], 255.0) - under)


def distances(
    view: View, part: Part, pose: Array, box: tuple[int, int, int, int]
) -> NDArray[np.float32]:
    """Pixels (rows, columns) from each pixel of `box` to the part's outline, below 0 inside."""
    a, b, c, d = box
    column, row = view.project(pose[:2]).tolist()
    x = np.arange(a, b, dtype=np.float32) + np.float32(0.5 - column)
    y = (np.float32(row - 0.5) - np.arange(c, d, dtype=np.float32))[:, None]
    s, co = np.float32(np.sin(pose[2])), np.float32(np.cos(pose[2]))
    along, up = co * x + s * y, co * y - s * x
    radius = np.float32(max(part.radius * view.scale, 0.9 if part.half else 0.0))
    if part.half is not None:
        p = np.abs(along) - np.float32(part.half[0] * view.scale)
        q = np.abs(up) - np.float32(part.half[1] * view.scale)
        outside = np.sqrt(np.maximum(p, 0.0) ** 2 + np.maximum(q, 0.0) ** 2)
        return outside + np.minimum(np.maximum(p, q), 0.0) - radius
    corners = part.core * view.scale
    normals, offsets = edges(corners)
    inner = np.full(along.shape, -np.inf, np.float32)
    outer = np.full(along.shape, np.inf, np.float32)
    for i in range(len(corners)):
        nx, ny = normals[i].astype(np.float32)
        inner = np.maximum(inner, nx * along + ny * up - np.float32(offsets[i]))
        px, py = along - np.float32(corners[i, 0]), up - np.float32(corners[i, 1])
        end = np.float32(np.linalg.norm(corners[(i + 1) % len(corners)] - corners[i]))
        t = np.clip(py * nx - px * ny, 0.0, end)  # along the edge: (-ny, nx)
        outer = np.minimum(outer, (px + ny * t) ** 2 + (py - nx * t) ** 2)
    return np.where(inner < 0.0, inner, np.sqrt(outer)) - radius


def paint_dot(
    patch: NDArray[np.float32], view: View, spot: ArrayLike, radius: float, colour: ArrayLike,
    alpha: float = 1.0, *, ring: float | None = None,
) -> None:  # fmt: skip
    """A disc at `spot` (2,) metres of `radius` pixels, or a ring whose line is `ring` wide."""
    column, row = view.project(spot).tolist()
    reach = radius + 2.0
    a, b = max(int(column - reach), 0), min(int(column + reach) + 2, view.size[0])
    c, d = max(int(row - reach), 0), min(int(row + reach) + 2, view.size[1])
    if a >= b or c >= d:
        return
    x = np.arange(a, b) + 0.5 - column
    y = np.arange(c, d)[:, None] + 0.5 - row
    far = np.sqrt(x * x + y * y) - radius
    if ring is not None:
        far = np.abs(far) - 0.5 * ring
    cover = (alpha * np.clip(0.5 - far, 0.0, 1.0)).astype(np.float32)[..., None]
    under = patch[c:d, a:b]
    under += cover * (tone(colour) - under)


def paint_trail(
    canvas: Picture, view: View, path: ArrayLike, strength: ArrayLike, colour: ArrayLike
) -> None:
    """Dots at the points `path` (N, 2), in metres, each of its own `strength` (N,) of 0..1."""
    spots = view.project(path)
    strength = np.asarray(strength, np.float64)
    radius, reach = 1.7 * view.unit, int(np.ceil(1.7 * view.unit)) + 1
    inside = (spots > -reach).all(-1) & (spots < np.array(view.size) + reach).all(-1)
    spots, strength = spots[inside], strength[inside]
    if not len(spots):
        return
    offset = np.arange(-reach, reach + 1)
    column = np.floor(spots[:, 0]).astype(np.int64)[:, None, None] + offset
    row = np.floor(spots[:, 1]).astype(np.int64)[:, None, None] + offset[:, None]
    far = np.hypot(column + 0.5 - spots[:, 0, None, None], row + 0.5 - spots[:, 1, None, None])
    cover = strength[:, None, None] * np.clip(radius + 0.5 - far, 0.0, 1.0)
    column, row = np.broadcast_arrays(column, row)
    seen = (column >= 0) & (column < view.size[0]) & (row >= 0) & (row < view.size[1])
    seen &= cover > 0.004
    layer: Array = np.zeros((view.size[1], view.size[0]))
    np.maximum.at(layer, (row[seen], column[seen]), cover[seen])
    a, b = int(column[seen].min(initial=0)), int(column[seen].max(initial=0)) + 1
    c, d = int(row[seen].min(initial=0)), int(row[seen].max(initial=0)) + 1
    lay(canvas[c:d, a:b], layer[c:d, a:b], tone(colour))
