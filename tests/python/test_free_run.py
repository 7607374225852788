"""Free runs: the commands, what counts as a fault, the figures, and the capture beside them."""

from __future__ import annotations

import json
import math
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from ambulo import Model, ModelError, _core, load_model
from ambulo.cli.evaluate import evaluate
from ambulo.evaluate import metrics
from ambulo.evaluate.captured import Capture, measure_capture
from ambulo.evaluate.commands import CLASSES, FPS, Command, Steady, classes_with, random_commands
from ambulo.evaluate.faults import Faults, Moment, inward, is_clean, total
from ambulo.evaluate.free_run import Settings, free_run
from ambulo.evaluate.steady import Body, Motion, figures, floors, reached
from conftest import JOINTS, follower

WALK = Command((0.0, 1.0))
STAND = Command((0.0, 0.0))


class TestCommands:
    def test_the_same_seed_gives_the_same_commands(self) -> None:
        gaits = ("walk", "run")
        first, second, other = (
            list(islice(random_commands(seed, gaits), 3000)) for seed in (4, 4, 5)
        )
        assert first == second != other

    def test_a_player_who_never_rests(self) -> None:
        commands = list(islice(random_commands(1, ("walk", "jog", "crouch")), 10 * 60 * FPS))
        stands = np.array([c.speed == 0.0 for c in commands])
        assert 0.08 < stands.mean() < 0.25
        assert {c.gait for c in commands} == {"walk", "jog", "crouch"}
        assert max(c.speed for c in commands) < 3.4 + 1e-9
        faced = [c for c in commands if c.facing]
        assert 0.1 < len(faced) / len(commands) < 0.4
        assert all(math.hypot(*c.facing) == pytest.approx(1.0) for c in faced if c.facing)
        # Something new every 0.5 to 4 s: speeds stay the same in between.
        changes = np.flatnonzero(np.abs(np.diff([c.speed for c in commands])) > 1e-9)
        assert np.diff(changes).min() >= 0.5 * FPS - 1
        assert np.percentile(np.diff(changes), 90) <= 8.0 * FPS

    def test_steady_commands_go_where_they_are_called(self) -> None:
        at = {steady.name: steady.at(1.0, 0.0) for steady in CLASSES}
        assert at["walk"].velocity == pytest.approx((0.0, 1.4)) and at["walk"].facing is None
        # The character faces +Z; its left is +X.
        assert at["left"].velocity == pytest.approx((1.0, 0.0), abs=1e-9)
        assert at["right"].velocity == pytest.approx((-1.0, 0.0), abs=1e-9)
        assert at["back"].velocity == pytest.approx((0.0, -1.0), abs=1e-9)
        assert at["back"].facing == pytest.approx((0.0, 1.0))
        # A quarter turn a second, to the left.
        assert at["turn left"].velocity == pytest.approx((1.2, 0.0), abs=1e-9)
        assert at["stand"].speed == 0.0

    def test_speeds_of_ones_own(self) -> None:
        chosen = {steady.name: steady.speed for steady in classes_with({"jog": 2.5})}
        assert chosen["jog"] == 2.5 and chosen["walk"] == 1.4
        with pytest.raises(ValueError, match="no command is called 'hop'; known: back, crouch"):
            classes_with({"hop": 1.0})
        with pytest.raises(ValueError, match="jog: expected a speed"):
            classes_with({"jog": math.nan})


class Puppet:
    """Moments of the toy's body that do as a test says."""

    def __init__(self, model: Model) -> None:
        self.faults = Faults(model)
        stance = np.zeros((len(JOINTS), 3))
        for joint, (_, parent, offset) in enumerate(JOINTS):
            stance[joint] = offset + (stance[parent] if parent >= 0 else np.array([0, 0.98, 0]))
        self.stance, self.still = stance, np.tile([0.0, 0.0, 0.0, 1.0], (len(JOINTS), 1))

    def play(
        self, frames: int, command: Command = WALK, *, swing=lambda _: 0.0, pose=None,
        turn: float = 0.0, event: str | None = None, speed: float = 0.0,
    ) -> dict[str, int]:  # fmt: skip
        for frame in range(frames):
            places = (self.stance if pose is None else pose).copy()
            places[3, 2] += swing(frame)
            places[:, 0] += speed * frame / FPS
            rotations = self.still.copy()
            rotations[2] = [math.sin(turn * frame / 2), 0.0, 0.0, math.cos(turn * frame / 2)]
            root = (speed * frame / FPS, 0.0, 0.0, 0.0)
            self.faults.watch(Moment(places, rotations, root, command, event))
        return {kind: count for kind, count in self.faults.counts.items() if count}


