"""Batches of a data set that may be larger than memory, in an order that a seed decides."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ambulo.data import Dataset, DatasetError, Rows


@dataclass(frozen=True)
class _Piece:
    """Consecutive rows of a shard, within one run."""

    shard: int
    first: int
    rows: int


@dataclass
class _Place:
    """Where the sampler is; everything else follows from it and the seed."""

    epoch: int = 0
    """Passes over the whole set that are finished."""
    chunk: int = 0
    """Of this pass."""
    turn: int = 0
    """Shufflings of what the pool holds."""
    taken: int = 0
    """Starts that were taken of this shuffling."""
    served: int = 0
    """Windows that this chunk gave."""
    batches: int = 0


class Sampler:
    """Followers of the training clips, from a pool of bounded size.

    A batch has a window of consecutive rows a follower. With an age limit of one window every
    batch has new windows: all there are once a pass, in random order. With a higher limit a
    follower goes on where its last window ended, until it is too old or its run ends, and then
    starts anew elsewhere; `batch` says which ones did.

    Whole set in the pool: one shuffling covers everything. A larger set: its runs are cut into
    pieces, at other places each pass; shuffled pieces fill the pool, as many windows are taken as
    it has, and the next pieces follow until all were there. (The authors trained on a tenth of
    their set at a time in the same way.)

    With balancing, a start comes more or less than once a pass: categories that have fewer rows
    come oftener, by (rows) ** −balance.
    """

    def __init__(
        self,
        dataset: Dataset,
        seed: int,
        *,
        pool_bytes: int = 512 << 20,
        piece: int = 512,
        balance: float = 0.0,
        mix: float = 0.0,
        stagger: float = 0.0,
    ) -> None:
        self.dataset, self.seed, self.mix, self.stagger = dataset, seed, mix, stagger
        self.shards = dataset.of("training")
        total = sum(rows for shard in self.shards for _, rows in shard.runs)
        capacity = pool_bytes // dataset.row_bytes
        self.whole = total <= capacity
        self.piece = piece if self.whole else min(piece, capacity // 8)
        if self.piece < 1:
            raise DatasetError(f"a pool of {pool_bytes} bytes holds no 8 rows; enlarge it")
        self.chunks = 1 if self.whole else math.ceil(total / (capacity - self.piece))
        rows = total if self.whole else capacity
        self._pool = np.empty((rows, dataset.row_bytes // 4), np.float32)
        self._left = np.zeros(rows, np.int32)
        """Of each row of the pool: rows of its piece from there on."""
        self._shares = _category_shares(dataset, balance)
        self._place = _Place()
        self._frames = 0
        self._at = self._age = self._room = np.zeros(0, np.int64)
        self._order: NDArray[np.int64] | None = None
        self._loaded: tuple[int, int] | None = None

    @property
    def epoch(self) -> int:
        """Passes over the whole set that are finished."""
        return self._place.epoch

    @property
    def state(self) -> dict[str, Any]:
        """Where it is, as JSON can hold it; `resume` takes it."""
        followers = {"at": self._at, "age": self._age, "room": self._room}
        return {
            "place": dict(vars(self._place)),
            "frames": self._frames,
            **{name: values.tolist() for name, values in followers.items()},
        }

    def resume(self, state: dict[str, Any]) -> None:
        """Go on from a state."""
        self._place, self._frames = _Place(**state["place"]), state["frames"]
        self._at, self._age, self._room = (
            np.array(state[name], np.int64) for name in ("at", "age", "room")
        )
        self._order = None

    def batch(self, size: int, frames: int = 1, age: int = 1) -> tuple[Rows, NDArray[np.bool_]]:
        """The next windows.

        Args:
            size: how many followers.
            frames: consecutive rows of each window.
            age: rows that a follower goes on for before it starts anew; at least one window.

        Returns:
            (size, frames, columns), and (size,) whether a follower starts anew.
        """
        if (size, frames) != (len(self._at), self._frames):
            self._frames, self._order = frames, None
            self._at, self._age = np.zeros(size, np.int64), np.zeros(size, np.int64)
            self._room = np.zeros(size, np.int64)
        self._load()
        if self._place.served >= np.count_nonzero(self._left >= frames):
            self._next_chunk()
            self._load()
        share = ((np.arange(size) + 0.5) / size) ** self.mix
        limit = np.maximum((1 + (age - 1) * share).astype(np.int64), frames)
        fresh = (self._age + frames > limit) | (self._room < frames)
        count = int(fresh.sum())
        self._at[fresh] = self._starts(count)
        # Staggered lives: or all would grow old together.
        rng = np.random.default_rng([self.seed, 2, self._place.batches])
        most = np.minimum(self.stagger * limit, limit - frames)[fresh]
        self._age[fresh] = (rng.random(count) * most).astype(np.int64)
        batch = np.take(self._pool, self._at[:, None] + np.arange(frames), axis=0)
        self._room = self._left[self._at] - frames
        self._at = self._at + frames
        self._age = self._age + frames
        self._place.served += size
        self._place.batches += 1
        return batch, fresh

    def _next_chunk(self) -> None:
        place = self._place
        place.served = 0
        place.chunk += 1
        if place.chunk == self.chunks:
            place.epoch, place.chunk = place.epoch + 1, 0
        if not self.whole:
            # Other rows are coming: nobody goes on.
            place.turn = place.taken = 0
            self._room[:] = 0
            self._order = None

    def _starts(self, count: int) -> NDArray[np.int64]:
        """The next starts of this shuffling, and of those after it if it ends."""
        found = []
        while count:
            order = self._shuffled()
            if not len(order):
                raise DatasetError(
                    f"{self.dataset.folder}: no run of {self._frames} consecutive rows; use fewer "
                    "frames, or enlarge the pool or the piece"
                )
            picked = order[self._place.taken : self._place.taken + count]
            found.append(picked)
            count -= len(picked)
            self._place.taken += len(picked)
            if self._place.taken >= len(order):
                self._place.taken, self._order = 0, None
                self._place.turn += 1
        return np.concatenate(found) if found else np.zeros(0, np.int64)

    def _shuffled(self) -> NDArray[np.int64]:
        """First rows, in the pool, of all windows, in this shuffling's order."""
        if self._order is not None:
            return self._order
        starts = np.flatnonzero(self._left >= self._frames)
        assert self._loaded is not None
        rng = np.random.default_rng([self.seed, 1, *self._loaded, self._place.turn, self._frames])
        column = self.dataset.columns["category"].start
        middle = self._pool[starts + self._frames // 2, column].astype(np.int64)
        # A share of 1.3 is one window, and with a probability of 0.3 a second.
        times = np.floor(self._shares[middle] + rng.random(len(starts))).astype(np.int64)
        self._order = rng.permutation(np.repeat(starts, times))
        return self._order

    def _load(self) -> None:
        """Fill the pool with the pieces of this chunk."""
        wanted = (0, 0) if self.whole else (self._place.epoch, self._place.chunk)
        if self._loaded == wanted:
            return
        at = 0
        self._left[:] = 0
        for piece in self._pieces():
            # Opened each time: the pages that were read are given back when the map goes.
            source = self.shards[piece.shard].open()
            end = at + piece.rows
            self._pool[at:end] = source[piece.first : piece.first + piece.rows]
            self._left[at:end] = np.arange(piece.rows, 0, -1)
            if not np.isfinite(self._pool[at:end]).all():
                raise DatasetError(
                    f"{self.shards[piece.shard].path}: rows {piece.first} to "
                    f"{piece.first + piece.rows} have a number that is not finite; build the data "
                    "set again"
                )
            at = end
        self._loaded = wanted

    def _pieces(self) -> list[_Piece]:
        if self.whole:
            return [
                _Piece(index, first, rows)
                for index, shard in enumerate(self.shards)
                for first, rows in shard.runs
            ]
        rng = np.random.default_rng([self.seed, 0, self._place.epoch])
        pieces = list(self._cut(rng))
        shuffled = [pieces[i] for i in rng.permutation(len(pieces))]
        # As many rows to each chunk, but for a piece.
        before = np.cumsum([0] + [piece.rows for piece in shuffled])
        chunk = before[:-1] * self.chunks // before[-1]
        own = self._place.chunk
        return [piece for piece, its in zip(shuffled, chunk, strict=True) if its == own]

    def _cut(self, rng: np.random.Generator) -> Iterator[_Piece]:
        """Every run in pieces; where the first cut lies is random."""
        for index, shard in enumerate(self.shards):
            for first, rows in shard.runs:
                cut = int(rng.integers(1, self.piece + 1))
                edges = [0, *range(cut, rows, self.piece), rows]
                for a, b in itertools.pairwise(edges):
                    yield _Piece(index, first + a, b - a)


def _category_shares(dataset: Dataset, balance: float) -> NDArray[np.float64]:
    """How often a pass takes a window of each category: (categories,), 1 on average."""
    counts = np.zeros(len(dataset.categories))
    for shard in dataset.of("training"):
        counts += shard.categories
    shares = np.where(counts > 0, np.maximum(counts, 1.0) ** -balance, 0.0)
    return shares * counts.sum() / (shares @ counts)
