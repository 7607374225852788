"""Commands on motion files: look at them, convert them."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click

from ambulo import _core
from ambulo.cli.progress import bar
from ambulo.cli.stopping import STOPPED, held_back

SUFFIXES = {".bvh", ".amc", ".keys"}
EXISTS = "exists; --overwrite replaces it"
# A conversion run twice by mistake fails for every file; more lines than these tell no more.
ALIKE = 5
AXES = click.Choice(_core.motion_axes(), case_sensitive=False)


@click.group()
def motion() -> None:
    """Look at and convert motion files (BVH, AMC with its ASF, and keys)."""


@dataclass
class Outcome:
    """What became of one input file."""

    input: Path
    output: Path | None = None
    report: dict[str, Any] = field(default_factory=dict)
    error: str | None = None

    def as_dict(self) -> dict[str, Any]:
        """For JSON; what does not apply is left out."""
        named: dict[str, Any] = {"input": str(self.input)}
        if self.output is not None:
            named["output"] = str(self.output)
        if self.error is not None:
            named["error"] = self.error
        return named | self.report


@motion.command()
@click.argument("path", metavar="FILE|FOLDER", type=click.Path(exists=True, path_type=Path))
@click.option("--repair", is_flag=True, help="Mend what can be mended, and say what was done.")
@click.option("--json", "as_json", is_flag=True, help="Print as JSON, one entry a file.")
@click.pass_context
def info(ctx: click.Context, path: Path, repair: bool, as_json: bool) -> None:
    """Say what a motion file, or every one below a folder, holds.

    Axes, unit and a T-pose in the first frame are guesses from joint names and motion: nothing is
    changed by them. Exit code 1 if a file cannot be read.

    \b
    Examples:
      ambulo motion info walk.bvh
      ambulo motion info captures/ --json
    """
    inputs = list(motion_files(path))

    def look(outcome: Outcome) -> None:
        _, outcome.report = _core.read_motion(str(outcome.input), repair=repair)

    outcomes, stopped = _each([Outcome(file) for file in inputs], look, "reading")
    if as_json:
        _print_json(outcomes, single=path.is_file())
    else:
        for outcome in outcomes:
            click.echo(_described(outcome, path))
    _finish(ctx, outcomes, len(inputs), stopped)


@motion.command()
@click.argument("source", metavar="IN", type=click.Path(exists=True, path_type=Path))
@click.argument("target", metavar="OUT", type=click.Path(path_type=Path))
@click.option("--fps", type=click.FloatRange(min=1e-3, max=1e6), help="Resample to this rate.")
@click.option("--mirror", is_flag=True, help="Write the mirror image: left becomes right.")
@click.option("--axes", type=AXES, help="Convert to these axes and units.")
@click.option(
    "--from-axes", type=AXES,
    help="What the input is in. Default: what `info` guesses of each file, which is then named.",
)  # fmt: skip
@click.option(
    "--amc-fps", default=120.0, show_default=True, type=click.FloatRange(min=1e-3, max=1e6),
    help="Rate of AMC files, which store none.",
)  # fmt: skip
@click.option("--repair", is_flag=True, help="Mend what can be mended, and say what was done.")
@click.option("--json", "as_json", is_flag=True, help="Print what was done as JSON.")
@click.option("--dry-run", is_flag=True, help="Read and convert everything, write nothing.")
@click.option(
    "--overwrite/--no-overwrite", default=False, show_default=True,
    help="Replace files that exist. An input is never replaced.",
)  # fmt: skip
@click.pass_context
def convert(
    ctx: click.Context,
    source: Path,
    target: Path,
    fps: float | None,
    mirror: bool,
    axes: str | None,
    from_axes: str | None,
    amc_fps: float,
    repair: bool,
    as_json: bool,
    dry_run: bool,
    overwrite: bool,
) -> None:
    """Convert IN, a file or a folder with all below it, to BVH at OUT.

    A folder's tree is kept. A file that fails does not stop the others: it is named at the end,
    and the exit code is 1. Files appear whole or not at all. Ctrl-C stops after the file at hand.
    Channels and their order stay those of the input.

    \b
    Examples:
      ambulo motion convert 02_01.amc walk.bvh
      ambulo motion convert walk.bvh unity/walk.bvh --from-axes cm --axes unity
      ambulo motion convert captures/ mirrored/ --fps 60 --mirror --dry-run
    """
    planned = _planned(source, target)
    taken = _Taken([outcome.input for outcome in planned], overwrite)

    def work(outcome: Outcome) -> None:
        output = taken.check(outcome.output)
        clip, report = _core.read_motion(str(outcome.input), repair=repair, fps=amc_fps)
        outcome.report = {"notes": report["notes"]}
        if mirror:
            clip = clip.mirrored(axes=from_axes or "ambulo")
        if axes:
            source_axes = from_axes or _guessed(report, outcome)
            clip = clip.converted(source_axes, axes)
            outcome.report |= {"from_axes": source_axes, "axes": axes}
        if fps is not None:
            clip = clip.resampled(fps)
        outcome.report |= {"frames": clip.frames, "fps": clip.fps, "joints": len(clip.names)}
        if not dry_run:
            output.parent.mkdir(parents=True, exist_ok=True)
            outcome.report["notes"] += _core.write_motion(str(output), clip)

    outcomes, stopped = _each(planned, work, "converting")
    if as_json:
        _print_json(outcomes, single=source.is_file())
    else:
        for outcome in outcomes:
            if outcome.error is None:
                _say(outcome, "would write" if dry_run else "wrote")
    _finish(ctx, outcomes, len(planned), stopped)


# -- files ------------------------------------------------------------------------------------


def motion_files(path: Path) -> Iterator[Path]:
    """Give the file itself, or every motion file below the folder, in order."""
    if path.is_file():
        yield path
        return
    _refuse_special(path)
    files = [p for p in path.rglob("*") if p.suffix.lower() in SUFFIXES and p.is_file()]
    if not files:
        raise click.UsageError(f"no .bvh, .amc or .keys file below {path}")
    yield from sorted(files)


def _refuse_special(path: Path) -> None:
    """Pipes and devices may never end, so they are not read."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise click.UsageError(f"{path}: not a regular file")


