"""The command that shows what was evolved, and judges it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click
import numpy as np

from ambulo._core import Arena, Creature, creature_tasks
from ambulo.cli.progress import bar
from ambulo.creature import (
    SavedController,
    description,
    load_controller,
    load_creature,
    recorded,
)
from ambulo.evolution import population_of
from ambulo.executors import default_threads
from ambulo.files import write_atomic
from ambulo.pictures.creature import write_creature_film, write_training_picture
from ambulo.pictures.replay import gait_picture, strip_picture
from ambulo.rollout import Rollout

TASKS = [task["name"] for task in creature_tasks()]
STEPS = 2000


@click.command()
@click.argument("source", metavar="RUN|CONTROLLER", type=click.Path(exists=True, path_type=Path))
@click.option(
    "-o", "--output", required=True, metavar="DIR",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder for film, pictures and judgement; what is in it of an earlier replay is replaced.",
)  # fmt: skip
@click.option(
    "--steps", default=STEPS, show_default=True, type=click.IntRange(8, 10**6),
    help="How long it is looked at.",
)  # fmt: skip
@click.option(
    "--creature", metavar="FILE",
    help="Another creature than the one it was made for; its joints and sensors must be as many.",
)  # fmt: skip
@click.option(
    "--task", type=click.Choice(TASKS), help="Judge it as this. Default: what it was evolved for."
)
@click.option(
    "--solver", type=click.Choice(["lockstep", "box2d"]),
    help="Play it in another solver than the one it was evolved in, and say how far it gets there.",
)  # fmt: skip
@click.option(
    "--film", default="gif", show_default=True, type=click.Choice(["gif", "mp4", "none"]),
    help="MP4 needs ffmpeg.",
)  # fmt: skip
@click.option(
    "--seconds", default=12.0, show_default=True, type=click.FloatRange(0.1, 3600.0),
    help="Length of the film, from the start.",
)  # fmt: skip
@click.option(
    "--population", is_flag=True,
    help="Also draw all of a run's newest generation at the end of their episode.",
)  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="Print the judgement as JSON.")
def replay(
    source: Path,
    output: Path,
    steps: int,
    creature: str | None,
    task: str | None,
    solver: str | None,
    film: str,
    seconds: float,
    population: bool,
    as_json: bool,
) -> None:
    """Play a run's champion, or any controller, and say whether its motion can be used.

    Writes film.gif, gait.png (which foot is down when), strip.png and judgement.json. The episode
    that was evolved is played, too: its fitness must come out the same to the last bit.

    \b
    Examples:
      ambulo replay out/tetrapod -o out/tetrapod/replay
      ambulo replay out/tetrapod -o look --population --film none
      ambulo replay out/tetrapod -o box2d --solver box2d
      ambulo replay out/tetrapod/best.safetensors -o look --creature heavier.json --film none --json
    """
    if population and not source.is_dir():
        raise click.UsageError("--population needs a run's folder, not a controller")
    saved = load_controller(source)
    body = saved.creature if creature is None else load_creature(creature)
    settings = dict(saved.settings)
    settings["task"] = _task(saved, task)
    evolved_in = _arena(body, settings, saved)
    settings["world"] = {**settings.get("world", {}), **({"solver": solver} if solver else {})}
    arena = _arena(body, settings, saved)
    elsewhere = evolved_in.settings() != arena.settings()
    fitness = _fitness(arena, saved, body, elsewhere)
    rollout, judgement = recorded(arena, body, saved.genome, steps)
    if elsewhere:
        _, at_home = recorded(evolved_in, body, saved.genome, steps)
        fitness["distance_at_home"] = at_home["distance"]
    robustness = json.loads(arena.robustness(saved.genome[None], default_threads()))[0]
    report = {
        "creature": body.facts()["name"],
        "task": settings["task"]["name"],
        "same_creature": body.hash == saved.creature.hash,
        "solver": json.loads(arena.settings())["world"]["solver"],
        **fitness,
        **judgement,
        "robustness": robustness,
    }
    output.mkdir(parents=True, exist_ok=True)
    files = _pictures(output, rollout, report, film, seconds)
    if population:
        files.append(_population(output / "population.png", source, saved))
    report["files"] = [str(file) for file in files]
    write_atomic(output / "judgement.json", json.dumps(report, indent=2) + "\n")
    if as_json:
        click.echo(json.dumps(report, indent=2))
    else:
        _say(report, output)


def _task(saved: SavedController, task: str | None) -> dict[str, Any]:
    """Settings of the task: as it was evolved, or another task with its own defaults."""
    evolved = saved.settings.get("task")
    if task is not None and (evolved is None or evolved["name"] != task):
        return {"name": task}
    if evolved is None:
        raise click.ClickException(
            "this controller does not say what it was evolved for; --task judges it"
        )
    return evolved


def _arena(body: Creature, settings: dict[str, Any], saved: SavedController) -> Arena:
    arena = Arena(body, json.dumps(settings))
    grows = json.loads(arena.settings())["controller"]["kind"] == "graph"
    if arena.genes != len(saved.genome) and not grows:
        raise click.ClickException(
            f"{body.facts()['name']} needs a controller of {arena.genes} numbers, this one has "
            f"{len(saved.genome)}: joints and sensors must be as many as "
            f"{saved.creature.facts()['name']} has"
        )
    return arena


def _fitness(
    arena: Arena, saved: SavedController, body: Creature, elsewhere: bool
) -> dict[str, Any]:
    """Fitness of the episode that was evolved, beside what was noted then.

    `elsewhere`: the arena is not the one that it was evolved in.
    """
    fitness, terms = arena.score(saved.genome)
    noted = saved.record.get("fitness_hex")
    before = None if noted is None else float.fromhex(noted)
    evolved = (
        saved.settings.get("task", {}).get("name") == json.loads(arena.settings())["task"]["name"]
    )
    same = body.hash == saved.creature.hash and evolved and not elsewhere
    if before is not None and same and fitness != before:
        raise RuntimeError(
            f"the replay reached {fitness!r}, but {before!r} is noted: the file was changed, or "
            "this machine computes differently"
        )
    return {"fitness": fitness, "recorded_fitness": before, "terms": terms}


def _pictures(
    output: Path, rollout: Rollout, report: dict[str, Any], film: str, seconds: float
) -> list[Path]:
    task = report["task"]
    title = f"{report['creature']}, {task}"
    written = [
        strip_picture(output / "strip.png", rollout, report, task, title),
        gait_picture(output / "gait.png", rollout, report, task, title),
    ]
    if film != "none":
        stop = min(rollout.steps, round(seconds / rollout.dt))
        with bar("filming", 1.0, "") as progress:
            written.append(
                write_creature_film(
                    output / f"film.{film}", rollout, title=title, stop=stop,
                    progress=lambda done, total: progress(done / total),
                )
            )  # fmt: skip
    return written


def _population(path: Path, run: Path, saved: SavedController) -> Path:
    """Everyone of the run's newest generation, half-transparent, where its episode ends."""
    generation, arena, genomes = population_of(run)
    recordings = []
    with bar("replaying", len(genomes), "individuals") as progress:
        for genome in genomes:
            recordings.append(arena.record(genome, arena.steps))
            progress(len(recordings))
    poses = np.stack([recording.poses()[-1] for recording in recordings])
    creatures = [description(arena.creature_of(genome)) for genome in genomes]
    fitness = arena.evaluate(genomes, default_threads())[:, 0]
    title = f"{saved.creature.facts()['name']}, generation {generation}"
    return write_training_picture(
        path, creatures, poses, fitness, recordings[0].ground(), title
    )  # fmt: skip


