"""The seed's own study again: 7 creatures × run and jump × N runs, and what came of them.

    runs/CREATURE-TASK/seed-N/   the run's folder
    pictures/                    a strip and a gait diagram of the best of the first three runs
    results.json                 everything that the page shows
    index.html, figures/, tables/

Runs are the product's own, so a study that was stopped goes on where it was.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ambulo._core import Arena
from ambulo.creature import description, load_controller, load_creature, recorded
from ambulo.evaluate.machine import machine
from ambulo.evolution import Evolution, champion_at, read_history
from ambulo.executors import default_threads, on_threads
from ambulo.files import write_atomic
from ambulo.pictures.replay import gait_picture, strip_picture
from ambulo.study.page import write_page
from ambulo.study.published import PUBLISHED, marks_of
from ambulo.study.results import INITIAL

JUDGED_STEPS = 2000


@dataclass(frozen=True)
class Plan:
    """What a study does."""

    folder: Path
    creatures: tuple[str, ...]
    """Names of creatures that ship."""
    tasks: tuple[str, ...]
    runs: int
    """Of each case; a run's seed is its number, from 1."""
    generations: int = 300
    population: int = 50

    @property
    def cases(self) -> list[tuple[str, str]]:
        """(creature, task), in the seed's order."""
        return [(creature, task) for task in self.tasks for creature in self.creatures]

    def settings(self, task: str, seed: int) -> dict[str, Any]:
        """The seed's own settings with what the plan says."""
        return {
            "preset": "seed",
            "generations": self.generations,
            "seed": seed,
            "evolution": {"population": self.population},
            "task": {"name": task},
        }

    def run_folder(self, creature: str, task: str, seed: int) -> Path:
        """Where a run lives."""
        return self.folder / "runs" / f"{creature}-{task}" / f"seed-{seed}"


def seed_creatures() -> tuple[str, ...]:
    """The seven creatures, in the seed's order."""
    return tuple(dict.fromkeys(case.creature for case in PUBLISHED.cases))


def begun(plan: Plan) -> bool:
    """Whether there is any run of it."""
    seeds = range(1, plan.runs + 1)
    return any(
        Evolution.exists(plan.run_folder(creature, task, seed))
        for creature, task in plan.cases
        for seed in seeds
    )


def evolve_all(
    plan: Plan, *, threads: int | None, stop: Callable[[], bool], watch: Callable[[str, float], Any]
) -> bool:
    """Does every run that is not done yet; False if it was stopped.

    As many runs at a time as `threads`, each on one: a generation of fifty is too few to share out
    well. Seed after seed through all cases, so that a study that is stopped has some of each.
    `watch` is told what runs and how many generations of all are done.
    """
    cases = [
        (creature, task, seed) for seed in range(1, plan.runs + 1) for creature, task in plan.cases
    ]
    done = dict.fromkeys(cases, 0)

    def evolve(case: tuple[str, str, int]) -> bool:
        creature, task, seed = case
        if stop():
            return False
        run = _begun(plan, plan.run_folder(creature, task, seed), creature, task, seed)
        executor, name = on_threads(run.arena, 1), f"{creature} {task} {seed}/{plan.runs}"
        done[case] = run.generation
        if run.generation >= run.generations:
            watch(name, sum(done.values()))
        for _ in run.steps(executor, threads=1, stop=stop):
            done[case] = run.generation
            watch(name, sum(done.values()))
        return run.generation >= run.generations

    # The slow part leaves the interpreter, so threads are enough.
    with ThreadPoolExecutor(threads or default_threads()) as pool:
        return all(list(pool.map(evolve, cases)))


def _begun(plan: Plan, folder: Path, creature: str, task: str, seed: int) -> Evolution:
    if Evolution.exists(folder):
        return _checked(plan, folder, creature, task, seed)
    return Evolution.begin(folder, load_creature(creature), plan.settings(task, seed))


def _checked(plan: Plan, folder: Path, creature: str, task: str, seed: int) -> Evolution:
    """A run that was begun, if it is one of this plan; nothing of it is changed."""
    run, body = Evolution.resume(folder), load_creature(creature)
    asked = json.loads(Arena(body, json.dumps(plan.settings(task, seed))).settings())
    if run.creature.hash != body.hash or run.settings != asked:
        raise ValueError(
            f"{folder} is a run with other settings; give another folder for the study"
        )
    return run


def gather(plan: Plan) -> dict[str, Any]:
    """What the runs came to, judged at the seed's moments; pictures are drawn on the way.

    Writes `results.json` and gives what is in it.
    """
    cases = [_case(plan, creature, task) for creature, task in plan.cases]
    runs = [run for case in cases for run in case["runs"]]
    results = {
        "machine": machine(),
        "started": _started(plan),
        "version": version("ambulo"),
        "runs": plan.runs,
        "generations": plan.generations,
        "population": plan.population,
        "seconds": round(sum(run["seconds"] for run in runs), 3),
        "settings": {"judged_steps": JUDGED_STEPS, **_common_settings(plan)},
        "cases": cases,
    }
    write_atomic(plan.folder / "results.json", json.dumps(results) + "\n")
    return results