class TestFaults:
    def test_a_walk_has_none(self, toys: Model) -> None:
        puppet = Puppet(toys)
        assert puppet.play(600, swing=lambda i: 0.3 * math.sin(0.1 * i), turn=0.1) == {}
        totals = total([puppet.faults, puppet.faults])
        assert is_clean(totals) and totals["minutes"] == pytest.approx(1200 / 3600)
        assert totals["turn_rad_per_frame"]["max"] == pytest.approx(0.1, abs=1e-3)

    def test_freezes(self, toy: Model) -> None:
        assert Puppet(toy).play(3 * FPS) == {}, "not yet"
        assert Puppet(toy).play(3 * FPS + 2) == {"freeze": 1}
        assert Puppet(toy).play(20 * FPS) == {"freeze": 1}, "one spell"
        assert Puppet(toy).play(600, STAND) == {}, "who is to stand may be still"
        assert Puppet(toy).play(600, speed=1.0) == {"freeze": 1}, "slides in one pose"
        # A joint that moves by 2 mm now and then is enough, one by half a millimetre is not.
        assert Puppet(toy).play(600, swing=lambda i: 0.002 * (i // 100)) == {}
        assert Puppet(toy).play(600, swing=lambda i: 0.0005 * (i // 100)) == {"freeze": 1}

    def test_explosions(self, toy: Model) -> None:
        held = "held: the network's answer is not a body"
        assert Puppet(toy).play(5, event=held) == {"explosion": 1}
        assert Puppet(toy).play(5, event="skipped: 1 s") == {}
        stance = Puppet(toy).stance
        assert Puppet(toy).play(2, pose=stance * np.nan) == {"explosion": 1}
        assert Puppet(toy).play(2, pose=stance + np.array([1.2, 0.0, 0.0])) == {"explosion": 1}

    def test_broken_poses(self, toy: Model) -> None:
        stance = Puppet(toy).stance
        assert Puppet(toy).play(3, turn=1.1) == {"snap": 1}
        assert Puppet(toy).play(3, turn=0.9) == {}
        assert Puppet(toy).play(3, pose=stance * [1.0, 0.3, 1.0]) == {"fall": 1}
        assert Puppet(toy).play(3, pose=stance - [0.0, 0.3, 0.0]) == {"sink": 1}

    def test_spells_are_listed_with_their_time(self, toy: Model) -> None:
        puppet = Puppet(toy)
        puppet.play(60)
        puppet.play(30, pose=puppet.stance - [0.0, 0.3, 0.0])
        puppet.play(30)
        puppet.play(30, pose=puppet.stance - [0.0, 0.3, 0.0])
        totals = total([puppet.faults])
        assert totals["sink"] == 2 and totals["bad_frames"] == 60 and not is_clean(totals)
        assert [one["at_s"] for one in totals["first"]] == [1.0, 2.0]
        assert totals["first"][0]["gait"] == "walk" and totals["first"][0]["seed"] == 0

    def test_inward_is_the_characters_own_view(self) -> None:
        # Facing +X, what lies towards −Z is on the left.
        assert inward(np.array([0.0, 1.0, -2.0]), math.pi / 2) == pytest.approx([2.0, 1.0, 0.0])


def motion(root: np.ndarray, yaw: np.ndarray, toe_height: float = 0.02) -> Motion:
    """A body of two toes and hips over a path (T, 2)."""
    frames = len(root)
    positions = np.zeros((frames, 3, 3))
    positions[..., [0, 2]] = root[:, None]
    positions[:, 1:, 1], positions[:, 0, 1] = toe_height, 1.0
    above = positions[:, 1:, 1]
    return Motion(positions, root, yaw, above, np.ones((frames, 2), bool))


class TestSteady:
    body = Body(toes=(1, 2), toe_heights=(0.02, 0.02), chest=None)

    def test_speed_along_a_line(self) -> None:
        for heading in (0.0, 2.0):
            for aside, name in ((0.0, "walk"), (math.pi, "back")):
                steady = Steady(name, speed=1.0, aside=aside)
                move = heading + aside
                way = np.linspace(0.0, 9.0, 601)[:, None] * [math.sin(move), math.cos(move)]
                found = reached([motion(way, np.full(601, heading))], steady, [heading])
                assert found["speed_ratio"] == pytest.approx(0.9) and "turn_ratio" not in found

    def test_speed_and_turn_on_a_circle(self) -> None:
        steady, time = Steady("turn left", speed=1.2, turn=math.pi / 2), np.arange(601) / FPS
        turn, speed = 0.9 * steady.turn, 1.1 * steady.speed
        radius = speed / turn
        way = radius * np.stack([1.0 - np.cos(turn * time), np.sin(turn * time)], axis=1)
        found = reached([motion(way, turn * time)], steady, [0.0])
        assert found["turn_ratio"] == pytest.approx(0.9)
        assert found["speed_ratio"] == pytest.approx(1.1, rel=1e-3)

    def test_standing_has_a_drift(self) -> None:
        way = np.linspace(0.0, 0.2, 601)[:, None] * [1.0, 0.0]
        found = reached([motion(way, np.zeros(601))], Steady("stand"), [0.0])
        assert found == {"drift_cm_per_s": pytest.approx(2.0)}

    def test_skate_is_over_the_bodys_own_floor(self) -> None:
        way = np.arange(61)[:, None] * [0.01, 0.0]
        for height in (0.0, 0.05):
            found = figures([motion(way, np.zeros(61), height)], self.body, np.zeros(2))
            assert found["skate_cm_per_frame"] == pytest.approx(1.0)
            assert found["floor_cm"] == pytest.approx(100.0 * height)
        hardly = motion(way, np.zeros(61))
        hardly.touching[5:] = False
        assert floors([hardly], np.array([0.1, 0.2])) == pytest.approx([0.1, 0.2])

    def test_jerk_of_a_cubic(self) -> None:
        time = np.arange(31) / FPS
        way = np.stack([time**3, 0.0 * time], axis=1)
        found = figures([motion(way, 0.0 * time)], self.body, np.zeros(2))
        assert found["jerk_m_per_s3"] == pytest.approx(6.0)

    def test_sway_of_a_swing(self) -> None:
        time = np.arange(601) / FPS
        places = np.stack([0.03 * np.sin(2 * np.pi * time), 0.0 * time, 5.0 + 0.0 * time], axis=1)
        windows = metrics.sway(places, FPS)
        assert len(windows) == 9 and windows == pytest.approx(0.03 / math.sqrt(2.0), rel=0.01)
        assert len(metrics.sway(places[:50], FPS)) == 0

    def test_where_the_arms_meet_is_the_chest(self) -> None:
        names = ("Hips", "Spine", "Chest", "LeftArm", "RightArm", "LeftToe", "RightToe")
        parents = (None, 0, 1, 2, 2, 0, 0)
        skeleton = [{"name": n, "parent": p} for n, p in zip(names, parents, strict=True)]
        feet = {"joints": [5, 5, 6, 6], "heights": [0.1, 0.02, 0.1, 0.03]}
        body = Body.of({"skeleton": skeleton, "feet": feet})
        assert body == Body(toes=(5, 6), toe_heights=(0.02, 0.03), chest=2)
        assert Body.of({"skeleton": skeleton[:3], "feet": feet}).chest is None


def rows_of(layout_name: str, speed: float, turn: float, category: int, frames: int) -> np.ndarray:
    """A shard's rows: a body that glides ahead on a curve, its toes 3 cm high."""
    layout = _core.layout(layout_name, len(JOINTS))
    metre = layout["units_per_metre"]
    rate, left = (1.0 / FPS, -1.0) if layout_name == "holden" else (1.0, 1.0)
    parts = []
    time = np.arange(frames) / FPS
    yaw = turn * time
    step = speed / FPS * np.stack([np.sin(yaw), np.cos(yaw)], axis=1)
    place = np.cumsum(step, axis=0)
    parts += [np.zeros(frames), np.full(frames, category), place[:, 0], np.zeros(frames)]
    parts += [place[:, 1], yaw]
    pose = np.tile([0.0, 1.0, 0.0], (len(JOINTS), 1))
    pose[[4, 8]] = [0.1, 0.03, 0.1], [-0.1, 0.03, 0.1]
    known = {
        "root_velocity": np.tile([0.0, speed * rate * metre], (frames, 1)),
        "root_yaw": np.full((frames, 1), left * turn * rate),
        "contacts": np.ones((frames, 4)),
        "joint_position": np.tile(metre * pose.ravel(), (frames, 1)),
    }
    for side in ("inputs", "outputs"):
        for name, size in layout[side]:
            block = known.get(name) if side == "outputs" else None
            parts += list((np.zeros((frames, size)) if block is None else block).T)
    return np.stack(parts, axis=1).astype(np.float32)


class TestCapture:
    @pytest.mark.parametrize("layout", ["holden", "ambulo"])
    def test_finds_who_does_the_same(self, layout: str) -> None:
        model = follower(layout)
        quarter = math.pi / 2
        clips = [
            (rows_of(layout, 1.4, 0.0, 1, 300), [(0, 100), (100, 200)]),
            (rows_of(layout, 1.4, 0.0, 6, 300), [(0, 300)]),
            (rows_of(layout, 1.2, quarter, 1, 240), [(0, 240)]),
            (rows_of(layout, 2.8, 0.0, 1, 300), [(0, 300)]),
            (rows_of(layout, 0.0, 0.0, 0, 600), [(0, 600)]),
        ]
        capture = Capture(
            model.header["layout"], model.header["parts"], [lambda c=clip: c for clip in clips]
        )
        found, left_out = measure_capture(capture, CLASSES)
        assert left_out == []
        seconds = {name: round(figure["seconds"], 3) for name, figure in found.items()}
        expected = {"walk": 5.0, "turn left": 4.0, "stand": 10.0}
        assert {name: s for name, s in seconds.items() if s} == expected
        # Gliding toes skate by as much as the root moves.
        assert found["walk"]["skate_cm_per_frame"] == pytest.approx(140.0 / 60.0, rel=1e-3)
        assert found["walk"]["floor_cm"] == pytest.approx(3.0, abs=1e-3)
        assert found["stand"]["hips_sway_cm"] == pytest.approx(0.0, abs=1e-6)
        assert found["run"] == {"seconds": 0.0}

    def test_hills_are_left_out(self) -> None:
        model = follower("ambulo")
        rows = rows_of("ambulo", 1.4, 0.0, 1, 300)
        layout = _core.layout("ambulo", len(JOINTS))
        names = [name for name, _ in layout["inputs"]]
        sizes = [size for _, size in layout["inputs"]]
        start = 6 + sum(sizes[: names.index("terrain_centre")])
        rows[100:, start + 3] = 0.05
        capture = Capture(
            model.header["layout"], model.header["parts"], [lambda: (rows, [(0, 300)])]
        )
        found, _ = measure_capture(capture, CLASSES)
        assert found["walk"]["seconds"] == pytest.approx(100 / FPS)

    def test_files_of_another_skeleton_are_refused_with_the_reason(
        self, toy: Model, tmp_path: Path
    ) -> None:
        other = _core.Clip.from_arrays(
            names=["a", "b"], parents=[-1, 0], offsets=np.array([[0, 0, 0], [0, 1.0, 0]]), fps=60.0,
            rotations=np.tile([0.0, 0.0, 0.0, 1.0], (90, 2, 1)), root=np.zeros((90, 3)),
        )  # fmt: skip
        path = tmp_path / "other.bvh"
        _core.write_motion(str(path), other)
        capture = Capture.of_files(toy, [path])
        with pytest.raises(ValueError, match=r"no motion capture can be compared .*other\.bvh"):
            measure_capture(capture, CLASSES)


class TestFreeRun:
    def test_a_follower_obeys(self, toys: Model) -> None:
        settings = Settings(minutes=0.2, seeds=2)
        done: list[float] = []
        report = free_run(toys, settings, on_progress=done.append)
        assert done == sorted(done) and done[-1] == pytest.approx(settings.seconds)
        for name, found in report["classes"].items():
            if name != "stand":
                assert found["speed_ratio"] == pytest.approx(1.0, abs=0.05), name
            if name.startswith("turn"):
                assert found["turn_ratio"] == pytest.approx(1.0, abs=0.02)
        # It glides in one pose, which is what a freeze is.
        assert report["random"]["freeze"] > 0 and report["random"]["explosion"] == 0
        assert report["classes"]["stand"]["drift_cm_per_s"] < 0.5
        walk = report["classes"]["walk"]
        assert walk["skate_cm_per_frame"] == pytest.approx(140.0 / 60.0, rel=0.02)

    def test_the_same_every_time(self, toy: Model) -> None:
        settings = Settings(minutes=0.05, seeds=2, classes=classes_with({})[:2])
        first, second = (json.dumps(free_run(toy, settings)) for _ in range(2))
        assert first == second

    def test_beside_a_capture(self, toy: Model) -> None:
        clip = (rows_of("holden", 1.4, 0.0, 1, 600), [(0, 600)])
        capture = Capture(toy.header["layout"], toy.header["parts"], [lambda: clip])
        settings = Settings(minutes=0.0, seeds=1, classes=classes_with({})[:2])
        report = free_run(toy, settings, capture)
        assert report["classes"]["walk"]["ratios"]["skate"] == pytest.approx(1.0, rel=0.02)
        assert report["classes"]["stand"]["ratios"] == {}

    def test_command(self, toys: Model, tmp_path: Path) -> None:
        path = tmp_path / "toy.safetensors"
        toys.save(path)
        arguments = ["free-run", str(path), "--minutes", "0.1", "--seeds", "1"]
        run = CliRunner().invoke(evaluate, [*arguments, "--gait", "walk", "--json"])
        assert run.exit_code == 0, run.output
        report = json.loads(run.stdout)
        assert report["gaits"] == ["walk"] and report["random"]["minutes"] == pytest.approx(0.1)
        shown = CliRunner().invoke(evaluate, [*arguments, "--speed", "jog=2.5"])
        assert shown.exit_code == 0 and "freeze" in shown.output and "turn left" in shown.output
        assert "2.5" in shown.output and "standing: drifts" in shown.output
        for bad, message in [
            (["--speed", "hop=1"], "no command is called 'hop'"),
            (["--speed", "jog"], "expected COMMAND=METRES-A-SECOND"),
            (["--gait", "fly"], "'fly' is not one of"),
        ]:
            refused = CliRunner().invoke(evaluate, [*arguments, *bad])
            assert refused.exit_code == 2 and message in refused.output

    def test_a_model_that_cannot_be_controlled_is_named(self, tmp_path: Path) -> None:
        path = tmp_path / "broken.safetensors"
        follower(tuning={"stand_freedom": 3.0}).save(path)
        run = CliRunner().invoke(evaluate, ["free-run", str(path), "--seeds", "1"])
        assert isinstance(run.exception, ModelError)
        assert str(run.exception).startswith(f"{path}: the bundle's 'tuning' part is broken")

    def test_feet_can_be_held(self, network: Path) -> None:
        model, walk = load_model(network), (Steady("walk", "walk", 1.4),)
        skates = []
        for hold in (False, True):
            report = free_run(model, Settings(0.0, 1, classes=walk, hold_feet=hold))
            skates.append(report["classes"]["walk"]["skate_cm_per_frame"])
        print(f"skate {skates[0]:.2f} cm a frame, with feet held {skates[1]:.2f}")
        assert skates[1] < 0.8 * skates[0]

    def test_the_authors_network(self, network: Path) -> None:
        report = free_run(load_model(network), Settings(minutes=1.0, seeds=1))
        assert report["random"]["freeze"] == report["random"]["explosion"] == 0
        assert report["random"]["fall"] == report["random"]["sink"] == 0
        assert 0.6 < report["classes"]["walk"]["speed_ratio"] < 1.1
        assert report["classes"]["walk"]["skate_cm_per_frame"] < 0.6
