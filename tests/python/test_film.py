"""Films, filmstrips and charts of a recording, looked at pixel by pixel."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ambulo.pictures import encode as film_files
from ambulo.pictures.drawing import Camera, Cones, draw_cones, unit
from ambulo.pictures.encode import shared_palette
from ambulo.pictures.film import write_film, write_filmstrip
from ambulo.pictures.ground import _lines, cast_shadow, draw_ground, lay_shadow
from ambulo.pictures.mannequin import LEFT, RIGHT, landmarks
from ambulo.pictures.stage import Stage, follow, place_camera, smooth
from ambulo.pictures.top_view import write_top_view
from ambulo.recording import Flat, Floats, Recording

FPS = 30.0
SIZE = (160, 120)
# Name, parent, and place when standing at the origin and facing +Z, metres.
STANDING = (
    ("Hips", -1, (0.0, 0.95, 0.0)),
    ("LeftUpLeg", 0, (0.10, 0.92, 0.0)),
    ("LeftLeg", 1, (0.10, 0.50, 0.02)),
    ("LeftFoot", 2, (0.10, 0.08, 0.0)),
    ("LeftToeBase", 3, (0.10, 0.02, 0.14)),
    ("RightUpLeg", 0, (-0.10, 0.92, 0.0)),
    ("RightLeg", 5, (-0.10, 0.50, 0.02)),
    ("RightFoot", 6, (-0.10, 0.08, 0.0)),
    ("RightToeBase", 7, (-0.10, 0.02, 0.14)),
    ("Spine", 0, (0.0, 1.15, 0.0)),
    ("Neck", 9, (0.0, 1.45, 0.0)),
    ("Head", 10, (0.0, 1.56, 0.02)),
    ("LeftShoulder", 9, (0.06, 1.40, 0.0)),
    ("LeftArm", 12, (0.18, 1.40, 0.0)),
    ("LeftForeArm", 13, (0.20, 1.12, 0.0)),
    ("LeftHand", 14, (0.20, 0.88, 0.02)),
    ("RightShoulder", 9, (-0.06, 1.40, 0.0)),
    ("RightArm", 16, (-0.18, 1.40, 0.0)),
    ("RightForeArm", 17, (-0.20, 1.12, 0.0)),
    ("RightHand", 18, (-0.20, 0.88, 0.02)),
)
NAMES = tuple(name for name, _, _ in STANDING)


class Ramp:
    """Ground that rises half a metre a metre of z."""

    def height(self, x: Floats, z: Floats) -> Floats:
        return 0.5 * z + 0.0 * x


def walker(frames: int = 60, speed: float = 1.2, *, raised: str = "") -> Recording:
    """Walks along +Z at `speed` m/s, a stride of 1 s; `raised`: "Left" or "Right" hand is up."""
    seconds = np.arange(frames) / FPS
    positions = np.repeat(np.array([place for _, _, place in STANDING])[None], frames, 0)
    for side, sign in (("Left", 1.0), ("Right", -1.0)):
        swing = 0.30 * sign * np.cos(2.0 * np.pi * seconds)
        for joint, part in (("Leg", 0.5), ("Foot", 1.0), ("ToeBase", 1.0)):
            positions[:, NAMES.index(side + joint), 2] += part * swing
        if side == raised:
            positions[:, NAMES.index(side + "ForeArm"), 1] = 1.66
            positions[:, NAMES.index(side + "Hand"), 1] = 1.90
    root = np.stack([np.zeros(frames), speed * seconds], -1)
    positions[..., 2] += root[:, None, 1]
    return Recording(
        fps=FPS,
        names=NAMES,
        parents=tuple(parent for _, parent, _ in STANDING),
        positions=positions.astype(np.float32),
        tips=np.zeros((frames, 0, 3), np.float32),
        tip_joints=(),
        root=root.astype(np.float32),
        facing=np.zeros(frames, np.float32),
        gait=(np.arange(frames) >= frames // 2).astype(np.int64),
        gait_names=("walk", "jog"),
        leg=np.zeros(frames, np.int64),
        lap=np.zeros(frames, np.int64),
        contacts=np.zeros((frames, 4), np.float32),
        asked=np.tile(np.array([0.0, speed, np.nan], np.float32), (frames, 1)),
    )


def ball(centre: tuple[float, float, float], radius: float, colour: tuple[float, ...]) -> Cones:
    at = np.array([centre], np.float64)
    r = np.array([radius])
    return Cones(at, at, r, r, np.array([[1.0, 0.0, 0.0]]), np.ones(1), np.array([colour]))


def both(a: Cones, b: Cones) -> Cones:
    fields = [f.name for f in dataclasses.fields(Cones)]
    return Cones(*(np.concatenate([getattr(a, f), getattr(b, f)]) for f in fields))


def front_camera(size: tuple[int, int] = SIZE) -> Camera:
    """Looks along -Z at somebody who stands at the origin and faces +Z."""
    return place_camera((0.0, 0.0, 0.0), np.pi, size, distance=5.0, rise=1.4, middle=1.0)


def changed(stage: Stage, frame: float, camera: Camera) -> np.ndarray:
    """(H, W) which pixels differ with and without the character; no shadow counts."""
    plain = stage.paint(frame, camera, camera.sun, figure=False)
    picture = plain.copy()
    body = stage.mannequin.cones(stage.recording.positions[int(frame)], np.zeros((0, 3)))
    draw_cones(picture, camera, body, camera.sun)
    return np.abs(picture - plain).max(-1) > 0.02


# The renderer -------------------------------------------------------------------------------


def test_a_ball_covers_what_the_projection_says() -> None:
    camera = front_camera()
    picture = np.zeros((SIZE[1], SIZE[0], 3), np.float32)
    centre, radius = (0.5, 1.2, 0.4), 0.3
    draw_cones(picture, camera, ball(centre, radius, (1.0, 1.0, 1.0)), camera.sun)
    rows, columns = np.nonzero(picture.max(-1) > 0.15)
    column, row, depth = camera.project(centre)
    assert abs(columns.mean() + 0.5 - column) < 0.7
    assert abs(rows.mean() + 0.5 - row) < 0.7
    area = np.pi * (camera.focal * radius / depth) ** 2
    assert abs(len(rows) / area - 1.0) < 0.06


def test_the_nearer_ball_hides_the_farther_whatever_their_order() -> None:
    camera = front_camera()
    near = ball((0.0, 1.0, 1.0), 0.2, (1.0, 0.0, 0.0))
    far = ball((0.0, 1.0, -1.0), 0.4, (0.0, 0.0, 1.0))
    column, row, _ = camera.project((0.0, 1.0, 1.0)).astype(int)
    for cones in (both(near, far), both(far, near)):
        picture = np.zeros((SIZE[1], SIZE[0], 3), np.float32)
        draw_cones(picture, camera, cones, camera.sun)
        assert picture[row, column, 0] > 3.0 * picture[row, column, 2]


def test_a_cone_is_squashed_along_its_axis_only() -> None:
    camera = front_camera()
    flat = dataclasses.replace(ball((0.0, 1.0, 0.0), 0.4, (1.0, 1.0, 1.0)), squash=np.full(1, 0.5))
    picture = np.zeros((SIZE[1], SIZE[0], 3), np.float32)
    draw_cones(picture, camera, flat, camera.sun)
    rows, columns = np.nonzero(picture.max(-1) > 0.1)
    assert abs(np.ptp(columns) / np.ptp(rows) - 0.5) < 0.06


def test_light_comes_from_above() -> None:
    camera = front_camera()
    picture = np.zeros((SIZE[1], SIZE[0], 3), np.float32)
    draw_cones(picture, camera, ball((0.0, 1.0, 0.0), 0.4, (0.8, 0.8, 0.8)), camera.sun)
    column, top, _ = camera.project((0.0, 1.3, 0.0)).astype(int)
    bottom = int(camera.project((0.0, 0.7, 0.0))[1])
    assert picture[top, column].mean() > picture[bottom, column].mean() + 0.15


def test_shadow_falls_where_the_light_sends_it() -> None:
    camera = front_camera((320, 240))
    light = unit([1.0, -2.0, 0.0])
    ground = draw_ground(camera, Flat(), light, grid=False)
    before = ground.picture.copy()
    cones = ball((0.0, 0.8, 0.0), 0.15, (1.0, 1.0, 1.0))
    lay_shadow(ground, camera, cast_shadow(cones, light, 0.0, spread=0.05), 0.6)
    rows, columns = np.nonzero((before - ground.picture).max(-1) > 0.1)
    column, row, _ = camera.project((0.4, 0.0, 0.0))
    assert abs(columns.mean() + 0.5 - column) < 1.5
    assert abs(rows.mean() + 0.5 - row) < 1.5


def test_level_ground_and_a_level_height_field_look_the_same() -> None:
    class Level:
        def height(self, x: Floats, z: Floats) -> Floats:
            return np.zeros(np.broadcast(x, z).shape)

    camera = front_camera()
    flat, field = (draw_ground(camera, t, camera.sun).picture for t in (Flat(), Level()))
    below = int(camera.horizon) + 4
    assert np.abs(flat - field)[below:].mean() < 0.004


def test_grid_lines_run_through_whole_metres() -> None:
    camera = place_camera((0.0, 0.0, 0.0), 0.3, (640, 480), distance=4.0, rise=2.0, middle=0.5)
    picture = draw_ground(camera, Flat(), camera.sun).picture

    def shade(x: float, z: float) -> float:
        column, row, _ = camera.project((x, 0.0, z)).astype(int)
        return float(picture[row, column].mean())

    for x, z in ((0.0, 0.5), (1.0, 0.4), (0.6, 0.0), (0.5, -1.0)):
        assert shade(x, z) < shade(x + 0.3, z + 0.3) - 0.05
    # However large a pixel is, lines cover the same part of the ground on average.
    places = np.linspace(-1.0, 1.0, 2000, endpoint=False, dtype=np.float32)
    for width in (0.004, 0.1, 0.7, 2.3):
        covered = _lines(places, np.full(2000, width, np.float32), 0.02)
        assert covered.mean() == pytest.approx(0.02, rel=0.02)
        assert covered.min() > -1e-3 and covered.max() < 1.001


def test_each_pixel_of_a_height_field_lies_on_it_and_on_its_ray() -> None:
    camera = place_camera((0.0, 0.0, 0.0), 0.3, SIZE, distance=5.0, rise=1.5, middle=1.0)
    ground = draw_ground(camera, Ramp(), camera.sun)
    for row, column in ((60, 20), (90, 80), (110, 150)):
        point = [float(plane[row, column]) for plane in (ground.x, ground.y, ground.z)]
        assert point[1] == pytest.approx(0.5 * point[2], abs=0.01)
        seen = camera.project(point)
        assert seen[:2] == pytest.approx((column + 0.5, row + 0.5), abs=0.6)


# The mannequin ------------------------------------------------------------------------------


def test_the_mannequin_stands_on_its_joints() -> None:
    stage = Stage(walker(), Flat(), np.zeros((0, 2)))
    camera = place_camera((0.0, 0.0, 0.0), 2.4, (320, 240), distance=5.0, rise=1.4, middle=1.0)
    hit = changed(stage, 0, camera)
    for joint in ("Head", "Spine", "LeftLeg", "RightLeg", "LeftForeArm", "RightHand", "LeftFoot"):
        place = stage.recording.positions[0, NAMES.index(joint)]
        column, row, _ = camera.project(place).astype(int)
        assert hit[row, column], joint
    assert 0.02 < hit.mean() < 0.06
    rows = np.flatnonzero(hit.any(1))
    assert camera.project((0.0, 1.83, 0.0))[1] < rows[0] < camera.project((0.0, 1.70, 0.0))[1]
    # The soles are on the ground: the lowest pixel is that of a toe.
    toes = camera.project(stage.recording.positions[0, NAMES.index("RightToeBase")] * (1, 0, 1))
    heels = camera.project(stage.recording.positions[0, NAMES.index("LeftFoot")] * (1, 0, 1))
    assert rows[-1] == pytest.approx(max(toes[1], heels[1]), abs=4.0)


@pytest.mark.parametrize(("side", "sign"), [("Left", 1), ("Right", -1)])
def test_a_raised_hand_is_raised_on_its_own_side(side: str, sign: int) -> None:
    """Somebody who faces the camera has the left hand on the viewer's right."""
    stage = Stage(walker(raised=side), Flat(), np.zeros((0, 2)))
    camera = front_camera((320, 240))
    crown = int(camera.project((0.0, 1.84, 0.0))[1])
    _, columns = np.nonzero(changed(stage, 0, camera)[:crown])
    assert len(columns) > 10
    assert sign * (columns.mean() - 160) > 5
    picture = stage.paint(0, camera, camera.sun)
    spot = stage.recording.positions[0, NAMES.index(side + "Hand")]
    column, row, _ = camera.project(spot).astype(int)
    tint = np.array(LEFT if side == "Left" else RIGHT)
    warm = picture[row, column, 0] - picture[row, column, 2]
    assert warm * (tint[0] - tint[2]) > 0.0


