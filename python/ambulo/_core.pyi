"""Types of the native module."""

from collections.abc import Callable, Sequence
from os import PathLike
from typing import Any, Literal, TypedDict

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

class Terrain:
    @staticmethod
    def flat(height: float = 0.0) -> Terrain: ...
    @staticmethod
    def hills(seed: int = 0, size: float = 160.0, height: float = 3.0) -> Terrain: ...
    @staticmethod
    def from_text(text: str, cell: float, scale: float) -> Terrain: ...
    def heights(self, x: Floats, z: Floats) -> Floats: ...

class Controller:
    def __init__(
        self,
        model: Model,
        *,
        terrain: Terrain | None = None,
        start: tuple[float, float] = (0.0, 0.0),
        facing: float = 0.0,
        responsive: bool = False,
        tuning: str | None = None,
    ) -> None: ...
    def set_areas(
        self,
        *,
        walls: Sequence[Sequence[float]] = (),
        jumps: Sequence[Sequence[float]] = (),
        crouches: Sequence[Sequence[float]] = (),
    ) -> None: ...
    def step(
        self,
        dt: float,
        velocity: tuple[float, float] = (0.0, 0.0),
        *,
        gait: str = "walk",
        facing: tuple[float, float] | None = None,
        strafe: float = 0.0,
    ) -> tuple[int, str | None]: ...
    def positions(self) -> Floats: ...
    def rotations(self) -> Floats: ...
    def tips(self) -> Floats: ...
    def trajectory(self) -> Floats: ...
    @property
    def root(self) -> tuple[float, float, float, float]: ...
    @property
    def contacts(self) -> list[float]: ...
    @property
    def phase(self) -> float: ...
    @property
    def gaits(self) -> list[float]: ...

class Model:
    @staticmethod
    def from_bytes(bytes: bytes) -> Model: ...
    @staticmethod
    def build(
        header: str,
        layers: Sequence[tuple[Floats, Floats]],
        input_mean: Floats,
        input_std: Floats,
        output_mean: Floats,
        output_std: Floats,
    ) -> Model: ...
    def to_bytes(self, half: bool = False) -> bytes: ...
    @property
    def half(self) -> bool: ...
    def header_json(self) -> str: ...
    @property
    def inputs(self) -> int: ...
    @property
    def outputs(self) -> int: ...
    @property
    def widths(self) -> list[int]: ...
    def layers(self) -> list[tuple[Floats, Floats]]: ...
    def normalisation(self) -> dict[str, Floats]: ...
    def predict(self, x: Floats, phase: Floats) -> Floats: ...

class _Layout(TypedDict):
    name: str
    hash: str
    fps: float
    units_per_metre: float
    rate_time: float
    yaw_sign: float
    inputs: list[tuple[str, int]]
    outputs: list[tuple[str, int]]

def layout(name: str, joints: int) -> _Layout: ...
def joint_rotations(name: str, joints: int, outputs: Floats) -> Floats: ...
def phase_shares(cycles: Sequence[float]) -> NDArray[np.float64]: ...
def drawn_offsets(model: Model) -> Floats: ...

# -- motion files ---------------------------------------------------------------------------------

class MotionFileError(ValueError):
    """A motion file that is refused; the attributes are None where the whole file is meant."""

    line: int | None
    column: int | None
    expected: str | None
    found: str | None

class Clip:
    """A skeleton's motion; immutable. Lengths are in the clip's own units."""

    @staticmethod
    def from_arrays(
        *,
        names: Sequence[str],
        parents: Sequence[int],
        offsets: NDArray[np.float64],
        fps: float,
        rotations: NDArray[np.float64],
        root: NDArray[np.float64] | None = None,
    ) -> Clip: ...
    @property
    def names(self) -> list[str]: ...
    @property
    def parents(self) -> list[int]: ...
    @property
    def offsets(self) -> NDArray[np.float64]: ...
    @property
    def tip_joints(self) -> list[int]: ...
    @property
    def tips(self) -> NDArray[np.float64]: ...
    @property
    def fps(self) -> float: ...
    @property
    def frames(self) -> int: ...
    @property
    def duration(self) -> float: ...
    @property
    def rotations(self) -> NDArray[np.float64]: ...
    @property
    def translations(self) -> NDArray[np.float64]: ...
    def positions(self) -> NDArray[np.float32]: ...
    def resampled(self, fps: float) -> Clip: ...
    def slice(self, start: int, end: int) -> Clip: ...
    def mirrored(
        self, method: Literal["auto", "name", "geometry"] = "auto", axes: str = "ambulo"
    ) -> Clip: ...
    def converted(self, from_axes: str, to_axes: str) -> Clip: ...

def motion_axes() -> list[str]: ...
def read_motion(
    path: str | PathLike[str],
    *,
    repair: bool = False,
    fps: float | None = None,
    positions: Literal["replace", "add"] = "replace",
) -> tuple[Clip, dict[str, Any]]: ...
def write_motion(path: str | PathLike[str], clip: Clip) -> list[str]: ...

# -- data sets ------------------------------------------------------------------------------------

def dataset_categories() -> list[str]: ...
def dataset_check(text: str) -> str: ...
def dataset_plan(
    files: Sequence[str],
    folder: str,
    settings: str = "",
    *,
    threads: int = 1,
    progress: Callable[[float], object] | None = None,
) -> tuple[str, list[tuple[str, str]]]: ...
def dataset_build(
    folder: str,
    manifest: str,
    *,
    threads: int = 1,
    progress: Callable[[float], object] | None = None,
) -> str: ...

class _ClipRows(TypedDict):
    rows: Floats
    runs: list[tuple[int, int]]
    fps: float

def clip_rows(
    model: Model, path: str, *, axes: str | None = None, mirrored: bool = False
) -> _ClipRows: ...
