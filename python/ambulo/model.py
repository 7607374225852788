"""Models: files that hold a network and everything needed to use it rightly."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ambulo import _core
from ambulo.files import write_atomic


class ModelError(ValueError):
    """A file or folder is not a model that this version can use; the message says why."""


class Model:
    """A phase-functioned neural network and its header; immutable."""

    def __init__(self, core: _core.Model) -> None:
        self.core = core
        self.header: dict[str, Any] = json.loads(core.header_json())

    @classmethod
    def from_bytes(cls, data: bytes) -> Model:
        """Read a bundle's bytes.

        Raises:
            ModelError: they are not a complete, consistent bundle; the message says what is wrong.
        """
        try:
            return cls(_core.Model.from_bytes(data))
        except ValueError as error:
            raise ModelError(str(error)) from error

    @property
    def inputs(self) -> int:
        """Length of the input vector."""
        return self.core.inputs

    @property
    def outputs(self) -> int:
        """Length of the output vector."""
        return self.core.outputs

    @property
    def names(self) -> tuple[str, ...]:
        """Joint names, parents first."""
        return tuple(joint["name"] for joint in self.header["parts"]["skeleton"])

    @property
    def parents(self) -> tuple[int, ...]:
        """Index of each joint's parent, -1 for the root."""
        joints = self.header["parts"]["skeleton"]
        return tuple(-1 if joint["parent"] is None else joint["parent"] for joint in joints)

    @property
    def tip_joints(self) -> tuple[int, ...]:
        """For each tip (a bone's end without a joint) the joint it hangs on."""
        joints = enumerate(self.header["parts"]["skeleton"])
        return tuple(i for i, joint in joints for _ in joint.get("tips", []))

    @property
    def tuning(self) -> dict[str, Any]:
        """What the model asks its controller to do differently from the published loop."""
        tuning = self.header["parts"].get("tuning", {})
        if not isinstance(tuning, dict):
            raise ModelError(f"the bundle's 'tuning' part is broken: {tuning!r} is not an object")
        return dict(tuning)

    def predict(self, x: ArrayLike, phase: ArrayLike) -> NDArray[np.float32]:
        """Run the network.

        Args:
            x: (N, inputs) float32, not normalised, in the layout's units.
            phase: (N,) float32, radians; any finite value, taken modulo 2π.

        Returns:
            (N, outputs) float32, not normalised.

        Raises:
            ValueError: shapes that do not fit, or a phase that is not finite.
        """
        x, phase = np.asarray(x, np.float32), np.asarray(phase, np.float32)
        if x.ndim != 2 or phase.ndim != 1:
            raise ValueError(
                f"expected x of shape (N, {self.inputs}) and phase of shape (N,), "
                f"got {x.shape} and {phase.shape}"
            )
        return self.core.predict(np.ascontiguousarray(x), np.ascontiguousarray(phase))

    def to_bytes(self, half: bool = False) -> bytes:
        """The model as a safetensors file.

        Args:
            half: layers as float16, rounded to nearest: half the size. Means and deviations stay
                float32, and so does everything in memory once it is loaded.

        Raises:
            ModelError: a weight is too large for half precision; the message names its tensor.
        """
        try:
            return self.core.to_bytes(half)
        except ValueError as error:
            raise ModelError(str(error)) from error

    def save(self, path: str | Path, half: bool = False) -> None:
        """Write the model as one safetensors file, atomically; `half` as in `to_bytes`."""
        write_atomic(path, self.to_bytes(half))

    def info(self) -> dict[str, Any]:
        """What a person wants to know of it, as plain values; `bytes` is the size of its file."""
        header, half = self.header, self.core.half
        return {
            "kind": header["kind"],
            "precision": "float16" if half else "float32",
            "bytes": len(self.to_bytes(half)),
            "layout": header["layout"]["name"],
            "layout_hash": header["layout"]["hash"],
            "widths": self.core.widths,
            "joints": len(header["parts"].get("skeleton", [])),
            "fps": header["fps"],
            "tuning": self.tuning,
            "licence": header["licence"],
            "provenance": header["provenance"],
        }
