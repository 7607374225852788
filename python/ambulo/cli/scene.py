"""Commands for scenes: play them, check their files, add to them."""

from __future__ import annotations

import json
import platform
import shutil
import time
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.table import Table

from ambulo import _core
from ambulo.cli.progress import bar
from ambulo.cli.stopping import STOPPED
from ambulo.evaluate.adding import NSM, SOURCE, add_interactions
from ambulo.evaluate.visit_outputs import Reel, reels, write_film, write_plan, write_strip
from ambulo.evaluate.visits import summarise, weights_hash
from ambulo.executors import default_threads
from ambulo.files import write_atomic
from ambulo.loading import load_model
from ambulo.model import Model
from ambulo.scene import (
    Problem,
    SceneError,
    SceneFiles,
    Visited,
    begin_visit,
    check_file,
    load_scene,
    load_script,
    run_visit,
    visit_seeds,
)
from ambulo.scene_recording import SceneRecording
from ambulo.starters import FOLDER, starter_model, starter_scene

# Films of a few minutes' visit take about a minute.
SIZE, FPS = (480, 270), 10
WHOLE_SIZE, WHOLE_FPS = (320, 180), 5


@click.group()
def scene() -> None:
    """Play scenes in which a character uses what is around it, and check their files."""


# -- check --------------------------------------------------------------------------------------


@scene.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True,
                type=click.Path(path_type=Path))  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="Print as JSON, problems included.")
@click.pass_context
def check(ctx: click.Context, files: tuple[Path, ...], as_json: bool) -> None:
    """Say whether each FILE is a scene, an interaction or a script, and if not, where and why.

    Of a scene, the interactions and clips that it names are looked at, too. Every problem comes
    with file, line and path; exit 1 if there is any.

    \b
    Examples:
      ambulo scene check my_scene.toml
      ambulo scene check interactions/*.toml scenes/*.toml --json
    """
    found: list[dict[str, Any]] = []
    for file in files:
        problems: list[Problem] = []
        facts: dict[str, Any] = {}
        try:
            facts = check_file(file)
        except SceneError as error:
            problems = error.problems
        except OSError as error:
            # Those after it are still looked at.
            problems = [Problem(str(file), "$", error.strerror or str(error))]
        row = {"file": str(file), "good": not problems, **facts}
        found.append(row | ({"problems": [vars(one) for one in problems]} if problems else {}))
        if not as_json:
            for problem in problems:
                click.echo(str(problem))
            if facts:
                click.echo(f"{file}: good; {_facts(facts)}")
    if as_json:
        click.echo(json.dumps(found, indent=2))
    if not all(row["good"] for row in found):
        ctx.exit(1)


def _facts(facts: dict[str, Any]) -> str:
    kind = {"scene": "a scene", "interaction": "an interaction", "script": "a script"}
    words = [f"{kind[facts['kind']]}, '{facts['name']}'"]
    if "object" in facts:
        words.append(f"for a {facts['object']}")
    words += [f"{facts[key]} {key}" for key in ("objects", "interactions", "tasks") if key in facts]
    return ", ".join(words)


# -- run ----------------------------------------------------------------------------------------


@scene.command()
@click.argument("file", metavar="[SCENE]", required=False,
                type=click.Path(exists=True, dir_okay=False, path_type=Path))  # fmt: skip
