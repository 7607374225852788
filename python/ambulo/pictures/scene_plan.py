"""A scene seen from above: ground, walls, objects, the path and where something happened."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ambulo.files import replacing
from ambulo.pictures.drawing import Array
from ambulo.pictures.film import check_size
from ambulo.pictures.scene_set import Props
from ambulo.pictures.solids import Boxes
from ambulo.pictures.stage import between
from ambulo.pictures.sunlight import hull
from ambulo.pictures.top_view import dress_plan
from ambulo.scene_recording import GroundPatch, SceneRecording

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK = "#2e323a"
QUIET = "#8a8e96"
ACCENT = "#ec5438"
WALL = "#6f747c"
GROUND = {"flat": "#f3f2ef", "rugged": "#e4e9dc", "slope": "#e9e4da", "steps": "#e3dfe6"}
DPI = 120
AROUND = 2.0  # metres of surroundings shown


def write_scene_plan(
    path: str | Path,
    recording: SceneRecording,
    *,
    size: tuple[int, int] = (1000, 1000),
    title: str = "",
) -> Path:
    """Writes the scene as seen from above (PNG, SVG or PDF, by the name of `path`).

    A true view from above, nothing mirrored: +Z runs up the page and +X, the left of somebody who
    looks along +Z, to the left. Objects are shown where they are at the end, pale where they were
    at the start; a number on the path is an event, and a list says which. `size` in pixels, at
    most: one scale for both axes. A file appears only when it is whole.
    """
    path = Path(path)
    check_size(size)
    if not path.suffix:
        raise ValueError(f"{path.name!r} needs a suffix that names the picture's format, as .png")

    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    events = _events(recording)
    props = Props(recording)
    low, high = _extent(recording, props)
    longest = max((len(text) for _, text in events), default=0)
    legend = max(2.4, 0.5 + 0.066 * (longest + 10)) if events else 0.2  # inches on the right
    spare = np.array([0.6 + legend, 0.55 + (0.45 if title else 0.15)])
    scale = float(((np.array(size) / DPI - spare) / (high - low)).min())
    if scale <= 0.0:
        raise ValueError(f"size {size} is too small for a plan")
    inches = scale * (high - low) + spare
    figure = Figure(figsize=(float(inches[0]), float(inches[1])), dpi=DPI)
    FigureCanvasAgg(figure)
    corner, extent = np.array([0.6, 0.5]) / inches, scale * (high - low) / inches
    axes = figure.add_axes((corner[0], corner[1], extent[0], extent[1]))
    _draw_ground(axes, recording, low, high)
    _draw_things(axes, recording, props)
    _draw_path(axes, recording)
    _draw_events(axes, recording, events, low, high)
    _finish(axes, low, high, title)
    with replacing(path) as part:
        figure.savefig(part, format=path.suffix[1:].lower(), facecolor="white")
    return path


def _events(recording: SceneRecording) -> list[tuple[float, str]]:
    """The events that say something."""
    return [(time, text) for time, text in recording.events if text]


def _extent(recording: SceneRecording, props: Props) -> tuple[Array, Array]:
    """Lowest and highest x, z shown: the path, what stands near it, and a margin."""
    path = np.asarray(recording.character.root, np.float64)
    low, high = path.min(0) - AROUND, path.max(0) + AROUND
    near = Boxes.joined([props.still, props.movers(0.0), props.movers(recording.frames - 1.0)])
    flat = near.corners[..., [0, 2]]
    close = ((near.centre[:, [0, 2]] > low - 1.0) & (near.centre[:, [0, 2]] < high + 1.0)).all(1)
    if close.any():
        low = np.minimum(low, flat[close].min((0, 1)) - 0.3)
        high = np.maximum(high, flat[close].max((0, 1)) + 0.3)
    more = 0.5 * np.maximum((high - low).max() / 2.0 - (high - low), 0.0)
    return low - more, high + more


def _draw_ground(axes: Axes, recording: SceneRecording, low: Array, high: Array) -> None:
    """Pieces of ground, with their kind where their middle is shown; a line each step."""
    from matplotlib.patches import Polygon

    for piece in recording.patches:
        place = np.asarray(piece.place, np.float64)
        corners = _corners(piece)
        colour = GROUND[piece.kind]
        axes.add_patch(Polygon(corners, fc=colour, ec="#c9ccd1", lw=0.8, zorder=0.1))
        if piece.kind == "steps":
            for part in np.linspace(0.0, 1.0, piece.count + 1)[1:-1]:
                ends = corners[:2] + part * (corners[[3, 2]] - corners[:2])
                axes.plot(*ends.T, color="#b9b4c0", lw=0.8, zorder=0.2)
        if piece.kind != "flat" and (place > low + 0.4).all() and (place < high - 0.4).all():
            words = f"{piece.kind} {piece.from_height:g} → {piece.to_height:g} m"
            words = piece.kind if piece.kind == "rugged" else words
            axes.text(
                float(place[0]), float(place[1]), words, color=QUIET, fontsize=8, ha="center",
                va="center", zorder=0.7, clip_on=True,
            )  # fmt: skip


def _corners(piece: GroundPatch) -> Array:
    """(4, 2) of a piece, from its own least x and z on, x first."""
    c, s = np.cos(piece.yaw), np.sin(piece.yaw)
    own = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.asarray(piece.size)
    return np.asarray(piece.place) + own @ np.array([[c, -s], [s, c]])


def _draw_things(axes: Axes, recording: SceneRecording, props: Props) -> None:
    """Walls and objects, those that move pale at the start, with their names."""
    last = recording.frames - 1.0
    _polygons(axes, props.movers(0.0), 0.28, 2.0)
    _polygons(axes, props.still, 1.0, 2.1)
    _polygons(axes, props.movers(last), 1.0, 2.2)
    every = Boxes.joined([props.still, props.movers(last)])
    for name, owners in props.owned().items():
        mine = every.corners[np.isin(every.owner, owners)][..., [0, 2]]
        if not mine.size:
            continue
        low, high = mine.min((0, 1)), mine.max((0, 1))
        axes.annotate(
            name, (0.5 * (low[0] + high[0]), low[1]), xytext=(0, -3),
            textcoords="offset points", color=INK, fontsize=9, ha="center", va="top", zorder=5,
            annotation_clip=True,
        )  # fmt: skip


def _polygons(axes: Axes, boxes: Boxes, alpha: float, order: float) -> None:
    """The boxes' outlines from above, higher ones over lower ones."""
    from matplotlib.patches import Polygon

    for i in np.argsort(boxes.corners[..., 1].max(-1)):
        outline = hull(boxes.corners[i][:, [0, 2]])
        axes.add_patch(
            Polygon(
                outline, fc=tuple(0.92 * boxes.colour[i]), ec=INK, lw=0.5, alpha=alpha,
                zorder=order,
            )
        )  # fmt: skip


