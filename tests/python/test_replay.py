"""Replaying: the fitness to the last bit, what is said of a motion, what is refused."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from ambulo._core import Arena, CreatureController
from ambulo.creature import CreatureError, load_controller, load_creature, recorded
from ambulo.starters import starter_model
from creature_runs import SMALL, ambulo, history, said, text_of, write_controller

# Biped 1 has two of these.
HIP = text_of("biped1")["joints"][0]
SHORT = ("--steps", 120, "--film", "none")
KEYS = {
    "fitness", "recorded_fitness", "usable", "reasons", "speed_bl_s", "upright", "torso_contact",
    "legs_used", "regularity", "cost_of_transport", "symmetry", "saturation", "terms", "creature",
    "task", "same_creature", "steps", "hash", "files", "solver", "robustness", "good",
}  # fmt: skip


def judged(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "judgement.json").read_text())


def test_a_run_is_filmed_drawn_and_judged(finished_run: Path, tmp_path: Path) -> None:
    folder = tmp_path / "deep" / "replay"
    run = ambulo("replay", finished_run, "-o", folder, "--steps", 120, "--seconds", 0.3)
    assert run.exit_code == 0, run.output
    assert {path.name for path in folder.iterdir()} == {
        "film.gif", "gait.png", "strip.png", "judgement.json",
    }  # fmt: skip
    found = judged(folder)
    assert set(found) >= KEYS
    assert sorted(found["files"]) == sorted(
        str(folder / name) for name in ("film.gif", "gait.png", "strip.png")
    )
    for file in found["files"]:
        with Image.open(file) as image:
            assert min(image.size) > 100
    with Image.open(folder / "film.gif") as film:
        # Three tenths of a second.
        frames = getattr(film, "n_frames", 1)
        assert 4 <= frames <= 19
    assert found["fitness"] == found["recorded_fitness"]
    assert found["recorded_fitness"] == load_controller(finished_run).record["fitness"]
    assert found["steps"] == 120 and found["same_creature"] and found["task"] == "run"
    assert found["usable"] == (not found["reasons"])
    for share in ("upright", "torso_contact", "saturation"):
        assert 0.0 <= found[share] <= 1.0
    assert 0 <= found["legs_used"] <= found["legs"] == 2
    verdict = "usable" if found["usable"] else "not usable"
    assert run.output.startswith(f"Biped 1, run: {verdict}\n")
    assert all(reason in run.output for reason in found["reasons"])


def test_a_controllers_file_is_enough_and_it_comes_out_the_same_again(
    finished_run: Path, tmp_path: Path
) -> None:
    copy = tmp_path / "mine.safetensors"
    copy.write_bytes((finished_run / "best.safetensors").read_bytes())
    reports = [
        said(ambulo("replay", source, "-o", tmp_path / name, *SHORT, "--json"))
        for name, source in (("a", finished_run), ("b", copy), ("c", copy))
    ]
    for name, report in zip("abc", reports, strict=True):
        assert report == judged(tmp_path / name)
        assert [Path(file).name for file in report.pop("files")] == ["strip.png", "gait.png"]
        assert {path.name for path in (tmp_path / name).iterdir()} == {
            "strip.png", "gait.png", "judgement.json",
        }  # fmt: skip
    assert reports[0] == reports[1] == reports[2]
    assert len(reports[0]["hash"]) == 16
    other = said(
        ambulo("replay", copy, "-o", tmp_path / "d", "--steps", 121, "--film", "none", "--json")
    )  # fmt: skip
    assert other["steps"] == 121 and other["hash"] != reports[0]["hash"]
    # The episode that was evolved is not the one that is looked at.
    assert other["fitness"] == reports[0]["fitness"]


def test_every_champion_replays_to_its_own_fitness(finished_run: Path, tmp_path: Path) -> None:
    champions = sorted((finished_run / "champions").iterdir())
    lines = history(finished_run)
    reached = [
        said(ambulo("replay", champion, "-o", tmp_path / "r", *SHORT, "--json"))["fitness"]
        for champion in champions
    ]
    assert reached == [line["best"] for line in lines if "champion" in line]
    assert reached == sorted(set(reached))


def test_a_recording_is_one_step_after_the_other(finished_run: Path) -> None:
    saved = load_controller(finished_run)
    arena = Arena(saved.creature, json.dumps(saved.settings))
    rollout, judgement = recorded(arena, saved.creature, saved.genome, 60)
    assert rollout.poses.shape == (61, 3, 3) and rollout.touching.shape == (61, 3)
    assert rollout.angles.shape == (61, 2) and rollout.commands.shape == (60, 2)
    assert rollout.torques.shape == (60, 2) and rollout.steps == 60
    assert rollout.joint_names == ("hip back", "hip front")
    assert [leg.name for leg in rollout.legs] == ["leg back", "leg front"]
    assert rollout.creature["parts"][rollout.torso]["name"] == "torso"
    assert np.abs(rollout.commands).max() <= 1.0
    assert np.abs(rollout.torques).max() <= 1.0001 * HIP["torque"]
    assert np.array_equal(rollout.angles[0], np.zeros(2))
    # As long as the episode that was evolved, so it ends where that did.
    torso = rollout.poses[:, rollout.torso, 0]
    assert torso[-1] - torso[0] == pytest.approx(saved.record["fitness"], abs=1e-5)
    longer, _ = recorded(arena, saved.creature, saved.genome, 90)
    assert np.array_equal(longer.poses[:61], rollout.poses)
    assert judgement["distance"] == pytest.approx(saved.record["fitness"], abs=1e-5)


# -- on others, and as others -----------------------------------------------------------------


def test_another_creature_with_as_many_joints_is_tried(finished_run: Path, tmp_path: Path) -> None:
    creature = text_of("biped1")
    for part in creature["parts"]:
        part["density"] *= 1.3
    heavier = tmp_path / "heavier.json"
    heavier.write_text(json.dumps(creature))
    own = said(ambulo("replay", finished_run, "-o", tmp_path / "a", *SHORT, "--json"))
    run = ambulo(
        "replay", finished_run, "-o", tmp_path / "b", *SHORT, "--creature", heavier, "--json"
    )  # fmt: skip
    other = said(run)
    assert not other["same_creature"] and own["same_creature"]
    assert other["hash"] != own["hash"] and other["fitness"] != own["fitness"]
    assert other["recorded_fitness"] == own["recorded_fitness"]
    same = ambulo(
        "replay", finished_run, "-o", tmp_path / "c", *SHORT, "--creature", "biped1", "--json"
    )  # fmt: skip
    assert said(same)["same_creature"] and said(same)["hash"] == own["hash"]


def test_a_creature_with_other_joints_is_refused(finished_run: Path, tmp_path: Path) -> None:
    folder = tmp_path / "r"
    run = ambulo("replay", finished_run, "-o", folder, *SHORT, "--creature", "tetrapod1")
    assert run.exit_code == 1
    assert "Tetrapod 1 needs a controller of 104 numbers, this one has 62" in run.output
    assert "joints and sensors must be as many as Biped 1 has" in run.output
    assert not folder.exists()
    run = ambulo("replay", finished_run, "-o", folder, *SHORT, "--creature", "centipede")
    assert run.exit_code == 1 and "there are apod" in run.output


def test_it_is_judged_as_another_task(finished_run: Path, tmp_path: Path) -> None:
    report = said(
        ambulo("replay", finished_run, "-o", tmp_path / "r", *SHORT, "--task", "jump", "--json")
    )  # fmt: skip
    assert report["task"] == "jump" and report["gain"] is not None
    assert report["fitness"] != report["recorded_fitness"]
    own = said(
        ambulo("replay", finished_run, "-o", tmp_path / "r", *SHORT, "--task", "run", "--json")
    )  # fmt: skip
    assert own["task"] == "run" and own["gain"] is None
    assert own["fitness"] == own["recorded_fitness"]


def test_a_controller_of_no_task_needs_one(tmp_path: Path) -> None:
    """As a tool of one's own may make it."""
    arena = Arena(load_creature("biped1"), json.dumps(SMALL))
    genome = arena.search().ask()[0]
    file = tmp_path / "c.safetensors"
    file.write_bytes(arena.controller(genome, "none", "{}", "{}"))
    run = ambulo("replay", file, "-o", tmp_path / "r", *SHORT)
    assert run.exit_code == 1 and "--task judges it" in run.output
    report = said(ambulo("replay", file, "-o", tmp_path / "r", *SHORT, "--task", "run", "--json"))
    assert report["recorded_fitness"] is None and math.isfinite(report["fitness"])
    baked = ambulo("creature", "bake", file, "-o", tmp_path / "b.json")
    assert baked.exit_code == 1 and "does not say what it was evolved for" in baked.output