@pytest.mark.parametrize(
    ("hip", "knee", "wrist"),
    [
        ("LeftUpLeg", "LeftLeg", "LeftHand"),
        ("mixamorig:LeftUpLeg", "mixamorig:LeftLeg", "mixamorig:LeftHand"),
        ("thigh_l", "calf_l", "hand_l"),
        ("lfemur", "ltibia", "lwrist"),
        ("LeftHip", "LeftKnee", "LeftWrist"),
    ],
)
def test_landmarks_are_found_under_many_names(hip: str, knee: str, wrist: str) -> None:
    names = ("root", hip, knee, wrist, "RightUpLeg", "lowerback")
    found = landmarks(names)
    assert (found["left hip"], found["left knee"], found["left wrist"]) == (1, 2, 3)
    assert found["right hip"] == 4


def test_a_skeleton_of_unknown_names_is_drawn_too() -> None:
    known = walker()
    strange = dataclasses.replace(known, names=tuple(f"joint{i}" for i in range(len(NAMES))))
    stage = Stage(strange, Flat(), np.zeros((0, 2)))
    assert not stage.mannequin.human
    assert 0.01 < changed(stage, 0, front_camera()).mean() < 0.2


def test_a_body_on_four_legs_is_no_mannequin() -> None:
    """A dog's joints are named as a person's; its trunk lies."""
    known = walker()
    lying = known.positions[..., [0, 2, 1]]
    stage = Stage(dataclasses.replace(known, positions=lying), Flat(), np.zeros((0, 2)))
    assert not stage.mannequin.human and Stage(known, Flat(), np.zeros((0, 2))).mannequin.human


