"""The study of the seed: what it does, does not do twice, and goes on with."""

from __future__ import annotations

import importlib
import json
import shutil
import signal
import time
from pathlib import Path
from typing import Any

import pytest

from ambulo.creature import load_controller
from ambulo.evolution import Evolution
from ambulo.study import seed_2d
from ambulo.study.published import PUBLISHED
from ambulo.study.seed_2d import Plan, begun, evolve_all, gather, publish, seed_creatures
from creature_runs import ambulo, history, outcome, said, start

ARGUMENTS = ("--runs", 1, "--generations", 2, "--creature", "biped1", "--creature", "tetrapod1")
JUMPS = (*ARGUMENTS, "--task", "jump")


def runs(folder: Path) -> dict[str, Any]:
    """What came of every run, by its place."""
    found = sorted(path.parent for path in (folder / "runs").rglob("run.json"))
    return {str(run.relative_to(folder)): outcome(run) for run in found}


def results(folder: Path) -> dict[str, Any]:
    """The results without what clocks and the machine decide."""
    found = json.loads((folder / "results.json").read_text())
    for case in found["cases"]:
        for run in case["runs"]:
            del run["seconds"]
            for mark in run["marks"]:
                del mark["seconds"]
    return {key: found[key] for key in found if key not in ("machine", "started", "seconds")}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished small study of two creatures that jump. Not to be changed."""
    folder = tmp_path_factory.mktemp("study") / "whole"
    report = said(ambulo("study", "seed-2d", "-o", folder, *JUMPS, "--json"))
    assert report == {
        "page": str(folder / "index.html"), "results": str(folder / "results.json"),
        "finished": True,
    }  # fmt: skip
    return folder


def test_the_creatures_and_settings_are_the_seeds(tmp_path: Path) -> None:
    assert seed_creatures() == (
        "apod", "biped1", "biped2", "tetrapod1", "tetrapod2", "decapod1", "decapod2",
    )  # fmt: skip
    plan = Plan(tmp_path, seed_creatures(), ("run", "jump"), PUBLISHED.runs)
    assert len(plan.cases) == 14 and plan.cases[0] == ("apod", "run")
    assert (plan.runs, plan.generations, plan.population) == (10, 300, 50)
    assert plan.settings("jump", 4) == {
        "preset": "seed", "generations": 300, "seed": 4, "evolution": {"population": 50},
        "task": {"name": "jump"},
    }  # fmt: skip


def test_a_study_leaves_runs_results_pictures_and_a_page(whole: Path) -> None:
    assert set(runs(whole)) == {f"runs/{name}-jump/seed-1" for name in ("biped1", "tetrapod1")}
    found = json.loads((whole / "results.json").read_text())
    assert found["runs"] == 1 and found["generations"] == 2 and found["population"] == 50
    assert found["settings"]["judged_steps"] == 2000
    assert found["seconds"] > 0.0 and found["machine"]["cpu"]
    assert [case["creature"] for case in found["cases"]] == ["biped1", "tetrapod1"]
    page = (whole / "index.html").read_text()
    for case in found["cases"]:
        folder = whole / "runs" / f"{case['creature']}-jump" / "seed-1"
        assert case["task"] == "jump" and case["steps"] == 500
        (run,) = case["runs"]
        lines = history(folder)
        assert run["seed"] == 1
        assert run["best"] == [round(line["best_so_far"], 4) for line in lines]
        assert run["mean"] == [round(line["mean"], 4) for line in lines]
        mark = run["marks"][-1]
        assert mark["generation"] == 2 and mark["usable"] == (not mark["reasons"])
        assert mark["fitness"] == load_controller(folder).record["fitness"]
        for key in ("picture", "gait"):
            assert (whole / case[key]).is_file() and case[key] in page
    assert (whole / "tables").is_dir() and (whole / "figures").is_dir()


def test_a_study_that_is_done_is_not_done_again(whole: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(whole, tmp_path / "study")
    before = {path: path.stat().st_mtime_ns for path in (folder / "runs").rglob("*.*")}
    run = ambulo("study", "seed-2d", "-o", folder, *JUMPS)
    assert run.exit_code == 0, run.output
    assert f"wrote {folder / 'index.html'}" in run.output
    assert runs(folder) == runs(whole) and results(folder) == results(whole)
    champions = [path for path in before if path.suffix == ".safetensors"]
    assert champions and all(path.stat().st_mtime_ns == before[path] for path in champions)


def test_a_study_that_was_stopped_goes_on_to_the_same_results(whole: Path, tmp_path: Path) -> None:
    folder = tmp_path / "study"
    plan = Plan(folder, ("biped1", "tetrapod1"), ("jump",), runs=1, generations=2)
    told: list[tuple[str, float]] = []

    def watch(name: str, done: float) -> None:
        told.append((name, done))

    # In the middle of the first run.
    assert not evolve_all(plan, threads=1, stop=lambda: len(told) >= 1, watch=watch)
    assert told == [("biped1 jump 1/1", 1)] and begun(plan)
    unfinished = gather(plan)
    publish(plan, unfinished)
    assert [len(run["best"]) for case in unfinished["cases"] for run in case["runs"]] == [1]
    assert (folder / "index.html").is_file()
    run = ambulo("study", "seed-2d", "-o", folder, *JUMPS)
    assert run.exit_code == 0, run.output
    assert runs(folder) == runs(whole) and results(folder) == results(whole)


def test_more_runs_are_added_to_those_there_are(whole: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(whole, tmp_path / "study")
    more = ("--runs", 2, "--generations", 2, "--creature", "biped1", "--task", "jump")
    assert ambulo("study", "seed-2d", "-o", folder, *more).exit_code == 0
    first, second = results(folder)["cases"][0]["runs"]
    assert first == results(whole)["cases"][0]["runs"][0] and second["seed"] == 2
    assert second["best"] != first["best"]
    assert runs(folder)["runs/biped1-jump/seed-1"] == runs(whole)["runs/biped1-jump/seed-1"]


def test_a_folder_of_another_study_is_refused(whole: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(whole, tmp_path / "study")
    other = ("--runs", 1, "--generations", 3, "--creature", "biped1", "--task", "jump")
    run = ambulo("study", "seed-2d", "-o", folder, *other)
    assert run.exit_code == 1
    assert "biped1-jump/seed-1 is a run with other settings; give another folder" in run.output
    assert runs(folder) == runs(whole) and results(folder) == results(whole)


def test_only_the_page_is_made_anew(whole: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(whole, tmp_path / "study")
    for name in ("index.html", "results.json"):
        (folder / name).unlink()
    shutil.rmtree(folder / "pictures")
    run = ambulo("study", "seed-2d", "-o", folder, "--page-only", *JUMPS, "--task", "run")
    assert run.exit_code == 0, run.output
    found = results(folder)
    # Those that run were never begun, and are not begun now.
    assert [len(case["runs"]) for case in found["cases"] if case["task"] == "run"] == [0, 0]
    assert [c for c in found["cases"] if c["task"] == "jump"] == results(whole)["cases"]
    assert runs(folder) == runs(whole)
    assert (folder / "index.html").is_file() and list((folder / "pictures").iterdir())


def test_there_is_no_page_of_nothing(tmp_path: Path) -> None:
    """It named a half-written file of its own as missing."""
    folder = tmp_path / "study"
    run = ambulo("study", "seed-2d", "-o", folder, "--page-only", *JUMPS)
    assert run.exit_code == 1 and f"Error: {folder} holds no run of these cases yet" in run.output
    assert not folder.exists()


def test_a_page_of_a_plan_that_the_runs_do_not_follow_is_refused(
    tmp_path: Path, whole: Path
) -> None:
    """It used to write a page that said another number of generations than there were."""
    folder = tmp_path / "study"
    shutil.copytree(whole, folder)
    before = (folder / "results.json").read_bytes()
    run = ambulo(
        "study", "seed-2d", "-o", folder, "--page-only", *JUMPS, "--generations", 1
    )  # fmt: skip
    assert run.exit_code == 1 and "is a run with other settings" in run.output
    assert (folder / "results.json").read_bytes() == before


def test_a_dry_run_says_how_much_it_is_and_writes_nothing(tmp_path: Path) -> None:
    run = ambulo("study", "seed-2d", "-o", tmp_path / "study", "--dry-run")
    assert run.exit_code == 0
    shown = dict(line.split() for line in run.stdout.splitlines())
    assert shown == {
        "cases": "14", "runs": "10", "generations": "300", "population": "50",
        "all_generations": "42000",
    }  # fmt: skip
    told = ambulo("study", "seed-2d", "-o", tmp_path / "study", "--dry-run", "--json")
    assert json.loads(told.stdout) == {key: int(value) for key, value in shown.items()}
    run = ambulo("study", "seed-2d", "-o", tmp_path / "study", *ARGUMENTS, "--dry-run")
    assert [int(line.split()[1]) for line in run.stdout.splitlines()] == [4, 1, 2, 50, 8]
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "arguments",
    [("--creature", "raptor"), ("--task", "fly"), ("--runs", 0), ("--generations", 0)],
)
def test_wrong_usage_is_refused(arguments: tuple[object, ...], tmp_path: Path) -> None:
    run = ambulo("study", "seed-2d", "-o", tmp_path / "study", *arguments)
    assert run.exit_code == 2 and not list(tmp_path.iterdir())


def test_running_is_judged_at_the_seeds_moments(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With fewer genomes and a shorter look: its moments are generations 15, 75 and 300."""
    monkeypatch.setattr(seed_2d, "JUDGED_STEPS", 50)
    monkeypatch.setattr(
        Plan, "settings",
        lambda plan, task, seed: {
            "preset": "seed", "generations": plan.generations, "seed": seed,
            "evolution": {"population": 4}, "task": {"name": task, "steps": 20},
        },
    )  # fmt: skip
    plan = Plan(tmp_path / "study", ("biped1",), ("run",), runs=4, generations=80)
    told: list[float] = []
    assert evolve_all(
        plan, threads=1, stop=lambda: False, watch=lambda _, done: told.append(done)
    )  # fmt: skip
    assert told == sorted(told) and told[-1] == 4 * 80
    (case,) = gather(plan)["cases"]
    assert [run["seed"] for run in case["runs"]] == [1, 2, 3, 4]
    for run in case["runs"]:
        assert [mark["generation"] for mark in run["marks"]] == [15, 75, 80]
        for mark in run["marks"]:
            assert round(mark["fitness"], 4) == run["best"][mark["generation"] - 1]
            assert mark["judgement"]["legs_used"].endswith("/2")
    finals = {run["seed"]: run["best"][-1] for run in case["runs"]}
    assert len(set(finals.values())) > 1
    # The pictures are of the best of the first three, and of those that are finished.
    asked: list[Path] = []
    load = seed_2d.load_controller

    def noting(path: Path) -> Any:
        asked.append(path)
        return load(path)

    monkeypatch.setattr(seed_2d, "load_controller", noting)
    gather(plan)
    best = max((1, 2, 3), key=lambda seed: finals[seed])
    assert plan.run_folder("biped1", "run", best) in asked
    assert case["picture"] == "pictures/biped1-run.png"


