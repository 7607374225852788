"""What came out: the headline, the comparison with the thesis, and with what it could not do."""

from __future__ import annotations

from ambulo.study import words
from ambulo.study.markup import (
    Markup,
    bar,
    definitions,
    heads,
    join,
    note,
    number,
    table,
    tag,
)
from ambulo.study.results import Results
from ambulo.study.totals import Totals
from ambulo.study.words import count, duration


def headline(study: Results, totals: Totals) -> Markup:
    """The title and the four numbers to take away."""
    facts = [
        (
            "cases usable in the end, best of the first three runs",
            count(totals.cases),
            f"thesis, same cases: {count(totals.published_cases)}",
        ),
        ("of all runs usable in the end", count(totals.runs), "thesis: not given"),
        (
            "evolution, all finished runs",
            duration(totals.seconds),
            f"thesis, same runs: {duration(totals.published_seconds)}",
        ),
        ("cases usable at the very first run", count(totals.first), "thesis: not given"),
    ]
    tiles = [
        tag("div", tag("dt", name), tag("dd", value), tag("dd", other, class_="other"))
        for name, value, other in facts
    ]
    creatures = len({case.published.creature for case in study.cases})
    lead = (
        f"{creatures} creatures, {len(study.cases)} cases, {study.runs} runs each: the protocol of "
        "a diploma thesis of 2017, with our creatures and solver. Its figures and tables stand "
        "beside ours."
    )
    return join(
        [
            tag("p", f"Ambulo {study.version} · a published study, run again", class_="eyebrow"),
            tag("h1", "2D creatures that learn to move"),
            tag("p", lead, class_="lead"),
            tag("dl", *tiles, class_="tiles"),
        ]
    )


def unfinished(study: Results, totals: Totals) -> Markup:
    """What is missing of a study that is not complete."""
    missing = words.what_is_missing(study)
    if not missing:
        return Markup()
    done = f"{totals.finished} runs are finished"
    summary = tag("summary", f"This study is not complete: {done}. What is missing")
    listed = tag("ul", *(tag("li", phrase) for phrase in missing))
    return tag("aside", tag("details", summary, listed), class_="notice")


def outcome(study: Results, totals: Totals) -> Markup:
    """How many are usable and how long it took, and how far that compares."""
    if not totals.runs.of:
        return tag("p", "No run has come to its end yet.")
    paragraphs = [
        words.how_many_usable(totals),
        words.how_long(study, totals),
        "The two words “usable” differ. The thesis means that “the desired motion is actually "
        "executed successfully”, as its author saw it; somersaults count. Here "
        "a replay is measured: the torso must stay up, every leg must work and the pace must "
        "last. Ours is the stricter one.",
        "Metres cannot be compared: the thesis does not give the sizes and motor strengths of its "
        "bodies, and ours are our own. What compares is how the curves rise, which share of the "
        "end is reached when, how far runs differ, and which motions are usable.",
    ]
    prose = tag("div", *(tag("p", text) for text in paragraphs if text), class_="prose")
    return join([prose, _by_time(totals)])


def _by_time(totals: Totals) -> Markup:
    head = heads(
        "Generations of its",
        "Usable in the thesis",
        "Usable here",
        ">Our median time",
        ">Longest",
    )
    names = {"1 min": "first minute", "5 min": "first five minutes", "end": "whole run"}
    body = [
        tag(
            "tr",
            tag("th", names[frame.label], scope="row"),
            tag("td", bar(frame.published)),
            tag("td", bar(frame.usable)),
            number(duration(frame.median)),
            number(duration(frame.longest)),
        )
        for frame in totals.frames
    ]
    about = (
        "Cases in which the best of the first three runs is usable. The thesis judges its decapods "
        "only in the end; here they are judged early too, at the generations that its own pace "
        "comes to."
    )
    return join([table([head], [tag("tbody", *body)], "Usable cases by time"), note(about)])


def limits(study: Results, totals: Totals) -> Markup:
    """What the thesis could not do."""
    points = {
        "Ten legs": words.ten_legs(study),
        "A usable gait at the first try": words.first_try(totals),
        "Inside a game session": words.game_session(totals),
        "Out of local optima": words.local_optima(totals),
        "Not shown here": words.not_shown(study),
    }
    return definitions(points.items(), class_="points")
