"""What a training run can be told, what of it makes sense, and the sets that are named."""

from __future__ import annotations

import dataclasses
import difflib
import math
import tomllib
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, get_type_hints


class SettingsError(ValueError):
    """A setting that is unknown or out of range; the message names it."""


@dataclass(frozen=True)
class Stage:
    """A part of the training: how the network runs on its own.

    A batch has followers: each runs along a clip with its own pose fed back, `frames` rows a step
    (the gradient flows through them), and goes on step after step until it has followed for `age`
    rows; then it starts anew from some clip's own pose. One row and an age of one is the published
    way.
    """

    share: float = 1.0
    """Of all steps; the shares of all stages sum to 1."""
    frames: int = 1
    age: int = 1
    age_end: int = 0
    """What `age` has grown to, linearly, at the stage's end; 0: stays."""
    batch: int = 0
    """Followers; 0: the setting `batch` over `frames`, so that a step has as many rows."""


@dataclass(frozen=True)
class Settings:
    """Everything that decides what a run learns; times are in steps, one batch each."""

    # The network.
    hidden: tuple[int, ...] = (512, 512)
    """Widths of the hidden layers."""
    init: str = "glorot"
    """'glorot' or 'published'."""

    # Normalisation.
    joint_weight: float = 1.0
    """How loud the input's joints are."""
    masked_joints: tuple[str, ...] = ()
    """Joints that the input hides; names that the skeleton has not are passed over."""
    std_floor: float = 1e-4
    hide_constant: bool = True

    # How long, and how fast.
    steps: int = 0
    """0: as many as `epochs` takes."""
    epochs: float = 0.0
    """Passes over the training rows, if `steps` is 0."""
    batch: int = 512
    learning_rate: float = 1e-3
    schedule: str = "cosine"
    """'cosine' from `learning_rate` to `final_rate`, or 'constant'."""
    final_rate: float = 1e-5
    warmup: int = 200
    """Steps over which the rate rises from zero."""
    weight_decay: float = 0.0
    """AdamW's, on weights; biases are free."""
    clip: float = 1.0
    """Largest norm of a gradient; 0: any."""
    ema: float = 0.999
    """Share of the old in the running mean of the weights, which is what is kept; 0: none."""

    # What is learned.
    stages: tuple[Stage, ...] = (Stage(),)
    feedback: float = 0.5
    """Share of the predicted position in the pose fed back, as the runtime has it."""
    mix: float = 0.0
    """Follower j of B has the age limit 1 + (age − 1)·(j/B) ** mix: with 2, most are young."""
    stagger: float = 0.5
    """A start counts as this old already, by chance, as a share of the age limit at most."""
    own_phase: bool = False
    """Go on with the predicted phase instead of the clip's."""
    phase_pull: float = 2.0
    """Of an own phase: the share of what it is off that is to come back in a second."""
    own_root: float = 0.0
    """Share of the followers that also go their own way over the ground."""
    own_future: float = 0.0
    """Share, of all, that are told what they foresee, bent to the clip's, as the runtime does."""
    told_simply: float = 0.0
    """Share, of all, that are told the clip's future as a wish: straight on, facing one way."""
    root_pull: float = 1.0
    """As `phase_pull`, of an own way."""
    root_noise: float = 0.0
    """How far beside its clip an own way begins, metres and 1.5 times as many radians."""
    past_warp: float = 0.0
    """How much faster or slower its past looks than it was: speed is to be read from the future."""
    through_time: bool = True
    """Let the gradient flow from a frame of a step into those before."""
    l1: float = 0.0
    """Times Σ mean |W| of the layers."""
    dropout_input: float = 0.0
    dropout_hidden: float = 0.0
    noise: float = 0.0
    """Largest deviation of noise on a pose that is started from, as a share of its block's."""
    phase_noise: float = 0.0
    """The same for its phase, cycles."""
    noise_end: float = 1.0
    """What is left of both at the last step; they change linearly."""
    balance: float = 0.0
    """Categories with few rows come oftener: (rows) ** −balance; 0: as recorded, 1: all alike."""
    implied: float = 0.0
    """Weight of the velocity from the pose before to the predicted one, against the capture's."""
    planted: float = 0.0
    """The same for feet in contact, along the ground."""
    weigh: str = "numbers"
    """In the loss, 'numbers' count alike, or 'blocks' do however many numbers they have."""
    block_weights: dict[str, float] = dataclasses.field(default_factory=dict)
    """Times this, by an output block's name; 1 if not named."""

    # How it is judged.
    every: int = 500
    """Steps from one report, validation and checkpoint to the next."""
    judge_windows: int = 128
    judge_frames: int = 60
    measure: str = "loop"
    """The best is kept by 'loop' (position error with the pose fed back) or 'one_step' (loss)."""
    patience: int = 0
    """Stop after this many reports without a better one; 0: never."""

    # What the model carries.
    tuning: dict[str, Any] = dataclasses.field(default_factory=dict)
    """How the runtime is to move it where that is not the published way: fields of the runtime's
    tuning, such as `pose_halflife`."""

    # Memory.
    pool_mb: int = 512
    """Rows in memory, MB; a larger set passes through it."""
    piece: int = 512
    """Consecutive rows that come into the pool together, when it does not hold the whole set."""

    seed: int = 0


