"""Commands that make models: train, and export to other formats."""

from __future__ import annotations

import contextlib
import importlib.util
import itertools
import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from ambulo.checkpoint import Run
from ambulo.cli.from_motion import data_folder
from ambulo.cli.stopping import STOPPED, held_back
from ambulo.data import Dataset, open_dataset, windows
from ambulo.export import check_exportable, checked, parity
from ambulo.files import write_atomic
from ambulo.loading import load_model
from ambulo.presets import PRESETS, Settings, load_settings, plain

if TYPE_CHECKING:
    from ambulo import train as training

# Rows of the data set on which a trained network and the runtime are compared.
PARITY_ROWS = 1024


@click.command()
@click.argument("folder", metavar="DATASET", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", required=True, type=click.Path(dir_okay=False, path_type=Path),
    help="The model to write (.safetensors).",
)  # fmt: skip
@click.option(
    "--preset", default="default", show_default=True, type=click.Choice(list(PRESETS)),
    help="What to learn and how.",
)  # fmt: skip
@click.option(
    "--config", type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="TOML file with settings that replace the preset's.",
)  # fmt: skip
@click.option("--steps", type=int, help="Length of the training, in batches.")
@click.option("--seed", type=int, help="Of everything random.")
@click.option(
    "--run", "run_folder", type=click.Path(file_okay=False, path_type=Path),
    help="Folder for checkpoints and curve. Default: OUTPUT with .run for its suffix.",
)  # fmt: skip
@click.option("--resume", is_flag=True, help="Go on from the run's last checkpoint.")
@click.option("--overwrite", is_flag=True, help="Replace OUTPUT and its run if they exist.")
@click.option("--dry-run", is_flag=True, help="Check everything, say the plan, write nothing.")
@click.option("--json", "as_json", is_flag=True, help="Print the report as JSON.")
@click.option(
    "--tensorboard", type=click.Path(file_okay=False, path_type=Path),
    help="Also write the curve here for TensorBoard (needs tensorboardX).",
)  # fmt: skip
@click.option(
    "--distributed", metavar="HOST:PORT",
    help="Where process 0 of several listens. All see DATASET and OUTPUT's folder.",
)  # fmt: skip
@click.option("--processes", type=click.IntRange(1), help="How many processes there are.")
@click.option("--process", type=click.IntRange(0), help="Which one this is, from 0.")
@click.option("--licence", help="Of motion files, in words; the model carries it.")
def train(
    folder: Path,
    output: Path,
    preset: str,
    config: Path | None,
    steps: int | None,
    seed: int | None,
    run_folder: Path | None,
    resume: bool,
    overwrite: bool,
    dry_run: bool,
    as_json: bool,
    tensorboard: Path | None,
    distributed: str | None,
    processes: int | None,
    process: int | None,
    licence: str | None,
) -> None:
    """Train a controller on DATASET: a data set's folder, or a folder of motion files.

    Of motion files a data set is made first, beside OUTPUT, with .data for its suffix.

    The best weights by the validation clips become OUTPUT. Ctrl-C saves a checkpoint; --resume
    goes on from it, or from the last one before a crash, to the same result.

    \b
    Examples:
      ambulo train captures/ -o model.safetensors
      ambulo train data/ -o model.safetensors --preset quick --seed 3
      ambulo train data/ -o model.safetensors --resume
    """
    module = _jax_or_reason()
    run = Run(run_folder or output.with_suffix(".run"))
    settings = load_settings(preset, config, steps=steps, seed=seed)
    _check_places(output, run, resume=resume, overwrite=overwrite, dry_run=dry_run)
    _tensorboard_or_reason(tensorboard)
    _connect(module, distributed, processes, process)
    folder = data_folder(folder, output, licence, dry_run=dry_run, overwrite=overwrite)
    dataset = open_dataset(folder)
    check_exportable(dataset, settings.tuning)
    plan = _plan(module, dataset, settings)
    if dry_run:
        click.echo(json.dumps(plan, indent=2) if as_json else _said(plan))
        click.echo("dry run: nothing written", err=True)
        return
    first = not process
    if first:
        click.echo(_said(plan), err=True)
    logs = tensorboard if first else None
    with (
        _showing(plan["steps"], first) as show,
        _tensorboard(logs) as log,
        held_back() as asked_to_stop,
    ):
        result = module.train(
            dataset, settings, run, resume=resume, stop=asked_to_stop,
            watch=lambda progress: (show(progress), log(progress)),
        )  # fmt: skip
    for warning in result.warnings:
        click.echo(f"note: {warning}", err=True)
    if not result.finished:
        click.echo(f"stopped at step {result.step}; --resume goes on from there", err=True)
        raise click.exceptions.Exit(STOPPED)
    if first:
        _finish(module, dataset, settings, result, run, output, as_json)


