"""What the page says in words and numbers, all of it made from the data."""

from __future__ import annotations

from datetime import datetime

from ambulo.study.published import JUMP, RUN
from ambulo.study.results import Case, Results
from ambulo.study.tables import Tally
from ambulo.study.totals import Totals

DOING = {RUN: "moving forward", JUMP: "jumping"}
"""What a creature does, by task."""


# Numbers ------------------------------------------------------------------------------------


def duration(seconds: float | None) -> str:
    """As one says it: "0.42 s", "31 s", "4 min 12 s", "41 h 40 min"; no break before a unit."""
    if seconds is None:
        return "–"
    if seconds < 10:
        return f"{seconds:.2f}\u00a0s" if seconds < 1 else f"{seconds:.1f}\u00a0s"
    if seconds < 3599.5:
        minutes, rest = divmod(round(seconds), 60)
        parts = ((minutes, "min"), (rest, "s"))
    else:
        hours, minutes = divmod(round(seconds / 60), 60)
        parts = ((hours, "h"), (minutes, "min"))
    return " ".join(f"{count}\u00a0{unit}" for count, unit in parts if count)


def metres(value: float | None) -> str:
    """Without the unit."""
    return decimal(value).replace("-", "−")


def decimal(value: float | None) -> str:
    """Of two digits."""
    return "–" if value is None else f"{value:.2f}"


def percent(share: float | None) -> str:
    """A share of 1."""
    return "–" if share is None else f"{100 * share:.0f} %".replace("-", "−")


def count(tally: Tally) -> str:
    """So many of so many, if any."""
    return str(tally) if tally.of else "none yet"


def plural(number: int, one: str) -> str:
    """A number of things: "1 run", "2 runs"."""
    return f"{number} {one}" if number == 1 else f"{number} {one}s"


def when(started: str) -> str:
    """An ISO time to the minute; anything else as it is."""
    try:
        return datetime.fromisoformat(started).strftime("%Y-%m-%d %H:%M %Z").strip()
    except ValueError:
        return started


def processor(study: Results) -> str:
    """What the study ran on."""
    machine = study.machine
    return f"{machine.get('cpu', 'unknown')}, {plural(int(machine.get('cores', 0)), 'core')}"


def doing(case: Case) -> str:
    """What its creature does."""
    return DOING[case.published.task]


# Sentences ----------------------------------------------------------------------------------


def what_is_missing(study: Results) -> list[str]:
    """A phrase for each case that is not complete; empty when all is there."""
    missing = []
    for case in study.cases:
        finished = len(case.finished(study.generations))
        if finished >= study.runs:
            continue
        begun = len(case.runs) - finished
        task = "running" if case.published.task == RUN else "jumping"
        unfinished = f", {begun} unfinished" if begun else ""
        missing.append(f"{case.name} {task}: {finished} of {study.runs} runs{unfinished}")
    return missing


def how_many_usable(totals: Totals) -> str:
    """Cases and runs, ours and the thesis's; of a study that has judged one."""
    ours, theirs = totals.cases, totals.published_cases
    return (
        f"Of the {ours.of} cases that came to the last generation, the best of the first three "
        f"runs is usable in {ours.count}; of the same cases the thesis counts {theirs.count}. "
        f"Taking any of the runs, {count(totals.some)} cases have a usable one, and "
        f"{count(totals.runs)} runs are usable ({percent(totals.runs.count / totals.runs.of)})."
    )


def how_long(study: Results, totals: Totals) -> str | None:
    """How long evolution took, here and there; nothing while no run is finished."""
    if not totals.finished.count:
        return None
    words = (
        f"The {plural(totals.finished.count, 'finished run')} took {duration(totals.seconds)} of "
        f"evolution, added up; on the clock the whole study took {duration(study.seconds)}. As "
        f"many runs of the same cases took the thesis {duration(totals.published_seconds)}"
    )
    if totals.seconds > 0:
        words += f", {totals.published_seconds / totals.seconds:,.0f} times as long"
    if totals.published_total != totals.published_seconds:
        words += f"; all of its own runs took {duration(totals.published_total)}"
    return (
        f"{words}. That is another machine ({processor(study)}, against an "
        f"{study.published.machine}) and another way of working: the thesis drew its creatures "
        "while they trained, at ten times real time."
    )


def ten_legs(study: Results) -> str:
    """What became of the cases that the thesis got to no usable motion."""
    cases = [case for case in study.cases if not case.published.usable]
    phrases = []
    for case in cases:
        usable = Tally.over(mark.usable for mark in case.judged(study.generations))
        outcome = f"{usable} runs" if usable.of else "none finished yet"
        phrases.append(f"{case.name} {doing(case)}, {outcome}")
    listed = "; ".join(phrases)
    return f"The thesis got {len(cases)} cases to no usable motion. Usable here: {listed}."


def first_try(totals: Totals) -> str:
    """Whether one run is enough."""
    return (
        "The thesis asks for a few runs and a choice among them. Here the very first run of a case "
        f"is usable in {count(totals.first)}."
    )


def game_session(totals: Totals) -> str:
    """Whether a player would wait for it."""
    first, last = totals.frames[0], totals.frames[-1]
    if first.median is None or last.longest is None or first.longest is None:
        return "No run has come far enough to say."
    return (
        f"What the thesis evolved in a minute takes {duration(first.median)} here (median; "
        f"{duration(first.longest)} at most), and {first.usable} cases are usable by then; the "
        f"thesis had {first.published}. The longest whole run took {duration(last.longest)}."
    )


def local_optima(totals: Totals) -> str:
    """How many runs ended in a motion that is not usable, and why."""
    failed = totals.runs.of - totals.runs.count
    start = "Some of the thesis's runs end in somersaults, on a side or on the head. "
    if not failed:
        return f"{start}Here no finished run failed ({count(totals.runs)} usable)."
    listed = "; ".join(f"{reason} ({number})" for reason, number in totals.reasons[:5])
    why = f" Why, most frequent first: {listed}." if listed else ""
    return f"{start}Here {failed} of {totals.runs.of} judged runs are not usable in the end.{why}"


def not_shown(study: Results) -> str:
    """What the thesis looked at and this study does not."""
    return (
        "The thesis also saw motions break when the time scale changed, knew one terrain, and "
        f"asked {study.published.people} people how well a motion fits. This study changes neither "
        "physics nor terrain after training, and nobody was asked: a usable motion need not look "
        "natural."
    )
