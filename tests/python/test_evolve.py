"""Evolving: the same seed the same run, runs that are cut short, refusals, the command."""

from __future__ import annotations

import importlib
import json
import re
import shutil
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ambulo._core import Arena
from ambulo.creature import load_controller, load_creature
from ambulo.evolution import Evolution, RunError, champion_at
from ambulo.executors import Executor, on_threads
from creature_runs import SMALL, TOML, ambulo, history, outcome, said, start, text_of

TERMS = {
    "direction_change", "distance", "energy", "height", "leg_use", "natural", "rollover",
    "saturation", "symmetry",
}  # fmt: skip


def begun(folder: Path, **changes: Any) -> Evolution:
    return Evolution.begin(folder, load_creature("biped1"), SMALL | changes)


def finish(run: Evolution) -> None:
    for _ in run.steps(on_threads(run.arena, 1)):
        pass


# -- what a run is ----------------------------------------------------------------------------


@pytest.mark.parametrize("threads", [1, 2])
def test_the_same_seed_gives_the_same_run_on_any_number_of_threads(
    threads: int, finished_run: Path, small_config: Path, tmp_path: Path
) -> None:
    again = tmp_path / "again"
    run = ambulo(
        "evolve", "biped1", "run", "-o", again, "--config", small_config, "--threads", threads
    )
    assert run.exit_code == 0, run.output
    assert outcome(again) == outcome(finished_run)


def test_another_seed_gives_another_run(
    finished_run: Path, small_config: Path, tmp_path: Path
) -> None:
    other = tmp_path / "other"
    ambulo("evolve", "biped1", "run", "-o", other, "--config", small_config, "--seed", 4)
    assert history(other)[0]["best"] != history(finished_run)[0]["best"]
    best = [(run / "best.safetensors").read_bytes() for run in (other, finished_run)]
    assert best[0] != best[1]


@pytest.mark.parametrize("task", ["run", "jump"])
def test_history_has_a_complete_line_a_generation(task: str, tmp_path: Path) -> None:
    run = begun(tmp_path / "run", generations=12, task={"name": task, "steps": 80})
    finish(run)
    lines = run.history()
    assert [line["generation"] for line in lines] == list(range(1, 13))
    seconds = [line["seconds"] for line in lines]
    assert seconds == sorted(seconds) and seconds[-1] > 0.0
    highest, champions = -np.inf, []
    for line in lines:
        improved = line["best"] > highest
        highest = max(highest, line["best"])
        assert line["mean"] <= line["best"] and line["best_so_far"] == highest
        assert line["steps"] == 80 and "robustness" not in line
        assert ("champion" in line) == ("terms" in line) == improved
        if improved:
            champions.append(line["champion"])
            assert line["champion"] == f"champions/generation-{line['generation']:06d}.safetensors"
            assert set(line["terms"]) == TERMS
            # The seed's fitness is one term alone.
            counts = {"run": "distance", "jump": "height"}[task]
            assert line["terms"][counts] == line["best"]
            saved = load_controller(run.folder / line["champion"])
            assert saved.record["generation"] == line["generation"]
            assert saved.record["terms"] == line["terms"]
            assert float.fromhex(saved.record["fitness_hex"]) == line["best"]
            assert run.arena.score(saved.genome)[0] == line["best"]
    assert len(champions) > 1
    there = sorted(path.name for path in (run.folder / "champions").iterdir())
    assert [f"champions/{name}" for name in there] == champions
    assert (run.folder / "best.safetensors").read_bytes() == (
        run.folder / champions[-1]
    ).read_bytes()


def test_the_champion_of_any_generation_is_found(finished_run: Path) -> None:
    lines = history(finished_run)
    for generation in range(1, len(lines) + 1):
        champion = champion_at(finished_run, generation)
        assert champion is not None
        record = load_controller(champion).record
        assert record["fitness"] == lines[generation - 1]["best_so_far"]
    assert champion_at(finished_run, 0) is None


def test_a_controller_says_where_it_is_from(finished_run: Path) -> None:
    saved = load_controller(finished_run)
    assert saved.creature.hash == load_creature("biped1").hash
    assert saved.settings["seed"] == 3 and saved.settings["evolution"]["population"] == 8
    assert saved.settings["task"]["steps"] == 60
    assert saved.header["provenance"]["source"] == "evolved: run"
    assert saved.header["provenance"]["seed"] == "3"


