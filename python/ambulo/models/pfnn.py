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

Training on one step alone lets a model's small errors feed on themselves once it runs free.
`unroll` therefore also runs it as the runtime does: the predicted pose goes into the next input,
half-way from where its own velocity would take it, while everything else of the input is the
clip's. What a window ends with may be carried into the next one, batch after batch, so that poses
as old as one likes are learned from at the price of a single step.

Shapes: N rows of a batch, T consecutive frames, J joints. Phases are in cycles. Everything here is
pure: no state, no file, no seed but the keys that are handed in.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax import Array, lax

POINTS = 4
# A pose with a number this many deviations from the mean is no body.
BROKEN = 12.0

Params = list[dict[str, Array]]
"""A layer each: `weight` (inputs, 4 × outputs), `bias` (4 × outputs,); control point k has the
columns k·outputs to (k+1)·outputs."""


class Scale(NamedTuple):
    """Normalisation: the network sees (x − x_mean) / x_std and gives (y − y_mean) / y_std."""

    x_mean: Array
    x_std: Array
    y_mean: Array
    y_std: Array


class Wiring(NamedTuple):
    """Where the numbers lie that go round the loop; static. Spans are (first, end)."""

    phase: int
    root: int
    x: tuple[int, int]
    y: tuple[int, int]
    position_in: tuple[int, int]
    velocity_in: tuple[int, int]
    position_out: tuple[int, int]
    velocity_out: tuple[int, int]
    rate_out: int
    contacts_out: tuple[int, int]
    feet: tuple[int, ...]
    """Joints that the contacts are of."""
    unit: float
    """The vectors' units in a metre; roots are in metres."""
    dt: float
    """One frame in the unit that velocities and the phase rate count in."""
    fps: float


class Options(NamedTuple):
    """How a forward pass is disturbed and how a loop is closed; static but for `noise`."""

    drop_input: float = 0.0
    drop_hidden: float = 0.0
    noise: Any = 0.0
    """Largest deviation of what is added to a pose that a row starts from, as a share of
    `pose_std`."""
    phase_noise: Any = 0.0
    """The same for its phase, cycles."""
    feedback: float = 0.5
    """Share of the predicted position in what is fed back; the rest is the carried one."""
    own_phase: bool = False
    closed: bool = True
    """Feed the pose back; else every step has the clip's own input."""
    through_time: bool = True
    """Let the gradient flow from a step into those before it."""
    phase_pull: float = 0.0
    """Of an own phase: the share of what it is off from the clip's that a second takes back."""
    implied: float = 0.0
    """Weight in the loss of the velocity that a pose implies: see `_implied`."""
    planted: float = 0.0
    """The same of feet in contact."""


class Outcome(NamedTuple):
    """What `unroll` says of every step."""

    loss: Array
    """(T,) weighted mean square in normalised units."""
    position: Array
    """(T, N) mean distance of a joint from the clip's, in the layout's unit of length."""


# -- the network ------------------------------------------------------------------------------


def init(key: Array, widths: list[int], scheme: str = "glorot") -> Params:
    """Draw weights uniformly, each control point on its own; biases are zero.

    Args:
        key: a JAX random key.
        widths: input, hidden …, output.
        scheme: 'glorot' has the bound √(6 / (inputs + outputs)); 'published' the one of the
            authors' code, √(6 / (inputs · outputs)), some twelve times smaller.
    """
    params = []
    for inputs, outputs in zip(widths[:-1], widths[1:], strict=True):
        key, own = jax.random.split(key)
        spread = inputs * outputs if scheme == "published" else inputs + outputs
        bound = (6.0 / spread) ** 0.5
        weight = jax.random.uniform(own, (inputs, POINTS * outputs), jnp.float32, -bound, bound)
        params.append({"weight": weight, "bias": jnp.zeros(POINTS * outputs, jnp.float32)})
    return params


def phase_shares(cycles: Array) -> Array:
    """Shares of the four control points (…, 4) at phases in cycles (…); any phase is taken modulo 1.

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


def predict(params: Params, scale: Scale, x: Array, cycles: Array) -> Array:
    """The same on numbers that are not normalised."""
    y = forward(params, (x - scale.x_mean) / scale.x_std, cycles)
    return y * scale.y_std + scale.y_mean


def mean_size(params: Params) -> Array:
    """Σ over the layers of mean |W|, the published regulariser; biases are free."""
    return sum((jnp.abs(layer["weight"]).mean() for layer in params), jnp.float32(0.0))


# -- the loop ---------------------------------------------------------------------------------


class Carry(NamedTuple):
    """What the next step takes from the model itself, a row of the batch each."""

    position: Array
    """(N, 3J), joints as they were predicted, in the root of that moment."""
    velocity: Array
    """(N, 3J)"""
    phase: Array
    """(N,)"""
    root: Array
    """(N, 4), of that moment: x, height, z, yaw in the world."""
    valid: Array
    """(N,) False: nothing to go on from, or a pose that is no body; the clip's own is taken."""


