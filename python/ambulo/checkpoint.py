"""A run's folder: what was asked for, how it went, and where it can go on.

    settings.json   the settings, the data set and the seed; a run goes on only with the same
    last.npz        everything of the newest checkpoint: weights, moments, means, sampler
    best.npz        the same at the best report so far
    metrics.jsonl   a line a report
    curve.png       the same as a picture

Every file is written beside its place, flushed to the disk and renamed, so that at any moment the
folder holds a whole checkpoint. When a run goes on, the lines after its checkpoint are cut off:
they are computed again, to the same numbers.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ambulo.files import replacing, write_atomic

FORMAT = 1
_NOTES = "notes"


class RunError(ValueError):
    """A run folder cannot be used; the message says what to do."""


class Run:
    """One run's folder; it is made at the first write."""

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)

    @property
    def exists(self) -> bool:
        """Whether a run was begun here."""
        return (self.folder / "settings.json").is_file()

    def begin(self, asked: Mapping[str, Any]) -> None:
        """Write down what was asked for, and take away what an earlier run left."""
        self.folder.mkdir(parents=True, exist_ok=True)
        for name in ("last.npz", "best.npz", "metrics.jsonl", "curve.png", "settings.json"):
            (self.folder / name).unlink(missing_ok=True)
        write_atomic(self.folder / "settings.json", json.dumps(asked, indent=2) + "\n")

    def asked(self) -> dict[str, Any]:
        """What `begin` wrote."""
        path = self.folder / "settings.json"
        try:
            return json.loads(path.read_text(encoding="utf-8"))
        except json.JSONDecodeError as error:
            raise RunError(f"{path}: {error}; --overwrite starts again") from error

    def save(self, name: str, arrays: Mapping[str, Any], notes: Mapping[str, Any]) -> None:
        """Write a checkpoint: named arrays, and plain values beside them."""
        path = self.folder / f"{name}.npz"
        text = json.dumps({"format": FORMAT, **notes}).encode()
        held: dict[str, Any] = {key: np.asarray(value) for key, value in arrays.items()}
        held[_NOTES] = np.frombuffer(text, np.uint8)
        with replacing(path) as part, part.open("wb") as file:
            np.savez(file, allow_pickle=False, **held)
            file.flush()
            os.fsync(file.fileno())
        _settle(self.folder)

    def load(self, name: str) -> tuple[dict[str, NDArray[Any]], dict[str, Any]] | None:
        """The arrays and notes of a checkpoint; None if there is none."""
        path = self.folder / f"{name}.npz"
        if not path.is_file():
            return None
        try:
            with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
                arrays = {key: file[key] for key in file.files}
            notes = json.loads(arrays.pop(_NOTES).tobytes())
        except Exception as error:  # A broken zip raises many things.
            raise RunError(
                f"{path}: not a checkpoint ({error}); --overwrite starts again"
            ) from error
        if notes["format"] != FORMAT:
            raise RunError(
                f"{path}: a checkpoint of format {notes['format']}, this version has {FORMAT}; "
                "--overwrite starts again"
            )
        return arrays, notes

    # -- the curve ----------------------------------------------------------------------------

    def report(self, line: Mapping[str, Any]) -> None:
        """Add a line to the metrics."""
        with (self.folder / "metrics.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
            file.flush()
            os.fsync(file.fileno())

    def reports(self) -> list[dict[str, Any]]:
        """The lines so far; one that a crash left half written is passed over."""
        path = self.folder / "metrics.jsonl"
        if not path.is_file():
            return []
        lines = []
        for text in path.read_text(encoding="utf-8").splitlines():
            try:
                lines.append(json.loads(text))
            except json.JSONDecodeError:
                break
        return lines

    def cut(self, step: int) -> None:
        """Take away the lines after a step."""
        kept = [json.dumps(line) + "\n" for line in self.reports() if line["step"] <= step]
        write_atomic(self.folder / "metrics.jsonl", "".join(kept))

    def draw(self) -> None:
        """Draw the curve."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        lines = self.reports()
        figure = Figure(figsize=(8, 4.5), dpi=120, layout="constrained")
        FigureCanvasAgg(figure)
        losses, loop = figure.subplots(1, 2)
        for axes, keys in (
            (losses, {"loss": "training", "one_step": "validation, one step"}),
            (loop, {"one_step_cm": "one step", "loop_cm": "pose fed back"}),
        ):
            for key, label in keys.items():
                points = [(line["step"], line[key]) for line in lines if line.get(key) is not None]
                if points:
                    axes.plot(*zip(*points, strict=True), label=label)
            axes.set(xlabel="step", yscale="log")
            axes.grid(alpha=0.3)
            if axes.lines:
                axes.legend()
        losses.set(title="loss, deviations²")
        loop.set(title="validation: joint position error, cm")
        with replacing(self.folder / "curve.png") as part:
            figure.savefig(part, format="png")


def _settle(folder: Path) -> None:
    """Flush a folder's entries, so that a rename outlives a power cut."""
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:  # Where folders cannot be opened, renames are all there is.
        return
    try:
        os.fsync(handle)
    except OSError:
        pass
    finally:
        os.close(handle)
