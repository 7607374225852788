"""Walking a track: steering, figures, outputs, and the same path at any rate."""

from __future__ import annotations

import json
import math
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from ambulo import Controller, Model, ModelError, Terrain, _core, load_model
from ambulo.character import Step
from ambulo.cli import character, cli
from ambulo.evaluate import metrics
from ambulo.evaluate.track import Track, TrackError, Waypoint, load_track, parse_track
from ambulo.evaluate.walk import summarise, walk_laps
from ambulo.recording import Recording
from conftest import follower

STARTER = Path(__file__).parents[2] / "starters" / "human.safetensors"

SMALL = """
name = "small"
reach = 0.5
[[waypoint]]
position = [6, 0]
speed = 1.5
[[waypoint]]
position = [6, 6]
gait = "jog"
speed = 2.5
[[waypoint]]
position = [0, 0]
gait = "crouch"
speed = 1.0
strafe = [1, 0]
"""


def recording(root: np.ndarray, **changes) -> Recording:
    """A one-joint character on a path (T, 2)."""
    frames = len(root)
    positions = np.zeros((frames, 1, 3))
    positions[:, 0, [0, 2]] = root
    made = Recording(
        fps=60.0, names=("Toe",), parents=(-1,), positions=positions, tips=np.zeros((frames, 0, 3)),
        tip_joints=(), root=root, facing=np.zeros(frames), gait=np.zeros(frames, int),
        gait_names=("walk",), leg=np.zeros(frames, int), lap=np.zeros(frames, int),
        contacts=np.zeros((frames, 4)), asked=np.tile([0.0, 1.0, 0.0], (frames, 1)),
    )  # fmt: skip
    return replace(made, **changes)


class TestTracks:
    def test_the_seeds_track_is_table_3_1(self) -> None:
        track = load_track("seeds")
        positions = [(-30, 40), (-50, 0), (-25, -25), (25, -40), (10, -10), (25, 50)]
        assert [w.position for w in track.waypoints] == positions
        assert [w.gait for w in track.waypoints] == [
            "walk", "walk", "jog", "jog", "crouch", "walk",
        ]  # fmt: skip
        # Centimetres per 60 Hz frame, in metres a second.
        speeds = [w.speed for w in track.waypoints]
        assert speeds == pytest.approx([1.5, 1.5, 6.3, 6.3, 1.2, 1.5])
        assert track.waypoints[1].strafe == pytest.approx((-math.sqrt(0.5), -math.sqrt(0.5)))
        assert track.waypoints[5].strafe == (0.0, -1.0)

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            (("speed = 1.5", "speed = -1"), r"t: waypoint\[0\].speed: expected 0.06 to 20 m_per_s"),
            (("speed = 1.5", "speed = 0.05"), r"speed: expected 0.06 to 20 m_per_s, found 0.05"),
            (("speed = 1.5", "speed = 20.1"), r"speed: expected 0.06 to 20 m_per_s, found 20.1"),
            (("[6, 6]", "[6]"), r"waypoint\[1\].position: expected two numbers \[x, z\]"),
            (("[6, 6]", "[6, nan]"), r"waypoint\[1\].position\[1\]: expected a number"),
            (("[6, 6]", "[6, 0]"), r"waypoint\[1\].position: expected a place more than reach"),
            (
                ("[6, 6]", "[6.3, 0.4]"),
                r"more than reach = 0.5 m from the one before, found '0.5 m",
            ),
            (('"jog"', '"fly"'), r"waypoint\[1\].gait: expected one of walk, jog, crouch, run"),
            (("[1, 0]", "[0, 0]"), r"waypoint\[2\].strafe: expected a direction"),
            (("reach = 0.5", "reach = true"), "reach: expected a number"),
            (("reach", "raech"), "raech: expected one of name, reach"),
            (('name = "small"', 'speed_unit = "mph"'), "speed_unit: expected one of"),
            (('name = "small"', 'speed_unit = ["x"]'), "speed_unit: expected one of"),
            (("[[waypoint]]", "[[waypoints]]"), "waypoints: expected one of"),
            (("[[waypoint]]", "[[waypoint"), "not TOML: .*line 4"),
        ],
    )
    def test_refused_with_the_place(self, change: tuple[str, str], message: str) -> None:
        with pytest.raises(TrackError, match=message):
            parse_track(SMALL.replace(*change), "t")

    def test_speeds_are_limited_in_the_unit_of_the_file(self) -> None:
        text = SMALL.replace("reach", 'speed_unit = "cm_per_frame"\nreach')
        for good, speed in (("0.1", 0.06), ("33.3333", 20.0)):
            track = parse_track(text.replace("speed = 1.5", f"speed = {good}"), "t")
            assert track.waypoints[0].speed == pytest.approx(speed, abs=1e-4)
        limits = r"0.1 to 33.3333 cm_per_frame \(0.06 to 20 m_per_s\), found 40"
        with pytest.raises(TrackError, match=rf"^t: waypoint\[0\].speed: expected {limits}$"):
            parse_track(text.replace("speed = 1.5", "speed = 40"), "t")

    def test_a_missing_file_says_what_there_is(self) -> None:
        with pytest.raises(TrackError, match="the shipped track is called 'seeds'"):
            load_track("sedes")

    def test_ahead_stays_on_the_leg(self) -> None:
        track = parse_track(SMALL, "t")
        assert track.ahead(0, (1.0, 5.0), 2.0) == pytest.approx((3.0, 0.0))
        assert track.ahead(0, (-9.0, 0.0), 2.0) == pytest.approx((2.0, 0.0))
        assert track.ahead(0, (5.0, 1.0), 2.0) == pytest.approx((6.0, 0.0))


