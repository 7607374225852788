"""Commands that measure speed."""

from __future__ import annotations

import json

import click
from rich.console import Console
from rich.table import Table

from ambulo.cli.progress import bar
from ambulo.creature import load_creature
from ambulo.evaluate.evolve_speed import compare
from ambulo.executors import default_threads


@click.group()
def bench() -> None:
    """Measure speed, beside what others make, in one run."""


@bench.command()
@click.option(
    "--creature", "creatures", multiple=True, default=["tetrapod2"], show_default=True,
    help="A file or the name of one that ships; may be given again.",
)  # fmt: skip
@click.option(
    "--population", default=50, show_default=True, type=click.IntRange(1, 10000),
    help="Individuals at once.",
)  # fmt: skip
@click.option(
    "--steps", default=1000, show_default=True, type=click.IntRange(1, 100000),
    help="Steps of each measurement.",
)  # fmt: skip
@click.option(
    "--repeats", default=7, show_default=True, type=click.IntRange(1, 1000),
    help="Measurements of each engine; one more warms up.",
)  # fmt: skip
@click.option(
    "--threads", "counts", multiple=True, type=click.IntRange(1),
    help="May be given again. Default: 1, and all processors.",
)  # fmt: skip
@click.option(
    "--peers/--no-peers", default=True, show_default=True,
    help="Also measure pyb2d3: pip install 'ambulo[bench]'.",
)  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
def evolve(
    creatures: tuple[str, ...],
    population: int,
    steps: int,
    repeats: int,
    counts: tuple[int, ...],
    peers: bool,
    as_json: bool,
) -> None:
    """Character-steps a second of the physics with the seed's network every step.

    Engines: the lockstep solver with as many lanes as this machine has, and with 8 and 1; Box2D,
    and pyb2d3, which is another binding of it. All take turns on the same creature, so that a
    machine that slows down slows all; medians are printed, and lockstep over each of the others.

    \b
    Example:
      ambulo bench evolve --creature tetrapod2 --creature decapod2 --json
    """
    bodies = {name: load_creature(name) for name in creatures}
    threads = list(dict.fromkeys(counts or (1, default_threads())))
    try:
        with bar("measuring", 1.0, "") as progress:
            found = compare(
                bodies, population=population, steps=steps, repeats=repeats, threads=threads,
                peers=peers, watch=progress,
            )  # fmt: skip
    except ImportError as error:
        raise click.ClickException(f"{error}; --no-peers leaves it out") from error
    if as_json:
        click.echo(json.dumps(found, indent=2))
        return
    table = Table(box=None, pad_edge=False)
    for column in ("engine", "creature", "threads", "character-steps/s", "least", "most"):
        table.add_column(column, justify="left" if column in ("engine", "creature") else "right")
    for row in found["results"]:
        speeds = (f"{row[key]:,}" for key in ("char_steps_per_s", "least", "most"))
        table.add_row(row["engine"], row["creature"], str(row["threads"]), *speeds)
    console = Console(width=100)
    console.print(table)
    for row in found["ratios"]:
        console.print(
            f"lockstep is {row['ratio']:.2f} × {row['over']} on {row['creature']}, "
            f"threads: {row['threads']}"
        )
    about = found["machine"]
    console.print(f"{about['cpu']}, {about['cores']} processors, load {about['load']}")
