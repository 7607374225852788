"""Terrain by name or file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ambulo import _core

# The published height maps: pixels of 3.937007874 cm, heights in units of 3 cm
# (Holden et al. 2017, the demo's hscale and vscale).
MAP_CELL = 0.03937007874
MAP_SCALE = 0.03
MAX_SEED = 2**64 - 1


class Terrain:
    """Terrain to walk on: flat, hills from a seed, or a height map."""

    def __init__(self, core: _core.Terrain) -> None:
        self.core = core

    @classmethod
    def flat(cls, height: float = 0.0) -> Terrain:
        """Level ground at `height` metres."""
        return cls(_core.Terrain.flat(height))

    @classmethod
    def hills(cls, seed: int = 0, size: float = 160.0, height: float = 3.0) -> Terrain:
        """Gentle hills, `size` metres a side around the origin, between 0 and `height` metres.

        Raises:
            ValueError: the seed does not fit 64 bits, or a length is not one to make hills with.
        """
        if not 0 <= seed <= MAX_SEED:
            raise ValueError(f"the seed of the hills is {seed}, expected 0 to {MAX_SEED}")
        return cls(_core.Terrain.hills(seed, size, height))

    @classmethod
    def from_file(
        cls, path: str | Path, cell: float = MAP_CELL, scale: float = MAP_SCALE
    ) -> Terrain:
        """A text grid of heights, one row a line (rows run along +Z, columns along +X).

        `cell` is the distance between neighbours in metres, `scale` metres per unit of height;
        the defaults are those of the PFNN's height maps.
        """
        try:
            return cls(_core.Terrain.from_text(Path(path).read_text(), cell, scale))
        except FileNotFoundError as error:
            raise ValueError(f"{path}: no such file") from error
        except OSError as error:
            raise ValueError(f"{path}: not a height map: {error.strerror or error}") from error
        except ValueError as error:
            raise ValueError(f"{path}: not a height map: {error}") from error

    @classmethod
    def named(cls, name: str, seed: int = 0) -> Terrain:
        """`flat`, `hills` (with a seed) or a file's path."""
        match name:
            case "flat":
                return cls.flat()
            case "hills":
                return cls.hills(seed)
            case _ if not Path(name).exists():
                raise ValueError(f"{name}: no such file; or 'flat' or 'hills'")
            case _:
                return cls.from_file(name)

    def height(self, x: NDArray[np.floating], z: NDArray[np.floating]) -> NDArray[np.float32]:
        """Heights in metres at points (x, z) of any one shape."""
        x, z = np.broadcast_arrays(x, z)
        flat_x = np.ascontiguousarray(x, np.float32).ravel()
        flat_z = np.ascontiguousarray(z, np.float32).ravel()
        return self.core.heights(flat_x, flat_z).reshape(x.shape)
