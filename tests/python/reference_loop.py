"""The published run-time loop once more, in float64 numpy and centimetres, from its description.

Holden et al. 2017, sections 5 and 6, and the published demo; written independently of the
controller, so that a wrong sign, frame or order in either shows. No walls, areas or feet.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

NOW, POINTS = 60, 120
Height = Callable[[np.ndarray, np.ndarray], np.ndarray]


def blend(phase: float) -> np.ndarray:
    """Shares of the control points."""
    at = 4.0 * (phase / (2.0 * math.pi) % 1.0)
    k, m = int(at) % 4, at - int(at)
    y0, y1, y2, y3 = np.eye(4)[[(k - 1) % 4, k, (k + 1) % 4, (k + 2) % 4]]
    cubic = -0.5 * y0 + 1.5 * y1 - 1.5 * y2 + 0.5 * y3
    return y1 + 0.5 * m * (y2 - y0) + m * m * (y0 - 2.5 * y1 + 2 * y2 - 0.5 * y3) + m**3 * cubic


def rotation(direction: np.ndarray) -> np.ndarray:
    """Root to world: +Z goes to the direction (x, z)."""
    s, c = direction
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def toward(a: np.ndarray, b: np.ndarray, t: float) -> np.ndarray:
    """Between two directions, the shorter way round."""
    start = math.atan2(*a)
    turn = (math.atan2(*b) - start + math.pi) % (2.0 * math.pi) - math.pi
    return np.array([math.sin(start + turn * t), math.cos(start + turn * t)])


class Reference:
    """One character; lengths in cm, velocities in cm a frame, 60 frames a second."""

    def __init__(self, core: Any, joints: int, height: Height) -> None:
        n = {key: value.astype(float) for key, value in core.normalisation().items()}
        self.layers = [(w.astype(float), b.astype(float)) for w, b in core.layers()]
        self.n, self.joints, self.height = n, joints, height
        self.place = np.zeros((POINTS, 2))
        self.facing = np.tile([0.0, 1.0], (POINTS, 1))
        self.gait = np.zeros((POINTS, 6))
        self.gait[:, 0] = 1.0  # The character has been standing.
        self.ground = np.full(POINTS, self._ground(np.zeros((1, 2)))[0])
        self.root_height = self.ground.copy()
        self.phase, self.strafe, self.crouch = 0.0, 0.0, 0.0
        self.velocity, self.look = np.zeros(2), np.array([0.0, 1.0])
        mean, j = n["output_mean"], joints
        ground = np.array([0.0, self.ground[0], 0.0])
        self.position = mean[32 : 32 + 3 * j].reshape(j, 3) + ground
        self.speed = mean[32 + 3 * j : 32 + 6 * j].reshape(j, 3)
        self.shown, self.root, self.shown_phase = self.position, (np.zeros(2), self.look), 0.0

    def _ground(self, place: np.ndarray) -> np.ndarray:
        return 100.0 * self.height(place[:, 0] / 100.0, place[:, 1] / 100.0).astype(float)

    def _predict(self, x: np.ndarray) -> np.ndarray:
        h, shares = (x - self.n["input_mean"]) / self.n["input_std"], blend(self.phase)
        for index, (w, b) in enumerate(self.layers):
            h = shares @ (w @ h + b)
            if index < len(self.layers) - 1:
                h = np.where(h > 0.0, h, np.expm1(np.minimum(h, 0.0)))
        return h * self.n["output_std"] + self.n["output_mean"]

    def step(self, velocity, gait="walk", facing=None, strafe=0.0) -> None:
        """One frame; `velocity` in metres a second, as the controller takes it."""
        self._wish(np.array(velocity) * 100.0 / 60.0, gait, facing, strafe)
        self._bend()
        y = self._predict(self._input())
        self._pose(y)
        self._advance(y)

    def _wish(self, velocity, gait, facing, strafe) -> None:
        self.velocity = self.velocity * 0.1 + velocity * 0.9
        self.strafe = self.strafe * 0.1 + strafe * 0.9
        self.crouch = self.crouch * 0.1 + (gait == "crouch") * 0.9
        length = float(np.hypot(*self.velocity))
        along = self.velocity / length if length > 1e-3 else self.look
        asked = along if facing is None else np.array(facing) / np.hypot(*facing)
        self.look = toward(self.look, toward(along, asked, self.strafe), 0.9)
        goal = np.zeros(6)
        if length < 0.1:
            goal[0] = 1.0 - length / 0.1
        elif self.crouch > 0.1:
            goal[3] = self.crouch
        else:
            goal[2 if gait in ("jog", "run") else 1] = 1.0
        self.gait[NOW] = self.gait[NOW] * 0.9 + goal * 0.1

    def _bend(self) -> None:
        near = 0.5 + 0.5 * self.strafe
        turn = 2.0 - 1.5 * self.strafe
        bent = self.place.copy()
        for i in range(NOW + 1, POINTS):
            t = (i - NOW) / 60.0
            share = 1.0 - (1.0 - t) ** near
            step = (self.place[i] - self.place[i - 1]) * (1.0 - share) + self.velocity * share
            bent[i] = bent[i - 1] + step
            self.facing[i] = toward(self.facing[i], self.look, 1.0 - (1.0 - t) ** turn)
            self.gait[i] = self.gait[NOW]
        self.place = bent
        self.ground[NOW:] = self._ground(self.place[NOW:])
        self.root_height[NOW:] = self.ground[::10].mean()

    def _input(self) -> np.ndarray:
        samples, inward = np.arange(0, POINTS, 10), rotation(self.facing[NOW])
        flat = lambda v: np.stack([v[:, 0], 0.0 * v[:, 0], v[:, 1]], axis=1)  # noqa: E731
        place = flat(self.place[samples] - self.place[NOW]) @ inward
        facing = flat(self.facing[samples]) @ inward
        gait = self.gait[samples].copy()
        gait[:, 5] = 0.0
        x, z = self.facing[samples].T
        left = 25.0 * np.stack([z, -x], axis=1)
        heights = [
            self._ground(self.place[samples] + left),
            self.ground[samples],
            self._ground(self.place[samples] - left),
        ]
        before, back = NOW - 1, rotation(self.facing[NOW - 1])
        root = [self.place[before][0], self.root_height[before], self.place[before][1]]
        parts = [
            place[:, 0], place[:, 2], facing[:, 0], facing[:, 2], gait.T.ravel(),
            ((self.position - root) @ back).ravel(), (self.speed @ back).ravel(),
            *(h - self.root_height[NOW] for h in heights),
        ]  # fmt: skip
        return np.concatenate(parts)

    def _pose(self, y: np.ndarray) -> None:
        j, outward = self.joints, rotation(self.facing[NOW])
        root = np.array([self.place[NOW][0], self.root_height[NOW], self.place[NOW][1]])
        shown = y[32 : 32 + 3 * j].reshape(j, 3) @ outward.T + root
        self.speed = y[32 + 3 * j : 32 + 6 * j].reshape(j, 3) @ outward.T
        self.position = 0.5 * (self.position + self.speed) + 0.5 * shown
        self.shown, self.shown_phase = shown, self.phase
        self.root = (self.place[NOW].copy(), self.facing[NOW].copy())

    def _advance(self, y: np.ndarray) -> None:
        freedom = (1.0 - self.gait[NOW, 0]) ** 0.25
        outward = rotation(self.facing[NOW])
        for track in (self.place, self.facing, self.gait, self.ground, self.root_height):
            track[:NOW] = track[1 : NOW + 1].copy()
        moved = outward @ [y[0], 0.0, y[1]]
        self.place[NOW] = self.place[NOW] + moved[[0, 2]] * freedom
        yaw = math.atan2(*self.facing[NOW]) - y[2] * freedom
        self.facing[NOW] = [math.sin(yaw), math.cos(yaw)]
        outward, foreseen = rotation(self.facing[NOW]), y[8:32].reshape(4, 6)
        for i in range(NOW + 1, POINTS):
            k = min((i - NOW) // 10, 4)
            m = (i - NOW) / 10.0 - k
            px, pz, dx, dz = foreseen[:, k] * (1.0 - m) + foreseen[:, k + 1] * m
            self.place[i] = self.place[NOW] + (outward @ [px, 0.0, pz])[[0, 2]]
            direction = (outward @ [dx, 0.0, dz])[[0, 2]]
            self.facing[i] = direction / np.hypot(*direction)
        cycles = max(y[3], 0.0) * (0.9 * freedom + 0.1)
        self.phase = (self.phase + 2.0 * math.pi * cycles) % (2.0 * math.pi)
