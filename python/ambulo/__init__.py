"""Learned character animation: load a model, give it wishes, take its poses.

2D creatures that evolve how they move: `load_creature`, `load_creature_controller`, and the command
line's `ambulo evolve`.

    >>> import ambulo
    >>> model = ambulo.load_model("model.safetensors")
    >>> character = ambulo.Controller(model)
    >>> character.step(1 / 60, velocity=(0.0, 1.5))
    >>> character.positions().shape
    (31, 3)

Metres, seconds and radians throughout. Characters: right-handed, +Y up, +Z forward (one that faces
+Z has its left at +X), quaternions as (x, y, z, w). Creatures: x forward, y up.
"""

from ambulo._core import (
    Clip,
    Creature,
    CreatureController,
    CreatureFileError,
    MotionFileError,
    read_motion,
    write_motion,
)
from ambulo.character import Controller
from ambulo.creature import CreatureError, load_creature, load_creature_controller
from ambulo.loading import load_model
from ambulo.model import Model, ModelError
from ambulo.terrain import Terrain

__all__ = [
    "Clip",
    "Controller",
    "Creature",
    "CreatureController",
    "CreatureError",
    "CreatureFileError",
    "Model",
    "ModelError",
    "MotionFileError",
    "Terrain",
    "load_creature",
    "load_creature_controller",
    "load_model",
    "read_motion",
    "write_motion",
]
