"""A character around a course: the responsiveness test of the first seed's study, and its figures.

Source: Segerstedt 2021, section 3.1.1: a fixed course of waypoints, laps around it, the time that
each frame takes. Which figures a lap has, and how each is defined, is in `docs/walking.md`.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ambulo.character import Controller
from ambulo.evaluate import metrics
from ambulo.evaluate.track import GAITS, Track, Waypoint
from ambulo.model import Model
from ambulo.recording import Recording
from ambulo.terrain import Terrain

FPS = 60
# The driver steers for a point of the course this far ahead, metres, as a player would who means to
# stay on it; 2 m are a second or two of walking.
LOOKAHEAD = 2.0
# A leg that takes longer than this many times its straight-line time, and ten seconds, is given up.
PATIENCE = 3.0
# Figures of speed need two frames; a lap has them even if it starts within reach of every waypoint.
LEAST_FRAMES = 2


@dataclass(frozen=True)
class LapFigures:
    """Figures of one lap; definitions in `docs/walking.md`."""

    time_s: float
    waypoints_reached: int
    path_error_m: float
    path_error_max_m: float
    heading_error_deg: float
    mean_speed_ratio: float
    foot_skate_cm_per_frame: float
    foot_skate_cm_per_s: float
    foot_floor_cm: float
    planted_slide_cm_per_frame: float
    planted_share: float
    ms_per_frame_mean: float
    ms_per_frame_sd: float
    held_frames: int


@dataclass(frozen=True)
class Lap:
    """One lap: its motion and its figures."""

    recording: Recording
    rotations: NDArray[np.float32]
    """(T, J, 4) local quaternions x, y, z, w; the root joint's in the world."""
    figures: LapFigures

    def without_motion(self) -> Lap:
        """The same lap with a path and figures only: no joints, a hundredth of the memory."""
        return replace(
            self, recording=self.recording.without_joints(), rotations=self.rotations[:, :0]
        )


def walk_laps(
    model: Model,
    track: Track,
    terrain: Terrain,
    laps: int,
    *,
    responsive: bool = False,
    place_feet: bool = True,
    on_progress: Callable[[float], None] | None = None,
) -> Iterator[Lap]:
    """Walk a character around a track, lap after lap.

    Args:
        model: of either layout.
        track: the course.
        terrain: what it walks on.
        laps: how many, ≥ 1.
        responsive: the controller's quicker tuning.
        place_feet: by the layer, as `Controller` does.
        on_progress: called once a second of walking with the laps done so far, fractions included.

    Yields:
        Each lap when it is finished.
    """
    origin, first = track.start, track.waypoints[0].position
    facing = math.atan2(first[0] - origin[0], first[1] - origin[1])
    character = Controller(
        model, terrain=terrain, start=origin, facing=facing,
        responsive=responsive, place_feet=place_feet,
    )  # fmt: skip
    for lap in range(laps):
        yield _Walker(character, track, terrain, lap, on_progress).lap()


