"""How speed, direction and gait set the rhythm of the steps and the motion of the body.

Sources: walking's step length over step rate is nearly constant, about 0.4 m a Hz (the "walk
ratio", Sekiya et al. 1996), which makes the rate grow with the root of the speed (Grieve & Gear
1966; Inman, Ralston & Todd 1981). The share of a stride that a foot is down falls from 0.68 in a
slow walk to 0.57 at 2 m/s (Murray et al. 1966; Grieve 1968) and from 0.40 in a jog to 0.28 at
5 m/s, while the step rate rises little (Cavanagh & Kram 1989; Weyand et al. 2000).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ambulo.starter_motion.body import LEG
from ambulo.starter_motion.intent import Intent
from ambulo.starter_motion.rotations import Floats, mix, smoothed

GRAVITY = 9.81
# Step length over step rate, metres a Hz: ahead, backwards, sideways; radians a Hz for turning.
WALK_RATIO, BACK_RATIO, SIDE_RATIO, TURN_RATIO = 0.40, 0.30, 0.13, 0.55
LOW_RATIO = 0.32  # in a crouch
SLOWEST = 1.3  # steps a second
# A person whose feet have to move at all: m/s, a turn counting at a hand's breadth from the axis.
MOVING, TURN_ARM = 0.08, 0.25


@dataclass(frozen=True)
class Rhythm:
    """The gait frame by frame, (F,) each."""

    rate: Floats
    """Steps a second that the speed asks for."""
    duty: Floats
    """Share of a stride that a foot is on the ground."""
    ahead: Floats
    """Cosine of the direction of travel: 1 forwards, -1 backwards, 0 sideways; 0 in a stand."""
    moving: Floats
    """1 where the feet have to step, 0 where they may stay."""
    running: Floats
    crouch: Floats
    speed: Floats
    """m/s."""


def rhythm(intent: Intent) -> Rhythm:
    """What the path asks of the legs."""
    left, front = intent.local.T
    speed = intent.speed
    ahead = front / np.maximum(speed, 0.3)
    ratio = mix(mix(BACK_RATIO, WALK_RATIO, 0.5 + 0.5 * ahead), LOW_RATIO, intent.crouch)
    squares = (front / ratio) ** 2 + (left / SIDE_RATIO) ** 2 + (intent.turn / TURN_RATIO) ** 2
    walk_rate = np.clip(squares**0.25, SLOWEST, 3.2)
    run_rate = 2.38 + 0.125 * np.minimum(speed, 5.5)
    rate = smoothed(mix(walk_rate, run_rate, intent.running), 6.0)
    walk_duty = np.clip(0.70 - 0.065 * speed, 0.56, 0.70)
    run_duty = np.clip(0.49 - 0.042 * speed, 0.27, 0.44)
    duty = mix(walk_duty, run_duty, intent.running)
    busy = np.hypot(speed, TURN_ARM * intent.turn) > MOVING
    return Rhythm(rate, duty, ahead, busy.astype(float), intent.running, intent.crouch, speed)


def bob(rate: Floats, step: Floats, running: Floats, crouch: Floats) -> Floats:
    """Height of the hips' up and down (half of it from top to bottom), metres; < 0 where running.

    Walking is a stiff leg that vaults over the foot, flattened to about six tenths by the knee and
    the pelvis (Saunders, Inman & Eberhart 1953): highest in mid-stance. Running is a spring whose
    body falls freely at the top (Blickhan 1989; McMahon & Cheng 1990): lowest in mid-stance.
    """
    half = np.minimum(0.5 * step, 0.7 * LEG)
    vault = 0.5 * 0.64 * (LEG - np.sqrt(LEG**2 - half**2)) * (1.0 - 0.5 * crouch)
    spring = 1.08 * GRAVITY / (2.0 * np.pi * rate) ** 2
    return mix(vault, -spring, running)
