"""Quaternions (x, y, z, w) and smooth curves over whole arrays of frames.

Angles are in radians. Axes are Ambulo's: +Y up, +Z forward, +X the character's left.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def about(axis: int, angle: ArrayLike) -> Floats:
    """Turns by `angle` (...) about the X (0), Y (1) or Z (2) axis, as quaternions (..., 4)."""
    half = 0.5 * np.asarray(angle, np.float64)
    turned = np.zeros((*half.shape, 4))
    turned[..., axis] = np.sin(half)
    turned[..., 3] = np.cos(half)
    return turned


def product(*factors: Floats) -> Floats:
    """Quaternions (..., 4) multiplied in order: the last one is applied first."""
    result = factors[0]
    for q in factors[1:]:
        px, py, pz, pw = result[..., 0], result[..., 1], result[..., 2], result[..., 3]
        x, y, z, w = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
        both = np.empty(np.broadcast_shapes(result.shape, q.shape))
        both[..., 0] = pw * x + px * w + py * z - pz * y
        both[..., 1] = pw * y - px * z + py * w + pz * x
        both[..., 2] = pw * z + px * y - py * x + pz * w
        both[..., 3] = pw * w - px * x - py * y - pz * z
        result = both
    return result


def inverse(q: Floats) -> Floats:
    """The opposite turns of unit quaternions (..., 4)."""
    return q * np.array([-1.0, -1.0, -1.0, 1.0])


def rotated(q: Floats, vector: ArrayLike) -> Floats:
    """Vectors (..., 3) turned by unit quaternions (..., 4)."""
    v = np.asarray(vector, np.float64)
    axis = q[..., :3]
    twice = 2.0 * cross(axis, v)
    return v + q[..., 3:] * twice + cross(axis, twice)


def cross(a: Floats, b: Floats) -> Floats:
    """Cross products (..., 3); numpy's own is several times slower on short arrays."""
    result = np.empty(np.broadcast_shapes(a.shape, b.shape))
    result[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    result[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    result[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return result


def log(q: Floats) -> Floats:
    """Rotation vectors (..., 3), the short way round, of unit quaternions (..., 4)."""
    q = np.where(q[..., 3:] < 0.0, -q, q)
    sine = np.linalg.norm(q[..., :3], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, q[..., 3:])
    return q[..., :3] * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-9), 2.0)


def exp(vector: Floats) -> Floats:
    """Unit quaternions (..., 4) of rotation vectors (..., 3)."""
    angle = np.linalg.norm(vector, axis=-1, keepdims=True)
    scale = np.where(angle > 1e-9, np.sin(0.5 * angle) / np.maximum(angle, 1e-9), 0.5)
    return np.concatenate([vector * scale, np.cos(0.5 * angle)], axis=-1)


def from_axes(x: Floats, y: Floats, z: Floats) -> Floats:
    """Unit quaternions (..., 4) of orthonormal axes (..., 3), the columns of the matrix."""
    m = np.stack([x, y, z], axis=-1)
    trace = m[..., 0, 0] + m[..., 1, 1] + m[..., 2, 2]
    # The four squares of the parts of the quaternion; the greatest one is divided by.
    squares = np.stack(
        [
            1.0 + 2.0 * m[..., 0, 0] - trace,
            1.0 + 2.0 * m[..., 1, 1] - trace,
            1.0 + 2.0 * m[..., 2, 2] - trace,
            1.0 + trace,
        ],
        axis=-1,
    )
    a, b, c = (
        m[..., 2, 1] - m[..., 1, 2],
        m[..., 0, 2] - m[..., 2, 0],
        m[..., 1, 0] - m[..., 0, 1],
    )
    d, e, f = (
        m[..., 1, 0] + m[..., 0, 1],
        m[..., 0, 2] + m[..., 2, 0],
        m[..., 2, 1] + m[..., 1, 2],
    )
    rows = np.stack(
        [
            np.stack([squares[..., 0], d, e, a], axis=-1),
            np.stack([d, squares[..., 1], f, b], axis=-1),
            np.stack([e, f, squares[..., 2], c], axis=-1),
            np.stack([a, b, c, squares[..., 3]], axis=-1),
        ],
        axis=-2,
    )
    best = squares.argmax(axis=-1)[..., None, None]
    row = np.take_along_axis(rows, np.broadcast_to(best, (*best.shape[:-1], 4)), axis=-2)[..., 0, :]
    return row / np.linalg.norm(row, axis=-1, keepdims=True)


def unit(vector: Floats) -> Floats:
    """Vectors (..., n) scaled to length 1."""
    return vector / np.linalg.norm(vector, axis=-1, keepdims=True)


def heading(yaw: ArrayLike) -> Floats:
    """Forward directions (..., 3) of yaws (...)."""
    yaw = np.asarray(yaw, np.float64)
    return np.stack([np.sin(yaw), np.zeros_like(yaw), np.cos(yaw)], axis=-1)


def leftward(yaw: ArrayLike) -> Floats:
    """Directions (..., 3) to the left of yaws (...)."""
    yaw = np.asarray(yaw, np.float64)
    return np.stack([np.cos(yaw), np.zeros_like(yaw), -np.sin(yaw)], axis=-1)


# -- curves ---------------------------------------------------------------------------------------


def ease(x: ArrayLike) -> Floats:
    """From 0 at 0 to 1 at 1 with least jerk; flat outside (Flash & Hogan 1985)."""
    x = np.clip(np.asarray(x, np.float64), 0.0, 1.0)
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


def mix(a: ArrayLike, b: ArrayLike, share: ArrayLike) -> Floats:
    """`a` where `share` is 0, `b` where it is 1."""
    share = np.asarray(share, np.float64)
    return np.asarray(a, np.float64) * (1.0 - share) + np.asarray(b, np.float64) * share


def smoothed(signal: Floats, sigma: float) -> Floats:
    """A signal (F, ...) blurred over frames by a Gaussian of `sigma` frames; ends are held."""
    if sigma <= 0.0 or len(signal) < 2:
        return signal
    reach = max(int(np.ceil(3.5 * sigma)), 1)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    kernel /= kernel.sum()
    flat = signal.reshape(len(signal), -1)
    padded = np.pad(flat, ((reach, reach), (0, 0)), mode="edge")
    columns = [np.convolve(column, kernel, mode="valid") for column in padded.T]
    return np.stack(columns, axis=1).reshape(signal.shape)


def widened(signal: Floats, reach: int) -> Floats:
    """The greatest value of a signal (F,) within `reach` frames."""
    padded = np.pad(signal, reach, mode="edge")
    return np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1).max(axis=1)


def hermite(
    s: Floats, seconds: float, start: Floats, end: Floats, v0: Floats, v1: Floats
) -> Floats:
    """Points (F, n) at shares `s` (F,) of a passage that takes `seconds`.

    A quintic from `start` at velocity `v0` to `end` at `v1` (n,), without acceleration at the ends.
    """
    s = s[:, None]
    cubed = s**3
    rise = cubed * (10.0 + s * (6.0 * s - 15.0))
    leave = s - cubed * (6.0 + s * (3.0 * s - 8.0))
    arrive = -cubed * (4.0 + s * (3.0 * s - 7.0))
    return start + (end - start) * rise + seconds * (v0 * leave + v1 * arrive)
