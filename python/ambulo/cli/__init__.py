"""The command line."""

from __future__ import annotations

import sys
from typing import Any

import click

from ambulo.cli.accuracy import accuracy
from ambulo.cli.bench import bench
from ambulo.cli.character import import_, model, walk
from ambulo.cli.creature import creature
from ambulo.cli.dataset import dataset
from ambulo.cli.demo import demo
from ambulo.cli.evaluate import evaluate
from ambulo.cli.evolve import evolve
from ambulo.cli.motion import motion
from ambulo.cli.replay import replay
from ambulo.cli.scene import scene
from ambulo.cli.starter import starter
from ambulo.cli.stopping import STOPPED
from ambulo.cli.study import study
from ambulo.cli.train import export, train

EPILOG = """Examples:

\b
  ambulo import holden NETWORK-FOLDER -o model.safetensors
  ambulo walk model.safetensors -o out/walk
  ambulo motion convert captures/ out/ --fps 60 --mirror
  ambulo evolve tetrapod2 run -o out/tetrapod
  ambulo replay out/tetrapod -o out/tetrapod/replay
  ambulo scene run -o out/visit

Exit codes: 0 done, 1 something failed and was named, 2 wrong usage, 130 stopped by Ctrl-C."""


class _Group(click.Group):
    """Errors that a user can mend become one line, not a traceback."""

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except (click.exceptions.Exit, click.Abort):
            # Click's own ways out; they are RuntimeErrors, too.
            raise
        except KeyboardInterrupt:
            click.echo("stopped", err=True)
            raise click.exceptions.Exit(STOPPED) from None
        except (ValueError, OSError, RuntimeError) as error:
            if ctx.obj and ctx.obj.get("debug"):
                raise
            raise click.ClickException(str(error)) from error


@click.group(
    cls=_Group,
    epilog=EPILOG,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(package_name="ambulo")
@click.option("--debug", is_flag=True, help="Show tracebacks instead of one-line errors.")
@click.pass_context
def cli(ctx: click.Context, debug: bool) -> None:
    """Ambulo: character animation that is learned."""
    ctx.obj = {"debug": debug}


@cli.command()
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
def completion(shell: str) -> None:
    """Print a completion script for SHELL.

    \b
    Example (bash):
      ambulo completion bash > ~/.local/share/bash-completion/completions/ambulo
    """
    from click.shell_completion import get_completion_class

    found = get_completion_class(shell)
    if found is None:
        raise click.ClickException(f"this version of click has no completion for {shell}")
    click.echo(found(cli, {}, "ambulo", "_AMBULO_COMPLETE").source())


COMMANDS = (
    bench, creature, dataset, demo, evaluate, evolve, export, import_, model, motion, replay,
    scene, starter, study, train, walk,
)  # fmt: skip
for command in COMMANDS:
    cli.add_command(command)
evaluate.add_command(accuracy)


def main() -> None:
    """Entry point of the `ambulo` command."""
    try:
        cli(prog_name="ambulo")
    except KeyboardInterrupt:
        # Outside of a command, as while Click reports an error or the process winds down.
        click.echo("stopped", err=True)
        sys.exit(STOPPED)
