"""What a search may do beside finding a controller: bodies, lessons, physics that change.

And the study of how soon all that goes.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from ambulo._core import Arena
from ambulo.creature import load_controller, load_creature
from ambulo.evolution import Evolution
from ambulo.study import gaits
from creature_runs import ambulo, history, outcome, said

TOML = """
generations = 8
seed = 3
[evolution]
population = 8
[task]
steps = 200
grow = [60]
[search]
trials = 4
"""
LESSONS = """
seed = 2
generations = 40
[evolution]
population = 32
[[curriculum]]
task = "run"
until = "usable"
[[curriculum]]
ground = {kind = "hurdles", height = 0.02, width = 0.15, between = 2.0}
steps = 300
until = "usable"
"""


def write(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


# -- bodies -----------------------------------------------------------------------------------


def test_a_champion_brings_its_own_body(tmp_path: Path) -> None:
    config, folder = write(tmp_path / "c.toml", TOML), tmp_path / "run"
    options = ("-o", folder, "--config", config, "--body", "--json")
    report = said(ambulo("evolve", "tetrapod2", "run", *options))
    base, evolved = load_creature("tetrapod2"), load_creature(folder / "evolved.json")
    saved = load_controller(folder)
    assert saved.creature.hash == evolved.hash != base.hash
    assert load_creature(folder / "creature.json").hash == base.hash
    assert "body" not in saved.settings and "body" in Evolution.resume(folder).settings
    for part, before in zip(
        json.loads(evolved.json())["parts"], json.loads(base.json())["parts"], strict=True
    ):
        assert 0.8 - 1e-6 <= part["density"] / before["density"] <= 1.25 + 1e-6
        assert part["density"] != before["density"]
    # Every file is enough to repeat what it did, and the replay says so.
    for line in (line for line in history(folder) if "champion" in line):
        file = load_controller(folder / line["champion"])
        arena = Arena(file.creature, json.dumps(file.settings))
        assert arena.score(file.genome)[0] == file.record["fitness"] == line["best_so_far"]
    replayed = said(
        ambulo("replay", folder, "-o", tmp_path / "r", "--film", "none", "--population", "--json")
    )
    assert replayed["fitness"] == replayed["recorded_fitness"] == report["fitness"]
    assert replayed["same_creature"] and (tmp_path / "r" / "population.png").is_file()


def test_a_run_of_bodies_goes_on_to_the_same_end(tmp_path: Path) -> None:
    config = write(tmp_path / "c.toml", TOML + "[body]\nsize = [0.5, 1.5]\n")
    for folder, first in (("whole", 8), ("parts", 3)):
        options = ("-o", tmp_path / folder, "--config", config, "--body", "--robust")
        run = ambulo("evolve", "biped1", "run", *options, "--generations", first)
        assert run.exit_code == 0, run.output
    run = ambulo("evolve", "--resume", "-o", tmp_path / "parts", "--generations", 8)
    assert run.exit_code == 0, run.output
    parts, whole = outcome(tmp_path / "parts"), outcome(tmp_path / "whole")
    assert set(parts) == set(whole)
    # Champions say how many generations were asked for when they were found.
    for name in ("history.jsonl", "checkpoint.json", "evolved.json", "run.json"):
        assert parts[name] == whole[name], name
    settings = Evolution.resume(tmp_path / "whole").settings
    # What the file says of bodies stands; the flag adds the rest.
    assert settings["body"]["size"] == [0.5, 1.5]
    assert settings["body"]["density"] == pytest.approx([0.8, 1.25])
    assert settings["search"]["randomise"] is True


def test_a_new_run_in_the_folder_takes_the_body_away(tmp_path: Path) -> None:
    config, folder = write(tmp_path / "c.toml", TOML), tmp_path / "run"
    options = ("-o", folder, "--config", config, "--generations", 1)
    assert ambulo("evolve", "biped1", "run", *options, "--body").exit_code == 0
    assert (folder / "evolved.json").is_file()
    assert ambulo("evolve", "biped1", "run", *options, "--overwrite").exit_code == 0
    assert not (folder / "evolved.json").exists()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[body]\nsize = [2.0, 3.0]", "body.size: [2, 3] is not a factor of 0.25 to 1"),
        ("[body]\nlength = [0.5, 1.0]", "body.length: unknown field"),
        ("[[curriculum]]\nuntil = 'perfect'", "curriculum[0].until"),
        ("[[curriculum]]\ntask = 'fly'\nuntil = 'good'", "curriculum[0]: task.name: no task"),
    ],
)
def test_what_cannot_be_is_refused_with_its_place(text: str, told: str, tmp_path: Path) -> None:
    config = write(tmp_path / "c.toml", text)
    run = ambulo("evolve", "frog", "run", "-o", tmp_path / "run", "--config", config)
    assert run.exit_code == 1 and "c.toml" in run.output and told in run.output, run.output
    assert not (tmp_path / "run").exists()


# -- lessons ----------------------------------------------------------------------------------


def test_lessons_come_first_and_are_told(tmp_path: Path) -> None:
    config, folder = write(tmp_path / "c.toml", LESSONS), tmp_path / "run"
    options = ("-o", folder, "--config", config)
    plan = ambulo("evolve", "tetrapod2", "hurdles", *options, "--dry-run").output
    assert "lesson 1: run until usable" in plan and "lesson 2: hurdles until usable" in plan
    report = said(ambulo("evolve", "tetrapod2", "hurdles", *options, "--until", "usable", "--json"))
    assert report["reached"] and report["lessons_ahead"] == 0
    lines = history(folder)
    ahead = [line.get("ahead", 0) for line in lines]
    assert ahead == sorted(ahead, reverse=True) and {0, 1, 2} == set(ahead)
    assert sum(line.get("learned", False) for line in lines) == 2
    assert all("champion" not in line for line in lines if line.get("ahead"))
    saved = load_controller(folder)
    assert saved.settings["task"]["name"] == "hurdles"
    replayed = said(ambulo("replay", folder, "-o", tmp_path / "r", "--film", "none", "--json"))
    assert replayed["usable"] and replayed["fitness"] == report["fitness"]


def test_a_run_that_ends_in_a_lesson_says_so(tmp_path: Path) -> None:
    text = '[search]\ntrials = 2\n[[curriculum]]\ntask = "jump"\nuntil = "good"\n'
    config, folder = write(tmp_path / "c.toml", text), tmp_path / "run"
    options = ("-o", folder, "--config", config, "--population", 4, "--generations", 1)
    run = ambulo("evolve", "decapod1", "run", *options)
    assert run.exit_code == 0 and "still in lesson 1 of 1" in run.output, run.output
    assert not (folder / "best.safetensors").exists()
    report = said(ambulo("evolve", "--resume", "-o", folder, "--generations", 2, "--json"))
    assert report["lessons_ahead"] == 1 and report["fitness"] is None
    assert [line["best_so_far"] for line in history(folder)] == [None, None]


# -- how soon ---------------------------------------------------------------------------------


def test_the_study_of_how_soon_has_a_line_for_every_case(tmp_path: Path) -> None:
    options = ("--creature", "tetrapod1", "--seeds", 1, "--seconds", 0.4, "--task", "run")
    totals = said(ambulo("study", "gaits", "-o", tmp_path / "g", *options, "--json"))
    rows = [row for row in gaits.ROWS if row.task == "run"]
    assert [total["row"] for total in totals] == [row.name for row in rows]
    results: dict[str, Any] = json.loads((tmp_path / "g" / "results.json").read_text())
    assert results["totals"] == totals and len(results["cases"]) == len(rows)
    first = results["cases"][0]
    assert first["seconds"]["usable"] <= first["seconds"]["robust"] and first["judgement"]["usable"]
    page = (tmp_path / "g" / "README.md").read_text()
    assert page.count("| Tetrapod 1 |") == len(rows)
    assert "| Tetrapod 1 | 5 min | 1 |" in page and f"| run | {totals[0]['usable']} of 1" in page


def test_minutes_of_the_seed_are_told_where_it_has_any() -> None:
    assert gaits.minutes_of_the_seed("tetrapod2", "run") == "27 min"
    assert gaits.minutes_of_the_seed("decapod2", "run") == "never (58 min)"
    assert gaits.minutes_of_the_seed("tetrapod2", "swim") == "–"
    assert gaits.minutes_of_the_seed("raptor", "run") == "–"