def test_ctrl_c_leaves_a_page_and_the_same_command_goes_on(tmp_path: Path) -> None:
    folder = tmp_path / "study"
    arguments = ("--runs", 1, "--creature", "biped1", "--task", "jump")
    process = start("study", "seed-2d", "-o", folder, *arguments)
    file = folder / "runs" / "biped1-jump" / "seed-1" / "history.jsonl"
    until = time.monotonic() + 60.0
    while not file.is_file() or file.read_bytes().count(b"\n") < 2:
        assert time.monotonic() < until
        time.sleep(0.005)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130, errors
    assert errors.endswith("stopped; the same command goes on\n")
    assert (folder / "index.html").is_file()
    run = Evolution.resume(file.parent)
    assert 2 <= run.generation < 300 == run.generations


def test_the_progress_bar_is_told_of_everything(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a terminal."""
    module = importlib.import_module("ambulo.cli.study")
    console = module.Console
    monkeypatch.setattr(
        module, "Console", lambda stderr: console(stderr=stderr, force_terminal=True, width=100)
    )
    folder = shutil.copytree(whole, tmp_path / "study")
    run = ambulo("study", "seed-2d", "-o", folder, *JUMPS)
    assert run.exit_code == 0 and "tetrapod1 jump 1/1" in run.output and "100%" in run.output
