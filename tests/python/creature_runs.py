"""Small searches of creatures: a few steps of a few genomes, over in a blink."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from click.testing import CliRunner, Result
from numpy.typing import NDArray

from ambulo._core import Arena, Creature
from ambulo.cli import cli
from ambulo.creature import load_creature, recorded
from ambulo.evolution import LICENCE
from ambulo.rollout import Rollout

SMALL: dict[str, Any] = {
    "preset": "seed",
    "generations": 6,
    "seed": 3,
    "evolution": {"population": 8},
    "task": {"name": "run", "steps": 60},
}
# The same as a configuration file.
TOML = """
preset = "seed"
generations = 6
seed = 3
[evolution]
population = 8
[task]
steps = 60
"""


def ambulo(*arguments: object) -> Result:
    """A command of ours, in this process."""
    return CliRunner().invoke(cli, [str(argument) for argument in arguments])


def start(*arguments: object) -> subprocess.Popen[str]:
    """A command of ours, in a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "ambulo", *(str(argument) for argument in arguments)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def said(run: Result, code: int = 0) -> Any:
    """What a command with --json printed."""
    assert run.exit_code == code, run.output
    return json.loads(run.stdout)


def history(run: Path) -> list[dict[str, Any]]:
    """The lines of a run's history without what a clock decides."""
    lines = [json.loads(line) for line in (run / "history.jsonl").read_text().splitlines()]
    return [{key: value for key, value in line.items() if key != "seconds"} for line in lines]


def outcome(run: Path) -> dict[str, Any]:
    """Everything in a run's folder that a clock does not decide, by name."""
    found: dict[str, Any] = {
        str(path.relative_to(run)): path.read_bytes() for path in run.rglob("*") if path.is_file()
    }
    checkpoint = json.loads(found["checkpoint.json"])
    del checkpoint["seconds"]
    return found | {"checkpoint.json": checkpoint, "history.jsonl": history(run)}


def text_of(name: str) -> dict[str, Any]:
    """The file of a creature that ships."""
    return json.loads(load_creature(name).json())


def gaited(creature: Creature, steps: int) -> tuple[Arena, NDArray[np.float32], Rollout, float]:
    """The fastest of some random controllers whose motion repeats itself, and its period."""
    arena = Arena(creature, json.dumps(SMALL | {"evolution": {"population": 60}}))
    best: tuple[float, NDArray[np.float32], Rollout, float] | None = None
    for genome in arena.search().ask():
        rollout, judgement = recorded(arena, creature, genome, steps)
        speed = abs(judgement["speed_bl_s"])
        if (judgement["regularity"] or 0.0) > 0.6 and (best is None or speed > best[0]):
            best = speed, genome, rollout, judgement["period_s"]
    assert best is not None, "none of them has a gait"
    return arena, *best[1:]


def write_controller(path: Path, arena: Arena, genome: NDArray[np.float32], **record: Any) -> Path:
    """A genome as a controller's file, with whatever is to be noted of it."""
    parts = {"arena": json.loads(arena.settings()), "record": record}
    path.write_bytes(arena.controller(genome, LICENCE, "{}", json.dumps(parts)))
    return path
