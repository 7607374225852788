"""What ships with the project: where the starter model, the creatures and the scenes lie."""

from __future__ import annotations

from pathlib import Path

HUMAN = "human.safetensors"
FOLDER = Path(__file__).resolve().parents[2] / "starters"


def starter_model() -> Path:
    """The starter model's file: a person who walks, jogs, runs, crouches and strafes.

    Raises:
        FileNotFoundError: this is not a checkout of the project; the message says what to do.
    """
    path = FOLDER / HUMAN
    if not path.is_file():
        raise FileNotFoundError(
            f"{path} is missing: it comes with a checkout of the project; `ambulo starter motion` "
            "and `ambulo train --preset starter` make another"
        )
    return path


def starter_creatures() -> dict[str, Path]:
    """The creatures' files by name; none where this is not a checkout of the project."""
    return {path.stem: path for path in sorted((FOLDER / "creatures").glob("*.json"))}


def starter_scene() -> Path:
    """The playground: a scene with one of everything; its script is `playground-visit.toml`.

    Raises:
        FileNotFoundError: this is not a checkout of the project.
    """
    path = FOLDER / "scenes" / "playground.toml"
    if not path.is_file():
        raise FileNotFoundError(f"{path} is missing: it comes with a checkout of the project")
    return path
