"""Data sets: opened or refused, normalised, drawn from in bounded memory."""

from __future__ import annotations

import itertools
import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ambulo.data import Dataset, DatasetError, open_dataset, windows
from ambulo.normalisation import HIDDEN, normalisation
from ambulo.sampler import Sampler
from conftest import JOINTS
from synthetic_dataset import CATEGORIES, spoiled, write_dataset


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_dataset(tmp_path_factory.mktemp("data") / "toy", slope=0.1)


@pytest.fixture(scope="session")
def dataset(folder: Path) -> Dataset:
    return open_dataset(folder)


def test_a_dataset_opens_with_its_blocks_by_name(dataset: Dataset) -> None:
    joints = 3 * len(JOINTS)
    assert dataset.widths == (156 + 2 * joints, 32 + 4 * joints)
    assert dataset.blocks["inputs"]["joint_position"] == slice(120, 120 + joints)
    assert dataset.columns["output"].stop * 4 == dataset.row_bytes
    assert dataset.rows("training") == 1200 and dataset.rows("validation") == 400
    assert dataset.frame == pytest.approx(1 / 60)
    assert dataset.joints[0] == "Hips"


def cut_short(manifest: Any, copy: Path) -> None:
    path = copy / "shards" / "clip1.npy"
    content = path.read_bytes()
    path.unlink()
    path.write_bytes(content[:5000])


def gone(manifest: Any, copy: Path) -> None:
    (copy / "shards" / "clip1.npy").unlink()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda m, _: m.update(format=9), "update Ambulo"),
        (lambda m, _: m.update(licence="  "), "licence is empty"),
        (lambda m, _: m.pop("fps"), "'fps' is missing"),
        (lambda m, _: m["columns"].pop(), "columns"),
        (lambda m, _: m["statistics"]["input_std"].pop(), "statistics.input_std"),
        (lambda m, _: m["clips"][0].update(runs=[[0, 999]]), "run of 999 rows"),
        (lambda m, _: m["clips"][0].update(rows=7), "expected float32"),
        (lambda m, _: m["clips"][0].update(split="test"), "split 'test'"),
        (
            lambda m, _: [c.update(split="validation") for c in m["clips"]],
            "no clip is for training",
        ),
        (cut_short, "clip1.npy: cannot be read"),
        (gone, "clip1.npy: cannot be read"),
    ],
)
def test_a_broken_dataset_is_refused(folder: Path, tmp_path: Path, change: Any, says: str) -> None:
    with pytest.raises(DatasetError, match=re.escape(says)):
        open_dataset(spoiled(folder, tmp_path, change))


def test_a_folder_without_a_manifest_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="ambulo dataset build"):
        open_dataset(tmp_path)


def test_the_identity_follows_the_content(folder: Path, tmp_path: Path, dataset: Dataset) -> None:
    assert (
        open_dataset(spoiled(folder, tmp_path / "a", lambda m, _: None)).identity
        == dataset.identity
    )
    other = open_dataset(spoiled(folder, tmp_path / "b", lambda m, _: m.update(licence="mine")))
    assert other.identity != dataset.identity


