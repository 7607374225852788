"""The command that evolves a creature's gait."""

from __future__ import annotations

import contextlib
import json
import math
import time
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from ambulo._core import Arena, Creature, creature_tasks
from ambulo.cli.stopping import STOPPED, held_back
from ambulo.creature import load_creature
from ambulo.evolution import Champion, Evolution, Generation
from ambulo.executors import Executor, check_ray, on_ray, on_threads

if TYPE_CHECKING:
    from ambulo._core import CreatureFacts

TASKS = [task["name"] for task in creature_tasks()]
UNTIL = ["usable", "robust", "good"]
KINDS = ["network", "phase_network", "oscillator", "oscillator_network", "poses", "graph"]
STRATEGIES = ["genetic", "es", "cma_es", "openai_es", "map_elites", "neat"]


@click.command()
@click.argument("creature", required=False)
@click.argument("task", required=False, type=click.Choice(TASKS))
@click.option(
    "-o", "--output", "folder", required=True, metavar="RUN",
    type=click.Path(file_okay=False, path_type=Path), help="The run's folder.",
)  # fmt: skip
@click.option(
    "--config", type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="TOML file with settings; what it leaves out is as the preset has it. --dry-run prints "
    "all there are.",
)  # fmt: skip
@click.option(
    "--preset", type=click.Choice(["natural", "seed"]),
    help="natural (default): a gait in seconds, chosen for holding up. seed: the protocol of 2017.",
)  # fmt: skip
@click.option(
    "--until", type=click.Choice(UNTIL),
    help="Stop as soon as the champion is usable; or still so under other physics; or good, too.",
)  # fmt: skip
@click.option(
    "--solver", type=click.Choice(["lockstep", "box2d"]), help="Who does the physics. "
    "Default: lockstep, which is more than ten times faster.",
)  # fmt: skip
@click.option("--controller", type=click.Choice(KINDS), help="Default: what suits the task.")
@click.option(
    "--strategy", type=click.Choice(STRATEGIES),
    help="Default: es, an evolution strategy; in the seed's protocol genetic.",
)  # fmt: skip
@click.option(
    "--body", is_flag=True,
    help="Evolve proportions, strengths and densities, too: each by up to a quarter, if [body] of "
    "the configuration does not say otherwise. The champion's file holds its own creature.",
)  # fmt: skip
@click.option(
    "--robust", is_flag=True,
    help="Try every generation under other friction, mass, motor torque and time step and with "
    "pushes, too; the worse fitness counts.",
)  # fmt: skip
@click.option("--generations", type=click.IntRange(1), help="At most so many. Default: 300.")
@click.option(
    "--population", type=click.IntRange(2), help="Genomes of each. Default: the strategy's own."
)
@click.option("--seed", type=click.IntRange(0, 2**64 - 1), help="Of everything random. Default: 1.")
@click.option(
    "--minutes", type=click.FloatRange(0.0, min_open=True),
    help="Stop after the generation in which this time is up.",
)  # fmt: skip
@click.option("--threads", type=click.IntRange(1), help="Default: all processors.")
@click.option(
    "--executor", default="local", show_default=True, type=click.Choice(["local", "ray"]),
    help="Where creatures are tried; ray spreads them over a cluster.",
)  # fmt: skip
@click.option("--ray-address", metavar="HOST:PORT", help="The cluster. Default: a local one.")
@click.option("--resume", is_flag=True, help="Go on with RUN from its last generation.")
@click.option("--overwrite", is_flag=True, help="Start again if RUN holds a run.")
@click.option(
    "--dry-run", is_flag=True, help="Check everything, print the settings, write nothing."
)
@click.option("--json", "as_json", is_flag=True, help="Print the report as JSON.")
def evolve(
    creature: str | None,
    task: str | None,
    folder: Path,
    config: Path | None,
    preset: str | None,
    until: str | None,
    solver: str | None,
    controller: str | None,
    strategy: str | None,
    body: bool,
    robust: bool,
    generations: int | None,
    population: int | None,
    seed: int | None,
    minutes: float | None,
    threads: int | None,
    executor: str,
    ray_address: str | None,
    resume: bool,
    overwrite: bool,
    dry_run: bool,
    as_json: bool,
) -> None:
    """Evolve how CREATURE, a file or the name of one that ships, does TASK.

    A champion is chosen on replays: usable as it is, then under how many other physics (friction,
    mass, pushes), then good. A search that is stuck begins anew.

    RUN gets the settings, a line a generation, a controller for every improvement and a
    checkpoint. Ctrl-C finishes the generation and saves; --resume goes on, also after a crash, to
    the same result. The same seed gives the same run, on any number of threads.

    \b
    Examples:
      ambulo evolve tetrapod2 run -o out/tetrapod --until good
      ambulo evolve biped2 run -o out/seed --preset seed --solver box2d
      ambulo evolve my_creature.json jump -o out/mine --seed 7 --minutes 2
      ambulo evolve tetrapod2 run -o out/bred --body --robust --generations 100
      ambulo evolve --resume -o out/tetrapod --generations 600
    """
    if ray_address is not None and executor != "ray":
        raise click.UsageError("--ray-address belongs to --executor ray")
    chosen = {
        "preset": preset,
        "generations": generations,
        "seed": seed,
        "world.solver": solver,
        "controller.kind": controller,
        "evolution.strategy": strategy,
        "evolution.population": population,
        "search.randomise": robust or None,
        "body": body or None,
    }
    if resume:
        run = _resumed(folder, creature, task, config, chosen, overwrite)
        if dry_run:
            _say_plan(run.arena, run.creature.facts(), as_json)
            return
        _check_until(run.arena, until)
    else:
        if creature is None or task is None:
            raise click.UsageError("CREATURE and TASK are needed, unless --resume goes on with RUN")
        drawn = load_creature(creature)
        asked = _settings(config, task, chosen)
        arena = _arena(drawn, asked, config)
        _check_until(arena, until)
        if dry_run:
            _say_plan(arena, drawn.facts(), as_json)
            return
        if Evolution.exists(folder) and not overwrite:
            raise click.ClickException(
                f"{folder} holds a run; --resume goes on with it, --overwrite starts again"
            )
        if executor == "ray":
            check_ray(ray_address)  # Before there is a folder.
        run = Evolution.begin(folder, drawn, asked)
    began = run.generation
    with (
        _executing(run, executor, threads, ray_address) as tried,
        held_back() as asked_to_stop,
        _showing(run, minutes) as show,
    ):
        for done in run.steps(
            tried, threads=threads, minutes=minutes, until=until, stop=asked_to_stop
        ):
            show(done)
        reached = None if until is None else run.search.has(until)
        stopped = asked_to_stop() and run.generation < run.generations and not reached
    archive = run.write_archive()
    _report(run, began, until, reached, len(archive), as_json)
    if stopped:
        click.echo(f"stopped after generation {run.generation}; --resume goes on", err=True)
        raise click.exceptions.Exit(STOPPED)


