"""Figures of a study: fitness over the generations, as SVG that suits a light and a dark page.

A figure is drawn in light colours; a style sheet inside it swaps them where the reader's system is
dark, so a file looks right in a page and by itself. Texts stay text, in the reader's own font.

matplotlib takes its SVG settings from process-wide parameters, which are set for the moment of
drawing and put back: draw from one thread.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from ambulo.study.published import PublishedMark
from ambulo.study.results import Case, Mark, Results, Run

FONT = "Inter, ui-sans-serif, system-ui, -apple-system, 'Segoe UI', Roboto, Arial, sans-serif"

PAPER, INK, MUTED, GRID = "#ffffff", "#22272e", "#6b7480", "#e3e6ea"

RUNS = ("#2563a8", "#c2571a", "#2f8a5b")
"""Of the first, second and third run."""

CREATURES = {
    "apod": "#3566ad",
    "biped1": "#c4561b",
    "biped2": "#a87a12",
    "tetrapod1": "#2d8a57",
    "tetrapod2": "#168694",
    "decapod1": "#8650a6",
    "decapod2": "#b6376e",
}

DARK = {
    PAPER: "#1b1f24",
    INK: "#e6e9ed",
    MUTED: "#98a2ae",
    GRID: "#30363d",
    RUNS[0]: "#74b0f4",
    RUNS[1]: "#f29a5e",
    RUNS[2]: "#66c997",
    CREATURES["apod"]: "#7db2f5",
    CREATURES["biped1"]: "#f39a60",
    CREATURES["biped2"]: "#e3bd5a",
    CREATURES["tetrapod1"]: "#68cb98",
    CREATURES["tetrapod2"]: "#5ccad6",
    CREATURES["decapod1"]: "#c596e6",
    CREATURES["decapod2"]: "#f087b2",
}
"""What each colour becomes on a dark page."""

SMALL, LARGE = (360, 236), (620, 310)
"""Width and height, in CSS pixels."""

STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "ambulo",
    "font.size": 11.5,
    "text.color": INK,
    "axes.edgecolor": GRID,
    "axes.linewidth": 1.0,
    "xtick.color": GRID,
    "ytick.color": GRID,
    "xtick.labelcolor": MUTED,
    "ytick.labelcolor": MUTED,
    "path.simplify": False,
}


def first_runs(case: Case, results: Results) -> str:
    """Best fitness of the first three runs, as the thesis's figures 5.1-5.7 and 5.9-5.15.

    A dot is a judged individual: filled if it is usable.
    """
    runs = list(zip(case.initial, RUNS, strict=False))
    with _style():
        figure, axes = _canvas(SMALL, right=24)
        for run, colour in runs:
            _curve(axes, run, colour, width=2.0)
        _frame(axes, case.initial, results.generations)
        _moments(axes, case.published.marks, results.generations)
        for run, colour in runs:
            for mark in run.marks:
                _dot(axes, mark, colour)
        _end_labels(axes, [(str(i), run.best[-1], c) for i, (run, c) in enumerate(runs, 1)])
        return _svg(figure, f"{case.name}: best fitness of the first runs")


def all_runs(case: Case, results: Results) -> str:
    """Every run thin and their mean thick, as the thesis's figures A.1-A.14.

    The mean goes as far as all runs have come.
    """
    colour = CREATURES[case.published.creature]
    with _style():
        figure, axes = _canvas(SMALL, right=24)
        for run in case.runs:
            _curve(axes, run, colour, width=1.0, alpha=0.5)
        if len(case.runs) > 1:
            common = min(len(run.best) for run in case.runs)
            mean = np.mean([run.best[:common] for run in case.runs], axis=0)
            _steps(axes, mean, colour, width=2.6)
        _frame(axes, case.runs, results.generations)
        for run in case.runs:
            if mark := run.mark(results.generations):
                _dot(axes, mark, colour, size=5.0)
        return _svg(figure, f"{case.name}: best fitness of all runs")


def best_of_each(
    cases: Sequence[Case], results: Results, title: str, size: tuple[int, int] = LARGE
) -> str:
    """The best of the first three runs of each creature, as the thesis's figures 5.8 and 5.16.

    Each case has a run.
    """
    best = [max(case.initial, key=lambda run: run.best[-1]) for case in cases]
    colours = [CREATURES[case.published.creature] for case in cases]
    with _style():
        figure, axes = _canvas(size, right=92)
        for run, colour in zip(best, colours, strict=True):
            _curve(axes, run, colour, width=2.2)
        _frame(axes, best, results.generations)
        ends = zip(cases, best, colours, strict=True)
        _end_labels(axes, [(case.name, run.best[-1], colour) for case, run, colour in ends])
        return _svg(figure, title)


# Parts of a figure --------------------------------------------------------------------------


@contextmanager
def _style() -> Iterator[None]:
    """Our parameters over matplotlib's own, whatever the user's are."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        yield


def _canvas(size: tuple[int, int], right: int) -> tuple[Figure, Axes]:
    """Axes with fixed margins, so that the figures of a row line up; `right` in pixels."""
    width, height = size
    figure = Figure(figsize=(width / 72, height / 72), dpi=72, facecolor=PAPER)
    left, bottom, top = 42, 36, 26
    box = (left / width, bottom / height, 1 - (left + right) / width, 1 - (bottom + top) / height)
    return figure, figure.add_axes(box, facecolor="none")