@click.option(
    "--script", type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="What is done. Default: STEM-visit.toml beside the scene.",
)  # fmt: skip
@click.option(
    "-o", "--output", required=True, metavar="DIR",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder for figures, pictures and films.",
)  # fmt: skip
@click.option(
    "--model", "model_path", metavar="MODEL", type=click.Path(exists=True, path_type=Path),
    help="Who does it. Default: the starter model.",
)  # fmt: skip
@click.option(
    "--seed", type=click.IntRange(0, 2**64 - 1),
    help="0, the default, plays the script as it stands; others start a little elsewhere and break "
    "things off at random.",
)  # fmt: skip
@click.option(
    "--seeds", metavar="N", type=click.IntRange(1, 100_000),
    help="Measure the seeds 1 to N, too; films and pictures are those of seed 0.",
)  # fmt: skip
@click.option("--threads", type=click.IntRange(1), help="For --seeds. Default: all processors.")
@click.option(
    "--film", default="gif", show_default=True, type=click.Choice(["gif", "mp4", "none"]),
    help="A short film of each kind of interaction; mp4 needs ffmpeg on the PATH.",
)  # fmt: skip
@click.option("--no-film", is_flag=True, help="The same as --film none.")
@click.option(
    "--every", is_flag=True, help="A film of every interaction, not of the first of a kind."
)
@click.option(
    "--whole", is_flag=True,
    help="One film of the whole visit instead: 320x180, 5 pictures a second if not said otherwise.",
)  # fmt: skip
@click.option(
    "--film-from", metavar="S", type=click.FloatRange(0.0),
    help="Film only this part of the visit: from this second …",
)  # fmt: skip
@click.option(
    "--film-to", metavar="S", type=click.FloatRange(0.0, min_open=True), help="… to this one."
)
@click.option(
    "--size", metavar="WxH", help="Of films, pixels, 64 to 4096 a side. Default: 480x270."
)
@click.option(
    "--fps", type=click.IntRange(1, 100),
    help="Pictures a second of films; for a GIF a divisor of 100. Default: 10.",
)  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="Print the report as JSON.")
@click.option("--dry-run", is_flag=True, help="Read and check everything, write nothing.")
@click.option("--overwrite", is_flag=True, help="Replace what an earlier visit left in DIR.")
def run(
    file: Path | None,
    script: Path | None,
    output: Path,
    model_path: Path | None,
    seed: int | None,
    seeds: int | None,
    threads: int | None,
    film: str,
    no_film: bool,
    every: bool,
    whole: bool,
    film_from: float | None,
    film_to: float | None,
    size: str | None,
    fps: int | None,
    as_json: bool,
    dry_run: bool,
    overwrite: bool,
) -> None:
    """Play a script in SCENE, the playground by default: measure it, draw it, film it.

    Writes visit.json (measures, events, hashes of the model's weights before and after), plan.png
    (from above), strip.png (a moment of each interaction) and films. Figures come first: Ctrl-C
    while filming keeps them and the films that are finished.

    \b
    Examples:
      ambulo scene run -o out/visit
      ambulo scene run my_scene.toml --script my_script.toml -o out/mine --model model.safetensors
      ambulo scene run -o out/seeds --seeds 20 --no-film --json
      ambulo scene run -o out/door --film-from 60 --film-to 70 --size 960x540 --fps 25
    """
    if seed is not None and seeds is not None:
        raise click.UsageError("--seed plays one visit, --seeds 0 to N: name one of them")
    film = "none" if no_film else film
    part = film_from is not None or film_to is not None
    if whole + part + every > 1:
        raise click.UsageError("--every, --whole and --film-from/--film-to: name one of them")
    if film_from is not None and film_to is not None and film_from >= film_to:
        raise click.UsageError("--film-from must come before --film-to")
    usual = (WHOLE_SIZE, WHOLE_FPS) if whole else (SIZE, FPS)
    pixels, rate = _size(size) if size else usual[0], fps or usual[1]
    if film == "gif" and 100 % rate:
        raise click.UsageError(f"--fps {rate}: a GIF needs a divisor of 100; --film mp4 does not")
    if film == "mp4" and not shutil.which("ffmpeg"):
        raise click.ClickException("--film mp4 needs ffmpeg on the PATH; --film gif does without")
    if (output / "visit.json").exists() and not overwrite:
        raise click.ClickException(f"{output} holds a visit; --overwrite replaces it")
    file = file or starter_scene()
    script = script or _usual_script(file)
    model_path = model_path or starter_model()
    model = load_model(model_path)
    files = load_scene(file)
    text = load_script(script, files)
    before = weights_hash(model)
    begin_visit(model, files, text, seed or 0)  # whether it can begin
    if dry_run:
        _say_plan(file, script, model_path, files, text, seed, seeds, film, output)
        return
    recording, visits, took = _play(model, files, text, seed or 0, seeds, threads)
    report = {
        "scene": str(file),
        "script": str(script),
        "model": str(model_path),
        "licence": model.header["licence"],
        "inputs": model.inputs,
        "weights": {"sha256_before": before, "sha256_after": weights_hash(model)},
        "versions": {"ambulo": version("ambulo"), "python": platform.python_version()},
        "wall_s": took,
        "summary": summarise(visits),
        "visits": visits,
        "files": [],
    }
    _clear(output, overwrite)
    output.mkdir(parents=True, exist_ok=True)
    if whole or part:
        stop = min(film_to or recording.duration, recording.duration)
        if film_from is not None and film_from >= stop:
            raise click.ClickException(
                f"--film-from {film_from}: the visit is over after {recording.duration:.1f} s"
            )
        planned = [Reel(f"film.{film}", _name(files), film_from or 0.0, stop)]
    else:
        planned = reels(visits[0], film, recording.duration, every=every)
    try:
        _note(output, report)
        _draw(output, recording, report, [] if film == "none" else planned, pixels, rate)
    except KeyboardInterrupt:
        click.echo("stopped while drawing; what is finished is kept", err=True)
        _print(report, output, as_json)
        raise click.exceptions.Exit(STOPPED) from None
    _print(report, output, as_json)


def _name(files: SceneFiles) -> str:
    return str(json.loads(_core.read_scene(files.scene))["name"])


def _size(size: str) -> tuple[int, int]:
    try:
        width, height = (int(side) for side in size.split("x"))
    except ValueError:
        raise click.UsageError(f"--size {size}: expected WxH, as 640x360") from None
    if not (64 <= width <= 4096 and 64 <= height <= 4096):
        raise click.UsageError(f"--size {size}: 64 to 4096 a side")
    return width, height


def _usual_script(file: Path) -> Path:
    path = file.with_name(f"{file.stem}-visit.toml")
    if not path.is_file():
        raise click.UsageError(f"{path} is not there: --script says what to do in {file}")
    return path


def _play(
    model: Model, files: SceneFiles, script: str, seed: int, seeds: int | None, threads: int | None
) -> tuple[SceneRecording, list[Visited], float]:
    started = time.perf_counter()
    with bar("visiting", 100.0, "%") as progress:
        recording, visited = run_visit(
            model, files, script, seed, progress=lambda share: progress(100.0 * share)
        )
    visits = [visited]
    if seeds is not None:
        with bar("visiting", seeds, "seeds") as progress:
            visits += visit_seeds(
                model, files, script, range(1, seeds + 1),
                threads=threads or default_threads(), progress=progress,
            )  # fmt: skip
    return recording, visits, time.perf_counter() - started


def _clear(output: Path, overwrite: bool) -> None:
    """What an earlier visit wrote goes: its films may have other names."""
    if not (overwrite and (output / "visit.json").exists()):
        return
    try:
        old = json.loads((output / "visit.json").read_text(encoding="utf-8"))["files"]
    except (ValueError, KeyError, TypeError):
        old = []
    for name in old:
        if isinstance(name, str) and Path(name).name == name:
            (output / name).unlink(missing_ok=True)
    (output / "visit.json").unlink(missing_ok=True)


def _note(output: Path, report: dict[str, Any], file: Path | None = None) -> None:
    """Writes the report; its list of files names what is there at this moment."""
    if file is not None:
        report["files"].append(file.name)
    write_atomic(output / "visit.json", json.dumps(report, indent=2) + "\n")


def _draw(
    output: Path, recording: SceneRecording, report: dict[str, Any], planned: Sequence[Reel],
    size: tuple[int, int], fps: int,
) -> None:  # fmt: skip
    visit = report["visits"][0]
    title = f"{Path(report['script']).stem}, seed {visit['seed']}"
    _note(output, report, write_plan(output / "plan.png", recording, visit, title))
    strip = write_strip(output / "strip.png", recording, visit, title)
    if strip is not None:
        _note(output, report, strip)
    total, done = sum(reel.pictures(fps) for reel in planned), 0
    if not planned:
        return
    with bar("filming", total, "pictures") as progress:
        for reel in planned:
            path = write_film(
                output / reel.file, recording, reel, size=size, fps=fps,
                progress=lambda count, before=done: progress(before + count),
            )  # fmt: skip
            _note(output, report, path)
            done += reel.pictures(fps)


def _say_plan(
    file: Path, script: Path, model: Path, files: SceneFiles, text: str, seed: int | None,
    seeds: int | None, film: str, output: Path,
) -> None:  # fmt: skip
    tasks = json.loads(_core.read_script(text))["do"]
    click.echo(f"{file}: good; {len(files.interactions)} interactions, {len(files.clips)} clips")
    click.echo(f"{script}: good; {len(tasks)} tasks, {sum('use' in t for t in tasks)} of them uses")
    click.echo(f"{model}: can play it")
    played = f"seed {seed or 0}" if seeds is None else f"seeds 0 to {seeds}"
    films = "no films" if film == "none" else f"films ({film})"
    click.echo(f"dry run: would play {played} and write figures, pictures and {films} to {output}")


