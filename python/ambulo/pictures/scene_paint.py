"""Paints one moment of a scene: what each sample sees first, then the light there.

Flat faces, ground and figure meet in one buffer of 1 / depth with four samples a pixel; colours are
worked out once a pixel, and once a sample only where a pixel sees more than one thing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ambulo.pictures.drawing import (
    SUPERSAMPLE,
    Array,
    Camera,
    Cones,
    Pixels,
    Surface,
    draw_cones,
    lay_surface,
    see_cones,
)
from ambulo.pictures.ground import FAR, Shadow, cast_shadow, field_points
from ambulo.pictures.mannequin import Mannequin
from ambulo.pictures.scene_light import Lit, Setting, shade_pixels
from ambulo.pictures.scene_set import Props
from ambulo.pictures.solids import (
    Boxes,
    Faces,
    draw_faces,
    faces_of,
    picture_lattice,
    seen_forms,
)
from ambulo.pictures.stage import ACCENT, between, heights
from ambulo.pictures.sunlight import Contact, Sun
from ambulo.scene_recording import SceneRecording

REACH = 25.0  # metres from the character's path: what stands farther off casts no shadow
SKY = -1


@dataclass
class _Seen:
    """What the samples of a picture see."""

    inverse: Pixels
    """(2 H, 2 W) 1 / depth, 1 / metres."""
    ids: NDArray[np.int16]
    """(2 H, 2 W) -1 sky, 0 ground, then faces from 1."""


class Painter:
    """Everything of a scene that stays the same from picture to picture."""

    def __init__(
        self,
        recording: SceneRecording,
        light: Array,
        props: Props | None = None,
        mannequin: Mannequin | None = None,
    ) -> None:
        """`light` (3,) is the way the sun's light travels; the others if they are made already."""
        self.recording, self.props = recording, props or Props(recording)
        self.mannequin = mannequin or Mannequin(recording.character, recording.heights)
        self.fixed = Boxes.joined([self.props.ground, self.props.still])
        self.fixed_faces = faces_of(self.fixed)
        path = np.asarray(recording.character.root, np.float64)
        low, high = path.min(0) - REACH, path.max(0) + REACH
        movers = [self.props.movers(f) for f in np.linspace(0, recording.frames - 1, 40)]
        self.sun = Sun(light, self._casters(movers, low, high))
        self.near = self.sun.empty()
        self.sun.add_faces(self.near, self.fixed_faces)
        self.still_map = self.sun.finish(self.near)
        self.contact = Contact(low, high)
        self.contact.add(self.props.still, self._below(self.props.still))
        self.lattice = picture_lattice((32, 32))

    def _casters(self, movers: list[Boxes], low: Array, high: Array) -> Array:
        """(N, 3) points between which all shadows begin and end."""
        figure = np.asarray(self.recording.character.positions, np.float64)
        corners = [boxes.corners.reshape(-1, 3) for boxes in (self.fixed, *movers)]
        points = np.concatenate(
            [figure.reshape(-1, 3) - 0.4, figure.reshape(-1, 3) + 0.4, *corners]
        )
        flat = np.clip(points[:, [0, 2]], low, high)
        return np.stack([flat[:, 0], points[:, 1], flat[:, 1]], -1)

    def _below(self, boxes: Boxes) -> Array:
        """(N,) height of the ground under each box."""
        return heights(self.recording.heights, boxes.centre[:, [0, 2]])

    def pose(self, frame: float) -> Cones:
        """The character's body at a fractional frame."""
        character, at = self.recording.character, np.array([frame])
        return self.mannequin.cones(
            between(character.positions, at)[0], between(character.tips, at)[0]
        )

    def paint(
        self,
        frame: float,
        camera: Camera,
        *,
        solidity: Mapping[int, float] | None = None,
        figure: bool = True,
        marks: bool = True,
    ) -> Pixels:
        """The picture (H, W, 3) at a fractional frame.

        `solidity`: by owner, 1 for what is drawn as it is, less for what is looked through.
        """
        if self.lattice.shape != (camera.size[1] * SUPERSAMPLE, camera.size[0] * SUPERSAMPLE):
            self.lattice = picture_lattice(camera.size)
        movers = self.props.movers(frame)
        faces = _joined(self.fixed_faces, faces_of(movers), len(self.fixed))
        boxes = Boxes.joined([self.fixed, movers])
        forms = seen_forms(camera, faces)
        firm = np.array([(solidity or {}).get(int(owner), 1.0) for owner in boxes.owner])
        firm = firm[faces.box] if len(boxes) else np.zeros(0)
        seen, field = self._see(camera, faces, forms, firm >= 1.0)
        body = self.pose(frame) if figure else None
        surface = see_cones(camera, body) if body is not None else None
        inside = _enter(surface, seen) if surface is not None else None
        lit = self._light(frame, movers, body)
        setting = Setting(self, camera, boxes, faces, forms, field, lit)
        picture = np.empty((camera.size[1], camera.size[0], 3), np.float32)
        self._fill(picture, setting, seen.ids)
        if surface is not None and inside is not None:
            bright = self._on_figure(camera, surface, inside, lit)
            lay_surface(picture, camera, surface, self.sun.light, inside, bright)
        if (firm < 1.0).any():
            self._look_through(picture, setting, seen, firm)
        if marks:
            self._marks(picture, camera, frame)
        return picture

    # Seeing ---------------------------------------------------------------------------------

    def _see(
        self, camera: Camera, faces: Faces, forms: Array, chosen: NDArray[np.bool_]
    ) -> tuple[_Seen, tuple | None]:
        """The ground and the chosen faces; and the field's points where the ground is hilly."""
        shape = self.lattice.shape
        field = None
        if self.props.rest is None:
            form = ground_form(camera, self.props.level)
            across, down = self.lattice.linear(form, slice(0, shape[0]), slice(0, shape[1]))
            inverse = across[None, :] + down[:, None]
        else:
            field = field_points(camera, self.props.rest)
            n = SUPERSAMPLE
            inverse = np.repeat(np.repeat(1.0 / field[3], n, 0), n, 1).astype(np.float32)
        ids = np.where(inverse > 1.0 / FAR, np.int16(0), np.int16(SKY))
        np.maximum(inverse, np.float32(1.0 / FAR), out=inverse)
        draw_faces(camera, self.lattice, faces, forms, chosen, inverse, ids, 1)
        return _Seen(inverse, ids), field

    def _fill(self, picture: Pixels, setting: Setting, ids: NDArray[np.int16]) -> None:
        """Colours every pixel by what its samples see."""
        four = [sample.ravel() for sample in _samples(ids)]
        first = four[0]
        same = (first == four[1]) & (first == four[2]) & (first == four[3])
        planes = np.empty((3, same.size), np.float32)
        plain, mixed = np.flatnonzero(same), np.flatnonzero(~same)
        colours = shade_pixels(setting, plain, first.take(plain))
        edges = shade_pixels(
            setting, np.tile(mixed, 4), np.concatenate([sample.take(mixed) for sample in four])
        )
        for k in range(3):
            planes[k][plain] = colours[k]
            planes[k][mixed] = edges[k].reshape(4, -1).mean(0)
            picture[..., k] = planes[k].reshape(picture.shape[:2])

    def _look_through(self, picture: Pixels, setting: Setting, seen: _Seen, firm: Array) -> None:
        """Lays what is not firm over the picture, as firm as it is."""
        ids = np.full(seen.ids.shape, SKY, np.int16)
        inverse = seen.inverse.copy()
        draw_faces(
            setting.camera, self.lattice, setting.faces, setting.forms, firm < 1.0, inverse, ids, 1
        )
        four = _samples(ids)
        some = np.flatnonzero((four[0] > 0) | (four[1] > 0) | (four[2] > 0) | (four[3] > 0))
        if not some.size:
            return
        flat = picture.reshape(-1, 3)
        over = np.zeros((len(some), 3), np.float32)
        cover = np.zeros((len(some), 1), np.float32)
        strength = np.concatenate([[0.0], firm]).astype(np.float32)
        whole = (four[0] == four[1]) & (four[0] == four[2]) & (four[0] == four[3])
        whole = whole.ravel()[some]
        for chosen, samples, share in ((whole, four[:1], 1.0), (~whole, four, 0.25)):
            at = np.flatnonzero(chosen)
            for sample in samples:
                number = sample.ravel()[some[at]]
                real = number > 0
                weight = np.float32(share) * strength[np.maximum(number[real], 0)]
                colour = shade_pixels(setting, some[at[real]], number[real])
                over[at[real]] += (colour * weight).T
                cover[at[real], 0] += weight
        flat[some] = flat[some] * (1.0 - cover) + over

    # Light ----------------------------------------------------------------------------------

    def _light(self, frame: float, movers: Boxes, body: Cones | None) -> Lit:
        """The sun's maps and the dimness close to things, at this moment."""
        contact, near, things = self.contact, self.near, self.still_map
        if len(movers):
            contact, near = contact.copy(), near.copy()
            contact.add(movers, self._below(movers))
            self.sun.add_faces(near, faces_of(movers))
            things = self.sun.finish(near)
        if body is None:
            return Lit(things, things, contact, None, 0.0)
        near = near.copy()
        self.sun.add_cones(near, body)
        place = between(self.recording.character.root, np.array([frame]))
        level = float(heights(self.recording.heights, place)[0])
        down = np.array([1e-3, -1.0, 0.0])
        feet: Shadow = cast_shadow(body, down, level, spread=0.6, sharp=0.035, fade=0.25)
        return Lit(self.sun.finish(near), things, contact, feet, level)

    def _on_figure(
        self, camera: Camera, surface: Surface, inside: NDArray[np.bool_], lit: Lit
    ) -> Pixels:
        """(P,) how bright the samples `inside` of the figure are in the shadows of things."""
        t = surface.t[inside]
        axes = camera.axes
        toward = 0.03 * surface.normal[:, inside]
        own = np.stack([plane[inside] * t for plane in surface.rays]) + toward
        points = (axes.T @ own + camera.eye[:, None]).astype(np.float32)
        dark = self.sun.shade(
            lit.things, points, np.zeros((2, len(t)), np.float32), np.ones(len(t), bool)
        )
        return (1.0 - 0.40 * dark)[None]

    def _marks(self, picture: Pixels, camera: Camera, frame: float) -> None:
        """Where limbs are led to: small balls, seen through everything."""
        at = self.recording.targets_at(frame)
        count = len(at)
        if not count:
            return
        radius, side = np.full(count, 0.022), np.tile([1.0, 0.0, 0.0], (count, 1))
        colour = np.tile(ACCENT.astype(np.float64), (count, 1))
        draw_cones(
            picture, camera, Cones(at, at, radius, radius, side, np.ones(count), colour),
            self.sun.light,
        )  # fmt: skip


