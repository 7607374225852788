"""How soon creatures learn: every creature × task × seeds, beside the seed's minutes.

    results.json   every case, and the totals
    README.md      the tables

A case is a search as `ambulo evolve` makes it, with its default settings but for what its row says,
stopped when the champion is good and robust (where a task knows no good: robust) or the seconds are
up. Seconds are the processor's, of
one thread, champions' replays included.
"""

from __future__ import annotations

import json
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ambulo._core import Arena, Creature
from ambulo.creature import load_creature
from ambulo.evaluate.machine import machine
from ambulo.files import write_atomic
from ambulo.study.published import PUBLISHED

JUDGED_STEPS = 2000
LEVELS = ("usable", "robust", "good")


@dataclass(frozen=True)
class Row:
    """A kind of search."""

    name: str
    task: str
    settings: dict[str, Any]
    """Beside the defaults."""
    until: str = "good"
    """What ends a search."""


ROWS = (
    Row("run", "run", {}),
    Row("jump", "jump", {}),
    Row("run, the seed's network", "run", {"controller": {"kind": "network"}}),
    Row("run, `--robust`", "run", {"search": {"randomise": True}}),
    Row("run, `--body`", "run", {"body": {}}),
    *(
        Row(task.replace("_", " "), task, {}, until="robust")
        for task in ("climb", "hurdles", "holes", "rough", "keep_upright", "swim")
    ),
)


def case(
    creature: Creature, row: Row, seed: int, seconds: float, stop: Callable[[], bool]
) -> dict[str, Any]:
    """One search: when it was usable, robust and good, and what its champion is worth."""
    settings = {**row.settings, "seed": seed, "generations": 10**7, "task": {"name": row.task}}
    arena = Arena(creature, json.dumps(settings))
    search = arena.search()
    reached: dict[str, float | None] = dict.fromkeys(LEVELS)
    began = time.process_time()
    while reached[row.until] is None and time.process_time() - began < seconds and not stop():
        search.step(arena, 1)
        now = time.process_time() - began
        for level in LEVELS:
            if reached[level] is None and search.has(level):
                reached[level] = round(now, 3)
    champion = search.champion()
    found: dict[str, Any] = {
        "row": row.name,
        "creature": creature.facts()["name"],
        "seed": seed,
        "generations": search.generation,
        "restarts": search.restarts,
        "seconds": reached,
    }
    if champion is None:
        return found | {"judgement": None, "box2d": None}
    genome = champion["genome"]
    judgement = _judged(arena, genome)
    settings["world"] = {"solver": "box2d"}
    elsewhere = _judged(Arena(creature, json.dumps(settings)), genome)
    measure = "gain" if row.task == "jump" else "distance"
    compared = judgement["usable"] and row.task != "keep_upright"
    kept = elsewhere[measure] / judgement[measure] if compared else None
    return found | {
        "judgement": judgement,
        "box2d": {"usable": elsewhere["usable"], "kept": kept, "reasons": elsewhere["reasons"]},
    }


def _judged(arena: Arena, genome: Any) -> dict[str, Any]:
    judgement = json.loads(arena.judge(arena.record(genome, JUDGED_STEPS)))
    del judgement["feet"]
    return judgement


def study(
    creatures: tuple[str, ...],
    *,
    rows: tuple[Row, ...] = ROWS,
    seeds: int,
    seconds: float,
    stop: Callable[[], bool],
    watch: Callable[[str, int], Any],
) -> dict[str, Any]:
    """All cases; those that a stop has kept from being are missing."""
    cases: list[dict[str, Any]] = []
    for row in rows:
        for name in creatures:
            for seed in range(1, seeds + 1):
                if stop():
                    break
                watch(f"{name}, {row.name} {seed}/{seeds}", len(cases))
                cases.append(case(load_creature(name), row, seed, seconds, stop))
    return {
        "machine": machine(),
        "seeds": seeds,
        "seconds": seconds,
        "creatures": list(creatures),
        "totals": [total for row in rows if (total := _total(row, cases)) is not None],
        "cases": cases,
    }


