"""A search for a creature's controller, and the folder that it lives in.

    run.json         creature, settings, versions: a run goes on only with the same
    creature.json    the creature
    history.jsonl    a line a generation
    champions/       a controller for every improvement, by generation
    best.safetensors the newest of them
    evolved.json     where bodies evolve: its creature
    archive/         of MAP-Elites: a controller for every kind of motion, when the search ends
    checkpoint.json  everything that is needed to go on, renewed every generation

Every file is written beside its place and renamed, and the checkpoint comes last: whatever happens,
the folder can go on from it, at most the generation at hand is lost, and it comes out the same.
"""

from __future__ import annotations

import json
import platform
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ambulo._core import Arena, Creature, Search
from ambulo.creature import load_creature
from ambulo.executors import Executor, default_threads
from ambulo.files import replacing

FORMAT = 2
LICENCE = "the weights are their owner's: evolved from physics alone, no data behind them"


class RunError(ValueError):
    """A run's folder cannot be used; the message says what to do."""


@dataclass(frozen=True)
class Generation:
    """How one generation did."""

    generation: int
    """From 1."""
    best: float
    """Best fitness of this generation; NaN if nothing came of any."""
    mean: float
    """Mean of those that are numbers."""
    steps: int
    """Steps of its episodes."""
    ahead: int
    """How many lessons were ahead of the task itself."""
    best_so_far: float
    """Fitness of the champion, in an episode of full length; NaN before there is one."""
    seconds: float
    """Spent on the search up to now, breaks not counted."""
    improved: bool
    """Whether there is a new champion."""
    learned: bool
    """Whether a lesson was learned with it."""
    restarted: bool
    """Whether the search began anew after it."""


@dataclass(frozen=True)
class Champion:
    """The best that a search has found."""

    genome: NDArray[np.float32]
    """(G,)."""
    fitness: float
    """In an episode of full length."""
    generation: int
    """When it was found, from 1."""
    robustness: dict[str, Any] | None
    """Usable, and under which other physics; None where champions are chosen by fitness alone."""
    good: bool
    """Whether it is good, too."""


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


