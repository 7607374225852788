"""What visits to a scene came to, beside what is asked for."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ambulo.model import Model
from ambulo.scene import Visited

Measured = Mapping[str, Any]


@dataclass(frozen=True)
class Measure:
    """A number that should not be above another."""

    name: str
    unit: str
    target: float
    of: Callable[[Measured], float | None]
    """None where there was nothing to measure."""
    where: str = ""
    """The field that says where it was worst."""


def _most(field: str) -> Callable[[Measured], float | None]:
    return lambda measured: measured[field]["most"] if measured[field]["count"] else None


def _jumps(measured: Measured) -> float | None:
    plain = measured["walking_jump_cm"]
    return measured["transition_jump_cm"] / plain if plain > 0.0 else None


def _sitting(measured: Measured) -> float | None:
    return measured["sits"] - measured["stood_up"] if measured["sits"] else None


MEASURES = (
    Measure("hand to handle", "cm", 1.0, _most("hand_cm"), "hand_farthest"),
    Measure("hand to handle, turned", "°", 5.0, _most("hand_degrees")),
    Measure("hips to seat", "cm", 2.0, _most("hips_cm")),
    Measure("hips to seat, turned", "°", 5.0, _most("hips_degrees")),
    Measure("penetration", "cm", 1.0, _most("penetration_cm"), "deepest"),
    Measure("joint jump at changes", "× walking", 1.5, _jumps, "farthest"),
    Measure("foot skate, mean", "cm/frame", 0.1,
            lambda m: m["skate_cm"]["mean"] if m["skate_cm"]["count"] else None),
    Measure("sits without standing up", "", 0.0, _sitting),
    Measure("hands that slipped off", "", 0.0, lambda m: float(m["slips"])),
    Measure("tasks left undone", "", 0.0, lambda m: float(len(m["undone"]))),
)  # fmt: skip


def summarise(visits: Sequence[Visited]) -> list[dict[str, Any]]:
    """For each measure the value of the first visit, and mean and worst of all of them.

    `met`: whether the worst is no more than the target; None where there was nothing to measure.
    """
    return [_row(measure, visits) for measure in MEASURES]


def _row(measure: Measure, visits: Sequence[Visited]) -> dict[str, Any]:
    every = [(measure.of(visit["measured"]), visit) for visit in visits]
    found = [(value, visit) for value, visit in every if value is not None]
    worst = max(found, key=lambda pair: pair[0], default=None)
    return {
        "measure": measure.name,
        "unit": measure.unit,
        "target": measure.target,
        "first": every[0][0],
        "mean": sum(value for value, _ in found) / len(found) if found else None,
        "worst": None if worst is None else worst[0],
        "worst_seed": None if worst is None else worst[1]["seed"],
        "where": None if worst is None else worst[1]["measured"].get(measure.where) or None,
        "met": None if worst is None else worst[0] <= measure.target,
    }


def weights_hash(model: Model) -> str:
    """SHA-256 of a model's bundle as it is in memory."""
    return hashlib.sha256(model.to_bytes(model.core.half)).hexdigest()
