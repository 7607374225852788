"""How it was done: the protocol, the machine and settings, and the numbers to take along."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any
from urllib.parse import quote

from ambulo.study.assets import ROBUSTNESS_FILE, RUNS_FILE, time_file
from ambulo.study.markup import Markup, definitions, join, tag
from ambulo.study.results import Results
from ambulo.study.words import DOING, duration, processor, when

USABLE = (
    "A run is usable if, on a replay, it still gets forward in its last part, the torso stays "
    "upright and off the ground, and every leg works. A jump is usable if it gains height with "
    "all feet off the ground at once, is upright at the top and stands at the end. The Apod "
    "has no legs: every joint of it must move and, in a jump, nothing may touch the ground."
)


def method(study: Results) -> Markup:
    """All that it takes to make the study again."""
    files = [*(time_file(study, task) for task in DOING), ROBUSTNESS_FILE, RUNS_FILE]
    links = [tag("li", tag("a", file.removeprefix("tables/"), href=quote(file))) for file in files]
    return join(
        [
            tag("p", _protocol(study)),
            tag("p", USABLE),
            definitions(_facts(study).items(), class_="measures settings"),
            tag("h3", "The numbers"),
            tag("ul", *links),
        ]
    )


def _protocol(study: Results) -> str:
    steps = sorted({case.steps for case in study.cases if case.runs}, reverse=True)
    episode = f"; an episode has {' or '.join(map(str, steps))} steps" if steps else ""
    return (
        f"Each case is {study.runs} evolutions of {study.generations} generations of "
        f"{study.population} individuals{episode}. "
        "The number of a run is its random seed, so that it can be made again. Fitness is how far "
        "forward the torso got, or how high."
    )


def _facts(study: Results) -> dict[str, str]:
    return {
        "processor": processor(study),
        "system": str(study.machine.get("system", "unknown")),
        "load before": str(study.machine.get("load", "unknown")),
        "started": when(study.started),
        "time on the clock": duration(study.seconds),
        **_flat(study.settings),
    }


def _flat(settings: Mapping[str, Any], before: str = "") -> dict[str, str]:
    """Nested settings as "group name" → value."""
    flat: dict[str, str] = {}
    for key, value in settings.items():
        name = f"{before}{key}".replace("_", " ")
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{name} ")
        elif isinstance(value, (list, tuple)):
            flat[name] = ", ".join(map(str, value)) or "none"
        else:
            flat[name] = str(value)
    return flat
