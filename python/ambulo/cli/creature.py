"""Commands for creature files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click
from PIL import Image

from ambulo._core import Arena, Creature
from ambulo.bake import bake as baked
from ambulo.bake import find_loop
from ambulo.creature import (
    CreatureError,
    description,
    load_controller,
    load_creature,
    recorded,
)
from ambulo.files import replacing, write_atomic
from ambulo.pictures.creature import draw_creature
from ambulo.starters import starter_creatures

# Below this a motion is no gait, and its keyframes are those of the whole episode.
REGULAR = 0.5


@click.group()
def creature() -> None:
    """Check, draw and list creatures, and bake their motion."""


@creature.command(name="list")
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
def list_(as_json: bool) -> None:
    """List the creatures that ship with the project.

    \b
    Example:
      ambulo creature list
    """
    rows = {name: _facts(load_creature(path)) for name, path in starter_creatures().items()}
    if as_json:
        click.echo(json.dumps(rows, indent=2))
        return
    for name, row in rows.items():
        click.echo(
            f"{name:>10}  {row['legs']:>2} legs, {row['joints']:>2} driven joints, "
            f"{row['mass_kg']:5.1f} kg, {row['length_m']:.2f} m long"
        )


@creature.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True)
@click.option("--json", "as_json", is_flag=True, help="Print as JSON, problems included.")
@click.pass_context
def check(ctx: click.Context, files: tuple[str, ...], as_json: bool) -> None:
    """Say whether each FILE is a creature, and if not, where and why; exit 1 if any is not.

    \b
    Examples:
      ambulo creature check my_creature.json
      ambulo creature check creatures/*.json --json
    """
    found: list[dict[str, Any]] = []
    for file in files:
        try:
            found.append({"file": file, "good": True, **_facts(load_creature(file))})
        except CreatureError as error:
            listed = [{"path": path, "reason": reason} for path, reason in error.problems]
            found.append({"file": file, "good": False, "problems": listed})
        except OSError as error:
            # Those after it are still looked at.
            reason = error.strerror or str(error).removeprefix(f"{file}: ")
            listed = [{"path": None, "reason": reason}]
            found.append({"file": file, "good": False, "problems": listed})
    if as_json:
        click.echo(json.dumps(found, indent=2))
    else:
        for row in found:
            _say(row)
    if not all(row["good"] for row in found):
        ctx.exit(1)


def _say(row: dict[str, Any]) -> None:
    if row["good"]:
        click.echo(
            f"{row['file']}: good; {row['name']}, {row['parts']} parts, {row['joints']} driven "
            f"joints, {row['legs']} legs, {row['mass_kg']:.1f} kg, {row['length_m']:.2f} m"
        )
        return
    for problem in row["problems"]:
        place = "" if problem["path"] is None else f"{problem['path']}: "
        click.echo(f"{row['file']}: {place}{problem['reason']}")


def _facts(body: Creature) -> dict[str, Any]:
    facts = body.facts()
    return {
        "name": facts["name"],
        "hash": facts["hash"],
        "parts": len(description(body)["parts"]),
        "joints": len(facts["driven"]),
        "legs": len(facts["legs"]),
        "mass_kg": round(facts["mass"], 3),
        "length_m": round(facts["length"], 3),
        "standing_height_m": round(facts["standing_height"], 3),
    }


@creature.command()
@click.argument("source", metavar="FILE")
@click.option(
    "-o", "--output", required=True, metavar="PNG",
    type=click.Path(dir_okay=False, path_type=Path), help="The picture to write.",
)  # fmt: skip
@click.option(
    "--size", default="640x400", show_default=True, metavar="WxH", help="Pixels, 64 to 4096 a side."
)
@click.option("--overwrite", is_flag=True, help="Replace PNG if it exists.")
def show(source: str, output: Path, size: str, overwrite: bool) -> None:
    """Draw the creature in FILE, or one that ships, in its start pose.

    \b
    Example:
      ambulo creature show tetrapod2 -o tetrapod2.png
    """
    try:
        width, height = (int(side) for side in size.split("x"))
    except ValueError:
        raise click.UsageError(f"--size {size}: expected WxH, as 640x400") from None
    if not (64 <= width <= 4096 and 64 <= height <= 4096):
        raise click.UsageError(f"--size {size}: 64 to 4096 a side")
    if output.exists() and not overwrite:
        raise click.ClickException(f"{output} exists; --overwrite replaces it")
    picture = draw_creature(description(load_creature(source)), size=(width, height))
    with replacing(output) as part:
        Image.fromarray(picture).save(part, "PNG")
    click.echo(f"wrote {output}")


@creature.command()
@click.argument("source", metavar="RUN|CONTROLLER", type=click.Path(exists=True, path_type=Path))
@click.option(
    "-o", "--output", required=True, metavar="FILE",
    type=click.Path(dir_okay=False, path_type=Path), help="The keyframes to write (.json).",
)  # fmt: skip
@click.option(
    "--steps", default=2000, show_default=True, type=click.IntRange(8, 10**6),
    help="How long it moves; the loop is looked for in the second half.",
)  # fmt: skip
@click.option(
    "--every", default=1, show_default=True, type=click.IntRange(1, 60),
    help="A keyframe every so many steps; in a loop about so many, so that its end is one.",
)  # fmt: skip
@click.option("--whole", is_flag=True, help="All of the episode, no loop; what jumps always get.")
@click.option("--overwrite", is_flag=True, help="Replace FILE if it exists.")
@click.option("--json", "as_json", is_flag=True, help="Print what was found as JSON.")
def bake(
    source: Path, output: Path, steps: int, every: int, whole: bool, overwrite: bool, as_json: bool
) -> None:
    """Write a champion's motion as keyframes for every part, for a game without physics.

    Of a gait one period, its end fitted to its beginning; the seam that was left before is said.

    \b
    Example:
      ambulo creature bake out/tetrapod -o tetrapod.run.json
    """
    if output.exists() and not overwrite:
        raise click.ClickException(f"{output} exists; --overwrite replaces it")
    saved = load_controller(source)
    if "task" not in saved.settings:
        raise click.ClickException(f"{source} does not say what it was evolved for")
    arena = Arena(saved.creature, json.dumps(saved.settings))
    rollout, judgement = recorded(arena, saved.creature, saved.genome, steps)
    regular, period = judgement["regularity"] or 0.0, judgement["period_s"]
    once = whole or saved.settings["task"]["name"] == "jump"
    if not once and (period is None or regular < REGULAR):
        raise click.ClickException(
            f"this motion does not repeat itself (regularity {regular:.2f}, {REGULAR} is needed): "
            "--whole bakes all of it"
        )
    motion = baked(rollout, None if once else find_loop(rollout, period), every=every)
    write_atomic(output, json.dumps(motion) + "\n")
    report = {
        "output": str(output),
        "frames": motion["frames"],
        "fps": motion["fps"],
        "regularity": judgement["regularity"],
        "loop": motion["loop"],
    }
    if as_json:
        click.echo(json.dumps(report, indent=2))
        return
    loop = motion["loop"]
    click.echo(
        f"{motion['frames']} keyframes of {len(motion['parts'])} parts, "
        f"{motion['fps']:.0f} a second"
    )
    if loop is not None:
        click.echo(
            f"loop of {loop['duration_s']:.3f} s, {loop['advance']:.3f} m forward; seam "
            f"{100.0 * loop['seam']:.2f} cm and {loop['seam_angle']:.3f} rad, closed"
        )
    click.echo(f"wrote {output}")
