"""Commands that measure a model."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.table import Table

from ambulo.cli.motion import motion_files
from ambulo.cli.progress import bar
from ambulo.data import open_dataset
from ambulo.evaluate.captured import Capture
from ambulo.evaluate.commands import SPEEDS, classes_with
from ambulo.evaluate.faults import KINDS, is_clean
from ambulo.evaluate.free_run import GAITS, Settings, free_run
from ambulo.loading import load_model
from ambulo.model import Model, ModelError


@click.group()
def evaluate() -> None:
    """Measure models."""


def _speeds(_: click.Context, option: click.Parameter, values: tuple[str, ...]) -> dict[str, float]:
    speeds = {}
    for value in values:
        name, number = value.split("=", 1) if "=" in value else (value, "")
        try:
            speeds[name.strip()] = float(number)
        except ValueError:
            raise click.BadParameter(
                f"expected COMMAND=METRES-A-SECOND, found '{value}'", param=option
            ) from None
    try:
        classes_with(speeds)
    except ValueError as error:
        raise click.BadParameter(str(error), param=option) from None
    return speeds


@evaluate.command(name="free-run")
@click.argument("path", metavar="MODEL", type=click.Path(exists=True, path_type=Path))
@click.option(
    "--minutes", default=10.0, show_default=True, type=click.FloatRange(0.0, 6000.0),
    help="Of random commands, a seed.",
)  # fmt: skip
@click.option(
    "--seeds", default=5, show_default=True, type=click.IntRange(1, 1000),
    help="How many runs, each with commands of its own.",
)  # fmt: skip
@click.option(
    "--gait", "gaits", multiple=True, type=click.Choice(sorted(SPEEDS)),
    help="What random commands ask for; repeat it. Default: walk, jog, run and crouch.",
)  # fmt: skip
@click.option(
    "--speed", "speeds", multiple=True, callback=_speeds, metavar="COMMAND=M/S",
    help="Measure a steady command at a speed of your own ('jog=2.5'); repeat it.",
)  # fmt: skip
@click.option(
    "--capture", "captures", multiple=True, type=click.Path(exists=True, path_type=Path),
    help="Motion capture to hold the figures against: motion files or a folder of them, with the "
    "model's skeleton, or a data set; repeat it for more files.",
)  # fmt: skip
@click.option(
    "--hold-feet", is_flag=True,
    help="Measure with feet held where they stand. Default: as the network has them.",
)  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="Print the report as JSON.")
def free_run_(
    path: Path,
    minutes: float,
    seeds: int,
    gaits: tuple[str, ...],
    speeds: dict[str, float],
    captures: tuple[Path, ...],
    hold_feet: bool,
    as_json: bool,
) -> None:
    """Let MODEL's character run freely: does it ever fail, and how well does it obey?

    Random commands for a long time, watched for freezes, explosions and broken poses; then each
    steady command, measured for 10 s a seed once it is settled: speed and turn reached, foot
    skate, jerk, sway. The same arguments give the same report.

    \b
    Examples:
      ambulo evaluate free-run model.safetensors --minutes 1 --seeds 2
      ambulo evaluate free-run model.safetensors --capture captures/ --json
    """
    settings = Settings(
        minutes=minutes,
        seeds=seeds,
        gaits=gaits or GAITS,
        classes=classes_with(speeds),
        hold_feet=hold_feet,
    )
    model = load_model(path)
    captured = _captured(model, captures)
    with bar("running", settings.seconds, unit="s") as progress:
        try:
            report = free_run(model, settings, captured, progress)
        except ModelError as error:
            raise ModelError(f"{path}: {error}") from error
    for reason in report["left_out"]:
        click.echo(f"left out {reason}", err=True)
    report = {"model": str(path), "capture": [str(p) for p in captures], **report}
    if as_json:
        click.echo(json.dumps(report, indent=2))
        return
    _print(report)


def _captured(model: Model, paths: tuple[Path, ...]) -> Capture | None:
    if not paths:
        return None
    if len(paths) == 1 and (paths[0] / "dataset.json").is_file():
        return Capture.of_dataset(open_dataset(paths[0]))
    return Capture.of_files(model, [file for path in paths for file in motion_files(path)])


def _print(report: dict[str, Any]) -> None:
    console, wild = Console(soft_wrap=False), report["random"]
    if wild["minutes"]:
        _print_wild(report["seeds"], wild)
    console.print(_table(report))
    notes = "m/s: asked; speed, turn: share of the asked; skate: cm per 1/60 s; jerk: m/s³"
    if report["capture"]:
        notes += "; ×: share of the capture's, of which there are so many seconds"
    click.echo(notes)
    stand = report["classes"].get("stand", {})
    if stand:
        click.echo(_standing(stand))


def _print_wild(seeds: int, wild: dict[str, Any]) -> None:
    click.echo(
        f"{seeds} × random commands, {wild['minutes']:.1f} minutes in all: "
        + ", ".join(f"{kind} {wild[kind]}" for kind in KINDS)
    )
    if not is_clean(wild):
        click.echo(f"{wild['bad_frames']} bad frames, {100.0 * wild['bad_share']:.3f} %; first:")
        for one in wild["first"][:5]:
            click.echo(
                f"  seed {one['seed']}, {one['at_s']:.2f} s: {one['kind']} when asked for "
                f"{one['gait']} at {one['speed']:.2f} m/s"
            )
    turns = wild["turn_rad_per_frame"]
    click.echo(
        f"largest turn of a joint from frame to frame: {turns['p99.9']:.2f} rad in one frame of a "
        f"thousand, {turns['max']:.2f} at most"
    )


def _table(report: dict[str, Any]) -> Table:
    captured = bool(report["capture"])
    columns = ["m/s", "speed", "turn", "skate", "jerk"]
    table = Table(title="steady commands")
    table.add_column("command", no_wrap=True)
    for title in columns + (["skate ×", "jerk ×", "capture s"] if captured else []):
        table.add_column(title, justify="right")
    for name, found in report["classes"].items():
        row = [
            name,
            f"{found['asked']['speed']:.1f}",
            _number(found, "speed_ratio"),
            _number(found, "turn_ratio"),
            _number(found, "skate_cm_per_frame"),
            _number(found, "jerk_m_per_s3", ".0f"),
        ]
        if captured:
            ratios = found["ratios"]
            row += [_number(ratios, "skate"), _number(ratios, "jerk")]
            row.append(f"{found['capture']['seconds']:.0f}")
        table.add_row(*row)
    return table


def _standing(stand: dict[str, Any]) -> str:
    parts = [f"drifts {stand['drift_cm_per_s']:.1f} cm/s"]
    for key, what in (("hips_sway", "hips sway"), ("chest_sway", "the chest moves")):
        if f"{key}_cm" in stand:
            part = f"{what} by {stand[f'{key}_cm']:.2f} cm"
            ratio = stand.get("ratios", {}).get(key)
            parts.append(part + (f" ({ratio:.2f} × capture)" if ratio else ""))
    return "standing: " + ", ".join(parts)


def _number(found: dict[str, Any], key: str, spec: str = ".2f") -> str:
    return format(found[key], spec) if key in found else ""