def _print(report: dict[str, Any], output: Path, as_json: bool) -> None:
    if as_json:
        click.echo(json.dumps(report, indent=2))
        return
    visits, several = report["visits"], len(report["visits"]) > 1
    first = visits[0]["measured"]
    table = Table(title=f"{Path(report['script']).stem}: {first['seconds']:.0f} s")
    table.add_column("measure", no_wrap=True)
    columns = [f"seed {visits[0]['seed']}"] + (["mean", "worst"] if several else [])
    for name in (*columns, "target"):
        table.add_column(name, justify="right")
    table.add_column("met")
    places: list[str] = []
    for row in report["summary"]:
        values = [row["first"]] + ([row["mean"], row["worst"]] if several else [])
        shown = [_number(value, row["unit"]) for value in values]
        met = "–" if row["met"] is None else "✓" if row["met"] else "✗"
        target = f"≤ {row['target']:g} {row['unit']}".rstrip()
        where = row["where"] or ""
        if several and row["worst"] and row["worst"] > 0.0:
            where = f"seed {row['worst_seed']}: {where}".removesuffix(": ")
        table.add_row(row["measure"], *shown, target, met)
        if where:
            places.append(f"  {row['measure']}: {where}")
    Console(soft_wrap=False).print(table)
    for line in ["worst", *places] if places else []:
        click.echo(line)
    ended = sum(visit["measured"]["ended"] for visit in visits)
    broken = sum(visit["measured"]["broken"] for visit in visits)
    click.echo(f"{ended} interactions played to their end, {broken} broken off or given up")
    weights = report["weights"]
    same = weights["sha256_before"] == weights["sha256_after"]
    click.echo(
        f"weights: SHA-256 {weights['sha256_before'][:16]}… before and after: no weight changed"
        if same else "the model's weights changed: this must not be"
    )  # fmt: skip
    for name in ["visit.json", *report["files"]]:
        click.echo(f"wrote {output / name}")


def _number(value: float | None, unit: str) -> str:
    if value is None:
        return "–"
    return f"{value:.0f}" if not unit else f"{value:.3f}"


# -- table --------------------------------------------------------------------------------------


@scene.command()
@click.option(
    "--model", "model_path", metavar="MODEL", type=click.Path(exists=True, path_type=Path),
    help="Who is given interactions. Default: the starter model.",
)  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
def table(model_path: Path | None, as_json: bool) -> None:
    """Add four interactions one by one to a character that has none, and say what it took.

    Each time the scene is played to its end. The rows beside ours are published ones.

    \b
    Example:
      ambulo scene table
    """
    starter_scene()  # says so where nothing ships
    model_path = model_path or starter_model()
    with bar("adding", len(NSM), "interactions") as progress:
        rows = add_interactions(load_model(model_path), FOLDER, progress)
    if as_json:
        click.echo(json.dumps({"model": str(model_path), "source": SOURCE, "rows": rows}, indent=2))
        return
    _print_table(rows)


def _print_table(rows: Sequence[dict[str, Any]]) -> None:
    shown = Table(title="What an interaction more takes")
    for name in ("", "added", "file B", "clip B", "load ms", "played"):
        shown.add_column(name, justify="left" if name == "added" else "right")
    for row in rows:
        shown.add_row(
            str(row["interactions"]), Path(row["file"]).stem, str(row["file_bytes"]),
            str(row["clip_bytes"]), f"{1e3 * row['seconds_to_load']:.1f}",
            f"{row['played']} of {row['interactions']}",
        )  # fmt: skip
    beside = Table(title="beside what is published: clips, re-training, input features")
    beside.add_column("", justify="right")
    for whose in ("ours", "Neuranimation ¹", "NSM ¹"):
        beside.add_column(whose)
    for row in rows:
        changed = row["weights_before"] != row["weights_after"]
        ours = {"clips": row["clips"], "retraining": changed, "inputs": str(row["inputs_after"])}
        cells = [
            f"{whose['clips']}, {'yes' if whose['retraining'] else 'no'}, {whose['inputs']}"
            for whose in (ours, row["neuranimation"], row["nsm"])
        ]
        beside.add_row(str(row["interactions"]), *cells)
    console = Console(soft_wrap=False)
    console.print(shown)
    console.print(beside)
    click.echo(f"¹ as published: {SOURCE}")
    first, last = rows[0], rows[-1]
    click.echo(
        f"inputs {first['inputs_before']} before, {last['inputs_after']} after; weights "
        f"{first['weights_before'][:16]}… before, {last['weights_after'][:16]}… after"
    )
