"""A population in Box2D 3, as fast as pyb2d3 steps it: a peer to measure against.

The same creatures, the same kind of world and the same network as ours, each individual with
weights of its own, drawn at random: what is measured is steps, not learning. Settings that were
tried, with a tetrapod of 9 parts and 8 joints, a population of 50, pyb2d3 0.11.1 and one thread:

- One shared world with everyone at a place of their own takes two thirds of the time of one world
  each (of which Box2D allows 128). From 2 m apart on, the distance between them makes no
  difference; at the same place they are 3 % slower, although filters keep them from colliding.
- Its batch of bodies reads all rotations in one call; an `angle` a joint makes a step 6 % slower.
  There is no batch of joints: motor speeds are set one by one, fastest from C through `map`.
- A pool of one thread is more than a fifth slower than no pool.
"""

from __future__ import annotations

import importlib
import math
from collections import deque
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

Creature = dict[str, Any]
"""A creature file: SI units, radians, x to the right, y up, the ground at y = 0."""

GRAVITY = (0.0, -9.81)
HIDDEN = 10
# A layer's inputs and outputs lie in [-RANGE, RANGE].
RANGE = 3.0
# Between neighbours, metres: wide enough that most never meet, and narrow enough that a population
# of 50 stays within 500 m of the origin, where a float resolves 0.03 mm.
SPACING = 20.0
# Of ground beyond the outermost individual, metres.
RUNWAY = 1000.0
FRICTION = 0.8
# Parts with one of these tags hang on a joint that the network does not drive.
UNDRIVEN = {"hand", "head", "ignored"}
# Collision categories: the ground meets parts, parts meet nothing but the ground.
GROUND, PART = 1, 2


class Peer:
    """A population of one creature, stepped together, each with a random network of its own.

    Sleeping and continuous collision are off, joint limits and motors on; the motor of a joint that
    the network does not drive holds still.
    """

    def __init__(
        self,
        creature: Creature,
        population: int,
        seed: int,
        dt: float = 1 / 60,
        substeps: int = 4,
    ) -> None:
        """Build the world, everyone in the start pose.

        Args:
            creature: what a creature file holds, already checked.
            population: individuals, N.
            seed: of the networks' weights.
            dt: seconds a step.
            substeps: of Box2D's solver, in each step.

        Raises:
            ImportError: pyb2d3 is not installed.
        """
        self._b2 = _import()
        self._dt = dt
        self._substeps = substeps
        parts, joints = creature["parts"], creature["joints"]
        index = {part["name"]: i for i, part in enumerate(parts)}
        tags = [set(part.get("tags", ())) for part in parts]
        torso = next(i for i, tag in enumerate(tags) if "torso" in tag)
        driven = [joint for joint in joints if not tags[index[joint["child"]]] & UNDRIVEN]

        self._build(creature, population, index, torso, {joint["name"] for joint in driven})

        # An angle of the network is that of one part seen from another; the torso is seen from the
        # world, which is the column after the parts and does not turn.
        self._seen = np.array([torso, *(index[joint["child"]] for joint in driven)])
        self._seen_from = np.array([len(parts), *(index[joint["parent"]] for joint in driven)])
        self._start = np.array([part.get("angle", 0.0) for part in parts], np.float32)
        self._angles = np.zeros((population, len(parts) + 1), np.float32)
        self._rotations = np.empty((population * len(parts), 2), np.float32)

        self._speeds = np.array([joint["speed"] for joint in driven], np.float32)
        self._layers = _random_layers(population, [len(self._seen), HIDDEN, len(driven)], seed)

    def run(self, steps: int) -> None:
        """Step everyone: sense, evaluate the network, set the motors, step the world."""
        motor_speeds = self._speeds / np.float32(RANGE)
        set_speed = self._b2.RevoluteJoint.motor_speed.fset
        for _ in range(steps):
            speeds = self.outputs(self.inputs()) * motor_speeds
            # Calls the setter for every joint without a line of Python for each.
            deque(map(set_speed, self._driven, speeds.ravel().tolist()), maxlen=0)
            self._world.step(self._dt, self._substeps)

    def inputs(self) -> NDArray[np.float32]:
        """(N, 1 + J) of [-3, 3]: the torso's rotation, then the driven joints' angles.

        All from the start pose, half a turn being 3.
        """
        self._bodies.get_rotations(self._rotations)
        cosine, sine = self._rotations.T
        turned = np.arctan2(sine, cosine).reshape(len(self._angles), -1) - self._start
        self._angles[:, :-1] = turned
        angles = self._angles[:, self._seen] - self._angles[:, self._seen_from]
        angles -= math.tau * np.round(angles / math.tau)
        return angles * np.float32(RANGE / math.pi)

    def outputs(self, inputs: NDArray[np.float32]) -> NDArray[np.float32]:
        """(N, J) of [-3, 3]: everyone's own network on everyone's own inputs (N, 1 + J)."""
        values = inputs[:, np.newaxis]
        for weights, bias in self._layers:
            values = np.float32(RANGE) * np.tanh(values @ weights + bias)
        return values[:, 0]

    def distances(self) -> NDArray[np.float32]:
        """(N,): how far each torso is to the right of where it started, metres."""
        return self._torsos.get_positions()[:, 0] - self._start_x

    def _build(
        self,
        creature: Creature,
        population: int,
        index: dict[str, int],
        torso: int,
        driven: set[str],
    ) -> None:
        """The world, and in it the ground and everyone, in a row around the origin."""
        b2 = self._b2
        # Both batches keep the order of the individuals: (N, P) and (N,).
        self._bodies, self._torsos = b2.Bodies(), b2.Bodies()
        self._driven: list[Any] = []

        self._world = b2.World(gravity=GRAVITY)
        self._world.sleeping_enabled = False
        self._world.continuous_enabled = False
        half = population * SPACING / 2 + RUNWAY
        ground = b2.segment((-half, 0.0), (half, 0.0))
        surface = _surface(b2, 1.0, FRICTION, GROUND, PART)
        self._world.create_static_body().create_shape(surface, ground)

        for i in range(population):
            x = (i - (population - 1) / 2) * SPACING
            bodies = [_add_part(b2, self._world, part, x) for part in creature["parts"]]
            for body in bodies:
                self._bodies.append(body.id)
            self._torsos.append(bodies[torso].id)
            for joint in creature["joints"]:
                parent, child = index[joint["parent"]], index[joint["child"]]
                ends = bodies[parent], bodies[child]
                angles = [creature["parts"][p].get("angle", 0.0) for p in (parent, child)]
                made = _add_joint(self._world, joint, ends, angles[1] - angles[0], x)
                if joint["name"] in driven:
                    self._driven.append(made)
        self._start_x = self._torsos.get_positions()[:, 0].copy()