class TestMetrics:
    def test_foot_skate_is_weighted_by_height(self) -> None:
        # 1 cm a frame along x, on the floor: weight 2 − 2⁰ = 1.
        root = np.stack([np.arange(11) * 0.01, np.zeros(11)], axis=1)
        flat, floor = Terrain.flat(0.5), np.array([0.04, 0.04])
        for height, expected in [
            (0.0, 1.0),
            (-0.01, 1.0),
            (0.0125, 2.0 - math.sqrt(2.0)),
            (0.025, 0.0),
            (0.2, 0.0),
        ]:
            toe = recording(root)
            toe.positions[:, 0, 1] = 0.5 + 0.04 + height
            skate = metrics.foot_skate(toe, flat, [0, 0], floor)
            assert skate == pytest.approx(expected, abs=1e-4)
        slow = replace(recording(root), fps=30.0)
        slow.positions[:, 0, 1] = 0.54
        assert metrics.foot_skate(slow, flat, [0, 0], floor) == pytest.approx(0.5, abs=1e-4)

    def test_planted_feet_slide_between_two_frames_that_they_stand_in(self) -> None:
        path = np.array([0.0, 0.5, 0.51, 0.51, 0.9, 0.93, 2.0])
        toe = recording(np.stack([path, 0.0 * path], axis=1))
        left = np.array([False, True, True, True, True, False, True])
        planted = np.stack([left, np.zeros(7, bool)], axis=1)
        # 1, 0 and 39 cm a frame; what happens before it stands and after is none of it.
        assert metrics.planted_slide(toe, planted, [0, 0]) == pytest.approx(40.0 / 3, abs=1e-4)
        slow = replace(toe, fps=30.0)
        assert metrics.planted_slide(slow, planted, [0, 0]) == pytest.approx(20.0 / 3, abs=1e-4)
        assert metrics.planted_slide(toe, planted & False, [0, 0]) == 0.0

    def test_the_floor_is_where_feet_are_in_contact(self) -> None:
        toe = recording(np.zeros((9, 2)))
        toe.positions[:, 0, 1] = [0.9, 0.53, 0.54, 0.55, 0.9, 0.9, 0.9, 0.9, 0.9]
        toe.contacts[1:4, 1] = toe.contacts[2, 3] = 1.0
        floor = metrics.contact_floor(toe, Terrain.flat(0.5), [0, 0])
        assert floor == pytest.approx([0.04, 0.04])
        toe.contacts[:, 3] = 0.2
        assert metrics.contact_floor(toe, Terrain.flat(0.5), [0, 0]) is None

    def test_path_error_is_the_distance_to_the_closed_track(self) -> None:
        corners = [(0.0, 4.0), (4.0, 4.0), (4.0, 0.0), (0.0, 0.0)]
        track = Track("square", 1.0, tuple(Waypoint(c, "walk", 1.0, None) for c in corners))
        root = np.array([[2.0, 4.5], [-1.0, 2.0], [2.0, 0.0], [5.0, 5.0]])
        expected = (0.5 + 1.0 + 0.0 + math.sqrt(2.0)) / 4.0
        assert metrics.path_error(root, track) == pytest.approx(expected)
        assert metrics.path_error_max(root, track) == pytest.approx(math.sqrt(2.0))

    def test_heading_error_takes_the_shorter_way_round(self) -> None:
        asked = np.tile([0.0, 1.0, math.radians(175)], (5, 1))
        turned = recording(np.zeros((5, 2)), facing=np.full(5, math.radians(-175)), asked=asked)
        assert metrics.heading_error(turned) == pytest.approx(10.0)

    def test_speed_ratio(self) -> None:
        root = np.stack([np.zeros(61), np.arange(61) * 0.75 / 60.0], axis=1)
        assert metrics.speed_ratio(recording(root)) == pytest.approx(0.75, rel=1e-3)