def _draw_path(axes: Axes, recording: SceneRecording) -> None:
    """The path, a tick a second the way the character faces."""
    from matplotlib.collections import LineCollection

    root = np.asarray(recording.character.root, np.float64)
    axes.plot(*root.T, color="#2f7f96", lw=2.2, zorder=3, solid_capstyle="round")
    seconds = np.arange(0.0, recording.duration + 1e-6, 1.0) * recording.fps
    at = between(root, seconds)
    yaw = between(np.unwrap(np.asarray(recording.character.facing, np.float64)), seconds)
    tick = 0.28 * np.stack([np.sin(yaw), np.cos(yaw)], -1)
    axes.add_collection(
        LineCollection(list(np.stack([at, at + tick], 1)), colors=INK, lw=1.0, zorder=3.2)
    )
    axes.plot(*root[0], "o", ms=7, mfc="white", mec=INK, mew=1.6, zorder=4)


def _draw_events(
    axes: Axes, recording: SceneRecording, events: list[tuple[float, str]], low: Array, high: Array
) -> None:
    """Numbers where events were, aside of the path, and the list of them beside the plan."""
    spots: list[Array] = []
    gap = 0.030 * float((high - low).max())
    for number, (time, text) in enumerate(events, 1):
        place = between(recording.character.root, np.array([time * recording.fps]))[0]
        spot = place + np.array([-1.0, 0.6]) * gap
        while any(np.hypot(*(spot - other)) < gap for other in spots):
            spot = spot + np.array([-1.0, 0.0]) * gap  # to the right: +X is to the left
        spots.append(spot)
        axes.plot(*np.stack([place, spot]).T, color=ACCENT, lw=0.8, zorder=6)
        axes.plot(*place, "o", ms=4, color=ACCENT, zorder=6)
        axes.plot(*spot, "o", ms=12, mfc=ACCENT, mec="white", mew=1.0, zorder=7)
        axes.annotate(str(number), spot, color="white", fontsize=7.5, weight="bold",
                      ha="center", va="center", zorder=8)  # fmt: skip
        line = 1.0 - 0.03 - (number - 1) * min(0.045, 0.92 / len(events))
        for x, words, colour in ((1.02, f"{number}", ACCENT), (1.075, text, INK)):
            words = f"{words}   {time:.1f} s" if colour == INK else words
            axes.text(x, line, words, transform=axes.transAxes, color=colour, fontsize=9,
                      va="center")  # fmt: skip


def _finish(axes: Axes, low: Array, high: Array, title: str) -> None:
    """Axes and title."""
    dress_plan(axes, low, high, grid="#e3e4e6", line=0.6)
    if title:
        axes.set_title(title, loc="left", color=INK, fontsize=14, pad=10)
