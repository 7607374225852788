"""The network, and the loop in which it meets its own predictions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from ambulo import _core
from ambulo.data import Dataset, open_dataset, windows
from ambulo.models import paths, pfnn, rollout
from ambulo.presets import (
    settings,
)
from ambulo.trainer import Trainer
from conftest import JOINTS
from synthetic_dataset import SMALL, write_dataset

# Compiling is most of the work here; the numbers are good enough without polish.
jax.config.update("jax_disable_most_optimizations", True)


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_dataset(tmp_path_factory.mktemp("data") / "toy", slope=0.1)


@pytest.fixture(scope="session")
def dataset(folder: Path) -> Dataset:
    return open_dataset(folder)


def test_the_phase_function_is_the_runtimes() -> None:
    cycles = np.concatenate([np.linspace(-2.0, 3.0, 401), [0.0, 0.25, 0.5, 0.75, 1.0]])
    with jax.enable_x64():
        ours = np.asarray(pfnn.phase_shares(jnp.asarray(cycles)))
    assert np.abs(ours - _core.phase_shares(cycles.tolist())).max() < 1e-12
    single = np.asarray(pfnn.phase_shares(jnp.asarray(cycles, jnp.float32)))
    assert np.abs(single - ours).max() < 1e-5


def test_blending_after_the_product_is_blending_the_weights() -> None:
    params = pfnn.init(jax.random.key(0), [5, 7, 3])
    params = [{**layer, "bias": layer["bias"] + 0.1 * i} for i, layer in enumerate(params, 1)]
    rng = np.random.default_rng(0)
    x, cycles = rng.standard_normal((20, 5)).astype(np.float32), rng.random(20).astype(np.float32)
    got = np.asarray(pfnn.forward(params, jnp.asarray(x), jnp.asarray(cycles)))
    for row, cycle, y in zip(x.astype(np.float64), cycles, got, strict=True):
        share = _core.phase_shares([float(cycle)])[0]
        h = row
        for index, layer in enumerate(params):
            wide = np.asarray(layer["weight"], np.float64).reshape(len(h), 4, -1)
            bias = np.asarray(layer["bias"], np.float64).reshape(4, -1)
            h = h @ np.einsum("k,iko->io", share, wide) + share @ bias
            if index == 0:
                h = np.where(h > 0, h, np.exp(np.minimum(h, 0)) - 1)
        assert np.abs(h - y).max() < 1e-5


@pytest.mark.parametrize(("scheme", "bound"), [("published", (6 / 2048) ** 0.5), ("glorot", 0.25)])
def test_weights_begin_within_their_bound(scheme: str, bound: float) -> None:
    (layer,) = pfnn.init(jax.random.key(1), [32, 64], scheme)
    weight = np.asarray(layer["weight"])
    assert weight.shape == (32, 4 * 64) and not layer["bias"].any()
    assert 0.98 * bound < np.abs(weight).max() <= bound
    # The control points are not copies of each other.
    assert np.abs(weight[:, :64] - weight[:, 64:128]).mean() > 0.3 * bound


def test_dropout_keeps_the_mean_and_drops_its_share() -> None:
    x = jnp.ones((200, 500))
    dropped = np.asarray(pfnn.dropout(jax.random.key(0), x, 0.3))
    assert abs((dropped == 0).mean() - 0.3) < 0.01
    assert abs(dropped.mean() - 1.0) < 0.01
    assert pfnn.dropout(jax.random.key(0), x, 0.0) is x


def perfect(trainer: Trainer, monkeypatch: pytest.MonkeyPatch, rows: np.ndarray, off: float = 0.0):
    """Make the network foresee exactly what the clip does, but for `off` deviations."""
    answers = iter(np.swapaxes(rows, 0, 1))
    y = slice(*trainer.wiring.y)

    def forward(*_: Any) -> Any:
        row = next(answers)
        return jnp.asarray((row[:, y] - trainer.scale.y_mean) / trainer.scale.y_std) + off

    monkeypatch.setattr(rollout, "forward", forward)


LAYOUTS = pytest.mark.parametrize("layout", ["ambulo", "holden"])


@LAYOUTS
def test_what_a_perfect_network_feeds_back_is_the_clips_next_input(
    layout: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Units, frames of the roots and the height between rows, on ground that goes up and down."""
    dataset = open_dataset(write_dataset(tmp_path / "d", layout=layout, slope=0.3))
    trainer = Trainer(dataset, settings(SMALL))
    rows = windows(dataset, "training", 6, 5)
    w = trainer.wiring
    options = rollout.Options(feedback=1.0, own_phase=True, implied=1.0, planted=1.0)
    perfect(trainer, monkeypatch, rows)
    carry = rollout.nothing(len(rows), len(JOINTS))
    for t in range(6):
        row = jnp.asarray(rows[:, t])
        x, y = row[:, slice(*w.x)], row[:, slice(*w.y)]
        told, moment = rollout._meet(w, carry, row, x, y, 0.0, options, None)
        scale = np.abs(x).max()
        assert np.abs(told - x).max() < 2e-5 * scale
        assert np.abs((moment.phase - row[:, w.phase] + 0.5) % 1.0 - 0.5).max() < 1e-4
        velocity = x[:, slice(*w.velocity_in)] * w.dt
        there = y[:, slice(*w.position_out)] - velocity
        # One frame's turn of one frame's way: a few per cent of it.
        limit = 0.05 * np.abs(velocity).max() + 1e-5 * scale
        assert np.abs(moment.carried - there).max() < limit
        carry, (loss, error) = rollout._step(
            [], trainer.scale, w, carry, row, 1.0, 0.0, options, None
        )
        assert float(error.max()) < 1e-4 * scale
        assert float(loss) < 1e-3


