"""What lies beside the page: its figures and tables, by file name relative to it."""

from __future__ import annotations

from ambulo.study import curves, tables
from ambulo.study.curves import SMALL
from ambulo.study.results import Case, Results
from ambulo.study.words import DOING

ROBUSTNESS_FILE = "tables/robustness.csv"

RUNS_FILE = "tables/runs.csv"


def time_file(study: Results, task: str) -> str:
    """The table of training time of a task."""
    return f"tables/table-{study.published.tables[task]}.csv"


def best_file(task: str) -> str:
    """The figure of the best run of each creature."""
    return f"figures/best-{task}.svg"


def best_narrow_file(task: str) -> str:
    """The same for a narrow screen."""
    return f"figures/best-{task}-narrow.svg"


def first_runs_file(case: Case) -> str:
    """The figure of a case's first three runs."""
    return f"figures/{case.published.creature}-{case.published.task}-first.svg"


def all_runs_file(case: Case) -> str:
    """The figure of all runs of a case."""
    return f"figures/{case.published.creature}-{case.published.task}-all.svg"


def figures(study: Results) -> dict[str, str]:
    """SVG by file name, of the cases that have a run."""
    files = {}
    for task, doing in DOING.items():
        begun = study.begun(task)
        if begun:
            title = f"Best runs, {doing}"
            files[best_file(task)] = curves.best_of_each(begun, study, title)
            files[best_narrow_file(task)] = curves.best_of_each(begun, study, title, SMALL)
        for case in begun:
            files[first_runs_file(case)] = curves.first_runs(case, study)
            files[all_runs_file(case)] = curves.all_runs(case, study)
    return files


def csv_tables(study: Results) -> dict[str, str]:
    """CSV by file name."""
    files = {time_file(study, task): tables.time_csv(study, task) for task in DOING}
    files[ROBUSTNESS_FILE] = tables.robustness_csv(study)
    files[RUNS_FILE] = tables.runs_csv(study)
    return files