def test_the_post_hides_and_is_hidden() -> None:
    """A waypoint between camera and character is in front; one beyond is behind."""
    recording, camera = walker(), front_camera((320, 240))
    column, row, _ = camera.project((0.0, 0.97, 0.0)).astype(int)
    red = []
    for z in (1.0, -1.0):
        stage = Stage(recording, Flat(), np.array([[0.0, z]]))
        picture = stage.paint(0, camera, camera.sun)
        red.append((picture[row, column, 0] - picture[row, column, 1]) > 0.2)
    assert red == [True, False]


def test_the_path_is_on_the_ground_and_hidden_by_hills() -> None:
    class Ridge:
        """A wall 3 m high across z = 4."""

        def height(self, x: Floats, z: Floats) -> Floats:
            return 3.0 * np.exp(-(((z - 4.0) / 0.4) ** 2)) + 0.0 * x

    recording = walker(60)
    camera = place_camera((0.0, 0.0, 1.0), np.pi + 0.5, SIZE, distance=9.0, rise=1.5, middle=1.0)
    painted = []
    for terrain in (Flat(), Ridge()):
        stage = Stage(recording, terrain, np.zeros((0, 2)))
        ground = draw_ground(camera, terrain, camera.sun)
        before = ground.picture.copy()
        stage._mark_ground(ground, camera, 59.0)
        painted.append(np.abs(ground.picture - before).max(-1) > 0.05)
    assert not painted[1].any()
    rows, columns = np.nonzero(painted[0])
    ends = camera.project([[0.0, 0.0, 0.5], [0.0, 0.0, 59 * 0.04]])
    assert columns.min() <= ends[:, 0].min() + 2 and columns.max() >= ends[:, 0].max() - 2
    line = np.interp(columns + 0.5, np.sort(ends[:, 0]), ends[np.argsort(ends[:, 0]), 1])
    near = (columns > ends[:, 0].min()) & (columns < ends[:, 0].max())
    assert np.abs(rows + 0.5 - line)[near].max() < 2.0