def _planned(source: Path, target: Path) -> list[Outcome]:
    """Pair every input with its output."""
    if source.is_dir():
        if target.is_file():
            raise click.UsageError(f"{source} is a folder, but {target} is a file")
        files = motion_files(source)
        return [Outcome(f, (target / f.relative_to(source)).with_suffix(".bvh")) for f in files]
    _refuse_special(source)
    if target.is_dir():
        target = target / f"{source.stem}.bvh"
    if target.suffix.lower() != ".bvh":
        raise click.UsageError(f"{target}: only .bvh can be written")
    return [Outcome(source, target)]


class _Taken:
    """Outputs that must not be written."""

    def __init__(self, inputs: list[Path], overwrite: bool) -> None:
        self.inputs = {_identity(path): path for path in inputs if path.exists()}
        self.outputs: set[Path] = set()
        self.overwrite = overwrite

    def check(self, output: Path | None) -> Path:
        """Give the output's real path if it may be written.

        Resolved first: `new/../a.bvh` does not exist before `new` does, and is `a.bvh` after.
        """
        assert output is not None
        real = output.resolve()
        if real.exists():
            if _identity(real) in self.inputs:
                raise ValueError(f"{output} is an input: it is not written over")
            if real not in self.outputs and not self.overwrite:
                raise ValueError(f"{output} {EXISTS}")
        if real in self.outputs:
            raise ValueError(f"{output} is the output of another input too")
        self.outputs.add(real)
        return real


def _identity(path: Path) -> tuple[int, int]:
    """Tell one file from another, whatever its names."""
    status = path.stat()
    return status.st_dev, status.st_ino


