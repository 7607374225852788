"""Draws `keyed_walk.png`, the README's picture: a gait keyed by hand, in the films' own style.

Joint angles over a cycle follow the textbook curves of level walking (hip ±17°, knee 16° in stance
and 60° in swing, ankle from +11° to −16° at toe-off); no capture and no network is behind it.

    python docs/pictures/keyed_walk.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ambulo.pictures import write_filmstrip
from ambulo.recording import Recording

Array = NDArray[np.floating]
FPS, CYCLE, STRIDE = 60, 1.1, 1.4

# Name, parent, place when standing and facing +Z, metres.
STANDING = (
    ("Hips", -1, (0.0, 0.94, 0.0)), ("Spine", 0, (0.0, 1.08, 0.0)), ("Spine1", 1, (0.0, 1.22, 0.0)),
    ("Neck", 2, (0.0, 1.46, 0.0)), ("Head", 3, (0.0, 1.56, 0.02)),
    ("LeftUpLeg", 0, (0.09, 0.90, 0.0)), ("LeftLeg", 5, (0.09, 0.49, 0.0)),
    ("LeftFoot", 6, (0.09, 0.08, 0.0)), ("LeftToeBase", 7, (0.09, 0.02, 0.15)),
    ("RightUpLeg", 0, (-0.09, 0.90, 0.0)), ("RightLeg", 9, (-0.09, 0.49, 0.0)),
    ("RightFoot", 10, (-0.09, 0.08, 0.0)), ("RightToeBase", 11, (-0.09, 0.02, 0.15)),
    ("LeftArm", 2, (0.18, 1.42, 0.0)), ("LeftForeArm", 13, (0.19, 1.13, 0.0)),
    ("LeftHand", 14, (0.19, 0.88, 0.0)),
    ("RightArm", 2, (-0.18, 1.42, 0.0)), ("RightForeArm", 16, (-0.19, 1.13, 0.0)),
    ("RightHand", 17, (-0.19, 0.88, 0.0)),
)  # fmt: skip


def leg_angles(phase: Array) -> dict[str, Array]:
    """Flexion in degrees over phase in cycles since heel strike."""
    p = phase % 1.0
    knee = _curve(p, [4, 14, 16, 10, 7, 14, 40, 60, 40, 8])
    ankle = _curve(p, [0, -4, 4, 8, 11, 8, -16, -10, 0, 1])
    return {"UpLeg": 8.0 + 17.0 * np.cos(2.0 * np.pi * p), "Leg": -knee, "Foot": ankle}


def _curve(p: Array, keys: list[float]) -> Array:
    """A closed Catmull-Rom curve through evenly spaced keys."""
    at = p * len(keys)
    k, m = int(at), at - int(at)
    a, b, c, d = (keys[(k + i) % len(keys)] for i in (-1, 0, 1, 2))
    return b + m * (c - a + m * (2 * a - 5 * b + 4 * c - d + m * (3 * (b - c) + d - a))) / 2


def rotation(degrees: float) -> Array:
    """Flexion: forward and up about the character's right."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])


def positions(time: float) -> Array:
    """(J, 3) joints at a time in seconds, the lowest foot on the ground."""
    phase = time / CYCLE
    angles = {"Spine": 3.0, "Neck": -3.0}
    for side, ahead in (("Left", phase), ("Right", phase + 0.5)):
        angles |= {side + part: float(a) for part, a in leg_angles(np.array(ahead)).items()}
        swing = np.cos(2.0 * np.pi * (ahead + 0.5))
        angles |= {f"{side}Arm": 4.0 + 20.0 * swing, f"{side}ForeArm": 22.0 + 10.0 * swing}
    place, turn = np.zeros((len(STANDING), 3)), np.zeros((len(STANDING), 3, 3))
    for joint, (name, parent, at) in enumerate(STANDING):
        own = rotation(angles.get(name, 0.0))
        if parent < 0:
            place[joint], turn[joint] = at, own
            continue
        offset = np.array(at) - np.array(STANDING[parent][2])
        place[joint] = place[parent] + turn[parent] @ offset
        turn[joint] = turn[parent] @ own
    feet = [i for i, (name, _, _) in enumerate(STANDING) if name.endswith(("Foot", "ToeBase"))]
    floor = min(place[i, 1] - (0.08 if "Foot" in STANDING[i][0] else 0.02) for i in feet)
    return place - (0.0, floor, 0.0) + (0.0, 0.0, STRIDE * phase)


def main() -> None:
    """Draw the picture beside this file."""
    frames = int(3 * CYCLE * FPS)
    places = np.stack([positions(frame / FPS) for frame in range(frames)])
    root = places[:, 0][:, [0, 2]]
    recording = Recording(
        fps=FPS, names=tuple(n for n, _, _ in STANDING), parents=tuple(p for _, p, _ in STANDING),
        positions=places.astype(np.float32), tips=np.zeros((frames, 0, 3), np.float32),
        tip_joints=(), root=root.astype(np.float32), facing=np.zeros(frames, np.float32),
        gait=np.zeros(frames, int), gait_names=("walk",), leg=np.zeros(frames, int),
        lap=np.zeros(frames, int), contacts=np.zeros((frames, 4), np.float32),
        asked=np.tile(np.array([0.0, STRIDE / CYCLE, np.nan], np.float32), (frames, 1)),
    )  # fmt: skip
    path = Path(__file__).with_suffix(".png")
    write_filmstrip(path, recording, [(0, frames, "keyed walk")], cell=(150, 225))


if __name__ == "__main__":
    main()