def nothing(rows: int, joints: int) -> Carry:
    """A carry to start with."""
    pose = jnp.zeros((rows, 3 * joints))
    return Carry(pose, pose, jnp.zeros(rows), jnp.zeros((rows, 4)), jnp.zeros(rows, bool))


def unroll(
    params: Params,
    scale: Scale,
    wiring: Wiring,
    rows: Array,
    *,
    carry: Carry | None = None,
    fresh: Array | None = None,
    weights: Array | float = 1.0,
    pose_std: Array | float = 0.0,
    options: Options = Options(),
    key: Array | None = None,
) -> tuple[Outcome, Carry]:
    """Run over windows of consecutive rows of a data set and compare with them.

    Args:
        params: the network.
        scale: its normalisation.
        wiring: what lies where.
        rows: (N, T, columns), a data set's rows as they are.
        carry: of the windows just before these; none: start anew.
        fresh: (N,) start anew here, whatever the carry.
        weights: (outputs,) of each output's square in the loss.
        pose_std: (6J,) deviations of the input's positions and velocities, for the noise.
        options: disturbances and how the loop is closed.
        key: of dropout and noise; without it nothing is disturbed.
    """
    rows = jnp.swapaxes(rows, 0, 1)
    if carry is None:
        joints = (wiring.position_in[1] - wiring.position_in[0]) // 3
        carry = nothing(rows.shape[1], joints)
    if fresh is not None:
        carry = carry._replace(valid=carry.valid & ~fresh)

    def step(carry: Carry, frame: tuple[Array, Array]) -> tuple[Carry, tuple[Array, Array]]:
        index, row = frame
        own = None if key is None else jax.random.fold_in(key, index)
        return _step(params, scale, wiring, carry, row, weights, pose_std, options, own)

    if len(rows) == 1:
        carry, (loss, error) = step(carry, (jnp.int32(0), rows[0]))
        return Outcome(loss[None], error[None]), carry
    carry, (loss, error) = lax.scan(step, carry, (jnp.arange(len(rows)), rows))
    return Outcome(loss, error), carry


def _step(
    params: Params, scale: Scale, wiring: Wiring, carry: Carry, row: Array,
    weights: Array | float, pose_std: Array | float, options: Options, key: Array | None,
) -> tuple[Carry, tuple[Array, Array]]:  # fmt: skip
    """One frame of every row: input, prediction, loss, and what goes on."""
    if not options.through_time:
        carry = lax.stop_gradient(carry)
    clip, y = row[:, slice(*wiring.x)], row[:, slice(*wiring.y)]
    x, phase, carried = _told(wiring, carry, row, clip, y, pose_std, options, key)
    target = (y - scale.y_mean) / scale.y_std
    if options.own_phase:
        target = _led_back(target, scale, wiring, phase, row[:, wiring.phase], options)
    guess = forward(
        params, (x - scale.x_mean) / scale.x_std, phase, key,
        options.drop_input, options.drop_hidden,
    )  # fmt: skip
    loss = (jnp.square(guess - target) * weights).mean()
    if options.implied or options.planted:
        loss = loss + _implied(guess, clip, y, carry, carried, scale, wiring, row, options)
    pose = jnp.concatenate(
        [guess[:, slice(*wiring.position_out)], guess[:, slice(*wiring.velocity_out)]], axis=1
    )
    valid = jnp.abs(pose).max(axis=1) < BROKEN
    guess = guess * scale.y_std + scale.y_mean
    off = lax.stop_gradient(guess - y)[:, slice(*wiring.position_out)]
    error = jnp.sqrt(jnp.square(off.reshape(len(y), -1, 3)).sum(-1)).mean(-1)
    # As the runtime has it: the position goes `feedback` of the way from the carried one, moved
    # by the predicted velocity, to the predicted one, and no phase runs backwards.
    velocity = guess[:, slice(*wiring.velocity_out)]
    moved = carried + velocity * wiring.dt
    position = moved + options.feedback * (guess[:, slice(*wiring.position_out)] - moved)
    phase = phase + jnp.maximum(guess[:, wiring.rate_out], 0.0) * wiring.dt
    return Carry(position, velocity, phase, _root(row, wiring), valid), (loss, error)


def _root(row: Array, wiring: Wiring) -> Array:
    """(N, 4): x, height, z in the vectors' unit, yaw."""
    place = row[:, wiring.root : wiring.root + 3] * wiring.unit
    return jnp.concatenate([place, row[:, wiring.root + 3 : wiring.root + 4]], axis=1)


