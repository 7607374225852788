"""Baking: where a motion repeats itself, and keyframes whose end meets their beginning."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ambulo._core import Arena
from ambulo.bake import Loop, bake, find_loop
from ambulo.creature import load_creature, recorded
from ambulo.rollout import Rollout
from creature_runs import SMALL, ambulo, gaited, said, write_controller

PERIOD, DT = 30, 1.0 / 60.0


def rollout(steps: int = 200, speed: float = 1.2, noise: float = 0.0) -> Rollout:
    """A torso that goes forward and bobs, a leg that swings, a wheel that turns with the gait."""
    cycle = 2.0 * np.pi * np.arange(steps + 1) / PERIOD
    x = speed * DT * np.arange(steps + 1) + 0.02 * np.sin(2.0 * cycle)
    y = 0.8 + 0.05 * np.cos(cycle)
    poses = np.zeros((steps + 1, 3, 3))
    poses[:, 0] = np.stack([x, y, 0.1 * np.sin(cycle)], axis=1)
    poses[:, 1] = np.stack([x + 0.2 * np.sin(cycle), y - 0.4, 0.8 * np.sin(cycle)], axis=1)
    # As physics gives it: between half a turn to the left and half a turn to the right.
    turned = (cycle + np.pi) % (2.0 * np.pi) - np.pi
    poses[:, 2] = np.stack([x - 0.3, y - 0.4, turned], axis=1)
    poses += np.random.default_rng(1).normal(0.0, 1.0, poses.shape) * noise
    return Rollout(
        creature={"name": "Cart", "parts": [{"name": n} for n in ("torso", "leg", "wheel")]},
        dt=DT, poses=poses.astype(np.float32), touching=np.zeros((steps + 1, 3), bool),
        angles=np.zeros((steps + 1, 2), np.float32), commands=np.zeros((steps, 2), np.float32),
        torques=np.zeros((steps, 2), np.float32), legs=(), torso=0, joint_names=("a", "b"),
        ground=np.zeros((2, 2), np.float32),
    )  # fmt: skip


def tracks(motion: dict[str, Any]) -> np.ndarray:
    """(F, P, 3): what was baked as numbers."""
    parts = motion["parts"].values()
    return np.stack([np.stack([p["x"], p["y"], p["angle"]], axis=1) for p in parts], axis=1)


def turn_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The short way around."""
    return np.abs((b - a + np.pi) % (2.0 * np.pi) - np.pi)


def assert_closed(motion: dict[str, Any]) -> None:
    """The end is the beginning, so much farther on; angles do not jump on the way."""
    frames, loop = tracks(motion), motion["loop"]
    assert motion["frames"] == len(frames)
    assert frames[-1, :, 0] - frames[0, :, 0] == pytest.approx(loop["advance"], abs=1e-4)
    assert frames[-1, :, 1] == pytest.approx(frames[0, :, 1], abs=1e-4)
    assert turn_between(frames[0, :, 2], frames[-1, :, 2]).max() < 1e-4
    assert np.abs(np.diff(frames[..., 2], axis=0)).max() < np.pi
    assert (len(frames) - 1) / motion["fps"] == pytest.approx(loop["duration_s"])


# -- where it repeats itself ------------------------------------------------------------------


@pytest.mark.parametrize("share", [0.9, 1.0, 1.1])
def test_the_period_is_found_near_to_where_it_is_said_to_be(share: float) -> None:
    loop = find_loop(rollout(), share * PERIOD * DT)
    assert loop.length == PERIOD and loop.start >= 100
    assert loop.seam < 1e-5 and loop.seam_angle < 1e-5
    assert loop.advance == pytest.approx(1.2 * PERIOD * DT, abs=1e-5)


def test_the_seam_says_how_far_the_ends_are_apart() -> None:
    loop = find_loop(rollout(noise=0.01), PERIOD * DT)
    assert abs(loop.length - PERIOD) <= 2
    assert 1e-4 < loop.seam < 0.05 and 1e-4 < loop.seam_angle < 0.05


def test_the_least_bad_seam_is_taken() -> None:
    seen = rollout(noise=0.01)
    clean = rollout().poses
    # One period in the second half is as it should be, with the step before each end.
    seen.poses[129:161] = clean[129:161]
    loop = find_loop(seen, PERIOD * DT)
    assert (loop.start, loop.length) == (130, PERIOD) and loop.seam < 1e-5


