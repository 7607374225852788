"""Scenes made by code, with a person from the starter clips: what tests of pictures look at."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ambulo import _core
from ambulo.recording import Floats, Recording
from ambulo.scene_recording import GroundPatch, ScenePart, SceneRecording, Solid, Wall

CLIPS = Path(__file__).parents[2] / "starters" / "clips"


def transform(
    place: Sequence[float] | np.ndarray, yaw: float = 0.0, *, lift: float = 0.0
) -> np.ndarray:
    """(7,) a place x, z turned by `yaw`, `lift` m up."""
    turn = [0.0, np.sin(0.5 * yaw), 0.0, np.cos(0.5 * yaw)]
    return np.array([place[0], lift, place[1], *turn])


def solid(centre: Sequence[float], size: Sequence[float]) -> Solid:
    return Solid(np.array(centre, float), 0.5 * np.array(size, float))


def acting(
    clip: str, place: Sequence[float] = (0.0, 0.0), yaw: float = 0.0, fps: float = 30.0
) -> Recording:
    """A starter clip, performed at a place."""
    motion = _core.read_motion(CLIPS / f"{clip}.keys")[0].resampled(fps)
    own = np.asarray(motion.positions(), np.float64)
    c, s = np.cos(yaw), np.sin(yaw)
    positions = own.copy()
    positions[..., 0] = place[0] + c * own[..., 0] + s * own[..., 2]
    positions[..., 2] = place[1] - s * own[..., 0] + c * own[..., 2]
    return person(motion.names, motion.parents, positions, np.full(len(own), yaw), fps)


def person(
    names: Sequence[str], parents: Sequence[int], positions: np.ndarray, facing: np.ndarray,
    fps: float = 30.0,
) -> Recording:  # fmt: skip
    """A recording of joints alone; the hips are the root."""
    frames = len(positions)
    none = np.zeros(frames, np.int64)
    return Recording(
        fps=fps,
        names=tuple(names),
        parents=tuple(parents),
        positions=positions,
        tips=np.zeros((frames, 0, 3)),
        tip_joints=(),
        root=positions[:, 0][:, [0, 2]],
        facing=facing,
        gait=none,
        gait_names=("",),
        leg=none,
        lap=none,
        contacts=np.zeros((frames, 4)),
        asked=np.full((frames, 3), np.nan),
    )


def chair(place: Sequence[float], yaw: float = 0.0) -> ScenePart:
    solids = [solid((0, 0.44, 0), (0.44, 0.04, 0.42)), solid((0, 0.68, -0.23), (0.44, 0.44, 0.04))]
    for x in (-0.2, 0.2):
        solids += [solid((x, 0.21, z), (0.04, 0.42, 0.04)) for z in (-0.19, 0.19)]
    return ScenePart("chair", "chair", "chair", tuple(solids), transform(place, yaw))


def crate(transforms: Floats, size: float = 0.9, name: str = "crate") -> ScenePart:
    return ScenePart(name, "box", "box", (solid((0, 0, 0), (size,) * 3),), transforms)


def door(place: Sequence[float], yaw: float, angles: np.ndarray) -> list[ScenePart]:
    """A door 0.9 m wide, hinge on its left, opened by `angles` (T,)."""
    posts = [solid((x, 1.025, 0), (0.08, 2.05, 0.08)) for x in (-0.49, 0.49)]
    lintel = solid((0, 2.09, 0), (1.06, 0.08, 0.08))
    frame = ScenePart("door", "frame", "door", (*posts, lintel), transform(place, yaw))
    hinge = np.array([place[0] + 0.45 * np.cos(yaw), place[1] - 0.45 * np.sin(yaw)])
    leaf = solid((-0.45, 1.03, 0), (0.9, 2.04, 0.04))
    turned = np.array([transform(hinge, yaw + a) for a in angles])
    return [frame, ScenePart("door", "leaf", "door", (leaf,), turned)]


def button(place: Sequence[float], yaw: float, depth: np.ndarray) -> list[ScenePart]:
    """A button 1.15 m high on a post, pressed by `depth` (T,) metres."""
    post = solid((0, 0.61, -0.05), (0.14, 1.22, 0.1))
    cap = solid((0, 0, 0.0125), (0.1, 0.1, 0.025))
    out = np.array([np.sin(yaw), np.cos(yaw)])
    moved = np.array([transform(np.array(place) - d * out, yaw, lift=1.15) for d in depth])
    return [
        ScenePart("button", "post", "button", (post,), transform(place, yaw)),
        ScenePart("button", "cap", "button", (cap,), moved),
    ]


def lever(place: Sequence[float], yaw: float, angles: np.ndarray) -> list[ScenePart]:
    """A lever, laid over by `angles` (T,) about its own x."""
    post, arm = solid((0, 0.375, 0), (0.1, 0.75, 0.1)), solid((0, 0.2, 0), (0.03, 0.4, 0.03))
    about = np.array([0.0, np.sin(0.5 * yaw), 0.0, np.cos(0.5 * yaw)])
    moved = []
    for angle in angles:
        x, w = np.sin(0.5 * angle), np.cos(0.5 * angle)  # yaw after the turn about x
        turn = [about[3] * x, about[1] * w, -about[1] * x, about[3] * w]
        moved.append([place[0], 0.75, place[1], *turn])
    return [
        ScenePart("lever", "post", "lever", (post,), transform(place, yaw)),
        ScenePart("lever", "arm", "lever", (arm,), np.array(moved)),
    ]


class Pieces:
    """The heights of patches, the highest counting; 0 beyond them."""

    def __init__(self, patches: Sequence[GroundPatch]) -> None:
        self.patches = patches

    def height(self, x: Floats, z: Floats) -> Floats:
        x, z = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(z, np.float64))
        out = np.zeros(x.shape)
        for p in self.patches:
            dx, dz, c, s = x - p.place[0], z - p.place[1], np.cos(p.yaw), np.sin(p.yaw)
            u, v = (dx * c - dz * s) / p.size[0], (dx * s + dz * c) / p.size[1] + 0.5
            inside = (np.abs(u) <= 0.5) & (v >= 0.0) & (v <= 1.0)
            if p.kind == "rugged":
                fade = np.clip(4.0 * (0.5 - np.abs(u)), 0, 1) * np.clip(8.0 * v * (1 - v), 0, 1)
                own = p.from_height + fade * (0.5 + 0.25 * np.sin(1.1 * x) + 0.25 * np.cos(1.3 * z))
            elif p.kind == "steps":
                step = np.clip(np.floor(v * p.count), 0, p.count - 1) / (p.count - 1)
                own = p.from_height + (p.to_height - p.from_height) * step
            elif p.kind == "slope":
                own = p.from_height + (p.to_height - p.from_height) * v
            else:
                own = np.full(x.shape, p.from_height)
            out = np.where(inside, np.maximum(out, own), out)
        return out


GROUND = (
    GroundPatch((0.0, 10.0), (60.0, 60.0)),
    GroundPatch((4.2, 0.5), (2.0, 2.1), 0.0, "steps", 0.15, 1.05, 7),
    GroundPatch((4.2, 2.8), (2.0, 2.5), 0.0, "flat", 1.05),
    GroundPatch((6.45, 2.8), (2.5, 2.5), -0.5 * np.pi, "slope", 0.0, 1.05),
)
HILLS = GroundPatch((-9.0, 2.0), (9.0, 12.0), 0.2, "rugged", 0.0)


def room(*, hills: bool = False, fps: float = 30.0) -> SceneRecording:
    """Somebody sits down before a wall with a door that swings, beside a crate that slides."""
    sitter = acting("sit", (0.0, 0.38), 0.0, fps)
    frames = sitter.frames
    phase = np.linspace(0.0, 2.0 * np.pi, frames)
    slide = np.array([transform((-1.5 - 0.4 * np.sin(p), 0.9), 0.3, lift=0.45) for p in phase])
    patches = (*GROUND, HILLS) if hills else GROUND
    parts = [
        chair((0.0, 0.0)),
        crate(slide),
        crate(transform((1.15, 1.2), 0.5, lift=0.16), 0.32, "parcel"),
        *door((1.6, -1.6), 0.0, 0.7 * (1.0 - np.cos(phase))),
        *button((0.5, -1.45), 0.0, 0.01 * (1.0 - np.cos(phase))),
        *lever((-1.1, -0.9), 0.0, 0.6 * np.sin(phase)),
    ]
    walls = (Wall((-3.0, -1.6), (1.07, -1.6), 2.4), Wall((2.13, -1.6), (3.0, -1.6), 2.4))
    return SceneRecording(
        character=sitter,
        parts=tuple(parts),
        walls=walls,
        heights=Pieces(patches),
        patches=patches,
        events=((0.0, "sit: enter"), (1.9, "sit: hold"), (4.3, "sit: exit")),
    )