# -- refusals ---------------------------------------------------------------------------------


def test_a_fitness_that_does_not_come_out_is_refused(finished_run: Path, tmp_path: Path) -> None:
    saved = load_controller(finished_run)
    arena = Arena(saved.creature, json.dumps(saved.settings))
    noted = math.nextafter(saved.record["fitness"], math.inf)
    file = write_controller(
        tmp_path / "c.safetensors", arena, saved.genome, fitness=noted, fitness_hex=noted.hex()
    )  # fmt: skip
    run = ambulo("replay", file, "-o", tmp_path / "r", *SHORT)
    assert run.exit_code == 1
    assert f"the replay reached {saved.record['fitness']!r}, but {noted!r} is noted" in run.output
    assert not (tmp_path / "r").exists()


def test_a_network_that_was_changed_is_noticed(finished_run: Path, tmp_path: Path) -> None:
    saved = load_controller(finished_run)
    arena = Arena(saved.creature, json.dumps(saved.settings))
    genome = saved.genome.copy()
    genome[0] += 0.5
    file = write_controller(tmp_path / "c.safetensors", arena, genome, **saved.record)
    run = ambulo("replay", file, "-o", tmp_path / "r", *SHORT)
    assert run.exit_code == 1 and "is noted: the file was changed" in run.output