RANGES: dict[str, tuple[float, float]] = {
    "joint_weight": (1e-6, 1e6), "std_floor": (1e-12, 1.0),
    "steps": (0, 1e9), "epochs": (0.0, 1e6), "batch": (1, 65536),
    "learning_rate": (1e-9, 1.0), "final_rate": (0.0, 1.0), "warmup": (0, 1e9),
    "weight_decay": (0.0, 10.0), "clip": (0.0, 1e6), "ema": (0.0, 0.999999),
    "feedback": (0.0, 1.0), "l1": (0.0, 10.0),
    "dropout_input": (0.0, 0.95), "dropout_hidden": (0.0, 0.95),
    "noise": (0.0, 10.0), "noise_end": (0.0, 10.0), "balance": (0.0, 1.0),
    "every": (1, 1e9), "judge_windows": (1, 4096), "judge_frames": (2, 600),
    "patience": (0, 1e9), "pool_mb": (1, 1e6), "piece": (2, 1e6), "seed": (0, 2**31 - 1),
    "mix": (0.0, 10.0), "implied": (0.0, 100.0), "planted": (0.0, 100.0),
    "stagger": (0.0, 1.0), "phase_pull": (0.0, 100.0), "phase_noise": (0.0, 1.0),
    "own_root": (0.0, 1.0), "own_future": (0.0, 1.0), "told_simply": (0.0, 1.0),
    "root_pull": (0.0, 100.0), "root_noise": (0.0, 10.0), "past_warp": (0.0, 1.0),
    "share": (0.0, 1.0), "frames": (1, 600), "age": (1, 36000), "age_end": (0, 36000),
}  # fmt: skip
# A stage's 0 stands for the setting of that name.
STAGE_RANGES = {**RANGES, "batch": (0, 65536)}
CHOICES = {
    "init": ("glorot", "published"),
    "schedule": ("cosine", "constant"),
    "weigh": ("numbers", "blocks"),
    "measure": ("loop", "one_step"),
}

# Joints of the authors' skeleton whose input they hide: they hardly move, or only shake.
_HIDDEN = [
    "LHipJoint", "RHipJoint", "LowerBack", "Neck", "LeftShoulder", "LeftFingerBase",
    "LeftHandIndex1", "LThumb", "RightShoulder", "RightFingerBase", "RightHandIndex1", "RThumb",
]  # fmt: skip