# -- what is not a number ---------------------------------------------------------------------


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_never_a_champion(bad: float, tmp_path: Path) -> None:
    run = begun(tmp_path / "run")
    honest = on_threads(run.arena, 1)
    expected: list[float] = []

    def spoiled(genomes: NDArray[np.float32], how: str) -> NDArray[np.float64]:
        scores = honest(genomes, how)
        fitness = scores[:, 0]
        # Whoever is best is not a number, and the first, which argmax takes if all are equal.
        fitness[[0, int(np.argmax(fitness))]] = bad
        expected.append(float(fitness[np.isfinite(fitness)].max()))
        return scores

    for _ in range(4):
        done = run.step(spoiled)
        assert done.best == expected[-1] and np.isfinite(done.mean)
        assert done.best_so_far == max(expected)
    assert [line["best"] for line in run.history()] == expected
    assert load_controller(run.folder).record["fitness"] == max(expected)


def nothing(genomes: NDArray[np.float32], _: str) -> NDArray[np.float64]:
    """An executor with which nothing comes of any."""
    return np.full((len(genomes), 5), np.nan)


@pytest.mark.parametrize("preset", ["seed", "natural"])
def test_a_generation_of_which_nothing_came_is_noted_and_the_next_goes_on(
    preset: str, tmp_path: Path
) -> None:
    run = begun(tmp_path / "run", preset=preset)
    done = run.step(nothing)
    assert not done.improved and np.isnan(done.best) and np.isnan(done.mean)
    (line,) = run.history()
    assert line["best"] is line["mean"] is line["best_so_far"] is None and "champion" not in line
    assert not (run.folder / "best.safetensors").exists()
    # Strict JSON, which has no NaN.
    for name in ("checkpoint.json", "history.jsonl", "run.json"):
        assert not re.search("NaN|Infinity", (run.folder / name).read_text())
    again = Evolution.resume(run.folder)
    assert again.champion is None
    assert again.step(on_threads(again.arena, 1)).improved


