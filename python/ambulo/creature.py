"""2D creatures: their files, their controllers, their recorded episodes."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ambulo import _core
from ambulo._core import Arena, Creature, CreatureController
from ambulo.rollout import Leg, Rollout
from ambulo.starters import starter_creatures

Floats = NDArray[np.float32]


class CreatureError(ValueError):
    """A creature or a controller that cannot be used; the message names the file and the place."""

    def __init__(self, text: str, problems: Sequence[tuple[str, str]] = ()) -> None:
        super().__init__(text)
        self.problems = list(problems)
        """Of a creature: JSON path and reason of everything that is wrong."""


def load_creature(source: str | Path) -> Creature:
    """A creature from a file, or by the name of one that ships with the project (`tetrapod2`).

    Raises:
        CreatureError: not a creature; a line for everything that is wrong, with its JSON path.
        FileNotFoundError: nothing is there; the message lists the names there are.
    """
    path = Path(source)
    if not path.is_file():
        shipped = starter_creatures()
        found = shipped.get(str(source))
        if found is None and path.is_dir():
            raise IsADirectoryError(f"{source} is a folder; a creature is a file")
        if found is None:
            raise FileNotFoundError(
                f"{source}: no such file, and no creature that ships is called so; there are "
                f"{', '.join(shipped)}"
            )
        path = found
    return parse_creature(_text(path), str(path))


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        reason = f"not UTF-8 ({error.reason} at {error.start})"
        raise CreatureError(f"{path}: $: {reason}", [("$", reason)]) from error


def parse_creature(text: str, name: str) -> Creature:
    """A creature from a file's text; `name` stands before every complaint.

    Raises:
        CreatureError: not a creature; a line for everything that is wrong, with its JSON path.
    """
    try:
        return Creature.parse(text)
    except _core.CreatureFileError as error:
        lines = str(error).splitlines()
        text = "\n".join(f"{name}: {line}" for line in lines)
        raise CreatureError(text, error.problems) from error


def description(creature: Creature) -> dict[str, Any]:
    """What the creature's file says."""
    return json.loads(creature.json())


@dataclass(frozen=True)
class SavedController:
    """A controller's file: the network, the creature, and how it was evolved."""

    genome: Floats
    """(G,): its weights and biases."""
    creature: Creature
    """What it was made for."""
    header: dict[str, Any]
    """The bundle's header."""
    settings: dict[str, Any]
    """All settings of the search; only the controller's own where it was not evolved by us."""
    record: dict[str, Any]
    """What was noted of it: fitness, generation, terms."""


def load_creature_controller(source: str | Path) -> CreatureController:
    """A controller from its file, or the best one of a run's folder: angles in, motor speeds out.

    Raises:
        CreatureError: not a controller; the message names the file and what is wrong.
        FileNotFoundError: nothing is there.
    """
    path = Path(source)
    if path.is_dir():
        path = path / "best.safetensors"
        if not path.is_file():
            raise FileNotFoundError(f"{source} holds no best.safetensors: is it a run's folder?")
    try:
        return CreatureController.from_bytes(path.read_bytes())
    except ValueError as error:
        raise CreatureError(f"{path}: {error}") from error


def load_controller(source: str | Path) -> SavedController:
    """The same with all that its file says of how it was evolved."""
    read = load_creature_controller(source)
    header = json.loads(read.header_json())
    parts = header["parts"]
    return SavedController(
        genome=read.genome(),
        creature=read.creature(),
        header=header,
        settings=parts.get("arena", {"controller": json.loads(read.settings())}),
        record=parts.get("record", {}),
    )


def recorded(
    arena: Arena, creature: Creature, genome: Floats, steps: int
) -> tuple[Rollout, dict[str, Any]]:
    """An episode of a genome (G,) for so many steps, and the judgement of it."""
    found = arena.record(genome, steps)
    facts = creature.facts()
    legs = tuple(
        Leg(leg["name"], tuple(leg["parts"]), leg["foot"], tuple(leg["joints"]))
        for leg in facts["legs"]
    )
    rollout = Rollout(
        creature=description(creature),
        dt=found.dt,
        poses=found.poses(),
        touching=found.touching(),
        angles=found.angles(),
        commands=found.commands(),
        torques=found.torques(),
        legs=legs,
        torso=facts["torso"],
        joint_names=tuple(facts["driven"]),
        ground=found.ground(),
    )
    judgement = json.loads(arena.judge(found))
    return rollout, {**judgement, "hash": found.hash}