def _say(report: dict[str, Any], output: Path) -> None:
    shown = f"{report['creature']}, {report['task']}: "
    verdict = "usable" if report["usable"] else "not usable"
    if report["usable"] and report["robustness"]["robust"]:
        verdict = "good and robust" if report["good"] else "robust"
    click.echo(shown + verdict)
    for reason in report["reasons"]:
        click.echo(f"  {reason}")
    click.echo(f"fitness {report['fitness']:.3f}", nl=False)
    noted = report["recorded_fitness"]
    click.echo("" if noted is None else f", {noted:.3f} when it was evolved")
    figures = {
        "speed": (report["speed_bl_s"], "body lengths a second"),
        "upright": (100.0 * report["upright"], "% of the steps"),
        "regularity": (report["regularity"], ""),
        "period": (report["period_s"], "s"),
        "cost of transport": (report["cost_of_transport"], ""),
        "symmetry": (report["symmetry"], ""),
        "saturation": (report["saturation"], ""),
        "smoothness": (report["smoothness"], "(nearer to 0 is smoother)"),
        "rise": (report["gain"], f"m of {report['gain_needed'] or 0.0:.2f} m needed"),
    }
    for name, (value, unit) in figures.items():
        if value is not None:
            click.echo(f"  {name:>17}  {value:.2f} {unit}".rstrip())
    held = report["robustness"]
    click.echo(
        f"  {'other physics':>17}  friction {sum(held['friction'])} of 2, "
        f"mass {sum(held['mass'])} of 2, pushes {held['pushes']} of 16"
    )
    # How far a jump drifts is nobody's aim.
    if report["gain"] is None and report.get("distance_at_home", 0.0) > 0.1:
        kept = 100.0 * report["distance"] / report["distance_at_home"]
        click.echo(
            f"  {'distance':>17}  {report['distance']:.1f} m in {report['solver']}, "
            f"{kept:.0f} % of where it was evolved"
        )
    if report["legs"]:
        click.echo(f"  {'legs used':>17}  {report['legs_used']} of {report['legs']}")
    click.echo(f"wrote {', '.join(Path(file).name for file in report['files'])} to {output}")