def _finish(
    module: ModuleType, dataset: Dataset, settings: Settings, result: training.Result, run: Run,
    output: Path, as_json: bool,
) -> None:  # fmt: skip
    split = "validation" if dataset.rows("validation") else "training"
    rows = windows(dataset, split, 1, PARITY_ROWS)[:, 0]
    provenance = module.provenance(dataset, settings, result)
    model = checked(result.params, result.scale, dataset, provenance, rows, settings.tuning)
    model.save(output)
    report = {
        "output": str(output),
        "run": str(run.folder),
        "steps": result.step,
        "best_step": result.best_step,
        **result.measures,
        "seconds": result.seconds,
        "samples_per_s": result.samples_per_second,
        "parity": parity(model, result.params, rows, dataset),
        "licence": dataset.licence,
    }
    if as_json:
        click.echo(json.dumps(report, indent=2))
        return
    for key, value in report.items():
        click.echo(f"{key:>24}  {value:.4g}" if isinstance(value, float) else f"{key:>24}  {value}")


def _jax_or_reason() -> ModuleType:
    if importlib.util.find_spec("jax") is None or importlib.util.find_spec("optax") is None:
        raise click.ClickException("training needs JAX and optax: pip install 'ambulo[train]'")
    from ambulo import train as module

    return module


def _connect(
    module: ModuleType, where: str | None, processes: int | None, process: int | None
) -> None:
    if where is None:
        if processes is not None or process is not None:
            raise click.UsageError("--processes and --process belong to --distributed")
        return
    if processes is None or process is None:
        raise click.UsageError("--distributed needs --processes and --process")
    if process >= processes:
        raise click.UsageError(f"--process {process} is not below --processes {processes}")
    module.connect(where, processes, process)


def _check_places(output: Path, run: Run, *, resume: bool, overwrite: bool, dry_run: bool) -> None:
    if not output.parent.is_dir():
        raise click.ClickException(f"{output.parent} is not a folder")
    if resume and overwrite:
        raise click.UsageError("--resume goes on, --overwrite starts again: give one of them")
    if resume and not run.exists:
        raise click.ClickException(
            f"{run.folder} holds no run to go on with; without --resume one is started"
        )
    if resume or overwrite or dry_run:
        return
    if output.exists():
        raise click.ClickException(f"{output} exists; --overwrite replaces it")
    if run.exists:
        raise click.ClickException(
            f"{run.folder} holds a run; --resume goes on with it, --overwrite starts again"
        )


def _plan(module: ModuleType, dataset: Dataset, settings: Settings) -> dict[str, Any]:
    """What is about to happen."""
    nx, ny = dataset.widths
    widths = [nx, *settings.hidden, ny]
    pairs = itertools.pairwise(widths)
    missing = [name for name in settings.masked_joints if name not in dataset.joints]
    return {
        "dataset": str(dataset.folder),
        "layout": f"{dataset.layout['name']}, {len(dataset.joints)} joints",
        "rows": {split: dataset.rows(split) for split in ("training", "validation")},
        "widths": widths,
        "numbers": sum(4 * (a + 1) * b for a, b in pairs),
        "steps": module.total_steps(settings, dataset),
        "in_memory_mb": round(
            min(dataset.rows("training") * dataset.row_bytes / 2**20, settings.pool_mb), 1
        ),
        "masked_but_absent": missing,
        "licence": dataset.licence,
        "settings": plain(settings),
    }


def _said(plan: dict[str, Any]) -> str:
    rows = plan["rows"]
    lines = [
        f"{rows['training']} rows to learn, {rows['validation']} to judge by; {plan['layout']}",
        f"network {' → '.join(map(str, plan['widths']))}, {plan['numbers'] / 1e6:.2f} M numbers",
        f"{plan['steps']} steps; licence of the motion: {plan['licence']}",
    ]
    if plan["masked_but_absent"]:
        lines.append(f"masked joints that are not there: {', '.join(plan['masked_but_absent'])}")
    return "\n".join(lines)


# -- watching ---------------------------------------------------------------------------------

Watcher = Callable[["training.Progress"], Any]


