"""One episode of a creature, step by step, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Leg:
    """A chain of leg segments."""

    name: str
    """That of its first part."""
    parts: tuple[int, ...]
    """From the body to the foot, as indices of the creature's parts."""
    foot: int
    """The part that is meant to touch the ground."""
    joints: tuple[int, ...]
    """Its driven joints, as indices of columns of `angles`."""


@dataclass(frozen=True)
class Rollout:
    """T steps; arrays with T + 1 rows begin with the start pose."""

    creature: dict[str, Any]
    """The creature file."""
    dt: float
    """Seconds a step."""
    poses: NDArray[np.float32]
    """(T + 1, P, 3): x, y in metres and angle in radians of each part's own frame."""
    touching: NDArray[np.bool_]
    """(T + 1, P): the part touches the ground."""
    angles: NDArray[np.float32]
    """(T + 1, J): driven joints, radians from the start pose, counter-clockwise."""
    commands: NDArray[np.float32]
    """(T, J): the motor speed asked for, as a part of the joint's own, -1 to 1."""
    torques: NDArray[np.float32]
    """(T, J): what the motors applied, newton metres."""
    legs: tuple[Leg, ...]
    """In the creature's order; none for a creature without legs."""
    torso: int
    """Index of the torso among the parts."""
    joint_names: tuple[str, ...]
    """Of the driven joints."""
    ground: NDArray[np.float32]
    """(N, 2): the ground's outline from left to right, metres."""

    @property
    def steps(self) -> int:
        """T."""
        return len(self.commands)
