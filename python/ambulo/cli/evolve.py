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
from ambulo.evolution import Evolution, Generation
from ambulo.executors import Executor, check_ray, on_ray, on_threads

if TYPE_CHECKING:
    from ambulo._core import CreatureFacts

TASKS = [task["name"] for task in creature_tasks()]


@click.command()
@click.argument("creature", required=False)
@click.argument("task", required=False, type=click.Choice(TASKS))
@click.option(
    "-o", "--output", "folder", required=True, metavar="RUN",
    type=click.Path(file_okay=False, path_type=Path), help="The run's folder.",
)  # fmt: skip
@click.option(
    "--config", type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="TOML file with settings; what it leaves out is as the seed has it.",
)  # fmt: skip
@click.option("--generations", type=click.IntRange(1), help="How many. Default: 300.")
@click.option("--population", type=click.IntRange(3), help="Genomes of each. Default: 50.")
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
    """Evolve how CREATURE does TASK: a file or the name of one that ships; run or jump.

    RUN gets the settings, a line a generation, a controller for every improvement and a
    checkpoint. Ctrl-C finishes the generation and saves; --resume goes on, also after a crash, to
    the same result. The same seed gives the same run, on any number of threads.

    \b
    Examples:
      ambulo evolve tetrapod2 run -o out/tetrapod
      ambulo evolve my_creature.json jump -o out/mine --seed 7 --minutes 2
      ambulo evolve --resume -o out/tetrapod --generations 600
    """
    if ray_address is not None and executor != "ray":
        raise click.UsageError("--ray-address belongs to --executor ray")
    if resume:
        run = _resumed(folder, creature, task, config, population, seed, overwrite, generations)
        if dry_run:
            _say_plan(run.arena, run.creature.facts(), as_json)
            return
    else:
        if creature is None or task is None:
            raise click.UsageError("CREATURE and TASK are needed, unless --resume goes on with RUN")
        body = load_creature(creature)
        asked = _settings(config, task, generations, population, seed)
        arena = _arena(body, asked, config)
        if dry_run:
            _say_plan(arena, body.facts(), as_json)
            return
        if Evolution.exists(folder) and not overwrite:
            raise click.ClickException(
                f"{folder} holds a run; --resume goes on with it, --overwrite starts again"
            )
        if executor == "ray":
            check_ray(ray_address)  # Before there is a folder.
        run = Evolution.begin(folder, body, asked)
    began = run.generation
    with (
        _executing(run, executor, threads, ray_address) as tried,
        held_back() as asked_to_stop,
        _showing(run, minutes) as show,
    ):
        for done in run.steps(tried, minutes=minutes, stop=asked_to_stop):
            show(done)
        stopped = asked_to_stop() and run.generation < run.generations
    _report(run, began, as_json)
    if stopped:
        click.echo(f"stopped after generation {run.generation}; --resume goes on", err=True)
        raise click.exceptions.Exit(STOPPED)


def _settings(
    config: Path | None, task: str, generations: int | None, population: int | None,
    seed: int | None,
) -> dict[str, Any]:  # fmt: skip
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
    for key, value in (("generations", generations), ("seed", seed)):
        if value is not None:
            settings[key] = value
    if population is not None:
        strategy = settings.setdefault("evolution", {})
        if not isinstance(strategy, dict):
            raise ValueError(f"{config}: evolution: expected a table")
        strategy["population"] = population
    return settings


def _arena(body: Creature, settings: dict[str, Any], config: Path | None) -> Arena:
    """Checks all settings; complaints begin with the file that they are from."""
    try:
        return Arena(body, json.dumps(settings))
    except ValueError as error:
        raise ValueError(str(error) if config is None else f"{config}: {error}") from error


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
    population: int | None, seed: int | None, overwrite: bool, generations: int | None,
) -> Evolution:  # fmt: skip
    if overwrite:
        raise click.UsageError("--resume goes on, --overwrite starts again: give one of them")
    if config is not None or population is not None or seed is not None:
        raise click.UsageError("a run goes on with the settings that it began with")
    run = Evolution.resume(folder, generations)
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
            f"{settings['task']['name']}: {settings['generations']} generations of "
            f"{settings['evolution']['population']}, {arena.steps} steps each, "
            f"{arena.genes} weights"
        )
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
    return f"generation {done.generation}/{run.generations}  best {best}  mean {mean}"


def _report(run: Evolution, began: int, as_json: bool) -> None:
    best = run.best_genome is not None
    report = {
        "run": str(run.folder),
        "creature": run.creature.facts()["name"],
        "task": run.settings["task"]["name"],
        "seed": run.settings["seed"],
        "generations": run.generation,
        "resumed_from": began or None,
        "fitness": run.best_fitness if best else None,
        "champion_generation": run.best_generation if best else None,
        "champion": str(run.folder / "best.safetensors") if best else None,
        "seconds": round(run.seconds, 3),
    }
    if as_json:
        click.echo(json.dumps(report, indent=2))
        return
    if not best:
        click.echo(f"{run.generation} generations, but nothing that is a number came of any")
        return
    click.echo(
        f"{report['creature']}, {report['task']}: fitness {run.best_fitness:.3f} in generation "
        f"{run.best_generation} of {run.generation}, {run.seconds:.1f} s"
    )
    click.echo(f"watch it: ambulo replay {run.folder} -o {run.folder / 'replay'}")
