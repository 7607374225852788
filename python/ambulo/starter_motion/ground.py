"""Grounds to walk on: level, smooth slopes, stairs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from ambulo.starter_motion.noise import Chance
from ambulo.starter_motion.rotations import Floats, ease


class Ground(Protocol):
    """Heights of the ground, metres."""

    def height(self, x: ArrayLike, z: ArrayLike) -> Floats:
        """Heights above the points `x`, `z` (metres, any one shape), in that shape."""
        ...


@dataclass(frozen=True)
class Level:
    """Flat ground at height 0."""

    def height(self, x: ArrayLike, z: ArrayLike) -> Floats:
        """0 everywhere."""
        return np.zeros(np.broadcast(x, z).shape)


@dataclass(frozen=True)
class Slopes:
    """Waves of earth: the sum of a few sines, each (height, kx, kz, phase) in metres and rad/m."""

    waves: tuple[tuple[float, float, float, float], ...]

    @classmethod
    def random(cls, chance: Chance, steepness: float = 0.15) -> Slopes:
        """Five waves of 6 to 16 m whose slopes together reach about `steepness`."""
        waves = []
        for _ in range(5):
            number = 2.0 * np.pi / chance.uniform(6.0, 16.0)
            way, phase = chance.uniform(0.0, 2.0 * np.pi), chance.uniform(0.0, 2.0 * np.pi)
            height = 0.45 * steepness / number
            waves.append((height, number * np.sin(way), number * np.cos(way), phase))
        return cls(tuple(waves))

    def height(self, x: ArrayLike, z: ArrayLike) -> Floats:
        """Heights in metres."""
        x, z = np.asarray(x, np.float64), np.asarray(z, np.float64)
        parts = (h * np.sin(kx * x + kz * z + phase) for h, kx, kz, phase in self.waves)
        return sum(parts, np.zeros(np.broadcast(x, z).shape))


@dataclass(frozen=True)
class Stairs:
    """Flights of steps across the Z axis, with landings: up where `rises` are positive."""

    edges: tuple[float, ...]
    """z of each edge, metres, rising."""
    rises: tuple[float, ...]
    """Change of height at each edge, metres."""

    @classmethod
    def random(cls, chance: Chance, length: float) -> Stairs:
        """Flights of 3 to 7 steps up and down in turns, over `length` metres from z = 2."""
        edges: list[float] = []
        rises: list[float] = []
        z, up = 2.0, 1.0
        while z < length:
            tread, rise = chance.uniform(0.36, 0.46), chance.uniform(0.10, 0.17)
            for _ in range(int(chance.uniform(3.0, 8.0))):
                edges.append(z)
                rises.append(up * rise)
                z += tread
            z += chance.uniform(1.2, 3.0)
            up = -up
        return cls(tuple(edges), tuple(rises))

    def height(self, x: ArrayLike, z: ArrayLike) -> Floats:
        """Heights in metres; an edge is 2 cm wide, as a height map would have it."""
        z = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(z, np.float64))[1]
        height = np.zeros(z.shape)
        for edge, rise in zip(self.edges, self.rises, strict=True):
            height += rise * ease((z - edge) / 0.02 + 0.5)
        return height
