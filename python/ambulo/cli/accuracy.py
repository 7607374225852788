"""The command `evaluate accuracy`."""

from __future__ import annotations

import json
import os
from functools import partial
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.console import Console
from rich.table import Table

from ambulo import _core
from ambulo.cli.motion import motion_files
from ambulo.cli.progress import bar
from ambulo.data import open_dataset
from ambulo.evaluate.accuracy import BASELINES, SECONDS, Clip, Settings
from ambulo.evaluate.accuracy import accuracy as measure
from ambulo.loading import load_model
from ambulo.model import Model


@click.command()
@click.argument("path", metavar="MODEL", type=click.Path(exists=True, path_type=Path))
@click.argument(
    "sources", metavar="CLIPS...", nargs=-1, required=True,
    type=click.Path(exists=True, path_type=Path),
)  # fmt: skip
@click.option(
    "--every", default=5, show_default=True, type=click.IntRange(1, 1000),
    help="Predict every such row in one step.",
)  # fmt: skip
@click.option(
    "--windows", default=128, show_default=True, type=click.IntRange(0, 10000),
    help="Closed loops of five seconds, a split; a fifth as many free runs.",
)  # fmt: skip
@click.option("--axes", help="What motion files are in, where it cannot be told (cm, inch, …).")
@click.option("--seed", default=0, show_default=True, help="Of the choice of windows.")
@click.option("--files", "each", is_flag=True, help="One line for each clip, too.")
@click.option("--json", "as_json", is_flag=True, help="Print the report as JSON.")
def accuracy(
    path: Path,
    sources: tuple[Path, ...],
    every: int,
    windows: int,
    axes: str | None,
    seed: int,
    each: bool,
    as_json: bool,
) -> None:
    """Hold MODEL's poses against captured ones.

    CLIPS are motion files or folders of them, or data sets (their training and validation clips
    are told apart). Errors of one step, of the pose fed back for 1, 2 and 5 seconds, and of a free
    run that is asked for what the clip does; beside each, poses that need no model.

    \b
    Examples:
      ambulo evaluate accuracy model.safetensors data/
      ambulo evaluate accuracy model.safetensors walk.bvh --json
    """
    model = load_model(path)
    clips = [clip for source in sources for clip in _clips(model, source, axes)]
    settings = Settings(
        every=every,
        windows=windows,
        free_windows=windows // 5,
        threads=os.cpu_count() or 1,
        seed=seed,
    )
    with bar("measuring", 1.0, unit="") as progress:
        report = measure(model, clips, settings, progress)
    for reason in report["left_out"]:
        click.echo(f"left out {reason}", err=True)
    if not report["splits"]:
        raise click.ClickException("no clip could be used")
    if as_json:
        click.echo(json.dumps({"model": str(path), **report}, indent=2))
        return
    for split, found in report["splits"].items():
        _print(split, found)
    if each:
        _print_files(report["files"])


def _clips(model: Model, source: Path, axes: str | None) -> list[Clip]:
    if (source / "dataset.json").is_file():
        dataset = open_dataset(source)
        if dataset.layout["hash"] != model.header["layout"]["hash"]:
            raise click.ClickException(
                f"{source} has the layout {dataset.layout['name']} for {len(dataset.joints)} "
                f"joints, the model {model.header['layout']['name']} for {len(model.names)}"
            )

        def rows(shard: Any) -> tuple[np.ndarray, Any]:
            return np.asarray(shard.open()), shard.runs

        return [Clip(s.name, s.split, partial(rows, s)) for s in dataset.shards if s.rows]

    def read(file: Path) -> tuple[np.ndarray, Any]:
        found = _core.clip_rows(model.core, str(file), axes=axes)
        return found["rows"], found["runs"]

    return [Clip(file.stem, "clips", partial(read, file)) for file in motion_files(source)]


def _print(split: str, found: dict[str, Any]) -> None:
    console, one = Console(soft_wrap=False), found["one_step"]
    table = Table(title=f"{split}: {one['rows']} rows")
    for title in ("", "relative", "one step cm", *(f"loop {s} s cm" for s in SECONDS)):
        table.add_column(title, justify="right" if title else "left")
    loop = found["loop"]
    looped = [loop.get(f"{s} s", {}) for s in SECONDS]
    table.add_row(
        "model",
        f"{one['relative_error']:.4f} ± {one['relative_error_sd']:.4f}",
        f"{one['position_cm']:.2f}",
        *(f"{at['position_cm']:.1f}" if at else "" for at in looped),
    )
    for name in BASELINES:
        base = one["baselines"][name]
        table.add_row(
            name,
            f"{base['relative_error']:.4f}",
            f"{base['position_cm']:.2f}",
            *(f"{at['baselines_cm'][name]:.1f}" if at else "" for at in looped),
        )
    console.print(table)
    gaits = ", ".join(f"{name} {cm:.2f}" for name, cm in one["position_cm_by_gait"].items())
    click.echo(
        f"one step: 95 % below {one['position_cm_p95']:.2f} cm, at most "
        f"{one['position_cm_max']:.1f} cm; rotations {one['rotation_deg']:.2f}° off, contacts F1 "
        f"{one['contact_f1']:.3f}; cm by gait: {gaits}"
    )
    for name, run in (("loop", loop), ("free run", found["free"])):
        if run:
            click.echo(
                f"{name}: {run['windows']} windows, skate {run['skate_cm_per_frame']:.3f} cm/frame "
                f"({run['skate_ratio']:.2f} × capture), jerk {run['jerk_m_per_s3']:.0f} m/s³ "
                f"({run['jerk_ratio']:.2f} × capture)"
            )
    if loop:
        phases = ", ".join(f"{loop[f'{s} s']['phase_error']:.3f}" for s in SECONDS)
        click.echo(f"loop: phase off by {phases} cycles after {', '.join(map(str, SECONDS))} s")
    free = found["free"]
    if free:
        bases = ", ".join(f"{name} {cm:.1f}" for name, cm in free["baselines_cm"].items())
        click.echo(
            f"free run: pose {free['position_cm']['mean']:.1f} cm off the clip's (95 % below "
            f"{free['position_cm']['p95']:.1f}), at a phase of its own; {bases}"
        )
        errors = ", ".join(f"{error:.2f}" for error in free["path_error_m"].values())
        ratio = free["distance_ratio"]
        click.echo(
            f"free run: {errors} m off the clip's path after {', '.join(map(str, SECONDS))} s, "
            f"heading {free['heading_error_deg']:.1f}° off"
            + (f", {ratio:.2f} × its distance" if ratio else "")
        )


def _print_files(files: list[dict[str, Any]]) -> None:
    table = Table(title="one step, by clip")
    for title in ("clip", "split"):
        table.add_column(title)
    for title in ("relative", "sd", "cm", *BASELINES):
        table.add_column(title, justify="right")
    for file in files:
        table.add_row(
            file["name"],
            file["split"],
            f"{file['relative_error']:.4f}",
            f"{file['relative_error_sd']:.4f}",
            f"{file['position_cm']:.2f}",
            *(f"{file['baselines'][name]:.4f}" for name in BASELINES),
        )
    Console(soft_wrap=False).print(table)
