"""A smooth mannequin over the joints of a skeleton: joint positions in, rounded cones out.

Joints are recognised by name (LAFAN1, CMU, Mixamo, Unreal and kin). A skeleton without two legs,
two arms and a head gets a plain cone a bone instead. Measures are of a person of 1.75 m and are
scaled to the stature of the skeleton; the tints tell left from right.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from ambulo.pictures.drawing import Array, Cones, unit
from ambulo.recording import Heights, Recording

BODY = (0.56, 0.59, 0.64)
LEFT = (0.88, 0.63, 0.44)
RIGHT = (0.37, 0.61, 0.70)
DARK = (0.17, 0.20, 0.25)

# Landmark -> the stems of joint names, best first, with side and digits taken off.
SIDED = {
    "hip": ("upleg", "upperleg", "thigh", "femur", "hip"),
    "knee": ("leg", "lowerleg", "shin", "calf", "tibia", "knee"),
    "ankle": ("foot", "ankle"),
    "toe": ("toebase", "toe", "toes", "ball"),
    "shoulder": ("arm", "upperarm", "humerus", "shoulder"),
    "elbow": ("forearm", "lowerarm", "radius", "elbow"),
    "wrist": ("wrist", "hand"),
}
REQUIRED = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")


def _stem(name: str) -> tuple[str, str]:
    """Side ("left", "right" or "") and the bare lower-case stem of a joint name."""
    name = name.split(":")[-1]
    for side in ("left", "right"):
        letter = side[0]
        pattern = (
            rf"(?i:{side})|^{letter}(?=[A-Z_.])|^{letter.upper()}(?=[A-Z_.])"
            rf"|[_.](?i:{letter})(?=$|[_.\d])"
        )
        if re.search(pattern, name):
            bare = re.sub(pattern, "", name, count=1)
            return side, re.sub(r"[^a-z]", "", bare.lower())
    lower = re.sub(r"[^a-z]", "", name.lower())
    sided = {stem for stems in SIDED.values() for stem in stems}
    for side in ("left", "right"):  # CMU writes lfemur
        if lower[:1] == side[0] and lower[1:] in sided:
            return side, lower[1:]
    return "", lower


def landmarks(names: tuple[str, ...]) -> dict[str, int]:
    """Joint index of each landmark found: "left hip", "right wrist", "head", ..."""
    stems = [_stem(name) for name in names]
    found: dict[str, int] = {}
    for side in ("left", "right"):
        for mark, choices in SIDED.items():
            for choice in choices:
                if (side, choice) in stems:
                    found[f"{side} {mark}"] = stems.index((side, choice))
                    break
    if ("", "head") in stems:
        found["head"] = stems.index(("", "head"))
    return found


@dataclass
class _Heap:
    """Cones being collected, in units of the stature of a person of 1.75 m."""

    scale: float

    def __post_init__(self) -> None:
        self.rows: list[tuple] = []

    def add(
        self,
        a: Array,
        b: Array,
        ra: float,
        rb: float,
        colour: tuple[float, float, float],
        axis: Array | None = None,
        squash: float = 1.0,
    ) -> None:
        """A cone from `a` to `b` (metres), radii `ra`, `rb` (scaled)."""
        axis = np.array([1.0, 0.0, 0.0]) if axis is None else axis
        self.rows.append((a, b, ra * self.scale, rb * self.scale, axis, squash, colour))

    def cones(self) -> Cones:
        """All of them."""
        a, b, ra, rb, axis, squash, colour = zip(*self.rows, strict=True)
        return Cones(
            np.array(a, np.float64),
            np.array(b, np.float64),
            np.array(ra, np.float64),
            np.array(rb, np.float64),
            np.array(axis, np.float64),
            np.array(squash, np.float64),
            np.array(colour, np.float64),
        )


class Mannequin:
    """The body of one recording's character, measured once and posed every frame."""

    def __init__(self, recording: Recording, terrain: Heights) -> None:
        self.parents = recording.parents
        self.tip_joints = recording.tip_joints
        self.marks = landmarks(recording.names)
        self.terrain = terrain
        wanted = [f"{side} {mark}" for side in ("left", "right") for mark in REQUIRED] + ["head"]
        sample = np.linspace(0, recording.frames - 1, min(recording.frames, 200)).astype(int)
        positions = np.asarray(recording.positions, np.float64)[sample]
        self.human = all(mark in self.marks for mark in wanted) and self._upright(positions)
        self.lengths = self._bone_lengths(positions)
        self.spine = self._spine_chain() if self.human else []
        self.stature = self._stature(positions)
        self.scale = self.stature / 1.75
        if self.human:
            self._measure_feet(positions)

    def cones(self, joints: Array, tips: Array) -> Cones:
        """The body at joint positions (J, 3) and tips (K, 3), metres."""
        joints, tips = np.asarray(joints, np.float64), np.asarray(tips, np.float64)
        heap = _Heap(self.scale)
        if self.human:
            self._torso_and_head(heap, joints, tips)
            for side, colour in (("left", LEFT), ("right", RIGHT)):
                self._leg(heap, joints, side, colour)
                self._arm(heap, joints, tips, side, colour)
        else:
            self._plain(heap, joints, tips)
        return heap.cones()

    def _upright(self, positions: Array) -> bool:
        """Whether the trunk stands more than it lies: captured dogs have arms by name, too."""
        arms = (
            positions[:, self.marks["left shoulder"]] + positions[:, self.marks["right shoulder"]]
        )
        trunk = arms - positions[:, self.marks["left hip"]] - positions[:, self.marks["right hip"]]
        level = np.linalg.norm(trunk[:, [0, 2]], axis=-1)
        return bool(np.median(trunk[:, 1] - level) > 0.0)

    # Measuring ------------------------------------------------------------------------------

    def _bone_lengths(self, positions: Array) -> Array:
        """(J,) metres from each joint to its parent, 0 for the root: medians over the frames."""
        parents = np.array([i if p < 0 else p for i, p in enumerate(self.parents)])
        return np.median(np.linalg.norm(positions - positions[:, parents], axis=-1), axis=0)

    def _spine_chain(self) -> list[int]:
        """The joints from the root's first child to the head."""
        chain, joint = [], self.marks["head"]
        while joint >= 0:
            chain.append(joint)
            joint = self.parents[joint]
        return chain[::-1]

    def _stature(self, positions: Array) -> float:
        """Metres from sole to crown when standing straight."""
        if not self.human:
            extent = positions.max(1) - positions.min(1)
            return float(max(np.median(extent.max(-1)), 0.1))
        leg = sum(self.lengths[self.marks[f"left {mark}"]] for mark in ("knee", "ankle"))
        hips = 0.5 * (positions[:, self.marks["left hip"]] + positions[:, self.marks["right hip"]])
        away = np.median(np.linalg.norm(positions[:, self.spine] - hips[:, None], axis=-1), 0)
        first = int(away.argmin())
        trunk = away[first] + sum(self.lengths[j] for j in self.spine[first + 1 :])
        return float(max((leg + trunk) / 0.885, 0.1))  # the part of it that is below the skull

    def _measure_feet(self, positions: Array) -> None:
        """How the feet lie when flat on the ground, from the frames in which they do."""
        self.sole_pitch, self.toe_height = {}, {}
        for side in ("left", "right"):
            ankle = positions[:, self.marks[f"{side} ankle"]]
            toe_joint = self.marks.get(f"{side} toe")
            if toe_joint is None:
                continue
            toe = positions[:, toe_joint]
            low = [p[:, 1] - self.terrain.height(p[:, 0], p[:, 2]) for p in (ankle, toe)]
            flat = np.logical_and(*(v <= np.quantile(v, 0.45) for v in low))
            flat = flat if flat.any() else np.ones(len(toe), bool)
            foot = np.median((toe - ankle)[flat][:, 1])
            reach = max(float(self.lengths[toe_joint]), 1e-3)
            self.sole_pitch[side] = float(np.arcsin(np.clip(foot / reach, -0.9, 0.5)))
            self.toe_height[side] = float(np.median(low[1][flat]))

    # Building -------------------------------------------------------------------------------

    def _mark(self, joints: Array, name: str) -> Array:
        return joints[self.marks[name]]

    def _tip(self, tips: Array, joint: int, at: Array) -> Array | None:
        """Direction and length (3,) from a joint to its end site; None where there is none."""
        for k, owner in enumerate(self.tip_joints):
            if owner == joint and float(np.linalg.norm(tips[k] - at)) > 0.02 * self.scale:
                return tips[k] - at
        return None

    def _torso_and_head(self, heap: _Heap, joints: Array, tips: Array) -> None:
        s = self.scale
        hip_left, hip_right = self._mark(joints, "left hip"), self._mark(joints, "right hip")
        arm_left = self._mark(joints, "left shoulder")
        arm_right = self._mark(joints, "right shoulder")
        hips, arms = 0.5 * (hip_left + hip_right), 0.5 * (arm_left + arm_right)
        head = self._mark(joints, "head")
        up = unit(arms - hips)
        pelvis_side, chest_side = unit(hip_left - hip_right), unit(arm_left - arm_right)
        pelvis_front = unit(np.cross(pelvis_side, up))
        chest_front = unit(np.cross(chest_side, up))
        bend = self._spine_bend(joints, hips, arms)

        def trunk(part: float, front: float = 0.0) -> Array:
            """A point of the trunk: 0 at the hips, 1 between the shoulders."""
            curve = 4.0 * part * (1.0 - part)
            return hips + part * (arms - hips) + curve * bend + front * s * chest_front

        # One flattened column from the seat to the breast: each part starts as the last one ends.
        seat = hips + 0.030 * s * up - 0.008 * s * pelvis_front
        waist, ribs, breast = trunk(0.36, 0.008), trunk(0.60, 0.012), trunk(0.80, 0.004)
        front = unit(pelvis_front + chest_front)
        heap.add(seat, waist, 0.146, 0.123, BODY, pelvis_front, 0.76)
        heap.add(waist, ribs, 0.123, 0.146, BODY, front, 0.74)
        heap.add(ribs, breast, 0.146, 0.148, BODY, chest_front, 0.74)
        for sign in (-1.0, 1.0):  # seat and breast have a left and a right
            heap.add(
                hips + sign * 0.056 * s * pelvis_side - 0.020 * s * pelvis_front, seat,
                0.094, 0.104, BODY,
            )  # fmt: skip
            pit = trunk(0.72, 0.026) + sign * 0.062 * s * chest_side
            heap.add(pit, breast, 0.088, 0.10, BODY)
        # Shoulders: slopes from the neck to the arms.
        nape = arms + 0.075 * s * up - 0.012 * s * chest_front
        for arm in (arm_left, arm_right):
            heap.add(trunk(0.93), arm, 0.094, 0.061, BODY, chest_front, 0.88)
            heap.add(nape, arm + 0.012 * s * up, 0.066, 0.052, BODY)
        self._head(heap, joints, tips, nape, head, chest_side)

    def _spine_bend(self, joints: Array, hips: Array, arms: Array) -> Array:
        """(3,) how far the middle of the spine leaves the line from the hips to the shoulders.

        Only the part that changes with the pose counts as a bend; a skeleton's own spine runs
        behind that line, which the flesh hides, so half of it is kept.
        """
        line = arms - hips
        length = max(float(line @ line), 1e-9)
        inner = [joints[j] for j in self.spine[1:-1]]
        parts = [float((p - hips) @ line) / length for p in inner]
        middle = [p - hips - t * line for p, t in zip(inner, parts, strict=True) if 0.2 < t < 0.8]
        return 0.5 * np.mean(middle, axis=0) if middle else np.zeros(3)

    def _head(
        self, heap: _Heap, joints: Array, tips: Array, nape: Array, head: Array, side: Array
    ) -> None:
        s = self.scale
        tip = self._tip(tips, self.marks["head"], head)
        base = joints[self.parents[self.marks["head"]]] if self.marks["head"] else nape
        rise = tip if tip is not None else head - base
        # A neck leans forward by nature; the head above it does not.
        front = unit(np.cross(side, rise))
        up = unit(unit(rise) - (0.0 if tip is not None else 0.28) * front)
        front = unit(np.cross(side, up))
        side = np.cross(up, front)
        skull = head + 0.068 * s * up + 0.022 * s * front
        heap.add(nape, head + 0.02 * s * up, 0.062, 0.056, BODY)
        heap.add(
            skull + 0.022 * s * up - 0.010 * s * front, skull - 0.052 * s * up + 0.030 * s * front,
            0.104, 0.064, BODY, side, 0.80,
        )  # fmt: skip
        eyes = skull + 0.002 * s * up + 0.056 * s * front
        heap.add(eyes + 0.034 * s * side, eyes - 0.034 * s * side, 0.034, 0.034, DARK, up, 0.62)

    def _leg(
        self, heap: _Heap, joints: Array, side: str, colour: tuple[float, float, float]
    ) -> None:
        s = self.scale
        hip, knee, ankle = (self._mark(joints, f"{side} {m}") for m in ("hip", "knee", "ankle"))
        left = unit(self._mark(joints, "left hip") - self._mark(joints, "right hip"))
        shin = unit(knee - ankle)
        back = unit(np.cross(shin, left))
        groin = hip + 0.20 * (knee - hip)
        heap.add(hip, groin, 0.083, 0.083, BODY)
        heap.add(groin, knee, 0.083, 0.056, colour)
        calf = ankle + 0.70 * (knee - ankle) + 0.012 * s * back
        heap.add(knee, calf, 0.055, 0.053, colour)
        heap.add(calf, ankle, 0.053, 0.036, colour)
        heap.add(knee, ankle, 0.054, 0.034, colour)
        if f"{side} toe" in self.marks:
            self._foot(heap, ankle, self._mark(joints, f"{side} toe"), shin, left, side, colour)

    def _foot(
        self,
        heap: _Heap,
        ankle: Array,
        toe: Array,
        shin: Array,
        left: Array,
        side: str,
        colour: tuple[float, float, float],
    ) -> None:
        s = self.scale
        instep = unit(toe - ankle)
        # Shin and instep span the foot's upright plane; they are never one line but come near it
        # on tiptoe, where the hips' own axis keeps the foot from rolling over.
        across = unit(unit(np.cross(shin, instep)) * 0.6 + left * 0.4)
        across = unit(across - instep * float(across @ instep))
        normal = np.cross(instep, across)  # up, out of the instep
        pitch = self.sole_pitch[side]
        forward = np.cos(pitch) * instep - np.sin(pitch) * normal
        up = np.cos(pitch) * normal + np.sin(pitch) * instep
        sole = toe - self.toe_height[side] * up  # on the sole, under the ball of the foot
        reach = float((toe - ankle) @ forward)
        heel = sole - (reach + 0.038 * s) * forward + 0.034 * s * up
        ball = sole + 0.031 * s * up
        inside = -across if side == "left" else across
        heap.add(ankle, heel, 0.037, 0.036, colour)
        heap.add(heel, ball, 0.036, 0.046, colour, up, 0.78)
        heap.add(ankle + 0.006 * s * forward, ball, 0.038, 0.040, colour, up, 0.80)
        # The toes stay flat on the ground while the heel lifts.
        end = ball + 0.052 * s * forward - 0.006 * s * up + 0.008 * s * inside
        floor = float(self.terrain.height(end[0:1], end[2:3])[0]) + 0.024 * s
        end = end + np.array([0.0, max(floor - end[1], 0.0), 0.0])
        heap.add(ball, end, 0.046, 0.037, colour, up, 0.66)

    def _arm(
        self,
        heap: _Heap,
        joints: Array,
        tips: Array,
        side: str,
        colour: tuple[float, float, float],
    ) -> None:
        s = self.scale
        arm, elbow, wrist = (
            self._mark(joints, f"{side} {m}") for m in ("shoulder", "elbow", "wrist")
        )
        deltoid, belly = arm + 0.30 * (elbow - arm), elbow + 0.28 * (wrist - elbow)
        heap.add(arm, deltoid, 0.060, 0.053, colour)
        heap.add(deltoid, elbow, 0.053, 0.041, colour)
        heap.add(elbow, belly, 0.041, 0.043, colour)
        heap.add(belly, wrist, 0.043, 0.028, colour)
        along = unit(wrist - elbow)
        tip = self._tip(tips, self.marks[f"{side} wrist"], wrist)
        hand = unit(tip) if tip is not None else along
        left = unit(self._mark(joints, "left shoulder") - self._mark(joints, "right shoulder"))
        knuckles = wrist + 0.085 * s * hand
        palm = unit(left - hand * float(left @ hand))
        heap.add(wrist + 0.015 * s * hand, knuckles, 0.032, 0.040, colour, palm, 0.66)
        curl = unit(hand - 0.35 * (palm if side == "left" else -palm))
        heap.add(knuckles, knuckles + 0.065 * s * curl, 0.036, 0.024, colour, palm, 0.62)

    def _plain(self, heap: _Heap, joints: Array, tips: Array) -> None:
        """A cone a bone, as thick as its length and the character's size suggest."""
        bones = [(p, i) for i, p in enumerate(self.parents) if p >= 0]
        ends = [(joints[p], joints[i]) for p, i in bones]
        ends += [(joints[j], tips[k]) for k, j in enumerate(self.tip_joints)]
        for a, b in ends:
            length = float(np.linalg.norm(b - a)) / self.scale
            if length > 1e-4:
                radius = min(max(0.22 * length, 0.018), 0.085)
                heap.add(a, b, radius, 0.75 * radius, BODY)
        if not heap.rows:
            heap.add(joints[0], joints[0], 0.1, 0.1, BODY)