def test_the_speed_shown_is_the_speed_walked() -> None:
    assert Stage(walker(), Flat(), np.zeros((0, 2))).speed == pytest.approx(1.2, rel=1e-3)


# The camera ---------------------------------------------------------------------------------


def test_smoothing_does_not_lag() -> None:
    ramp = np.arange(200.0)
    assert np.abs(smooth(ramp, 0.1, 0.04) - ramp).max() < 0.05
    step = np.repeat([0.0, 1.0], 100)
    soft = smooth(step, 0.1, 0.04)
    assert soft[99] + soft[100] == pytest.approx(1.0, abs=0.02)
    assert np.abs(np.diff(soft)).max() < 0.2


def test_the_camera_keeps_the_character_in_the_middle() -> None:
    recording = walker(150, speed=3.0)
    cameras = follow(recording, np.arange(30.0, 150.0, 1.2), 1.75, Flat(), SIZE, 0.9)
    for frame, camera in zip(np.arange(30.0, 150.0, 1.2), cameras, strict=True):
        z = 3.0 * frame / FPS
        column, top, _ = camera.project((0.0, 1.75, z))
        bottom = camera.project((0.0, 0.0, z))[1]
        assert abs(column - 80.0) < 8.0
        assert 0.45 < (bottom - top) / SIZE[1] < 0.60
        # From the front and the character's left.
        assert camera.eye[0] > 1.0 and camera.eye[2] > z + 1.0