def _settings(config: Path | None, task: str, chosen: dict[str, Any]) -> dict[str, Any]:
    """The configuration file with what the command line says on top."""
    settings: dict[str, Any] = {}
    if config is not None:
        try:
            settings = tomllib.loads(config.read_text(encoding="utf-8"))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise ValueError(f"{config}: {error}") from error
        _check_values(settings, str(config), "")
    wanted = settings.setdefault("task", {})
    if not isinstance(wanted, dict):
        raise ValueError(f"{config}: task: expected a table")
    if wanted.setdefault("name", task) != task:
        raise ValueError(f"{config}: task.name is '{wanted['name']}', but '{task}' is asked for")
    for place, value in chosen.items():
        if value is None:
            continue
        if place == "body":
            settings.setdefault("body", {})
            continue
        *tables, key = place.split(".")
        table = settings
        for name in tables:
            table = table.setdefault(name, {})
            if not isinstance(table, dict):
                raise ValueError(f"{config}: {name}: expected a table")
        table[key] = value
    return settings


def _arena(body: Creature, settings: dict[str, Any], config: Path | None) -> Arena:
    """Checks all settings; complaints begin with the file that they are from."""
    try:
        return Arena(body, json.dumps(settings))
    except ValueError as error:
        raise ValueError(str(error) if config is None else f"{config}: {error}") from error


def _check_until(arena: Arena, until: str | None) -> None:
    if until is not None and json.loads(arena.settings())["search"]["trials"] == 0:
        raise click.UsageError(
            f"--until {until} needs champions that are chosen on replays, but search.trials is 0"
        )


def _check_values(value: Any, config: str, place: str) -> None:
    """TOML has dates and numbers that are not finite; no setting is one."""
    if isinstance(value, dict):
        for key, inner in value.items():
            _check_values(inner, config, f"{place}.{key}" if place else key)
    elif isinstance(value, list):
        for index, inner in enumerate(value):
            _check_values(inner, config, f"{place}[{index}]")
    elif isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{config}: {place}: {value} is not finite")
    elif not isinstance(value, str | int | float):
        raise ValueError(f"{config}: {place}: no setting is a date or a time")


def _resumed(
    folder: Path, creature: str | None, task: str | None, config: Path | None,
    chosen: dict[str, Any], overwrite: bool,
) -> Evolution:  # fmt: skip
    if overwrite:
        raise click.UsageError("--resume goes on, --overwrite starts again: give one of them")
    others = [value for place, value in chosen.items() if place != "generations"]
    if config is not None or any(value is not None for value in others):
        raise click.UsageError("a run goes on with the settings that it began with")
    run = Evolution.resume(folder, chosen["generations"])
    if task is not None and run.settings["task"]["name"] != task:
        raise click.ClickException(f"{folder} is a run of {run.settings['task']['name']}")
    if creature is not None and load_creature(creature).hash != run.creature.hash:
        raise click.ClickException(f"{folder} is a run of another creature than {creature}")
    return run