def _import() -> Any:
    """pyb2d3, imported only by those who measure."""
    try:
        return importlib.import_module("pyb2d3")
    except ImportError as error:
        text = "measuring against pyb2d3 needs it: pip install 'ambulo[bench]'"
        raise ImportError(text, name="pyb2d3") from error


def _surface(b2: Any, density: float, friction: float, category: int, meets: int) -> Any:
    """What a shape is made of, and which categories it collides with."""
    material = b2.surface_material(friction=friction)
    filtered = b2.make_filter(category_bits=category, mask_bits=meets)
    return b2.shape_def(density=density, material=material, filter=filtered)


def _shape(b2: Any, shape: dict[str, dict[str, Any]]) -> Any:
    """A part's shape in the part's own frame."""
    ((kind, size),) = shape.items()
    if kind == "box":
        return b2.box(size["width"] / 2, size["height"] / 2)
    if kind == "capsule":
        end = size["length"] / 2
        return b2.capsule((0.0, -end), (0.0, end), size["radius"])
    if kind == "circle":
        return b2.circle((0.0, 0.0), size["radius"])
    assert kind == "polygon", kind
    return b2.polygon(size["points"])


def _add_part(b2: Any, world: Any, part: dict[str, Any], x: float) -> Any:
    """A part's body, moved by x from where the start pose has it."""
    position = (part["position"][0] + x, part["position"][1])
    body = world.create_dynamic_body(position=position, rotation=part.get("angle", 0.0))
    friction = part.get("friction", FRICTION)
    body.create_shape(
        _surface(b2, part["density"], friction, PART, GROUND), _shape(b2, part["shape"])
    )
    return body


def _add_joint(
    world: Any, joint: dict[str, Any], ends: tuple[Any, Any], angle: float, x: float
) -> Any:
    """A hinge between parent and child, whose angle in the start pose is given; it stands still."""
    anchor = (joint["anchor"][0] + x, joint["anchor"][1])
    lower, upper = joint["limits"]
    return world.create_revolute_joint(
        *ends,
        local_anchor_a=ends[0].local_point(anchor),
        local_anchor_b=ends[1].local_point(anchor),
        # Box2D clamps it to half a turn.
        reference_angle=math.remainder(angle, math.tau),
        enable_limit=True,
        lower_angle=lower,
        upper_angle=upper,
        enable_motor=True,
        max_motor_torque=joint["torque"],
        motor_speed=0.0,
    )


def _random_layers(
    population: int, sizes: list[int], seed: int
) -> list[tuple[NDArray[np.float32], NDArray[np.float32]]]:
    """Of fully connected layers: weights (N, from, to), biases (N, 1, to), uniform in [-1, 1]."""
    draw = np.random.default_rng(seed)
    layers = []
    for inputs, outputs in pairwise(sizes):
        weights = draw.uniform(-1, 1, (population, inputs, outputs)).astype(np.float32)
        bias = draw.uniform(-1, 1, (population, 1, outputs)).astype(np.float32)
        layers.append((weights, bias))
    return layers
