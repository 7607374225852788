"""Models from paths, whatever is there."""

from __future__ import annotations

from pathlib import Path

from ambulo import _core
from ambulo.holden import import_holden
from ambulo.model import Model, ModelError


def load_model(path: str | Path) -> Model:
    """Load a bundle, or import a folder of the PFNN authors' weights on the fly.

    Raises:
        ModelError: not a model; the message names the file and what is wrong.
        FileNotFoundError: nothing is there.
    """
    path = Path(path)
    if path.is_dir():
        return import_holden(path).model
    try:
        return Model(_core.Model.from_bytes(path.read_bytes()))
    except ValueError as error:
        raise ModelError(f"{path}: {error}") from error
