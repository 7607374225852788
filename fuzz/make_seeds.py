"""Writes the seeds that no editor can: whole bundles, as small as can be.

.venv/bin/python fuzz/make_seeds.py
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from ambulo import _core

HEADER = {
    "format": 1,
    "kind": "pfnn",
    "activation": "elu",
    "fps": 60.0,
    "layout": {"name": "t", "hash": "0", "inputs": [["a", 2]], "outputs": [["b", 1]]},
    "licence": "none",
    "provenance": {},
    "parts": {},
}


def ones(*shape: int) -> np.ndarray:
    """Float32 ones."""
    return np.ones(shape, np.float32)


SEEDS = Path(__file__).parent / "seeds"

# A controller of either activation, for the creature that is a seed itself.
CONTROLLERS = {
    "tanh": {"hidden": [2]},
    "logistic": {"version": "1.0", "hidden": [1, 1]},
}


def bundles() -> None:
    """A model in either precision."""
    layers = [(ones(4, 2, 2), ones(4, 2)), (ones(4, 1, 2), ones(4, 1))]
    model = _core.Model.build(json.dumps(HEADER), layers, ones(2), ones(2), ones(1), ones(1))
    folder = SEEDS / "bundle"
    (folder / "tiny.safetensors").write_bytes(model.to_bytes())
    (folder / "tiny_half.safetensors").write_bytes(model.to_bytes(half=True))


def controllers() -> None:
    """Controllers of a creature."""
    creature = _core.Creature.parse((SEEDS / "creature" / "leg.json").read_text())
    for name, controller in CONTROLLERS.items():
        settings = {"controller": controller, "task": {"name": "run"}}
        arena = _core.Arena(creature, json.dumps(settings))
        data = arena.controller(ones(arena.genes), "none", "{}", "{}")
        (SEEDS / "controller" / f"{name}.safetensors").write_bytes(data)


if __name__ == "__main__":
    bundles()
    controllers()
