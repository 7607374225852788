"""The tables of a study: training time, robustness, and every run; as rows and as CSV.

What is not there yet is `None` or left out of a count, and every count says out of how many.
Fitness is in metres.
"""

from __future__ import annotations

import csv
import io
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from ambulo.study.published import PublishedMark
from ambulo.study.results import INITIAL, Case, Cell, Mark, Results, marks_at

Row = TypeVar("Row")


@dataclass(frozen=True)
class Tally:
    """So many out of so many."""

    count: int
    of: int

    def __str__(self) -> str:
        return f"{self.count} of {self.of}"

    @classmethod
    def over(cls, answers: Iterable[bool]) -> Tally:
        """Count the yes among answers."""
        answers = list(answers)
        return cls(sum(answers), len(answers))


def ratio(part: float | None, whole: float | None) -> float | None:
    """`part / whole` where that says something: of a whole above zero."""
    return None if part is None or whole is None or whole <= 0 else part / whole


# Tables 5.1 and 5.2 -------------------------------------------------------------------------


@dataclass(frozen=True)
class TimeRow:
    """A row of table 5.1 or 5.2: the thesis's on the left, ours on the right."""

    case: Case
    published: PublishedMark
    published_share: float | None
    """Its fitness as a part of its fitness in the end: bodies cancel out."""
    generation: int
    ours: Mark | None
    """Of the first three runs the best at this generation; `None` where none came so far."""
    seed: int | None
    """Of that run."""
    share: float | None
    """As `published_share`."""
    usable: Tally
    """All runs that were judged at this generation."""


def time_rows(results: Results, task: str) -> list[TimeRow]:
    """Three rows a creature: after the thesis's one and five minutes, and in the end."""
    rows = []
    for case in results.of_task(task):
        end = case.best_initial(results.generations)
        for mark in case.published.marks:
            generation = results.generation_of(mark)
            best = case.best_initial(generation)
            rows.append(
                TimeRow(
                    case=case,
                    published=mark,
                    published_share=ratio(mark.fitness, max(case.published.finals)),
                    generation=generation,
                    ours=best[1] if best else None,
                    seed=best[0].seed if best else None,
                    share=ratio(best[1].fitness, end[1].fitness) if best and end else None,
                    usable=Tally.over(mark.usable for mark in case.judged(generation)),
                )
            )
    return rows


TIME_COLUMNS: Mapping[str, Callable[[TimeRow], Cell]] = {
    "creature": lambda row: row.case.published.creature,
    "when": lambda row: row.published.label,
    "generation": lambda row: row.generation,
    "thesis_minutes": lambda row: row.published.minutes,
    "thesis_fitness": lambda row: row.published.fitness,
    "thesis_share_of_end": lambda row: row.published_share,
    "thesis_usable": lambda row: row.published.usable,
    "seconds": lambda row: row.ours.seconds if row.ours else None,
    "fitness": lambda row: row.ours.fitness if row.ours else None,
    "share_of_end": lambda row: row.share,
    "usable": lambda row: row.ours.usable if row.ours else None,
    "why_not": lambda row: row.ours.why if row.ours else None,
    "run": lambda row: row.seed,
    "usable_runs": lambda row: row.usable.count,
    "judged_runs": lambda row: row.usable.of,
}
"""Metres, seconds, minutes, shares of 1."""


def time_csv(results: Results, task: str) -> str:
    """Table 5.1 or 5.2 as CSV."""
    return _columns_csv(TIME_COLUMNS, time_rows(results, task))


# Robustness ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class RobustnessRow:
    """How much the finished runs of a case differ in the end."""

    case: Case
    finished: int
    worst: float | None
    median: float | None
    best: float | None
    spread: float | None
    """Sample standard deviation / mean; none under two runs or where the mean is not above 0."""
    usable: Tally
    evenness: float | None
    """Worst / best of the first three runs, once all three are finished."""
    published_evenness: float
    """The same of the thesis's three."""


def robustness_rows(results: Results) -> list[RobustnessRow]:
    """A row a case."""
    rows = []
    for case in results.cases:
        finished = case.finished(results.generations)
        finals = [run.best[-1] for run in finished]
        spread = statistics.stdev(finals) if len(finals) > 1 else None
        three = finals[:INITIAL] if finished[:INITIAL] == case.initial else []
        rows.append(
            RobustnessRow(
                case=case,
                finished=len(finals),
                worst=min(finals, default=None),
                median=statistics.median(finals) if finals else None,
                best=max(finals, default=None),
                spread=ratio(spread, statistics.mean(finals)) if finals else None,
                usable=Tally.over(m.usable for m in marks_at(finished, results.generations)),
                evenness=ratio(min(three), max(three)) if len(three) == INITIAL else None,
                published_evenness=min(case.published.finals) / max(case.published.finals),
            )
        )
    return rows


ROBUSTNESS_COLUMNS: Mapping[str, Callable[[RobustnessRow], Cell]] = {
    "creature": lambda row: row.case.published.creature,
    "task": lambda row: row.case.published.task,
    "finished_runs": lambda row: row.finished,
    "worst": lambda row: row.worst,
    "median": lambda row: row.median,
    "best": lambda row: row.best,
    "spread": lambda row: row.spread,
    "usable_runs": lambda row: row.usable.count,
    "judged_runs": lambda row: row.usable.of,
    "worst_by_best_of_first_three": lambda row: row.evenness,
    "thesis_worst_by_best_of_three": lambda row: row.published_evenness,
}
"""Metres, shares of 1."""


def robustness_csv(results: Results) -> str:
    """The table of robustness as CSV."""
    return _columns_csv(ROBUSTNESS_COLUMNS, robustness_rows(results))


# Every run ----------------------------------------------------------------------------------


def runs_csv(results: Results) -> str:
    """Every mark of every run, with all that its replay measured."""
    marks = [(case, run, mark) for case in results.cases for run in case.runs for mark in run.marks]
    measures = sorted({key for _, _, mark in marks for key in mark.judgement})
    header = ("creature", "task", "run", "generation", "seconds", "fitness", "usable", "why_not")
    body = [
        (
            case.published.creature,
            case.published.task,
            run.seed,
            mark.generation,
            mark.seconds,
            mark.fitness,
            mark.usable,
            mark.why,
            *(mark.judgement.get(key) for key in measures),
        )
        for case, run, mark in marks
    ]
    return _csv((*header, *measures), body)


# CSV ----------------------------------------------------------------------------------------


def _columns_csv(columns: Mapping[str, Callable[[Row], Cell]], rows: Iterable[Row]) -> str:
    return _csv(list(columns), ([value(row) for value in columns.values()] for row in rows))


def _csv(header: Sequence[str], rows: Iterable[Sequence[Cell]]) -> str:
    """Yes and no, six digits, empty for what is not there."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(header)
    writer.writerows([_csv_cell(cell) for cell in row] for row in rows)
    return file.getvalue()


def _csv_cell(cell: Cell) -> str:
    if cell is None:
        return ""
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    return f"{cell:.6g}" if isinstance(cell, float) else str(cell)
