"""Evolving with the defaults: champions that hold up, restarts, every strategy and controller."""

from __future__ import annotations

import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ambulo import evolution
from ambulo._core import Arena, Search
from ambulo.cli.evolve import KINDS, STRATEGIES, UNTIL
from ambulo.creature import (
    load_controller,
    load_creature,
    load_creature_controller,
    recorded,
)
from ambulo.evolution import Evolution
from creature_runs import SMALL, ambulo, history, outcome, said

SHORT = ("--film", "none", "--json")
# Grows, and begins anew soon.
TOML = """
generations = 20
seed = 3
[evolution]
population = 8
[task]
steps = 200
grow = [60, 120]
[search]
trials = 4
patience = 3
"""
HOLDS = {"robust", "usable", "friction", "mass", "pushes"}


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("config") / "natural.toml"
    path.write_text(TOML)
    return path


Evolve = Callable[..., dict[str, Any]]


@pytest.fixture(scope="module")
def evolve(config: Path) -> Evolve:
    """The report of a small run in a folder; of Biped 1 that runs, if not otherwise said."""

    def evolved(folder: Path, *options: object, of: tuple[str, str] = ("biped1", "run")) -> Any:
        arguments = (*of, "-o", folder, "--config", config, "--json", *options)
        return said(ambulo("evolve", *arguments))

    return evolved


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, evolve: Evolve) -> Path:
    """A finished run, which began anew on the way. Not to be changed."""
    folder = tmp_path_factory.mktemp("natural") / "run"
    assert evolve(folder)["restarts"] > 0
    return folder


# -- champions --------------------------------------------------------------------------------


def test_champions_say_how_they_hold_up(tmp_path: Path, evolve: Evolve) -> None:
    folder = tmp_path / "run"
    report = evolve(folder, "--preset", "natural", of=("tetrapod1", "run"))
    record = load_controller(folder).record
    assert set(report["robustness"]) == HOLDS and report["reached"] is None
    assert record["robustness"] == report["robustness"] and record["good"] is report["good"]
    assert record["fitness"] == report["fitness"]
    lines = [line for line in history(folder) if "champion" in line]
    assert lines[-1]["generation"] == report["champion_generation"]
    assert lines[-1]["robustness"] == report["robustness"]
    for line in lines:
        saved = load_controller(folder / line["champion"])
        assert saved.record["robustness"] == line["robustness"] and len(line["terms"]) == 9
        assert saved.record["good"] is line["good"]
        # The fitness of a full episode, whatever stage it was found in.
        arena = Arena(saved.creature, json.dumps(saved.settings))
        assert arena.score(saved.genome)[0] == saved.record["fitness"] == line["best_so_far"]
        (found,) = json.loads(arena.robustness(saved.genome[None], 1))
        assert found == line["robustness"] or not line["robustness"]["usable"]
    held = [(line["robustness"]["usable"], line["robustness"]["robust"]) for line in lines]
    assert held == sorted(held) and held[-1][0]
    # A replay judges it the same way.
    again = said(ambulo("replay", folder, "-o", tmp_path / "replay", *SHORT))
    assert again["robustness"] == report["robustness"] and again["good"] is report["good"]
    assert again["usable"] and again["solver"] == "lockstep"
    told = ambulo("replay", folder, "-o", tmp_path / "replay", "--film", "none").stdout
    friction, mass = (sum(again["robustness"][name]) for name in ("friction", "mass"))
    pushes = again["robustness"]["pushes"]
    assert f"friction {friction} of 2, mass {mass} of 2, pushes {pushes} of 16" in told


def test_episodes_grow_and_searches_begin_anew(whole: Path) -> None:
    lines = history(whole)
    assert len(lines) == 20 and {line["steps"] for line in lines} > {60}
    for line, after in pairwise(lines):
        if line.get("restarted"):
            assert after["steps"] == 60
        else:
            assert after["steps"] in (line["steps"], {60: 120, 120: 200}.get(line["steps"]))


@pytest.mark.parametrize("level", UNTIL)
def test_a_run_stops_when_its_champion_is_what_was_asked_for(
    level: str, tmp_path: Path, evolve: Evolve
) -> None:
    folder = tmp_path / "run"
    options = ("--until", level, "--generations", 300)
    report = evolve(folder, *options, of=("tetrapod1", "run"))
    done = report["generations"]
    assert report["reached"] is True and done < 300 and len(history(folder)) == done
    assert report["champion_generation"] == done
    held = report["robustness"]
    assert {"usable": held["usable"], "robust": held["robust"], "good": report["good"]}[level]
    # No champion before was enough.
    for line in history(folder)[:-1]:
        before = line.get("robustness", {"usable": False, "robust": False})
        enough = before["robust"] and line["good"] if level == "good" else before[level]
        assert not enough
    # Going on, it has nothing to do; and says so.
    told = ambulo("evolve", "--resume", "-o", folder, "--until", level)
    assert told.exit_code == 0 and len(history(folder)) == done
    assert f"{level} after {done} of at most 300 generations\n" in told.stdout
    verdict = told.stdout.partition("Tetrapod 1, run: ")[2].partition(", fitness")[0]
    good = "good and robust" if report["good"] else "robust"
    assert verdict == (good if held["robust"] else "usable")


