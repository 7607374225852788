"""Training a network on its own predictions: a batch of followers, each along a clip.

Learned one step at a time from captured poses (Holden et al. 2017, §6), a network meets only poses
that are right. Run free, its small errors feed on themselves. A follower therefore goes along a
clip as the runtime would let it go: its next input has its own predicted pose, velocity and phase,
for some followers also its own way over the ground and its own foreseen trajectory, bent towards
the clip's as the runtime bends it towards a wish. What is asked of it is the clip's row, and where
it has strayed, what leads it back: the idea of learning from the states that one's own policy
visits is DAgger's (Ross, Gordon, Bagnell, AISTATS 2011).

`unroll` runs T frames, through which the gradient flows; what they end with is carried into the
next batch, so that poses as old as one likes are learned from at the price of a single step.

Shapes: N followers, T consecutive frames, J joints. A root is seen from above: x, z and yaw, yaw 0
facing +Z, positive towards +X; distances in the vectors' unit. Pure like everything in this folder.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array, lax

from ambulo.models.paths import (
    AHEAD,
    NOW,
    PAST,
    PAST_FROM_SAMPLES,
    SAMPLES,
    STRIDE,
    TURN,
    difference,
    joined,
    placed,
    raised,
    seen_from,
    told_from,
    trajectory,
    turned,
)
from ambulo.models.pfnn import Numbers, Params, Scale, forward

# A pose with a number this many deviations from the mean is no body.
BROKEN = 12.0
# Metres from its clip at which a follower has lost it.
LOST = 0.7
# How quickly a foreseen trajectory bends to the asked one, as the runtime bends it when it is told
# a facing: share 1 − (1 − t)^bias at t of the window.
POSITION_BIAS, FACING_BIAS = 1.0, 2.0


class Wiring(NamedTuple):
    """Where the numbers lie that go round the loop; static. Spans are (first, end)."""

    phase: int
    root: int
    x: tuple[int, int]
    y: tuple[int, int]
    trajectory_in: tuple[tuple[int, int], ...]
    """x, z, direction x, direction z."""
    gaits_in: tuple[int, int]
    """All gaits, 12 samples each."""
    position_in: tuple[int, int]
    velocity_in: tuple[int, int]
    root_out: tuple[int, int]
    yaw_out: int
    rate_out: int
    contacts_out: tuple[int, int]
    trajectory_out: tuple[tuple[int, int], ...]
    position_out: tuple[int, int]
    velocity_out: tuple[int, int]
    feet: tuple[int, ...]
    """Joints that the contacts are of."""
    turn: float
    """1 where a positive yaw rate turns towards +X, −1 where it turns away."""
    unit: float
    """The vectors' units in a metre; roots in the rows are in metres."""
    dt: float
    """One frame in the unit that velocities and rates count in."""
    fps: float

    @property
    def a_second(self) -> float:
        """From per second to the unit that velocities count in."""
        return 1.0 / (self.fps * self.dt)


class Options(NamedTuple):
    """How a forward pass is disturbed and how a loop is closed; static but for the noise."""

    drop_input: float = 0.0
    drop_hidden: float = 0.0
    noise: Any = 0.0
    """Largest deviation of what is added to a pose that is started from, as a share of
    `pose_std`."""
    phase_noise: Any = 0.0
    """The same for its phase, cycles."""
    closed: bool = True
    """Feed the pose back; else every step has the clip's own input."""
    feedback: float = 0.5
    """Share of the predicted position in what is fed back; the rest is the carried one."""
    through_time: bool = True
    """Let the gradient flow from a step into those before it."""
    own_phase: bool = False
    own_root: float = 0.0
    """Share of followers that go their own way over the ground."""
    own_future: float = 0.0
    """Share of followers that are told their own foreseen trajectory, bent to the clip's."""
    told_simply: float = 0.0
    """Share of followers that are told the clip's future as a wish: straight on, facing one way."""
    phase_pull: float = 0.0
    """What leads back: the share of what one is off that goes in a second."""
    root_pull: float = 0.0
    root_noise: float = 0.0
    """How far beside its clip an own way begins, metres and 1.5 times as many radians."""
    past_warp: float = 0.0
    """How much faster or slower its past looks than it was: speed is to be read from the future."""
    implied: float = 0.0
    """Weight in the loss of the velocity that a pose implies: see `_implied`."""
    planted: float = 0.0
    """The same of feet in contact, along the ground."""


