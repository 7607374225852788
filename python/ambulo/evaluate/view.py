"""A model's vectors in metres and seconds, and poses from one frame of reference to another."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from ambulo import _core
from ambulo.data import COLUMNS, spans
from ambulo.model import Model

Array = NDArray[np.floating]

FPS = 60


class View:
    """A model's vectors by block, in metres and seconds."""

    def __init__(self, model: Model, threads: int = 1) -> None:
        self.model, self.core, self.threads = model, model.core, threads
        layout = model.header["layout"]
        self.inputs, self.outputs = spans(layout["inputs"]), spans(layout["outputs"])
        self.joints, self.layout = len(model.names), layout["name"]
        self.columns = spans([*COLUMNS, ("input", self.core.inputs), ("output", self.core.outputs)])
        table = _core.layout(self.layout, self.joints)
        self.unit = table["units_per_metre"]
        self.rate_time = table["rate_time"]
        self.feet = model.header["parts"]["feet"]["joints"]

    @property
    def speed(self) -> float:
        """What a velocity of the layout is multiplied by to be metres a second."""
        return 1.0 / (self.rate_time * self.unit)

    def input(self, rows: Array) -> NDArray[np.float32]:
        """The input vectors of rows."""
        return np.ascontiguousarray(rows[:, self.columns["input"]], np.float32)

    def output(self, rows: Array) -> Array:
        """The output vectors of rows."""
        return rows[:, self.columns["output"]]

    def positions(self, vectors: Array, side: str = "outputs") -> Array:
        """(N, J, 3) places of the joints from the root, metres."""
        block = getattr(self, side)["joint_position"]
        return vectors[:, block].reshape(len(vectors), -1, 3) / self.unit

    def velocities(self, vectors: Array, side: str = "outputs") -> Array:
        """(N, J, 3) metres a second."""
        block = getattr(self, side)["joint_velocity"]
        return vectors[:, block].reshape(len(vectors), -1, 3) * self.speed

    def rotations(self, vectors: Array) -> Array:
        """(N, J, 4) unit quaternions x, y, z, w from the root, as the runtime reads them."""
        vectors = np.ascontiguousarray(vectors, np.float32)
        return _core.joint_rotations(self.layout, self.joints, vectors).astype(float)

    def contacts(self, vectors: Array) -> NDArray[np.bool_]:
        """(N, 4) left heel, left toe, right heel, right toe."""
        return vectors[:, self.outputs["contacts"]] > 0.5

    def phase_rate(self, vectors: Array) -> Array:
        """(N,) cycles a second."""
        return vectors[:, self.outputs["phase_rate"]][:, 0] / self.rate_time

    def predict(self, x: Array, cycles: Array, pool: ThreadPoolExecutor) -> Array:
        """(N, outputs) for phases in cycles; rows share the pool's threads."""
        x = np.ascontiguousarray(x, np.float32)
        phase = np.ascontiguousarray(cycles * (2.0 * np.pi), np.float32)
        parts = np.array_split(np.arange(len(x)), self.threads)

        def part(rows: NDArray[np.int_]) -> Array:
            return self.core.predict(x[rows[0] : rows[-1] + 1], phase[rows[0] : rows[-1] + 1])

        return np.concatenate(list(pool.map(part, [p for p in parts if len(p)])))

    def mean_pose(self) -> Array:
        """(J, 3) the mean of the training data."""
        mean = self.core.normalisation()["output_mean"][None]
        return self.positions(mean)[0]


def world(poses: Array, roots: Array) -> Array:
    """(T, J, 3) from roots (T, 4: x, height, z, yaw) to the world."""
    return turned(poses, roots[:, 3]) + _places(roots)


def seen_from(places: Array, roots: Array) -> Array:
    """(T, J, 3) from the world to roots (T, 4)."""
    return turned(places - _places(roots), -roots[:, 3])


def _places(roots: Array) -> Array:
    return roots[:, None, :3].astype(float)


def turned(vectors: Array, yaw: Array) -> Array:
    """(T, J, 3) turned about +Y by yaws (T,)."""
    sin, cos = np.sin(yaw)[:, None], np.cos(yaw)[:, None]
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    return np.stack([x * cos + z * sin, y, z * cos - x * sin], axis=-1)
