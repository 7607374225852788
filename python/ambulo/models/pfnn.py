"""The phase-functioned neural network: its numbers, its forward pass, its losses.

Daniel Holden, Taku Komura, Jun Saito, "Phase-Functioned Neural Networks for Character Control",
SIGGRAPH 2017. Affine layers with ELU in between (§4, equation 6), whose weights are a closed
Catmull-Rom spline through four control points, followed once a cycle (equation 7):

    y(x, p) = W2(p) elu(W1(p) elu(W0(p) x + b0(p)) + b1(p)) + b2(p)
    W(p)    = Σ_k share_k(p) W_k

A batch has a phase a row. Blending the weights first would need a matrix a row; since the blend is
linear it may come after the product instead: the four control points lie side by side as one wide
matrix (inputs, 4 × outputs), x is multiplied once, and the four results are blended by the row's
shares. That is four times the arithmetic of one network and still several times quicker, because
it is one large matrix product.

Shapes: N rows of a batch. Phases are in cycles. Everything here is pure: no state, no file, no seed
but the keys that are handed in. How it is run on its own predictions is in `rollout`.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

POINTS = 4

Numbers = Array | np.ndarray

Params = list[dict[str, Array]]
"""A layer each: `weight` (inputs, 4 × outputs), `bias` (4 × outputs,); control point k has the
columns k·outputs to (k+1)·outputs."""


class Scale(NamedTuple):
    """Normalisation: the network sees (x − x_mean) / x_std and gives (y − y_mean) / y_std."""

    x_mean: Numbers
    x_std: Numbers
    y_mean: Numbers
    y_std: Numbers


def init(key: Array, widths: list[int], scheme: str = "glorot") -> Params:
    """Draw weights uniformly, each control point on its own; biases are zero.

    Args:
        key: a JAX random key.
        widths: input, hidden …, output.
        scheme: 'glorot' has the bound √(6 / (inputs + outputs)); 'published' the one of the
            authors' code, √(6 / (inputs · outputs)), some twelve times smaller.
    """
    params = []
    for inputs, outputs in itertools.pairwise(widths):
        key, own = jax.random.split(key)
        spread = inputs * outputs if scheme == "published" else inputs + outputs
        bound = (6.0 / spread) ** 0.5
        weight = jax.random.uniform(own, (inputs, POINTS * outputs), jnp.float32, -bound, bound)
        params.append({"weight": weight, "bias": jnp.zeros(POINTS * outputs, jnp.float32)})
    return params


def phase_shares(cycles: Array) -> Array:
    """Shares of the four control points (…, 4) at phases in cycles (…), taken modulo 1.

    Equation 7 as the kernel that it is: with d the distance from control point k along the closed
    cycle of length 4, the share is 1.5d³ − 2.5d² + 1 up to 1, and −0.5d³ + 2.5d² − 4d + 2 up to 2.
    """
    at = POINTS * (cycles - jnp.floor(cycles))
    around = at[..., None] - jnp.arange(POINTS, dtype=cycles.dtype) + POINTS / 2
    d = jnp.abs(around - POINTS * jnp.floor(around / POINTS) - POINTS / 2)
    near = (1.5 * d - 2.5) * d * d + 1.0
    far = ((-0.5 * d + 2.5) * d - 4.0) * d + 2.0
    return jnp.where(d < 1.0, near, far)


def forward(
    params: Params,
    x: Array,
    cycles: Array,
    key: Array | None = None,
    drop_input: float = 0.0,
    drop_hidden: float = 0.0,
) -> Array:
    """Run the network on normalised numbers: (N, inputs) and (N,) to (N, outputs).

    With a key, numbers are dropped: of the input with one probability, of every hidden layer's
    output with the other; those that stay are scaled up.
    """
    shares = phase_shares(cycles)[:, :, None]
    for index, layer in enumerate(params):
        if key is not None:
            rate = drop_hidden if index else drop_input
            x = dropout(jax.random.fold_in(key, index), x, rate)
        wide = x @ layer["weight"] + layer["bias"]
        x = (wide.reshape(len(x), POINTS, -1) * shares).sum(axis=1)
        if index < len(params) - 1:
            x = jax.nn.elu(x)
    return x


def dropout(key: Array, x: Array, rate: float) -> Array:
    """Set numbers to zero with this probability and scale the others by 1 / (1 − rate)."""
    if rate == 0.0:
        return x
    # Sixteen bits are half the work of the thirty-two that a float takes.
    bits = jax.random.bits(key, x.shape, jnp.uint16)
    return jnp.where(bits >= round(rate * 65536), x / (1.0 - rate), 0.0)


def predict(params: Params, scale: Scale, x: Numbers, cycles: Numbers) -> Array:
    """The same on numbers that are not normalised."""
    x, cycles = jnp.asarray(x), jnp.asarray(cycles)
    y = forward(params, (x - scale.x_mean) / scale.x_std, cycles)
    return y * scale.y_std + scale.y_mean


def mean_size(params: Params) -> Array:
    """Σ over the layers of mean |W|, the published regulariser; biases are free."""
    return sum((jnp.abs(layer["weight"]).mean() for layer in params), jnp.float32(0.0))