PLAIN = Options()


class Outcome(NamedTuple):
    """What `unroll` says of every step."""

    loss: Array
    """(T,) weighted mean square in normalised units."""
    position: Array
    """(T, N) mean distance of a joint from the clip's, each in its root."""


class Carry(NamedTuple):
    """What the next step takes from the follower itself."""

    position: Array
    """(N, 3J), joints as they were predicted, in the root of that moment."""
    velocity: Array
    """(N, 3J)"""
    phase: Array
    """(N,)"""
    height: Array
    """(N,) of that root."""
    path: Array
    """(N, P, 3) roots, the last one now, the one before it that of the pose."""
    future: Array
    """(N, 6, 3) the foreseen trajectory, from now on in the frame of now: x, z, yaw."""
    valid: Array
    """(N,) False: nothing to go on from, or it went astray; the clip's own is taken."""


class _Moment(NamedTuple):
    """One row, as a follower meets it."""

    clip: Array
    """(N, 3) the clip's root."""
    next_clip: Array
    now: Array
    """(N, 3) the follower's own root."""
    off: Array
    """(N, 3) from it to the clip's, yaw the short way round."""
    path: Array
    rooted: Array
    """(N, 1) whether it goes its own way."""
    carried: Array
    """(N, 3J) the pose before, seen from now."""
    phase: Array


def nothing(rows: int, joints: int, options: Options = PLAIN) -> Carry:
    """A carry to start with."""
    pose = jnp.zeros((rows, 3 * joints))
    length = PAST + 1 if options.own_root else 2
    return Carry(
        pose, pose, jnp.zeros(rows), jnp.zeros(rows), jnp.zeros((rows, length, 3)),
        jnp.zeros((rows, len(AHEAD), 3)), jnp.zeros(rows, bool),
    )  # fmt: skip


def unroll(
    params: Params,
    scale: Scale,
    wiring: Wiring,
    rows: Array,
    *,
    carry: Carry | None = None,
    fresh: Array | None = None,
    weights: Numbers | float = 1.0,
    pose_std: Numbers | float = 0.0,
    options: Options = PLAIN,
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
        carry = nothing(rows.shape[1], joints, options)
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
    weights: Numbers | float, pose_std: Numbers | float, options: Options, key: Array | None,
) -> tuple[Carry, tuple[Array, Array]]:  # fmt: skip
    """One frame of every follower: input, prediction, loss, and what goes on."""
    if not options.through_time:
        carry = lax.stop_gradient(carry)
    clip, y = row[:, slice(*wiring.x)], row[:, slice(*wiring.y)]
    x, moment = _meet(wiring, carry, row, clip, y, pose_std, options, key)
    guess = forward(
        params, (x - scale.x_mean) / scale.x_std, moment.phase, key,
        options.drop_input, options.drop_hidden,
    )  # fmt: skip
    out = guess * scale.y_std + scale.y_mean
    # What it walks on is not learned through: the loss says at every step which way is back.
    after = lax.stop_gradient(_walked(wiring, moment, out, options))
    asked = _led_back(wiring, moment, after, y, row[:, wiring.phase], options)
    loss = (jnp.square(guess - (asked - scale.y_mean) / scale.y_std) * weights).mean()
    if options.implied or options.planted:
        loss = loss + _implied(wiring, scale, moment, out, clip, y, options)
    going = _carry_on(wiring, scale, moment, carry, after, row, guess, out, options)
    off = lax.stop_gradient(out - y)[:, slice(*wiring.position_out)].reshape(len(y), -1, 3)
    return going, (loss, jnp.sqrt(jnp.square(off).sum(-1)).mean(-1))


# -- before the prediction --------------------------------------------------------------------


