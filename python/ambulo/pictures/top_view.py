"""Charts of a recording."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ambulo.files import replacing
from ambulo.pictures.drawing import Array
from ambulo.recording import Recording

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK = "#2e323a"
QUIET = "#8a8e96"
ACCENT = "#ec5438"
DPI = 120
GAITS = ("#9aa0a8", "#2f7f96", "#e08a3c", "#b8406a", "#6a9a3a", "#7a5bb0", "#c9a227", "#4a6fc4")


def write_top_view(
    path: str | Path,
    recording: Recording,
    waypoints: ArrayLike,
    reach: ArrayLike = 0.5,
    *,
    title: str = "",
    pixels: int = 1200,
) -> Path:
    """Writes the course as seen from above (PNG, SVG or PDF, by the name of `path`).

    The page is a true view from above, nothing mirrored: +Z runs up the page and so +X, the left
    of somebody who looks along +Z, runs to the LEFT. Both axes are in metres at one scale.

    `waypoints` (M, 2 or more): x, z in metres, in order, drawn as numbered circles of radius
    `reach` metres (one number or (M,)) and joined by the straight ideal track. The path is
    coloured by gait, the first lap bold; a tick a second points the way the character faces.
    `pixels`: the picture's longer side. A file appears only when it is whole.
    """
    path = Path(path)
    points = np.asarray(waypoints, np.float64)
    if points.ndim != 2 or points.shape[1] < 2 or not len(points):
        raise ValueError(f"waypoints must have shape (M, 2 or more), M > 0, not {points.shape}")
    points = points[:, :2]
    if np.ndim(reach) and np.shape(reach) != (len(points),):
        raise ValueError(
            f"reach must be one number or one a waypoint ({len(points)}), "
            f"not of shape {np.shape(reach)}"
        )
    radii = np.broadcast_to(np.asarray(reach, np.float64), len(points))
    if not (radii > 0.0).all():
        raise ValueError("reach must be above 0 m")
    if pixels < 300:
        raise ValueError(f"pixels must be at least 300, not {pixels}")
    if not path.suffix:
        raise ValueError(f"{path.name!r} needs a suffix that names the picture's format, as .png")

    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    low, high = _extent(recording, points, radii)
    margin = np.array([0.75, 0.98])  # inches left and below: labels and legend
    spare = margin + np.array([0.25, 0.55 if title else 0.20])
    scale = float(((pixels / DPI - spare) / (high - low)).min())  # inches a metre
    inches = scale * (high - low) + spare
    figure = Figure(figsize=(float(inches[0]), float(inches[1])), dpi=DPI)
    FigureCanvasAgg(figure)
    corner, extent = margin / inches, scale * (high - low) / inches
    axes = figure.add_axes((corner[0], corner[1], extent[0], extent[1]))
    _draw_track(axes, points, radii)
    _draw_path(axes, recording)
    period = _draw_facing(axes, recording, float((high - low).max()))
    _finish(figure, axes, recording, low, high, title, period)
    with replacing(path) as part:
        figure.savefig(part, format=path.suffix[1:].lower(), facecolor="white")
    return path


def _extent(recording: Recording, points: Array, radii: Array) -> tuple[Array, Array]:
    """Lowest and highest x, z of all that is drawn, with a margin, no more than 2.5 to 1."""
    path = np.asarray(recording.root, np.float64)
    low = np.minimum(path.min(0), (points - radii[:, None]).min(0)) - 0.6
    high = np.maximum(path.max(0), (points + radii[:, None]).max(0)) + 0.6
    more = 0.5 * np.maximum((high - low).max() / 2.5 - (high - low), 0.0)
    return low - more, high + more


def _draw_track(axes: Axes, points: Array, radii: Array) -> None:
    """The waypoints, numbered from 0, and the straight lines between them."""
    from matplotlib.patches import Circle

    closed = np.concatenate([points, points[:1]])
    axes.plot(closed[:, 0], closed[:, 1], color="#c9ccd1", lw=1.0, ls=(0, (5, 4)), zorder=1)
    for number, (point, radius) in enumerate(zip(points, radii, strict=True)):
        centre = (float(point[0]), float(point[1]))
        axes.add_patch(Circle(centre, float(radius), fc=ACCENT, alpha=0.13, lw=0, zorder=1.5))
        axes.add_patch(Circle(centre, float(radius), fill=False, ec=ACCENT, lw=1.0, zorder=2))
        # The number sits on its circle's upper right, clear of the path through the middle.
        spot = (centre[0] - 0.71 * float(radius), centre[1] + 0.71 * float(radius))
        axes.annotate(
            str(number), spot, xytext=(5, 5), textcoords="offset points", color=ACCENT,
            fontsize=11, weight="bold", ha="center", va="center", zorder=6,
        )  # fmt: skip


def _draw_path(axes: Axes, recording: Recording) -> None:
    """All laps thin, the first bold on top, each piece in the colour of its gait."""
    from matplotlib.collections import LineCollection

    root = np.asarray(recording.root, np.float64)
    pieces = np.stack([root[:-1], root[1:]], 1)
    colours = np.array(GAITS)[np.asarray(recording.gait[:-1]) % len(GAITS)]
    first = np.asarray(recording.lap[:-1]) == recording.lap[0]
    for chosen, width, alpha, order in ((~first, 0.9, 0.55, 3), (first, 2.6, 1.0, 4)):
        axes.add_collection(
            LineCollection(
                list(pieces[chosen]),
                colors=list(colours[chosen]),
                linewidths=width,
                alpha=alpha,
                capstyle="round",
                zorder=order,
            )
        )
    axes.plot(*root[0], "o", ms=7, mfc="white", mec=INK, mew=1.6, zorder=7)


def _draw_facing(axes: Axes, recording: Recording, size: float) -> int:
    """Ticks along the first lap, the way the character faces; returns the seconds between them.

    A tick is a fortieth of the picture's `size` (metres) long and they keep as far apart, so that
    facing shows on a small course and on a large one.
    """
    from matplotlib.collections import LineCollection

    length = max(size / 40.0, 0.4)
    root = np.asarray(recording.root, np.float64)
    first = np.flatnonzero(np.asarray(recording.lap) == recording.lap[0])
    walked = float(np.hypot(*np.diff(root[first], axis=0).T).sum())
    speed = walked / max(len(first) / recording.fps, 1e-6)
    period = max(round(length / max(speed, 0.1)), 1)
    at = root[first][:: max(round(period * recording.fps), 1)]
    yaw = np.asarray(recording.facing, np.float64)[first][:: max(round(period * recording.fps), 1)]
    tick = length * np.stack([np.sin(yaw), np.cos(yaw)], -1)
    axes.add_collection(
        LineCollection(list(np.stack([at, at + tick], 1)), colors=INK, lw=1.1, zorder=5)
    )
    axes.plot(at[:, 0], at[:, 1], "o", ms=3.0, color=INK, zorder=5)
    return period


def dress_plan(axes: Axes, low: Array, high: Array, *, grid: str, line: float) -> None:
    """Axes of a plan from `low` to `high` (x, z, metres), +X to the left, and its grid's lines."""
    from matplotlib.ticker import MultipleLocator

    axes.set_aspect("equal")
    step = next((s for s in (1.0, 2.0, 5.0, 10.0, 20.0) if max(high - low) < 16.0 * s), 50.0)
    axes.xaxis.set_major_locator(MultipleLocator(step))
    axes.yaxis.set_major_locator(MultipleLocator(step))
    axes.set_xlim(high[0], low[0])  # +X to the left: seen from above
    axes.set_ylim(low[1], high[1])
    axes.set_xlabel("x, metres (+X to the left: seen from above)", color=INK)
    axes.set_ylabel("z, metres", color=INK)
    axes.grid(color=grid, lw=line)
    axes.set_axisbelow(True)
    axes.tick_params(colors=QUIET, length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _finish(
    figure: Figure,
    axes: Axes,
    recording: Recording,
    low: Array,
    high: Array,
    title: str,
    period: int,
) -> None:
    """Axes, legend and title."""
    from matplotlib.lines import Line2D

    dress_plan(axes, low, high, grid="#eceded", line=0.8)
    present = [int(g) for g in np.unique(recording.gait)]
    handles = [
        Line2D([], [], color=GAITS[g % len(GAITS)], lw=2.6, label=recording.gait_names[g])
        for g in present
    ]
    every = "facing, each second" if period == 1 else f"facing, every {period} s"
    handles.append(Line2D([], [], color=INK, lw=1.1, marker="o", ms=3, label=every))
    handles.append(Line2D([], [], color="#c9ccd1", lw=1.0, ls=(0, (5, 4)), label="straight track"))
    handles.append(
        Line2D([], [], ls="", marker="o", ms=7, mfc="white", mec=INK, mew=1.6, label="start")
    )
    width = float(figure.get_size_inches()[0])
    figure.legend(
        handles=handles, loc="lower left", bbox_to_anchor=(0.40 / width, 0.0),
        ncols=max(min(len(handles), int(width / 1.35)), 1), frameon=False, labelcolor=INK,
        fontsize=9, handlelength=1.6, columnspacing=1.4,
    )  # fmt: skip
    if title:
        axes.set_title(title, loc="left", color=INK, fontsize=14, pad=12)
