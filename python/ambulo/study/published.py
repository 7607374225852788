"""The thesis's own figures, typed from its text, as data.

A. Gegendorfer, "Using Neuroevolution for Physics-Based Character Animation in Two Dimensions",
diploma thesis, TU Wien, 2017. Seven creatures × (run, jump) = 14 cases, 10 runs each, 300
generations of 50 individuals, on an i5-4670K that drew them while they trained. Its bodies' sizes
and motor strengths are not given: its metres compare with nobody's.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

RUN, JUMP = "run", "jump"

GENERATIONS = 300


@dataclass(frozen=True)
class PublishedMark:
    """A row of its table 5.1 or 5.2: what was there after some minutes."""

    label: str
    """"1 min", "5 min" or "end"."""
    minutes: int
    """Its column "Duration"."""
    generation: int
    """Its column "Generations". Its decapods' early rows are dashes: there it is what its own
    minutes for 300 generations come to."""
    fitness: float | None
    """Best fitness, metres; `None` where its table has a dash."""
    usable: bool | None
    """By its author's eye; `None` where its table has a dash."""


@dataclass(frozen=True)
class PublishedCase:
    """A creature at a task."""

    creature: str
    """Name of the creature file."""
    name: str
    """As the thesis calls it."""
    task: str
    """`RUN` or `JUMP`."""
    figure: str
    """Fitness of the first three runs over the generations."""
    appendix: str
    """The same of all ten runs."""
    finals: tuple[float, float, float]
    """Final fitness of the three initial runs, metres (section 5.2.1)."""
    marks: tuple[PublishedMark, ...]
    """The rows of its table, from the first minute to the end."""
    rating: float | None
    """How well the motion fits the character, mean of 40 people's 1 to 5 (section 5.2.4)."""
    rating_figure: str | None

    @property
    def minutes(self) -> int:
        """Minutes of a whole run."""
        return self.marks[-1].minutes

    @property
    def usable(self) -> bool:
        """The best of its three initial runs was usable in the end."""
        return bool(self.marks[-1].usable)


@dataclass(frozen=True)
class Published:
    """A published study."""

    source: str
    machine: str
    runs: int
    """Runs of each case."""
    people: int
    """Who rated its motions."""
    cases: tuple[PublishedCase, ...]
    """In its order: the seven creatures running, then jumping."""
    best_figures: dict[str, str]
    """By task: the best initial run of each creature."""
    tables: dict[str, str]
    """By task: the numbers of its tables of training time."""

    @cached_property
    def _by_name(self) -> dict[tuple[str, str], PublishedCase]:
        return {(case.creature, case.task): case for case in self.cases}

    def case(self, creature: str, task: str) -> PublishedCase:
        """Fails with `ValueError` for a case that the study does not have."""
        try:
            return self._by_name[creature, task]
        except KeyError:
            raise ValueError(f"the study has no case '{creature}' with task '{task}'") from None

    def minutes_for_one_run_each(self) -> int:
        """What one run of every case took it."""
        return sum(case.minutes for case in self.cases)


def marks_of(creature: str, task: str) -> list[tuple[str, int]]:
    """The generations at which the thesis looked at a case: (label, generation), in order.

    Two labels may share a generation: its jumps are through with 300 within five minutes.
    """
    return [(mark.label, mark.generation) for mark in PUBLISHED.case(creature, task).marks]


def _case(
    creature: str,
    task: str,
    figures: tuple[str, str],
    finals: tuple[float, float, float],
    marks: tuple[tuple[int, int, float | None, bool | None], ...],
    rating: tuple[float, str] | None,
) -> PublishedCase:
    rows = zip(("1 min", "5 min", "end"), marks, strict=True)
    return PublishedCase(
        creature=creature,
        name=f"{creature[:-1]} {creature[-1]}".capitalize() if creature != "apod" else "Apod",
        task=task,
        figure=figures[0],
        appendix=figures[1],
        finals=finals,
        marks=tuple(PublishedMark(label, *mark) for label, mark in rows),
        rating=rating[0] if rating else None,
        rating_figure=rating[1] if rating else None,
    )


