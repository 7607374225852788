"""Seeded chance, from uniform draws only: their stream is alike in every version of numpy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from ambulo.starter_motion.rotations import Floats, smoothed

T = TypeVar("T")


class Chance:
    """Random numbers of one clip."""

    def __init__(self, *seed: int) -> None:
        self._bits = np.random.Generator(np.random.PCG64(list(seed)))

    def uniform(self, low: float, high: float) -> float:
        """A number from `low` to `high`."""
        return low + (high - low) * float(self._bits.random())

    def about(self, spread: float) -> float:
        """A number around 0 with standard deviation `spread`, never beyond 2.5 of them."""
        return spread * float(self._bits.random(3).sum() - 1.5) * 2.0 * (5.0 / 6.0)

    def happens(self, share: float) -> bool:
        """True this often."""
        return bool(self._bits.random() < share)

    def choice(self, options: Sequence[T], weights: Sequence[float] | None = None) -> T:
        """One of the options, by weight."""
        shares = np.ones(len(options)) if weights is None else np.asarray(weights, np.float64)
        edges = np.cumsum(shares) / shares.sum()
        index = int(np.searchsorted(edges, self._bits.random(), side="right"))
        return options[min(index, len(options) - 1)]

    def wander(self, frames: int, sigma: float) -> Floats:
        """A slow signal (F,) of standard deviation 1; `sigma` frames are its memory."""
        reach = int(np.ceil(3.5 * sigma))
        white = self._bits.random(frames + 2 * reach) * np.sqrt(12.0) - np.sqrt(3.0)
        # White noise blurred by a Gaussian of sigma keeps 1 / (2 sqrt(pi) sigma) of its variance.
        gain = np.sqrt(2.0 * np.sqrt(np.pi) * sigma)
        return smoothed(white, sigma)[reach : reach + frames] * gain