# Files --------------------------------------------------------------------------------------


def test_gif_has_the_right_frames_length_and_pictures(tmp_path: Path) -> None:
    recording = walker()
    told: list[tuple[int, int]] = []
    path = write_film(
        tmp_path / "walk.gif",
        recording,
        [(0, 30, "One"), (30, 60, "Two")],
        waypoints=[(0.0, 4.0)],
        size=SIZE,
        fps=10,
        progress=lambda done, total: told.append((done, total)),
    )
    assert told == [(i, 20) for i in range(1, 21)]
    stage = Stage(recording, Flat(), np.array([[0.0, 4.0]]))
    with Image.open(path) as gif:
        assert gif.size == SIZE
        assert getattr(gif, "n_frames", 1) == 20
        assert gif.info["loop"] == 0
        for i in range(20):
            gif.seek(i)
            assert gif.info["duration"] == 100
        shown = np.asarray(gif.convert("RGB"), np.float64) / 255.0
    cameras = follow(
        recording, 30.0 + 3.0 * np.arange(10), stage.mannequin.stature, Flat(), SIZE, 0.9
    )
    # The last picture went through 19 changes; the caption begins below row 92.
    wanted = stage.paint(57.0, cameras[-1], cameras[5].sun)
    off = np.abs(shown - wanted)[:92]
    assert off.mean() < 0.012
    assert np.quantile(off, 0.998) < 0.06