# Each names what it starts from (`base`) and what it changes.
PRESETS: dict[str, dict[str, Any]] = {
    "default": {
        "about": "some minutes on two cores for half an hour of capture",
        "hidden": [512, 512],
        "steps": 14000,
        "noise": 0.1,
        "phase_noise": 0.02,
        "balance": 0.6,
        "feedback": 1.0,
        "own_phase": True,
        "mix": 1.5,
        "stagger": 0.0,
        "own_root": 0.7,
        "own_future": 0.5,
        "told_simply": 0.3,
        "root_pull": 2.0,
        "root_noise": 0.05,
        "past_warp": 0.1,
        "implied": 0.008,
        "planted": 0.02,
        "weigh": "blocks",
        "block_weights": {
            "root_yaw": 0.5,
            "phase_rate": 0.5,
            "contacts": 0.5,
            "trajectory_x": 0.4,
            "trajectory_z": 0.4,
            "direction_x": 0.3,
            "direction_z": 0.3,
            "joint_position": 3.0,
            "joint_velocity": 1.5,
            "joint_rotation": 1.5,
        },
        "stages": [
            {"share": 0.1},
            {"share": 0.4, "age": 1, "age_end": 60},
            {"share": 0.5, "age": 60, "age_end": 120},
        ],
        "tuning": {
            "pose_halflife": 0.0,
            "velocity_halflife": 0.12,
            "facing_halflife": 0.08,
            "stand_freedom": 1.0,
            "sway": 0.045,
            "foot_drive": 0.4,
            "fastest_turn": 35.0,
            "speed_limit": [0.7, 1.5],
            "speed_halflife": 0.5,
        },
    },
    "quick": {
        "base": "default",
        "about": "something that walks, in a minute or two",
        "hidden": [256, 256],
        "steps": 4000,
        "learning_rate": 1.5e-3,
        "stages": [
            {"share": 0.05},
            {"share": 0.45, "age": 1, "age_end": 60},
            {"share": 0.5, "age": 60, "age_end": 120},
        ],
    },
    "starter": {
        "base": "default",
        "about": "the starter motion",
        "hidden": [384, 384],
        "steps": 12000,
        "planted": 0.01,
        "tuning": {
            "pose_halflife": 0.03,
            "facing_halflife": 0.08,
            "position_bias": [2.0, 1.0],
            "facing_bias": [1.0, 0.5],
            "stand_freedom": 1.0,
            "sway": 0.03,
            "foot_drive": 0.25,
            "fastest_turn": 35.0,
            "speed_limit": [0.85, 1.05],
            "speed_halflife": 0.5,
        },
    },
    "holden": {
        "about": "the published training: days on two cores",
        "init": "published",
        "joint_weight": 0.1,
        "masked_joints": _HIDDEN,
        "hide_constant": False,
        "epochs": 20.0,
        "batch": 32,
        "learning_rate": 1e-4,
        "schedule": "constant",
        "warmup": 0,
        "clip": 0.0,
        "ema": 0.0,
        "l1": 0.01 / 6.0,
        "dropout_input": 0.3,
        "dropout_hidden": 0.3,
        "every": 10000,
        "measure": "one_step",
    },
    "holden-xl": {
        "base": "holden",
        "about": "one more hidden layer",
        "hidden": [512, 512, 512],
        "l1": 0.01 / 8.0,
    },
    "holden-xt": {"base": "holden", "about": "twice as long", "epochs": 40.0},
    "ava": {
        "base": "holden",
        "about": "191 joints: as holden, for any skeleton",
        "masked_joints": [],
    },
}


def preset(name: str) -> dict[str, Any]:
    """The keys that a preset sets, those of what it starts from included."""
    if name not in PRESETS:
        raise SettingsError(f"preset '{name}' is not known{_near(name, list(PRESETS))}")
    own = {key: value for key, value in PRESETS[name].items() if key not in ("base", "about")}
    base = PRESETS[name].get("base")
    return {**preset(base), **own} if base else own


def load_settings(name: str, config: str | Path | None = None, **given: Any) -> Settings:
    """A preset, changed by a TOML file, changed by keys that are not None.

    Raises:
        SettingsError: an unknown key, or a value that is out of range.
    """
    keys = preset(name)
    if config is not None:
        try:
            changes = tomllib.loads(Path(config).read_text(encoding="utf-8"))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise SettingsError(f"{config}: {error}") from error
        try:
            settings({**keys, **changes})
        except SettingsError as error:
            raise SettingsError(f"{config}: {error}") from error
        keys |= changes
    return settings({**keys, **{key: value for key, value in given.items() if value is not None}})


