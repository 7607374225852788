"""Samples a second that a training step learns from, on one core, for the published sizes.

A sample is a row: 342 numbers in, 311 out, two hidden layers of 512, one phase. Both ways compute
the same network, loss, gradient and Adam step in JAX:

  ours    the four control points of a layer as one wide product, blended after it
  plain   the paper's formula as it stands: each sample's own weights are blended from the four
          control points, then applied

Steps of both alternate, so that a machine that slows down slows both; medians are printed, of the
processor time that a step took, so that other programs on the core do not count. The process holds
itself to one core, XLA to one thread. The plain way has a matrix a sample (2.4 MB each, and its
gradient): it gets smaller batches, which cost it nothing. Both must come to the same loss.

    python benches/training.py
    python benches/training.py --batches 512 --steps 30 --json
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

INPUTS, HIDDEN, OUTPUTS = 342, [512, 512], 311
# What is asked of ours, samples a second on a core.
ASKED = 8000


def hold_to_one_core() -> str:
    """One core for the process and one thread for XLA; before JAX starts."""
    os.environ["JAX_PLATFORMS"] = "cpu"
    flags = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
    os.environ["XLA_FLAGS"] = flags
    if not hasattr(os, "sched_setaffinity"):
        return "one XLA thread, not held to a core on this system"
    core = min(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {core})
    return f"core {core}"


def steps(dropout: float) -> dict[str, Callable[..., Any]]:
    """A training step of each way, compiled: (params, moments, x, y, phase, key) → the same."""
    import jax
    import jax.numpy as jnp
    import optax

    from ambulo.models import pfnn

    adam = optax.adam(1e-4)

    def plain(params: Any, x: Any, phase: Any, key: Any) -> Any:
        shares = pfnn.phase_shares(phase)
        for index, layer in enumerate(params):
            if index:
                x = pfnn.dropout(jax.random.fold_in(key, index), x, dropout)
            points = layer["weight"].reshape(len(layer["weight"]), 4, -1)
            weights = jnp.einsum("nk,iko->nio", shares, points)
            biases = shares @ layer["bias"].reshape(4, -1)
            x = jnp.einsum("ni,nio->no", x, weights) + biases
            if index < len(params) - 1:
                x = jax.nn.elu(x)
        return x

    def ours(params: Any, x: Any, phase: Any, key: Any) -> Any:
        return pfnn.forward(params, x, phase, key, 0.0, dropout)

    def step_of(forward: Callable[..., Any]) -> Callable[..., Any]:
        def step(params: Any, moments: Any, x: Any, y: Any, phase: Any, key: Any) -> Any:
            def loss(params: Any) -> Any:
                return jnp.square(forward(params, x, phase, key) - y).mean()

            value, gradient = jax.value_and_grad(loss)(params)
            change, moments = adam.update(gradient, moments)
            return optax.apply_updates(params, change), moments, value

        return jax.jit(step)

    return {"ours": step_of(ours), "plain": step_of(plain)}


def measure(
    batch: int, count: int, plain_batch: int, plain_count: int, dropout: float
) -> dict[str, Any]:
    """Seconds of each way's steps, in turn, and the losses: they must agree."""
    import jax
    import numpy as np
    import optax

    from ambulo.models import pfnn

    rng = np.random.default_rng(0)
    x = rng.standard_normal((batch, INPUTS)).astype(np.float32)
    y = rng.standard_normal((batch, OUTPUTS)).astype(np.float32)
    phase = rng.random(batch).astype(np.float32)
    ways = steps(dropout)
    first = slice(0, plain_batch)
    sizes = {"ours": slice(0, batch), "plain": first}
    states, times, losses = {}, {name: [] for name in ways}, {}
    for name, step in ways.items():
        params = pfnn.init(jax.random.key(0), [INPUTS, *HIDDEN, OUTPUTS])
        states[name] = (params, optax.adam(1e-4).init(params))
        key = jax.random.key(0)
        losses[name] = float(step(*states[name], x[first], y[first], phase[first], key)[2])
    for turn in range(count + 1):
        for name, step in ways.items():
            if name == "plain" and turn > plain_count:
                continue
            rows = sizes[name]
            start = time.process_time()
            *state, loss = step(*states[name], x[rows], y[rows], phase[rows], jax.random.key(turn))
            loss.block_until_ready()
            # The first of its size was compiled.
            if turn:
                times[name].append(time.process_time() - start)
            states[name] = state
    apart = abs(losses["ours"] - losses["plain"]) / losses["plain"]
    medians = {name: statistics.median(taken) for name, taken in times.items()}
    speeds = {name: sizes[name].stop / median for name, median in medians.items()}
    return {
        "batch": batch,
        "plain_batch": plain_batch,
        "steps": {name: len(taken) for name, taken in times.items()},
        "samples_per_s": speeds,
        "times_quicker": speeds["ours"] / speeds["plain"],
        "losses_differ_by": apart,
    }


def main() -> int:
    """Print a table, or JSON; exit 1 if ours is slower than asked."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--batches", type=int, nargs="+", default=[512, 1024])
    parser.add_argument("--steps", type=int, default=40, help="of ours, each batch size")
    parser.add_argument("--plain-batch", type=int, default=128, help="of the plain way")
    parser.add_argument("--plain-steps", type=int, default=8, help="of the plain way")
    parser.add_argument("--dropout", type=float, default=0.2, help="on hidden layers")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    where = hold_to_one_core()
    results = [
        measure(
            batch, arguments.steps, arguments.plain_batch, arguments.plain_steps, arguments.dropout
        )
        for batch in arguments.batches
    ]
    if any(one["losses_differ_by"] > 1e-4 for one in results):
        raise SystemExit("the two ways do not compute the same: nothing to compare")
    import jax

    machine = {"machine": platform.machine(), "held_to": where, "jax": jax.__version__}
    if arguments.json:
        print(json.dumps({**machine, "asked_samples_per_s": ASKED, "results": results}, indent=2))
    else:
        print(f"training step, {INPUTS} → {HIDDEN} → {OUTPUTS}, {where}, JAX {jax.__version__}")
        print(f"{'batch':>8} {'ours/s':>10} {'plain/s':>10} {'quicker':>8} {'losses':>9}")
        for one in results:
            speed = one["samples_per_s"]
            print(
                f"{one['batch']:>8} {speed['ours']:>10,.0f} {speed['plain']:>10,.0f} "
                f"{one['times_quicker']:>7.1f}× {one['losses_differ_by']:>9.1e}"
            )
    slow = [one["batch"] for one in results if one["samples_per_s"]["ours"] < ASKED]
    if slow:
        print(f"below {ASKED} samples/s a core at batch {slow}", file=sys.stderr)
    return 1 if slow else 0


if __name__ == "__main__":
    sys.exit(main())