@contextlib.contextmanager
def _showing(steps: int, first: bool) -> Iterator[Watcher]:
    """A bar on a terminal, a line a report elsewhere; both on standard error."""
    console = Console(stderr=True)
    if not first:
        yield lambda progress: None
        return
    if not console.is_terminal:
        yield _Lines(steps)
        return
    columns = [
        TextColumn("training"), BarColumn(), TextColumn("{task.percentage:>3.0f}%"),
        TextColumn("{task.fields[told]}"), TimeElapsedColumn(), TextColumn("left"),
        TimeRemainingColumn(),
    ]  # fmt: skip
    with Progress(*columns, console=console) as bar:
        task = bar.add_task("training", total=steps, told="compiling")
        told = ""

        def show(progress: training.Progress) -> None:
            nonlocal told
            told = _figures(progress.line) if progress.line else told
            speed = f"{progress.samples_per_second:,.0f} samples/s" if progress.step > 1 else ""
            bar.update(task, completed=progress.step, told=f"{speed} {told}")

        yield show


class _Lines:
    """Plain lines, for logs."""

    def __init__(self, steps: int) -> None:
        self.steps, self.began, self.first = steps, time.perf_counter(), None

    def __call__(self, progress: training.Progress) -> None:
        if self.first is None:
            self.first = progress.step - 1
        if progress.line is None:
            return
        done = progress.step - self.first
        left = (time.perf_counter() - self.began) / done * (self.steps - progress.step)
        click.echo(
            f"step {progress.step}/{self.steps}  {_figures(progress.line)}  "
            f"{progress.line['samples_per_s']:,.0f} samples/s  {left:.0f} s left",
            err=True,
        )


def _figures(line: dict[str, Any]) -> str:
    return (
        f"loss {line['loss']:.4f}, judged {line['one_step']:.4f}, "
        f"{line['one_step_cm']:.2f} cm a step, {line['loop_cm']:.2f} cm in the loop"
    )


def _tensorboard_or_reason(folder: Path | None) -> None:
    if folder is not None and importlib.util.find_spec("tensorboardX") is None:
        raise click.ClickException(
            "--tensorboard needs tensorboardX: pip install 'ambulo[tensorboard]'"
        )


@contextlib.contextmanager
def _tensorboard(folder: Path | None) -> Iterator[Watcher]:
    """Write every report's figures for TensorBoard."""
    if folder is None:
        yield lambda progress: None
        return
    from tensorboardX import SummaryWriter

    def write(progress: training.Progress) -> None:
        if progress.line is None:
            return
        for key, value in progress.line.items():
            if key != "step":
                writer.add_scalar(key, np.float64(value), progress.step)

    with SummaryWriter(str(folder)) as writer:
        yield write


# -- other formats ----------------------------------------------------------------------------


@click.group()
def export() -> None:
    """Write models in other formats."""


@export.command(name="onnx")
@click.argument("path", metavar="MODEL", type=click.Path(exists=True, path_type=Path))
@click.option(
    "-o", "--output", required=True, type=click.Path(dir_okay=False, path_type=Path),
    help="The file to write (.onnx).",
)  # fmt: skip
@click.option("--overwrite", is_flag=True, help="Replace OUTPUT if it exists.")
@click.option("--dry-run", is_flag=True, help="Make and check the graph, write nothing.")
@click.option("--json", "as_json", is_flag=True, help="Print the report as JSON.")
def export_onnx(path: Path, output: Path, overwrite: bool, dry_run: bool, as_json: bool) -> None:
    """Write MODEL as an ONNX graph, phase function and normalisation inside.

    Inputs are x (N, inputs), not normalised, and phase (N,) in radians; output is y (N, outputs).
    The file carries the licence, the layout and the rest of the model's header as metadata, and is
    compared with the model before it is written.

    \b
    Example:
      ambulo export onnx model.safetensors -o model.onnx
    """
    for name in ("onnx", "onnxruntime"):
        if importlib.util.find_spec(name) is None:
            raise click.ClickException(f"this needs {name}: pip install 'ambulo[onnx]'")
    from ambulo.export import checked_onnx

    if output.exists() and not (overwrite or dry_run):
        raise click.ClickException(f"{output} exists; --overwrite replaces it")
    model = load_model(path)
    content, off = checked_onnx(model)
    if not dry_run:
        write_atomic(output, content)
    report = {
        "output": None if dry_run else str(output),
        "bytes": len(content),
        "difference": off,
        "licence": model.header["licence"],
    }
    if as_json:
        click.echo(json.dumps(report, indent=2))
        return
    click.echo(f"largest difference from the model: {off:.1e} of a number or its deviation")
    click.echo(f"licence: {report['licence']}")
    click.echo("dry run: nothing written" if dry_run else f"wrote {output}")