def _common_settings(plan: Plan) -> dict[str, Any]:
    """Settings of all runs alike."""
    settings = plan.settings(plan.tasks[0], 1)
    resolved = json.loads(Arena(load_creature(plan.creatures[0]), json.dumps(settings)).settings())
    world = {key: value for key, value in resolved["world"].items() if key != "ground"}
    return {"evolution": resolved["evolution"], "world": world}


def _started(plan: Plan) -> str:
    """When the first run was begun."""
    times = [
        (plan.run_folder(creature, task, 1) / "creature.json").stat().st_mtime
        for creature, task in plan.cases
        if Evolution.exists(plan.run_folder(creature, task, 1))
    ]
    began = datetime.fromtimestamp(min(times, default=time.time()), UTC)
    return began.isoformat(timespec="seconds")


def _case(plan: Plan, creature: str, task: str) -> dict[str, Any]:
    body = load_creature(creature)
    facts = body.facts()
    runs = []
    for seed in range(1, plan.runs + 1):
        folder = plan.run_folder(creature, task, seed)
        if Evolution.exists(folder):
            _checked(plan, folder, creature, task, seed)
            runs.append(_run(plan, folder, creature, task, seed))
    runs = [run for run in runs if run["best"]]
    case: dict[str, Any] = {
        "creature": creature,
        "name": description(body)["name"],
        "legs": len(facts["legs"]),
        "joints": len(facts["driven"]),
        "task": task,
        "steps": Arena(body, json.dumps(plan.settings(task, 1))).steps,
        "runs": runs,
        "picture": None,
        "film": None,
        "gait": None,
    }
    finished = [run for run in runs[:INITIAL] if len(run["best"]) >= plan.generations]
    if finished:
        best = max(finished, key=lambda run: run["best"][-1])
        folder = plan.run_folder(creature, task, best["seed"])
        case.update(_pictures(plan, folder, creature, task))
    return case


def _run(plan: Plan, folder: Path, creature: str, task: str, seed: int) -> dict[str, Any]:
    history = read_history(folder)
    generations = {min(mark, plan.generations) for _, mark in marks_of(creature, task)}
    generations.add(plan.generations)
    marks = [
        _mark(folder, history, generation)
        for generation in sorted(generations)
        if generation <= len(history)
    ]
    rounded = (round(line["best_so_far"] or 0.0, 4) for line in history)
    return {
        "seed": seed,
        "best": list(rounded),
        "mean": [round(line["mean"] or 0.0, 4) for line in history],
        "seconds": history[-1]["seconds"] if history else 0.0,
        "marks": [mark for mark in marks if mark is not None],
    }


def _mark(folder: Path, history: list[dict[str, Any]], generation: int) -> dict[str, Any] | None:
    """The champion after so many generations, judged."""
    path = champion_at(folder, generation)
    if path is None:
        return None
    saved = load_controller(path)
    arena = Arena(saved.creature, json.dumps(saved.settings))
    _, judgement = recorded(arena, saved.creature, saved.genome, JUDGED_STEPS)
    figures = ("speed_bl_s", "upright", "torso_contact", "regularity", "cost_of_transport")
    return {
        "generation": generation,
        "seconds": history[generation - 1]["seconds"],
        "fitness": saved.record["fitness"],
        "usable": judgement["usable"],
        "reasons": judgement["reasons"],
        "judgement": {
            **{key: judgement[key] for key in figures},
            "legs_used": f"{judgement['legs_used']}/{judgement['legs']}",
        },
    }


def _pictures(plan: Plan, folder: Path, creature: str, task: str) -> dict[str, str]:
    """Strip and gait diagram of a run's champion; paths relative to the study's folder."""
    saved = load_controller(folder)
    arena = Arena(saved.creature, json.dumps(saved.settings))
    rollout, judgement = recorded(arena, saved.creature, saved.genome, JUDGED_STEPS)
    place = plan.folder / "pictures"
    place.mkdir(parents=True, exist_ok=True)
    title = f"{saved.creature.facts()['name']}, {task}"
    strip, gait = f"{creature}-{task}.png", f"{creature}-{task}-gait.png"
    strip_picture(place / strip, rollout, judgement, task, title)
    gait_picture(place / gait, rollout, judgement, task, title)
    return {"picture": f"pictures/{strip}", "gait": f"pictures/{gait}"}


def publish(plan: Plan, results: dict[str, Any]) -> list[Path]:
    """Writes the page."""
    return write_page(plan.folder, results)
