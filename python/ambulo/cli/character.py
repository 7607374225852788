"""Commands that use a model: import, look, walk."""

from __future__ import annotations

import json
import shutil
import time
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.console import Console
from rich.table import Table

from ambulo.cli.progress import bar
from ambulo.cli.stopping import STOPPED
from ambulo.evaluate.outputs import write_outputs
from ambulo.evaluate.track import Track, load_track
from ambulo.evaluate.walk import Lap, summarise, walk_laps
from ambulo.files import write_atomic
from ambulo.holden import import_holden
from ambulo.loading import load_model
from ambulo.model import Model, ModelError
from ambulo.terrain import MAX_SEED, Terrain


@click.group(name="import")
def import_() -> None:
    """Turn other projects' weights into a model."""


@import_.command(name="holden")
@click.argument("folder", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option(
    "-o", "--output", required=True, type=click.Path(dir_okay=False, path_type=Path),
    help="The model to write (.safetensors).",
)  # fmt: skip
@click.option(
    "--skeleton", type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="BVH file with the rest pose. Default: rest.bvh beside the weights, else bones as the "
    "network itself draws them.",
)  # fmt: skip
@click.option("--overwrite", is_flag=True, help="Replace OUTPUT if it exists.")
@click.option("--dry-run", is_flag=True, help="Check everything, write nothing.")
@click.option("--json", "as_json", is_flag=True, help="Print the report as JSON.")
def import_holden_(
    folder: Path,
    output: Path,
    skeleton: Path | None,
    overwrite: bool,
    dry_run: bool,
    as_json: bool,
) -> None:
    """Import the PFNN authors' weights from FOLDER (W0_000.bin …).

    Any four or more of the 50 slices do; with more than four the files are checked against each
    other.

    \b
    Example:
      ambulo import holden network/ -o holden.safetensors
    """
    _may_write(output, overwrite)
    imported = import_holden(folder, skeleton)
    if not dry_run:
        imported.model.save(output)
    report = {
        "output": None if dry_run else str(output),
        "slices": list(imported.slices),
        "residual": imported.residual,
        "amplification": imported.amplification,
        **imported.model.info(),
    }
    if as_json:
        click.echo(json.dumps(report, indent=2))
        return
    fit = "not checked (four slices always fit)"
    if imported.residual is not None:
        fit = f"misfit {imported.residual:.1e} of the largest weight"
    click.echo(f"{len(imported.slices)} slices, {fit}; skeleton from {imported.skeleton}")
    click.echo(f"licence: {imported.model.header['licence']}")
    click.echo("dry run: nothing written" if dry_run else f"wrote {output}")


@click.group()
def model() -> None:
    """Look at models, and make their files smaller."""


@model.command(name="info")
@click.argument("path", metavar="MODEL", type=click.Path(exists=True, path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
def model_info(path: Path, as_json: bool) -> None:
    """Say what MODEL is: its network, size, layout, tuning, licence and origin.

    \b
    Example:
      ambulo model info model.safetensors --json
    """
    info = load_model(path).info()
    if as_json:
        click.echo(json.dumps(info, indent=2))
        return
    tuning, provenance = info.pop("tuning"), info.pop("provenance")
    info["bytes"] = f"{info['bytes']:,}"
    info["tuning"] = ", ".join(f"{key} {value}" for key, value in tuning.items()) or "published"
    for key, value in {**info, **provenance}.items():
        click.echo(f"{key:>12}  {value}")


@model.command(name="half")
@click.argument("path", metavar="MODEL", type=click.Path(exists=True, path_type=Path))
@click.option(
    "-o", "--output", required=True, type=click.Path(dir_okay=False, path_type=Path),
    help="The model to write (.safetensors).",
)  # fmt: skip
@click.option("--overwrite", is_flag=True, help="Replace OUTPUT if it exists.")
@click.option("--dry-run", is_flag=True, help="Check and measure, write nothing.")
@click.option("--json", "as_json", is_flag=True, help="Print the report as JSON.")
def model_half(path: Path, output: Path, overwrite: bool, dry_run: bool, as_json: bool) -> None:
    """Write MODEL with its layers in half precision: half the size.

    Says by how much that changes its answers: the largest difference in 64 random inputs, as a
    share of each number's deviation.

    \b
    Example:
      ambulo model half model.safetensors -o small.safetensors
    """
    _may_write(output, overwrite)
    whole = load_model(path)
    data = whole.to_bytes(half=True)
    report = {
        "output": None if dry_run else str(output),
        "bytes_before": whole.info()["bytes"],
        "bytes": len(data),
        "largest_change_sd": _largest_change(whole, Model.from_bytes(data)),
    }
    if not dry_run:
        write_atomic(output, data)
    if as_json:
        click.echo(json.dumps(report, indent=2))
        return
    before, after = report["bytes_before"], report["bytes"]
    click.echo(f"{before / 1e6:.2f} MB before, {after / 1e6:.2f} MB in half precision")
    click.echo(f"largest change of an answer: {report['largest_change_sd']:.1e} deviations")
    click.echo("dry run: nothing written" if dry_run else f"wrote {output}")


def _largest_change(a: Model, b: Model) -> float:
    """Of two models of one shape: over random inputs, in deviations of the outputs."""
    n, rng = a.core.normalisation(), np.random.default_rng(0)
    x = n["input_mean"] + n["input_std"] * rng.standard_normal((64, a.inputs))
    phase = rng.uniform(0.0, 2.0 * np.pi, 64)
    change = np.abs(a.predict(x, phase) - b.predict(x, phase)) / n["output_std"]
    return float(change.max())


@click.command()
@click.argument("path", metavar="MODEL", type=click.Path(exists=True, path_type=Path))
@click.option("--track", default="seeds", show_default=True, help="'seeds' or a TOML file.")
@click.option(
    "--laps", default=1, show_default=True, type=click.IntRange(1, 10_000), help="How many laps."
)
@click.option(
    "--terrain", default="flat", show_default=True, help="'flat', 'hills' or a height map file."
)
@click.option(
    "--seed", default=0, show_default=True, type=click.IntRange(0, MAX_SEED),
    help="Seed of the hills.",
)  # fmt: skip
@click.option("--responsive", is_flag=True, help="Follow wishes sooner; feet slide a little more.")
@click.option(
    "--place-feet/--own-feet", default=True, show_default=True,
    help="Feet held by the layer of feet (planted balls stay, nothing below the ground), or by the "
    "controller's own, simpler hold. The path is the same.",
)  # fmt: skip
@click.option(
    "-o", "--output", type=click.Path(file_okay=False, path_type=Path),
    help="Folder for the motion (BVH), pictures (PNG), film and summary.json. "
    "Without it nothing is written.",
)  # fmt: skip
@click.option(
    "--film", default="gif", show_default=True, type=click.Choice(["gif", "mp4", "none"]),
    help="mp4 needs ffmpeg on the PATH.",
)  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON.")
def walk(
    path: Path,
    track: str,
    laps: int,
    terrain: str,
    seed: int,
    responsive: bool,
    place_feet: bool,
    output: Path | None,
    film: str,
    as_json: bool,
) -> None:
    """Walk MODEL's character around a track and measure it.

    MODEL is a .safetensors file or a folder of the PFNN authors' weights. Motion, pictures and
    film show the first lap; the figures cover all. Ctrl-C keeps the laps that are finished.

    \b
    Examples:
      ambulo walk model.safetensors --laps 19 --json
      ambulo walk model.safetensors --terrain hills --seed 3 -o out/hills
    """
    _walk(
        path, load_model(path), load_track(track), Terrain.named(terrain, seed), terrain, laps,
        responsive=responsive, place_feet=place_feet, output=output, film=film, as_json=as_json,
    )  # fmt: skip


def _walk(
    path: Path,
    character: Model,
    track: Track,
    ground: Terrain,
    ground_name: str,
    laps: int,
    *,
    responsive: bool,
    place_feet: bool,
    output: Path | None,
    film: str,
    as_json: bool,
) -> None:
    if output is not None and film == "mp4" and not shutil.which("ffmpeg"):
        raise click.ClickException("--film mp4 needs ffmpeg on the PATH; --film gif does without")
    started = time.perf_counter()
    finished: list[Lap] = []
    stopped = False
    with bar("walking", laps, unit="laps") as progress:
        try:
            for lap in walk_laps(
                character, track, ground, laps,
                responsive=responsive, place_feet=place_feet, on_progress=progress,
            ):  # fmt: skip
                # The first lap is shown in full; of the others the figures and the path are enough.
                finished.append(lap if not finished else lap.without_motion())
        except KeyboardInterrupt:
            stopped = True
        except ModelError as error:
            raise ModelError(f"{path}: {error}") from error
    if not finished:
        click.echo("stopped before the first lap was finished; nothing written", err=True)
        raise click.exceptions.Exit(STOPPED)
    summary = {
        "terrain": ground_name,
        "laps_asked": laps,
        "wall_s": time.perf_counter() - started,
        "licence": character.header["licence"],
        **summarise(finished, track),
    }
    text = json.dumps(summary, indent=2)
    written: list[Path] = []
    # The figures first, in the file and printed: drawing takes longest and may be stopped.
    if output is not None:
        output.mkdir(parents=True, exist_ok=True)
        written.append(output / "summary.json")
        write_atomic(written[0], text + "\n")
    if as_json:
        click.echo(text)
    if output is not None:
        with bar("drawing", 1.0, unit="") as progress:
            written += write_outputs(output, finished, track, character, ground, film, progress)
    if not as_json:
        _print(summary, written)
    if stopped:
        raise click.exceptions.Exit(STOPPED)


def _print(summary: dict[str, Any], written: list[Path]) -> None:
    totals, laps = summary["totals"], summary["laps"]
    table = Table(title=f"{len(laps)} × {summary['track']} on {summary['terrain']} ground")
    columns = [
        ("lap", "", "d"),
        ("time s", "time_s", ".1f"),
        ("reached", "waypoints_reached", "d"),
        ("path m", "path_error_m", ".2f"),
        ("heading °", "heading_error_deg", ".1f"),
        ("speed", "mean_speed_ratio", ".2f"),
        ("skate cm", "foot_skate_cm_per_frame", ".2f"),
        ("planted cm", "planted_slide_cm_per_frame", ".3f"),
        ("ms", "ms_per_frame_mean", ".3f"),
    ]
    for title, _, _ in columns:
        table.add_column(title, justify="right")
    for number, lap in enumerate(laps, 1):
        table.add_row(*(format(lap[key] if key else number, spec) for _, key, spec in columns))
    Console(soft_wrap=False).print(table)
    click.echo("path and heading: mean error; speed: share of the asked; skate and ms: per frame")
    click.echo(f"{totals['waypoints_reached']} of {totals['waypoints']} waypoints reached")
    if totals["held_frames"]:
        click.echo(
            f"{totals['held_frames']} of {totals['frames']} frames held the pose: bad input or a "
            "bad prediction"
        )
    for path in written:
        click.echo(f"wrote {path}")
    if not written:
        click.echo("nothing written; -o DIR writes the motion, pictures and a film")


def _may_write(path: Path, overwrite: bool) -> None:
    if path.exists() and not overwrite:
        raise click.ClickException(f"{path} exists; --overwrite replaces it")
    if not path.parent.is_dir():
        raise click.ClickException(f"{path.parent} is not a folder")
