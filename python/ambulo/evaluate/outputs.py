"""What `ambulo walk` writes: motion, pictures and film of the first lap."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from ambulo import _core
from ambulo.evaluate.track import Track
from ambulo.evaluate.walk import FPS, Lap
from ambulo.model import Model
from ambulo.pictures import Shot, write_film, write_filmstrip, write_top_view
from ambulo.recording import Recording
from ambulo.terrain import Terrain

# A shot of each leg: this long, from this long after its start, seconds.
SHOT, SETTLE = 4.0, 3.0


def write_outputs(
    folder: Path,
    laps: Sequence[Lap],
    track: Track,
    model: Model,
    terrain: Terrain,
    film: str,
    on_progress: Callable[[float], None],
) -> list[Path]:
    """Write `walk.bvh`, `top.png`, `strip.png` and `film.gif` (or .mp4) into a folder.

    The film is most of the work: `on_progress` gets the share that is done (0 to 1).
    """
    first = laps[0].recording
    points = np.array([w.position for w in track.waypoints])
    shots = leg_shots(first, track)
    written = [folder / "walk.bvh", folder / "top.png", folder / "strip.png"]
    write_bvh(written[0], laps[0], model)
    paths = Recording.joined([lap.recording for lap in laps])
    write_top_view(written[1], paths, points, track.reach, title=f"track '{track.name}'")
    write_filmstrip(written[2], first, shots, terrain=terrain)
    on_progress(0.1)
    if film != "none":
        written.append(folder / f"film.{film}")

        def filmed(done: int, total: int) -> None:
            on_progress(0.1 + 0.9 * done / total)

        write_film(written[-1], first, shots, terrain=terrain, waypoints=points, progress=filmed)
    return written


def leg_shots(recording: Recording, track: Track) -> list[Shot]:
    """A few seconds of every leg, once the character has settled into it."""
    shots = []
    for leg, waypoint in enumerate(track.waypoints):
        frames = np.flatnonzero(recording.leg == leg)
        if not len(frames):
            continue
        length = min(int(SHOT * FPS), len(frames))
        start = int(frames[0]) + min(int(SETTLE * FPS), len(frames) - length)
        strafing = ", strafing" if waypoint.strafe else ""
        shots.append((start, start + length, f"{leg} {waypoint.gait}{strafing}"))
    return shots


def write_bvh(path: Path, lap: Lap, model: Model) -> None:
    """Write a lap as BVH, in centimetres."""
    skeleton = model.header["parts"]["skeleton"]
    clip = _core.Clip.from_arrays(
        names=list(model.names),
        parents=list(model.parents),
        offsets=np.array([joint["offset"] for joint in skeleton], dtype=float),
        fps=float(FPS),
        rotations=lap.rotations.astype(float),
        root=lap.recording.positions[:, 0].astype(float),
    )
    _core.write_motion(str(path), clip.converted("ambulo", "cm"))