def _total(row: Row, cases: list[dict[str, Any]]) -> dict[str, Any] | None:
    mine = [case for case in cases if case["row"] == row.name]
    if not mine:
        return None
    times = {level: [case["seconds"][level] for case in mine] for level in LEVELS}
    reached = {level: [t for t in found if t is not None] for level, found in times.items()}
    usable = [case for case in mine if case["judgement"] and case["judgement"]["usable"]]
    kept = [kept for case in usable if (kept := case["box2d"]["kept"]) is not None]
    regular = [
        case for case in usable
        if case["judgement"]["regularity"] and case["judgement"]["regularity"] > 0.9
    ]  # fmt: skip
    return {
        "row": row.name,
        "cases": len(mine),
        **{level: len(found) for level, found in reached.items()},
        **{f"{level}_slowest": max(found, default=None) for level, found in reached.items()},
        **{
            f"{level}_median": statistics.median(found) if found else None
            for level, found in reached.items()
        },
        "regular": len(regular),
        "usable_in_box2d": sum(case["box2d"]["usable"] for case in usable),
        "kept_in_box2d": statistics.median(kept) if kept else None,
    }


def minutes_of_the_seed(creature: str, task: str) -> str:
    """When the seed's own champion was usable, in its minutes; a dash for what it has not."""
    if (creature, task) not in {(case.creature, case.task) for case in PUBLISHED.cases}:
        return "–"
    published = PUBLISHED.case(creature, task)
    for mark in published.marks:
        if mark.usable:
            return f"{mark.minutes} min"
    return f"never ({published.minutes} min)"


def page(results: dict[str, Any]) -> str:
    """The tables, as Markdown."""
    told = results["machine"]
    lines = [
        "# How soon creatures learn",
        "",
        "Made by `ambulo study gaits`: every creature and task from "
        f"{results['seeds']} seeds, default settings, one thread, at most "
        f"{results['seconds']:g} s of the processor's time each, champions' replays included.",
        f"{told['cpu']}, {told['system']}, load {told['load']} at the end. Usable, robust and good "
        "are defined in [creatures](../../creatures.md).",
        "",
        "| | usable | robust | good and robust | regularity > 0.9 | usable in Box2D | of its "
        "distance or height kept there, median |",
        "|---|---|---|---|---|---|---|",
    ]
    rows = {row.name: row for row in ROWS}
    for total in results["totals"]:
        row = rows[total["row"]]
        cells = [_of(total, level) for level in LEVELS]
        if row.until != "good":  # Nobody waited for it.
            cells[LEVELS.index("good")] = "–"
        regular = "–" if row.task in ("jump", "keep_upright") else str(total["regular"])
        kept = total["kept_in_box2d"]
        lines.append(
            f"| {total['row']} | {' | '.join(cells)} | {regular} | "
            f"{total['usable_in_box2d']} | {'–' if kept is None else f'{kept:.2f}'} |"
        )
    for row in ROWS:
        mine = [case for case in results["cases"] if case["row"] == row.name]
        if mine:
            lines += ["", f"## {row.name[0].upper()}{row.name[1:]}", "", *_cases(row, mine)]
    return "\n".join(lines) + "\n"


def _of(total: dict[str, Any], level: str) -> str:
    """How many reached it, and when the median and the last one did."""
    text = f"{total[level]} of {total['cases']}"
    if total[level]:
        text += f" ({total[f'{level}_median']:.2f} s, last {total[f'{level}_slowest']:.2f} s)"
    return text


def _cases(row: Row, cases: list[dict[str, Any]]) -> list[str]:
    what = "rise, of what is needed" if row.task == "jump" else "body lengths/s"
    lines = [
        f"| creature | the seed, usable after | seed | usable | robust | good | {what} | "
        "regularity | cost of transport | in Box2D |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for case in cases:
        name = case["creature"].lower().replace(" ", "")
        seconds = (
            "–" if (time := case["seconds"][level]) is None else f"{time:.2f} s" for level in LEVELS
        )
        judgement, box2d = case["judgement"], case["box2d"]
        if judgement is None:
            figures = ["–"] * 4
        else:
            jump, still = row.task == "jump", row.task == "keep_upright"
            speed = (
                judgement["gain"] / judgement["gain_needed"] if jump else judgement["speed_bl_s"]
            )
            kept = "usable" if box2d["usable"] else "not usable"
            if box2d["kept"] is not None:
                kept += f", {100.0 * box2d['kept']:.0f} %"
            regularity, cost = judgement["regularity"], judgement["cost_of_transport"]
            figures = [
                "–" if still else f"{speed:.2f}",
                "–" if jump or still or regularity is None else f"{regularity:.2f}",
                "–" if jump or still or cost is None else f"{cost:.2f}",
                kept,
            ]
        cells = [
            case["creature"],
            minutes_of_the_seed(name, row.task),
            str(case["seed"]),
            *seconds,
            *figures,
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def write(folder: Path, results: dict[str, Any]) -> list[Path]:
    """Writes results and page."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / "results.json", folder / "README.md"]
    write_atomic(paths[0], json.dumps(results) + "\n")
    write_atomic(paths[1], page(results))
    return paths
