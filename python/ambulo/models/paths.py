"""Ways over the ground and poses told from them, seen from above; batches of them.

A root is x, z and yaw, yaw 0 facing +Z, positive towards +X. A trajectory is places told from a
root: 12 samples, 10 frames apart, the seventh now; that of an output has the six from the next
frame on.

Shapes: N rows, K places, J joints.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jax import Array

from ambulo.models.pfnn import Numbers

SAMPLES, STRIDE, NOW = 12, 10, 6
PAST = NOW * STRIDE
AHEAD = np.arange(SAMPLES - NOW) / (SAMPLES - NOW)
TURN = 2.0 * np.pi


def turned(yaw: Numbers, points: Array) -> Array:
    """(…, 2) from a frame of a yaw into the one around it."""
    sin, cos = jnp.sin(yaw), jnp.cos(yaw)
    x, z = points[..., 0], points[..., 1]
    return jnp.stack([x * cos + z * sin, z * cos - x * sin], axis=-1)


def placed(root: Array, points: Array) -> Array:
    """(N, K, 3) places in roots (N, 3), in the world."""
    place = root[:, None, :2] + turned(root[:, None, 2], points[..., :2])
    return jnp.concatenate([place, root[:, None, 2:] + points[..., 2:]], axis=-1)


def told_from(root: Array, points: Array) -> Array:
    """(N, K, 3) places in the world, seen from roots (N, 3)."""
    place = turned(-root[:, None, 2], points[..., :2] - root[:, None, :2])
    return jnp.concatenate([place, points[..., 2:] - root[:, None, 2:]], axis=-1)


def difference(to: Array, of: Array) -> Array:
    """(N, 3) from one root to another, in the world, the yaw the short way round."""
    off = to - of
    return off.at[:, 2].add(-TURN * jnp.round(off[:, 2] / TURN))


def trajectory(vector: Array, where: tuple[tuple[int, int], ...]) -> Array:
    """(N, K, 3) the trajectory in a vector: x, z, yaw."""
    x, z, dx, dz = (vector[:, slice(*span)] for span in where)
    return jnp.stack([x, z, jnp.arctan2(dx, dz)], axis=-1)


def joined(off: Array, root: Array, future: Array) -> Array:
    """A clip's future (N, 6, 3), told in its root, seen from another root.

    What they are apart (`off`, from the root to the clip's) is made up over the window.
    """
    place = turned(off[:, None, 2], future[..., :2])
    place = place + turned(-root[:, None, 2], off[:, None, :2]) * AHEAD[:, None]
    return jnp.concatenate([place, future[..., 2:] + off[:, None, 2:] * AHEAD[:, None]], axis=-1)


def seen_from(position: Array, here: Array, there: Array) -> Array:
    """Joints (N, 3J) in one root, seen from another; heights are kept."""
    points = position.reshape(len(position), -1, 3)
    flat = here[:, None, :2] + turned(here[:, None, 2], points[..., ::2])
    flat = turned(-there[:, None, 2], flat - there[:, None, :2])
    return jnp.stack([flat[..., 0], points[..., 1], flat[..., 1]], axis=-1).reshape(position.shape)


def raised(position: Array, by: Array) -> Array:
    """(N, 3J) moved up by (N,)."""
    points = position.reshape(len(position), -1, 3)
    return points.at[:, :, 1].add(by[:, None]).reshape(position.shape)


def spline(samples: int, stride: int) -> np.ndarray:
    """(frames, samples): Catmull-Rom from samples `stride` frames apart to every frame."""
    rows = np.zeros(((samples - 1) * stride + 1, samples))
    slopes = np.gradient(np.eye(samples), axis=0, edge_order=2)
    for frame in range(len(rows)):
        k = min(frame // stride, samples - 2)
        t = frame / stride - k
        rows[frame, k] += 2 * t**3 - 3 * t**2 + 1
        rows[frame, k + 1] += 3 * t**2 - 2 * t**3
        rows[frame] += (t**3 - 2 * t**2 + t) * slopes[k] + (t**3 - t**2) * slopes[k + 1]
    return rows.astype(np.float32)


# From the seven samples up to now to every frame.
PAST_FROM_SAMPLES = spline(NOW + 1, STRIDE)