def test_what_is_no_controller_is_refused_by_name(tmp_path: Path, finished_run: Path) -> None:
    folder = tmp_path / "empty"
    folder.mkdir()
    run = ambulo("replay", folder, "-o", tmp_path / "r")
    assert run.exit_code == 1
    assert f"{folder} holds no best.safetensors: is it a run's folder?" in run.output
    person = ambulo("replay", starter_model(), "-o", tmp_path / "r")
    assert person.exit_code == 1
    assert f"Error: {starter_model()}: kind 'pfnn' is not known; expected 'mlp'" in person.output
    whole = (finished_run / "best.safetensors").read_bytes()
    broken = tmp_path / "broken.safetensors"
    for content in (b"", b"12345678", whole[: len(whole) // 2], whole[:-1]):
        broken.write_bytes(content)
        run = ambulo("replay", broken, "-o", tmp_path / "r")
        assert run.exit_code == 1 and run.output.startswith(f"Error: {broken}: "), run.output
        with pytest.raises(CreatureError):
            load_controller(broken)
    torque = f'torque\\":{HIP["torque"]}'.encode()
    changed = whole.replace(torque, torque.replace(b"0.0", b"1.0"))
    assert changed != whole
    broken.write_bytes(changed)
    run = ambulo("replay", broken, "-o", tmp_path / "r")
    assert run.exit_code == 1 and "it was changed" in run.output
    assert ambulo("replay", tmp_path / "nothing", "-o", tmp_path / "r").exit_code == 2
    assert not (tmp_path / "r").exists()


def test_a_controller_alone_has_no_population(finished_run: Path, tmp_path: Path) -> None:
    best = finished_run / "best.safetensors"
    run = ambulo("replay", best, "-o", tmp_path / "r", *SHORT, "--population")
    assert run.exit_code == 2 and "--population needs a run's folder" in run.output
    report = said(
        ambulo("replay", finished_run, "-o", tmp_path / "r", *SHORT, "--population", "--json")
    )  # fmt: skip
    assert str(tmp_path / "r" / "population.png") in report["files"]
    with Image.open(tmp_path / "r" / "population.png") as picture:
        assert min(picture.size) > 100


# -- driving without physics ------------------------------------------------------------------


class TestDriving:
    @pytest.fixture
    def controller(self, finished_run: Path) -> CreatureController:
        return CreatureController.from_bytes((finished_run / "best.safetensors").read_bytes())

    def test_speeds_are_those_that_the_joints_have(self, controller: CreatureController) -> None:
        assert controller.widths == [3, 10, 2]
        draw = np.random.default_rng(1)
        found = []
        for rotation, *angles in draw.uniform(-math.pi, math.pi, (200, 3)):
            speeds = controller.drive(rotation, angles)
            assert speeds.shape == (2,) and np.isfinite(speeds).all()
            found.append(speeds)
        assert np.abs(found).max() <= HIP["speed"] and np.std(found) > 0.1
        again = controller.drive(0.1, [0.2, 0.3]), controller.drive(0.1, [0.2, 0.3])
        assert np.array_equal(*again)

    def test_it_asks_for_what_the_arena_asked_for(
        self, controller: CreatureController, finished_run: Path
    ) -> None:
        saved = load_controller(finished_run)
        arena = Arena(saved.creature, json.dumps(saved.settings))
        rollout, _ = recorded(arena, saved.creature, saved.genome, 60)
        tilt = rollout.poses[:, rollout.torso, 2] - rollout.poses[0, rollout.torso, 2]
        asked = [
            controller.drive(float(tilt[step]), rollout.angles[step].tolist()) / HIP["speed"]
            for step in range(60)
        ]
        assert np.abs(np.array(asked) - rollout.commands).max() < 1e-3

    @pytest.mark.parametrize("angles", [[], [0.0], [0.0, 0.0, 0.0]])
    def test_a_number_for_each_joint_is_needed(
        self, angles: list[float], controller: CreatureController
    ) -> None:
        with pytest.raises(ValueError, match=f"{len(angles)}.*2|2.*{len(angles)}"):
            controller.drive(0.0, angles)
