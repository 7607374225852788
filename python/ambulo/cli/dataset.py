"""Commands on data sets: build one from motion files, and look at it."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.console import Console
from rich.table import Table

from ambulo import _core
from ambulo.cli.motion import AXES, motion_files
from ambulo.cli.progress import bar
from ambulo.data import open_dataset
from ambulo.files import write_atomic

MANIFEST = "manifest.toml"
# Licence texts are long; their beginning says which one it is.
LICENCE_LETTERS = 200


@click.group()
def dataset() -> None:
    """Build data sets from motion files, and look at them."""


@dataset.command()
@click.argument(
    "sources", metavar="[SRC]...", nargs=-1, type=click.Path(exists=True, path_type=Path)
)
@click.option(
    "-o", "--output", required=True, type=click.Path(file_okay=False, path_type=Path),
    help="The data set's folder.",
)  # fmt: skip
@click.option(
    "--config", type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="TOML file with settings that a new manifest begins with.",
)  # fmt: skip
@click.option("--licence", help="Licence of the recordings; models trained from them carry it.")
@click.option(
    "--axes", type=AXES, help="What all files are in. Default: found out for each of them."
)
@click.option(
    "--threads", type=click.IntRange(1, 1024), default=os.cpu_count() or 1, show_default=True,
    help="The result does not depend on it.",
)  # fmt: skip
@click.option("--dry-run", is_flag=True, help="Look at the files, print the manifest, stop.")
@click.option("--overwrite", is_flag=True, help="Make the manifest anew if there is one.")
@click.option("--json", "as_json", is_flag=True, help="Print the report as JSON.")
def build(
    sources: tuple[Path, ...],
    output: Path,
    config: Path | None,
    licence: str | None,
    axes: str | None,
    threads: int,
    dry_run: bool,
    overwrite: bool,
    as_json: bool,
) -> None:
    """Turn motion files into rows that a network learns from.

    The first build looks at SRC (files or folders of BVH and AMC) and writes manifest.toml: which
    clips, their axes, which joints are hips and feet, training or validation. Edit it and build
    again, without SRC: only what changed is built. Stop at any moment; the next build goes on.

    \b
    Examples:
      ambulo dataset build captures/ -o data/
      ambulo dataset build captures/ -o data/ --config settings.toml --dry-run
      ambulo dataset build -o data/
    """
    manifest = output / MANIFEST
    if manifest.exists() and not overwrite:
        if config is not None or licence is not None or axes is not None:
            raise click.UsageError(
                f"{manifest} has the settings already: edit it, or --overwrite makes it anew"
            )
        text, skipped = manifest.read_text(encoding="utf-8"), []
        clips = _checked(text, manifest)["clip"]
        _unnamed(clips, sources, output)
    else:
        text, skipped = planned(sources, output, config, licence, axes, threads)
        clips = _checked(text, manifest)["clip"]
    if dry_run:
        click.echo(text)
        list_left_out(skipped)
        return
    output.mkdir(parents=True, exist_ok=True)
    if not manifest.exists() or overwrite:
        write_atomic(manifest, text)
    list_left_out(skipped)
    report = build_dataset(output, text, threads)
    if as_json:
        named = {str(path): reason for path, reason in skipped}
        click.echo(json.dumps({"folder": str(output), **report, "skipped": named}, indent=2))
        return
    for name in report["empty"]:
        click.echo(f"{name}: no row can be used (too short, or no steps were found in it)")
    _note(_checked(text, manifest), report)
    training, validation = report["rows"]
    click.echo(
        f"{output}: {training} rows for training and {validation} for validation from "
        f"{len(clips)} clips ({report['written']} shards written, {report['kept']} kept)"
    )


def _note(manifest: dict[str, Any], report: dict[str, Any]) -> None:
    """What a model made of this will lack."""
    if not manifest["licence"].strip():
        click.echo(
            f"note: no licence is stated; set it in {MANIFEST} (or --licence): models carry it",
            err=True,
        )
    if not report["rows"][1]:
        click.echo(
            "note: no clip is held out for validation (too few takes for the share); set "
            f'split = "validation" for one in {MANIFEST}, or models are judged by what they learn',
            err=True,
        )


def build_dataset(folder: Path, manifest: str, threads: int) -> dict[str, Any]:
    """Build a manifest's shards under a progress bar; returns the report."""
    with bar("building", 1.0, unit="") as progress:
        return json.loads(
            _core.dataset_build(str(folder), manifest, threads=threads, progress=progress)
        )


