"""Commands that repeat published studies."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import click
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from ambulo.cli.stopping import STOPPED, held_back
from ambulo.study import gaits as how_soon
from ambulo.study.published import GENERATIONS, JUMP, PUBLISHED, RUN
from ambulo.study.seed_2d import Plan, begun, evolve_all, gather, publish, seed_creatures

TASKS = [RUN, JUMP]


@click.group()
def study() -> None:
    """Repeat published studies, tables and figures included."""


@study.command(name="seed-2d")
@click.option(
    "-o", "--output", required=True, metavar="DIR",
    type=click.Path(file_okay=False, path_type=Path), help="Folder for runs, results and page.",
)  # fmt: skip
@click.option(
    "--runs", default=PUBLISHED.runs, show_default=True, type=click.IntRange(1, 1000),
    help="Of each case; seeds 1 to this.",
)  # fmt: skip
@click.option(
    "--generations", default=GENERATIONS, show_default=True, type=click.IntRange(1),
    help="Of each run.",
)  # fmt: skip
@click.option(
    "--creature", "creatures", multiple=True, type=click.Choice(seed_creatures()),
    help="Only this one; may be given again. Default: all seven.",
)  # fmt: skip
@click.option(
    "--task", "tasks", multiple=True, type=click.Choice(TASKS), help="Only this one. Default: both."
)
@click.option("--threads", type=click.IntRange(1), help="Default: all processors.")
@click.option("--page-only", is_flag=True, help="No evolution: the page of what there is.")
@click.option("--dry-run", is_flag=True, help="Say what would be done, write nothing.")
@click.option("--json", "as_json", is_flag=True, help="Print where everything is as JSON.")
def seed_2d(
    output: Path,
    runs: int,
    generations: int,
    creatures: tuple[str, ...],
    tasks: tuple[str, ...],
    threads: int | None,
    page_only: bool,
    dry_run: bool,
    as_json: bool,
) -> None:
    """The 2D seed's study: 14 cases, fitness curves, tables 5.1 and 5.2, robustness, one page.

    Its algorithm and settings on our creatures: seven of them run and jump, 300 generations of 50,
    ten runs each. Ctrl-C stops after the generation at hand; the same command goes on.

    \b
    Examples:
      ambulo study seed-2d -o out/seed-2d --runs 3
      ambulo study seed-2d -o out/look --runs 1 --generations 20 --creature biped1
    """
    plan = Plan(
        folder=output,
        creatures=creatures or seed_creatures(),
        tasks=tasks or tuple(TASKS),
        runs=runs,
        generations=generations,
    )
    total = len(plan.cases) * plan.runs * plan.generations
    if dry_run:
        figures = {
            "cases": len(plan.cases),
            "runs": plan.runs,
            "generations": plan.generations,
            "population": plan.population,
            "all_generations": total,
        }
        if as_json:
            click.echo(json.dumps(figures, indent=2))
        else:
            click.echo("\n".join(f"{key:>16}  {value}" for key, value in figures.items()))
        click.echo("dry run: nothing written", err=True)
        return
    finished = True
    if page_only and not begun(plan):
        raise click.ClickException(f"{output} holds no run of these cases yet")
    if not page_only:
        output.mkdir(parents=True, exist_ok=True)
        with held_back() as asked_to_stop, _bar(total) as watch:
            finished = evolve_all(plan, threads=threads, stop=asked_to_stop, watch=watch)
    click.echo("judging and drawing", err=True)
    results = gather(plan)
    written = publish(plan, results)
    page = next(path for path in written if path.name == "index.html")
    if as_json:
        report = {"page": str(page), "results": str(output / "results.json"), "finished": finished}
        click.echo(json.dumps(report, indent=2))
    else:
        click.echo(f"wrote {page}")
    if not finished:
        click.echo("stopped; the same command goes on", err=True)
        raise click.exceptions.Exit(STOPPED)


@study.command()
@click.option(
    "-o", "--output", required=True, metavar="DIR",
    type=click.Path(file_okay=False, path_type=Path), help="Folder for results and page.",
)  # fmt: skip
@click.option(
    "--creature", "creatures", multiple=True, metavar="CREATURE",
    help="A file or the name of one that ships; may be given again. Default: the seed's seven.",
)  # fmt: skip
@click.option(
    "--task", "tasks", multiple=True,
    type=click.Choice(list(dict.fromkeys(row.task for row in how_soon.ROWS))),
    help="Only this one; may be given again. Default: all.",
)  # fmt: skip
@click.option(
    "--seeds", default=3, show_default=True, type=click.IntRange(1, 1000), help="1 to this."
)
@click.option(
    "--seconds", default=5.0, show_default=True, type=click.FloatRange(0.0, 3600.0, min_open=True),
    help="Of the processor's time that each search gets.",
)  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="Print the totals as JSON.")
def gaits(
    output: Path,
    creatures: tuple[str, ...],
    tasks: tuple[str, ...],
    seeds: int,
    seconds: float,
    as_json: bool,
) -> None:
    """How soon creatures learn: usable, robust, good; the seed's minutes beside it.

    Every creature and task with default settings on one thread, and running with the seed's
    network, under drawn physics and with a body that evolves; champions are played in Box2D, too.
    Ctrl-C stops and writes what there is.

    \b
    Examples:
      ambulo study gaits -o out/gaits
      ambulo study gaits -o out/mine --creature my_creature.json --task run --seeds 1
    """
    names = creatures or seed_creatures()
    rows = tuple(row for row in how_soon.ROWS if not tasks or row.task in tasks)
    with held_back() as asked_to_stop, _bar(len(rows) * len(names) * seeds) as watch:
        results = how_soon.study(
            names, rows=rows, seeds=seeds, seconds=seconds, stop=asked_to_stop, watch=watch
        )
        stopped = asked_to_stop()
    if not results["cases"]:
        raise click.exceptions.Exit(STOPPED)
    written = how_soon.write(output, results)
    if as_json:
        click.echo(json.dumps(results["totals"], indent=2))
    else:
        click.echo(how_soon.page(results).split("## ")[0].strip())
        click.echo(f"wrote {' and '.join(map(str, written))}")
    if stopped:
        click.echo("stopped: some cases are missing", err=True)
        raise click.exceptions.Exit(STOPPED)


@contextmanager
def _bar(total: int) -> Iterator[Callable[[str, float], None]]:
    """A bar of generations; nothing where standard error is no terminal."""
    console = Console(stderr=True)
    columns = [
        TextColumn("{task.description:>22}"), BarColumn(), TextColumn("{task.percentage:>3.0f}%"),
        TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn(),
    ]  # fmt: skip
    with Progress(*columns, console=console, disable=not console.is_terminal) as progress:
        task = progress.add_task("", total=total)
        yield lambda name, done: progress.update(task, description=name, completed=done)
