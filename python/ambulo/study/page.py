"""The page of a study: one HTML file with its figures and tables beside it.

Every sentence that says how something came out is made from the data. Nothing is fetched from
elsewhere and nothing runs: pictures and tables lie in the same folder.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ambulo.files import write_atomic
from ambulo.study.assets import csv_tables, figures
from ambulo.study.markup import Markup, join, tag
from ambulo.study.published import JUMP, PUBLISHED, RUN, Published
from ambulo.study.results import Results, read_results
from ambulo.study.sections.cards import cards
from ambulo.study.sections.method import method
from ambulo.study.sections.outcome import headline, limits, outcome, unfinished
from ambulo.study.sections.robustness import robustness
from ambulo.study.sections.task import of_task
from ambulo.study.style import STYLE
from ambulo.study.totals import totals_of


def write_page(
    folder: Path, results: Mapping[str, Any], published: Published = PUBLISHED
) -> list[Path]:
    """Write `index.html`, `figures/*.svg` and `tables/*.csv` into a folder; what was written.

    `results` may be unfinished: the page shows what is there and says what is missing. Paths of
    pictures in it are relative to the folder and should be there by now. The page is written last.
    `ValueError` for results that lack something or have a case that is not a published one.
    """
    study = read_results(results, published)
    files = {**figures(study), **csv_tables(study), "index.html": _page(study, folder)}
    written = []
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomic(path, content)
        written.append(path)
    return written


@dataclass(frozen=True)
class Section:
    """A part of the page."""

    anchor: str
    title: str
    body: Markup

    def markup(self) -> Markup:
        """As HTML."""
        return tag("section", tag("h2", self.title), self.body, id=self.anchor)


def _page(study: Results, folder: Path) -> str:
    totals = totals_of(study)
    sections = [
        Section("outcome", "What came out", outcome(study, totals)),
        Section("limits", "What the thesis could not do", limits(study, totals)),
        Section("pictures", "Pictures", cards(study, folder)),
        Section("forward", "Moving forward", of_task(study, RUN)),
        Section("jumping", "Jumping", of_task(study, JUMP)),
        Section("robustness", "Robustness", robustness(study)),
        Section("method", "How it was done", method(study)),
    ]
    links = [tag("a", section.title, href=f"#{section.anchor}") for section in sections]
    body = join(
        [
            tag("header", headline(study, totals), class_="top"),
            unfinished(study, totals),
            tag("nav", *links, aria_label="Sections"),
            tag("main", *(section.markup() for section in sections)),
            tag("footer", tag("p", f"Made by Ambulo {study.version}. {study.published.source}.")),
        ]
    )
    title = tag("title", "2D creatures that learn to move · Ambulo")
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        f"{title}\n<style>{STYLE}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )
