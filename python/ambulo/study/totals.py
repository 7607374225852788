"""What all cases of a study come to together.

What is not there yet is `None` or left out of a count, and every count says out of how many.
"""

from __future__ import annotations

import re
import statistics
from collections import Counter
from dataclasses import dataclass

from ambulo.study.results import Results
from ambulo.study.tables import Tally, time_rows


@dataclass(frozen=True)
class Frame:
    """All cases at one of the thesis's marks."""

    label: str
    usable: Tally
    """The best of the first three runs, of the cases that came so far."""
    published: Tally
    """Of the cases that its tables judge there."""
    median: float | None
    """Seconds that our runs took to that generation."""
    longest: float | None


@dataclass(frozen=True)
class Totals:
    """What all cases come to."""

    cases: Tally
    """Usable in the end: the best of the first three runs, of the cases that have one."""
    published_cases: Tally
    """The thesis's verdict on the same cases."""
    some: Tally
    """Cases with at least one usable run."""
    runs: Tally
    """Usable runs, of those judged at the end."""
    first: Tally
    """Cases whose very first run is usable."""
    finished: Tally
    """Runs at their last generation, of all asked for."""
    seconds: float
    """Evolution of the finished runs, added up."""
    published_seconds: float
    """What the thesis took for as many runs of the same cases."""
    published_total: float
    """What the thesis took for all its runs, seconds."""
    frames: tuple[Frame, ...]
    reasons: tuple[tuple[str, int], ...]
    """Why runs are not usable in the end, most frequent first; numbers and names of parts in them
    left out."""


def totals_of(results: Results) -> Totals:
    """Add up a study."""
    end, published = results.generations, results.published
    finished = [(case, run) for case in results.cases for run in case.finished(end)]
    by_case = [case.judged(end) for case in results.cases]
    judged = [mark for marks in by_case for mark in marks]
    best = [(case, pair[1]) for case in results.cases if (pair := case.best_initial(end))]
    firsts = [case.runs[0].mark(end) for case in results.cases if case.runs]
    reasons = Counter(kind_of(reason) for m in judged if not m.usable for reason in m.reasons)
    return Totals(
        cases=Tally.over(mark.usable for _, mark in best),
        published_cases=Tally.over(case.published.usable for case, _ in best),
        some=Tally.over(any(mark.usable for mark in marks) for marks in by_case if marks),
        runs=Tally.over(mark.usable for mark in judged),
        first=Tally.over(mark.usable for mark in firsts if mark),
        finished=Tally(len(finished), results.runs * len(results.cases)),
        seconds=sum(run.seconds for _, run in finished),
        published_seconds=60.0 * sum(case.published.minutes for case, _ in finished),
        published_total=60.0 * published.minutes_for_one_run_each() * published.runs,
        frames=_frames(results),
        reasons=tuple(sorted(reasons.items(), key=lambda item: (-item[1], item[0]))),
    )


def _frames(results: Results) -> tuple[Frame, ...]:
    rows = [row for task in results.published.tables for row in time_rows(results, task)]
    frames = []
    for label in dict.fromkeys(row.published.label for row in rows):
        here = [row for row in rows if row.published.label == label]
        seconds = [mark.seconds for row in here for mark in row.case.judged(row.generation)]
        verdicts = [row.published.usable for row in here]
        frames.append(
            Frame(
                label=label,
                usable=Tally.over(row.ours.usable for row in here if row.ours),
                published=Tally.over(v for v in verdicts if v is not None),
                median=statistics.median(seconds) if seconds else None,
                longest=max(seconds, default=None),
            )
        )
    return tuple(frames)


def kind_of(reason: str) -> str:
    """A reason without its numbers and the parts that are idle, to count runs that fail alike."""
    if reason.startswith("idle: "):
        return "idle: …"
    return re.sub(r"[-−+]?\d+(?:[.,]\d+)?(?: ?%)?", "…", reason)
