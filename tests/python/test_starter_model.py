"""The model that ships: small, free, and it walks."""

import math

import pytest

from ambulo import Controller, load_model
from ambulo.cli.demo import LICENCE
from ambulo.starters import starter_model


@pytest.fixture(scope="module")
def model():
    return load_model(starter_model())


def test_it_is_small_and_free(model) -> None:
    assert starter_model().stat().st_size <= 6_000_000
    assert model.info()["precision"] == "float16"
    assert model.info()["licence"] == LICENCE, "as `make starter` states it"
    assert starter_model().with_name("human.md").is_file(), "its card"


@pytest.mark.parametrize(
    ("gait", "speed", "aside"),
    [
        ("walk", 1.4, 0.0),
        ("jog", 2.8, 0.0),
        ("run", 4.5, 0.0),
        ("crouch", 0.9, 0.0),
        ("walk", 1.0, math.pi),
        ("walk", 1.0, math.pi / 2),
    ],
)
def test_it_goes_as_fast_as_it_is_asked(model, gait: str, speed: float, aside: float) -> None:
    character = Controller(model)
    velocity = (speed * math.sin(aside), speed * math.cos(aside))

    def walk(seconds: float) -> None:
        for _ in range(round(seconds * 60)):
            step = character.step(1 / 60, velocity, gait=gait, facing=(0.0, 1.0), strafe=1.0)
            assert step.event is None

    walk(4.0)
    x, _, z, _ = character.root
    walk(6.0)
    to_x, _, to_z, yaw = character.root
    along = ((to_x - x) * velocity[0] + (to_z - z) * velocity[1]) / speed
    assert along / 6.0 == pytest.approx(speed, rel=0.07)
    assert abs(yaw) < 0.3, "it faces where it is asked to"
    head = character.positions()[:, 1].max() - character.root[1]
    assert (0.9 if gait == "crouch" else 1.3) < head < (1.5 if gait == "crouch" else 1.9)
