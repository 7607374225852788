"""Scenes, interactions and scripts from files, and visits to them.

A scene names interactions, an interaction names a clip, both without a folder. An interaction is
looked for beside its scene, then in `../interactions`; a clip beside its interaction, then in
`../clips`.
"""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypedDict

import numpy as np

from ambulo import _core
from ambulo.model import Model
from ambulo.recording import Floats, Recording
from ambulo.scene_recording import GroundPatch, ScenePart, SceneRecording, Solid, Wall

MOST_TEXT = 1 << 18  # bytes of a document; longer ones are refused by their reader, too
MOST_CLIP = 1 << 26  # bytes of a motion file
AT_LINE = re.compile(r"line (\d+), column (\d+): ")
FPS = round(1.0 / _core.Visit.dt)
PART = 30  # frames between two reports of a visit
SHOWN = 0.5  # weight from which on a limb's target is marked
HANDLES = ("handle_front", "handle_back", "grip")


@dataclass(frozen=True)
class Problem:
    """Something wrong in a file."""

    file: str
    path: str
    """Where in the document, as `$.object[3].interactions[0]`; `$` is all of it."""
    reason: str
    line: int | None = None
    column: int | None = None

    def __str__(self) -> str:
        place = "" if self.line is None else f":{self.line}:{self.column}"
        return f"{self.file}{place}: {self.path}: {self.reason}"


class SceneError(ValueError):
    """Files that cannot be used; a line for each of `problems`."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        super().__init__("\n".join(map(str, problems)))
        self.problems = list(problems)


@dataclass(frozen=True)
class SceneFiles:
    """A scene with all that it names."""

    path: Path
    scene: str
    """Its text."""
    interactions: Mapping[str, str] = field(default_factory=dict)
    """Texts, by the names that the scene has for them."""
    clips: Mapping[str, _core.Clip] = field(default_factory=dict)
    """Motion in our axes, by the names that the interactions have for it."""
    sources: Mapping[str, Path] = field(default_factory=dict)
    """Where each of them was found."""


class Happened(TypedDict):
    """Something that happened on a visit."""

    time: float
    what: str
    object: str
    interaction: str


class Visited(TypedDict):
    """What a visit came to: what was measured (see `docs/scenes.md`), and what happened."""

    seed: int
    measured: dict[str, Any]
    happened: list[Happened]


# -- reading ------------------------------------------------------------------------------------


def kind_of(text: str) -> str:
    """What a document is by its keys: "scene", "interaction" or "script"."""
    try:
        keys = tomllib.loads(text).keys()
    except tomllib.TOMLDecodeError:
        keys = {line.strip(" []\r").split("=")[0].strip() for line in text.splitlines()}
    if keys & {"do", "interruptions"}:
        return "script"
    if keys & {"trigger", "approach", "clip", "target", "action", "exit"}:
        return "interaction"
    return "scene"


def check_file(path: str | Path) -> dict[str, Any]:
    """Read a scene with all that it names, an interaction with its clip, or a script.

    Returns what it is: `kind`, `name`, and counts of what is in it.

    Raises:
        SceneError: everything that is wrong.
    """
    path = Path(path)
    text = _read_text(path)
    kind = kind_of(text)
    if kind == "script":
        script = json.loads(_checked(path, text, _core.read_script))
        return {"kind": kind, "name": script["name"], "tasks": len(script["do"])}
    if kind == "interaction":
        one = json.loads(_checked(path, text, _core.read_interaction))
        problems: list[Problem] = []
        _clip_of(path, text, one, {}, {}, problems)
        _raise(problems)
        return {"kind": kind, "name": one["name"], "object": one["object"]}
    files = gather(text, path)
    scene = json.loads(_core.read_scene(text))
    counts = {"objects": len(scene.get("object", [])), "interactions": len(files.interactions)}
    return {"kind": kind, "name": scene["name"], **counts}


def load_scene(path: str | Path) -> SceneFiles:
    """Read a scene, the interactions that it names, and their clips.

    Raises:
        SceneError: everything that is wrong, and each file that is missing with the place in the
            document that asks for it.
        OSError: the scene itself cannot be read.
    """
    path = Path(path)
    return gather(_read_text(path), path)


def gather(text: str, path: Path) -> SceneFiles:
    """What a scene's text names, looked for as if it were the file `path`."""
    scene = json.loads(_checked(path, text, _core.read_scene))
    interactions: dict[str, str] = {}
    clips: dict[str, _core.Clip] = {}
    sources: dict[str, Path] = {}
    problems: list[Problem] = []
    asked = [
        (f"$.object[{index}].interactions[{which}]", name)
        for index, one in enumerate(scene.get("object", []))
        for which, name in enumerate(one.get("interactions", []))
    ]
    for place, name in asked:
        if name in sources:
            continue
        found = _find(path, "interactions", name)
        if found is None:
            problems.append(_problem(path, text, place, _missing(path, "interactions", name)))
            continue
        sources[name] = found
        try:
            own = _read_text(found)
            one = json.loads(_checked(found, own, _core.read_interaction))
        except SceneError as error:
            problems += error.problems
            continue
        interactions[name] = own
        _clip_of(found, own, one, clips, sources, problems)
    _raise(problems)
    _checked(path, text, lambda text: _core.read_scene(text, interactions))
    return SceneFiles(path, text, interactions, clips, sources)


def load_script(path: str | Path, files: SceneFiles | None = None) -> str:
    """The text of a script, held to the scene that it is for.

    Raises:
        SceneError: everything that is wrong.
        OSError: it cannot be read.
    """
    path = Path(path)
    text = _read_text(path)
    scene = None if files is None else files.scene
    _checked(path, text, lambda text: _core.read_script(text, scene))
    return text


def _clip_of(
    path: Path, text: str, one: Mapping[str, Any], clips: dict[str, _core.Clip],
    sources: dict[str, Path], problems: list[Problem],
) -> None:  # fmt: skip
    """Reads the clip of an interaction, if it has one and it was not read before."""
    name = one["clip"].get("file")
    if name is None:
        return
    found = _find(path, "clips", name)
    place = "$.clip.file"
    if found is None:
        problems.append(_problem(path, text, place, _missing(path, "clips", name)))
    elif sources.setdefault(name, found) != found:
        reason = f"'{name}' is {sources[name]} for one interaction and {found} for another"
        problems.append(_problem(path, text, place, reason))
    elif name not in clips:
        try:
            clips[name] = read_clip(found)
        except (ValueError, OSError) as error:
            problems.append(_problem(path, text, place, str(error)))


def read_clip(path: Path) -> _core.Clip:
    """A motion file in our axes and metres."""
    size = path.stat().st_size
    if size > MOST_CLIP:
        raise ValueError(f"{path} has {size} bytes; at most {MOST_CLIP} are read")
    clip, report = _core.read_motion(path)
    axes = report["axes"] or report["detected"]["axes"]
    if axes is None:
        raise ValueError(
            f"{path}: its axes and unit cannot be told; ambulo motion convert writes it in ours"
        )
    return clip if axes == "ambulo" else clip.converted(axes, "ambulo")


def _find(asking: Path, folder: str, name: str) -> Path | None:
    """Beside the file that asks for it, or in the folder next to its own."""
    for place in _places(asking, folder):
        if (place / name).is_file():
            return place / name
    return None


def _places(asking: Path, folder: str) -> tuple[Path, Path]:
    return asking.parent, Path(os.path.normpath(asking.parent / ".." / folder))


def _missing(asking: Path, folder: str, name: str) -> str:
    beside, next_to = _places(asking, folder)
    return f"there is no '{name}', neither in {beside} nor in {next_to}"


def _read_text(path: Path) -> str:
    with path.open("rb") as file:
        data = file.read(MOST_TEXT + 1)
    if len(data) > MOST_TEXT:
        raise SceneError([Problem(str(path), "$", f"such a file has at most {MOST_TEXT} bytes")])
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        column = len(data[: error.start].split(b"\n")[-1]) + 1
        raise SceneError([Problem(str(path), "$", "this is no UTF-8", line, column)]) from None


def _checked(path: Path, text: str, read: Callable[[str], str]) -> str:
    """What `read` makes of a text; its problems with file and line."""
    try:
        return read(text)
    except _core.SceneFileError as error:
        problems = [_problem(path, text, *problem) for problem in error.problems]
    raise SceneError(problems)


def _problem(path: Path, text: str, place: str, reason: str) -> Problem:
    said = AT_LINE.match(reason)
    if said:
        return Problem(str(path), place, reason[said.end() :], int(said[1]), int(said[2]))
    return Problem(str(path), place, reason, *(_core.document_place(text, place) or (None, None)))


def _raise(problems: Sequence[Problem]) -> None:
    if problems:
        raise SceneError(problems)


# -- visiting -----------------------------------------------------------------------------------


def begin_visit(model: Model, files: SceneFiles, script: str, seed: int = 0) -> _core.Visit:
    """A character at the start of a scene, with a script to play.

    Raises:
        ValueError: a model that cannot use objects (no humanoid, a layout of another version), a
            clip that does not fit, a start without ground.
    """
    return _core.Visit(
        model.core, files.scene, script, dict(files.interactions), dict(files.clips), seed
    )


def run_visit(
    model: Model,
    files: SceneFiles,
    script: str,
    seed: int = 0,
    *,
    progress: Callable[[float], object] | None = None,
) -> tuple[SceneRecording, Visited]:
    """Play a script to its end: what is drawn, and what was measured.

    Args:
        model: who.
        files: where.
        script: what to do: the text of a script.
        seed: 0 plays it as it stands; others start a little elsewhere and break things off.
        progress: is called with the share of the interactions that are over, 0 to 1.
    """
    visit = begin_visit(model, files, script, seed)
    uses = max(sum("use" in task for task in json.loads(_core.read_script(script))["do"]), 1)
    parts = visit.parts()
    tracks: list[tuple[Floats, ...]] = [_frame(visit)]
    led: list[dict[str, Floats]] = [{}]
    while visit.step():
        tracks.append(_frame(visit))
        led.append({limb: np.array(wanted[:3]) for limb, weight, wanted, _ in visit.led()
                    if weight > SHOWN})  # fmt: skip
        if progress is not None and len(tracks) % PART == 0:
            measured = json.loads(visit.measured())
            progress((measured["ended"] + len(measured["undone"])) / uses)
    report = visited(visit, seed)
    recording = _recorded(model, visit, parts, tracks, led, report["happened"])
    return recording, report


def visited(visit: _core.Visit, seed: int) -> Visited:
    """What a visit came to so far."""
    measured, happened = json.loads(visit.measured()), json.loads(visit.happened())
    return {"seed": seed, "measured": measured, "happened": happened}


def visit_seeds(
    model: Model,
    files: SceneFiles,
    script: str,
    seeds: Iterable[int],
    *,
    threads: int = 1,
    progress: Callable[[int], object] | None = None,
) -> list[Visited]:
    """Play a visit for each seed; the numbers do not depend on `threads`.

    `progress` is called with how many are over.
    """
    return json.loads(
        _core.visit_seeds(
            model.core, files.scene, script, dict(files.interactions), dict(files.clips),
            list(seeds), threads=threads, progress=progress,
        )
    )  # fmt: skip


class _Ground:
    """The ground of a visit."""

    def __init__(self, visit: _core.Visit) -> None:
        self.visit = visit

    def height(self, x: Floats, z: Floats) -> Floats:
        x, z = np.broadcast_arrays(np.asarray(x, np.float32), np.asarray(z, np.float32))
        return self.visit.heights(x.ravel(), z.ravel()).reshape(x.shape)


def _frame(visit: _core.Visit) -> tuple[Floats, ...]:
    contacts = np.array(visit.contacts, np.float32)
    return (
        visit.positions(), visit.tips(), np.array(visit.root), contacts, visit.part_transforms()
    )  # fmt: skip


def _recorded(
    model: Model, visit: _core.Visit, parts: Sequence[_core.ScenePartFacts],
    tracks: Sequence[tuple[Floats, ...]], led: Sequence[Mapping[str, Floats]],
    happened: Sequence[Happened],
) -> SceneRecording:  # fmt: skip
    positions, tips, root, contacts, transforms = (
        np.stack(track) for track in zip(*tracks, strict=True)
    )
    frames = len(positions)
    none = np.zeros(frames, np.int64)
    character = Recording(
        fps=float(FPS),
        names=model.names,
        parents=model.parents,
        positions=positions,
        tips=tips,
        tip_joints=model.tip_joints,
        root=root[:, [0, 2]],
        facing=np.unwrap(root[:, 3]),
        gait=none,
        gait_names=("",),
        leg=none,
        lap=none,
        contacts=contacts,
        asked=np.full((frames, 3), np.nan),
    )
    scene = json.loads(visit.scene())
    ground = _Ground(visit)
    targets = {
        limb: np.array([row.get(limb, np.full(3, np.nan)) for row in led])
        for limb in sorted({limb for row in led for limb in row})
    }
    return SceneRecording(
        character=character,
        parts=tuple(
            _part(scene["object"][one["object"]], one, transforms[:, index])
            for index, one in enumerate(parts)
        ),
        walls=tuple(_wall(one, ground) for one in scene.get("wall", [])),
        heights=ground,
        patches=tuple(map(_patch, scene["ground"])),
        events=tuple((one["time"], caption(one)) for one in happened),
        targets=targets,
    )


def caption(happened: Happened) -> str:
    """One event in words: the interaction, or what it is done to, and what became of it."""
    return f"{Path(happened['interaction']).stem.replace('_', ' ')}: {happened['what']}"


def _part(thing: Mapping[str, Any], one: _core.ScenePartFacts, transforms: Floats) -> ScenePart:
    grips = [place[:3] for name, place in sorted(one["frames"].items()) if name in HANDLES]
    moves = one["moves"]
    return ScenePart(
        object=thing["name"],
        part=one["name"],
        kind=next(iter(thing["kind"])),
        solids=tuple(Solid(np.array(centre), np.array(half)) for centre, half in one["solids"]),
        transforms=transforms if moves else transforms[0],
        grips=np.array(grips, float).reshape(-1, 3),
    )


def _wall(one: Mapping[str, Any], ground: _Ground) -> Wall:
    ends = np.array([one["start"], one["end"]], np.float32)
    base = float(ground.height(ends[:, 0], ends[:, 1]).min())
    (a, b), (c, d) = one["start"], one["end"]
    return Wall((a, b), (c, d), one["height"], one["thickness"], base)


def _patch(one: Mapping[str, Any]) -> GroundPatch:
    kind, its = next(iter(one["kind"].items()))
    (x, z), (wide, long) = one["place"], one["size"]
    low = its["height"] if "height" in its else its["from"]
    return GroundPatch(
        (x, z), (wide, long), one["yaw"], kind, low, its.get("to", low), its.get("count", 0)
    )
