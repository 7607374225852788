"""The person who walks: 1.75 m tall, in T-pose at rest, every joint's axes along the world's.

Segment lengths follow Drillis & Contini (1966) as shares of stature (thigh 0.245, shank 0.246,
upper arm 0.186, forearm 0.146), rounded to half centimetres and with the joint centres inside.
"""

from __future__ import annotations

import numpy as np

from ambulo.starter_motion.rotations import Floats

THIGH, SHANK = 0.43, 0.42
LEG = THIGH + SHANK
ANKLE = 0.085  # height of the ankle over a flat sole
BALL = 0.028  # height of the toe joint, over the ball of the foot
UPPER_ARM, FOREARM = 0.300, 0.255
HIP_SIDE, HIP_DROP = 0.092, 0.02

# In the foot's own axes, from the ankle (metres).
TO_HEEL = np.array([0.0, -ANKLE, -0.050])
TO_TOE = np.array([0.0, BALL - ANKLE, 0.145])
# From the toe joint to the sole below the tip of the toes.
TO_TIP = np.array([0.0, -BALL, 0.070])

# Standing upright with straight knees.
HIPS_HEIGHT = ANKLE + LEG + HIP_DROP

LEFT, RIGHT = 0, 1
SIDES = ("Left", "Right")
SIGNS = (1.0, -1.0)  # +X is left


def _skeleton() -> tuple[tuple[str, ...], tuple[int, ...], Floats]:
    rows: list[tuple[str, str, tuple[float, float, float]]] = [("Hips", "", (0.0, 0.0, 0.0))]
    for side, x in zip(SIDES, SIGNS, strict=True):
        rows += [
            (f"{side}UpLeg", "Hips", (x * HIP_SIDE, -HIP_DROP, 0.0)),
            (f"{side}Leg", f"{side}UpLeg", (0.0, -THIGH, 0.0)),
            (f"{side}Foot", f"{side}Leg", (0.0, -SHANK, 0.0)),
            (f"{side}Toe", f"{side}Foot", (TO_TOE[0], TO_TOE[1], TO_TOE[2])),
        ]
    rows += [
        ("Spine", "Hips", (0.0, 0.085, -0.012)),
        ("Spine1", "Spine", (0.0, 0.115, -0.004)),
        ("Spine2", "Spine1", (0.0, 0.115, -0.002)),
        ("Neck", "Spine2", (0.0, 0.225, -0.004)),
        ("Head", "Neck", (0.0, 0.110, 0.022)),
    ]
    for side, x in zip(SIDES, SIGNS, strict=True):
        rows += [
            (f"{side}Shoulder", "Spine2", (x * 0.050, 0.165, 0.004)),
            (f"{side}Arm", f"{side}Shoulder", (x * 0.125, -0.006, -0.008)),
            (f"{side}ForeArm", f"{side}Arm", (x * UPPER_ARM, 0.0, 0.0)),
            (f"{side}Hand", f"{side}ForeArm", (x * FOREARM, 0.0, 0.0)),
        ]
    names = tuple(name for name, _, _ in rows)
    parents = tuple(names.index(parent) if parent else -1 for _, parent, _ in rows)
    return names, parents, np.array([offset for _, _, offset in rows])


NAMES, PARENTS, OFFSETS = _skeleton()
"""22 joints, parents before their children; offsets (22, 3) in metres."""


def joint(name: str, side: int | None = None) -> int:
    """Index of a joint; a bare name and a side give the left or the right one."""
    return NAMES.index(name if side is None else SIDES[side] + name)
