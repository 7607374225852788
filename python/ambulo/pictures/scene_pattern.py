"""What is drawn on the faces of things: edges, planks, panels, tape; all in metres."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ambulo.pictures.drawing import Pixels
from ambulo.pictures.scene_set import CRATE, LEAF, PARCEL, TERRAIN


def pattern(
    look: NDArray[np.int64], u: Pixels, v: Pixels, hu: Pixels, hv: Pixels, size: Pixels
) -> Pixels:
    """(P,) what the colour is multiplied by: edges, planks, panels, tape.

    `u`, `v` (P,) metres from each face's middle, `hu`, `hv` half its sizes, `size` that of a pixel.
    """
    edge = np.minimum(hu - np.abs(u), hv - np.abs(v))
    drawn = np.float32(0.16) * (look != TERRAIN)
    out = 1.0 - drawn * np.clip((np.float32(0.006) - edge) / size + 0.5, 0.0, 1.0)
    for kind, drawing in ((CRATE, _crate), (LEAF, _leaf), (PARCEL, _parcel)):
        some = np.flatnonzero(look == kind)
        if some.size:
            out[some] *= drawing(*(p[some] for p in (u, v, hu, hv, size)))
    return out


def line(away: Pixels, half: float, size: Pixels) -> Pixels:
    """How much a line `half` m to each side covers of a pixel `size` m wide, `away` m off."""
    cover = np.clip((np.float32(half) - np.abs(away)) / size + 0.5, 0.0, 1.0)
    return cover * np.minimum(np.float32(2.0 * half) / size, 1.0)


def _crate(u: Pixels, v: Pixels, hu: Pixels, hv: Pixels, size: Pixels) -> Pixels:
    """A frame of boards around planks."""
    edge = np.minimum(hu - np.abs(u), hv - np.abs(v))
    board = np.clip(0.24 * np.minimum(hu, hv), 0.02, 0.09)
    inner = np.clip((edge - board) / size + 0.5, 0.0, 1.0)
    plank = np.float32(0.13)
    seam = np.abs(np.remainder(u + 0.5 * plank, plank) - 0.5 * plank)
    out = 1.0 - inner * (0.13 + 0.14 * line(seam, 0.004, size))
    return out * (1.0 - 0.30 * line(edge - board, 0.007, size))


def _leaf(u: Pixels, v: Pixels, hu: Pixels, hv: Pixels, size: Pixels) -> Pixels:
    """Two panels, one above the other, on a face that is large enough."""
    large = (hu > 0.2) & (hv > 0.5)
    side = hu - 0.12 - np.abs(u)
    upper = np.minimum(v + 0.02, hv - 0.13 - v)
    lower = np.minimum(-0.14 - v, v + hv - 0.16)
    edge = np.minimum(side, np.maximum(upper, lower))
    inner = np.clip(edge / size + 0.5, 0.0, 1.0)
    out = (1.0 - 0.07 * inner) * (1.0 - 0.26 * line(edge, 0.009, size))
    return np.where(large, out, 1.0)


def _parcel(u: Pixels, v: Pixels, hu: Pixels, hv: Pixels, size: Pixels) -> Pixels:
    """A strip of tape."""
    return 1.0 + 0.13 * line(u, 0.025, size)
