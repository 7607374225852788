"""Writes the seeds that no editor can: whole bundles of either precision, as small as can be.

.venv/bin/python fuzz/make_seeds.py
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from ambulo import _core

HEADER = {
    "format": 1,
    "kind": "pfnn",
    "activation": "elu",
    "fps": 60.0,
    "layout": {"name": "t", "hash": "0", "inputs": [["a", 2]], "outputs": [["b", 1]]},
    "licence": "none",
    "provenance": {},
    "parts": {},
}


def ones(*shape: int) -> np.ndarray:
    """Float32 ones."""
    return np.ones(shape, np.float32)


if __name__ == "__main__":
    layers = [(ones(4, 2, 2), ones(4, 2)), (ones(4, 1, 2), ones(4, 1))]
    model = _core.Model.build(json.dumps(HEADER), layers, ones(2), ones(2), ones(1), ones(1))
    folder = Path(__file__).parent / "seeds" / "bundle"
    (folder / "tiny.safetensors").write_bytes(model.to_bytes())
    (folder / "tiny_half.safetensors").write_bytes(model.to_bytes(half=True))