def _meet(
    wiring: Wiring, carry: Carry, row: Array, clip: Array, y: Array, pose_std: Numbers | float,
    options: Options, key: Array | None,
) -> tuple[Array, _Moment]:  # fmt: skip
    """The input of a row, with what is the follower's own in it."""
    place = wiring.unit * row[:, wiring.root : wiring.root + 3]
    height = place[:, 1]
    there = jnp.stack([place[:, 0], place[:, 2], row[:, wiring.root + 3]], axis=1)
    rooted = _some(len(row), options.own_root)
    now, path, carry = _own_root(wiring, carry, there, clip, rooted, options, key)
    position, velocity = clip[:, slice(*wiring.position_in)], clip[:, slice(*wiring.velocity_in)]
    phase = row[:, wiring.phase]
    # The root in which a fresh pose is told is not at hand; but where the clip is now, less how it
    # got there, is where it was. (The velocity is in the root before: one frame's turn of it.)
    carried = y[:, slice(*wiring.position_out)] - velocity * wiring.dt
    noises = (options.noise, options.phase_noise)
    if key is not None and any(not isinstance(n, float) or n for n in noises):
        told = position
        position, velocity, phase = _noisy(key, position, velocity, phase, pose_std, options)
        carried = carried + position - told
    if options.closed:
        going = carry.valid[:, None]
        lifted = raised(carry.position, carry.height - height)
        carried = jnp.where(going, seen_from(lifted, path[:, -2], now), carried)
        position = jnp.where(going, lifted, position)
        velocity = jnp.where(going, carry.velocity, velocity)
        if options.own_phase:
            phase = jnp.where(carry.valid, carry.phase, phase)
    x = clip.at[:, slice(*wiring.position_in)].set(position)
    x = x.at[:, slice(*wiring.velocity_in)].set(velocity)
    off = difference(there, now)
    next_clip = _moved(there, y, wiring)
    moment = _Moment(there, next_clip, now, off, path, rooted, carried, phase)
    if options.own_root:
        x = _told(wiring, moment, carry, x, clip, options)
    return x, moment


def _own_root(
    wiring: Wiring, carry: Carry, there: Array, clip: Array, rooted: Array, options: Options,
    key: Array | None,
) -> tuple[Array, Array, Carry]:  # fmt: skip
    """Where the follower is, the way it came, and its carry.

    Where it foresaw nothing, the carry gets the clip's future.
    """
    if not options.own_root:
        before = jnp.where(carry.valid[:, None], carry.path[:, -2], there)
        return there, jnp.stack([before, there], axis=1), carry
    samples = trajectory(clip, wiring.trajectory_in)
    # Whoever turned more than half round in that second would seem to jump.
    yaw = jnp.unwrap(samples[..., 2], axis=1)
    samples = samples.at[..., 2].set(yaw - yaw[:, NOW : NOW + 1])
    path = placed(there, jnp.einsum("ps,nsc->npc", PAST_FROM_SAMPLES, samples[:, : NOW + 1]))
    if key is not None and (options.root_noise or options.past_warp):
        path = _beside(wiring, path, rooted, options, jax.random.fold_in(key, 200))
    going = (carry.valid[:, None] & rooted)[..., None]
    path = jnp.where(going, carry.path, path)
    # The others have been where their clip was.
    before = jnp.where(carry.valid[:, None], carry.path[:, -2], path[:, -2])
    path = path.at[:, -2].set(before)
    future = jnp.where(going, carry.future, samples[:, NOW:])
    now = jnp.where(rooted, path[:, -1], there)
    return now, path.at[:, -1].set(now), carry._replace(future=future)


def _beside(wiring: Wiring, path: Array, rooted: Array, options: Options, key: Array) -> Array:
    """A way that is moved and turned as a whole, and stretched about where it ends."""
    aside, warp = (jax.random.fold_in(key, i) for i in range(2))
    size = options.root_noise * np.array([wiring.unit, wiring.unit, 1.5])
    off = size * jax.random.normal(aside, (len(path), 3)) * rooted
    stretch = (
        1.0 + options.past_warp * jax.random.normal(warp, (len(path), 1, 1)) * rooted[..., None]
    )
    end = path[:, -1:]
    # Not the last way: the pose's own velocity belongs to it.
    past = jnp.concatenate([stretch * (path - end)[..., :2], (path - end)[..., 2:]], axis=-1)
    past = past.at[:, -2].set((path - end)[:, -2])
    moved = turned(off[:, None, 2], past[..., :2]) + end[..., :2] + off[:, None, :2]
    return jnp.concatenate([moved, path[..., 2:] + off[:, None, 2:]], axis=-1)