def settings(keys: dict[str, Any]) -> Settings:
    """Settings from plain values, as TOML and JSON have them, all checked."""
    made = _made(Settings, keys, RANGES)
    if made.steps == 0 and made.epochs == 0.0:
        raise SettingsError("steps and epochs are both 0: say how long to train")
    shares = sum(stage.share for stage in made.stages)
    if not math.isclose(shares, 1.0, abs_tol=1e-6):
        raise SettingsError(f"stages: their shares sum to {shares:g}, expected 1")
    if made.final_rate > made.learning_rate:
        raise SettingsError(
            f"final_rate {made.final_rate:g} is above learning_rate {made.learning_rate:g}"
        )
    return made


def plain(made: Settings) -> dict[str, Any]:
    """The other way: as JSON can hold them."""
    return _listed(dataclasses.asdict(made))


def difference(a: dict[str, Any], b: dict[str, Any]) -> list[str]:
    """Keys in which two plain settings differ, with both values."""
    keys = sorted(a.keys() | b.keys())
    return [f"{key} ({a.get(key)} → {b.get(key)})" for key in keys if a.get(key) != b.get(key)]


def _made(kind: type, keys: dict[str, Any], ranges: dict[str, tuple[float, float]]) -> Any:
    known = {field.name for field in fields(kind)}
    for key in keys:
        if key not in known:
            raise SettingsError(f"'{key}' is not a setting{_near(key, sorted(known))}")
    types = get_type_hints(kind)
    return kind(**{key: _value(key, value, types[key], ranges) for key, value in keys.items()})


def _value(key: str, value: Any, kind: Any, ranges: dict[str, tuple[float, float]]) -> Any:
    if kind is float and type(value) is int:
        value = float(value)
    if kind in (bool, int, float, str):
        if type(value) is not kind:
            raise SettingsError(f"{key}: expected {_KINDS[kind]}, got {value!r}")
        return _checked(key, value, ranges)
    if not isinstance(value, dict if key in ("block_weights", "tuning") else list | tuple):
        raise SettingsError(f"{key}: expected {_KINDS[key]}, got {value!r}")
    if key == "hidden":
        if not all(type(width) is int and 1 <= width <= 8192 for width in value):
            raise SettingsError(f"hidden: expected widths from 1 to 8192, got {value!r}")
        return tuple(value)
    if key == "masked_joints":
        return tuple(_value("masked_joints", name, str, ranges) for name in value)
    if key == "stages":
        if not value or not all(isinstance(stage, dict) for stage in value):
            raise SettingsError(f"stages: expected {_KINDS['stages']}, got {value!r}")
        return tuple(_made(Stage, stage, STAGE_RANGES) for stage in value)
    if key == "tuning":
        return dict(value)
    assert isinstance(value, dict)
    weights = {name: _value(f"block_weights.{name}", w, float, ranges) for name, w in value.items()}
    if any(not 0.0 <= weight <= 1e6 for weight in weights.values()):
        raise SettingsError(f"block_weights: expected numbers from 0 to 1e6, got {value!r}")
    return weights


_KINDS: dict[Any, str] = {
    bool: "true or false", int: "a whole number", float: "a number", str: "text",
    "hidden": "a list of widths", "masked_joints": "a list of names",
    "stages": "tables with frames and share", "block_weights": "a table of numbers by block",
    "tuning": "a table",
}  # fmt: skip


def _checked(key: str, value: Any, ranges: dict[str, tuple[float, float]]) -> Any:
    if key in CHOICES and value not in CHOICES[key]:
        raise SettingsError(f"{key}: '{value}' is none of {', '.join(CHOICES[key])}")
    if key in ranges:
        low, high = ranges[key]
        # Written so that NaN is refused.
        if not low <= value <= high:
            raise SettingsError(f"{key}: {value} is not between {low:g} and {high:g}")
    return value


def _near(word: str, known: list[str]) -> str:
    near = difflib.get_close_matches(word, known, 1)
    return f"; did you mean '{near[0]}'?" if near else f"; known: {', '.join(known)}"


def _listed(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _listed(inner) for key, inner in value.items()}
    return [_listed(inner) for inner in value] if isinstance(value, list | tuple) else value