class _Walker:
    """Steers one lap and keeps what happened."""

    def __init__(
        self,
        character: Controller,
        track: Track,
        terrain: Terrain,
        lap: int,
        on_progress: Callable[[float], None] | None,
    ) -> None:
        self.character, self.track, self.terrain = character, track, terrain
        self.index, self.on_progress = lap, on_progress
        self.positions: list[NDArray[np.float32]] = []
        self.tips: list[NDArray[np.float32]] = []
        self.rotations: list[NDArray[np.float32]] = []
        self.rows: list[tuple[float, ...]] = []
        self.planted: list[list[bool]] = []
        self.seconds: list[float] = []
        self.reached = self.held = 0

    def lap(self) -> Lap:
        for leg, waypoint in enumerate(self.track.waypoints):
            self._leg(leg, waypoint)
        recording = self._recording()
        return Lap(recording, np.stack(self.rotations), self._figures(recording))

    def _leg(self, leg: int, waypoint: Waypoint) -> None:
        patience = 10.0 + PATIENCE * self.track.leg_time(leg)
        for frame in range(math.ceil(patience * FPS)):
            x, _, z, _ = self.character.root
            distance = math.dist((x, z), waypoint.position)
            if distance <= self.track.reach and len(self.rows) >= LEAST_FRAMES:
                self.reached += 1
                return
            goal = self.track.ahead(leg, (x, z), LOOKAHEAD)
            dx, dz = goal[0] - x, goal[1] - z
            speed = waypoint.speed / max(math.hypot(dx, dz), 1e-6)
            self._frame(leg, waypoint, (dx * speed, dz * speed))
            if self.on_progress and frame % FPS == 0:
                share = max(0.0, 1.0 - distance / self.track.leg_length(leg))
                self.on_progress(self.index + (leg + share) / len(self.track.waypoints))

    def _frame(self, leg: int, waypoint: Waypoint, velocity: tuple[float, float]) -> None:
        facing = waypoint.strafe
        before = time.perf_counter()
        step = self.character.step(
            1.0 / FPS, velocity, gait=waypoint.gait, facing=facing, strafe=1.0 if facing else 0.0
        )
        self.seconds.append(time.perf_counter() - before)
        self.held += step.event is not None
        x, _, z, yaw = self.character.root
        look = facing or velocity
        asked = (*velocity, math.atan2(look[0], look[1]))
        gait = GAITS.index(waypoint.gait)
        self.positions.append(self.character.positions())
        self.tips.append(self.character.tips())
        self.rotations.append(self.character.rotations())
        self.planted.append(self.character.planted)
        self.rows.append((x, z, yaw, *asked, leg, gait, *self.character.contacts))

    def _recording(self) -> Recording:
        rows = np.array(self.rows)
        model = self.character.model
        return Recording(
            fps=FPS,
            names=model.names,
            parents=model.parents,
            positions=np.stack(self.positions),
            tips=np.stack(self.tips),
            tip_joints=model.tip_joints,
            root=rows[:, 0:2].astype(np.float32),
            facing=rows[:, 2].astype(np.float32),
            asked=rows[:, 3:6].astype(np.float32),
            leg=rows[:, 6].astype(int),
            gait=rows[:, 7].astype(int),
            gait_names=GAITS,
            lap=np.full(len(rows), self.index),
            contacts=rows[:, 8:12].astype(np.float32),
        )

    def _figures(self, recording: Recording) -> LapFigures:
        feet = self.character.model.header["parts"]["feet"]
        toes = [feet["joints"][i] for i in (1, 3)]
        floor = metrics.contact_floor(recording, self.terrain, toes)
        if floor is None:
            floor = np.array([feet["heights"][i] for i in (1, 3)])
        skate = metrics.foot_skate(recording, self.terrain, toes, floor)
        planted = np.array(self.planted)
        ms = np.array(self.seconds) * 1000.0
        return LapFigures(
            time_s=len(recording.root) / FPS,
            waypoints_reached=self.reached,
            path_error_m=metrics.path_error(recording.root, self.track),
            path_error_max_m=metrics.path_error_max(recording.root, self.track),
            heading_error_deg=metrics.heading_error(recording),
            mean_speed_ratio=metrics.speed_ratio(recording),
            foot_skate_cm_per_frame=skate,
            foot_skate_cm_per_s=FPS * skate,
            foot_floor_cm=float(floor.mean() * 100.0),
            planted_slide_cm_per_frame=metrics.planted_slide(recording, planted, toes),
            planted_share=float(planted.mean()),
            ms_per_frame_mean=float(ms.mean()),
            ms_per_frame_sd=float(ms.std()),
            held_frames=self.held,
        )


def summarise(laps: list[Lap], track: Track) -> dict:
    """The laps' figures and their totals, as plain values for `summary.json`."""
    figures = [asdict(lap.figures) for lap in laps]
    frames = np.array([lap.recording.frames for lap in laps], dtype=float)
    others = ("waypoints_reached", "held_frames", "time_s", "path_error_max_m")
    keys = [k for k in figures[0] if k not in others]
    # Frame-weighted means; the spread of the frame time is that of the laps' means, as published.
    totals = {key: float(np.average([f[key] for f in figures], weights=frames)) for key in keys}
    totals["ms_per_frame_sd_of_laps"] = float(np.std([f["ms_per_frame_mean"] for f in figures]))
    totals["path_error_max_m"] = max(f["path_error_max_m"] for f in figures)
    return {
        "track": track.name,
        "waypoints": len(track.waypoints),
        "laps": figures,
        "totals": {
            "time_s": float(sum(f["time_s"] for f in figures)),
            "frames": int(frames.sum()),
            "waypoints_reached": sum(f["waypoints_reached"] for f in figures),
            "waypoints": len(track.waypoints) * len(laps),
            "held_frames": sum(f["held_frames"] for f in figures),
            **totals,
        },
    }
