"""Commands that make what a newcomer without capture needs: the starter motion."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from ambulo._core import write_motion
from ambulo.cli.progress import bar
from ambulo.cli.stopping import STOPPED, held_back
from ambulo.starter_motion import MINUTES, StarterClip, clips, plan

SHOWN = 5


@click.group()
def starter() -> None:
    """Make motion to begin with, free of anybody's licence."""


@starter.command()
@click.option(
    "-o", "--output", required=True, metavar="DIR",
    type=click.Path(file_okay=False, path_type=Path), help="Folder for the files.",
)  # fmt: skip
@click.option(
    "--seed", default=0, show_default=True, type=click.IntRange(min=0),
    help="Another seed makes other motion of the same kinds.",
)  # fmt: skip
@click.option(
    "--minutes", default=MINUTES, show_default=True,
    type=click.FloatRange(min=0.0, max=600.0, min_open=True),
    help="Length of it all; below some four minutes it comes out longer.",
)  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="Print what was made as JSON.")
@click.option("--dry-run", is_flag=True, help="Make everything, write nothing.")
@click.option(
    "--overwrite/--no-overwrite", default=False, show_default=True, help="Replace files that exist."
)
@click.pass_context
def motion(
    ctx: click.Context,
    output: Path,
    seed: int,
    minutes: float,
    as_json: bool,
    dry_run: bool,
    overwrite: bool,
) -> None:
    """Make human locomotion by rule: BVH files, 60 Hz, centimetres, +Y up, 22 joints.

    Stands, walks, jogs, runs, backward and sideways steps, turns, crouches, slopes, stairs, jumps,
    and minutes of it all mixed as by a player. The same seed makes the same files. Ctrl-C stops
    after the file at hand.

    \b
    Examples:
      ambulo starter motion -o motion/
      ambulo starter motion -o more/ --seed 1 --minutes 40 --json
    """
    planned = plan(minutes)
    files = [output / f"{entry.name}.bvh" for entry in planned]
    if not overwrite:
        _refuse_existing(files)
    made: list[dict[str, Any]] = []
    with held_back() as stop, bar("making", len(files), "files") as progress:
        for file, clip in zip(files, clips(seed, minutes), strict=True):
            if not dry_run:
                output.mkdir(parents=True, exist_ok=True)
                write_motion(str(file), clip.clip.converted("ambulo", "cm"))
            made.append(_told(file, clip))
            progress(len(made))
            if stop():
                break
    if as_json:
        click.echo(json.dumps(made, indent=2))
    else:
        _say(made, output, "would write" if dry_run else "wrote")
    if len(made) < len(files):
        click.echo(f"stopped after {len(made)} of {len(files)} files", err=True)
        ctx.exit(STOPPED)


def _refuse_existing(files: list[Path]) -> None:
    """Before anything is made: what exists is kept."""
    there = [file for file in files if file.exists()]
    if there:
        more = f" and {len(there) - SHOWN} more" if len(there) > SHOWN else ""
        names = ", ".join(str(file) for file in there[:SHOWN])
        raise ValueError(f"{names}{more} exist; --overwrite replaces them")


def _told(file: Path, clip: StarterClip) -> dict[str, Any]:
    seconds: dict[str, float] = {}
    for start, end, gait in clip.gaits:
        seconds[gait] = round(seconds.get(gait, 0.0) + end - start, 2)
    return {
        "output": str(file),
        "frames": clip.clip.frames,
        "seconds": round(clip.clip.duration, 2),
        "gaits": seconds,
    }


def _say(made: list[dict[str, Any]], output: Path, verb: str) -> None:
    """A line for the files and one for how long each gait is."""
    gaits: dict[str, float] = {}
    for entry in made:
        for gait, seconds in entry["gaits"].items():
            gaits[gait] = gaits.get(gait, 0.0) + seconds
    total = sum(gaits.values())
    click.echo(f"{verb} {len(made)} files to {output} ({total / 60.0:.1f} min at 60 fps)")
    shares = (f"{gait} {seconds:.0f} s" for gait, seconds in gaits.items())
    click.echo(f"  {', '.join(shares)}")