def test_palette_serves_a_rare_colour(tmp_path: Path) -> None:
    picture = np.full((100, 100, 3), 200, np.uint8)
    picture[:, :, 1] = np.arange(100)[None, :] + 100
    picture[:3, :3] = (250, 20, 20)
    palette = np.array(shared_palette([picture]).getpalette()).reshape(-1, 3)
    assert np.abs(palette - (250, 20, 20)).max(-1).min() <= 6


def test_nothing_is_left_when_progress_raises(tmp_path: Path) -> None:
    def stop(done: int, total: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    old = tmp_path / "film.gif"
    old.write_bytes(b"the film of yesterday")
    for name in ("film.gif", "new.gif"):
        with pytest.raises(KeyboardInterrupt):
            write_film(tmp_path / name, walker(), [(0, 60, "")], size=SIZE, fps=10, progress=stop)
    assert [p.name for p in tmp_path.iterdir()] == ["film.gif"]
    assert old.read_bytes() == b"the film of yesterday"


def test_mp4_without_ffmpeg_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(film_files.shutil, "which", lambda name: None)
    with pytest.raises(RuntimeError, match="ffmpeg"):
        write_film(tmp_path / "film.mp4", walker(), [(0, 60, "")], size=SIZE)
    assert not list(tmp_path.iterdir())


def test_mp4_feeds_ffmpeg_raw_pictures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A stand-in for ffmpeg keeps what it is fed."""
    tool = tmp_path / "ffmpeg"
    tool.write_text(
        "#!/bin/sh\n"
        'for last; do :; done\n[ "$last" = -encoders ] && { echo " V mpeg4"; exit; }\n'
        'cat > "$last"\necho "$@" > "$0.args"\n'
    )
    tool.chmod(0o755)
    monkeypatch.setattr(film_files.shutil, "which", lambda name: str(tool))
    path = write_film(tmp_path / "film.mp4", walker(), [(0, 30, "")], size=SIZE, fps=10)
    assert path.stat().st_size == 10 * SIZE[0] * SIZE[1] * 3
    arguments = (tmp_path / "ffmpeg.args").read_text()
    assert "-s 160x120 -r 10" in arguments and "-c:v mpeg4" in arguments
    tool.write_text("#!/bin/sh\ncat > /dev/null\necho no such codec >&2\nexit 3\n")
    with pytest.raises(RuntimeError, match="no such codec"):
        write_film(tmp_path / "other.mp4", walker(), [(0, 30, "")], size=SIZE, fps=10)
    assert not (tmp_path / "other.mp4").exists()


def test_filmstrip_shows_one_cycle_to_the_right(tmp_path: Path) -> None:
    recording = walker(90)
    path = write_filmstrip(
        tmp_path / "strip.png",
        recording,
        [(0, 90, "Walk"), (0, 45, "Again")],
        poses=4,
        cell=(120, 180),
    )
    unit = 180 / 270
    with Image.open(path) as image:
        head, margin = round(190 * unit), round(24 * unit)
        assert image.size == (head + 4 * 120 + margin, 2 * margin + 2 * 180 + round(12 * unit))
        sheet = np.asarray(image.convert("RGB"), np.float64)
    from ambulo.pictures.film import _cycle

    stage = Stage(recording, Flat(), np.zeros((0, 2)))
    first, span = _cycle(stage, 0, 90)
    assert span == pytest.approx(FPS, abs=1.0)
    assert first % FPS == pytest.approx(0.0, abs=1.0)  # the left foot is farthest ahead
    for k in range(4):
        cell = sheet[margin : margin + 150, head + 120 * k : head + 120 * (k + 1)]
        assert np.ptp(cell[75, :, :], axis=0).max() > 40  # somebody is there
    # Left (warm) foot ahead in the first pose, behind in the third: travel is to the right.
    feet = sheet[margin + 120 : margin + 160]
    centre = []
    for k in (0, 2):
        cell = feet[:, head + 120 * k : head + 120 * (k + 1)]
        _, columns = np.nonzero(cell[..., 0] - cell[..., 2] > 40)
        centre.append(columns.mean())
    assert centre[0] > centre[1] + 10


def test_top_view_is_seen_from_above(tmp_path: Path) -> None:
    """+Z runs up the page and +X to the left; the picture is found by the colours of the gaits."""
    walk = walker(90)
    root = np.stack([np.linspace(0.0, 4.0, 90), np.linspace(0.0, 2.0, 90)], -1)
    recording = dataclasses.replace(walk, root=root.astype(np.float32))
    path = write_top_view(
        tmp_path / "top.png", recording, [(0.0, 0.0), (4.0, 2.0)], 0.5, pixels=600
    )
    with Image.open(path) as image:
        assert 590 <= max(image.size) <= 610
        picture = np.asarray(image.convert("RGB"), np.float64)
    chart = picture[: int(0.75 * len(picture))]  # without the legend
    walked, jogged = (
        np.argwhere(np.abs(chart - colour).max(-1) < 12).mean(0)
        for colour in ((0x9A, 0xA0, 0xA8), (0x2F, 0x7F, 0x96))
    )
    assert jogged[1] < walked[1] - 50  # more x: to the left
    assert jogged[0] < walked[0] - 20  # more z: up


def test_bad_arguments_are_refused(tmp_path: Path) -> None:
    recording, path = walker(), tmp_path / "film.gif"
    shots = [(0, 60, "")]
    with pytest.raises(ValueError, match="no shots"):
        write_film(path, recording, [])
    with pytest.raises(ValueError, match="'late' runs from 50 to 61"):
        write_film(path, recording, [(50, 61, "late")])
    with pytest.raises(ValueError, match="size"):
        write_film(path, recording, shots, size=(0, 100))
    with pytest.raises(ValueError, match="divide 100"):
        write_film(path, recording, shots, fps=30)
    with pytest.raises(ValueError, match="above 0"):
        write_film(path, recording, shots, fps=0)
    with pytest.raises(ValueError, match=r"\.gif or \.mp4"):
        write_film(tmp_path / "film.avi", recording, shots)
    with pytest.raises(ValueError, match="even"):
        write_film(tmp_path / "film.mp4", recording, shots, size=(161, 120))
    with pytest.raises(ValueError, match="waypoints"):
        write_film(path, recording, shots, waypoints=[1.0, 2.0])
    with pytest.raises(ValueError, match="poses"):
        write_filmstrip(tmp_path / "strip.png", recording, shots, poses=0)
    with pytest.raises(ValueError, match="reach"):
        write_top_view(tmp_path / "top.png", recording, [(0, 0), (1, 1)], [0.5, 0.5, 0.5])
    with pytest.raises(ValueError, match="waypoints"):
        write_top_view(tmp_path / "top.png", recording, [])
    with pytest.raises(ValueError, match="pixels"):
        write_top_view(tmp_path / "top.png", recording, [(0, 0)], pixels=0)
    with pytest.raises(ValueError, match=r"Recording\.root must have shape"):
        dataclasses.replace(recording, root=recording.root[1:])
    with pytest.raises(ValueError, match="before its child"):
        dataclasses.replace(recording, parents=(0, *recording.parents[1:]))
    assert not list(tmp_path.iterdir())
