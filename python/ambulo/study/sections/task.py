"""A task: its curves over the generations and its table of training time."""

from __future__ import annotations

from collections.abc import Sequence

from ambulo.study.assets import best_file, best_narrow_file, first_runs_file, time_file
from ambulo.study.curves import LARGE, SMALL
from ambulo.study.markup import (
    Markup,
    csv_link,
    dot,
    figure,
    group_heads,
    heads,
    join,
    note,
    number,
    picture,
    table,
    tag,
    verdict,
    void,
    yes_no,
)
from ambulo.study.results import Case, Results, Run
from ambulo.study.tables import TimeRow, time_rows
from ambulo.study.words import DOING, doing, duration, metres, percent


def of_task(study: Results, task: str) -> Markup:
    """Of the cases that have a run."""
    begun = study.begun(task)
    if not begun:
        return tag("p", "No run yet.")
    intro = (
        "Best fitness so far over the generations, of the first three runs of each creature. "
        "Dotted lines: where the thesis was after one and five minutes. A dot is a motion that "
        "was judged on a replay: filled if usable, hollow if not. Scales differ from case to case."
    )
    figures = [_best_runs(study, task, begun), *(_first_runs(study, case) for case in begun)]
    return join([tag("p", intro), tag("div", *figures, class_="grid"), _time_table(study, task)])


# Figures ------------------------------------------------------------------------------------


def _best_runs(study: Results, task: str, begun: Sequence[Case]) -> Markup:
    ends = ", ".join(
        f"{case.name} {metres(max(run.best[-1] for run in case.initial))}" for case in begun
    )
    alt = f"Best of the first three runs of each creature, {DOING[task]}, in metres: {ends}."
    image = tag(
        "picture",
        void("source", media="(max-width:42rem)", srcset=best_narrow_file(task)),
        picture(best_file(task), alt, LARGE),
    )
    about = f"best of the first three runs, as its figure {study.published.best_figures[task]}"
    return figure(image, "All creatures", about, class_="wide")


def _first_runs(study: Results, case: Case) -> Markup:
    ends = ", ".join(f"run {run.seed} {metres(run.best[-1])} m" for run in case.initial)
    alt = (
        f"Best fitness of {case.name}, {doing(case)}, over {study.generations} generations: {ends}."
    )
    rows = (_legend(study, run, index) for index, run in enumerate(case.initial, 1))
    theirs = " · ".join(f"{value:.2f}" for value in case.published.finals)
    return figure(
        picture(first_runs_file(case), alt, SMALL),
        case.name,
        f"as its figure {case.published.figure}",
        tag("table", tag("tbody", *rows), class_="legend"),
        note(f"Thesis: {theirs} m"),
    )


def _legend(study: Results, run: Run, index: int) -> Markup:
    """Where a curve ends, and whether its motion is usable there."""
    if mark := run.mark(study.generations):
        state = verdict(mark.usable)
    elif len(run.best) < study.generations:
        state = tag("span", f"after {len(run.best)}", class_="note")
    else:
        state = Markup("–")
    return tag(
        "tr",
        tag("th", dot(index), f"Run {run.seed}", scope="row"),
        number(f"{metres(run.best[-1])} m"),
        tag("td", state),
    )


# Training time ------------------------------------------------------------------------------


def _time_table(study: Results, task: str) -> Markup:
    rows = time_rows(study, task)
    groups = group_heads(3, {"Thesis": 4, "Here": 5})
    head = heads(
        "Creature", "When", ">Generations",
        ">Time", ">Fitness", ">Of its end", "Usable",
        ">Time", ">Fitness", ">Of its end", ">Usable runs", "Usable",
    )  # fmt: skip
    marks = len(study.cases[0].published.marks)
    bodies = [
        tag("tbody", *(_time_cells(row, i, marks) for i, row in enumerate(rows[at : at + marks])))
        for at in range(0, len(rows), marks)
    ]
    about = (
        f"As its table {study.published.tables[task]}. Best fitness in metres, of different "
        "bodies; “of its end” is the part of the fitness at the last generation, which compares. "
        "Ours is the best of the first three runs at that generation, with the time that this run "
        "took to get there and why it is not usable. “Usable runs” counts all runs. "
    )
    return join(
        [
            tag("h3", "Training time"),
            table([groups, head], bodies, f"Training time, {DOING[task]}"),
            note(about, csv_link(time_file(study, task))),
        ]
    )


def _time_cells(row: TimeRow, index: int, marks: int) -> Markup:
    mark, ours = row.published, row.ours
    name = tag("th", row.case.name, scope="rowgroup", rowspan=marks)
    why = tag("small", ours.why) if ours and ours.reasons else Markup()
    return tag(
        "tr",
        name if index == 0 else Markup(),
        tag("th", mark.label, scope="row", class_="when"),
        number(str(row.generation)),
        number(f"{mark.minutes} min", first=True),
        number(metres(mark.fitness)),
        number(percent(row.published_share)),
        tag("td", yes_no(mark.usable)),
        number(duration(ours.seconds if ours else None), first=True),
        number(metres(ours.fitness if ours else None)),
        number(percent(row.share)),
        number(str(row.usable) if row.usable.of else "–"),
        tag("td", yes_no(ours.usable if ours else None), why, class_="why"),
    )
