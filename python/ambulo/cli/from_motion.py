"""Training straight from motion files: the data set is made on the way."""

from __future__ import annotations

import json
import os
from pathlib import Path

import click

from ambulo import _core
from ambulo.cli.dataset import MANIFEST, build_dataset, list_left_out, planned
from ambulo.cli.motion import SUFFIXES, motion_files
from ambulo.files import write_atomic


def data_folder(
    folder: Path, output: Path, licence: str | None, *, dry_run: bool, overwrite: bool
) -> Path:
    """The data set in a folder, or one made beside the model from the motion files there.

    What is there of it already is kept: it goes on where it was stopped.
    """
    if not folder.is_dir() or (folder / "dataset.json").is_file() or (folder / MANIFEST).is_file():
        return folder
    if not any(path.suffix.lower() in SUFFIXES for path in folder.rglob("*")):
        return folder
    target = output.with_suffix(".data")
    if dry_run:
        raise click.UsageError(
            f"{folder} holds motion files: `ambulo dataset build {folder} -o {target} --dry-run` "
            "says what would be made of them, --dry-run here needs the data set"
        )
    manifest, threads = target / MANIFEST, os.cpu_count() or 1
    if manifest.exists() and not overwrite:
        _check_same(manifest, folder, licence)
    else:
        text, skipped = planned([folder], target, None, licence, None, threads)
        list_left_out(skipped)
        target.mkdir(parents=True, exist_ok=True)
        write_atomic(manifest, text)
    report = build_dataset(target, manifest.read_text(encoding="utf-8"), threads)
    click.echo(f"{target}: {report['rows'][0]} rows for training", err=True)
    return target


def _check_same(manifest: Path, folder: Path, licence: str | None) -> None:
    """What lies beside the model may be another folder's."""
    told = json.loads(_core.dataset_check(manifest.read_text(encoding="utf-8")))
    named = {(manifest.parent / clip["file"]).resolve() for clip in told["clip"]}
    if not named & {file.resolve() for file in motion_files(folder)}:
        raise click.ClickException(
            f"{manifest} was made from other motion than {folder}: --overwrite makes it anew"
        )
    if licence is not None and licence != told["licence"]:
        raise click.ClickException(
            f"{manifest} states another licence ('{told['licence']}'): --overwrite makes it anew"
        )
