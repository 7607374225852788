"""Robustness: how much the outcome depends on the run."""

from __future__ import annotations

from ambulo.study.assets import ROBUSTNESS_FILE, all_runs_file
from ambulo.study.curves import SMALL
from ambulo.study.markup import (
    Markup,
    bar,
    csv_link,
    figure,
    group_heads,
    heads,
    join,
    note,
    number,
    picture,
    table,
    tag,
)
from ambulo.study.published import RUN
from ambulo.study.results import Results
from ambulo.study.tables import RobustnessRow, robustness_rows
from ambulo.study.words import DOING, decimal, doing, metres, percent, plural


def robustness(study: Results) -> Markup:
    """A table of all cases, and the figure of each that has a run."""
    rows = robustness_rows(study)
    begun = [row for row in rows if row.case.runs]
    if not begun:
        return tag("p", "No run yet.")
    intro = (
        "How much does the outcome depend on the run? Fitness in metres at the last generation of "
        "all finished runs. The spread is the standard deviation as a part of the mean; worst ÷ "
        "best of the first three runs is what the thesis's numbers allow to compare."
    )
    groups = group_heads(7, {"Worst ÷ best of three": 2})
    head = heads(
        "Case", ">Runs", ">Worst", ">Median", ">Best", ">Spread", "Usable runs", ">Thesis", ">Here"
    )
    bodies = [
        tag("tbody", *(_cells(row) for row in rows if row.case.published.task == task))
        for task in DOING
    ]
    figures = (
        "Every run thin, their mean thick; at the end of a run a filled dot if it is usable, a "
        "hollow one if not."
    )
    return join(
        [
            tag("p", intro),
            table([groups, head], bodies, "Robustness"),
            note(csv_link(ROBUSTNESS_FILE)),
            tag("h3", "All runs"),
            tag("p", figures),
            tag("div", *(_all_runs(row) for row in begun), class_="grid"),
        ]
    )


def _cells(row: RobustnessRow) -> Markup:
    return tag(
        "tr",
        tag("th", row.case.name, tag("small", doing(row.case)), scope="row"),
        number(str(row.finished)),
        number(metres(row.worst)),
        number(metres(row.median)),
        number(metres(row.best)),
        number(percent(row.spread)),
        tag("td", bar(row.usable)),
        number(decimal(row.published_evenness), first=True),
        number(decimal(row.evenness)),
    )


def _all_runs(row: RobustnessRow) -> Markup:
    case = row.case
    way = "forward" if case.published.task == RUN else doing(case)
    ends = (
        f"they end between {metres(row.worst)} and {metres(row.best)} m, median "
        f"{metres(row.median)} m"
        if row.finished
        else "none is finished"
    )
    alt = f"Best fitness of {plural(len(case.runs), 'run')} of {case.name}, {doing(case)}: {ends}."
    about = f"{way}, as its figure {case.published.appendix}"
    return figure(picture(all_runs_file(case), alt, SMALL), case.name, about)