def test_windows_are_spread_over_a_split_and_stay_within_runs(dataset: Dataset) -> None:
    found = windows(dataset, "training", 50, 40)
    assert found.shape == (40, 50, dataset.row_bytes // 4)
    place = found[..., 2:5:2]
    assert np.linalg.norm(np.diff(place, axis=1), axis=-1).max() < 0.06, "a window leaps"
    shard = dataset.of("training")[0].open()
    assert np.array_equal(found[0], shard[:50])
    assert np.array_equal(found[-1], dataset.of("training")[-1].open()[-50:])
    # More than there are: each once. Longer than any run: none.
    assert len(windows(dataset, "validation", 199, 1000)) == 4
    assert len(windows(dataset, "validation", 201, 5)) == 0


# -- normalisation ----------------------------------------------------------------------------


def test_deviations_are_averaged_over_the_published_blocks(tmp_path: Path) -> None:
    dataset = open_dataset(write_dataset(tmp_path / "d", layout="holden"))
    rng = np.random.default_rng(0)
    std = [rng.uniform(0.5, 2.0, width).astype(np.float32) for width in dataset.widths]
    stats = replace(dataset.statistics, input_std=std[0], output_std=std[1])
    n = normalisation(replace(dataset, statistics=stats))
    nx, ny, j = *dataset.widths, 3 * len(JOINTS)
    blocks_in = [0, 12, 24, 36, 48, 120, 120 + j, 120 + 2 * j, nx]
    blocks_out = [0, 2, 3, 4, 8, 20, 32, 32 + j, 32 + 2 * j, ny]
    for got, own, edges in ((n.input_std, std[0], blocks_in), (n.output_std, std[1], blocks_out)):
        for a, b in itertools.pairwise(edges):
            assert np.allclose(got[a:b], own[a:b].mean(), rtol=1e-6)


def test_joints_are_weighted_masked_and_constants_hidden(dataset: Dataset) -> None:
    n = normalisation(dataset, joint_weight=0.1, masked_joints=("Spine", "Nobody"))
    plain_ = normalisation(dataset)
    block = dataset.blocks["inputs"]["joint_velocity"]
    spine = dataset.joints.index("Spine")
    ours = n.input_std[block].reshape(-1, 3)
    assert (ours[spine] == HIDDEN).all()
    assert np.allclose(ours[1], 10.0 * plain_.input_std[block].reshape(-1, 3)[1], rtol=1e-6)
    # The gait that never was: it cannot blow up what it never taught.
    jump = dataset.blocks["inputs"]["gait_jump"]
    assert (n.input_std[jump] == HIDDEN).all()
    shown = normalisation(dataset, hide_constant=False).input_std[jump]
    assert (shown > 0.05).all() and (shown < 1.0).all()
    assert (n.output_std >= 1e-4).all() and (n.pose_std < 10).all()


# -- batches ----------------------------------------------------------------------------------


def numbered(tmp_path: Path, **how: Any) -> Dataset:
    """A data set whose phase column numbers the training rows; runs are 1000 apart."""
    folder = write_dataset(tmp_path / "numbered", **how)
    dataset = open_dataset(folder)
    number = 0
    for shard in dataset.of("training"):
        values = np.load(shard.path)
        for first, rows in shard.runs:
            values[first : first + rows, 0] = number + np.arange(rows)
            number += 1000
        np.save(shard.path, values)
    return open_dataset(folder)


def test_a_pass_takes_every_window_once(tmp_path: Path) -> None:
    dataset = numbered(tmp_path, clips=3, rows=100)
    sampler = Sampler(dataset, 0)
    assert sampler.whole
    taken = [sampler.batch(46, 5)[0] for _ in range(4)]
    numbers = np.concatenate(taken)[..., 0].astype(int)
    assert (np.diff(numbers, axis=1) == 1).all(), "not consecutive, or over the end of a run"
    first = numbers[:, 0]
    assert len(set(first)) == len(first) == 4 * 46
    assert sampler.epoch == 0
    sampler.batch(46, 5)
    assert sampler.epoch == 1
    again = Sampler(dataset, 1).batch(46, 5)[0][:, 0, 0]
    assert not np.array_equal(again, taken[0][:, 0, 0])


def test_a_larger_set_passes_through_the_pool(tmp_path: Path) -> None:
    dataset = numbered(tmp_path, clips=5, rows=600)
    pool = 400 * dataset.row_bytes
    sampler = Sampler(dataset, 0, pool_bytes=pool, piece=64)
    assert not sampler.whole and sampler.chunks >= 6
    seen: list[np.ndarray] = []
    while sampler.epoch == 0:
        rows, fresh = sampler.batch(16)
        assert fresh.all() and rows.shape[:2] == (16, 1)
        seen.append(rows[:, 0, 0])
    numbers, times = np.unique(np.concatenate(seen), return_counts=True)
    # The last batch of a chunk may begin a second shuffling of it.
    assert len(numbers) == 2400 and times.max() <= 2 and (times == 2).mean() < 0.1
    assert sampler._pool.nbytes <= pool
    # The second pass cuts and shuffles otherwise.
    first = np.concatenate([sampler.batch(16)[0][:, 0, 0] for _ in range(20)])
    assert len(np.intersect1d(first, np.concatenate(seen[:20]))) < 200


@pytest.mark.parametrize("pool", [1 << 30, 300_000])
def test_followers_go_on_until_they_are_old(tmp_path: Path, pool: int) -> None:
    dataset = numbered(tmp_path, clips=3, rows=300)
    sampler = Sampler(dataset, 0, pool_bytes=pool, piece=64)
    before = None
    lives = np.zeros(20, int)
    longest = 0
    for _ in range(60):
        rows, fresh = sampler.batch(20, 2, age=12)
        numbers = rows[..., 0].astype(int)
        if before is not None:
            going = ~fresh
            assert (numbers[going, 0] == before[going] + 1).all()
        lives = np.where(fresh, 2, lives + 2)
        longest = max(longest, lives.max())
        before = numbers[:, -1]
    assert longest == 12


def test_most_followers_are_young_if_asked(tmp_path: Path) -> None:
    dataset = numbered(tmp_path, clips=3, rows=400)
    mixed, alike = (Sampler(dataset, 0, mix=mix) for mix in (2.0, 0.0))
    share = []
    for sampler in (mixed, alike):
        fresh = [sampler.batch(64, 1, age=20)[1].mean() for _ in range(60)]
        share.append(np.mean(fresh[20:]))
    assert share[0] > 3 * share[1] and 0.03 < share[1] < 0.08


def test_a_sampler_goes_on_where_it_was(tmp_path: Path) -> None:
    dataset = numbered(tmp_path, clips=4, rows=300)
    for pool in (1 << 30, 200 * dataset.row_bytes):
        how: dict[str, Any] = {"pool_bytes": pool, "piece": 50, "mix": 1.0, "stagger": 0.5}
        sampler = Sampler(dataset, 3, **how)
        for _ in range(23):
            sampler.batch(16, 2, age=9)
        state = json.loads(json.dumps(sampler.state))
        expected = [sampler.batch(16, 2, age=9) for _ in range(40)]
        other = Sampler(dataset, 3, **how)
        other.resume(state)
        for rows, fresh in expected:
            again = other.batch(16, 2, age=9)
            assert np.array_equal(again[0], rows) and np.array_equal(again[1], fresh)


@pytest.mark.parametrize("balance", [0.0, 0.5, 1.0])
def test_rare_categories_come_oftener(dataset: Dataset, balance: float) -> None:
    counts = np.sum([shard.categories for shard in dataset.of("training")], axis=0)
    sampler = Sampler(dataset, 0, balance=balance)
    taken = np.concatenate([sampler.batch(50)[0][:, 0, 1] for _ in range(100)]).astype(int)
    got = np.bincount(taken, minlength=len(CATEGORIES)) / len(taken)
    asked = np.where(counts > 0, np.maximum(counts, 1) ** (1.0 - balance), 0.0)
    assert np.allclose(got, asked / asked.sum(), atol=0.03)


def test_too_long_windows_and_bad_rows_are_refused(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="no run of 201 consecutive rows"):
        Sampler(open_dataset(folder), 0).batch(4, 201)
    dataset = open_dataset(write_dataset(tmp_path / "d", clips=2))
    path = dataset.of("training")[0].path
    values = np.load(path)
    values[17, 40] = np.nan
    np.save(path, values)
    with pytest.raises(DatasetError, match=r"clip0.npy: rows 0 to 200 .* not finite"):
        Sampler(dataset, 0).batch(4)


MEMORY = """
import resource, sys
from ambulo.data import open_dataset, windows
from ambulo.sampler import Sampler
dataset = open_dataset(sys.argv[1])
windows(dataset, "training", 2, 2)
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
sampler = Sampler(dataset, 0, pool_bytes=8 << 20, piece=256)
while sampler.epoch < 1:
    sampler.batch(512, 1, 4)
windows(dataset, "training", 60, 64)
print(before, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="ru_maxrss counts in another unit")
def test_memory_is_bounded_whatever_the_size(tmp_path: Path) -> None:
    """Mapped pages count as memory: a pass over a set must give them back."""
    folder = write_dataset(tmp_path / "large", clips=1, rows=2000, validation=0)
    manifest = json.loads((folder / "dataset.json").read_text())
    rows = np.load(folder / "shards" / "clip0.npy")
    np.save(folder / "shards" / "clip0.npy", np.tile(rows, (50, 1)))
    (clip,) = manifest["clips"]
    clip.update(rows=100_000, runs=[[0, 100_000]], categories=[50 * n for n in clip["categories"]])
    (folder / "dataset.json").write_text(json.dumps(manifest))
    assert (folder / "shards" / "clip0.npy").stat().st_size > 130 << 20
    run = subprocess.run(
        [sys.executable, "-c", MEMORY, str(folder)], capture_output=True, text=True, check=True
    )
    before, after = map(int, run.stdout.split())
    assert after - before < 32 << 10, f"{(after - before) >> 10} MB for a pool of 8"


TRAINING = """
import resource, sys
from ambulo.cli import cli
cli(sys.argv[1:], standalone_mode=False)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="ru_maxrss counts in another unit")
def test_training_on_more_than_the_limit_stays_within_it(tmp_path: Path) -> None:
    """A set of 2 GB (many names of one file) is trained on in 1.5 GB, JAX and all."""
    folder = write_dataset(tmp_path / "large", clips=2, rows=2000, validation=1)
    manifest = json.loads((folder / "dataset.json").read_text())
    shard = folder / "shards" / "clip0.npy"
    rows = np.load(shard)
    np.save(shard, np.tile(rows, (50, 1)))
    clip, held = manifest["clips"]
    clip.update(rows=100_000, runs=[[0, 100_000]], categories=[50 * n for n in clip["categories"]])
    copies = []
    for number in range(16):
        name = f"copy{number}"
        (folder / "shards" / f"{name}.npy").hardlink_to(shard)
        copies.append({**clip, "name": name, "file": f"shards/{name}.npy"})
    manifest["clips"] = [*copies, held]
    (folder / "dataset.json").write_text(json.dumps(manifest))
    assert 16 * shard.stat().st_size > 2_000_000_000
    config = tmp_path / "small.toml"
    config.write_text(
        "hidden = [16]\nsteps = 300\nevery = 150\nbatch = 512\npool_mb = 64\npiece = 64\n"
    )
    told = ["train", str(folder), "-o", str(tmp_path / "m.safetensors"), "--config", str(config)]
    run = subprocess.run(
        [sys.executable, "-c", TRAINING, *told], capture_output=True, text=True, check=True
    )
    assert int(run.stdout.split()[-1]) < 1_500_000, f"{run.stdout.split()[-1]} kB"
