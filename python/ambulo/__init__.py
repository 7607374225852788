"""Learned character animation: load a model, give it wishes, take its poses.

    >>> import ambulo
    >>> model = ambulo.load_model("model.safetensors")
    >>> character = ambulo.Controller(model)
    >>> character.step(1 / 60, velocity=(0.0, 1.5))
    >>> character.positions().shape
    (31, 3)

Everything is in metres, seconds and radians, right-handed, +Y up, +Z forward (a character that
faces +Z has its left at +X), quaternions as (x, y, z, w).
"""

from ambulo._core import Clip, MotionFileError, read_motion, write_motion
from ambulo.character import Controller
from ambulo.loading import load_model
from ambulo.model import Model, ModelError
from ambulo.terrain import Terrain

__all__ = [
    "Clip",
    "Controller",
    "Model",
    "ModelError",
    "MotionFileError",
    "Terrain",
    "load_model",
    "read_motion",
    "write_motion",
]