def test_ends_that_only_touch_are_no_loop() -> None:
    """Half a period on, a swinging leg is where it was, on its way back."""
    seen = rollout()
    seen.poses[:, :, 1:] = 0.0
    seen.poses[:, 1, 2] = np.sin(2.0 * np.pi * np.arange(201) / PERIOD)
    seen.poses[:, :, 0] = 0.0
    loop = find_loop(seen, PERIOD * DT)
    assert loop.length == PERIOD


@pytest.mark.parametrize("steps", [20, 45, 66])
def test_an_episode_of_less_than_two_periods_is_too_short(steps: int) -> None:
    says = rf"an episode of {steps} steps is too short for a loop of 0.50 s; give more --steps"
    with pytest.raises(ValueError, match=says):
        find_loop(rollout(steps), PERIOD * DT)
    assert find_loop(rollout(72), PERIOD * DT).length == PERIOD


# -- keyframes --------------------------------------------------------------------------------


def test_a_loop_is_closed() -> None:
    seen = rollout(noise=0.01)
    loop = find_loop(seen, PERIOD * DT)
    motion = bake(seen, loop)
    assert motion["frames"] == loop.length + 1 and motion["fps"] == pytest.approx(60.0)
    assert_closed(motion)
    frames = tracks(motion)
    assert frames[0, 0, 0] == 0.0
    # Nothing is moved by more than what had to be closed.
    there = seen.poses[loop.start : loop.start + loop.length + 1].astype(float)
    there[..., 0] -= there[0, 0, 0]
    moved = np.abs(frames - there)[..., :2].max()
    assert 0.0 < moved < 0.05
    # The wheel turns once and on, and does not spring back.
    assert abs(frames[-1, 2, 2] - frames[0, 2, 2]) == pytest.approx(2.0 * np.pi, abs=1e-4)


@pytest.mark.parametrize("every", [1, 2, 4, 7, 29, 60])
def test_fewer_keyframes_still_end_where_the_loop_ends(every: int) -> None:
    """Of 30 steps every 4th is 0 to 28: the last two were missing, and the loop jerked."""
    seen = rollout()
    loop = find_loop(seen, PERIOD * DT)
    motion = bake(seen, loop, every=every)
    assert motion["frames"] == max(round(PERIOD / every), 1) + 1
    if every < PERIOD / 2:
        assert_closed(motion)
    assert (motion["frames"] - 1) / motion["fps"] == pytest.approx(PERIOD * DT)
    whole = tracks(bake(seen, loop))
    assert tracks(motion)[[0, -1]] == pytest.approx(whole[[0, -1]], abs=1e-5)


def test_without_a_loop_it_is_all_of_the_episode() -> None:
    seen = rollout(45)
    motion = bake(seen, None)
    assert motion["loop"] is None and motion["frames"] == 46
    frames = tracks(motion)
    expected = seen.poses.astype(float)
    assert frames[..., :2] == pytest.approx(expected[..., :2], abs=1e-5)
    assert np.abs(np.diff(frames[:, 2, 2])).max() < 0.3
    assert turn_between(frames[..., 2], expected[..., 2]).max() < 1e-4
    third = bake(seen, None, every=3)
    assert third["frames"] == 16 and third["fps"] == pytest.approx(20.0)
    assert np.array_equal(tracks(third), frames[::3])


def test_the_value_is_as_documented_and_plain_json() -> None:
    motion = bake(rollout(), Loop(110, PERIOD, 0.001, 0.002, 0.6))
    assert json.loads(json.dumps(motion, allow_nan=False)) == motion
    assert list(motion) == ["format", "creature", "fps", "frames", "loop", "parts"]
    assert motion["format"] == 1 and motion["creature"] == "Cart"
    assert motion["loop"] == {
        "start_s": pytest.approx(110 * DT), "duration_s": pytest.approx(PERIOD * DT),
        "advance": 0.6, "seam": 0.001, "seam_angle": 0.002,
    }  # fmt: skip
    assert list(motion["parts"]) == ["torso", "leg", "wheel"]
    for track in motion["parts"].values():
        assert {key: len(values) for key, values in track.items()} == {
            "x": PERIOD + 1, "y": PERIOD + 1, "angle": PERIOD + 1,
        }  # fmt: skip


# -- the command ------------------------------------------------------------------------------

STEPS = 400