def _guessed(report: dict[str, Any], outcome: Outcome) -> str:
    """What a file's format says it is in, or what it seems to be in; a note says the latter."""
    if report["axes"]:
        return str(report["axes"])
    guess = report["detected"]["axes"]
    if not guess:
        raise ValueError(f"{outcome.input}: its axes and unit cannot be told; name --from-axes")
    outcome.report["notes"].append(f"taken for {guess}; --from-axes says otherwise")
    return guess


# -- running and telling ----------------------------------------------------------------------


def _each(
    outcomes: list[Outcome], work: Callable[[Outcome], None], title: str
) -> tuple[list[Outcome], bool]:
    """Do the work for every file; what fails is kept as that file's error.

    Gives the outcomes of the files that were come to, at least one, and whether Ctrl-C was pressed.
    """
    with held_back() as stop, bar(title, len(outcomes), "files") as progress:
        for done, outcome in enumerate(outcomes):
            progress(done)
            try:
                work(outcome)
            except (ValueError, OSError) as error:
                outcome.error = str(error)
            if stop():
                return outcomes[: done + 1], True
    return outcomes, False


def _print_json(outcomes: list[Outcome], single: bool) -> None:
    entries = [outcome.as_dict() for outcome in outcomes]
    click.echo(json.dumps(entries[0] if single else entries, indent=2))


def _say(outcome: Outcome, verb: str) -> None:
    report = outcome.report
    click.echo(f"{verb} {outcome.output} ({report['frames']} frames at {report['fps']:g} fps)")
    for note in report["notes"]:
        click.echo(f"  note: {note}")


def _described(outcome: Outcome, path: Path) -> str:
    """Tell of a file in a few lines."""
    name = outcome.input.name if path.is_file() else outcome.input.relative_to(path)
    if outcome.error is not None:
        return f"{name}: cannot be read"
    report, seen = outcome.report, outcome.report["detected"]
    lines = [
        f"{name}: {report['frames']} frames at {report['fps']:g} fps ({report['seconds']:.2f} s), "
        f"{report['joints']} joints"
    ]
    guesses = [f"axes like {seen['axes']}"] if seen["axes"] else []
    for what in ("up", "forward"):
        if seen[what]:
            guesses.append(f"{what} {seen[what]} in {seen[f'{what}_share']:.0%} of frames")
    if seen["metres_per_unit"]:
        guesses.append(f"unit {seen['metres_per_unit']:g} m")
    if seen["t_pose_first_frame"]:
        guesses.append("frame 0 is a T-pose")
    if seen["positions"] in ("add", "unclear"):
        guesses.append(f"position channels: {seen['positions']}")
    if guesses:
        lines.append(f"  seems: {', '.join(guesses)}")
    lines += [
        f"  phase {name}: {start:g} to {end:g} s{', loops' if loops else ''}"
        for name, start, end, loops in report.get("phases", [])
    ]
    lines += [f"  event {name}: {time:g} s" for name, time in report.get("events", [])]
    lines += [f"  note: {note}" for note in [*report["notes"], *seen["notes"]]]
    return "\n".join(lines)


def _finish(ctx: click.Context, outcomes: list[Outcome], total: int, stopped: bool) -> None:
    """Name what failed; exit code 1 if anything did, 130 after Ctrl-C."""
    failed = [(outcome.input, outcome.error) for outcome in outcomes if outcome.error is not None]
    alike = len(failed) == len(outcomes) and all(error.endswith(EXISTS) for _, error in failed)
    shown = failed[:ALIKE] if alike else failed
    for path, error in shown:
        where = "" if str(path) in error else f"{path}: "
        click.echo(f"Error: {where}{error}", err=True)
    if len(shown) < len(failed):
        click.echo(f"… and {len(failed) - len(shown)} more", err=True)
    if failed and total > 1:
        click.echo(f"{len(failed)} of {len(outcomes)} files failed", err=True)
    if stopped:
        click.echo(f"stopped after {len(outcomes)} of {total} files", err=True)
        ctx.exit(STOPPED)
    if failed:
        ctx.exit(1)