def _curve(axes: Axes, run: Run, colour: str, width: float, alpha: float = 1.0) -> None:
    _steps(axes, np.asarray(run.best), colour, width, alpha)


def _steps(
    axes: Axes, values: NDArray[np.float64], colour: str, width: float, alpha: float = 1.0
) -> None:
    """A staircase from its corners alone: between them a best so far does not change."""
    corner = np.flatnonzero(np.diff(values, prepend=np.nan) != 0)
    x = np.append(corner + 1, len(values))
    y = np.append(values[corner], values[-1])
    axes.plot(
        x,
        y,
        drawstyle="steps-post",
        color=colour,
        linewidth=width,
        alpha=alpha,
        solid_joinstyle="round",
        solid_capstyle="round",
        clip_on=False,
    )


def _frame(axes: Axes, runs: Sequence[Run], generations: int) -> None:
    """Scales, grid and names of the axes."""
    lowest = min(min(run.best) for run in runs)
    highest = max(max(run.best) for run in runs)
    low, high = min(lowest, 0.0), max(highest, 0.0)
    span = (high - low) or 1.0
    axes.set_xlim(0, generations)
    axes.set_ylim(low - (0.04 * span if low < 0 else 0.0), high + 0.06 * span)
    axes.xaxis.set_major_locator(MaxNLocator(3, integer=True))
    axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))
    axes.grid(axis="y", color=GRID, linewidth=1.0)
    axes.set_axisbelow(True)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.tick_params(axis="y", length=0, pad=6)
    axes.tick_params(axis="x", length=4, pad=3)
    _note(axes, "m", (0, 1), (-6, 8), va="bottom", ha="right")
    _note(axes, "generations", (0.5, 0), (0, -23), va="top", ha="center")


def _note(
    axes: Axes, text: str, at: tuple[float, float], offset: tuple[int, int], va: str, ha: str
) -> None:
    """Small print at a place of the axes (0 to 1), moved by some pixels."""
    axes.annotate(
        text,
        at,
        offset,
        xycoords="axes fraction",
        textcoords="offset points",
        color=MUTED,
        fontsize=10.5,
        va=va,
        ha=ha,
    )


def _moments(axes: Axes, marks: Sequence[PublishedMark], generations: int) -> None:
    """Where the thesis was after one and five minutes."""
    for mark in marks[:-1]:
        if mark.generation >= generations:
            continue
        axes.axvline(mark.generation, color=MUTED, linewidth=0.8, dashes=(2, 3), zorder=0.5)
        at = (mark.generation / generations, 1.0)
        _note(axes, f"{mark.minutes}′", at, (0, 3), va="bottom", ha="center")


def _dot(axes: Axes, mark: Mark, colour: str, size: float = 6.5) -> None:
    axes.plot(
        [mark.generation],
        [mark.fitness],
        linestyle="none",
        marker="o",
        markersize=size,
        markerfacecolor=colour if mark.usable else PAPER,
        markeredgecolor=colour,
        markeredgewidth=1.6,
        zorder=4,
        clip_on=False,
    )


def _end_labels(axes: Axes, labels: Sequence[tuple[str, float, str]]) -> None:
    """Names beside the ends of the curves (name, value, colour), moved apart where they crowd."""
    low, high = axes.get_ylim()
    height = axes.bbox.height  # a point is a pixel: see `_canvas`
    ordered = sorted(labels, key=lambda label: label[1])
    wanted = [(value - low) / (high - low) * height for _, value, _ in ordered]
    for (name, _, colour), y in zip(ordered, spread_out(wanted, 13.5), strict=True):
        axes.annotate(
            name,
            (1, 0),
            (10, y),
            xycoords="axes fraction",
            textcoords="offset points",
            va="center_baseline",
            color=colour,
            fontweight="bold",
            parse_math=False,
        )


def spread_out(wanted: Sequence[float], gap: float) -> list[float]:
    """Ascending positions, moved as little as it takes to be `gap` apart.

    Those that crowd form a block around the mean of where they want to be.
    """
    blocks: list[tuple[float, int]] = []  # centre, how many
    for position in wanted:
        centre, count = position, 1
        while blocks and centre - blocks[-1][0] < gap * (count + blocks[-1][1]) / 2:
            before, many = blocks.pop()
            centre, count = (centre * count + before * many) / (count + many), count + many
        blocks.append((centre, count))
    return [centre + gap * (i - (count - 1) / 2) for centre, count in blocks for i in range(count)]


# The file -----------------------------------------------------------------------------------


def _svg(figure: Figure, title: str) -> str:
    """The same bytes for the same figure."""
    file = io.StringIO()
    figure.savefig(file, format="svg", metadata={"Title": title})
    return _themed(file.getvalue(), DARK)


def _themed(svg: str, dark: Mapping[str, str]) -> str:
    """Colours that follow the reader's system, the page's font, nothing that is not needed."""
    svg = re.sub(r"<!DOCTYPE.*?>\s*|\s*<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r"font-family: [^;\"]*|(?<=px) 'DejaVu Sans'[^;\"]*", f"font-family: {FONT}", svg)
    rules = "".join(
        f'[style*="{kind}: {light}"]{{{kind}:{night}!important}}'
        for light, night in dark.items()
        if light in svg
        for kind in ("fill", "stroke")
    )
    sheet = f"@media (prefers-color-scheme:dark){{{rules}}}"
    return svg.replace("</style>", f"{sheet}</style>", 1)