class TestTerrain:
    def test_named(self, tmp_path: Path) -> None:
        x = np.linspace(-3, 3, 12).reshape(3, 4)
        assert np.array_equal(Terrain.named("flat").height(x, x), np.zeros((3, 4), np.float32))
        hills = Terrain.named("hills", 3).height(x, 0.0 * x)
        assert np.array_equal(hills, Terrain.hills(3).height(x, 0.0 * x)) and hills.std() > 0.0
        grid = tmp_path / "grid.txt"
        grid.write_text("0 0 0\n10 10 10\n20 20 20\n")
        # Rows run along +Z, 3.937 cm apart; a unit of height is 3 cm.
        slope = Terrain.named(str(grid)).height(np.zeros(2), np.array([0.0, 0.03937]))
        assert slope == pytest.approx([0.3, 0.6], abs=1e-3)
        grid.write_text("1 2\n3 x\n")
        with pytest.raises(ValueError, match=r"grid\.txt: not a height map: row 2, column 2"):
            Terrain.named(str(grid))
        with pytest.raises(ValueError, match=r"^nowhere: no such file; or 'flat' or 'hills'$"):
            Terrain.named("nowhere")
        with pytest.raises(ValueError, match=r"^nowhere: no such file$"):
            Terrain.from_file("nowhere")
        with pytest.raises(ValueError, match=r"not a height map: Is a directory$"):
            Terrain.named(str(tmp_path))

    def test_a_seed_has_64_bits(self) -> None:
        Terrain.hills(2**64 - 1)
        for seed in (-1, 2**64):
            with pytest.raises(ValueError, match=f"the seed of the hills is {seed}, expected 0 to"):
                Terrain.hills(seed)

    def test_real_height_map(self, data: Path) -> None:
        path = data / "holden-pfnn" / "hmap_001_smooth.txt"
        ground = Terrain.from_file(path)
        heights = ground.height(*np.meshgrid(np.linspace(-5, 5, 50), np.linspace(-5, 5, 50)))
        assert 0.1 < np.ptp(heights) < 10.0


