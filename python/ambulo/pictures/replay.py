"""Which part of a recorded episode is shown, by the task: strip and gait diagram as files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from PIL import Image

from ambulo.files import replacing
from ambulo.pictures.creature import write_creature_strip
from ambulo.pictures.gait import draw_gait
from ambulo.rollout import Rollout

# Poses of a strip, and how many periods they cover; seconds of it where there is no period, and of
# a jump, which is over soon.
POSES, PERIODS, STRIP_S, JUMP_S = 8, 1.5, 1.2, 2.0
# Seconds of a gait diagram.
GAIT_S = 4.0


def strip_picture(
    path: Path, rollout: Rollout, judgement: Mapping[str, Any], task: str, title: str
) -> Path:
    """Poses of a gait late in the episode; of a jump from its beginning. Gives `path`."""
    if task == "jump":
        start, length = 0, round(JUMP_S / rollout.dt)
    else:
        length = round((PERIODS * (judgement["period_s"] or STRIP_S / PERIODS)) / rollout.dt)
        start = max(rollout.steps - length - rollout.steps // 8, 0)
    stop = min(start + max(length, POSES), rollout.steps)
    return write_creature_strip(path, rollout, poses=POSES, start=start, stop=stop, title=title)


def gait_picture(
    path: Path, rollout: Rollout, judgement: Mapping[str, Any], task: str, title: str
) -> Path:
    """Which foot is down when, late in the episode; of a jump from its beginning. Gives `path`."""
    length = round(GAIT_S / rollout.dt)
    start = 0 if task == "jump" else max(rollout.steps - length, 0)
    said = "usable" if judgement["usable"] else "not usable: " + "; ".join(judgement["reasons"])
    picture = draw_gait(
        rollout, start=start, stop=min(start + length, rollout.steps), title=title,
        notes=[_plain(said)], period_s=judgement["period_s"],
    )  # fmt: skip
    with replacing(path) as part:
        Image.fromarray(picture).save(part, "PNG")
    return path


def _plain(text: str) -> str:
    """Without the signs that the pictures' typeface lacks."""
    return text.replace("−", "-").replace("–", "-").replace("×", "x")
