"""What `ambulo scene run` writes: a plan, a strip, and films of a visit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ambulo.pictures import write_scene_film, write_scene_plan, write_scene_strip
from ambulo.scene import Happened, Visited
from ambulo.scene_recording import SceneRecording

BEFORE, AFTER = 1.0, 0.7  # seconds shown before an interaction's clip begins and after it is over
LONGEST = 15.0  # seconds of one interaction's film
HELD = 0.6  # seconds after a hold has begun at which it is photographed, if it lasts that long
ENDS = ("ended", "broken")


@dataclass(frozen=True)
class Reel:
    """A film that is to be made."""

    file: str
    title: str
    start: float
    stop: float

    def pictures(self, fps: int) -> int:
        """How many it has."""
        return max(int((self.stop - self.start) * fps + 1e-6), 1)


def interactions(happened: Sequence[Happened]) -> list[list[Happened]]:
    """What happened in each interaction that was begun, from its entering on."""
    found: list[list[Happened]] = []
    for one in happened:
        if one["what"] == "enters":
            found.append([one])
        elif found and found[-1][-1]["what"] not in ENDS and one["what"] != "walks":
            found[-1].append(one)
    return found


def reels(visit: Visited, suffix: str, duration: float, *, every: bool = False) -> list[Reel]:
    """A film for each kind of interaction, of the first that was played to its end, or for `every`.

    Their numbers are those on the plan.
    """
    stories = list(enumerate(interactions(visit["happened"]), 1))
    if not every:
        whole_first = sorted(stories, key=lambda pair: pair[1][-1]["what"] != "ended")
        firsts = {story[0]["interaction"]: number for number, story in reversed(whole_first)}
        stories = [pair for pair in stories if pair[0] in firsts.values()]
    made = []
    for number, story in stories:
        stem = Path(story[0]["interaction"]).stem
        start = max(story[0]["time"] - BEFORE, 0.0)
        stop = min(story[-1]["time"] + AFTER, start + LONGEST, duration)
        title = f"{stem.replace('_', ' ')}, {story[0]['object']}"
        if story[-1]["what"] == "broken":
            title += " (broken off)"
        made.append(Reel(f"film-{number:02}-{stem}.{suffix}", title, start, max(stop, start + 0.1)))
    return made


def moments(visit: Visited) -> list[float]:
    """A time in the hold of each interaction; when it was entered of those that never held."""
    times = []
    for story in interactions(visit["happened"]):
        holds = [k for k, one in enumerate(story) if one["what"] == "holds"]
        at = holds[0] if holds else 0
        after = story[at + 1]["time"] if at + 1 < len(story) else story[at]["time"]
        times.append(min(story[at]["time"] + HELD, 0.5 * (story[at]["time"] + after)))
    return times


def write_film(
    path: Path, recording: SceneRecording, reel: Reel, *, size: tuple[int, int], fps: int,
    progress: Callable[[int], object],
) -> Path:  # fmt: skip
    """Write one film; `progress` is called with how many pictures are done."""
    scene = recording.cut(reel.start, reel.stop)
    return write_scene_film(
        path, scene, size=size, fps=fps, title=reel.title,
        progress=lambda done, _: progress(done),
    )  # fmt: skip


def write_plan(path: Path, recording: SceneRecording, visit: Visited, title: str) -> Path:
    """Write the scene from above, with the place of each interaction."""
    events = tuple((story[0]["time"], _words(story)) for story in interactions(visit["happened"]))
    return write_scene_plan(path, replace(recording, events=events), title=title)


def _words(story: Sequence[Happened]) -> str:
    broken = ", broken off" if story[-1]["what"] == "broken" else ""
    stem = Path(story[0]["interaction"]).stem.replace("_", " ")
    return f"{stem}{broken}"


def write_strip(path: Path, recording: SceneRecording, visit: Visited, title: str) -> Path | None:
    """Write a picture of each interaction; nothing where there was none."""
    times = [min(time, recording.duration) for time in moments(visit)]
    return write_scene_strip(path, recording, times, title=title) if times else None
