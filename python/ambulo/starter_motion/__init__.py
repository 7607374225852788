"""Human locomotion made by rule, not captured: for tests, demonstrations and newcomers.

    >>> from ambulo.starter_motion import clips
    >>> first = next(clips(seed=0))
    >>> first.name, first.clip.fps
    ('stand_00', 60.0)

The clips are nobody's recording: footprints are planned along a wished path, the body is posed
over them by rules from the gait literature (named where they are used), and chance is seeded.
"""

from ambulo.starter_motion.ground import Ground, Level, Slopes, Stairs
from ambulo.starter_motion.intent import GAITS, Wish
from ambulo.starter_motion.perform import StarterClip, perform
from ambulo.starter_motion.repertoire import MINUTES, Planned, clips, plan

__all__ = [
    "GAITS",
    "MINUTES",
    "Ground",
    "Level",
    "Planned",
    "Slopes",
    "Stairs",
    "StarterClip",
    "Wish",
    "clips",
    "perform",
    "plan",
]
