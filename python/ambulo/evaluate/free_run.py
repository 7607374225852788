"""A free run: random commands for a long time, and each steady command for long enough to measure.

What counts as a fault is in `faults.py`, what is asked in `commands.py`, what is measured in
`steady.py`; `docs/walking.md` defines every figure. On flat ground, at 60 steps a second; the same
arguments give the same report, bit by bit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import chain, islice
from typing import Any

import numpy as np

from ambulo.character import Controller
from ambulo.evaluate.captured import Capture, measure_capture
from ambulo.evaluate.commands import CLASSES, FPS, Command, Steady, random_commands
from ambulo.evaluate.faults import Faults, Moment, total
from ambulo.evaluate.steady import Body, Motion, figures, reached, sways
from ambulo.model import Model

# Seconds of random commands, so that no two runs begin alike; of a steady command before it is
# measured; and then.
STIR, SETTLE, MEASURED = 2.0, 3.0, 10.0
GAITS = ("walk", "jog", "run", "crouch")
Progress = Callable[[float], None]


@dataclass(frozen=True)
class Settings:
    """How long and what."""

    minutes: float = 10.0
    """Of random commands, a seed."""
    seeds: int = 5
    gaits: tuple[str, ...] = GAITS
    """That random commands ask for."""
    classes: tuple[Steady, ...] = CLASSES
    hold_feet: bool = False
    """Measure with feet held where they stand; else as the network has them."""

    @property
    def seconds(self) -> float:
        """Of motion in all."""
        steady = len(self.classes) * (STIR + SETTLE + MEASURED)
        return self.seeds * (60.0 * self.minutes + steady)


def free_run(
    model: Model,
    settings: Settings,
    capture: Capture | None = None,
    on_progress: Progress | None = None,
) -> dict[str, Any]:
    """Run a model freely and report, as plain values.

    Args:
        model: with feet and a skeleton; its own tuning is used.
        settings: how long and what.
        capture: measured for the same figures, whose ratios are reported then.
        on_progress: gets the seconds of motion done so far, of `settings.seconds`.

    Raises:
        ModelError: the model cannot be controlled.
    """
    done = 0.0

    def advance(seconds: float) -> None:
        nonlocal done
        done += seconds
        if on_progress is not None:
            on_progress(done)

    watched = [_endure(model, seed, settings, advance) for seed in range(settings.seeds)]
    classes = {
        steady.name: _measure(model, steady, settings, advance) for steady in settings.classes
    }
    left_out: list[str] = []
    if capture is not None:
        same, left_out = measure_capture(capture, settings.classes)
        for name, found in classes.items():
            found["capture"] = same[name]
            found["ratios"] = _ratios(found, same[name])
    return {
        "left_out": left_out,
        "layout": model.header["layout"]["name"],
        "tuning": model.tuning,
        "seeds": settings.seeds,
        "gaits": list(settings.gaits),
        "hold_feet": settings.hold_feet,
        "random": total(watched),
        "classes": classes,
    }


def _endure(
    model: Model, seed: int, settings: Settings, advance: Callable[[float], None]
) -> Faults:
    faults = Faults(model)
    frames = round(settings.minutes * 60.0 * FPS)
    commands = islice(random_commands(seed, settings.gaits), frames)
    for frame, moment in enumerate(_moments(Controller(model, place_feet=False), commands), 1):
        faults.watch(moment)
        if frame % FPS == 0:
            advance(1.0)
    return faults


def _moments(character: Controller, commands: Iterable[Command]) -> Iterable[Moment]:
    for command in commands:
        step = character.step(
            1.0 / FPS,
            command.velocity,
            gait=command.gait,
            facing=command.facing,
            strafe=1.0 if command.facing else 0.0,
        )
        yield Moment(
            character.positions(), character.rotations(), character.root, command, step.event
        )


def _measure(
    model: Model, steady: Steady, settings: Settings, advance: Callable[[float], None]
) -> dict[str, Any]:
    body, motions, headings = Body.of(model.header["parts"]), [], []
    tuning = {**model.tuning, "hold_feet": settings.hold_feet}
    for seed in range(settings.seeds):
        heading = float(np.random.default_rng([seed, 1]).uniform(-np.pi, np.pi))
        character = Controller(model, facing=heading, tuning=tuning, place_feet=False)
        stirring = islice(random_commands(seed, settings.gaits), round(STIR * FPS))
        motions.append(_steady_motion(character, stirring, steady, heading, body))
        headings.append(heading)
        advance(STIR + SETTLE + MEASURED)
    pooled = sways(motions, body) if not steady.speed else {}
    return {
        "asked": {"gait": steady.gait, "speed": steady.speed, "turn": steady.turn},
        **reached(motions, steady, headings),
        **figures(motions, body, np.array(body.toe_heights)),
        **{key: float(np.median(values)) for key, values in pooled.items()},
    }


def _steady_motion(
    character: Controller,
    stirring: Iterable[Command],
    steady: Steady,
    heading: float,
    body: Body,
) -> Motion:
    frames = round((SETTLE + MEASURED) * FPS)
    commands = (steady.at(frame / FPS, heading) for frame in range(frames))
    positions, roots, contacts = [], [], []
    unmeasured = round((STIR + SETTLE) * FPS)
    for frame, moment in enumerate(_moments(character, chain(stirring, commands))):
        if frame >= unmeasured:
            positions.append(moment.positions)
            roots.append(moment.root)
            contacts.append(character.contacts)
    places, root = np.stack(positions), np.array(roots)
    return Motion(
        positions=places,
        root=root[:, [0, 2]],
        yaw=root[:, 3],
        toes_above=places[:, body.toes, 1].astype(float),
        touching=np.array(contacts)[:, [1, 3]] > 0.5,
    )


# Figures that capture has, too, and what their ratios are called.
RATIOS = {
    "skate_cm_per_frame": "skate",
    "jerk_m_per_s3": "jerk",
    "hips_sway_cm": "hips_sway",
    "chest_sway_cm": "chest_sway",
}


def _ratios(found: dict[str, Any], capture: dict[str, float]) -> dict[str, float]:
    """Ours over the capture's."""
    return {
        name: found[key] / capture[key]
        for key, name in RATIOS.items()
        if key in found and capture.get(key)
    }
