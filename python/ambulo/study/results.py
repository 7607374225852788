"""A study's results, read.

Results are the plain data that the study writes (JSON). They may be unfinished: cases without a
run, runs that have not come to the last generation. Fitness is in metres.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from ambulo.study.published import Published, PublishedCase, PublishedMark

INITIAL = 3
"""The thesis describes the first three runs of a case and tabulates the best of them."""

Cell = str | int | float | bool | None
"""A plain value; `None` is what is not there."""


@dataclass(frozen=True)
class Mark:
    """The best individual so far at a generation, judged on a replay."""

    generation: int
    seconds: float
    """Of evolution up to here."""
    fitness: float
    usable: bool
    reasons: tuple[str, ...]
    """Why it is not usable."""
    judgement: Mapping[str, Cell]
    """What the replay measured."""

    @property
    def why(self) -> str:
        """The reasons in one line."""
        return "; ".join(self.reasons)


@dataclass(frozen=True)
class Run:
    """One evolution."""

    seed: int
    best: tuple[float, ...]
    """Best fitness so far after each generation."""
    seconds: float
    marks: tuple[Mark, ...]

    def mark(self, generation: int) -> Mark | None:
        """What was judged after this generation."""
        return next((mark for mark in self.marks if mark.generation == generation), None)


def marks_at(runs: Iterable[Run], generation: int) -> list[Mark]:
    """What was judged at a generation, of the runs that have it."""
    return [mark for run in runs if (mark := run.mark(generation))]


@dataclass(frozen=True)
class Case:
    """A creature at a task, and the runs that there are."""

    published: PublishedCase
    name: str
    legs: int
    joints: int
    steps: int
    """Physics steps of an episode."""
    runs: tuple[Run, ...]
    """By seed."""
    picture: str | None
    film: str | None
    gait: str | None

    @property
    def initial(self) -> tuple[Run, ...]:
        """The runs that the thesis would describe."""
        return self.runs[:INITIAL]

    def best_initial(self, generation: int) -> tuple[Run, Mark] | None:
        """Of the first three runs the one with the best fitness at a generation."""
        judged = [(run, mark) for run in self.initial if (mark := run.mark(generation))]
        return max(judged, key=lambda pair: pair[1].fitness, default=None)

    def judged(self, generation: int) -> list[Mark]:
        """What was judged at a generation, of all runs that have it."""
        return marks_at(self.runs, generation)

    def finished(self, generations: int) -> tuple[Run, ...]:
        """The runs that came to the last generation."""
        return tuple(run for run in self.runs if len(run.best) >= generations)


@dataclass(frozen=True)
class Results:
    """All that a study has so far."""

    published: Published
    machine: Mapping[str, Any]
    started: str
    version: str
    runs: int
    """Asked for, of each case."""
    generations: int
    population: int
    seconds: float
    """From start to end on the clock."""
    settings: Mapping[str, Any]
    cases: tuple[Case, ...]
    """One for each of the published ones, in their order."""

    def of_task(self, task: str) -> tuple[Case, ...]:
        """The cases of a task."""
        return tuple(case for case in self.cases if case.published.task == task)

    def begun(self, task: str) -> tuple[Case, ...]:
        """Those of them that have a run."""
        return tuple(case for case in self.of_task(task) if case.runs)

    def generation_of(self, mark: PublishedMark) -> int:
        """Where a published mark lies here: "end" is the end also of a shorter study."""
        return self.generations if mark.label == "end" else mark.generation


def read_results(results: Mapping[str, Any], published: Published) -> Results:
    """Read a study's data; `ValueError` names what is missing or unknown."""
    seen: dict[PublishedCase, Mapping[str, Any]] = {}
    for data in _get(results, "cases", "results"):
        known = published.case(_get(data, "creature", "a case"), _get(data, "task", "a case"))
        if known in seen:
            raise ValueError(f"the results have '{known.creature}' with '{known.task}' twice")
        seen[known] = data
    return Results(
        published=published,
        machine=_get(results, "machine", "results"),
        started=str(_get(results, "started", "results")),
        version=str(_get(results, "version", "results")),
        runs=_get(results, "runs", "results"),
        generations=_get(results, "generations", "results"),
        population=_get(results, "population", "results"),
        seconds=float(_get(results, "seconds", "results")),
        settings=results.get("settings", {}),
        cases=tuple(_case(known, seen.get(known, {})) for known in published.cases),
    )


def _get(data: Mapping[str, Any], key: str, where: str) -> Any:
    try:
        return data[key]
    except KeyError:
        raise ValueError(f"{where} of the study: '{key}' is missing") from None


def _case(known: PublishedCase, data: Mapping[str, Any]) -> Case:
    runs = (_run(run, f"a run of '{known.creature}'") for run in data.get("runs", ()))
    return Case(
        published=known,
        name=str(data.get("name", known.name)),
        legs=data.get("legs", 0),
        joints=data.get("joints", 0),
        steps=data.get("steps", 0),
        runs=tuple(sorted((run for run in runs if run.best), key=lambda run: run.seed)),
        picture=data.get("picture"),
        film=data.get("film"),
        gait=data.get("gait"),
    )


def _run(data: Mapping[str, Any], where: str) -> Run:
    return Run(
        seed=_get(data, "seed", where),
        best=tuple(float(fitness) for fitness in _get(data, "best", where)),
        seconds=float(_get(data, "seconds", where)),
        marks=tuple(
            Mark(
                generation=_get(mark, "generation", where),
                seconds=float(_get(mark, "seconds", where)),
                fitness=float(_get(mark, "fitness", where)),
                usable=bool(_get(mark, "usable", where)),
                reasons=tuple(mark.get("reasons", ())),
                judgement=mark.get("judgement", {}),
            )
            for mark in data.get("marks", ())
        ),
    )
