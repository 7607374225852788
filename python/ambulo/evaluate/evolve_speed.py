"""How fast creatures are tried: by our solver, by Box2D, and by what others make of that."""

from __future__ import annotations

import contextlib
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
OURS, PEER = "lockstep", "pyb2d3"
LANES = {8: "8 lanes", 1: "1 lane"}
"""Widths that are measured beside the one that this machine takes: AVX2's, and any machine's."""


def engines(
    creature: Creature, *, population: int, steps: int, threads: list[int], peers: bool, seed: int
) -> dict[tuple[str, int], Measured]:
    """What is measured, by engine and threads: each call gives character-steps a second.

    All drive the same creature with the seed's network, inputs | 10 | outputs, every step: random
    ones, as at the start of a search. `lockstep` steps as many individuals together as this machine
    can, `lockstep, 1 lane` each by itself.

    Raises:
        ImportError: a peer is asked for and not installed; the message says how to.
    """

    def ours(solver: str, lanes: int | None) -> Arena:
        settings = {"preset": "seed", "seed": seed, "task": {"name": "run", "steps": steps}}
        settings |= {"evolution": {"population": population}, "world": {"solver": solver}}
        return Arena(creature, json.dumps(settings), lanes)

    def measured(arena: Arena, count: int) -> Measured:
        genomes = arena.search().ask()

        def measure() -> float:
            began = time.perf_counter()
            arena.evaluate(genomes, count)
            return population * steps / (time.perf_counter() - began)

        return measure

    arenas = {OURS: ours("lockstep", None)}
    for lanes, name in LANES.items():
        # Not every machine has them.
        with contextlib.suppress(ValueError):
            arenas[f"lockstep, {name}"] = ours("lockstep", lanes)
    arenas["box2d"] = ours("box2d", None)
    found = {
        (engine, count): measured(arena, count)
        for engine, arena in arenas.items()
        for count in threads
    }
    if peers:
        body = description(creature)
        Peer(body, population, seed)  # What is missing shows before anything is measured.

        def peer() -> float:
            # Making a world counts, as it does for ours.
            began = time.perf_counter()
            Peer(body, population, seed).run(steps)
            return population * steps / (time.perf_counter() - began)

        found[PEER, 1] = peer
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
    watch: Callable[[float], Any] = lambda share: None,
) -> dict[str, Any]:
    """Interleaved repeats of every engine on every creature; medians, and the spread of each.

    `watch` is told which share of them is done.
    """
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
            watch(done / (len(plan) * (repeats + 1)))
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
    """Ours over each other engine on the same creature and as many threads.

    Over the peer, which has but one, with one and with all that were asked for.
    """
    rows = []
    for peer in (row for row in results if row["engine"] != OURS):
        for own in (row for row in results if row["engine"] == OURS):
            alike = own["threads"] == peer["threads"] or peer["engine"] == PEER
            if alike and own["creature"] == peer["creature"]:
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
