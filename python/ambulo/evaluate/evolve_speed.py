"""How fast creatures are tried, beside what others make of the same engine."""

from __future__ import annotations

import json
import statistics
import time
from collections.abc import Callable
from typing import Any

from ambulo._core import Arena, Creature
from ambulo.creature import description
from ambulo.evaluate.machine import machine
from ambulo.evaluate.peer_pyb2d3 import Peer

Measured = Callable[[], float]


def engines(
    creature: Creature, *, population: int, steps: int, threads: list[int], peers: bool, seed: int
) -> dict[tuple[str, int], Measured]:
    """What is measured, by engine and threads: each call gives character-steps a second.

    All drive the same creature with the seed's network, inputs | 10 | outputs, every step: random
    ones, as at the start of a search.

    Raises:
        ImportError: a peer is asked for and not installed; the message says how to.
    """
    settings = {"seed": seed, "task": {"name": "run", "steps": steps}}
    settings["evolution"] = {"population": population}
    arena = Arena(creature, json.dumps(settings))
    genomes = arena.search().ask()

    def ours(count: int) -> Measured:
        def measure() -> float:
            began = time.perf_counter()
            arena.evaluate(genomes, count)
            return population * steps / (time.perf_counter() - began)

        return measure

    found = {("box2d", count): ours(count) for count in threads}
    if peers:
        body = description(creature)
        Peer(body, population, seed)  # What is missing shows before anything is measured.

        def peer() -> float:
            # Making a world counts, as it does for ours.
            began = time.perf_counter()
            Peer(body, population, seed).run(steps)
            return population * steps / (time.perf_counter() - began)

        found["pyb2d3", 1] = peer
    return found


def compare(
    creatures: dict[str, Creature],
    *,
    population: int,
    steps: int,
    repeats: int,
    threads: list[int],
    peers: bool = True,
    seed: int = 1,
    watch: Callable[[int], Any] = lambda done: None,
) -> dict[str, Any]:
    """Interleaved repeats of every engine on every creature; medians, and the spread of each."""
    plan: list[tuple[str, str, int, Measured]] = []
    for name, creature in creatures.items():
        made = engines(
            creature, population=population, steps=steps, threads=threads, peers=peers, seed=seed
        )
        plan += [(engine, name, count, measure) for (engine, count), measure in made.items()]
    speeds: list[list[float]] = [[] for _ in plan]
    done = 0
    for repeat in range(repeats + 1):
        for entry, (_, _, _, measure) in zip(speeds, plan, strict=True):
            speed = measure()
            if repeat:  # The first one warms up.
                entry.append(speed)
            done += 1
            watch(done)
    results = [
        {
            "engine": engine,
            "creature": name,
            "threads": count,
            "char_steps_per_s": round(statistics.median(entry)),
            "least": round(min(entry)),
            "most": round(max(entry)),
        }
        for entry, (engine, name, count, _) in zip(speeds, plan, strict=True)
    ]
    return {
        "machine": machine(),
        "population": population,
        "steps": steps,
        "repeats": repeats,
        "results": results,
        "ratios": _ratios(results),
    }


def _ratios(results: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Ours over each peer's, on the same creature: a thread, and with all that were asked for."""
    rows = []
    for peer in (row for row in results if row["engine"] != "box2d"):
        for own in results:
            if own["engine"] == "box2d" and own["creature"] == peer["creature"]:
                ratio = own["char_steps_per_s"] / peer["char_steps_per_s"]
                rows.append(
                    {
                        "creature": own["creature"],
                        "threads": own["threads"],
                        "over": peer["engine"],
                        "ratio": round(ratio, 3),
                    }
                )
    return rows