class Evolution:
    """A search in its folder: `begin` or `resume`, then `step` until it is enough."""

    def __init__(self, folder: Path, creature: Creature, arena: Arena) -> None:
        self.folder, self.creature, self.arena = folder, creature, arena
        self.settings: dict[str, Any] = json.loads(arena.settings())
        self.search: Search = arena.search()
        self.seconds = 0.0
        self._resumed: dict[str, Any] | None = None
        """What `run.json` says from the next step on, of a run that was resumed and not yet gone on
        with."""

    # -- folders -----------------------------------------------------------------------------

    @classmethod
    def exists(cls, folder: Path) -> bool:
        """Whether a run was begun in a folder."""
        return (folder / "run.json").is_file()

    @classmethod
    def begin(cls, folder: Path, creature: Creature, settings: dict[str, Any]) -> Evolution:
        """A new search; what an earlier run left in the folder is taken away.

        Raises:
            ValueError: settings that cannot be, with the name of the field.
        """
        run = cls(folder, creature, Arena(creature, json.dumps(settings)))
        folder.mkdir(parents=True, exist_ok=True)
        names = (
            "run.json", "checkpoint.json", "history.jsonl", "best.safetensors", "evolved.json"
        )  # fmt: skip
        for name in names:
            (folder / name).unlink(missing_ok=True)
        run._forget(after=-1)
        (folder / "champions").mkdir(exist_ok=True)
        _write(folder / "creature.json", creature.json())
        _write(folder / "history.jsonl", "")
        run._save()
        asked = {
            "format": FORMAT,
            "creature": creature.facts()["name"],
            "creature_hash": creature.hash,
            "settings": run.settings,
            "ambulo": version("ambulo"),
            "machine": platform.machine(),
        }
        _write(folder / "run.json", json.dumps(asked, indent=2) + "\n")
        return run

    @classmethod
    def resume(cls, folder: Path, generations: int | None = None) -> Evolution:
        """The last checkpoint; to go on to another number of `generations` if one is given.

        Changes nothing in the folder before it is gone on with.

        Raises:
            RunError: no run, or one that cannot go on.
        """
        if not cls.exists(folder):
            raise RunError(f"{folder} holds no run to go on with")
        asked = _read(folder / "run.json")
        if asked.get("format") != FORMAT or not isinstance(asked.get("settings"), dict):
            raise RunError(f"{folder}: a run of another version; start a new one")
        settings = asked["settings"]
        if generations is not None:
            settings["generations"] = generations
        creature = load_creature(folder / "creature.json")
        if creature.hash != asked.get("creature_hash"):
            raise RunError(
                f"{folder / 'creature.json'} is not the creature that this run began with"
            )
        run = cls(folder, creature, Arena(creature, json.dumps(settings)))
        held = _read(folder / "checkpoint.json")
        try:
            run.search = run.arena.restore(json.dumps(held["search"]))
            run.seconds = float(held["seconds"])
        except (KeyError, TypeError, ValueError) as error:
            raise RunError(f"{folder / 'checkpoint.json'}: {error}; start a new run") from error
        run._resumed = asked
        return run

    def _go_on(self) -> None:
        """Of a run that was resumed: takes away what came after the checkpoint."""
        if self._resumed is None:
            return
        self._forget(after=self.generation)
        history = self.folder / "history.jsonl"
        lines = history.read_text(encoding="utf-8").splitlines()[: self.generation]
        _write(history, "".join(line + "\n" for line in lines))
        _write(self.folder / "run.json", json.dumps(self._resumed, indent=2) + "\n")
        self._resumed = None

    @property
    def generation(self) -> int:
        """How many generations are done."""
        return self.search.generation

    @property
    def generations(self) -> int:
        """How many are to be done."""
        return self.settings["generations"]

    # -- searching ---------------------------------------------------------------------------

    def step(self, executor: Executor, threads: int | None = None) -> Generation:
        """One generation: tries it, notes how it did, saves everything.

        `threads`: of the replays that champions are chosen on; all processors by default.

        Raises:
            RuntimeError: a champion's replay differs from its scores, which must never be.
        """
        self._go_on()
        began = time.perf_counter()
        genomes, how = self.search.ask(), self.search.round(self.arena)
        scores = executor(genomes, how)
        told = self.search.tell(self.arena, scores, threads or default_threads())
        line: dict[str, Any] = {
            "generation": self.generation,
            "best": _number(told["best"]),
            "mean": _number(told["mean"]),
            "steps": told["steps"],
        }
        if told["ahead"]:
            line["ahead"] = told["ahead"]
        for event in ("learned", "restarted"):
            if told[event]:
                line[event] = True
        champion = self.champion
        if told["crowned"]:
            assert champion is not None
            self._check(champion, genomes, scores, how)
            line["champion"] = f"champions/{_champion(self.generation)}"
            line["terms"] = self._crown(champion)
            if champion.robustness is not None:
                line["robustness"], line["good"] = champion.robustness, champion.good
        self.seconds += time.perf_counter() - began
        best_so_far = float("nan") if champion is None else champion.fitness
        line["best_so_far"] = _number(best_so_far)
        line["seconds"] = round(self.seconds, 3)
        with (self.folder / "history.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
        self._save()
        return Generation(
            generation=self.generation,
            best=told["best"],
            mean=told["mean"],
            steps=told["steps"],
            ahead=told["ahead"],
            best_so_far=best_so_far,
            seconds=self.seconds,
            improved=told["crowned"],
            learned=told["learned"],
            restarted=told["restarted"],
        )

    @property
    def champion(self) -> Champion | None:
        """The best that was found."""
        found = self.search.champion()
        if found is None:
            return None
        robustness = found["robustness"]
        return Champion(
            genome=found["genome"],
            fitness=found["fitness"],
            generation=found["generation"],
            robustness=None if robustness is None else json.loads(robustness),
            good=found["good"],
        )

    def steps(
        self,
        executor: Executor,
        *,
        threads: int | None = None,
        minutes: float | None = None,
        until: str | None = None,
        stop: Callable[[], bool] = lambda: False,
    ) -> Iterator[Generation]:
        """One by one until all are done, or `minutes` are up, or `stop` says so.

        Or until the champion is what `until` asks for: `usable`, `robust` or `good`. `threads` as
        in `step`.
        """
        self._go_on()
        end = None if minutes is None else time.perf_counter() + 60.0 * minutes
        while self.generation < self.generations and not stop():
            if until is not None and self.search.has(until):
                break
            yield self.step(executor, threads)
            if end is not None and time.perf_counter() >= end:
                break

    def _check(
        self,
        champion: Champion,
        genomes: NDArray[np.float32],
        scores: NDArray[np.float64],
        how: str,
    ) -> None:
        """Whether a new champion does here what it did where it was tried."""
        index = int(np.argmax((genomes == champion.genome).all(1)))
        found, (again,) = scores[index], self.arena.try_round(champion.genome[None], how, 1)
        if not np.array_equal(again, found):
            raise RuntimeError(
                f"a champion's replay reached {again.tolist()} and not {found.tolist()}: please "
                "report this with the run's folder"
            )

    def _crown(self, champion: Champion) -> dict[str, float]:
        """Writes the champion's file; gives its terms, all of them."""
        _, terms = self.arena.score(champion.genome)
        content = self._controller(champion, terms)
        path = self.folder / "champions" / _champion(self.generation)
        for target in (path, self.folder / "best.safetensors"):
            with replacing(target) as part:
                part.write_bytes(content)
        if "body" in self.settings:
            _write(self.folder / "evolved.json", self.arena.creature_of(champion.genome).json())
        return terms

    def _controller(self, champion: Champion, terms: dict[str, float]) -> bytes:
        """The champion as a controller's file."""
        record = {
            "fitness": champion.fitness,
            # To the last bit, whatever happens to decimal digits on the way.
            "fitness_hex": champion.fitness.hex(),
            "generation": champion.generation,
            "terms": terms,
        }
        if champion.robustness is not None:
            record.update(robustness=champion.robustness, good=champion.good)
        provenance = {
            "tool": f"ambulo {version('ambulo')}",
            "source": f"evolved: {self.settings['task']['name']}",
            "seed": str(self.settings["seed"]),
        }
        # The file holds the creature that has evolved, so there is nothing left to evolve of it.
        arena = {name: value for name, value in self.settings.items() if name != "body"}
        return self.arena.controller(
            champion.genome,
            LICENCE,
            json.dumps(provenance),
            json.dumps({"arena": arena, "record": record}),
        )

    def write_archive(self) -> list[Path]:
        """Of MAP-Elites: a controller for every kind of motion that it keeps, to choose from.

        What an earlier call left is taken away.
        """
        place = self.folder / "archive"
        for path in place.glob("cell-*.safetensors"):
            path.unlink()
        written = []
        for cell, _, genome in self.search.archive():
            place.mkdir(exist_ok=True)
            fitness, terms = self.arena.score(genome)
            elite = Champion(genome, fitness, self.generation, robustness=None, good=False)
            path = place / f"cell-{'-'.join(map(str, cell))}.safetensors"
            with replacing(path) as part:
                part.write_bytes(self._controller(elite, terms))
            written.append(path)
        return written

    def _save(self) -> None:
        # The search's state is JSON as it comes.
        held = f'{{"search": {self.search.state()}, "seconds": {self.seconds!r}}}'
        _write(self.folder / "checkpoint.json", held)

    def _forget(self, after: int) -> None:
        """Champions of later generations, which will come again, and what was half written."""
        for place in (self.folder, self.folder / "champions"):
            for path in place.glob(".*.part"):
                path.unlink(missing_ok=True)
        for path in (self.folder / "champions").glob("generation-*.safetensors"):
            digits = path.stem.removeprefix("generation-")
            if digits.isdigit() and int(digits) > after:
                path.unlink()

    # -- looking back ------------------------------------------------------------------------

    def history(self) -> list[dict[str, Any]]:
        """The lines of `history.jsonl`."""
        return read_history(self.folder)


def read_history(folder: Path) -> list[dict[str, Any]]:
    """A run's generations: generation, best, mean, steps, best_so_far, seconds.

    Before the task itself also ahead, the lessons up to it; of the last of a lesson learned, of the
    last of a search restarted; of champions champion (their file), terms and, where they are chosen
    on replays, robustness and good.
    """
    lines = (folder / "history.jsonl").read_text(encoding="utf-8").splitlines(keepends=True)
    # A run that goes on, or was killed, may be in the middle of its last line.
    return [json.loads(line) for line in lines if line.endswith("\n")]


def population_of(folder: Path) -> tuple[int, Arena, NDArray[np.float32]]:
    """The generation, from 1, that a run would try next, where, and its genomes (N, G).

    Nothing of the run is changed.

    Raises:
        RunError: no run, or one that cannot go on.
    """
    if not Evolution.exists(folder):
        raise RunError(f"{folder} holds no run")
    run = Evolution.resume(folder)
    return run.generation + 1, run.arena, run.search.ask()


def champion_at(folder: Path, generation: int) -> Path | None:
    """The file of a run's champion after so many generations; None if there was none yet."""
    lines = [line for line in read_history(folder)[:generation] if "champion" in line]
    return folder / lines[-1]["champion"] if lines else None


def _champion(generation: int) -> str:
    return f"generation-{generation:06d}.safetensors"


def _write(path: Path, text: str) -> None:
    # Without waiting for the disk: a rename outlives the process, and a generation is short.
    with replacing(path) as part:
        part.write_text(text, encoding="utf-8")


def _read(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, json.JSONDecodeError, UnicodeDecodeError) as error:
        raise RunError(f"{path}: {error}; start a new run") from error
    if not isinstance(found, dict):
        raise RunError(f"{path}: expected an object; start a new run")
    return found
