"""The peer that `ambulo bench evolve` measures against: it is our creature that moves there."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
import pytest

from ambulo.evaluate.peer_pyb2d3 import Peer


def tetrapod() -> dict[str, Any]:
    """9 parts and 8 joints, the shins turned by 0.2 rad in the start pose."""
    torso = {"name": "torso", "shape": {"box": {"width": 1.4, "height": 0.3}}}
    parts = [{**torso, "position": [0.0, 0.95], "density": 50.0, "tags": ["torso"]}]
    joints = []
    leg = {"shape": {"capsule": {"length": 0.3, "radius": 0.06}}, "density": 50.0}
    motor = {"limits": [-0.8, 0.8], "torque": 60.0, "speed": 6.0}
    for name, x in zip("abcd", (0.55, 0.55, -0.55, -0.55), strict=True):
        thigh, shin = f"thigh {name}", f"shin {name}"
        knee = [x, 0.53]
        foot = [x + 0.17 * math.sin(0.2), 0.53 - 0.17 * math.cos(0.2)]
        parts.append({**leg, "name": thigh, "position": [x, 0.7], "tags": ["leg"]})
        parts.append({**leg, "name": shin, "position": foot, "angle": 0.2, "tags": ["foot"]})
        hip = {"name": f"hip {name}", "parent": "torso", "child": thigh, "anchor": [x, 0.85]}
        joints.append({**hip, **motor})
        bend = {"name": f"knee {name}", "parent": thigh, "child": shin, "anchor": knee}
        joints.append({**bend, **motor})
    return {"format": 1, "name": "Tetrapod", "parts": parts, "joints": joints}


def with_head(tags: list[str]) -> dict[str, Any]:
    """A tetrapod with a round head and a beak of four points on it."""
    creature = tetrapod()
    head = {"name": "head", "shape": {"circle": {"radius": 0.2}}, "position": [0.9, 1.2]}
    points = [[0.0, -0.05], [0.2, -0.02], [0.2, 0.02], [0.0, 0.05]]
    beak = {"name": "beak", "shape": {"polygon": {"points": points}}, "position": [1.1, 1.2]}
    motor = {"limits": [-0.3, 0.3], "torque": 20.0, "speed": 2.0}
    neck = {"name": "neck", "parent": "torso", "child": "head", "anchor": [0.7, 1.05]}
    bite = {"name": "bite", "parent": "head", "child": "beak", "anchor": [1.1, 1.2]}
    creature["parts"] += [{**part, "density": 20.0, "tags": tags} for part in (head, beak)]
    creature["joints"] += [{**joint, **motor} for joint in (neck, bite)]
    return creature


def test_without_it_the_error_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyb2d3", None)
    with pytest.raises(ImportError, match=r"needs it: pip install 'ambulo\[bench\]'"):
        Peer(tetrapod(), 1, seed=0)


class TestWithPyb2d3:
    @pytest.fixture(autouse=True)
    def installed(self) -> None:
        pytest.importorskip("pyb2d3")

    def test_everyone_starts_at_zero_and_some_walk_off(self) -> None:
        peer = Peer(tetrapod(), 20, seed=1)
        assert np.array_equal(peer.distances(), np.zeros(20))
        peer.run(300)
        distances = peer.distances()
        assert distances.shape == (20,)
        assert np.isfinite(distances).all()
        assert np.abs(distances).max() > 0.5
        assert len(np.unique(distances)) == 20

    def test_inputs_are_from_the_start_pose_and_stay_in_the_joints_limits(self) -> None:
        peer = Peer(tetrapod(), 10, seed=2)
        assert np.abs(peer.inputs()).max() < 1e-5
        peer.run(300)
        angles = peer.inputs() * math.pi / 3
        assert angles.shape == (10, 9)
        assert np.abs(angles[:, 1:]).max() < 0.8 + 0.1
        assert np.abs(angles[:, 1:]).max() > 0.7

    def test_outputs_are_everyones_own_network(self) -> None:
        peer = Peer(tetrapod(), 3, seed=3)
        inputs = np.random.default_rng(0).uniform(-3, 3, (3, 9)).astype(np.float32)
        outputs = peer.outputs(inputs)
        assert outputs.shape == (3, 8)
        for i in range(3):
            values = inputs[i]
            for weights, bias in peer._layers:
                values = 3 * np.tanh(values @ weights[i] + bias[i, 0])
            assert outputs[i] == pytest.approx(values, abs=1e-5)

    def test_the_ground_carries_them(self) -> None:
        peer = Peer(tetrapod(), 2, seed=4)
        peer.run(600)
        heights = peer._bodies.get_positions().reshape(2, 9, 2)[:, :, 1]
        assert heights.min() > 0
        assert heights.max() < 2

    def test_parts_do_not_collide_with_each_other(self) -> None:
        # In free fall without motors only contacts could turn a part, and paired legs overlap.
        creature = tetrapod()
        for part in creature["parts"]:
            part["position"][1] += 10.0
        for joint in creature["joints"]:
            joint["anchor"][1] += 10.0
            joint["torque"] = 0.0
        peer = Peer(creature, 2, seed=4)
        peer.run(30)
        assert np.abs(peer.inputs()).max() < 1e-3
        assert np.abs(peer.distances()).max() < 1e-3

    def test_a_seed_gives_the_same_steps_again(self) -> None:
        again, first, other = (Peer(tetrapod(), 5, seed) for seed in (5, 5, 6))
        for peer in (again, first, other):
            peer.run(200)
        assert np.array_equal(first.distances(), again.distances())
        assert not np.array_equal(first.distances(), other.distances())

    @pytest.mark.parametrize(("tags", "driven"), [(["head"], 8), (["hand"], 8), (["leg"], 10)])
    def test_what_is_tagged_is_not_driven(self, tags: list[str], driven: int) -> None:
        peer = Peer(with_head(tags), 2, seed=7)
        assert peer.inputs().shape == (2, 1 + driven)
        peer.run(60)
        assert np.isfinite(peer.distances()).all()