def ground_form(camera: Camera, level: float) -> Array:
    """(3,) a, b, c of 1 / depth = a column + b row + c on level ground."""
    b = 1.0 / (camera.focal * max(float(camera.eye[1]) - level, 1e-3))
    return np.array([0.0, b, -b * camera.horizon])


def _joined(first: Faces, second: Faces, boxes: int) -> Faces:
    """The faces of two heaps of boxes; the first heap has `boxes` of them."""
    return Faces(
        np.concatenate([first.corners, second.corners]),
        np.concatenate([first.normal, second.normal]),
        np.concatenate([first.box, second.box + boxes]),
        np.concatenate([first.side, second.side]),
    )


def _samples(ids: NDArray[np.int16]) -> list[NDArray[np.int16]]:
    """The four samples (H, W) of each pixel."""
    n = SUPERSAMPLE
    return [np.ascontiguousarray(ids[i::n, j::n]) for i in range(n) for j in range(n)]


def _enter(surface: Surface, seen: _Seen) -> NDArray[np.bool_]:
    """(h, w) the surface's samples that nothing hides; enters their depth."""
    n = SUPERSAMPLE
    window = (
        slice(surface.rows.start * n, surface.rows.stop * n),
        slice(surface.columns.start * n, surface.columns.stop * n),
    )
    with np.errstate(divide="ignore"):
        inverse = (1.0 / (surface.t * surface.rays[2])).astype(np.float32)
    target = seen.inverse[window]
    inside = inverse > target
    np.copyto(target, inverse, where=inside)
    return inside
