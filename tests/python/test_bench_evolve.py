"""Measuring how fast creatures are tried: what is measured, and what is said of it."""

from __future__ import annotations

import json
import os
import sys
from typing import Any

import pytest

from ambulo.creature import load_creature
from ambulo.evaluate import evolve_speed
from ambulo.evaluate.evolve_speed import compare, engines
from ambulo.evaluate.machine import machine
from creature_runs import ambulo, said

TINY = ("--population", 3, "--steps", 10, "--repeats", 2)


def measured(peers: bool, **changes: Any) -> dict[str, Any]:
    bodies = {name: load_creature(name) for name in ("biped1", "tetrapod1")}
    tiny: dict[str, Any] = {"population": 3, "steps": 10, "repeats": 3, "threads": [1, 2]}
    return compare(bodies, peers=peers, **(tiny | changes))


def rows(found: dict[str, Any]) -> list[tuple[str, str, int]]:
    return [(row["engine"], row["creature"], row["threads"]) for row in found["results"]]


def test_every_engine_is_measured_on_every_creature() -> None:
    pytest.importorskip("pyb2d3")
    done: list[int] = []
    found = measured(peers=True, watch=done.append)
    assert rows(found) == [
        (engine, creature, threads)
        for creature in ("biped1", "tetrapod1")
        for engine, threads in (("box2d", 1), ("box2d", 2), ("pyb2d3", 1))
    ]
    for row in found["results"]:
        assert 0 < row["least"] <= row["char_steps_per_s"] <= row["most"]
    assert (found["population"], found["steps"], found["repeats"]) == (3, 10, 3)
    # One more each that warms up.
    assert done == list(range(1, 6 * 4 + 1))
    speeds = {
        (row["engine"], row["creature"], row["threads"]): row["char_steps_per_s"]
        for row in found["results"]
    }
    assert [(row["creature"], row["threads"], row["over"]) for row in found["ratios"]] == [
        (creature, threads, "pyb2d3") for creature in ("biped1", "tetrapod1") for threads in (1, 2)
    ]
    for row in found["ratios"]:
        own = speeds["box2d", row["creature"], row["threads"]]
        assert row["ratio"] == round(own / speeds["pyb2d3", row["creature"], 1], 3)


def test_engines_take_turns_and_the_median_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    order: list[str] = []
    speeds = {"a": iter([1e9, 30.0, 10.0, 20.0]), "b": iter([1e9, 5.0, 5.0, 8.0])}

    def made(*_: object, **__: object) -> dict[tuple[str, int], Any]:
        def measure(name: str) -> float:
            order.append(name)
            return next(speeds[name])

        return {("box2d", 1): lambda: measure("a"), ("other", 1): lambda: measure("b")}

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
    clock = iter([5.0, 5.5])
    monkeypatch.setattr(evolve_speed.time, "perf_counter", lambda: next(clock))
    assert made["box2d", 1]() == 3 * 10 / 0.5


def test_the_report_as_json() -> None:
    run = ambulo("bench", "evolve", "--creature", "biped1", *TINY, "--threads", 1, "--no-peers",
                 "--json")  # fmt: skip
    found = said(run)
    assert set(found) >= {"machine", "results"} and found["ratios"] == []
    (row,) = found["results"]
    assert {key: row[key] for key in ("engine", "creature", "threads")} == {
        "engine": "box2d", "creature": "biped1", "threads": 1,
    }  # fmt: skip
    assert isinstance(row["char_steps_per_s"], int) and row["char_steps_per_s"] > 0
    assert set(found["machine"]) == {"cpu", "cores", "system", "python", "load"}


def test_creatures_and_threads_may_be_several_but_none_twice() -> None:
    creatures = ("--creature", "biped1", "--creature", "apod")
    threads = ("--threads", 2, "--threads", 1, "--threads", 2)
    run = ambulo("bench", "evolve", *creatures, *TINY, *threads, "--no-peers", "--json")
    assert rows(said(run)) == [
        ("box2d", "biped1", 2), ("box2d", "biped1", 1), ("box2d", "apod", 2), ("box2d", "apod", 1),
    ]  # fmt: skip


def test_the_table_says_each_engine_and_the_ratio() -> None:
    pytest.importorskip("pyb2d3")
    run = ambulo("bench", "evolve", "--creature", "biped1", *TINY, "--threads", 1)
    assert run.exit_code == 0, run.output
    lines = run.stdout.splitlines()
    assert lines[0].split() == [
        "engine", "creature", "threads", "character-steps/s", "least", "most",
    ]  # fmt: skip
    assert [line.split()[:3] for line in lines[1:3]] == [
        ["box2d", "biped1", "1"], ["pyb2d3", "biped1", "1"],
    ]  # fmt: skip
    assert " × pyb2d3" in lines[3] and machine()["cpu"][:20] in lines[4]


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
