"""Pictures: a card for each case, of the best of its first three runs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from urllib.parse import quote

from PIL import Image, UnidentifiedImageError

from ambulo.study.markup import Markup, definitions, join, note, picture, tag, verdict
from ambulo.study.results import Case, Cell, Mark, Results, Run
from ambulo.study.words import doing, metres, plural

MEASURES = {
    "speed_bl_s": ("speed", "{:.2f} body lengths/s"),
    "upright": ("upright", "{:.0%} of steps"),
    "torso_contact": ("torso on the ground", "{:.0%} of steps"),
    "legs_used": ("legs used", "{}"),
    "regularity": ("regularity", "{:.2f}"),
    "cost_of_transport": ("cost of transport", "{:.2f}"),
}
"""How a judgement's numbers are called and written; others go by their own name."""


def cards(study: Results, folder: Path) -> Markup:
    """Of the cases that have a run; `folder` is where their pictures lie."""
    intro = "One card a case, of the best of its first three runs after the last generation."
    if any(case.film for case in study.cases):
        intro += " Films are folded up until asked for."
    of_cases = (_card(study, case, folder) for case in study.cases if case.runs)
    return join([tag("p", intro), tag("div", *of_cases, class_="cards")])


def _card(study: Results, case: Case, folder: Path) -> Markup:
    kind = f"{plural(case.legs, 'leg')}, {plural(case.joints, 'joint')}, {case.steps} steps"
    best = case.best_initial(study.generations)
    return tag(
        "article",
        tag("h3", case.name, tag("small", doing(case))),
        note(kind),
        *_pictures(case, folder),
        *(_judged(*best) if best else [note("Not judged at the end yet.")]),
        _rating(study, case),
        class_="card",
    )


def _pictures(case: Case, folder: Path) -> list[Markup]:
    title = f"{case.name}, {doing(case)}"
    parts = []
    if case.picture:
        parts.append(_shown(folder, case.picture, f"Film strip of {title}"))
    if case.gait:
        parts.append(_shown(folder, case.gait, f"Gait diagram of {title}: when each foot is down"))
    if case.film:
        film = _shown(folder, case.film, f"Film of {title}", loading="lazy")
        parts.append(tag("details", tag("summary", "Film"), film))
    return parts


def _shown(folder: Path, file: str, alt: str, loading: str | None = None) -> Markup:
    """A picture that is there, leading to itself in full; else a word that it is not."""
    path = PurePosixPath(file)
    if path.is_absolute() or ".." in path.parts or not (folder / path).is_file():
        return note(f"{alt}: {file} is not there.")
    try:
        with Image.open(folder / path) as image:
            size = image.size
    except UnidentifiedImageError:
        size = None
    return tag("a", picture(file, alt, size, loading), href=quote(file), class_="shot")


def _judged(run: Run, mark: Mark) -> list[Markup]:
    return [
        tag("p", verdict(mark.usable), f" · run {run.seed} · {metres(mark.fitness)} m"),
        note(mark.why) if mark.reasons else Markup(),
        _measures(mark.judgement),
    ]


def _measures(judgement: Mapping[str, Cell]) -> Markup:
    rows = []
    for key, value in judgement.items():
        if value is not None:
            name, form = MEASURES.get(key, (key.replace("_", " "), "{:.3g}"))
            rows.append((name, _measure(value, form)))
    return definitions(rows, class_="measures") if rows else Markup()


def _measure(value: Cell, form: str) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    return form.format(value).replace("-", "−").replace("%", " %")


def _rating(study: Results, case: Case) -> Markup:
    if case.published.rating is None:
        return Markup()
    return note(
        f"The thesis's motion was rated {case.published.rating:.3f} of 5 by "
        f"{study.published.people} people (its figure {case.published.rating_figure})."
    )