@pytest.fixture(scope="module")
def walker(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A controller with a gait."""
    arena, genome, _, _ = gaited(load_creature("tetrapod1"), STEPS)
    return write_controller(tmp_path_factory.mktemp("walker") / "c.safetensors", arena, genome)


@pytest.mark.parametrize("every", [1, 3])
def test_a_gait_is_baked_as_a_loop(every: int, walker: Path, tmp_path: Path) -> None:
    file = tmp_path / "gait.json"
    arguments = ("creature", "bake", walker, "-o", file, "--steps", STEPS, "--every", every)
    report = said(ambulo(*arguments, "--json"))
    motion = json.loads(file.read_text())
    assert_closed(motion)
    assert list(motion["parts"]) == [
        part["name"] for part in json.loads(load_creature("tetrapod1").json())["parts"]
    ]
    assert report == {
        "output": str(file), "frames": motion["frames"], "fps": motion["fps"],
        "regularity": pytest.approx(report["regularity"]), "loop": motion["loop"],
    }  # fmt: skip
    assert report["regularity"] > 0.6
    assert motion["fps"] == pytest.approx(60.0 / every, rel=0.2)
    refused = ambulo(*arguments)
    assert refused.exit_code == 1 and "exists; --overwrite replaces it" in refused.output
    again = ambulo(*arguments, "--overwrite")
    assert again.exit_code == 0, again.output
    assert f"{motion['frames']} keyframes of 5 parts" in again.output
    assert "m forward; seam " in again.output and f"wrote {file}" in again.output
    assert json.loads(file.read_text()) == motion


def test_all_of_it_is_baked_if_that_is_asked_for(walker: Path, tmp_path: Path) -> None:
    file = tmp_path / "whole.json"
    report = said(
        ambulo("creature", "bake", walker, "-o", file, "--steps", 50, "--whole", "--json")
    )  # fmt: skip
    assert report["frames"] == 51 and report["loop"] is None
    assert json.loads(file.read_text())["loop"] is None


def test_a_jump_is_baked_whole(tmp_path: Path) -> None:
    arena = Arena(
        load_creature("biped1"), json.dumps(SMALL | {"task": {"name": "jump", "steps": 60}})
    )  # fmt: skip
    jumper = write_controller(tmp_path / "c.safetensors", arena, arena.search().ask()[0])
    report = said(
        ambulo("creature", "bake", jumper, "-o", tmp_path / "j.json", "--steps", 40, "--json")
    )  # fmt: skip
    assert report["frames"] == 41 and report["loop"] is None


def test_a_motion_that_does_not_repeat_itself_is_refused_with_the_way_out(tmp_path: Path) -> None:
    creature = load_creature("biped1")
    arena = Arena(creature, json.dumps(SMALL | {"evolution": {"population": 60}}))
    genomes = arena.search().ask()
    judged = [recorded(arena, creature, genome, 100)[1] for genome in genomes]
    # One whose best period is a bad one, and one that lies still and has none.
    vague = next(n for n, j in enumerate(judged) if j["period_s"] and j["regularity"] < 0.45)
    still = next(n for n, j in enumerate(judged) if j["period_s"] is None)
    stumbler, file = tmp_path / "c.safetensors", tmp_path / "b.json"
    for index in (vague, still):
        write_controller(stumbler, arena, genomes[index])
        run = ambulo("creature", "bake", stumbler, "-o", file, "--steps", 100)
        assert run.exit_code == 1 and not file.exists()
        regularity = judged[index]["regularity"] or 0.0
        assert (
            f"this motion does not repeat itself (regularity {regularity:.2f}, 0.5 is needed): "
            "--whole bakes all of it"
        ) in run.output
    assert ambulo("creature", "bake", stumbler, "-o", file, "--steps", 7).exit_code == 2
    assert ambulo("creature", "bake", stumbler, "-o", file, "--every", 0).exit_code == 2


def test_a_run_folder_is_baked_too(finished_run: Path, tmp_path: Path) -> None:
    file = tmp_path / "b.json"
    run = ambulo("creature", "bake", finished_run, "-o", file, "--whole", "--steps", 60)
    assert run.exit_code == 0, run.output
    motion = json.loads(file.read_text())
    torso = motion["parts"]["torso"]["x"]
    best = json.loads((finished_run / "history.jsonl").read_text().splitlines()[-1])
    # What it was evolved for: how far the torso comes in as many steps.
    assert torso[0] == 0.0 and torso[-1] == pytest.approx(best["best_so_far"], abs=1e-3)
    assert math.isclose(motion["fps"], 60.0, rel_tol=1e-6)