def plan_dataset(
    files: Sequence[Path], folder: Path, settings: str, threads: int
) -> tuple[str, list[tuple[Path, str]]]:
    """Look at motion files under a progress bar; returns a manifest and what is left out."""
    with bar("looking", 1.0, unit="") as progress:
        text, skipped = _core.dataset_plan(
            [str(file) for file in files], str(folder), settings, threads=threads, progress=progress
        )
    return text, [(Path(path), reason) for path, reason in skipped]


def found_licence(sources: Sequence[Path]) -> str:
    """The beginning of a licence file that lies with the recordings, or nothing."""
    for source in sources:
        folder = source if source.is_dir() else source.parent
        for path in sorted(folder.glob("[Ll][Ii][Cc][Ee][Nn][CcSs][Ee]*")):
            words = " ".join(path.read_text(encoding="utf-8", errors="replace").split())
            if words:
                cut = words[:LICENCE_LETTERS]
                return f"{path.name}: {cut}{'…' if len(words) > len(cut) else ''}"
    return ""


def planned(
    sources: Sequence[Path],
    folder: Path,
    config: Path | None,
    licence: str | None,
    axes: str | None,
    threads: int,
) -> tuple[str, list[tuple[Path, str]]]:
    """A new manifest's text for motion files, and what is left out of it."""
    if not sources:
        raise click.UsageError(f"{folder} has no {MANIFEST} yet: name motion files or folders")
    files = [file for source in sources for file in motion_files(source)]
    settings = config.read_text(encoding="utf-8") if config else ""
    if _checked(settings, config or Path(MANIFEST))["licence"] == "":
        words = licence if licence is not None else found_licence(sources)
        # Keys of the top level come before any table.
        settings = f"licence = {json.dumps(words, ensure_ascii=False)}\n" + _without(
            settings, "licence"
        )
    elif licence is not None:
        raise click.UsageError(f"{config} states a licence already")
    if axes is not None:
        settings = f'axes = "{axes}"\n' + _without(settings, "axes")
    return plan_dataset(files, folder, settings, threads)


def _without(settings: str, key: str) -> str:
    lines = settings.splitlines()
    return "\n".join(line for line in lines if line.split("=")[0].strip() != key)


def _checked(text: str, path: Path) -> dict[str, Any]:
    try:
        return json.loads(_core.dataset_check(text))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _unnamed(clips: list[dict[str, Any]], sources: Sequence[Path], folder: Path) -> None:
    """Say which files of the sources the manifest does not name."""
    named = {(folder / clip["file"]).resolve() for clip in clips}
    files = [file for source in sources for file in motion_files(source)]
    new = [file for file in files if file.resolve() not in named]
    if new:
        click.echo(
            f"{len(new)} files are not in {folder / MANIFEST} and are left out ({new[0]} …): add "
            "them there, or --overwrite makes the manifest anew",
            err=True,
        )


def list_left_out(skipped: list[tuple[Path, str]]) -> None:
    """Say which files are not used, and why."""
    for path, reason in skipped:
        click.echo(f"left out {path}: {reason}", err=True)


@dataset.command()
@click.argument("folder", metavar="DIR", type=click.Path(exists=True, path_type=Path))
@click.option("--clips", "each", is_flag=True, help="One line for each clip, too.")
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
def info(folder: Path, each: bool, as_json: bool) -> None:
    """Say what a data set holds, and how far its automatic labels can be trusted.

    \b
    Examples:
      ambulo dataset info data/
      ambulo dataset info data/ --json
    """
    path = folder / "dataset.json"
    if not path.is_file():
        raise click.ClickException(f"{folder} has no dataset.json: `ambulo dataset build` makes it")
    open_dataset(folder)  # Refuses what is not whole, or of another version.
    index = json.loads(path.read_bytes())
    summary = summarise(index)
    if as_json:
        click.echo(json.dumps(summary, indent=2))
        return
    _print(summary)
    if each:
        _print_clips(summary["clips"])


