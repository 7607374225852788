"""Measuring how fast creatures are tried: what is measured, and what is said of it."""

from __future__ import annotations

import contextlib
import json
import os
import sys
from itertools import product
from typing import Any

import pytest

from ambulo._core import Arena
from ambulo.creature import load_creature
from ambulo.evaluate import evolve_speed
from ambulo.evaluate.evolve_speed import LANES, compare, engines
from ambulo.evaluate.machine import machine
from creature_runs import SMALL, ambulo, said

TINY = ("--population", 3, "--steps", 10, "--repeats", 2)


def has(lanes: int) -> bool:
    """Whether this machine has so many."""
    with contextlib.suppress(ValueError):
        return bool(Arena(load_creature("biped1"), json.dumps(SMALL), lanes))
    return False


OURS = [
    "lockstep", *(f"lockstep, {name}" for lanes, name in LANES.items() if has(lanes)), "box2d",
]  # fmt: skip


def measured(peers: bool, **changes: Any) -> dict[str, Any]:
    bodies = {name: load_creature(name) for name in ("biped1", "tetrapod1")}
    tiny: dict[str, Any] = {"population": 3, "steps": 10, "repeats": 3, "threads": [1, 2]}
    return compare(bodies, peers=peers, **(tiny | changes))


def rows(found: dict[str, Any]) -> list[tuple[str, str, int]]:
    return [(row["engine"], row["creature"], row["threads"]) for row in found["results"]]


def test_every_engine_is_measured_on_every_creature() -> None:
    pytest.importorskip("pyb2d3")
    done: list[float] = []
    found = measured(peers=True, watch=done.append)
    assert rows(found) == [
        (engine, creature, threads)
        for creature in ("biped1", "tetrapod1")
        for engine, threads in [*product(OURS, (1, 2)), ("pyb2d3", 1)]
    ]
    for row in found["results"]:
        assert 0 < row["least"] <= row["char_steps_per_s"] <= row["most"]
    assert (found["population"], found["steps"], found["repeats"]) == (3, 10, 3)
    # One more each that warms up.
    runs = len(found["results"]) * 4
    assert done == [run / runs for run in range(1, runs + 1)]
    speeds = {
        (row["engine"], row["creature"], row["threads"]): row["char_steps_per_s"]
        for row in found["results"]
    }
    ratios = {(row["creature"], row["threads"], row["over"]) for row in found["ratios"]}
    others = [*OURS[1:], "pyb2d3"]
    assert ratios == set(product(("biped1", "tetrapod1"), (1, 2), others))
    assert len(found["ratios"]) == len(ratios)
    for row in found["ratios"]:
        own = speeds["lockstep", row["creature"], row["threads"]]
        # It has one thread only.
        beside = 1 if row["over"] == "pyb2d3" else row["threads"]
        assert row["ratio"] == round(own / speeds[row["over"], row["creature"], beside], 3)


def test_engines_take_turns_and_the_median_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    order: list[str] = []
    speeds = {"a": iter([1e9, 30.0, 10.0, 20.0]), "b": iter([1e9, 5.0, 5.0, 8.0])}

    def made(*_: object, **__: object) -> dict[tuple[str, int], Any]:
        def measure(name: str) -> float:
            order.append(name)
            return next(speeds[name])

        return {("lockstep", 1): lambda: measure("a"), ("other", 1): lambda: measure("b")}

    monkeypatch.setattr(evolve_speed, "engines", made)
    found = compare(
        {"x": load_creature("biped1")}, population=1, steps=1, repeats=3, threads=[1]
    )  # fmt: skip
    assert order == ["a", "b"] * 4
    assert [row["char_steps_per_s"] for row in found["results"]] == [20, 5]
    assert [(row["least"], row["most"]) for row in found["results"]] == [(10, 30), (5, 8)]
    assert found["ratios"] == [{"creature": "x", "threads": 1, "over": "other", "ratio": 4.0}]


def test_a_measurement_is_of_character_steps_a_second(monkeypatch: pytest.MonkeyPatch) -> None:
    made = engines(
        load_creature("biped1"), population=3, steps=10, threads=[1], peers=False, seed=1
    )  # fmt: skip
    for engine in OURS:
        clock = iter([5.0, 5.5])
        monkeypatch.setattr(evolve_speed.time, "perf_counter", clock.__next__)
        assert made[engine, 1]() == 3 * 10 / 0.5


def test_the_report_as_json() -> None:
    run = ambulo("bench", "evolve", "--creature", "biped1", *TINY, "--threads", 1, "--no-peers",
                 "--json")  # fmt: skip
    found = said(run)
    assert set(found) >= {"machine", "results"}
    assert rows(found) == [(engine, "biped1", 1) for engine in OURS]
    for row in found["results"]:
        assert isinstance(row["char_steps_per_s"], int) and row["char_steps_per_s"] > 0
    assert [row["over"] for row in found["ratios"]] == OURS[1:]
    assert set(found["machine"]) == {"cpu", "cores", "system", "python", "load"}


def test_creatures_and_threads_may_be_several_but_none_twice() -> None:
    creatures = ("--creature", "biped1", "--creature", "apod")
    threads = ("--threads", 2, "--threads", 1, "--threads", 2)
    run = ambulo("bench", "evolve", *creatures, *TINY, *threads, "--no-peers", "--json")
    assert rows(said(run)) == [
        (engine, creature, threads)
        for creature, engine, threads in product(("biped1", "apod"), OURS, (2, 1))
    ]


def test_the_table_says_each_engine_and_the_ratio() -> None:
    pytest.importorskip("pyb2d3")
    run = ambulo("bench", "evolve", "--creature", "biped1", *TINY, "--threads", 1)
    assert run.exit_code == 0, run.output
    lines = run.stdout.splitlines()
    assert lines[0].split() == [
        "engine", "creature", "threads", "character-steps/s", "least", "most",
    ]  # fmt: skip
    engines = [*OURS, "pyb2d3"]
    table, ratios = lines[1 : len(engines) + 1], lines[len(engines) + 1 : -1]
    for engine, line in zip(engines, table, strict=True):
        assert line.startswith(f"{engine} ") and line.split("biped1")[1].split()[0] == "1"
    for engine, line in zip(engines[1:], ratios, strict=True):
        assert line.startswith("lockstep is ") and line.endswith(
            f" × {engine} on biped1, threads: 1"
        )
    assert machine()["cpu"][:20] in lines[-1]


def test_without_pyb2d3_it_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyb2d3", None)
    run = ambulo("bench", "evolve", "--creature", "biped1", *TINY)
    assert run.exit_code == 1
    assert run.stderr == (
        "Error: measuring against pyb2d3 needs it: pip install 'ambulo[bench]'; --no-peers leaves "
        "it out\n"
    )
    assert ambulo("bench", "evolve", "--creature", "biped1", *TINY, "--no-peers").exit_code == 0


def test_a_creature_that_is_not_there_is_named() -> None:
    run = ambulo("bench", "evolve", "--creature", "centipede", *TINY, "--no-peers")
    assert run.exit_code == 1 and "centipede: no such file" in run.output


def test_the_machine_is_said_in_plain_words() -> None:
    found = machine()
    assert json.loads(json.dumps(found)) == found
    assert found["cpu"] and 1 <= found["cores"] <= (os.cpu_count() or 1)
