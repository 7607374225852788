"""A character under control of a model."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ambulo import _core
from ambulo.model import Model, ModelError
from ambulo.terrain import Terrain

Pair = Sequence[float] | NDArray[np.floating]
"""Two numbers (x, z)."""


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
        tuning: Mapping[str, Any] | None = None,
        place_feet: bool = True,
    ) -> None:
        """Stand at `start` (x, z metres), facing a yaw (radians, 0 = +Z, positive towards +X).

        Args:
            model: who to control.
            terrain: what to walk on; flat ground by default.
            start: where to stand.
            facing: where to look.
            responsive: turn and start sooner; feet slide a little more.
            tuning: instead of the model's own (`Model.tuning`): fields as `docs/models.md` lists
                them, those left out as published.
            place_feet: where the tuning holds feet (`hold_feet`), leave that to the layer of
                `ambulo-layers`: it holds the balls of the feet, bends the toes, keeps heels and
                toes above the ground and sinks the hips where a leg is too short. Only what is
                shown differs: root, phase and contacts are the same to the last bit. Without, and
                for skeletons that have no thighs, feet and toes by name, the controller's own,
                simpler hold stays.

        Raises:
            ModelError: the model's layout or skeleton is not one that this version controls, or a
                tuning that cannot be used.
        """
        self.model = model
        try:
            self.core = _core.Controller(
                model.core,
                terrain=terrain.core if terrain else None,
                start=start,
                facing=facing,
                responsive=responsive,
                tuning=None if tuning is None else json.dumps(dict(tuning)),
                place_feet=place_feet,
            )
        except ValueError as error:
            raise ModelError(str(error)) from error

    def step(
        self,
        dt: float,
        velocity: Pair = (0.0, 0.0),
        *,
        gait: str = "walk",
        facing: Pair | None = None,
        strafe: float = 0.0,
    ) -> Step:
        """Move on by `dt` seconds.

        Args:
            dt: seconds, ≥ 0; more than one second is cut to one.
            velocity: asked velocity (x, z), metres a second, at most 100; near zero means standing.
            gait: `walk`, `jog`, `run`, `crouch`, or `auto`: the first three by the asked speed,
                mixed from 1.9 to 2.3 and from 3.6 to 4.2 m/s. The published layout takes `run` for
                `jog`.
            facing: direction (x, z) to look at while strafing.
            strafe: 0 faces the movement, 1 faces `facing`.
        """
        look = None if facing is None else _pair(facing, "facing")
        asked = _pair(velocity, "velocity")
        return Step(*self.core.step(dt, asked, gait=gait, facing=look, strafe=strafe))

    def set_areas(
        self,
        *,
        walls: Sequence[Sequence[float]] = (),
        jumps: Sequence[Sequence[float]] = (),
        crouches: Sequence[Sequence[float]] = (),
    ) -> None:
        """Say where walls are and where to jump or duck; this replaces what was said before.

        Args:
            walls: (x1, z1, x2, z2, width): a segment and the distance to keep from it, metres.
            jumps: (x, y, z, radius, falloff): a full jump within `radius`, none beyond falloff.
            crouches: (x, z, half width, half depth, amount, falloff): a box parallel to the axes
                in which to crouch by `amount` (0 to 1), fading over `falloff` metres outside.

        Raises:
            ValueError: numbers that are not finite.
        """
        self.core.set_areas(
            walls=[tuple(wall) for wall in walls],
            jumps=[tuple(jump) for jump in jumps],
            crouches=[tuple(crouch) for crouch in crouches],
        )

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
    def planted(self) -> list[bool]:
        """Whether the left and the right foot are held where they stand.

        Without placed feet: whether the contact of its toes is above one half.
        """
        return self.core.planted

    @property
    def phase(self) -> float:
        """Radians, [0, 2π): 0 when the right foot comes down, π when the left does."""
        return self.core.phase


def _pair(numbers: Pair, what: str) -> tuple[float, float]:
    if len(numbers) != 2:
        raise ValueError(f"{what} must be two numbers (x, z), not {len(numbers)}")
    return (float(numbers[0]), float(numbers[1]))