def test_a_run_of_which_nothing_came_says_so(
    small_config: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def hopeless(*_: object) -> Executor:
        return nothing

    monkeypatch.setattr(importlib.import_module("ambulo.cli.evolve"), "on_threads", hopeless)
    folder = tmp_path / "run"
    run = ambulo("evolve", "biped1", "run", "-o", folder, "--config", small_config)
    assert run.exit_code == 0
    assert "6 generations, but nothing that is a number came of any" in run.output
    again = said(ambulo("evolve", "--resume", "-o", folder, "--json"))
    assert again["fitness"] is again["champion"] is again["champion_generation"] is None
    assert again["robustness"] is again["good"] is None


@pytest.mark.parametrize("preset", ["seed", "natural"])
def test_a_champion_that_does_not_replay_stops_the_run(preset: str, tmp_path: Path) -> None:
    """A cluster of machines that compute differently, say."""
    run = begun(tmp_path / "run", preset=preset)
    with pytest.raises(RuntimeError, match=r"a champion's replay reached .* and not"):
        run.step(lambda genomes, steps: on_threads(run.arena, 1)(genomes, steps) + 1e-9)
    assert not list((run.folder / "champions").iterdir())
    assert Evolution.resume(run.folder).generation == 0


# -- cut short --------------------------------------------------------------------------------


def test_a_generation_at_a_time_reaches_the_same_end(
    finished_run: Path, small_config: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "run"
    none = ("--minutes", 1e-9, "--json")
    report = said(
        ambulo("evolve", "biped1", "run", "-o", folder, "--config", small_config, *none)
    )  # fmt: skip
    assert report["generations"] == 1 and report["resumed_from"] is None
    for generation in range(2, 7):
        report = said(ambulo("evolve", "biped1", "run", "--resume", "-o", folder, *none))
        assert report["generations"] == generation and report["resumed_from"] == generation - 1
    assert outcome(folder) == outcome(finished_run)
    # Its clock went on, too.
    seconds = [line["seconds"] for line in Evolution.resume(folder).history()]
    assert seconds == sorted(seconds) and seconds[-1] > 2 * seconds[0] > 0.0
    # And a finished run stays as it is.
    report = said(ambulo("evolve", "--resume", "-o", folder, "--json"))
    assert report["generations"] == report["resumed_from"] == 6
    assert outcome(folder) == outcome(finished_run)


def test_a_run_goes_on_to_more_generations(finished_run: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(finished_run, tmp_path / "run")
    report = said(ambulo("evolve", "--resume", "-o", folder, "--generations", 9, "--json"))
    assert report["generations"] == 9
    long = begun(tmp_path / "long", generations=9)
    finish(long)
    assert history(folder) == history(long.folder)
    assert Evolution.resume(folder).generations == 9


def test_what_a_killed_run_left_behind_is_taken_away(finished_run: Path, tmp_path: Path) -> None:
    """It died after it had written a champion and its line, and before the checkpoint."""
    run = begun(tmp_path / "run")
    for _ in range(3):
        run.step(on_threads(run.arena, 1))
    folder = run.folder
    for generation in (4, 5):
        name = f"generation-{generation:06d}.safetensors"
        (folder / "champions" / name).write_bytes(b"of a time that has not been")
    with (folder / "history.jsonl").open("a") as file:
        file.write('{"generation": 4, "best": 99.0}\n{"generation": 5, "be')
    for part in (".checkpoint.json.1.part", "champions/.generation-000004.safetensors.1.part"):
        (folder / part).write_text("half")
    kept = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    again = Evolution.resume(folder)
    assert {path: path.read_bytes() for path in kept} == kept, "looking changes nothing"
    finish(again)
    assert outcome(folder) == outcome(finished_run)


def test_a_run_that_was_killed_while_it_began_is_none(
    finished_run: Path, small_config: Path, tmp_path: Path
) -> None:
    """What makes a folder a run is written last."""
    folder = shutil.copytree(finished_run, tmp_path / "run")
    (folder / "run.json").unlink()
    assert not Evolution.exists(folder)
    run = ambulo("evolve", "biped1", "run", "-o", folder, "--config", small_config)
    assert run.exit_code == 0, run.output
    assert outcome(folder) == outcome(finished_run)


LONG = {**SMALL, "generations": 400, "task": {"name": "run", "steps": 120}}


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory: pytest.TempPathFactory) -> Path:
    run = Evolution.begin(
        tmp_path_factory.mktemp("long") / "run", load_creature("biped1"), LONG
    )  # fmt: skip
    finish(run)
    return run.folder


@pytest.fixture
def long_config(tmp_path: Path) -> Path:
    path = tmp_path / "long.toml"
    path.write_text(TOML.replace("generations = 6", "generations = 400").replace("60", "120"))
    return path


def wait_for(lines: int, folder: Path) -> None:
    """Until a run has so many lines of history."""
    file, until = folder / "history.jsonl", time.monotonic() + 60.0
    while not file.is_file() or file.read_bytes().count(b"\n") < lines:
        assert time.monotonic() < until, "it never came so far"
        time.sleep(0.001)


def test_a_run_that_is_killed_again_and_again_reaches_the_same_end(
    unbroken: Path, long_config: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "run"
    arguments = ("biped1", "run", "--config", long_config)
    for lines in (3, 60, 120):
        process = start("evolve", *arguments, "-o", folder, "--threads", "1")
        wait_for(lines, folder)
        process.kill()
        _, errors = process.communicate()
        assert process.returncode == -signal.SIGKILL, errors
        done = json.loads((folder / "checkpoint.json").read_text())["search"]["generation"]
        assert lines - 1 <= done < 400
        # Whatever was written before stands.
        load_controller(folder)
        arguments = ("--resume",)
    report = said(ambulo("evolve", "--resume", "-o", folder, "--json"))
    assert report["generations"] == 400 and report["resumed_from"] >= 119
    assert outcome(folder) == outcome(unbroken)


def test_ctrl_c_finishes_the_generation_and_says_how_to_go_on(
    unbroken: Path, long_config: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "run"
    process = start("evolve", "biped1", "run", "-o", folder, "--config", long_config)
    wait_for(20, folder)
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=60)
    assert process.returncode == 130, errors
    done = json.loads((folder / "checkpoint.json").read_text())["search"]["generation"]
    assert 20 <= done < 400 and len(history(folder)) == done
    assert errors.endswith(f"stopped after generation {done}; --resume goes on\n")
    assert f"of {done}, " in output
    run = ambulo("evolve", "--resume", "-o", folder)
    assert run.exit_code == 0, run.output
    assert outcome(folder) == outcome(unbroken)


# -- refusals ---------------------------------------------------------------------------------


def test_a_run_is_not_overwritten_unless_that_is_asked_for(
    finished_run: Path, small_config: Path, tmp_path: Path
) -> None:
    folder = shutil.copytree(finished_run, tmp_path / "run")
    arguments = ("evolve", "biped1", "run", "-o", folder, "--config", small_config, "--seed", 8)
    refused = ambulo(*arguments)
    assert refused.exit_code == 1
    assert f"{folder} holds a run; --resume goes on with it, --overwrite" in refused.output
    assert outcome(folder) == outcome(finished_run)
    assert ambulo(*arguments, "--generations", 1, "--overwrite").exit_code == 0
    # Nothing of the other run is left.
    assert len(history(folder)) == len(list((folder / "champions").iterdir())) == 1
    fresh = tmp_path / "fresh"
    ambulo("evolve", "biped1", "run", "-o", fresh, "--config", small_config, "--seed", 8,
           "--generations", 1)  # fmt: skip
    assert outcome(folder) == outcome(fresh)


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (("--overwrite",), 2, "--resume goes on, --overwrite starts again: give one of them"),
        (("--seed", 3), 2, "a run goes on with the settings that it began with"),
        (("--population", 8), 2, "a run goes on with the settings that it began with"),
        (("--preset", "seed"), 2, "a run goes on with the settings that it began with"),
        (("--solver", "box2d"), 2, "a run goes on with the settings that it began with"),
        (("--config", "CONFIG"), 2, "a run goes on with the settings that it began with"),
        (("biped1", "jump"), 1, "is a run of run"),
        (("tetrapod1", "run"), 1, "is a run of another creature than tetrapod1"),
        (("tetrapod1",), 1, "is a run of another creature than tetrapod1"),
    ],
)
def test_a_run_goes_on_only_with_what_it_began_with(
    arguments: tuple[object, ...], code: int, says: str, finished_run: Path, small_config: Path,
    tmp_path: Path,
) -> None:  # fmt: skip
    folder = shutil.copytree(finished_run, tmp_path / "run")
    given = [small_config if argument == "CONFIG" else argument for argument in arguments]
    # What was refused had changed how many generations there are to be.
    run = ambulo("evolve", *given, "--resume", "-o", folder, "--generations", 99)
    assert run.exit_code == code and says in run.output, run.output
    assert outcome(folder) == outcome(finished_run)


def test_where_there_is_no_run_none_goes_on(tmp_path: Path) -> None:
    run = ambulo("evolve", "--resume", "-o", tmp_path / "nothing")
    assert run.exit_code == 1 and "nothing holds no run to go on with" in run.output
    assert not list(tmp_path.iterdir())


def spoil_creature(text: str) -> str:
    creature = json.loads(text)
    creature["joints"][0]["torque"] += 1.0
    return json.dumps(creature)


@pytest.mark.parametrize(
    ("name", "change", "says"),
    [
        ("checkpoint.json", lambda text: text[: len(text) // 2], "; start a new run"),
        ("checkpoint.json", lambda text: "", "Expecting value"),
        ("checkpoint.json", lambda text: "[]", "expected an object; start a new run"),
        ("checkpoint.json", lambda text: "{}", "'search'; start a new run"),
        ("checkpoint.json", lambda text: text.replace('"genes":62', '"genes":61'), "genom"),
        ("checkpoint.json", lambda text: text.replace('"seconds": ', '"seconds": "x'), "start a n"),
        ("run.json", lambda text: text.replace('"format": 2', '"format": 1'), "another version"),
        ("run.json", lambda text: '{"format": 2}', "another version"),
        ("run.json", lambda text: "{", "start a new run"),
        ("creature.json", spoil_creature, "is not the creature that this run began with"),
        ("creature.json", lambda text: text.replace("hip back", "hip", 1), "$.pairs[0]"),
    ],
)
def test_a_broken_folder_is_refused_and_named(
    name: str, change: Callable[[str], str], says: str, finished_run: Path, tmp_path: Path
) -> None:
    folder = shutil.copytree(finished_run, tmp_path / "run")
    before = (folder / name).read_text()
    (folder / name).write_text(change(before))
    assert (folder / name).read_text() != before
    run = ambulo("evolve", "--resume", "-o", folder)
    assert run.exit_code == 1, run.output
    assert run.output.startswith(f"Error: {folder}") and says in run.output, run.output
    if name != "creature.json":
        with pytest.raises(RunError):
            Evolution.resume(folder)


# -- settings ---------------------------------------------------------------------------------

SEED = 'preset = "seed"\n[evolution]\n'


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("generatons = 3", "generatons: unknown field"),
        ("generations = 1.5", "generations: invalid type"),
        ("generations = 0", "generations: 0 is not 1 to 10000000"),
        ("[evolution]\nmutation_rte = 0.1", "evolution.mutation_rte: unknown field"),
        ('[evolution]\nmutation_rate = "a"', "evolution.mutation_rate: invalid type"),
        (f"{SEED}mutation_rate = 1.5", "evolution.mutation_rate: 1.5 is not 0 to 1"),
        (f"{SEED}population = 1", "evolution.population: 1 is not 2 to 100000"),
        ("[evolution]\npopulation = 3", "evolution.population: 3 is not 4 to 100000"),
        (f'{SEED}selection = "best"', "evolution.selection: unknown variant"),
        ('[evolution]\nstrategy = "luck"', "evolution.strategy: unknown variant `luck`"),
        ('preset = "best"', "preset: unknown variant `best`, expected `natural` or `seed`"),
        ("evolution = 3", "evolution: invalid type"),
        ("[task]\nsteps = 0", "task.steps: 0 is not 1 to 1000000"),
        ("[task]\nsteps = 60\ngrow = [20, 90]", "task.grow: [20, 90] are not up to 100 growing"),
        ("[search]\ntrials = 1001", "search.trials: 1001 is not 0 to 1000"),
        ('[controller]\nkind = "brain"', "controller.kind: unknown variant `brain`"),
        ("[task.weights]\nbeauty = 1", "task.weights: no term is called 'beauty'; there are "),
        ('[task.weights]\ndistance = "x"', "task.weights.distance: invalid type"),
        ("task = 3", "task: expected a table"),
        ('[task]\nname = "fly"', "task.name is 'fly', but 'run' is asked for"),
        ("[controller]\nhidden = [0]", "controller.hidden: [0] is not up to 8 layers of 1 to 256"),
        ("[world]\nrate = 0", "world.rate: 0 is not 10 to 1000"),
        ('[world]\nsolver = "x"', "world.solver: unknown variant `x`"),
        ("[world]\nwind = 1", "world.wind: unknown field"),
        # These came as a traceback, and without the place.
        ("[task]\nsteps = 2020-01-01", "task.steps: no setting is a date or a time"),
        ("[task.weights]\ndistance = nan", "task.weights.distance: nan is not finite"),
        ("[controller]\nhidden = [4, inf]", "controller.hidden[1]: inf is not finite"),
        ("seed = 1\nseeds = = 1", "Invalid value (at line 2, column 9)"),
    ],
)
def test_settings_that_make_no_sense_are_refused_with_their_place(
    text: str, says: str, tmp_path: Path
) -> None:
    config = tmp_path / "config.toml"
    config.write_text(text)
    run = ambulo("evolve", "biped1", "run", "-o", tmp_path / "run", "--config", config)
    assert run.exit_code == 1, run.output
    assert run.output.startswith(f"Error: {config}: {says}"), run.output
    assert run.output.count("\n") == 1
    assert list(tmp_path.iterdir()) == [config]


def test_a_weight_of_no_term_is_refused_with_those_that_there_are() -> None:
    settings = {"task": {"name": "run", "weights": {"beauty": 1.0}}}
    with pytest.raises(ValueError, match=r"^task\.weights: .*'beauty'") as caught:
        Arena(load_creature("biped1"), json.dumps(settings))
    assert all(term in str(caught.value) for term in TERMS)


def test_a_config_that_is_not_utf_8_is_named(tmp_path: Path) -> None:
    config = tmp_path / "config.toml"
    config.write_bytes(b"seed = 1 # \xff")
    run = ambulo("evolve", "biped1", "run", "-o", tmp_path / "run", "--config", config)
    assert run.exit_code == 1 and f"Error: {config}: 'utf-8' codec" in run.output


def test_a_task_that_is_not_known_is_refused() -> None:
    with pytest.raises(ValueError, match=r"task\.name: no task is called 'fly'; there are run, j"):
        Arena(load_creature("biped1"), json.dumps({"task": {"name": "fly"}}))


def test_the_command_line_goes_over_the_config(small_config: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    over = ("--generations", 2, "--population", 5, "--seed", 2**64 - 1)
    run = ambulo("evolve", "biped1", "jump", "-o", folder, "--config", small_config, *over)
    assert run.exit_code == 0, run.output
    settings = json.loads((folder / "run.json").read_text())["settings"]
    assert settings["generations"] == 2 and settings["evolution"]["population"] == 5
    assert settings["seed"] == 2**64 - 1
    assert settings["task"]["name"] == "jump" and settings["task"]["steps"] == 60
    assert len(history(folder)) == 2


# -- the command ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "arguments",
    [
        (), ("biped1",), ("biped1", "fly"), ("biped1", "run", "--population", 1),
        ("biped1", "run", "--generations", 0), ("biped1", "run", "--seed", -1),
        ("biped1", "run", "--seed", 2**64), ("biped1", "run", "--minutes", 0),
        ("biped1", "run", "--threads", 0), ("biped1", "run", "--config", "nowhere.toml"),
        ("biped1", "run", "--preset", "seed", "--until", "robust"),
        ("biped1", "run", "--strategy", "luck"), ("biped1", "run", "--controller", "brain"),
    ],
)  # fmt: skip
def test_wrong_usage_is_refused_and_writes_nothing(
    arguments: tuple[object, ...], tmp_path: Path
) -> None:
    run = ambulo("evolve", *arguments, "-o", tmp_path / "run")
    assert run.exit_code == 2 and "Usage: " in run.output, run.output
    assert not list(tmp_path.iterdir())
    assert ambulo("evolve", *arguments).exit_code == 2


def test_a_creature_that_is_not_there_is_refused_with_those_that_are(tmp_path: Path) -> None:
    run = ambulo("evolve", "centipede", "run", "-o", tmp_path / "run")
    assert run.exit_code == 1 and "there are apod, biped1" in run.output
    assert not list(tmp_path.iterdir())


def test_a_dry_run_says_the_settings_and_writes_nothing(
    finished_run: Path, small_config: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "run"
    arguments = ("evolve", "biped1", "run", "-o", folder, "--config", small_config, "--dry-run")
    run = ambulo(*arguments)
    assert run.exit_code == 0 and "dry run: nothing written" in run.stderr
    assert "Biped 1: 2 driven joints, 2 legs" in run.stdout
    assert "run: at most 6 generations of 8, 60 steps each, 62 genes, genetic" in run.stdout
    assert not list(tmp_path.iterdir())
    plan = said(ambulo(*arguments, "--json"))
    assert plan["genes"] == 62 and plan["creature"] == "Biped 1"
    assert plan["settings"] == json.loads((finished_run / "run.json").read_text())["settings"]


def test_a_dry_run_of_going_on_writes_nothing(finished_run: Path, tmp_path: Path) -> None:
    """It had noted the new number of generations, and tidied up."""
    folder = shutil.copytree(finished_run, tmp_path / "run")
    (folder / "champions" / "generation-000099.safetensors").write_bytes(b"left")
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    run = ambulo("evolve", "--resume", "-o", folder, "--generations", 50, "--dry-run", "--json")
    assert said(run)["settings"]["generations"] == 50
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


def test_the_report(small_config: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    run = ambulo("evolve", "biped1", "run", "-o", folder, "--config", small_config, "--json")
    report = said(run)
    best = load_controller(folder).record
    assert report.pop("seconds") > 0.0
    assert report == {
        "run": str(folder), "creature": "Biped 1", "task": "run", "seed": 3, "generations": 6,
        "resumed_from": None, "restarts": 0, "lessons_ahead": 0, "fitness": best["fitness"],
        "champion_generation": best["generation"], "champion": str(folder / "best.safetensors"),
        "robustness": None, "good": None, "reached": None, "archive": None,
    }  # fmt: skip
    assert "generation 6/6" in run.stderr and "0 s left" in run.stderr
    told = ambulo("evolve", "--resume", "-o", folder)
    assert f"Biped 1, run: fitness {best['fitness']:.3f} in generation" in told.stdout
    assert f"ambulo replay {folder} -o {folder / 'replay'}" in told.stdout


def test_a_creature_of_ones_own_is_evolved(small_config: Path, tmp_path: Path) -> None:
    creature = text_of("biped1")
    creature["joints"][0]["torque"] = 200.0
    file = tmp_path / "mine.json"
    file.write_text(json.dumps(creature))
    folder = tmp_path / "run"
    run = ambulo("evolve", file, "run", "-o", folder, "--config", small_config)
    assert run.exit_code == 0, run.output
    # The run has its own copy.
    file.unlink()
    assert Evolution.resume(folder).creature.hash != load_creature("biped1").hash
    assert load_controller(folder).creature.hash == Evolution.resume(folder).creature.hash
