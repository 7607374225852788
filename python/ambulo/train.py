"""Training a phase-functioned neural network on a data set: the loop.

`presets` says what can be asked for, `sampler` draws the batches, `trainer` turns one into a step,
`models.pfnn` is the network, `checkpoint` the folder of a run. Batches and random numbers follow
from the seed and the step alone, so that a run that was killed goes on to the same weights.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import jax
import numpy as np
from jax import Array
from numpy.typing import NDArray

from ambulo.checkpoint import Run, RunError
from ambulo.data import Dataset, Rows, windows
from ambulo.normalisation import Normalisation
from ambulo.presets import Settings, SettingsError, difference, plain
from ambulo.sampler import Sampler
from ambulo.trainer import (
    State,
    Trainer,
    TrainingError,
    anyone,
    connect,
    followers,
    stage_at,
    total_steps,
    zero_loss,
)

__all__ = ["Progress", "Result", "TrainingError", "connect", "provenance", "total_steps", "train"]


# Seconds from one picture of the curve to the next.
DRAW_EVERY = 30.0


@dataclass
class Progress:
    """Handed to the watcher while a run goes on."""

    step: int
    steps: int
    samples_per_second: float
    line: dict[str, Any] | None = None
    """The report, if one was just made."""


@dataclass
class Result:
    """What a run came to."""

    params: list[dict[str, NDArray[np.float32]]]
    """The best weights: see `pfnn.Params`."""
    scale: Normalisation
    step: int
    """Steps that were run."""
    best_step: int
    measures: dict[str, float]
    """Of the best weights, on the validation clips (or the training ones if there are none)."""
    finished: bool
    """False if it was stopped before its time."""
    seconds: float
    samples_per_second: float
    warnings: list[str] = field(default_factory=list)


@dataclass
class _Best:
    value: float = math.inf
    step: int = 0
    since: int = 0
    """Reports since then."""
    measures: dict[str, float] = field(default_factory=dict)

    def better(self, line: dict[str, Any], measure: str, split: str) -> bool:
        """Take a report's figures if they are better."""
        value = line["loop_cm" if measure == "loop" else "one_step"]
        if not value < self.value:
            self.since += 1
            return False
        names = ("one_step", "one_step_cm", "loop_cm", "loop_end_cm")
        self.value, self.step, self.since = value, line["step"], 0
        self.measures = {f"{split}_{name}": line[name] for name in names}
        return True


def train(
    dataset: Dataset,
    settings: Settings,
    run: Run,
    *,
    resume: bool = False,
    watch: Callable[[Progress], object] = lambda progress: None,
    stop: Callable[[], bool] = lambda: False,
) -> Result:
    """Train, and leave checkpoints and the curve in the run's folder.

    Args:
        dataset: opened by `open_dataset`.
        settings: what to learn and how; from `load_settings`.
        run: the folder to use.
        resume: go on from its last checkpoint; without one, start.
        watch: called after every step.
        stop: asked after every step; True saves a checkpoint and returns.

    Raises:
        RunError: the run was begun with another data set or other settings.
        SettingsError: settings that do not fit this data set or these devices.
        TrainingError: the loss is no longer a number.
    """
    loop = _Loop(dataset, settings, run)
    loop.begin(resume)
    stopped = False
    while loop.step < loop.trainer.steps and not loop.enough and not stopped:
        line = loop.turn()
        watch(Progress(loop.step, loop.trainer.steps, loop.clock.speed, line))
        # Several processes stop together: they agree on it at reports only.
        if jax.process_count() == 1 or line:
            stopped = anyone(stop())
    if stopped:
        loop.save("last")
    return loop.result(not stopped)