def _told(
    wiring: Wiring, carry: Carry, row: Array, x: Array, y: Array, pose_std: Array | float,
    options: Options, key: Array | None,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """The input, its phase, and the pose before as it is seen from this row's root.

    Rows with nothing to go on from have the clip's own input, with noise; the others the clip's
    with their own pose in it.
    """
    position, velocity = x[:, slice(*wiring.position_in)], x[:, slice(*wiring.velocity_in)]
    # The root in which a fresh pose is told is not at hand; but where the clip is now, less how it
    # got there, is where it was. (The velocity is in the root before: one frame's turn of it.)
    carried = y[:, slice(*wiring.position_out)] - velocity * wiring.dt
    phase = row[:, wiring.phase]
    disturbed = any(not isinstance(n, float) or n for n in (options.noise, options.phase_noise))
    if key is not None and disturbed:
        there = position
        position, velocity, phase = _noisy(key, position, velocity, phase, pose_std, options)
        carried = carried + position - there
    if options.closed:
        going = carry.valid[:, None]
        root = _root(row, wiring)
        raised = _raised(carry.position, carry.root[:, 1] - root[:, 1])
        carried = jnp.where(going, _seen_from(raised, carry.root, root), carried)
        position = jnp.where(going, raised, position)
        velocity = jnp.where(going, carry.velocity, velocity)
        if options.own_phase:
            phase = jnp.where(carry.valid, carry.phase, phase)
    x = x.at[:, slice(*wiring.position_in)].set(position)
    return x.at[:, slice(*wiring.velocity_in)].set(velocity), phase, carried


def _led_back(
    target: Array, scale: Scale, wiring: Wiring, own: Array, clip: Array, options: Options
) -> Array:
    """The phase rate to learn: the clip's, and what brings the own phase back to the clip's.

    Left alone, a phase that has strayed would never learn to return. `phase_pull` is the share of
    what it is off that goes in a second.
    """
    off = lax.stop_gradient(clip - own)
    off = off - jnp.round(off)
    pull = options.phase_pull * off / (wiring.fps * wiring.dt)
    return target.at[:, wiring.rate_out].add(pull / scale.y_std[wiring.rate_out])


def _implied(
    guess: Array, clip: Array, y: Array, carry: Carry, carried: Array, scale: Scale,
    wiring: Wiring, row: Array, options: Options,
) -> Array:  # fmt: skip
    """How far the way from the pose before to the predicted one is from the capture's velocity.

    A pose that has strayed could otherwise snap back to the clip in one frame: right by the square
    error of the pose, and seen as a jerk and a sliding foot.
    """
    place = slice(*wiring.position_out)
    position = guess[:, place] * scale.y_std[place] + scale.y_mean[place]
    asked = clip[:, slice(*wiring.velocity_in)].reshape(len(clip), -1, 3)
    # The clip tells it in the root before.
    turn = jnp.where(carry.valid, carry.root[:, 3] - row[:, wiring.root + 3], 0.0)[:, None]
    x, z = _turned(asked[..., 0], asked[..., 2], turn)
    asked = jnp.stack([x, asked[..., 1], z], axis=-1)
    done = ((position - carried) / wiring.dt).reshape(asked.shape)
    std = scale.y_std[slice(*wiring.velocity_out)].reshape(-1, 3)
    off = jnp.square((done - asked) / std)
    contacts = y[:, slice(*wiring.contacts_out)]
    feet = off[:, jnp.array(wiring.feet)].sum(-1)
    return options.implied * off.mean() + options.planted * (feet * contacts).mean()


def _raised(position: Array, by: Array) -> Array:
    """(N, 3J) moved up by (N,)."""
    points = position.reshape(len(position), -1, 3)
    return points.at[:, :, 1].add(by[:, None]).reshape(position.shape)


def _seen_from(position: Array, here: Array, there: Array) -> Array:
    """Positions (N, 3J) in one root, seen from another; roots are (N, 4): x, height, z, yaw.

    Yaw 0 faces +Z, positive towards +X. Heights are kept.
    """
    points = position.reshape(len(position), -1, 3)
    x, z = _turned(points[..., 0], points[..., 2], here[:, 3:])
    x = x + (here[:, 0] - there[:, 0])[:, None]
    z = z + (here[:, 2] - there[:, 2])[:, None]
    x, z = _turned(x, z, -there[:, 3:])
    return jnp.stack([x, points[..., 1], z], axis=-1).reshape(position.shape)


def _turned(x: Array, z: Array, yaw: Array) -> tuple[Array, Array]:
    """From a root's frame to the world's."""
    sin, cos = jnp.sin(yaw), jnp.cos(yaw)
    return x * cos + z * sin, z * cos - x * sin


def _noisy(
    key: Array, position: Array, velocity: Array, phase: Array, std: Array | float,
    options: Options,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Noise on a pose and its phase; how much differs from row to row, up to what is asked."""
    pose, much, turn = (jax.random.fold_in(key, 100 + i) for i in range(3))
    width = position.shape[1]
    rows = len(position)
    much = options.noise * jax.random.uniform(much, (rows, 1))
    noise = much * std * jax.random.normal(pose, (rows, 2 * width))
    phase = phase + options.phase_noise * jax.random.normal(turn, (rows,))
    return position + noise[:, :width], velocity + noise[:, width:], phase