def _told(
    wiring: Wiring, moment: _Moment, carry: Carry, x: Array, clip: Array, options: Options
) -> Array:
    """The trajectory that a follower on its own way is told: its past, and where the clip goes."""
    rows = len(x)
    foreseen, simply = (
        _some(rows, share)[..., None] for share in (options.own_future, options.told_simply)
    )
    goal = joined(moment.off, moment.now, trajectory(clip, wiring.trajectory_in)[:, NOW:])
    straight = jnp.concatenate(
        [goal[:, -1:, :2] * (1.2 * AHEAD)[:, None], jnp.repeat(goal[:, 3:4, 2:], len(AHEAD), 1)],
        axis=-1,
    )
    goal = jnp.where(simply, straight, goal)
    bias = np.array([POSITION_BIAS, POSITION_BIAS, FACING_BIAS])
    bend = 1.0 - (1.0 - AHEAD[:, None]) ** bias
    apart = goal - carry.future
    apart = apart.at[..., 2].add(-TURN * jnp.round(apart[..., 2] / TURN))
    future = jnp.where(foreseen, carry.future + apart * bend, goal)
    past = told_from(moment.now, moment.path[:, :-1:STRIDE])
    own = jnp.concatenate([past, future], axis=1)
    parts = (own[..., 0], own[..., 1], jnp.sin(own[..., 2]), jnp.cos(own[..., 2]))
    for span, part in zip(wiring.trajectory_in, parts, strict=True):
        x = x.at[:, slice(*span)].set(jnp.where(moment.rooted, part, x[:, slice(*span)]))
    # The runtime knows no coming gait: what is asked for now is told of the whole future.
    gaits = x[:, slice(*wiring.gaits_in)].reshape(rows, -1, SAMPLES)
    asked = foreseen & (np.arange(SAMPLES) >= NOW)
    gaits = jnp.where(asked, gaits[:, :, NOW + 1 : NOW + 2], gaits)
    return x.at[:, slice(*wiring.gaits_in)].set(gaits.reshape(rows, -1))