@LAYOUTS
def test_a_perfect_follower_on_its_own_way_stays_with_its_clip(
    layout: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its path is walked by its own velocities, its future the one that it foresaw."""
    dataset = open_dataset(write_dataset(tmp_path / "d", layout=layout, slope=0.3))
    trainer = Trainer(dataset, settings(SMALL))
    frames = 90
    rows = windows(dataset, "training", frames, 4)
    w = trainer.wiring
    options = rollout.Options(
        feedback=1.0, own_phase=True, own_root=1.0, own_future=1.0, root_pull=2.0, phase_pull=2.0
    )
    perfect(trainer, monkeypatch, rows)
    carry = rollout.nothing(4, len(JOINTS), options)
    for t in range(frames):
        row = jnp.asarray(rows[:, t])
        x, y = row[:, slice(*w.x)], row[:, slice(*w.y)]
        told, moment = rollout._meet(w, carry, row, x, y, 0.0, options, None)
        for k, span in enumerate(w.trajectory_in):
            off = np.abs(told - x)[:, slice(*span)].max()
            assert off < (0.004 * w.unit if k < 2 else 0.01), (t, k)
        assert np.abs(np.asarray(moment.off)[:, :2]).max() < 1e-3 * w.unit
        carry, (loss, _) = rollout._step([], trainer.scale, w, carry, row, 1.0, 0.0, options, None)
        assert float(loss) < 1e-3, t
    assert carry.valid.all()


@LAYOUTS
@pytest.mark.parametrize("beside", [(0.1, 0.0, 0.0), (0.0, -0.2, 0.0), (0.0, 0.0, 0.3)])
def test_whoever_is_beside_its_clip_is_led_back(
    layout: str, beside: tuple[float, float, float], tmp_path: Path
) -> None:
    dataset = open_dataset(write_dataset(tmp_path / "d", layout=layout))
    trainer = Trainer(dataset, settings(SMALL))
    w = trainer.wiring
    rows = windows(dataset, "training", 2, 5)
    options = rollout.Options(own_root=1.0, root_pull=2.0)
    row = jnp.asarray(rows[:, 0])
    x, y = row[:, slice(*w.x)], row[:, slice(*w.y)]
    _, straight = rollout._meet(
        w, rollout.nothing(5, len(JOINTS), options), row, x, y, 0.0, options, None
    )
    off = np.array(beside) * [w.unit, w.unit, 1.0]
    path = straight.path.at[:, -1].add(off)
    carry = rollout.nothing(5, len(JOINTS), options)
    carry = carry._replace(path=path, valid=jnp.ones(5, bool))
    told, moment = rollout._meet(w, carry, row, x, y, 0.0, options, None)
    assert np.allclose(moment.off, -off, atol=1e-4 * w.unit)
    # Seen from where it is, the clip's way begins here, and what they are apart is made up.
    own, clip = (
        paths.trajectory(jnp.asarray(v), w.trajectory_in)[:, paths.NOW :] for v in (told, x)
    )
    own, clip = paths.placed(moment.now, own), paths.placed(straight.now, clip)
    left = np.array(own - clip)
    left[..., 2] = (left[..., 2] + np.pi) % (2 * np.pi) - np.pi
    assert np.allclose(left, off * (1.0 - paths.AHEAD)[:, None], atol=2e-3 * w.unit)
    # A frame of what is asked, walked: the clip's frame, and 2 a second of the way back.
    after = rollout._walked(w, moment, y, options)
    asked = rollout._led_back(w, moment, after, y, row[:, w.phase], options)
    walked = np.asarray(rollout._moved(moment.now, asked, w) - moment.now)
    clips = np.asarray(straight.next_clip - straight.clip)
    assert np.allclose(walked, clips - 2.0 / 60.0 * off, atol=1e-4 * w.unit)


def test_damping_keeps_to_where_the_velocity_leads(
    dataset: Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    trainer = Trainer(dataset, settings(SMALL))
    rows = windows(dataset, "training", 1, 3)
    w = trainer.wiring
    carries = []
    for feedback in (0.0, 0.5, 1.0):
        perfect(trainer, monkeypatch, rows, off=0.5)
        _, carry = rollout.unroll(
            [], trainer.scale, w, jnp.asarray(rows), options=rollout.Options(feedback=feedback)
        )
        carries.append(np.asarray(carry.position))
    std = trainer.scale.y_std[slice(*w.position_out)]
    y = rows[:, 0, slice(*w.y)]
    assert np.allclose(carries[2] - y[:, slice(*w.position_out)], 0.5 * std, atol=1e-4)
    assert np.allclose(carries[1], 0.5 * (carries[0] + carries[2]), atol=1e-5)
    assert np.abs(carries[0] - carries[2]).min() > 0.01


def test_a_pose_that_is_no_body_is_not_gone_on_from(
    dataset: Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    trainer = Trainer(dataset, settings(SMALL))
    rows = windows(dataset, "training", 1, 2)
    perfect(trainer, monkeypatch, rows, off=1000.0)
    _, carry = rollout.unroll([], trainer.scale, trainer.wiring, jnp.asarray(rows))
    assert not carry.valid.any()


def test_a_strayed_phase_is_asked_back(dataset: Dataset) -> None:
    trainer = Trainer(dataset, settings(SMALL))
    w = trainer.wiring
    row = jnp.asarray(windows(dataset, "training", 1, 3)[:, 0])
    row = row.at[:, w.phase].set(jnp.array([0.2, 0.1, 0.3]))
    x, y = row[:, slice(*w.x)], row[:, slice(*w.y)]
    options = rollout.Options(own_phase=True, phase_pull=2.0)
    carry = rollout.nothing(3, len(JOINTS))
    carry = carry._replace(phase=jnp.array([0.1, 0.9, 0.3]), valid=jnp.ones(3, bool))
    _, moment = rollout._meet(w, carry, row, x, y, 0.0, options, None)
    led = rollout._led_back(w, moment, moment.next_clip, y, row[:, w.phase], options)
    # The short way round, and two of what it is off a second.
    assert np.allclose((led - y)[:, w.rate_out], [0.2, 0.4, 0.0], atol=1e-6)


def test_noise_lies_on_what_is_started_from_only(dataset: Dataset) -> None:
    trainer = Trainer(dataset, settings(SMALL))
    w = trainer.wiring
    row = jnp.asarray(windows(dataset, "training", 1, 8)[:, 0])
    x, y = row[:, slice(*w.x)], row[:, slice(*w.y)]
    options = rollout.Options(noise=0.5, own_phase=True, phase_noise=0.01)
    going = rollout.nothing(8, len(JOINTS))._replace(valid=jnp.arange(8) % 2 == 0)
    key = jax.random.key(0)
    told, _ = rollout._meet(w, going, row, x, y, trainer.numbers.pose_std, options, key)
    pose = np.r_[slice(*w.position_in), slice(*w.velocity_in)]
    changed = np.abs(np.asarray(told - x))
    assert (changed[1::2][:, pose] > 0).mean() > 0.9
    others = np.delete(np.arange(x.shape[1]), pose)
    assert not changed[:, others].any()
    # Those that go on have their own pose, here nothing at all.
    velocity = np.asarray(told)[::2, slice(*w.velocity_in)]
    assert not velocity.any()


def test_shares_of_followers_lie_within_each_other() -> None:
    few, many = (np.asarray(rollout._some(100, share))[:, 0] for share in (0.2, 0.7))
    assert few.sum() == 20 and many.sum() == 70 and not (few & ~many).any()
    # Spread over the batch, as ages are by place.
    assert 25 < many[:50].sum() < 45


def test_the_gradient_flows_through_time_only_if_asked(dataset: Dataset) -> None:
    trainer = Trainer(dataset, settings(SMALL))
    rows = jnp.asarray(windows(dataset, "training", 4, 4))
    params = trainer.start()["params"]

    def last(params: Any, through_time: bool) -> Any:
        options = rollout.Options(through_time=through_time)
        outcome, _ = rollout.unroll(params, trainer.scale, trainer.wiring, rows, options=options)
        return outcome.loss[-1]

    through, cut = (jax.grad(last)(params, flag) for flag in (True, False))
    assert float(last(params, True)) == float(last(params, False))
    assert float(jnp.abs(through[0]["weight"] - cut[0]["weight"]).max()) > 1e-6
