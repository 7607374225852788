"""What it takes to add an interaction to a character that has none: Table 2 of the third seed.

Silva, Sugahara, Ugarte, "Neuranimation: Reactive Character Animations with Deep Neural Networks"
(GRAPP 2022), Table 2, compares NSM (Starke et al., 2019) with its own method.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ambulo import _core
from ambulo.evaluate.visits import weights_hash
from ambulo.model import Model
from ambulo.scene import SceneFiles, begin_visit, gather, visited

SOURCE = "Silva, Sugahara, Ugarte, Neuranimation, GRAPP 2022, Table 2"
# Interactions → smallest number of clips, re-training, input features.
NSM = {1: (5, True, "n"), 2: (10, True, "n + 14"), 3: (15, True, "n + 28"), 4: (20, True, "n + 42")}
SEED = {count: (count, False, "311") for count in NSM}

REPEATS = 5  # the quickest of so many counts: others are kept from the processor by something else

HEAD = """\
format = 1
name = "Four things"
spawn = { place = [0.0, 0.0] }

[[ground]]
place = [0.0, 0.0]
size = [40.0, 40.0]
kind.flat = { height = 0.0 }
"""

# Object, its interaction, where it stands, what it is, and how long it is used.
THINGS = (
    ("chair", "sit.toml", "place = [-2.0, 2.0]\nyaw = 1.6\nkind.chair = { seat_height = 0.46, "
     "seat_depth = 0.42, width = 0.44, back_height = 0.9 }", "stay = 1.0"),
    ("door", "open_door_front_right.toml", "place = [0.0, 5.0]\nyaw = 3.14159\n"
     "kind.door = { width = 0.9, height = 2.05, handle_height = 1.02, hinge = \"left\", "
     "limits = [-1.6, 1.6], mass = 22.0, damping = 3.0 }", ""),
    ("button", "press_button.toml", "place = [3.0, 8.0]\nyaw = 3.14159\n"
     "kind.button = { height = 1.15, radius = 0.05, travel = 0.015 }", ""),
    ("crate", "push_box_front.toml", "place = [5.0, 3.0]\n"
     "kind.box = { size = [0.9, 1.15, 0.9], mass = 40.0, friction = 0.4 }", "stay = 1.5"),
)  # fmt: skip


def scene_text(count: int) -> str:
    """A scene of which the first `count` things can be used."""
    text = HEAD
    for index, (name, file, what, _) in enumerate(THINGS):
        offers = json.dumps([file]) if index < count else "[]"
        text += f'\n[[object]]\nname = "{name}"\ninteractions = {offers}\n{what}\n'
    return text


def script_text(count: int) -> str:
    """A script that uses the first `count` things, one after the other."""
    text = 'format = 1\nname = "One after the other"\n'
    for name, _, _, stay in THINGS[:count]:
        text += f'\n[[do]]\nuse = "{name}"\n{stay}\n'
    return text + "\n[[do]]\nwait = 1.0\n"


def add_interactions(
    model: Model, starters: Path, progress: Callable[[int], object] | None = None
) -> list[dict[str, Any]]:
    """Add interactions to a scene one by one, and play each scene to its end.

    Args:
        model: who uses them.
        starters: the folder whose `interactions` and `clips` are added.
        progress: is called with how many were added so far.
    """
    path, rows, before = starters / "scenes" / "four-things.toml", [], 0.0
    for count in range(len(THINGS) + 1):
        hashed, inputs = weights_hash(model), model.inputs
        script = script_text(count)
        took, files = min(
            (_loaded(model, count, path) for _ in range(REPEATS)), key=lambda pair: pair[0]
        )
        visit = begin_visit(model, files, script)
        while visit.step(60):
            pass
        if count:
            name, file, _, _ = THINGS[count - 1]
            measured = visited(visit, 0)["measured"]
            rows.append(
                _row(count, name, file, starters, took - before)
                | {
                    "inputs_before": inputs,
                    "inputs_after": model.inputs,
                    "weights_before": hashed,
                    "weights_after": weights_hash(model),
                    "clips": len(files.clips),
                    "played": measured["ended"],
                    "undone": measured["undone"],
                }
            )
        before = took
        if progress is not None:
            progress(count)
    return rows


def _loaded(model: Model, count: int, path: Path) -> tuple[float, SceneFiles]:
    """Seconds from files to a character that can begin, and the files."""
    started = time.perf_counter()
    files = gather(scene_text(count), path)
    begin_visit(model, files, script_text(count))
    return time.perf_counter() - started, files


def _row(count: int, name: str, file: str, starters: Path, seconds: float) -> dict[str, Any]:
    path = starters / "interactions" / file
    clip = json.loads(_core.read_interaction(path.read_text(encoding="utf-8")))["clip"].get("file")
    nsm, seed = NSM[count], SEED[count]
    fields = ("clips", "retraining", "inputs")
    return {
        "interactions": count,
        "object": name,
        "file": file,
        "file_bytes": path.stat().st_size,
        "clip": clip,
        "clip_bytes": (starters / "clips" / clip).stat().st_size if clip else 0,
        "seconds_to_load": max(seconds, 0.0),
        "nsm": dict(zip(fields, nsm, strict=True)),
        "neuranimation": dict(zip(fields, seed, strict=True)),
    }
