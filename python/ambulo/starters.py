"""What ships with the project: where the starter model lies."""

from __future__ import annotations

from pathlib import Path

HUMAN = "human.safetensors"


def starter_model() -> Path:
    """The starter model's file: a person who walks, jogs, runs, crouches and strafes.

    Raises:
        FileNotFoundError: this is not a checkout of the project; the message says what to do.
    """
    path = Path(__file__).resolve().parents[2] / "starters" / HUMAN
    if not path.is_file():
        raise FileNotFoundError(
            f"{path} is missing: it comes with a checkout of the project; `ambulo starter motion` "
            "and `ambulo train --preset starter` make another"
        )
    return path