YES, NO, DASH = True, False, None

# fmt: off
PUBLISHED = Published(
    source=(
        "A. Gegendorfer, Using Neuroevolution for Physics-Based Character Animation in Two "
        "Dimensions, diploma thesis, TU Wien, 2017"
    ),
    machine="Intel Core i5-4670K, 3.4 GHz, 8 GB",
    runs=10,
    people=40,
    best_figures={RUN: "5.8", JUMP: "5.16"},
    tables={RUN: "5.1", JUMP: "5.2"},
    cases=(
        _case("apod", RUN, ("5.1", "A.1"), (220.73, 170.29, 123.42), (
            (1, 15, 92.37, YES), (5, 75, 203.51, YES), (20, 300, 220.73, YES)), (3.825, "5.17")),
        _case("biped1", RUN, ("5.2", "A.2"), (73.62, 104.05, 108.32), (
            (1, 15, 19.38, YES), (5, 75, 59.31, YES), (20, 300, 108.32, YES)), (3.75, "5.18")),
        _case("biped2", RUN, ("5.3", "A.3"), (50.38, 41.05, 179.69), (
            (1, 15, 3.68, NO), (5, 75, 109.09, YES), (20, 300, 179.69, YES)), (2.90, "5.19")),
        _case("tetrapod1", RUN, ("5.4", "A.4"), (147.71, 71.37, 209.01), (
            (1, 15, 26.47, NO), (5, 75, 36.43, YES), (20, 300, 209.01, YES)), (4.00, "5.20")),
        _case("tetrapod2", RUN, ("5.5", "A.5"), (136.93, 72.27, 75.41), (
            (1, 11, 19.90, NO), (5, 55, 30.26, NO), (27, 300, 136.93, YES)), (3.65, "5.21")),
        _case("decapod1", RUN, ("5.6", "A.6"), (56.93, 24.98, 20.42), (
            (1, 11, DASH, DASH), (5, 55, DASH, DASH), (27, 300, 56.93, NO)), None),
        _case("decapod2", RUN, ("5.7", "A.7"), (34.02, 20.48, 29.60), (
            (1, 5, DASH, DASH), (5, 25, DASH, DASH), (58, 300, 34.02, NO)), None),
        _case("apod", JUMP, ("5.9", "A.8"), (3.96, 5.58, 5.98), (
            (1, 60, 4.29, NO), (5, 300, 5.98, YES), (5, 300, 5.98, YES)), (3.225, "5.22")),
        _case("biped1", JUMP, ("5.10", "A.9"), (1.93, 2.09, 1.90), (
            (1, 60, 0.86, NO), (5, 300, 2.09, YES), (5, 300, 2.09, YES)), (3.475, "5.23")),
        _case("biped2", JUMP, ("5.11", "A.10"), (2.34, 3.12, 2.87), (
            (1, 60, 1.96, NO), (5, 300, 3.12, YES), (5, 300, 3.12, YES)), (3.275, "5.24")),
        _case("tetrapod1", JUMP, ("5.12", "A.11"), (2.12, 2.69, 2.51), (
            (1, 60, 2.07, NO), (5, 300, 2.69, YES), (5, 300, 2.69, YES)), (3.275, "5.25")),
        _case("tetrapod2", JUMP, ("5.13", "A.12"), (2.75, 3.28, 3.46), (
            (1, 37, 2.85, NO), (5, 187, 3.21, YES), (8, 300, 3.46, YES)), (3.575, "5.26")),
        _case("decapod1", JUMP, ("5.14", "A.13"), (1.23, 1.49, 1.17), (
            (1, 37, DASH, DASH), (5, 187, DASH, DASH), (8, 300, 1.49, NO)), None),
        _case("decapod2", JUMP, ("5.15", "A.14"), (1.54, 1.33, 1.25), (
            (1, 13, DASH, DASH), (5, 68, DASH, DASH), (22, 300, 1.54, NO)), None),
    ),
)
# fmt: on
