"""A character under control of a model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ambulo import _core
from ambulo.model import Model, ModelError
from ambulo.terrain import Terrain


@dataclass(frozen=True)
class Step:
    """What a step did."""

    steps: int
    """Fixed steps that ran inside."""
    event: str | None
    """`held: …` when bad input left everything as it was, `skipped: …` after a long pause."""


class Controller:
    """One character: wishes in, poses out, at any frame rate.

    Fixed steps run inside (60 a second for the published network) and poses are interpolated, so
    the path does not depend on the caller's rate.
    """

    def __init__(
        self,
        model: Model,
        *,
        terrain: Terrain | None = None,
        start: tuple[float, float] = (0.0, 0.0),
        facing: float = 0.0,
        responsive: bool = False,
    ) -> None:
        """Stand at `start` (x, z metres), facing a yaw (radians, 0 = +Z, positive towards +X).

        Raises:
            ModelError: the model's layout or skeleton is not one that this version controls.
        """
        self.model = model
        try:
            self.core = _core.Controller(
                model.core,
                terrain=terrain.core if terrain else None,
                start=start,
                facing=facing,
                responsive=responsive,
            )
        except ValueError as error:
            raise ModelError(str(error)) from error

    def step(
        self,
        dt: float,
        velocity: tuple[float, float] = (0.0, 0.0),
        *,
        gait: str = "walk",
        facing: tuple[float, float] | None = None,
        strafe: float = 0.0,
    ) -> Step:
        """Move on by `dt` seconds.

        Args:
            dt: seconds, ≥ 0; more than one second is cut to one.
            velocity: asked velocity (x, z), metres a second; near zero means standing.
            gait: `walk`, `jog` or `crouch`.
            facing: direction (x, z) to look at while strafing.
            strafe: 0 faces the movement, 1 faces `facing`.
        """
        steps, event = self.core.step(dt, velocity, gait=gait, facing=facing, strafe=strafe)
        return Step(steps, event)

    def positions(self) -> NDArray[np.float32]:
        """Global joint positions, (joints, 3) metres."""
        return self.core.positions()

    def rotations(self) -> NDArray[np.float32]:
        """Local joint rotations, (joints, 4) quaternions; the root joint's in the world."""
        return self.core.rotations()

    def tips(self) -> NDArray[np.float32]:
        """Global ends of bones without a joint, (tips, 3) metres."""
        return self.core.tips()

    @property
    def root(self) -> tuple[float, float, float, float]:
        """Place on the ground x, y, z (metres) and yaw (radians)."""
        return self.core.root

    @property
    def contacts(self) -> list[float]:
        """Left heel, left toe, right heel, right toe: 0 in the air, 1 on the ground."""
        return self.core.contacts

    @property
    def phase(self) -> float:
        """Radians, [0, 2π): 0 when the right foot comes down, π when the left does."""
        return self.core.phase