class TestWalking:
    def test_a_follower_reaches_every_waypoint(self, toys: Model) -> None:
        track = parse_track(SMALL, "t")
        done: list[float] = []
        laps = list(walk_laps(toys, track, Terrain.flat(), 3, on_progress=done.append))
        assert done == sorted(done) and done[-1] <= 3.0
        for number, lap in enumerate(laps):
            figures, r = lap.figures, lap.recording
            assert figures.waypoints_reached == 3 and figures.held_frames == 0
            assert figures.time_s == pytest.approx(r.frames / 60.0)
            assert figures.path_error_m < 0.5 and 0.5 < figures.mean_speed_ratio < 1.1
            assert 0.0 < figures.ms_per_frame_mean < 50.0
            assert set(r.lap) == {number} and list(np.unique(r.leg)) == [0, 1, 2]
            # Strafing asks for its own facing, else the movement's.
            assert r.asked[r.leg == 2, 2] == pytest.approx(math.pi / 2)
            along = np.arctan2(r.asked[r.leg == 0, 0], r.asked[r.leg == 0, 1])
            assert r.asked[r.leg == 0, 2] == pytest.approx(along, abs=1e-6)
            ends = [r.root[r.leg == leg][-1] for leg in range(3)]
            for end, waypoint in zip(ends, track.waypoints, strict=True):
                assert math.dist(end, waypoint.position) < track.reach + 0.1
        summary = summarise(laps, track)
        assert summary["totals"]["waypoints_reached"] == summary["totals"]["waypoints"] == 9
        times = [lap["time_s"] for lap in summary["laps"]]
        assert summary["totals"]["time_s"] == pytest.approx(sum(times))
        furthest = [lap["path_error_max_m"] for lap in summary["laps"]]
        assert summary["totals"]["path_error_max_m"] == max(furthest)
        for part in (*summary["laps"], summary["totals"]):
            assert part["path_error_max_m"] >= part["path_error_m"]
            assert part["foot_skate_cm_per_s"] == pytest.approx(
                60.0 * part["foot_skate_cm_per_frame"]
            )

    def test_a_lap_within_reach_of_all_has_figures(self, toy: Model) -> None:
        places = ((0.0, 0.0), (1.1, 0.0), (0.55, 0.95))
        track = Track("triangle", 1.0, tuple(Waypoint(p, "walk", 1.0, None) for p in places))
        laps = list(walk_laps(toy, track, Terrain.flat(), 5))
        assert all(lap.recording.frames >= 2 for lap in laps)
        assert all(math.isfinite(value) for value in summarise(laps, track)["totals"].values())

    def test_the_same_walk_every_time(self, toy: Model) -> None:
        track = parse_track(SMALL, "t")
        first, second = (next(iter(walk_laps(toy, track, Terrain.hills(5), 1))) for _ in range(2))
        assert np.array_equal(first.recording.positions, second.recording.positions)
        assert np.array_equal(first.rotations, second.rotations)

    def test_a_waypoint_out_of_reach_is_given_up(self, toy: Model) -> None:
        # Asked to reach within a millimetre at a run, the follower passes by and circles.
        text = SMALL.replace("reach = 0.5", "reach = 0.0001").replace("speed = 2.5", "speed = 9")
        lap = next(iter(walk_laps(toy, parse_track(text, "t"), Terrain.flat(), 1)))
        assert lap.figures.waypoints_reached < 3

    @pytest.mark.parametrize("gait", ["run", "auto"])
    def test_every_gait_is_walked(self, toys: Model, gait: str) -> None:
        track = parse_track(SMALL.replace('"jog"', f'"{gait}"'), "t")
        lap = next(iter(walk_laps(toys, track, Terrain.flat(), 1)))
        r = lap.recording
        assert lap.figures.waypoints_reached == 3 and lap.figures.held_frames == 0
        assert {r.gait_names[g] for g in r.gait[r.leg == 1]} == {gait}

    def test_outputs(self, toys: Model, tmp_path: Path) -> None:
        toys.save(tmp_path / "toy.safetensors")
        (tmp_path / "t.toml").write_text(SMALL)
        out = tmp_path / "out"
        arguments = ["walk", str(tmp_path / "toy.safetensors"), "--track", str(tmp_path / "t.toml")]
        quiet = CliRunner().invoke(cli, arguments)
        assert quiet.exit_code == 0, quiet.output
        assert "3 of 3 waypoints reached" in quiet.output and "nothing written" in quiet.output
        run = CliRunner().invoke(cli, [*arguments, "--laps", "2", "-o", str(out), "--json"])
        assert run.exit_code == 0, run.output
        names = {"walk.bvh", "top.png", "strip.png", "film.gif", "summary.json"}
        assert {p.name for p in out.iterdir()} == names
        summary = json.loads(run.stdout)
        assert summary == json.loads((out / "summary.json").read_text())
        lap_keys = {
            "time_s", "waypoints_reached", "path_error_m", "heading_error_deg", "mean_speed_ratio",
            "foot_skate_cm_per_frame", "ms_per_frame_mean", "ms_per_frame_sd",
            "path_error_max_m", "foot_skate_cm_per_s", "planted_slide_cm_per_frame",
            "planted_share",
        }  # fmt: skip
        assert len(summary["laps"]) == 2 and lap_keys <= set(summary["laps"][0])
        from ambulo import read_motion

        clip, _ = read_motion(str(out / "walk.bvh"))
        frames = round(summary["laps"][0]["time_s"] * 60)
        assert clip.frames == frames and clip.fps == pytest.approx(60.0)
        # The file is in centimetres; its hips go where the character went.
        lap = next(iter(walk_laps(toys, parse_track(SMALL, "t"), Terrain.flat(), 1)))
        expected = lap.recording.positions
        assert np.abs(clip.positions() / 100.0 - expected).max() < 1e-4

    def test_errors_are_one_line(self, toy: Model, tmp_path: Path) -> None:
        toy.save(tmp_path / "toy.safetensors")
        for arguments in (["--track", "nowhere"], ["--terrain", "nowhere"]):
            run = CliRunner().invoke(cli, ["walk", str(tmp_path / "toy.safetensors"), *arguments])
            assert run.exit_code == 1 and run.output.startswith("Error: nowhere"), run.output
        for seed in ("-1", str(2**64)):
            arguments = ["--terrain", "hills", "--seed", seed]
            run = CliRunner().invoke(cli, ["walk", str(tmp_path / "toy.safetensors"), *arguments])
            assert run.exit_code == 2 and "Invalid value for '--seed'" in run.output
        (tmp_path / "bad.safetensors").write_bytes(b"nothing")
        run = CliRunner().invoke(cli, ["walk", str(tmp_path / "bad.safetensors")])
        assert run.exit_code == 1 and "not a safetensors file" in run.output

    def test_a_model_that_cannot_be_controlled_is_named(
        self, toy: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        path = tmp_path / "toy.safetensors"
        toy.save(path)

        def refuse(*_: object, **__: object) -> None:
            raise ValueError("layout 'other' is not known")

        monkeypatch.setattr("ambulo.character._core.Controller", refuse)
        run = CliRunner().invoke(cli, ["walk", str(path)])
        assert run.exit_code == 1
        assert run.output == f"Error: {path}: layout 'other' is not known\n"

    def test_held_frames_are_said(
        self, toy: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        toy.save(tmp_path / "toy.safetensors")
        (tmp_path / "t.toml").write_text(SMALL)
        arguments = ["walk", str(tmp_path / "toy.safetensors"), "--track", str(tmp_path / "t.toml")]
        assert "held" not in CliRunner().invoke(cli, arguments).output
        step, events = Controller.step, iter(["held: a test"] * 7)

        def hold(self: Controller, *args, **options) -> Step:
            return replace(step(self, *args, **options), event=next(events, None))

        monkeypatch.setattr(Controller, "step", hold)
        output = CliRunner().invoke(cli, arguments).output
        assert re.search(r"^7 of \d+ frames held the pose", output, re.MULTILINE), output

    def test_mp4_without_ffmpeg_is_refused_before_the_walk(
        self, toy: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        toy.save(tmp_path / "toy.safetensors")
        monkeypatch.setenv("PATH", str(tmp_path))
        out = tmp_path / "out"
        arguments = ["walk", str(tmp_path / "toy.safetensors"), "-o", str(out), "--film", "mp4"]
        run = CliRunner().invoke(cli, arguments)
        assert run.exit_code == 1 and "needs ffmpeg" in run.output and not out.exists()

    def test_ctrl_c_keeps_the_laps_that_are_done(self, toy: Model, tmp_path: Path) -> None:
        toy.save(tmp_path / "toy.safetensors")
        (tmp_path / "t.toml").write_text(SMALL)
        out = tmp_path / "out"
        arguments = [
            str(tmp_path / "toy.safetensors"), "--track", str(tmp_path / "t.toml"),
            "--laps", "9999", "--film", "none", "-o", str(out),
        ]  # fmt: skip
        process = subprocess.Popen(
            [sys.executable, "-m", "ambulo", "walk", *arguments],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
        time.sleep(4.0)
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate(timeout=120)
        assert process.returncode == 130, output
        summary = json.loads((out / "summary.json").read_text())
        assert summary["laps_asked"] == 9999 and 1 <= len(summary["laps"]) < 9999
        assert "Error" not in output and (out / "walk.bvh").is_file()

    def test_ctrl_c_before_the_first_lap_is_done(
        self, toy: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def stop(*_: object, **__: object) -> None:
            raise KeyboardInterrupt

        toy.save(tmp_path / "toy.safetensors")
        monkeypatch.setattr(Controller, "step", stop)
        out = tmp_path / "out"
        arguments = ["walk", str(tmp_path / "toy.safetensors"), "-o", str(out), "--json"]
        run = CliRunner().invoke(cli, arguments)
        assert run.exit_code == 130 and run.stdout == "" and not out.exists()
        expected = "stopped before the first lap was finished; nothing written\n"
        assert run.stderr == expected

    def test_ctrl_c_while_drawing_keeps_the_figures(
        self, toy: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def stop(*_: object) -> None:
            raise KeyboardInterrupt

        toy.save(tmp_path / "toy.safetensors")
        (tmp_path / "t.toml").write_text(SMALL)
        monkeypatch.setattr(character, "write_outputs", stop)
        out = tmp_path / "out"
        arguments = [
            "walk", str(tmp_path / "toy.safetensors"), "--track", str(tmp_path / "t.toml"),
            "-o", str(out), "--json",
        ]  # fmt: skip
        run = CliRunner().invoke(cli, arguments)
        assert run.exit_code == 130 and run.stderr == "stopped\n"
        assert json.loads(run.stdout) == json.loads((out / "summary.json").read_text())


class TestController:
    def test_says_what_is_wrong(self, toy: Model) -> None:
        with pytest.raises(ModelError, match="not finite"):
            Controller(toy, start=(math.nan, 0.0))
        character = Controller(toy)
        with pytest.raises(ValueError, match="gait 'hop' is not known"):
            character.step(0.1, gait="hop")
        before = character.positions()
        assert character.step(0.1, (math.nan, 0.0)).event == (
            "held: the intent has a number that cannot be used"
        )
        assert character.step(-1.0).event == "held: dt is negative or not finite"
        assert np.array_equal(character.positions(), before)
        assert character.step(2.5).event == "skipped: 1.5 s"

    def test_gaits_by_name_and_by_speed(self, toys: Model) -> None:
        # Stand, walk, jog, run, crouch, jump, bump: what the network is told.
        for gait, speed, expected in [
            ("walk", 1.5, [0, 1, 0, 0, 0]),
            ("jog", 3.0, [0, 0, 1, 0, 0]),
            ("run", 5.0, [0, 0, 0, 1, 0]),
            ("crouch", 1.0, [0, 0, 0, 0, 1]),
            ("auto", 0.0, [1, 0, 0, 0, 0]),
            ("auto", 1.5, [0, 1, 0, 0, 0]),
            ("auto", 2.1, [0, 0.5, 0.5, 0, 0]),
            ("auto", 3.0, [0, 0, 1, 0, 0]),
            ("auto", 3.9, [0, 0, 0.5, 0.5, 0]),
            ("auto", 5.0, [0, 0, 0, 1, 0]),
        ]:
            character = Controller(toys)
            for _ in range(120):
                assert character.step(1 / 60, (0.0, speed), gait=gait).event is None
            assert character.core.gaits[:5] == pytest.approx(expected, abs=1e-4), (gait, speed)

    def test_placed_feet_change_nothing_but_the_legs(self, toys: Model) -> None:
        terrain = Terrain.hills(3)
        characters = [Controller(toys, terrain=terrain, place_feet=p) for p in (True, False)]
        most = 0.0
        for frame in range(240):
            for walker in characters:
                # At no multiple of the fixed step, and with a turn.
                walker.step(1 / 50, (math.sin(frame / 50), math.cos(frame / 50)))
            placed, own = characters
            assert placed.root == own.root and placed.phase == own.phase
            assert placed.contacts == own.contacts
            assert np.array_equal(placed.core.trajectory(), own.core.trajectory())
            most = max(most, float(np.abs(placed.positions() - own.positions()).max()))
        assert 1e-3 < most < 0.5, most

    def test_feet_are_held_where_they_stand(self) -> None:
        model = load_model(STARTER)
        legs = [model.names.index(f"{side}Toe") for side in ("Left", "Right")]
        character, terrain = Controller(model, terrain=Terrain.hills(3)), Terrain.hills(3)
        slides, before, stood = [], character.positions(), [False, False]
        for frame in range(300):
            character.step(1 / 60, (0.0, 1.4))
            now, planted = character.positions(), character.planted
            for toe, a, b in zip(legs, planted, stood, strict=True):
                if a and b:
                    slides.append(math.hypot(*(now[toe] - before[toe])[[0, 2]]))
            floor = terrain.height(now[legs, 0], now[legs, 2])
            assert frame < 2 or (now[legs, 1] - floor).min() > 0.02, "the ball is above the ground"
            before, stood = now, planted
        assert len(slides) > 150 and np.mean(slides) < 2e-4 and np.max(slides) < 1e-3

    def test_nobody_holds_feet_that_are_not_to_be_held(self, toys: Model) -> None:
        tuning, shown = {"hold_feet": False}, []
        for place in (True, False):
            character = Controller(toys, tuning=tuning, place_feet=place)
            for _ in range(60):
                character.step(1 / 60, (0.0, 1.0))
            shown.append(character.positions())
            assert character.planted == [contact > 0.5 for contact in character.contacts[1::2]]
        assert np.array_equal(*shown)

    def test_a_tuning_of_ones_own(self, toys: Model) -> None:
        for tuning, message in [
            ({"stand_freedom": 2.0}, "the tuning has a number"),
            ({"speed": 1.0}, "tuning: unknown field `speed`, expected one of"),
            ({"speed_limit": [0.8]}, "tuning: invalid length 1"),
            ({"pose_halflife": math.nan}, "tuning: "),
        ]:
            with pytest.raises(ModelError, match=message):
                Controller(toys, tuning=tuning)

        def gone(seconds: float, **options) -> float:
            character = Controller(toys, **options)
            for _ in range(round(60 * seconds)):
                character.step(1 / 60, (0.0, 1.5))
            return character.root[2]

        assert gone(2, tuning={}) == gone(2)
        assert gone(2, tuning={"velocity_halflife": 1.0}) < gone(2) - 0.1
        assert gone(2, tuning={"speed_limit": [0.8, 1.3]}) != gone(2)

    def test_the_models_own_tuning_is_used(self) -> None:
        def far(model: Model, **options) -> float:
            character = Controller(model, **options)
            for _ in range(120):
                character.step(1 / 60, (0.0, 1.5))
            return character.root[2]

        slow = follower("ambulo", tuning={"velocity_halflife": 1.0})
        assert far(slow) < far(follower("ambulo")) - 0.1
        assert far(slow, tuning={}) == far(follower("ambulo"))
        # Responsive changes only how the path bends.
        quick = far(slow, responsive=True)
        assert far(slow) != quick < far(follower("ambulo"), responsive=True) - 0.1

    def test_standing_is_as_free_as_the_tuning_says(self) -> None:
        # A network that sways to its left and foresees the same path.
        model = follower("ambulo")
        layers = [(0.0 * w, b.copy()) for w, b in model.core.layers()]
        n = model.core.normalisation()
        n["output_mean"][0] = 0.06
        swaying = Model(_core.Model.build(model.core.header_json(), layers, **n))
        for freedom, metres in ((0.0, 0.0), (0.5, 0.03), (1.0, 0.06)):
            character = Controller(swaying, tuning={"stand_freedom": freedom})
            for _ in range(61):
                character.step(1 / 60)
            assert character.root[0] == pytest.approx(metres, abs=2e-3)
            # The pose that is shown came before the last two steps' turns.
            turns = 2.0 * math.pi * (0.1 + 0.9 * freedom) * 59 / 60
            assert math.cos(character.phase - turns) == pytest.approx(1.0, abs=1e-4)

    def test_walls_and_areas(self, toy: Model) -> None:
        character = Controller(toy)
        character.core.set_areas(
            walls=[(-5, 3, 5, 3, 0.2)], jumps=[(0, 0, 1, 0.3, 0.2)], crouches=[]
        )
        jumped = False
        for _ in range(600):
            character.step(1 / 60, (0.0, 1.5))
            jumped |= character.core.gaits[5] > 0.9
            assert character.root[2] < 2.81
        assert jumped, "the jump gait is on near the area"
        with pytest.raises(ValueError, match="finite"):
            character.core.set_areas(walls=[(0, 0, 1, math.inf, 0.2)])


class TestRealNetwork:
    def test_walks_the_seeds_track(self, network: Path) -> None:
        lap = next(iter(walk_laps(load_model(network), load_track("seeds"), Terrain.flat(), 1)))
        figures, r = lap.figures, lap.recording
        assert figures.waypoints_reached == 6 and figures.held_frames == 0
        assert figures.path_error_m < 1.0 and figures.heading_error_deg < 10.0
        hips = np.array([np.median(r.positions[r.leg == leg, 0, 1]) for leg in range(6)])
        assert (hips[[0, 1, 2, 3, 5]] > 0.9).all() and hips[4] < 0.87, "crouches on leg 4 alone"
        toes = r.positions[:, [r.names.index("LeftToeBase"), r.names.index("RightToeBase")], 1]
        touching = toes[r.contacts[:, [1, 3]] > 0.5]
        low, high = np.percentile(touching, [2, 98])
        print(f"toe joints in contact: {low:.3f} to {high:.3f} m above the ground")
        assert low > -0.02 and high < 0.08, "feet on the ground"
        heads = r.positions[:, r.names.index("Head"), 1]
        assert (heads > 0.8).all() and (heads < 1.9).all()

    def test_every_rate_walks_the_same_path(self, network: Path) -> None:
        model = load_model(network)
        rng = np.random.default_rng(3)

        def path(steps) -> tuple[np.ndarray, np.ndarray]:
            character, time, rows = Controller(model), 0.0, []
            while time < 12.0:
                angle = 0.9 * math.sin(0.5 * time)
                dt = next(steps)
                character.step(dt, (1.4 * math.sin(angle), 1.4 * math.cos(angle)))
                time += dt
                rows.append((time, character.root[0], character.root[2]))
            array = np.array(rows)
            return array[:, 0], array[:, 1:]

        def forever(dt: float):
            while True:
                yield dt

        def irregular():
            while True:
                yield float(rng.uniform(0.002, 0.05))

        time, reference = path(forever(1 / 60))
        length = np.linalg.norm(np.diff(reference, axis=0), axis=1).sum()
        assert length > 8.0
        for name, steps in (
            ("30", forever(1 / 30)), ("144", forever(1 / 144)), ("irregular", irregular()),
        ):  # fmt: skip
            at, other = path(steps)
            inside = (at > 0.2) & (at < 11.9)
            same = np.stack([np.interp(at, time, reference[:, i]) for i in (0, 1)], axis=1)
            away = np.linalg.norm(other - same, axis=1)[inside].max()
            print(f"{name}: {away / length:.2%} of the path")
            assert away < 0.01 * length + 0.02, name

    def test_hills_carry_the_feet(self, network: Path) -> None:
        track = parse_track(SMALL.replace("[6, 6]", "[14, 14]"), "t")
        hills = Terrain.hills(1)
        lap = next(iter(walk_laps(load_model(network), track, hills, 1)))
        assert lap.figures.waypoints_reached == 3
        r = lap.recording
        toes = r.positions[:, [r.names.index("LeftToeBase"), r.names.index("RightToeBase")]]
        above = toes[..., 1] - hills.height(toes[..., 0], toes[..., 2])
        touching = above[r.contacts[:, [1, 3]] > 0.5]
        assert np.median(np.abs(touching - 0.04)) < 0.05