def _say_plan(arena: Arena, facts: CreatureFacts, as_json: bool) -> None:
    settings = json.loads(arena.settings())
    if as_json:
        plan = {"creature": facts["name"], "genes": arena.genes, "settings": settings}
        click.echo(json.dumps(plan, indent=2))
    else:
        driven, legs = len(facts["driven"]), len(facts["legs"])
        click.echo(f"{facts['name']}: {driven} driven joints, {legs} legs, {facts['mass']:.1f} kg")
        click.echo(
            f"{settings['task']['name']}: at most {settings['generations']} generations of "
            f"{len(arena.search().ask())}, {' then '.join(map(str, arena.stages))} steps each, "
            f"{arena.genes} genes, {settings['evolution']['strategy']}"
        )
        for number, lesson in enumerate(settings.get("curriculum", []), 1):
            name = lesson.get("task", settings["task"]["name"])
            click.echo(f"first, lesson {number}: {name} until {lesson['until']}")
        click.echo(json.dumps(settings, indent=2))
    click.echo("dry run: nothing written", err=True)


@contextlib.contextmanager
def _executing(
    run: Evolution, executor: str, threads: int | None, address: str | None
) -> Iterator[Executor]:
    if executor == "local":
        yield on_threads(run.arena, threads)
    else:
        with on_ray(run.creature, run.arena, address) as tried:
            yield tried


@contextlib.contextmanager
def _showing(run: Evolution, minutes: float | None) -> Iterator[Callable[[Generation], None]]:
    """A bar on a terminal, a line now and then elsewhere; both on standard error."""
    console = Console(stderr=True)
    began, first = time.perf_counter(), run.generation

    def left(done: Generation) -> float:
        spent = time.perf_counter() - began
        by_count = spent / max(done.generation - first, 1) * (run.generations - done.generation)
        return by_count if minutes is None else max(min(by_count, 60.0 * minutes - spent), 0.0)

    if not console.is_terminal:
        last = began

        def line(done: Generation) -> None:
            nonlocal last
            if time.perf_counter() - last > 10.0 or done.generation == run.generations:
                last = time.perf_counter()
                click.echo(f"{_told(run, done)}, {left(done):.0f} s left", err=True)

        yield line
        return
    columns = [
        TextColumn("evolving"), BarColumn(), TextColumn("{task.fields[told]}"),
        TimeElapsedColumn(), TextColumn("{task.fields[left]}"),
    ]  # fmt: skip
    with Progress(*columns, console=console) as bar:
        task = bar.add_task("evolving", total=run.generations, completed=first, told="", left="")

        def show(done: Generation) -> None:
            bar.update(
                task,
                completed=done.generation,
                told=_told(run, done),
                left=f"left {left(done):.0f} s",
            )

        yield show


def _told(run: Evolution, done: Generation) -> str:
    best, mean = (
        f"{value:.2f}" if math.isfinite(value) else "none"
        for value in (done.best_so_far, done.mean)
    )
    lesson = ""
    if done.ahead:
        lessons = len(run.settings["curriculum"])
        lesson = f"  lesson {lessons - done.ahead + 1}/{lessons}"
    return f"generation {done.generation}/{run.generations}{lesson}  best {best}  mean {mean}"


def _verdict(champion: Champion) -> str | None:
    """What its replays say of it, in a word."""
    if champion.robustness is None:
        return None
    if champion.robustness["robust"]:
        return "good and robust" if champion.good else "robust"
    return "usable" if champion.robustness["usable"] else "not usable"


def _report(
    run: Evolution, began: int, until: str | None, reached: bool | None, kinds: int, as_json: bool
) -> None:
    best = run.champion
    report = {
        "run": str(run.folder),
        "creature": run.creature.facts()["name"],
        "task": run.settings["task"]["name"],
        "seed": run.settings["seed"],
        "generations": run.generation,
        "restarts": run.search.restarts,
        "lessons_ahead": run.search.ahead,
        "resumed_from": began or None,
        "fitness": best and best.fitness,
        "champion_generation": best and best.generation,
        "champion": str(run.folder / "best.safetensors") if best else None,
        "robustness": best and best.robustness,
        "good": None if best is None or best.robustness is None else best.good,
        "reached": reached,
        "archive": kinds or None,
        "seconds": round(run.seconds, 3),
    }
    if as_json:
        click.echo(json.dumps(report, indent=2))
        return
    if best is None and run.search.ahead:
        lessons = len(run.settings["curriculum"])
        click.echo(
            f"{run.generation} generations, and still in lesson "
            f"{lessons - run.search.ahead + 1} of {lessons}: --resume --generations goes on"
        )
        return
    if best is None:
        click.echo(f"{run.generation} generations, but nothing that is a number came of any")
        return
    verdict = _verdict(best)
    click.echo(
        f"{report['creature']}, {report['task']}: {'' if verdict is None else f'{verdict}, '}"
        f"fitness {best.fitness:.3f} in generation {best.generation} of {run.generation}, "
        f"{run.seconds:.1f} s"
    )
    if until is not None:
        click.echo(
            f"{'' if reached else 'not yet '}{until} after {run.generation} of at most "
            f"{run.generations} generations"
        )
    if kinds:
        click.echo(f"{kinds} kinds of motion to choose from: {run.folder / 'archive'}")
    click.echo(f"watch it: ambulo replay {run.folder} -o {run.folder / 'replay'}")
