"""Films, pictures, strips and plans of scenes, looked at pixel by pixel."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from ambulo.pictures.drawing import Camera, unit
from ambulo.pictures.mannequin import Mannequin
from ambulo.pictures.scene import (
    draw_scene,
    write_scene_film,
    write_scene_plan,
    write_scene_strip,
)
from ambulo.pictures.scene_camera import Watch
from ambulo.pictures.scene_paint import Painter
from ambulo.pictures.scene_set import Props
from ambulo.pictures.stage import place_camera
from ambulo.recording import Floats
from ambulo.scene_recording import GroundPatch, ScenePart, SceneRecording, Solid, Wall
from scene_samples import acting, chair, crate, door, room, solid, transform

SIZE = (240, 180)
SUN = unit([0.5, -1.0, -0.3])


@pytest.fixture(scope="module")
def seated() -> SceneRecording:
    """Somebody sits down on a chair, and nothing else is there."""
    return SceneRecording(character=acting("sit", (0.0, 0.38)), parts=(chair((0.0, 0.0)),))


def front(size: tuple[int, int] = SIZE) -> Camera:
    """Looks along -Z at somebody at the origin who faces +Z; +X is to the right."""
    return place_camera((0.0, 0.0, 0.0), np.pi, size, distance=6.0, rise=1.6, middle=0.9)


def box_at(x: float, y: float, z: float, size: float = 0.5) -> ScenePart:
    return crate(transform((x, z), lift=y), size, f"box {x} {y} {z}")


def pixel(camera: Camera, place: tuple[float, float, float]) -> tuple[int, int]:
    column, row, _ = camera.project(place).astype(int)
    return int(row), int(column)


def paint(recording: SceneRecording, camera: Camera, *, figure: bool = True) -> np.ndarray:
    return Painter(recording, SUN).paint(0.0, camera, figure=figure)


def without(recording: SceneRecording) -> SceneRecording:
    return dataclasses.replace(recording, parts=(), walls=())


# What hides what ----------------------------------------------------------------------------


def test_a_box_covers_what_the_projection_says(seated: SceneRecording) -> None:
    camera = front((320, 240))
    scene = dataclasses.replace(seated, parts=(box_at(1.2, 0.7, 0.5, 0.6),))
    change = np.abs(
        paint(scene, camera, figure=False) - paint(without(scene), camera, figure=False)
    )
    change[pixel(camera, (1.2, 0.4, 0.8))[0] :] = 0.0  # without the shadow on the ground
    rows, columns = np.nonzero(change.max(-1) > 0.1)
    left, right = (camera.project(p)[0] for p in ((0.9, 1.0, 0.2), (1.5, 1.0, 0.8)))
    assert columns.min() == pytest.approx(left, abs=1.5)
    assert columns.max() == pytest.approx(right - 1.0, abs=1.5)
    assert rows.min() == pytest.approx(camera.project((1.2, 1.0, 0.2))[1], abs=1.5)


def test_a_box_before_the_character_hides_it_and_one_behind_is_hidden(
    seated: SceneRecording,
) -> None:
    camera = front()
    alone = paint(without(seated), camera)
    chest = pixel(camera, (0.0, 1.25, 0.38))
    for z, hides in ((1.4, True), (-0.8, False)):
        picture = paint(dataclasses.replace(seated, parts=(box_at(0.0, 1.2, z),)), camera)
        same = np.abs(picture[chest] - alone[chest]).max() < 0.06
        assert same != hides
        warm = float(picture[chest][0] - picture[chest][2])
        assert (warm > 0.1) == hides  # wood is warm, the trunk is grey


def test_a_box_cuts_through_the_character_where_it_stands(seated: SceneRecording) -> None:
    """Depth decides sample by sample: the arms before the board, the head behind it."""
    shape = solid((0, 0, 0), (2.0, 0.5, 0.02))
    board = ScenePart("b", "b", "box", (shape,), transform((0, 0.33), lift=1.0))
    camera = front((320, 240))
    picture = paint(dataclasses.replace(seated, parts=(board,)), camera)
    alone = paint(without(seated), camera)
    hands = pixel(camera, (0.27, 0.9, 0.49))
    assert np.abs(picture[hands] - alone[hands]).max() < 0.06
    aside = pixel(camera, (0.7, 1.0, 0.34))
    assert np.abs(picture[aside] - alone[aside]).max() > 0.1


def test_the_nearer_of_two_boxes_hides_the_farther_whatever_their_order(
    seated: SceneRecording,
) -> None:
    camera = front()
    near, far = box_at(0.0, 1.0, 1.5, 0.4), box_at(0.1, 1.1, -1.0, 0.9)
    first, second = (
        paint(dataclasses.replace(seated, parts=parts), camera)
        for parts in ((near, far), (far, near))
    )
    assert np.abs(first - second).max() < 1e-5
    alone = paint(dataclasses.replace(seated, parts=(near,)), camera)
    middle = pixel(camera, (0.0, 1.0, 1.75))
    assert np.abs(first[middle] - alone[middle]).max() < 0.02


def test_a_wall_is_looked_through_as_firmly_as_asked(seated: SceneRecording) -> None:
    camera = front()
    scene = dataclasses.replace(seated, parts=(), walls=(Wall((-2.0, 1.5), (2.0, 1.5), 2.4),))
    painter = Painter(scene, SUN)
    open_, glass, firm = (painter.paint(0.0, camera, solidity={0: s}) for s in (0.0, 0.25, 1.0))
    knee = pixel(camera, (0.1, 0.6, 0.45))
    assert np.allclose(glass[knee], 0.75 * open_[knee] + 0.25 * firm[knee], atol=0.01)
    assert np.abs(open_[knee] - firm[knee]).max() > 0.1


# Light --------------------------------------------------------------------------------------


def test_a_box_in_the_sun_throws_a_shadow_where_the_light_sends_it(
    seated: SceneRecording,
) -> None:
    camera = front((320, 240))
    scene = dataclasses.replace(seated, parts=(box_at(0.0, 1.2, 1.0, 0.4),))
    lit, dark = (paint(s, camera, figure=False) for s in (without(scene), scene))
    spot = np.array([0.0, 1.2, 1.0]) - SUN * (1.2 / SUN[1])
    row, column = pixel(camera, tuple(spot))
    assert (lit - dark)[row, column].min() > 0.15
    aside = pixel(camera, (spot[0] + 0.6, 0.0, spot[2]))
    assert np.abs((lit - dark)[aside]).max() < 0.01
    # The middle of the shadow, by all dark pixels below the box.
    shaded = (lit - dark).min(-1) > 0.1
    shaded[: row - 14] = False
    rows, columns = np.nonzero(shaded)
    assert columns.mean() == pytest.approx(column, abs=3.0)
    assert rows.mean() == pytest.approx(row, abs=3.0)


def test_the_shadow_of_the_character_lies_on_a_box_too(seated: SceneRecording) -> None:
    shape = solid((0, 0, 0), (3.0, 0.3, 3.0))
    low = ScenePart("b", "b", "box", (shape,), transform((0.5, -1.2), lift=0.15))
    camera = place_camera((0.5, 0, 0), np.pi, (320, 240), distance=6.0, rise=3.5, middle=0.5)
    scene = dataclasses.replace(seated, parts=(low,))
    painter = Painter(scene, SUN)
    change = painter.paint(0, camera, figure=False) - painter.paint(0, camera)
    chest = np.array([0.0, 1.2, 0.38])
    spot = chest - SUN * ((1.2 - 0.3) / SUN[1])
    assert change[pixel(camera, tuple(spot))].min() > 0.08


def test_a_box_on_the_ground_dims_it_close_by_only(seated: SceneRecording) -> None:
    scene = dataclasses.replace(seated, parts=(box_at(0.0, 0.25, 1.0),))
    camera = front((320, 240))
    painter = Painter(scene, np.array([1e-3, -1.0, 1e-3]))  # noon: no shadow aside
    change = Painter(without(scene), painter.sun.light).paint(0, camera, figure=False)
    change = (change - painter.paint(0, camera, figure=False)).mean(-1)
    near, far = pixel(camera, (0.0, 0.0, 1.29)), pixel(camera, (0.0, 0.0, 1.8))
    assert change[near] > 0.05 and abs(change[far]) < 0.005


# Ground -------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["flat", "slope", "steps"])
def test_pieces_of_ground_are_seen_where_they_are(seated: SceneRecording, kind: str) -> None:
    """A piece covers its own outline in the picture, turned as its yaw says."""
    piece = GroundPatch((0.0, 0.0), (1.0, 2.0), 0.5 * np.pi, kind, 0.2, 0.8, 4)
    base = GroundPatch((0.0, 0.0), (50.0, 50.0))
    camera = front((320, 240))
    scene = dataclasses.replace(seated, parts=(), patches=(base, piece))
    change = paint(scene, camera, figure=False)
    change = change - paint(dataclasses.replace(scene, patches=(base,)), camera, figure=False)
    columns = np.flatnonzero((np.abs(change).max(-1) > 0.04).any(0))
    ends = camera.project([[-1.0, 0.0, 0.5], [1.0, 0.0, 0.5]])[:, 0]
    # Its own +Z is +X of the world, the picture's right: there it is highest.
    assert columns.min() == pytest.approx(ends[0], abs=4.0)
    assert columns.max() == pytest.approx(ends[1], abs=30.0)  # and its shadow
    tops = [
        np.flatnonzero(np.abs(change[:, int(camera.project((x, 0.0, 0.0))[0])]).max(-1) > 0.04)[0]
        for x in (-0.9, 0.9)
    ]
    assert (tops[1] < tops[0] - 5) == (kind != "flat")


def test_hills_are_drawn_from_their_heights() -> None:
    flat, hilly = (draw_scene(room(hills=h), 0.0, size=SIZE) for h in (False, True))
    assert np.abs(flat.astype(int) - hilly).max() > 20


# The camera ---------------------------------------------------------------------------------


def watch(recording: SceneRecording) -> Watch:
    return Watch(recording, Props(recording), Mannequin(recording.character, recording.heights))


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_camera_stays_on_the_open_side_of_a_wall(seated: SceneRecording, side: float) -> None:
    wall = Wall((side, -4.0), (side, 4.0), 2.4)
    seen = watch(dataclasses.replace(seated, walls=(wall,)))
    camera = seen.cameras([60.0], SIZE)[0]
    assert side * camera.eye[0] < 0.0
    assert seen.solidity([60.0], [camera])[0] == {}


def test_the_camera_moves_smoothly_and_keeps_the_character_in_the_middle() -> None:
    scene = room()
    frames = np.arange(0.0, scene.frames - 1.0, 1.2)
    cameras = watch(scene).cameras(frames, SIZE)
    turns = np.diff(np.unwrap([c.yaw for c in cameras]))
    assert np.abs(turns).max() < np.radians(40.0) * 1.2 / 30.0
    for frame, camera in zip(frames, cameras, strict=True):
        hips = scene.character.positions[int(frame), 0]
        column, row, _ = camera.project(hips)
        assert abs(column - 120.0) < 16.0 and 60.0 < row < 130.0


def test_what_stands_in_the_way_is_looked_through(seated: SceneRecording) -> None:
    """Between two walls there is no free side."""
    walls = tuple(Wall((x, -6.0), (x, 6.0), 2.4) for x in (-1.0, 1.0)) + tuple(
        Wall((-1.0, z), (1.0, z), 2.4) for z in (-2.0, 2.0)
    )
    seen = watch(dataclasses.replace(seated, walls=walls))
    cameras = seen.cameras([10.0, 11.0], SIZE)
    firm = seen.solidity([10.0, 11.0], cameras)[0]
    assert firm and min(firm.values()) < 0.5


# Files --------------------------------------------------------------------------------------


def test_film_strip_and_plan_are_written(tmp_path: Path) -> None:
    scene = dataclasses.replace(
        room(), targets={"hand": np.tile([0.3, 1.0, 0.5], (room().frames, 1))}
    )
    told: list[tuple[int, int]] = []
    film = write_scene_film(
        tmp_path / "a.gif", scene, size=(160, 90), fps=10, start=1.0, stop=1.6, title="Sit",
        progress=lambda done, total: told.append((done, total)),
    )  # fmt: skip
    assert told == [(k, 6) for k in range(1, 7)]
    with Image.open(film) as gif:
        assert gif.size == (160, 90) and getattr(gif, "n_frames", 1) == 6
    strip = write_scene_strip(
        tmp_path / "a.png", scene, [0.0, 2.0, 5.0], size=(160, 120), columns=2
    )
    with Image.open(strip) as image:
        assert image.size == (2 * 8 + 2 * 160 + 4, 2 * 8 + 2 * (120 + 13) + 4)
    plan = write_scene_plan(tmp_path / "b.png", scene, size=(600, 600), title="Room")
    with Image.open(plan) as image:
        assert max(image.size) <= 601
        shown = np.asarray(image.convert("RGB"), int)
    red = np.argwhere(np.abs(shown - (0xEC, 0x54, 0x38)).max(-1) < 20)
    assert len(red) > 100  # events


def test_a_mark_is_where_the_target_is(seated: SceneRecording) -> None:
    camera = front((320, 240))
    points = np.full((seated.frames, 3), np.nan)
    points[0] = (0.6, 1.3, 0.4)
    scene = dataclasses.replace(seated, targets={"left hand": points})
    with_, without_ = (
        draw_scene(scene, 0.0, size=(320, 240), camera=camera, marks=m).astype(int)
        for m in (True, False)
    )
    rows, columns = np.nonzero(np.abs(with_ - without_).max(-1) > 30)
    row, column = pixel(camera, (0.6, 1.3, 0.4))
    assert abs(rows.mean() - row) < 1.5 and abs(columns.mean() - column) < 1.5
    assert np.array_equal(
        draw_scene(scene, 1.0, size=(320, 240), camera=camera),
        draw_scene(scene, 1.0, size=(320, 240), camera=camera, marks=False),
    )


def test_a_door_swings_between_two_frames(seated: SceneRecording) -> None:
    angles = np.where(np.arange(seated.frames) < 1, 0.0, 1.2)
    scene = dataclasses.replace(seated, parts=tuple(door((0.0, -1.0), 0.0, angles)))
    leaf = [Props(scene).movers(frame).corners for frame in (0.0, 0.5, 1.0)]
    free = [corners[0][0, [0, 2]] - (0.45, -1.0) for corners in leaf]
    turned = [np.arctan2(f[1], -f[0]) for f in free]
    assert turned[1] - turned[0] == pytest.approx(0.6, abs=0.01)
    assert turned[2] - turned[0] == pytest.approx(1.2, abs=0.01)
    assert Props(scene).movers(0.0).corners.shape == (1 + 6, 8, 3)  # and two handles of three boxes


def test_nothing_is_left_when_progress_raises(seated: SceneRecording, tmp_path: Path) -> None:
    def stop(done: int, total: int) -> None:
        raise KeyboardInterrupt

    old = tmp_path / "film.gif"
    old.write_bytes(b"the film of yesterday")
    for name in ("film.gif", "new.gif"):
        with pytest.raises(KeyboardInterrupt):
            write_scene_film(
                tmp_path / name, seated, size=(64, 48), fps=10, stop=0.3, progress=stop
            )
    assert [p.name for p in tmp_path.iterdir()] == ["film.gif"]
    assert old.read_bytes() == b"the film of yesterday"


# Refusals -----------------------------------------------------------------------------------


def test_bad_arguments_are_refused(seated: SceneRecording, tmp_path: Path) -> None:
    path = tmp_path / "film.gif"
    with pytest.raises(ValueError, match="size"):
        write_scene_film(path, seated, size=(0, 100))
    with pytest.raises(ValueError, match="divide 100"):
        write_scene_film(path, seated, fps=30)
    with pytest.raises(ValueError, match="above 0"):
        write_scene_film(path, seated, fps=0)
    with pytest.raises(ValueError, match="start and stop"):
        write_scene_film(path, seated, start=3.0, stop=2.0)
    with pytest.raises(ValueError, match="start and stop"):
        write_scene_film(path, seated, stop=99.0)
    with pytest.raises(ValueError, match=r"99 s is outside the recording, 0 to 5\.\d+ s"):
        draw_scene(seated, 99)
    with pytest.raises(ValueError, match="camera's picture"):
        draw_scene(seated, 0.0, size=(64, 64), camera=front())
    with pytest.raises(ValueError, match="no moments"):
        write_scene_strip(tmp_path / "strip.png", seated, [])
    with pytest.raises(ValueError, match="columns"):
        write_scene_strip(tmp_path / "strip.png", seated, [0.0], columns=0)
    with pytest.raises(ValueError, match="suffix"):
        write_scene_plan(tmp_path / "plan", seated)
    assert not list(tmp_path.iterdir())


def part(**changed: Any) -> ScenePart:
    given: dict[str, Any] = {
        "object": "o", "part": "p", "kind": "box", "solids": (solid((0, 0, 0), (1, 1, 1)),),
        "transforms": transform((0, 0)),
    }  # fmt: skip
    return ScenePart(**(given | changed))


BAD: list[tuple[str, Callable[[SceneRecording], object]]] = [
    (r"Solid\.half must be above 0", lambda s: solid((0, 0, 0), (1, 0, 1))),
    (r"Solid\.centre must have shape \(3,\)", lambda s: Solid(np.zeros(2), np.ones(3))),
    ("kind must be one of door, chair", lambda s: part(kind="table")),
    (r"transforms must have shape \(T, 7\)", lambda s: part(transforms=np.zeros(6))),
    ("quaternions of transforms must have length 1", lambda s: part(transforms=np.zeros(7))),
    ("transforms must be finite", lambda s: part(transforms=np.full(7, np.nan))),
    ("height and thickness must be above 0", lambda s: Wall((0, 0), (1, 0), 0.0)),
    ("start and end must lie apart", lambda s: Wall((1, 0), (1, 0), 2.0)),
    ("one of flat, rugged", lambda s: GroundPatch((0, 0), (1, 1), kind="lava")),
    ("count must be at least 2", lambda s: GroundPatch((0, 0), (1, 1), kind="steps")),
    (
        r"'o'\.'p' has 3 transforms; the character has \d+ frames",
        lambda s: dataclasses.replace(
            s, parts=(part(transforms=transform((0, 0))[[range(7)] * 3]),)
        ),
    ),
    (r"two parts 'o'\.'p'", lambda s: dataclasses.replace(s, parts=(part(), part()))),
    ("in order of time", lambda s: dataclasses.replace(s, events=((2.0, "a"), (1.0, "b")))),
    (
        r"targets\['hand'\] must have shape",
        lambda s: dataclasses.replace(s, targets={"hand": np.zeros((2, 3))}),
    ),
]


@pytest.mark.parametrize(("message", "make"), BAD, ids=[message for message, _ in BAD])
def test_malformed_recordings_are_refused(
    seated: SceneRecording, message: str, make: Callable[[SceneRecording], object]
) -> None:
    with pytest.raises(ValueError, match=message):
        make(seated)


def test_an_event_is_shown_until_the_next() -> None:
    scene = room()
    assert [scene.event_at(t) for t in (0.0, 1.89, 1.9, 99.0)] == [
        "sit: enter", "sit: enter", "sit: hold", "sit: exit",
    ]  # fmt: skip
    assert dataclasses.replace(scene, events=((1.0, "x"),)).event_at(0.5) == ""


class Hollow:
    """Ground that is lower than 0 everywhere: no patch says so."""

    def height(self, x: Floats, z: Floats) -> Floats:
        return np.full(np.broadcast(x, z).shape, -0.5)


def test_ground_without_patches_is_drawn_from_its_heights(seated: SceneRecording) -> None:
    camera = front()
    high, low = (
        paint(dataclasses.replace(seated, parts=(), heights=h), camera, figure=False)
        for h in (seated.heights, Hollow())
    )
    assert np.abs(high - low).max() > 0.05
