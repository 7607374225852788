"""A search for a creature's controller, and the folder that it lives in.

    run.json         creature, settings, versions: a run goes on only with the same
    creature.json    the creature
    history.jsonl    a line a generation
    champions/       a controller for every improvement, by generation
    best.safetensors the newest of them
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

from ambulo._core import Arena, Creature, Genetic
from ambulo.creature import load_creature
from ambulo.executors import Executor
from ambulo.files import replacing

FORMAT = 1
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
    best_so_far: float
    """Best fitness up to now."""
    seconds: float
    """Spent on the search up to now, breaks not counted."""
    improved: bool
    """Whether there is a new champion."""


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


class Evolution:
    """A search in its folder: `begin` or `resume`, then `step` until it is enough."""

    def __init__(self, folder: Path, creature: Creature, arena: Arena) -> None:
        self.folder, self.creature, self.arena = folder, creature, arena
        self.settings: dict[str, Any] = json.loads(arena.settings())
        self.search: Genetic = arena.search()
        self.best_fitness = -np.inf
        self.best_genome: NDArray[np.float32] | None = None
        self.best_generation = 0
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
        names = ("run.json", "checkpoint.json", "history.jsonl", "best.safetensors")
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
            run.search = Genetic.restore(json.dumps(held["search"]))
            run.seconds = float(held["seconds"])
            run.best_generation = int(held["best_generation"])
            if held["best_genome"] is not None:
                run.best_genome = np.array(held["best_genome"], np.float32)
                run.best_fitness = float.fromhex(held["best_fitness"])
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

    def step(self, executor: Executor) -> Generation:
        """One generation: tries it, notes how it did, saves everything.

        Raises:
            RuntimeError: a champion's replay differs from its fitness, which must never be.
        """
        self._go_on()
        began = time.perf_counter()
        genomes = self.search.ask()
        fitness = np.asarray(executor(genomes), np.float64)
        self.search.tell(fitness.tolist())
        finite = np.isfinite(fitness)
        best = int(np.argmax(np.where(finite, fitness, -np.inf)))
        improved = bool(finite.any() and fitness[best] > self.best_fitness)
        line: dict[str, Any] = {
            "generation": self.generation,
            "best": _number(fitness[best]),
            "mean": _number(fitness[finite].mean()) if finite.any() else None,
        }
        if improved:
            self.best_fitness, self.best_generation = float(fitness[best]), self.generation
            self.best_genome = genomes[best].copy()
            line["champion"] = f"champions/{_champion(self.generation)}"
            line["terms"] = self._crown()
        self.seconds += time.perf_counter() - began
        line["best_so_far"] = _number(self.best_fitness)
        line["seconds"] = round(self.seconds, 3)
        with (self.folder / "history.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
        self._save()
        return Generation(
            generation=self.generation,
            best=fitness[best] if finite.any() else float("nan"),
            mean=float(fitness[finite].mean()) if finite.any() else float("nan"),
            best_so_far=self.best_fitness,
            seconds=self.seconds,
            improved=improved,
        )

    def steps(
        self,
        executor: Executor,
        *,
        minutes: float | None = None,
        stop: Callable[[], bool] = lambda: False,
    ) -> Iterator[Generation]:
        """One by one until all are done, or `minutes` are up, or `stop` says so."""
        self._go_on()
        until = None if minutes is None else time.perf_counter() + 60.0 * minutes
        while self.generation < self.generations and not stop():
            yield self.step(executor)
            if until is not None and time.perf_counter() >= until:
                break

    def _crown(self) -> dict[str, float]:
        """Writes the champion's file; gives its terms, all of them."""
        assert self.best_genome is not None
        again, terms = self.arena.score(self.best_genome)
        if again != self.best_fitness:
            raise RuntimeError(
                f"a champion's replay reached {again!r} and not {self.best_fitness!r}: please "
                "report this with the run's folder"
            )
        content = self._controller(terms)
        path = self.folder / "champions" / _champion(self.generation)
        for target in (path, self.folder / "best.safetensors"):
            with replacing(target) as part:
                part.write_bytes(content)
        return terms

    def _controller(self, terms: dict[str, float]) -> bytes:
        """The champion as a controller's file."""
        assert self.best_genome is not None
        record = {
            "fitness": self.best_fitness,
            # To the last bit, whatever happens to decimal digits on the way.
            "fitness_hex": self.best_fitness.hex(),
            "generation": self.best_generation,
            "terms": terms,
        }
        provenance = {
            "tool": f"ambulo {version('ambulo')}",
            "source": f"evolved: {self.settings['task']['name']}",
            "seed": str(self.settings["seed"]),
        }
        return self.arena.controller(
            self.best_genome,
            LICENCE,
            json.dumps(provenance),
            json.dumps({"arena": self.settings, "record": record}),
        )

    def _save(self) -> None:
        best = self.best_genome
        held = {
            "search": json.loads(self.search.state()),
            "seconds": self.seconds,
            "best_fitness": self.best_fitness.hex() if best is not None else None,
            "best_generation": self.best_generation,
            "best_genome": None if best is None else [float(gene) for gene in best],
        }
        _write(self.folder / "checkpoint.json", json.dumps(held))

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
    """A run's generations: generation, best, mean, best_so_far, seconds, and of champions terms."""
    lines = (folder / "history.jsonl").read_text(encoding="utf-8").splitlines(keepends=True)
    # A run that goes on, or was killed, may be in the middle of its last line.
    return [json.loads(line) for line in lines if line.endswith("\n")]


def population_of(folder: Path) -> tuple[int, NDArray[np.float32]]:
    """The generation, from 1, that a run would try next: (N, G). Nothing of the run is changed.

    Raises:
        RunError: no run, or one that cannot go on.
    """
    if not Evolution.exists(folder):
        raise RunError(f"{folder} holds no run")
    held = _read(folder / "checkpoint.json")
    try:
        search = Genetic.restore(json.dumps(held["search"]))
        return search.generation + 1, search.ask()
    except (KeyError, ValueError) as error:
        raise RunError(f"{folder / 'checkpoint.json'}: {error}") from error


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