def summarise(index: dict[str, Any]) -> dict[str, Any]:
    """A data set's index as the figures that a person asks for."""
    clips = index["clips"]
    frames = np.array([clip["frames"] for clip in clips], float)

    def weighted(key: str) -> float:
        return float(np.average([clip[key] for clip in clips], weights=frames))

    categories = np.sum([clip["categories"] for clip in clips], axis=0)
    judged = [clip["agreement"] for clip in clips if clip["agreement"]]
    return {
        "layout": index["layout"]["name"],
        "joints": len(index["parts"]["skeleton"]),
        "licence": index["licence"],
        "minutes": float(frames.sum() / index["fps"] / 60.0),
        "rows": {
            split: sum(clip["rows"] for clip in clips if clip["split"] == split)
            for split in ("training", "validation")
        },
        "categories": dict(zip(index["categories"], categories.tolist(), strict=True)),
        "unusable_frames": sum(clip["unusable"] for clip in clips),
        "repeated_steps": weighted("repeated_steps"),
        "contact_confidence": weighted("contact_confidence"),
        "gait_confidence": weighted("gait_confidence"),
        "ground_gap_m": max(clip["ground_gap"] for clip in clips),
        "agreement": _agreement(judged),
        "clips": clips,
    }


def _agreement(judged: list[dict[str, Any]]) -> dict[str, float | None] | None:
    """Over all clips with labels made by hand, each frame counting alike."""
    if not judged:
        return None
    phase = [entry["phase_frames"] for entry in judged]
    gait = [entry["gait_frames"] for entry in judged]

    def mean(key: str, frames: list[int]) -> float | None:
        if not sum(frames):
            return None
        return float(np.average([entry[key] for entry in judged], weights=frames))

    return {
        "phase_error": mean("phase_error", phase),
        "phase_shift": mean("phase_shift", phase),
        "gait_agreement": mean("gait_agreement", gait),
        "gait_agreement_everywhere": mean("gait_agreement_everywhere", gait),
    }


def _print(summary: dict[str, Any]) -> None:
    rows = summary["rows"]
    click.echo(f"layout       {summary['layout']}, {summary['joints']} joints")
    click.echo(f"licence      {summary['licence']}")
    click.echo(f"motion       {summary['minutes']:.1f} min in {len(summary['clips'])} clips")
    click.echo(f"rows         {rows['training']} training, {rows['validation']} validation")
    total = max(sum(summary["categories"].values()), 1)
    shares = [f"{name} {100 * n / total:.1f} %" for name, n in summary["categories"].items() if n]
    click.echo(f"gaits        {', '.join(shares)}")
    click.echo(
        f"labels       contacts {100 * summary['contact_confidence']:.1f} % sure, gaits "
        f"{100 * summary['gait_confidence']:.1f} %; {100 * summary['repeated_steps']:.1f} % of the "
        f"steps repeat a foot; {summary['unusable_frames']} frames without a known phase"
    )
    click.echo(f"ground       meets standing feet within {100 * summary['ground_gap_m']:.1f} cm")
    agreement = summary["agreement"] or {}
    if agreement.get("phase_error") is not None:
        click.echo(
            f"by hand      phase {agreement['phase_error']:.3f} cycles off in the mean (shift "
            f"{agreement['phase_shift']:+.3f})"
        )
    if agreement.get("gait_agreement") is not None:
        click.echo(
            f"by hand      gaits agree in {100 * agreement['gait_agreement']:.1f} % of the frames "
            f"of labelled cycles ({100 * agreement['gait_agreement_everywhere']:.1f} % of all)"
        )


def _print_clips(clips: list[dict[str, Any]]) -> None:
    table = Table()
    for title in ("clip", "split", "take"):
        table.add_column(title)
    for title in ("rows", "unused", "contacts", "gaits", "gap cm"):
        table.add_column(title, justify="right")
    for clip in clips:
        table.add_row(
            clip["name"],
            clip["split"],
            clip["take"],
            str(clip["rows"]),
            str(clip["unusable"]),
            f"{100 * clip['contact_confidence']:.0f} %",
            f"{100 * clip['gait_confidence']:.0f} %",
            f"{100 * clip['ground_gap']:.1f}",
        )
    Console(soft_wrap=False).print(table)