def _noisy(
    key: Array, position: Array, velocity: Array, phase: Array, std: Numbers | float,
    options: Options,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Noise on a pose and its phase; how much differs from row to row, up to what is asked."""
    pose, much, turn = (jax.random.fold_in(key, 100 + i) for i in range(3))
    rows, width = position.shape
    much = options.noise * jax.random.uniform(much, (rows, 1))
    noise = much * std * jax.random.normal(pose, (rows, 2 * width))
    phase = phase + options.phase_noise * jax.random.normal(turn, (rows,))
    return position + noise[:, :width], velocity + noise[:, width:], phase


# -- after it ---------------------------------------------------------------------------------


def _walked(wiring: Wiring, moment: _Moment, out: Array, options: Options) -> Array:
    """(N, 3) the next root: predicted, or the clip's."""
    if not options.own_root:
        return moment.next_clip
    return jnp.where(moment.rooted, _moved(moment.now, out, wiring), moment.next_clip)


def _led_back(
    wiring: Wiring, moment: _Moment, after: Array, y: Array, phase: Array, options: Options
) -> Array:
    """What is asked for: the clip's output, and what leads a follower back that has strayed.

    Without it, what has once gone wrong would be learned as if it were right.
    """
    if options.own_phase:
        off = lax.stop_gradient(phase - moment.phase)
        off = options.phase_pull * (off - jnp.round(off)) * wiring.a_second
        y = y.at[:, wiring.rate_out].add(off)
    if not options.own_root:
        return y
    pull = options.root_pull * wiring.a_second
    back = pull * turned(-moment.now[:, 2], moment.off[:, :2])
    way = turned(moment.off[:, 2], y[:, slice(*wiring.root_out)]) + back
    asked = y.at[:, slice(*wiring.root_out)].set(way)
    asked = asked.at[:, wiring.yaw_out].add(wiring.turn * pull * moment.off[:, 2])
    coming = trajectory(y, wiring.trajectory_out)
    own = joined(difference(moment.next_clip, after), after, coming)
    parts = (own[..., 0], own[..., 1], jnp.sin(own[..., 2]), jnp.cos(own[..., 2]))
    for span, part in zip(wiring.trajectory_out, parts, strict=True):
        asked = asked.at[:, slice(*span)].set(part)
    return jnp.where(moment.rooted, asked, y)


def _implied(
    wiring: Wiring, scale: Scale, moment: _Moment, out: Array, clip: Array, y: Array,
    options: Options,
) -> Array:  # fmt: skip
    """How far the way from the pose before to the predicted one is from the capture's velocity.

    A pose that has strayed could otherwise snap back to the clip in one frame: right by the square
    error of the pose, and seen as a jerk and a sliding foot.
    """
    asked = clip[:, slice(*wiring.velocity_in)].reshape(len(clip), -1, 3)
    # It is told in the root before.
    turn = (moment.path[:, -2, 2] - moment.now[:, 2])[:, None]
    flat = turned(turn, asked[..., ::2])
    asked = jnp.stack([flat[..., 0], asked[..., 1], flat[..., 1]], axis=-1)
    done = (out[:, slice(*wiring.position_out)] - moment.carried) / wiring.dt
    std = scale.y_std[slice(*wiring.velocity_out)].reshape(-1, 3)
    off = jnp.square((done.reshape(asked.shape) - asked) / std)
    feet = off[:, np.array(wiring.feet), ::2].sum(-1) * y[:, slice(*wiring.contacts_out)]
    return options.implied * off.mean() + options.planted * feet.mean()


def _carry_on(
    wiring: Wiring, scale: Scale, moment: _Moment, carry: Carry, after: Array, row: Array,
    guess: Array, out: Array, options: Options,
) -> Carry:  # fmt: skip
    """What goes round, as the runtime has it.

    The position goes `feedback` of the way from the carried one, moved by the predicted velocity,
    to the predicted one; no phase runs backwards.
    """
    velocity = out[:, slice(*wiring.velocity_out)]
    moved = moment.carried + velocity * wiring.dt
    position = moved + options.feedback * (out[:, slice(*wiring.position_out)] - moved)
    phase = moment.phase + jnp.maximum(out[:, wiring.rate_out], 0.0) * wiring.dt
    pose = [guess[:, slice(*span)] for span in (wiring.position_out, wiring.velocity_out)]
    sane = jnp.abs(jnp.concatenate(pose, axis=1)).max(axis=1) < BROKEN
    off = difference(moment.next_clip, after)[:, :2]
    found = jnp.square(off).sum(axis=1) < (LOST * wiring.unit) ** 2
    path = jnp.concatenate([moment.path[:, 1:], after[:, None]], axis=1)
    future = carry.future
    if options.own_root:
        future = lax.stop_gradient(trajectory(out, wiring.trajectory_out))
    height = wiring.unit * row[:, wiring.root + 1]
    return Carry(position, velocity, phase, height, path, future, sane & found)


def _moved(root: Array, vector: Array, wiring: Wiring) -> Array:
    """(N, 3) a root, moved as an output says."""
    way = turned(root[:, 2], vector[:, slice(*wiring.root_out)]) * wiring.dt
    turn = wiring.turn * vector[:, wiring.yaw_out] * wiring.dt
    return root + jnp.concatenate([way, turn[:, None]], axis=1)


def _some(rows: int, share: float) -> Array:
    """(N, 1) which followers belong to a share.

    Those of a smaller share are among those of a larger one, and spread over the batch.
    """
    order = np.random.default_rng(0).permutation(rows)
    return jnp.asarray(order[:, None] < share * rows)
