"""Pictures of creatures, looked at pixel by pixel; their motion is made here, in code."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from ambulo.pictures import creature as pictures
from ambulo.pictures import encode as film_files
from ambulo.pictures.creature import (
    draw_creature,
    write_creature_film,
    write_creature_strip,
    write_training_picture,
)
from ambulo.pictures.creature_body import place, poses_at, read_body
from ambulo.pictures.creature_paint import FILLS, distances, paint_body
from ambulo.pictures.creature_view import SKY, View, check_ground, height, paint_world, write
from ambulo.pictures.gait import BAR, TRACK, draw_gait, gait_numbers
from ambulo.rollout import Leg, Rollout

SIZE = (200, 120)
DT = 1.0 / 60.0
PERIOD = 0.8
LEVEL = np.array([[-50.0, 0.0], [50.0, 0.0]], np.float32)
TORSO = FILLS["torso"]
HIP, KNEE = 0.80, 0.46  # metres above the ground in the start pose


def walker() -> dict[str, Any]:
    """A torso on two pairs of legs; every leg a thigh and a shin, all upright."""

    def leg(name: str, x: float) -> list[dict[str, Any]]:
        thigh = {"capsule": {"length": HIP - KNEE, "radius": 0.07}}
        shin = {"capsule": {"length": KNEE - 0.06, "radius": 0.06}}
        return [
            {"name": f"thigh {name}", "shape": thigh, "position": [x, 0.5 * (HIP + KNEE)],
             "density": 80.0, "tags": ["leg"]},
            {"name": f"shin {name}", "shape": shin, "position": [x, 0.5 * (KNEE + 0.06)],
             "density": 80.0, "tags": ["leg", "foot"]},
        ]  # fmt: skip

    body = {
        "name": "torso", "shape": {"box": {"width": 1.4, "height": 0.3}},
        "position": [0.0, 0.88], "density": 50.0, "tags": ["torso"],
    }  # fmt: skip
    places = {"a": -0.5, "b": -0.5, "c": 0.5, "d": 0.5}
    joints = []
    for name, x in places.items():
        joints += [
            {"name": f"hip {name}", "parent": "torso", "child": f"thigh {name}",
             "anchor": [x, HIP], "limits": [-0.8, 0.8], "torque": 60.0, "speed": 6.0},
            {"name": f"knee {name}", "parent": f"thigh {name}", "child": f"shin {name}",
             "anchor": [x, KNEE], "limits": [-1.2, 0.0], "torque": 40.0, "speed": 6.0},
        ]  # fmt: skip
    far, near = ([part for n in names for part in leg(n, places[n])] for names in ("ac", "bd"))
    pairs = [["hip a", "hip b"], ["hip c", "hip d"]]
    return {
        "format": 1, "name": "Walker", "parts": [*far, body, *near], "joints": joints,
        "sensors": ["joint_angles"], "pairs": pairs,
    }  # fmt: skip


NAMES = [part["name"] for part in walker()["parts"]]
PHASES = {"a": 0.0, "b": 0.5, "c": 0.25, "d": 0.75}


def walk(steps: int = 120, speed: float = 1.5, *, jump: float = 0.0) -> Rollout:
    """Walks to the right; every foot is down half the time. `jump` metres high, once."""
    seconds = np.arange(steps + 1) * DT
    x, up = speed * seconds, jump * np.maximum(1.0 - ((seconds - 1.0) / 0.4) ** 2, 0.0)
    poses = np.zeros((steps + 1, len(NAMES), 3))
    touching = np.zeros((steps + 1, len(NAMES)), bool)
    angles = np.zeros((steps + 1, 8))
    poses[:, NAMES.index("torso")] = np.stack([x, 0.88 + up, 0.0 * x], -1)
    for k, (name, phase) in enumerate(PHASES.items()):
        cycle = seconds / PERIOD - phase
        swing = 0.4 * np.cos(2.0 * np.pi * cycle)
        angles[:, 2 * k] = swing
        at = x + (-0.5 if name in "ab" else 0.5)
        for part, far in (("thigh", 0.5 * (HIP - KNEE)), ("shin", HIP - 0.5 * (KNEE + 0.06))):
            i = NAMES.index(f"{part} {name}")
            drop = HIP - far * np.cos(swing) + up
            poses[:, i] = np.stack([at + far * np.sin(swing), drop, swing], -1)
        touching[:, NAMES.index(f"shin {name}")] = np.mod(cycle - 1e-9, 1.0) < 0.5
    legs = tuple(
        Leg(f"thigh {n}", (NAMES.index(f"thigh {n}"), NAMES.index(f"shin {n}")),
            NAMES.index(f"shin {n}"), (2 * k, 2 * k + 1))
        for k, n in enumerate(PHASES)
    )  # fmt: skip
    nothing = np.zeros((steps, 8), np.float32)
    joint_names = tuple(joint["name"] for joint in walker()["joints"])
    return Rollout(
        walker(), DT, poses.astype(np.float32), touching, angles.astype(np.float32), nothing,
        nothing, legs, NAMES.index("torso"), joint_names, LEVEL,
    )  # fmt: skip


def one(shape: dict[str, Any], angle: float = 0.0) -> dict[str, Any]:
    part = {"name": "body", "shape": shape, "position": [0.0, 1.0], "angle": angle}
    return {"name": "One", "parts": [{**part, "density": 10.0, "tags": ["torso"]}], "joints": []}


def near(picture: np.ndarray, spot: np.ndarray, colour: tuple[int, ...]) -> bool:
    """Whether the pixel has about this colour: shading changes it by a tenth."""
    return bool(np.abs(picture[int(spot[1]), int(spot[0])].astype(int) - colour).max() < 28)


# Bodies -------------------------------------------------------------------------------------


def test_a_body_is_weighed_and_sorted() -> None:
    body = read_body(walker())
    limbs = [(HIP - KNEE, 0.07), (KNEE - 0.06, 0.06)]
    mass = 50.0 * 1.4 * 0.3 + 4.0 * 80.0 * sum(2 * r * n + np.pi * r * r for n, r in limbs)
    assert body.mass == pytest.approx(mass)
    assert {part.name for part in body.parts if part.far} == {
        "thigh a", "shin a", "thigh c", "shin c",
    }  # fmt: skip
    assert {part.name for part in body.parts if part.role == "foot"} == {
        f"shin {n}" for n in "abcd"
    }
    low, high = body.bounds(body.pose)
    assert low == pytest.approx([-0.7, 0.0]) and high == pytest.approx([0.7, 1.03])
    shape = {"polygon": {"points": [[0.0, 0.0], [0.0, 0.4], [0.8, 0.4], [0.8, 0.0]]}}
    assert read_body(one(shape)).mass == pytest.approx(3.2)  # clockwise is well, too
    assert read_body(one({"circle": {"radius": 0.5}})).mass == pytest.approx(2.5 * np.pi)


@pytest.mark.parametrize(
    ("shape", "inside", "outside"),
    [
        ({"capsule": {"length": 1.0, "radius": 0.1}}, (0.0, 0.57), (0.0, 0.63)),
        ({"box": {"width": 0.4, "height": 1.2}}, (0.17, 0.5), (0.23, 0.5)),
        ({"circle": {"radius": 0.5}}, (0.34, 0.34), (0.37, 0.37)),
        ({"polygon": {"points": [[0, 0], [0.8, 0], [0, 0.6]]}}, (0.36, 0.27), (0.44, 0.33)),
    ],
)
@pytest.mark.parametrize("angle", [0.0, 0.7, -2.5])
def test_every_shape_is_where_its_pose_says(
    shape: dict[str, Any], inside: tuple[float, float], outside: tuple[float, float], angle: float
) -> None:
    body = read_body(one(shape, angle))
    view = View((200, 200), 90.0, -1.1, 2.1, 0.5)
    canvas = np.full((200, 200, 3), 255, np.uint8)
    paint_body(canvas, view, body, body.pose)
    spots = view.project(place(np.array([inside, outside]), body.pose[0]))
    drawn = [bool((canvas[int(r), int(c)] < 240).any()) for c, r in spots]
    assert drawn == [True, False]
    # What is covered is as large as the shape, but for its rounded corners.
    area = (255.0 - canvas[..., 2].astype(float)).sum() / (255.0 - TORSO[2]) / 90.0**2
    assert area == pytest.approx(body.mass / 10.0, rel=0.12)


def test_distances_are_in_pixels() -> None:
    body = read_body(
        one({"polygon": {"points": [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]}})
    )
    view = View((200, 200), 50.0, -2.0, 3.0, 1.0)
    far = distances(view, body.parts[0], body.pose[0], (0, 200, 0, 200))
    assert far[100, 150] == pytest.approx(25.5, abs=0.01)  # 50.5 pixels right of the middle
    assert far[100, 110] == pytest.approx(-14.5, abs=0.01)
    assert far[150, 150] == pytest.approx(np.hypot(1, 1) * (25.5 + 5.5) - 5.5, abs=0.1)


def test_poses_between_steps_turn_the_short_way() -> None:
    poses = np.zeros((2, 1, 3))
    poses[:, 0, 2] = [3.0, -3.0]
    poses[1, 0, 0] = 2.0
    middle = poses_at(poses, [0.5])[0, 0]
    assert middle[0] == pytest.approx(1.0)
    assert np.cos(middle[2]) == pytest.approx(-1.0)
    assert poses_at(poses, [0.0, 1.0])[:, 0, 0].tolist() == [0.0, 2.0]


@pytest.mark.parametrize("size", [(640, 400), (300, 300), (64, 48)])
def test_a_portrait_shows_the_start_pose(size: tuple[int, int]) -> None:
    picture = draw_creature(walker(), size=size)
    assert picture.shape == (size[1], size[0], 3) and picture.dtype == np.uint8
    body = read_body(walker())
    view = pictures._portrait(size, *body.bounds(body.pose))
    assert near(picture, view.project((0.0, 0.95)), TORSO)
    assert near(picture, view.project((0.0, 0.4)), SKY)  # between the legs
    column, row = view.project((0.0, -0.05))
    assert picture[int(row), int(column)].mean() < np.mean(SKY) - 15  # ground
    if size[0] == 640:
        colour = picture[tuple(view.project((0.5, 0.25)).astype(int)[::-1])].astype(int)
        assert colour[2] - colour[0] > 10  # a foot is blue
        # A far leg looks out beside the near one; outlined, and paler than that.
        row, columns = int(view.project((0.0, 0.62))[1]), view.project([[0.4, 0], [0.8, 0]])[:, 0]
        line = picture[row, int(columns[0]) : int(columns[1])].mean(-1)
        low = np.flatnonzero((line < 180) & (line < np.roll(line, 1)) & (line < np.roll(line, -1)))
        edges = (low + 0.5 + int(columns[0])) / view.scale + view.left
        assert edges == pytest.approx([0.43, 0.57, 0.57 + 0.8 * 0.07], abs=0.01)
        assert line[low[:2]].max() < line[low[2]] - 40


def test_a_portrait_stands_on_the_ground() -> None:
    """The start pose of a file may hang in the air: the creature is lowered before it starts."""
    low, high = walker(), walker()
    for part in high["parts"]:
        part["position"] = [part["position"][0], part["position"][1] + 0.5]
    for joint in high["joints"]:
        joint["anchor"] = [joint["anchor"][0], joint["anchor"][1] + 0.5]
    assert np.abs(draw_creature(low).astype(int) - draw_creature(high)).max() <= 1


def test_limits_and_motors_are_drawn() -> None:
    def without(key: str) -> dict[str, Any]:
        creature = walker()
        for joint in creature["joints"]:
            del joint[key]
        return creature

    whole = draw_creature(walker()).astype(int)
    body = read_body(walker())
    view = pictures._portrait((640, 400), *body.bounds(body.pose))
    # The knee bends backwards only.
    fans = np.abs(whole - draw_creature(without("limits"))).max(-1) > 8
    for x, there in ((-0.5 - 0.15, True), (-0.5 + 0.19, False)):
        column, row = view.project((x, 0.36)).astype(int)
        assert fans[row, column] == there
    rings = np.abs(whole - draw_creature(without("torque"))).max(-1)[:300] > 60
    column, row = view.project((0.5, HIP)).astype(int)
    assert rings[row - 8 : row + 9, column - 8 : column + 9].any()
    assert not rings[:, int(view.project((0.0, 0.0))[0])].any()


# The world ----------------------------------------------------------------------------------


def test_ground_is_below_its_outline() -> None:
    ground = check_ground([[-2.0, 0.0], [0.0, 0.0], [1.0, 1.0], [1.0, 0.2], [4.0, 0.2]])
    view = View((300, 150), 50.0, -2.0, 2.0, 0.5)
    canvas = paint_world(view, ground)
    for x in (-1.5, 0.5, 0.9, 1.1, 3.5):
        level = float(height(ground, x))
        above, below = view.project([[x, level + 0.08], [x, level - 0.08]])
        assert near(canvas, above, SKY)
        assert canvas[int(below[1]), int(below[0])].mean() < np.mean(SKY) - 20


def test_text_stands_where_it_is_asked_to() -> None:
    for align, edge in (("left", 0), ("right", 1), ("middle", 2), ("gliding", 2)):
        canvas = np.full((60, 200, 3), 255, np.uint8)
        write(canvas, 100.0, 40.0, "HEH", (0, 0, 0), 20.0, align)
        rows, columns = np.nonzero(canvas[..., 0] < 128)
        assert abs(rows.max() - 39) <= 1
        places = (columns.min(), columns.max(), 0.5 * (columns.min() + columns.max()))
        assert abs(places[edge] - 100) < 4


# Films --------------------------------------------------------------------------------------


def test_film_has_the_right_pictures_and_length(tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    rollout = walk(120)
    path = write_creature_film(
        tmp_path / "walk.gif", rollout, size=SIZE, fps=10, start=30,
        progress=lambda done, total: told.append((done, total)),
    )  # fmt: skip
    assert told == [(i, 15) for i in range(1, 16)]  # 90 steps are 1.5 s
    with Image.open(path) as gif:
        assert gif.size == SIZE and getattr(gif, "n_frames", 1) == 15
        for i in range(15):
            gif.seek(i)
            assert gif.info["duration"] == 100
        shown = np.asarray(gif.convert("RGB"))
    body = read_body(rollout.creature)
    rows = 30.0 + 6.0 * np.arange(15)
    view = pictures._follow(rollout, body, rows, 0.1, SIZE)[-1]
    torso = rollout.poses[114, rollout.torso]
    assert near(shown, view.project(torso[:2]), TORSO)
    foot = rollout.poses[114, NAMES.index("shin d")]
    column, row = view.project(foot[:2]).astype(int)
    assert shown[row, column, 2] > shown[row, column, 0] + 6


def test_slow_motion_has_more_pictures(tmp_path: Path) -> None:
    counts = []
    for speed in (1.0, 0.5, 2.0):
        path = write_creature_film(
            tmp_path / "walk.gif", walk(60), size=(64, 48), fps=10, speed=speed
        )
        with Image.open(path) as gif:
            counts.append(getattr(gif, "n_frames", 1))
    assert counts == [10, 20, 5]


def test_slow_motion_shows_the_same_steps(tmp_path: Path) -> None:
    rollout = walk(60)
    path = write_creature_film(tmp_path / "slow.gif", rollout, size=SIZE, fps=10, speed=0.5)
    with Image.open(path) as gif:
        gif.seek(19)
        shown = np.asarray(gif.convert("RGB"))
    body = read_body(rollout.creature)
    view = pictures._follow(rollout, body, 3.0 * np.arange(20), 0.05, SIZE)[-1]
    front = rollout.poses[57, rollout.torso, :2] + np.array([0.66, 0.0])
    assert near(shown, view.project(front), TORSO)
    assert near(shown, view.project(front + np.array([0.08, 0.0])), SKY)


def test_the_camera_is_quiet_and_keeps_the_creature_in_view() -> None:
    rollout = walk(300, jump=8.0)
    body = read_body(rollout.creature)
    rows = np.linspace(0.0, 297.6, 125)
    views = pictures._follow(rollout, body, rows, 0.04, SIZE)
    low, high = body.bounds(poses_at(rollout.poses, rows))
    edges = [view.project(np.stack([a, b])) for view, a, b in zip(views, low, high, strict=True)]
    corners = np.array(edges)
    assert corners[..., 0].min() > 0 and corners[..., 0].max() < SIZE[0]
    assert corners[..., 1].min() > 0 and corners[..., 1].max() < SIZE[1]
    tops = np.array([view.top for view in views])
    assert np.ptp(tops) > 0.5  # it had to look up
    assert np.abs(np.diff(tops, n=2)).max() < 0.15 * np.ptp(tops)  # and did so smoothly
    flat = pictures._follow(walk(300), body, rows, 0.04, SIZE)
    assert np.ptp([view.top for view in flat]) == 0.0
    steps = np.diff([view.left for view in flat])
    assert steps == pytest.approx(1.5 * 0.04, abs=1e-3)


def test_the_starting_line_is_at_nought_and_the_trail_behind(tmp_path: Path) -> None:
    rollout, size = walk(120), (320, 180)
    body = read_body(rollout.creature)
    view = pictures._follow(rollout, body, np.arange(0.0, 120.0, 2.4), 0.04, size)[30]
    film = pictures._Film(rollout, body, size, "Walker", 1.0)
    picture = film.paint(72.0, view).astype(int)
    red = picture[..., 0] - picture[..., 1]
    column, row = view.project((0.0, 0.0)).astype(int)
    assert red[row - 30 : row, column - 1 : column + 2].max() > 40
    assert red[row - 20 : row, column + 5].max() < 15
    dots = [float(view.project((1.5 * t, 0.88))[0]) for t in (0.2, 0.4, 0.6)]
    middle = int(view.project((0.0, 0.88))[1])
    for dot in dots:
        assert red[middle - 1 : middle + 2, int(dot) - 1 : int(dot) + 2].max() > 20
    before = film.paint(0.0, view).astype(int)
    assert (before[..., 0] - before[..., 1])[middle, int(dots[2]) + 40 :].max() < 20


def test_nothing_is_left_when_progress_raises(tmp_path: Path) -> None:
    def stop(done: int, total: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    old = tmp_path / "film.gif"
    old.write_bytes(b"the film of yesterday")
    for name in ("film.gif", "new.gif"):
        with pytest.raises(KeyboardInterrupt):
            write_creature_film(tmp_path / name, walk(), size=SIZE, fps=10, progress=stop)
    assert [p.name for p in tmp_path.iterdir()] == ["film.gif"]
    assert old.read_bytes() == b"the film of yesterday"


def test_mp4_without_ffmpeg_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(film_files.shutil, "which", lambda name: None)
    with pytest.raises(RuntimeError, match="ffmpeg"):
        write_creature_film(tmp_path / "film.mp4", walk(), size=SIZE)
    assert not list(tmp_path.iterdir())


# Sheets -------------------------------------------------------------------------------------


def test_strip_stands_along_the_ground(tmp_path: Path) -> None:
    rollout = walk(240, speed=2.0)
    path = write_creature_strip(tmp_path / "strip.png", rollout, poses=5, width=620)
    with Image.open(path) as image:
        sheet = np.asarray(image.convert("RGB")).astype(int)
    assert sheet.shape[1] == 620
    red = sheet[..., 0] - sheet[..., 1]
    row = int(np.argmax((red[60:] > 90).sum(1))) + 60  # through the torsos
    run = np.flatnonzero(red[row] > 20)
    groups = np.split(run, np.flatnonzero(np.diff(run) > 4) + 1)
    bodies = [group for group in groups if len(group) > 20]
    assert len(bodies) == 5
    strength = [float(np.median(red[row, group])) for group in bodies]
    assert strength == sorted(strength) and strength[0] < 0.5 * strength[-1]
    middles = [float(group.mean()) for group in bodies]
    assert np.diff(middles) == pytest.approx(np.diff(middles).mean(), abs=2.0)


def test_strip_falls_back_to_cells(tmp_path: Path) -> None:
    sizes = []
    for name, rollout, columns in (
        ("slow", walk(120, speed=0.3), None),
        ("asked", walk(240, speed=2.0), 3),
    ):
        path = write_creature_strip(
            tmp_path / f"{name}.png", rollout, poses=6, width=620, columns=columns
        )
        with Image.open(path) as image:
            sheet = np.asarray(image.convert("RGB")).astype(int)
        red = sheet[..., 0] - sheet[..., 1]
        wanted = columns or 6
        row = int(np.argmax((red[44:] > 100).sum(1))) + 44
        bodies = np.flatnonzero(np.diff((red[row] > 100).astype(int)) == 1)
        assert len(bodies) == wanted  # all as strong as the last
        sizes.append(sheet.shape)
    assert sizes[0][1] == sizes[1][1] == 620 and sizes[1][0] > 1.5 * sizes[0][0]


def test_training_picture_shows_the_best(tmp_path: Path) -> None:
    rollout = walk(120)
    ends = [0.0, 2.0, 4.0, 7.0, 10.0]
    poses = np.repeat(rollout.poses[:1], len(ends), 0)
    poses[:, :, 0] += np.array(ends)[:, None]
    fitness = np.array([0.0, 2.0, 4.0, 10.0, 7.0])  # the fourth is best, though not the farthest
    for order in ([0, 1, 2, 3, 4], [3, 4, 1, 0, 2]):
        path = write_training_picture(
            tmp_path / "crowd.png", walker(), poses[order], fitness[order], LEVEL, "Generation 3",
            size=(800, 240),
        )  # fmt: skip
        with Image.open(path) as image:
            assert image.size == (800, 240)
            picture = np.asarray(image.convert("RGB")).astype(int)
        red = picture[..., 0] - picture[..., 1]
        row = int(np.argmax((red[80:] > 100).sum(1))) + 80
        strong, pale = np.flatnonzero(red[row] > 100), np.flatnonzero(red[row] > 6)
        assert 20 < np.ptp(strong) < 110
        share = (strong.mean() - pale.min()) / np.ptp(pale)
        assert share == pytest.approx((7.0 + 0.7) / (10.0 + 1.4), abs=0.02)


def test_a_wide_crowd_keeps_the_best_in_view(tmp_path: Path) -> None:
    rollout = walk(10)
    poses = np.repeat(rollout.poses[:1], 4, 0)
    poses[:, :, 0] += np.array([0.0, 500.0, 900.0, 1000.0])[:, None]
    path = write_training_picture(
        tmp_path / "crowd.png", walker(), poses, [0.0, 1.0, 2.0, 3.0], LEVEL, size=(800, 240)
    )
    with Image.open(path) as image:
        picture = np.asarray(image.convert("RGB")).astype(int)
    red = (picture[..., 0] - picture[..., 1])[80:]
    assert (red > 100).sum() > 50
    view, outside = pictures_crowd(poses)
    assert outside == 3 and view.span[0] < 1000.0 < view.span[1]


def test_a_picture_is_no_higher_than_it_needs_to_be(tmp_path: Path) -> None:
    heights = []
    for jump in (0.0, 2.0):
        poses = np.repeat(walk(1).poses[:1], 3, 0)
        poses[:, :, 0] += np.array([0.0, 10.0, 20.0])[:, None]
        poses[2, :, 1] += jump
        path = write_training_picture(
            tmp_path / "crowd.png", walker(), poses, [0.0, 1.0, 2.0], LEVEL
        )
        with Image.open(path) as image:
            assert image.size[0] == 1240
            heights.append(image.size[1])
    assert 120 < heights[0] < heights[1] - 50 < 320


def pictures_crowd(poses: np.ndarray) -> tuple[View, int]:
    from ambulo.pictures.creature_sheet import _crowd

    return _crowd(read_body(walker()), poses, 3, check_ground(LEVEL), (800, 240))


# Gaits --------------------------------------------------------------------------------------


def test_duty_and_phase_are_those_of_the_walk() -> None:
    rollout = walk(192)
    feet = [leg.foot for leg in rollout.legs]
    duty, phase = gait_numbers(rollout.touching[1:, feet], DT, PERIOD)
    assert duty == pytest.approx([0.5] * 4, abs=0.01)
    assert phase == pytest.approx([0.0, 0.5, 0.25, 0.75], abs=0.01)
    # Unequal stances: the phase is that of touch-down.
    down = np.zeros((96, 2), bool)
    for first in (0, 48):
        down[first + 4 : first + 28, 0] = True
        down[first + 16 : first + 28, 1] = True
    duty, phase = gait_numbers(down, DT, PERIOD)
    assert duty == pytest.approx([0.5, 0.25]) and phase == pytest.approx([0.0, 0.25], abs=0.01)
    never = np.stack([down[:, 0], np.zeros(96, bool), np.ones(96, bool)], -1)
    duty, phase = gait_numbers(never, DT, PERIOD)
    assert duty.tolist() == [0.5, 0.0, 1.0] and np.isnan(phase[1:]).all()
    for period in (None, 2.0):
        assert np.isnan(gait_numbers(down, DT, period)[1]).all()


def test_gait_has_a_bar_for_every_stance() -> None:
    rollout = walk(192)
    picture = draw_gait(rollout, period_s=PERIOD, notes=["1.5 m/s"]).astype(int)
    assert picture.shape[1] == 960 and picture.dtype.kind == "i"
    dark = np.abs(picture - BAR).max(-1) < 3
    rows = np.flatnonzero(dark[:, 128:836].sum(1) > 100)
    bands = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
    assert len(bands) == 2  # the near feet, b and d; the far ones are paler
    for band, phase in zip(bands, (0.5, 0.75), strict=True):
        row = int(band.mean())
        seconds = (np.arange(130, 834) + 0.5 - 128) / (836 - 128) * 192 * DT
        wanted = np.mod(seconds / PERIOD - phase, 1.0) < 0.5
        assert (dark[row, 130:834] == wanted).mean() > 0.98
        assert (np.abs(picture[row, 130:834][~wanted] - TRACK).max(-1) < 15).mean() > 0.9


def test_gait_curves_follow_the_angles() -> None:
    rollout = walk(96)
    angles = np.zeros_like(rollout.angles)
    angles[:, :2] = np.linspace(-0.5, 0.5, 97)[:, None]  # rises
    angles[:, 2] = angles[:, 0]  # its partner, too
    picture = draw_gait(dataclasses.replace(rollout, angles=angles)).astype(int)
    from ambulo.pictures.gait import HUES, _faded

    # Its shade, as strong as a thin line is after it was reduced.
    shade = np.array(_faded(HUES[0])) - picture[5, 5]
    share = ((picture - picture[5, 5]) @ shade) / (shade @ shade)
    rows = []
    for column in (150, 482, 814):
        found = np.flatnonzero(share[208:242, column] > 0.4)
        rows.append(float(found.mean()))
    assert rows[0] > rows[1] + 5 and rows[1] > rows[2] + 5
    assert rows[0] - rows[1] == pytest.approx(rows[1] - rows[2], abs=2.0)


def test_gait_of_a_creature_without_legs() -> None:
    rollout = dataclasses.replace(walk(60), legs=())
    tall = draw_gait(rollout).shape[0]
    never = dataclasses.replace(rollout, touching=np.zeros_like(rollout.touching))
    assert draw_gait(never).shape[0] == tall - 4 * 18
    assert draw_gait(rollout, width=480).shape == (pytest.approx(tall / 2, abs=1), 480, 3)


# Refusals -----------------------------------------------------------------------------------


def test_bad_creatures_are_refused() -> None:
    def broken(change: dict[str, Any], joint: dict[str, Any] | None = None) -> dict[str, Any]:
        creature = walker()
        creature["parts"][0].update(change)
        creature["joints"][0].update(joint or {})
        return creature

    with pytest.raises(ValueError, match="'parts'"):
        draw_creature({"name": "Nothing"})
    with pytest.raises(ValueError, match="part 'thigh a': no shape 'star'"):
        draw_creature(broken({"shape": {"star": {}}}))
    with pytest.raises(ValueError, match="'thigh a': capsule: radius must be a number above 0 m"):
        draw_creature(broken({"shape": {"capsule": {"length": 1.0, "radius": -1.0}}}))
    with pytest.raises(ValueError, match="at least 3 points"):
        draw_creature(broken({"shape": {"polygon": {"points": [[0, 0], [1, 1]]}}}))
    with pytest.raises(ValueError, match="convex"):
        draw_creature(broken({"shape": {"polygon": {"points": [[0, 0], [1, 1], [2, 2]]}}}))
    with pytest.raises(ValueError, match="'thigh a': position must be 2 numbers"):
        draw_creature(broken({"position": [1.0]}))
    with pytest.raises(ValueError, match="joint 'hip a': its parent 'tail' is no part"):
        draw_creature(broken({}, {"parent": "tail"}))


def test_bad_arguments_are_refused(tmp_path: Path) -> None:
    rollout, path = walk(60), tmp_path / "film.gif"
    with pytest.raises(ValueError, match="size"):
        draw_creature(walker(), size=(0, 100))
    with pytest.raises(ValueError, match="size"):
        write_creature_film(path, rollout, size=(0, 100))
    with pytest.raises(ValueError, match="divide 100"):
        write_creature_film(path, rollout, fps=30)
    with pytest.raises(ValueError, match="fps must be above 0"):
        write_creature_film(path, rollout, fps=0)
    with pytest.raises(ValueError, match="speed must be above 0"):
        write_creature_film(path, rollout, speed=0.0)
    with pytest.raises(ValueError, match=r"steps 50 to 61 are asked for.*0 to 60"):
        write_creature_film(path, rollout, start=50, stop=61)
    with pytest.raises(ValueError, match="steps 60 to 60"):
        write_creature_film(path, rollout, start=60)
    with pytest.raises(ValueError, match=r"\.gif or \.mp4"):
        write_creature_film(tmp_path / "film.avi", rollout)
    with pytest.raises(ValueError, match="even"):
        write_creature_film(tmp_path / "film.mp4", rollout, size=(201, 120))
    with pytest.raises(ValueError, match=r"poses of 60 steps of 'Walker' must have shape"):
        write_creature_film(path, dataclasses.replace(rollout, poses=rollout.poses[1:]))
    lost = rollout.poses.copy()
    lost[3, 0, 0] = np.nan
    with pytest.raises(ValueError, match="finite"):
        write_creature_film(path, dataclasses.replace(rollout, poses=lost))
    with pytest.raises(ValueError, match="ground"):
        write_creature_film(path, dataclasses.replace(rollout, ground=LEVEL[::-1]))
    with pytest.raises(ValueError, match="poses must be at least 1"):
        write_creature_strip(path, rollout, poses=0)
    with pytest.raises(ValueError, match="columns"):
        write_creature_strip(path, rollout, columns=0)
    with pytest.raises(ValueError, match="steps -1 to 60"):
        write_creature_strip(path, rollout, start=-1)
    with pytest.raises(ValueError, match=r"poses must have shape \(N, 9, 3\)"):
        write_training_picture(path, walker(), np.zeros((2, 3, 3)), [1.0, 2.0], LEVEL, "")
    with pytest.raises(ValueError, match="fitness must have one number a creature"):
        write_training_picture(path, walker(), np.zeros((2, 9, 3)), [1.0], LEVEL, "")
    with pytest.raises(ValueError, match="those of creature 0"):
        write_training_picture(path, walker(), lost[3:4], [1.0], LEVEL, "")
    with pytest.raises(ValueError, match="period_s"):
        draw_gait(rollout, period_s=0.0)
    with pytest.raises(ValueError, match="width"):
        draw_gait(rollout, width=10)
    with pytest.raises(ValueError, match="steps 10 to 5"):
        draw_gait(rollout, start=10, stop=5)
    assert not list(tmp_path.iterdir())
