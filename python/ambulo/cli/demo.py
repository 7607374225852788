"""The demonstration: everything from motion to a character that walks, without any capture."""

from __future__ import annotations

from pathlib import Path

import click

from ambulo.cli.character import walk
from ambulo.cli.dataset import build
from ambulo.cli.starter import motion
from ambulo.cli.train import train
from ambulo.starters import starter_model

# Enough to see how a network learns; the model that walks took minutes more.
MINUTES, STEPS, SEED = 4.0, 1200, 0
LICENCE = "MIT OR Apache-2.0: motion made by rule by Ambulo, nobody's recording"


@click.command()
@click.option(
    "-o", "--output", default="out/demo", show_default=True,
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder to write; what is in it of an earlier demonstration is replaced.",
)  # fmt: skip
@click.option(
    "--steps", default=STEPS, show_default=True, type=click.IntRange(1, 10**6),
    help="Length of the training that is shown.",
)  # fmt: skip
@click.pass_context
def demo(ctx: click.Context, output: Path, steps: int) -> None:
    """Show the whole way, without any data: motion, data set, training, a walk.

    Makes some minutes of motion by rule, builds a data set of it, trains on that for a little
    while, and walks the starter model around the seeds' track: picture, film and figures.

    \b
    Example:
      ambulo demo -o out/demo
    """
    clips, data, model = output / "motion", output / "data", output / "trained.safetensors"
    click.echo("1 of 4  motion made by rule")
    ctx.invoke(motion, output=clips, minutes=MINUTES, seed=SEED, overwrite=True)
    click.echo("2 of 4  a data set of it")
    ctx.invoke(build, sources=(clips,), output=data, licence=LICENCE, axes="cm", overwrite=True)
    click.echo(f"3 of 4  training for {steps} steps")
    ctx.invoke(
        train, folder=data, output=model, preset="quick", steps=steps, seed=SEED, overwrite=True
    )
    click.echo("4 of 4  the starter model walks the seeds' track")
    ctx.invoke(walk, path=starter_model(), output=output / "walk")
