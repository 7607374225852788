"""Where genomes are tried: on this machine's threads, or on a Ray cluster.

An executor takes genomes (N, G) and the round that they are tried in, as `Search.round` tells it,
and gives their scores (N, 5) as `Arena.try_round` does. All give the same numbers to the last bit:
a score depends on the genome and the round alone.
"""

from __future__ import annotations

import importlib.util
import logging
import os
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ambulo._core import Arena, Creature

Executor = Callable[[NDArray[np.float32], str], NDArray[np.float64]]


def default_threads() -> int:
    """The processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def on_threads(arena: Arena, threads: int | None = None) -> Executor:
    """Tries genomes on so many threads; all processors by default."""
    count = threads or default_threads()
    return lambda genomes, how: arena.try_round(genomes, how, count)


def _share(
    creature: str, settings: str, genomes: NDArray[np.float32], how: str
) -> NDArray[np.float64]:
    """One worker's part; creature and settings as text, so that any process can do it."""
    return Arena(Creature.parse(creature), settings).try_round(genomes, how, 1)


def check_ray(address: str | None = None) -> None:
    """Whether there is Ray, and somebody at `address` if it is HOST:PORT; `on_ray` asks, too.

    Ray itself tries an address for minutes and then ends the process without a word.

    Raises:
        RuntimeError: Ray is not installed.
        ConnectionError: nobody answers at `address`.
    """
    if importlib.util.find_spec("ray") is None:
        raise RuntimeError("spreading over a cluster needs Ray: pip install 'ambulo[ray]'")
    host, colon, port = (address or "").removeprefix("ray://").rpartition(":")
    if colon and port.isdigit():
        try:
            socket.create_connection((host.strip("[]"), int(port)), timeout=5.0).close()
        except (OSError, OverflowError) as error:
            raise ConnectionError(f"no Ray cluster answers at {address}: {error}") from error


@contextmanager
def on_ray(creature: Creature, arena: Arena, address: str | None = None) -> Iterator[Executor]:
    """Tries genomes on a Ray cluster, a share for each of its processors.

    `address` as Ray takes it (`auto`, `HOST:PORT`); a local cluster of this machine's processors
    is started without one, and ended with the block. A share whose worker dies is tried again by
    another.

    Raises:
        RuntimeError: Ray is not installed.
        ConnectionError: no cluster is at `address`.
    """
    check_ray(address)
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    import ray

    mine = not ray.is_initialized()
    if mine:
        local: dict[str, Any] = {} if address else {"num_cpus": default_threads()}
        ray.init(
            address=address, include_dashboard=False, log_to_driver=False,
            logging_level=logging.ERROR, **local,
        )  # fmt: skip
    try:
        task = ray.remote(max_retries=3)(_share)
        text = (creature.json(), arena.settings())

        def evaluate(genomes: NDArray[np.float32], how: str) -> NDArray[np.float64]:
            workers = max(int(ray.cluster_resources().get("CPU", 1)), 1)
            shares = np.array_split(genomes, min(workers, len(genomes)))
            return np.concatenate(ray.get([task.remote(*text, share, how) for share in shares]))

        yield evaluate
    finally:
        if mine:
            ray.shutdown()