def test_a_run_that_does_not_get_there_says_so(tmp_path: Path, config: Path) -> None:
    arguments = ("biped1", "run", "-o", tmp_path / "run", "--config", config)
    run = ambulo("evolve", *arguments, "--until", "good", "--generations", 1)
    assert run.exit_code == 0 and "not yet good after 1 of at most 1 generations" in run.stdout


def test_until_is_refused_where_champions_are_not_replayed(
    finished_run: Path, tmp_path: Path, config: Path
) -> None:
    """It went on to the last generation without a word."""
    new = ("biped1", "run", "-o", tmp_path / "run", "--config", config, "--preset", "seed")
    config.write_text(TOML.replace("trials = 4", "trials = 0"))
    runs = [ambulo("evolve", *arguments, "--until", "usable")
            for arguments in (new, ("--resume", "-o", finished_run))]  # fmt: skip
    config.write_text(TOML)
    for run in runs:
        assert run.exit_code == 2
        assert "needs champions that are chosen on replays, but search.trials is 0" in run.output
    assert not (tmp_path / "run").exists()


def test_threads_are_those_of_the_replays_too(
    tmp_path: Path, whole: Path, evolve: Evolve, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All processors were busy whatever was asked for."""

    def all_of_them() -> int:
        raise AssertionError("one was asked for")

    monkeypatch.setattr(evolution, "default_threads", all_of_them)
    evolve(tmp_path / "run", "--threads", 1)
    assert outcome(tmp_path / "run") == outcome(whole)


# -- cut short --------------------------------------------------------------------------------


def test_a_run_that_goes_on_comes_out_the_same(whole: Path, tmp_path: Path, evolve: Evolve) -> None:
    """Champions, restarts and all, stopped after every generation."""
    folder = tmp_path / "run"
    report = evolve(folder, "--minutes", 1e-9)
    for generation in range(2, 21):
        assert report["generations"] == generation - 1
        none = ("--minutes", 1e-9, "--threads", 1 + generation % 2)
        report = said(ambulo("evolve", "--resume", "-o", folder, *none, "--json"))
    assert report["restarts"] > 0
    assert outcome(folder) == outcome(whole)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"strategy": 3}', "STAGE", "RESTARTS"])
def test_a_search_that_is_none_is_not_restored(text: str, whole: Path) -> None:
    run = Evolution.resume(whole)
    state = json.loads(run.search.state())
    if text == "STAGE":
        text = json.dumps(state | {"stage": 3})
    elif text == "RESTARTS":
        text = json.dumps(state | {"restarts": -1})
    assert run.arena.restore(json.dumps(state)).state() == run.search.state()
    with pytest.raises(ValueError):
        run.arena.restore(text)


def test_a_search_of_another_arena_is_not_restored(whole: Path) -> None:
    run = Evolution.resume(whole)
    other = Arena(load_creature("tetrapod1"), json.dumps(SMALL))
    with pytest.raises(ValueError, match="a stored search is not one of this creature and task"):
        other.restore(run.search.state())


def test_a_search_is_told_a_score_of_five_numbers_for_each_genome() -> None:
    arena = Arena(load_creature("biped1"), json.dumps(SMALL))
    search = arena.search()
    genomes, before = search.ask(), search.state()
    how = json.loads(search.round(arena))
    assert how == {"ahead": 0, "steps": 60, "draw": None}
    scores = arena.try_round(genomes, json.dumps(how), 1)
    assert scores.tolist() == arena.evaluate(genomes, 1).tolist()
    with pytest.raises(ValueError, match="5 numbers each are expected"):
        search.tell(arena, scores[:, :3].copy(), 1)
    with pytest.raises(ValueError, match=f"{len(genomes)}"):
        search.tell(arena, scores[1:], 1)
    assert search.state() == before
    told = search.tell(arena, scores, 1)
    assert told["best"] == scores[:, 0].max() and told["steps"] == how["steps"] == 60
    assert told["mean"] == pytest.approx(scores[:, 0].mean())
    # At once, it is the same.
    other: Search = arena.search()
    assert other.step(arena, 2) == told and other.state() == search.state()
    with pytest.raises(ValueError, match="no 'perfect'"):
        search.has("perfect")


# -- solvers ----------------------------------------------------------------------------------


@pytest.mark.parametrize("solver", ["box2d", "lockstep"])
def test_a_champion_is_played_in_the_other_solver(
    solver: str, tmp_path: Path, evolve: Evolve
) -> None:
    folder, other = tmp_path / "run", {"box2d": "lockstep", "lockstep": "box2d"}[solver]
    evolve(folder, "--solver", solver, "--generations", 2, of=("tetrapod1", "run"))
    saved = load_controller(folder)
    assert saved.settings["world"]["solver"] == solver
    home, same, away = (
        said(ambulo("replay", folder, "-o", tmp_path / "r", *SHORT, *where))
        for where in ((), ("--solver", solver), ("--solver", other))
    )
    assert same == home and home["solver"] == solver and "distance_at_home" not in home
    assert home["fitness"] == home["recorded_fitness"] == saved.record["fitness"]
    assert away["solver"] == other and away["hash"] != home["hash"]
    assert away["fitness"] != away["recorded_fitness"] == home["fitness"]
    assert away["distance_at_home"] == home["distance"] > 0.1
    told = ambulo("replay", folder, "-o", tmp_path / "r", "--film", "none", "--solver", other)
    kept = 100.0 * away["distance"] / home["distance"]
    assert f"{away['distance']:.1f} m in {other}, {kept:.0f} % of where it was e" in told.stdout


# -- strategies and controllers ---------------------------------------------------------------


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_every_strategy_runs_and_goes_on(strategy: str, tmp_path: Path, evolve: Evolve) -> None:
    options = ("--strategy", strategy, "--generations", 4)
    report = evolve(tmp_path / "whole", *options)
    saved = load_controller(tmp_path / "whole")
    assert saved.settings["evolution"]["strategy"] == strategy
    assert report["generations"] == len(history(tmp_path / "whole")) == 4
    assert report["fitness"] == saved.record["fitness"] and report["robustness"]
    folder = tmp_path / "run"
    evolve(folder, *options, "--minutes", 1e-9)
    assert said(ambulo("evolve", "--resume", "-o", folder, "--json"))["resumed_from"] == 1
    assert outcome(folder) == outcome(tmp_path / "whole")


@pytest.mark.parametrize("task", ["run", "jump"])
@pytest.mark.parametrize("kind", KINDS)
def test_every_controller_is_evolved_and_drives(
    kind: str, task: str, tmp_path: Path, evolve: Evolve
) -> None:
    folder = tmp_path / "run"
    evolve(folder, "--controller", kind, "--generations", 2, of=("biped1", task))
    saved = load_controller(folder)
    assert saved.settings["controller"]["kind"] == kind
    arena = Arena(saved.creature, json.dumps(saved.settings))
    rollout, _ = recorded(arena, saved.creature, saved.genome, 120)
    controller = load_creature_controller(folder)
    assert np.array_equal(controller.genome(), saved.genome)
    assert len(saved.genome) == arena.genes or kind == "graph"
    # It asks for what the arena asked for.
    speed = json.loads(saved.creature.json())["joints"][0]["speed"]
    tilt = rollout.poses[:, rollout.torso, 2] - rollout.poses[0, rollout.torso, 2]
    asked = [
        controller.drive(float(tilt[step]), rollout.angles[step].tolist(), time=step * rollout.dt)
        for step in range(120)
    ]
    assert np.abs(np.array(asked) / speed - rollout.commands).max() < 1e-3
    assert rollout.commands.std() > 0.0
    with pytest.raises(ValueError, match=r"3.*2|2.*3"):
        controller.drive(0.0, [0.0, 0.0, 0.0])
    report = said(ambulo("replay", folder, "-o", tmp_path / "r", *SHORT, "--steps", 120))
    assert report["fitness"] == report["recorded_fitness"] == saved.record["fitness"]


def test_map_elites_leaves_an_archive_of_different_motions(tmp_path: Path, evolve: Evolve) -> None:
    folder = tmp_path / "run"
    report = evolve(folder, "--strategy", "map_elites", "--generations", 6)
    files = sorted((folder / "archive").glob("cell-*.safetensors"))
    assert report["archive"] == len(files) > 1
    for path in files:
        saved = load_controller(path)
        arena = Arena(saved.creature, json.dumps(saved.settings))
        assert arena.score(saved.genome)[0] == saved.record["fitness"], path.name
    genomes = {load_controller(path).genome.tobytes() for path in files}
    assert len(genomes) == len(files)