class _Loop:
    """A run under way."""

    def __init__(self, dataset: Dataset, settings: Settings, run: Run) -> None:
        self.dataset, self.settings, self.run = dataset, settings, run
        self.trainer = Trainer(dataset, settings)
        self.sampler = Sampler(
            dataset, settings.seed, pool_bytes=settings.pool_mb << 20, piece=settings.piece,
            balance=settings.balance, mix=settings.mix, stagger=settings.stagger,
        )  # fmt: skip
        self.judged, self.split, self.warnings = _judged(dataset, settings)
        self.writes = jax.process_index() == 0
        self.state: State = self.trainer.start()
        self.kept = self.trainer.kept(self.state)
        self.best, self.clock = _Best(), _Clock()
        self.step = 0
        self.began = time.perf_counter()
        self.drawn = -math.inf

    @property
    def enough(self) -> bool:
        """Whether it has not got better for too long."""
        return 0 < self.settings.patience <= self.best.since

    def begin(self, resume: bool) -> None:
        """Start, or go on from the last checkpoint."""
        now = asked(self.dataset, self.settings)
        if not (resume and self.run.exists):
            if self.writes:
                self.run.begin(now)
            return
        check_same(self.run, now)
        if (found := self.run.load("last")) is not None:
            arrays, notes = found
            self.state = self._from(arrays)
            self.sampler.resume(notes["sampler"])
            self.best = _Best(**notes["best"])
            self.began -= notes["seconds"]
            self.step = int(self.state["step"])
            best = self.run.load("best")
            self.kept = self.trainer.kept(self._from(best[0]) if best else self.state)
        if self.writes:
            self.run.cut(self.step)

    def _from(self, arrays: dict[str, NDArray[Any]]) -> State:
        state = self.trainer.restored(arrays)
        if state is None:
            raise RunError(
                f"{self.run.folder}: its checkpoint has other arrays than this version; "
                "--overwrite starts again"
            )
        return state

    def turn(self) -> dict[str, Any] | None:
        """One step; the report's line if it is time for one."""
        stage, age = stage_at(self.settings, self.step, self.trainer.steps)
        rows, fresh = self.sampler.batch(followers(self.settings, stage), stage.frames, age)
        self.state = self.trainer.learn(self.state, rows, fresh)
        self.step += 1
        self.clock.tick(rows.shape[:2], self.state["step"])
        if self.step % self.settings.every and self.step < self.trainer.steps:
            return None
        return self._report()

    def _report(self) -> dict[str, Any]:
        """Judge, note, draw and save."""
        loss = float(self.state["loss"]) / int(self.state["count"])
        if not math.isfinite(loss):
            raise TrainingError(
                f"the loss is {loss} at step {self.step}: the training has come apart. Try a lower "
                "learning_rate or clip; the last checkpoint is from before"
            )
        speed = self.clock.pause()
        params = self.trainer.kept(self.state)
        line = {
            "step": self.step,
            "epoch": self.sampler.epoch,
            "rate": float(self.trainer.rate(self.step - 1)),
            "loss": loss,
            **self.trainer.measure(params, self.judged),
            "samples_per_s": speed,
            "seconds": time.perf_counter() - self.began,
        }
        self.state = {**self.state, **self.trainer.place(zero_loss())}
        if self.best.better(line, self.settings.measure, self.split):
            self.kept = params
            self.save("best")
        if self.writes:
            self.run.report(line)
            self._draw(self.step == self.trainer.steps or self.enough)
        self.save("last")
        self.clock.go_on()
        return line

    def _draw(self, last: bool) -> None:
        """Draw the curve, though not all the time: it takes half a second."""
        now = time.perf_counter()
        if last or now - self.drawn > DRAW_EVERY:
            self.run.draw()
            self.drawn = time.perf_counter()

    def save(self, name: str) -> None:
        """Write a checkpoint; all processes call it together, one writes."""
        held = self.trainer.held(self.state)
        notes = {
            "sampler": self.sampler.state,
            "best": vars(self.best),
            "seconds": time.perf_counter() - self.began,
        }
        if self.writes:
            self.run.save(name, held, notes)

    def result(self, finished: bool) -> Result:
        """What it came to so far."""
        return Result(
            params=self.kept,
            scale=self.trainer.numbers,
            step=self.step,
            best_step=self.best.step,
            measures=self.best.measures,
            finished=finished,
            seconds=time.perf_counter() - self.began,
            samples_per_second=self.clock.speed,
            warnings=self.warnings,
        )


def _judged(dataset: Dataset, settings: Settings) -> tuple[Rows, str, list[str]]:
    """The windows that a run is judged on, and the split that they are from."""
    for split in ("validation", "training"):
        found = windows(dataset, split, settings.judge_frames, settings.judge_windows)
        if len(found) and split == "validation":
            return found, split, []
        if len(found):
            why = (
                f"no validation clip has {settings.judge_frames} consecutive rows: judged on "
                "training clips, which says nothing of motion that was not seen"
            )
            return found, split, [why]
    raise SettingsError(
        f"judge_frames: no clip has {settings.judge_frames} consecutive rows; make it smaller"
    )


class _Clock:
    """Rows a second of learning; compiling and judging are left out."""

    def __init__(self) -> None:
        self.speed = 0.0
        self._rows, self._seconds, self._since = 0, 0.0, 0.0
        self._warm: set[tuple[int, ...]] = set()

    def tick(self, shape: tuple[int, ...], awaited: Array) -> None:
        """A step on (windows, frames) was asked for."""
        now = time.perf_counter()
        if shape not in self._warm:
            # The first of its kind was compiled.
            awaited.block_until_ready()
            self._warm.add(shape)
            self._since = time.perf_counter()
            return
        self._rows += math.prod(shape)
        self._seconds += now - self._since
        self._since = now
        if self._seconds > 0.0:
            self.speed = self._rows / self._seconds

    def pause(self) -> float:
        """Stop counting, when all steps are done; the speed since the last pause."""
        self._seconds += time.perf_counter() - self._since
        self.speed = self._rows / self._seconds if self._rows else 0.0
        self._rows, self._seconds = 0, 0.0
        return self.speed

    def go_on(self) -> None:
        """Count again."""
        self._since = time.perf_counter()


# -- what a run is ----------------------------------------------------------------------------


def asked(dataset: Dataset, settings: Settings) -> dict[str, Any]:
    """What makes a run this run; as JSON."""
    return {
        "settings": plain(settings),
        "dataset": dataset.identity,
        "layout": dataset.layout["hash"],
    }


def check_same(run: Run, now: dict[str, Any]) -> None:
    """Refuse to go on with a run that was begun otherwise.

    Raises:
        RunError: it names what differs.
    """
    then = run.asked()
    for key, what in (("dataset", "another data set"), ("layout", "another layout")):
        if then.get(key) != now[key]:
            raise RunError(
                f"{run.folder}: begun with {what} ({then.get(key)}, now {now[key]}); "
                "--overwrite starts again"
            )
    changed = difference(then.get("settings", {}), now["settings"])
    if changed:
        raise RunError(
            f"{run.folder}: begun with other settings: {', '.join(changed)}; give the same, or "
            "--overwrite to start again"
        )


def provenance(dataset: Dataset, settings: Settings, result: Result) -> dict[str, str]:
    """Where a model comes from, for its header: text by key."""
    return {
        **{f"data.{key}": value for key, value in dataset.provenance.items()},
        "dataset": dataset.identity,
        "settings": json.dumps(plain(settings), sort_keys=True),
        "seed": str(settings.seed),
        "steps": f"{result.best_step} of {result.step}",
        **{key: f"{value:.4g}" for key, value in result.measures.items()},
        "tool": _tool(),
    }


def _tool() -> str:
    try:
        return f"ambulo {version('ambulo')}"
    except PackageNotFoundError:
        return "ambulo, not installed"
