"""A camera for scenes: it follows smoothly, from the side on which least is in the way.

Twice a second every direction is judged by what stands between it and the character's body, hands
and targets, and by how well a movement shows from there; the cheapest course through all of them,
turning included, is the camera's. What stands in the way all the same is looked through.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ambulo.pictures.drawing import SUN, Array, Camera, unit
from ambulo.pictures.mannequin import Mannequin
from ambulo.pictures.scene_set import TERRAIN, Props
from ambulo.pictures.solids import Boxes, faces_of
from ambulo.pictures.stage import FIELD_OF_VIEW, between, heights, place_camera, smooth
from ambulo.scene_recording import SceneRecording

BEAT = 0.5  # seconds between judgements
DIRECTIONS = 36
FIGURE = 0.42  # the character's part of the picture's height
RISE, MIDDLE = 1.12, 0.46  # of the stature: the eye, and what is at half picture height
BEST = 1.1  # radians from where the character faces: an interaction shows best from here
HIDDEN, ASIDE, TURN = 2.5, 0.6, 0.10  # what hiding, a poor side and a turn of a direction cost
GLASS, AJAR = 0.22, 0.40  # how firm a wall is that is looked through, and a door
AROUND = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
MARKS = ("head", "left wrist", "right wrist", "left knee", "right knee")


class Watch:
    """Where the camera is during a recording."""

    def __init__(self, recording: SceneRecording, props: Props, mannequin: Mannequin) -> None:
        self.recording, self.props, self.stature = recording, props, mannequin.stature
        self.joints = [mannequin.marks[m] for m in MARKS if m in mannequin.marks] or [0]
        self.distance = self.stature / (FIGURE * 2.0 * np.tan(0.5 * FIELD_OF_VIEW))
        last = recording.frames - 1
        self.beats = np.linspace(0.0, last, max(round(last / recording.fps / BEAT), 1) + 1)
        facing = np.unwrap(np.asarray(recording.character.facing, np.float64))
        self.facing = between(smooth(facing, 0.4, 1.0 / recording.fps), self.beats)
        self.side = self._course()
        self.light = self._light()

    def cameras(self, frames: ArrayLike, size: tuple[int, int]) -> list[Camera]:
        """One camera a (fractional) frame, the frames in order."""
        frames = np.asarray(frames, np.float64)
        recording = self.recording
        dt = 1.0 / recording.fps
        root = np.asarray(recording.character.root, np.float64)
        path = smooth(root, 0.25, dt)
        ground = smooth(heights(recording.heights, root), 0.5, dt)
        beat = float(self.beats[-1] / max(len(self.beats) - 1, 1)) / recording.fps
        side = smooth(self.side, 0.8, max(beat, 1e-3)) if len(self.side) > 1 else self.side
        side = np.interp(np.arange(len(root)), self.beats, side)
        side = smooth(side, 0.3, dt)  # takes the corners off the beats
        away = np.stack([np.sin(side), np.cos(side)], -1)
        floor = heights(recording.heights, path + self.distance * away) + 0.5 * self.stature
        rise = smooth(np.maximum(floor - ground, RISE * self.stature), 0.5, dt)
        tracks = np.column_stack([path[:, 0], ground, path[:, 1], side, rise])
        return [
            place_camera(
                row[:3], float(row[3]) + np.pi, size, distance=self.distance, rise=float(row[4]),
                middle=MIDDLE * self.stature,
            )
            for row in between(tracks, frames)
        ]  # fmt: skip

    def solidity(self, frames: ArrayLike, cameras: list[Camera]) -> list[dict[int, float]]:
        """How firm to draw what stands before the character, by owner, one each frame."""
        frames = np.asarray(frames, np.float64)
        tall = sorted(self.props.tall())
        if not tall:
            return [{} for _ in cameras]
        hidden = np.zeros((len(cameras), len(tall)))
        for i, (frame, camera) in enumerate(zip(frames, cameras, strict=True)):
            boxes = self._in_the_way(float(frame))
            hits = _between(camera.eye[None], self._points(float(frame)), boxes)[0]
            for k, owner in enumerate(tall):
                hidden[i, k] = hits[:, boxes.owner == owner].any(1).mean() if len(boxes) else 0.0
        wanted = np.clip(hidden / 0.25, 0.0, 1.0)
        if len(frames) > 1:
            dt = float(frames[1] - frames[0]) / self.recording.fps
            wanted = np.clip(smooth(wanted, 0.15, dt), 0.0, 1.0)
        least = [GLASS if owner < self.props.first else AJAR for owner in tall]
        return [
            {
                owner: 1.0 - (1.0 - low) * float(way)
                for owner, low, way in zip(tall, least, row, strict=True)
                if way > 0.03
            }
            for row in wanted
        ]

    def _light(self) -> Array:
        """(3,) sunlight from behind the camera, from the side that lights more of what is seen."""
        yaw = self.side + np.pi
        mean = float(np.arctan2(np.sin(yaw).mean(), np.cos(yaw).mean()))
        axes = Camera(np.zeros(3), mean, 1.0, 0.0, (1, 1)).axes
        faces = faces_of(self.props.still)
        root = np.asarray(self.recording.character.root, np.float64).mean(0)
        middle = faces.corners.mean(1)
        near = np.hypot(middle[:, 0] - root[0], middle[:, 2] - root[1])
        across = np.cross(
            faces.corners[:, 2] - faces.corners[:, 0], faces.corners[:, 3] - faces.corners[:, 1]
        )
        seen = np.maximum(-across @ axes[2], 0.0) * np.exp(-near / 6.0)
        right, left = unit(SUN) @ axes, unit(SUN * [-1.0, 1.0, 1.0]) @ axes
        lit = [float((seen * np.maximum(-faces.normal @ d, 0.0)).sum()) for d in (right, left)]
        return left if lit[1] > 1.05 * lit[0] + 1e-9 else right

    # Judging --------------------------------------------------------------------------------

    def _course(self) -> Array:
        """(B,) radians, unwrapped: the direction from the character to the camera at each beat."""
        angles: Array = np.arange(DIRECTIONS) * np.float64(2.0 * np.pi / DIRECTIONS)
        costs = np.array([self._cost(float(f), a, angles) for f, a in zip(
            self.beats, self.facing, strict=True)])  # fmt: skip
        off = np.abs(np.arange(DIRECTIONS)[:, None] - np.arange(DIRECTIONS))
        turn = TURN * np.minimum(off, DIRECTIONS - off).astype(np.float64) ** 2
        total, back = costs[0], []
        for row in costs[1:]:
            ways = total[:, None] + turn
            back.append(ways.argmin(0))
            total = ways.min(0) + row
        course = [int(total.argmin())]
        for step in reversed(back):
            course.append(int(step[course[-1]]))
        return np.unwrap(angles[course[::-1]]).astype(np.float64)

    def _cost(self, frame: float, facing: float, angles: Array) -> Array:
        """(D,) what it costs to look from each of `angles`."""
        root = between(self.recording.character.root, np.array([frame]))
        ground = float(heights(self.recording.heights, root)[0])
        away = np.stack([np.sin(angles), np.zeros(len(angles)), np.cos(angles)], -1)
        eyes = np.array([root[0, 0], ground + RISE * self.stature, root[0, 1]])
        eyes = eyes + self.distance * away
        hits = _between(eyes, self._points(frame), self._in_the_way(frame))
        hidden = hits.any(2).mean(1)
        floor = heights(self.recording.heights, eyes[:, [0, 2]])
        hidden = hidden + (floor > ground + RISE * self.stature)
        aside = np.abs(np.remainder(angles - facing + np.pi, 2.0 * np.pi) - np.pi)
        return HIDDEN * hidden + ASIDE * (1.0 - np.cos(aside - BEST))

    def _points(self, frame: float) -> Array:
        """(P, 3) what should be seen."""
        at = np.array([frame])
        points = between(self.recording.character.positions, at)[0][self.joints]
        feet = between(self.recording.character.root, at) + 0.45 * self.stature * AROUND
        low = heights(self.recording.heights, feet) + 0.06 * self.stature
        around = np.stack([feet[:, 0], low, feet[:, 1]], -1)
        return np.concatenate([points, self.recording.targets_at(frame), around])

    def _in_the_way(self, frame: float) -> Boxes:
        """Boxes large enough to hide something; sloping ground is not a box."""
        every = Boxes.joined([self.props.still, self.props.ground, self.props.movers(frame)])
        tops = every.corners[:, [2, 3, 6, 7], 1]
        slopes = (every.look == TERRAIN) & (np.ptp(tops, axis=1) > 0.01)
        return every.take((every.half.max(1) > 0.15) & ~slopes)


def _between(eyes: Array, points: Array, boxes: Boxes) -> NDArray[np.bool_]:
    """(E, P, N) whether the line from each eye (E, 3) to each point (P, 3) meets each box."""
    start = np.einsum("nij,enj->eni", boxes.axes, eyes[:, None] - boxes.centre)[:, None]
    end = np.einsum("nij,pnj->pni", boxes.axes, points[:, None] - boxes.centre)[None]
    way = 0.97 * (end - start)  # what touches the point itself is not in its way
    way = np.where(np.abs(way) < 1e-9, 1e-9, way)
    near, far = (-boxes.half - start) / way, (boxes.half - start) / way
    first, last = np.minimum(near, far).max(-1), np.maximum(near, far).min(-1)
    return (first < last) & (last > 0.0) & (first < 1.0)
