"""How near a model's poses are to captured ones: one step, with its own pose fed back, and free.

Three questions, because models rank differently in each. One step: every row's pose is the clip's
own. Closed loop: the clip gives trajectory, gait and ground, the model its own pose and phase.
Free: the clip gives only what it does as a wish, and the model's controller walks.

The relative error is equation 3.1 of Segerstedt 2021: the mean over frames and joints of
|t − p| / |t|, t and p relative to the root. Alone it proves nothing (the pose before scores well),
so that poses which need no model stand beside every figure.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ambulo.character import Controller
from ambulo.evaluate.captured import CATEGORIES
from ambulo.evaluate.metrics import SKATE_HEIGHT, jerk, skate
from ambulo.evaluate.view import FPS, View, seen_from, turned, world
from ambulo.model import Model

Array = NDArray[np.floating]

SECONDS = (1, 2, 5)
# A joint nearer to the root than this has no relative error to speak of, metres.
NEAREST = 0.01
# Before a free run is measured, it follows the clip's first wish for so long, seconds.
SETTLE = 2.0
# Windows of five seconds that are kept to choose from, a split.
MOST_WINDOWS = 256
BASELINES = ("last pose", "last pose + velocity", "mean pose")


@dataclass(frozen=True)
class Clip:
    """A captured clip as rows of the model's layout; see `ambulo.data` for their columns."""

    name: str
    split: str
    """'training', 'validation', or another word under which its figures are summed."""
    read: Callable[[], tuple[Array, Sequence[tuple[int, int]]]]
    """Rows, and runs (first row, rows) of consecutive ones."""


@dataclass(frozen=True)
class Settings:
    """How much is looked at."""

    every: int = 5
    """Rows from one that is predicted in one step to the next."""
    windows: int = 128
    """Closed loops, a split."""
    free_windows: int = 24
    """Free runs, a split."""
    threads: int = 2
    seed: int = 0


def accuracy(
    model: Model,
    clips: Sequence[Clip],
    settings: Settings | None = None,
    on_progress: Callable[[float], None] | None = None,
) -> dict[str, Any]:
    """Measure a model on clips; all figures as plain values.

    Args:
        model: of any layout that this version controls.
        clips: what it is measured on.
        settings: how much is looked at.
        on_progress: called with the share of the work that is done.

    Returns:
        `splits`: for each split one_step, loop and free; `files`: one-step figures of each clip;
        `left_out`: reasons why clips were not used.
    """
    settings = settings or Settings()
    view, tell = View(model, settings.threads), on_progress or (lambda share: None)
    rng = np.random.default_rng(settings.seed)
    report: dict[str, Any] = {"files": [], "splits": {}, "left_out": []}
    splits = list(dict.fromkeys(clip.split for clip in clips))
    sums = {split: _Sums() for split in splits}
    with ThreadPoolExecutor(settings.threads) as pool:
        for number, clip in enumerate(clips):
            try:
                rows, runs = clip.read()
            except ValueError as error:
                report["left_out"].append(str(error))
                continue
            found = _one_step(view, rows, _looked_at(runs, settings.every), pool)
            report["files"].append({"name": clip.name, "split": clip.split, **_file(found)})
            sums[clip.split].add(found, rows, runs, rng)
            tell(0.5 * (number + 1) / len(clips))
        for number, split in enumerate(splits):
            if sums[split].found:
                report["splits"][split] = {
                    "one_step": _summary(sums[split].found),
                    "loop": _loop(view, sums[split].windows(settings.windows, rng), pool),
                    "free": _free(view, sums[split].windows(settings.free_windows, rng)),
                }
            tell(0.5 + 0.5 * (number + 1) / len(splits))
    return report


# -- one step ---------------------------------------------------------------------------------


def _looked_at(runs: Sequence[tuple[int, int]], every: int) -> NDArray[np.int_]:
    """Rows with a row before them in their run."""
    looked = [np.arange(first + 1, first + count, every) for first, count in runs]
    return np.concatenate(looked) if looked else np.zeros(0, int)


def _one_step(
    view: View, all_rows: Array, looked: NDArray[np.int_], pool: ThreadPoolExecutor
) -> dict[str, Array]:
    """Errors of rows, one number a row: of the model, and of poses that need none."""
    rows, before = all_rows[looked], all_rows[looked - 1, 2:6]
    x, y = view.input(rows), view.output(rows)
    predicted = view.predict(x, rows[:, 0], pool)
    true = view.positions(y)
    last, velocity = view.positions(x, "inputs"), view.velocities(x, "inputs")
    poses = {
        "model": view.positions(predicted),
        "last pose": last,
        # In the world, so that it is told where the root goes: nothing is left to predict.
        "last pose + velocity": _carried(last + velocity / FPS, before, rows[:, 2:6]),
        "mean pose": np.broadcast_to(view.mean_pose(), true.shape),
    }
    found: dict[str, Array] = {"category": rows[:, 1].astype(int)}
    reach = np.maximum(np.linalg.norm(true, axis=-1), NEAREST)
    for name, pose in poses.items():
        off = np.linalg.norm(pose - true, axis=-1)
        found[f"{name} relative"] = (off / reach).mean(axis=1)
        found[f"{name} cm"] = 100.0 * off.mean(axis=1)
    found["max cm"] = 100.0 * np.linalg.norm(poses["model"] - true, axis=-1).max(axis=1)
    ours, theirs = view.rotations(predicted), view.rotations(y)
    # Of the two quaternions of a rotation the nearer one; the chord is exact for small angles.
    chords = [np.linalg.norm(ours - sign * theirs, axis=-1) for sign in (1.0, -1.0)]
    angles = np.degrees(4.0 * np.arcsin(np.clip(0.5 * np.minimum(*chords), 0.0, 1.0)))
    found["rotation deg"] = angles.mean(axis=1)
    told, seen = view.contacts(predicted), view.contacts(y)
    found["true positive"] = (told & seen).sum(axis=1)
    found["told or seen"] = told.sum(axis=1) + seen.sum(axis=1)
    return found


def _carried(poses: Array, before: Array, now: Array) -> Array:
    """Poses from the roots before, heights from this row's ground, as these roots see them."""
    before = np.concatenate([before[:, :1], now[:, 1:2], before[:, 2:]], axis=1)
    return seen_from(world(poses, before), now)


def _file(found: dict[str, Array]) -> dict[str, Any]:
    relative = found["model relative"]
    return {
        "relative_error": float(relative.mean()),
        "relative_error_sd": float(relative.std()),
        "position_cm": float(found["model cm"].mean()),
        "baselines": {name: float(found[f"{name} relative"].mean()) for name in BASELINES},
    }


def _summary(found: dict[str, Array]) -> dict[str, Any]:
    off, category = found["model cm"], found["category"]
    gaits = {
        name: float(off[category == number].mean())
        for number, name in enumerate(CATEGORIES)
        if (category == number).any()
    }
    return {
        "rows": len(off),
        "relative_error": float(found["model relative"].mean()),
        "relative_error_sd": float(found["model relative"].std()),
        "position_cm": float(off.mean()),
        "position_cm_p95": float(np.percentile(off, 95)),
        "position_cm_max": float(found["max cm"].max()),
        "position_cm_by_gait": gaits,
        "rotation_deg": float(found["rotation deg"].mean()),
        "contact_f1": float(
            2.0 * found["true positive"].sum() / max(found["told or seen"].sum(), 1)
        ),
        "baselines": {
            name: {
                "relative_error": float(found[f"{name} relative"].mean()),
                "position_cm": float(found[f"{name} cm"].mean()),
            }
            for name in BASELINES
        },
    }


@dataclass
class _Sums:
    """What is kept of a split's clips: errors by row, and windows to run through."""

    found: dict[str, Array] = field(default_factory=dict)
    long: list[Array] = field(default_factory=list)
    seen: int = 0

    def add(
        self,
        found: dict[str, Array],
        rows: Array,
        runs: Sequence[tuple[int, int]],
        rng: np.random.Generator,
    ) -> None:
        before = self.found
        self.found = {
            key: np.concatenate([before[key], values]) if before else values
            for key, values in found.items()
        }
        length = max(SECONDS) * FPS + 1
        for first, count in runs:
            for _ in range(count // (2 * length) + (count >= length)):
                start = first + int(rng.integers(0, count - length + 1))
                self._keep(np.array(rows[start : start + length]), rng)

    def _keep(self, window: Array, rng: np.random.Generator) -> None:
        """As many as are ever asked for, each of all windows with the same chance."""
        self.seen += 1
        if len(self.long) < MOST_WINDOWS:
            self.long.append(window)
        elif (place := int(rng.integers(0, self.seen))) < MOST_WINDOWS:
            self.long[place] = window

    def windows(self, most: int, rng: np.random.Generator) -> Array:
        """(N, T, columns) windows of five seconds, at most so many."""
        chosen = rng.permutation(len(self.long))[:most]
        return np.array([self.long[i] for i in chosen])


# -- closed loop ------------------------------------------------------------------------------


def _loop(view: View, windows: Array, pool: ThreadPoolExecutor) -> dict[str, Any]:
    """The pose fed back along the clip's own trajectory, with the model's own phase."""
    if not len(windows):
        return {}
    true = np.stack([view.positions(view.output(w)) for w in windows])
    run = list(_steps(view, windows, pool))
    poses = np.stack([pose for pose, _, _ in run], axis=1)
    drift = np.stack([phase for _, phase, _ in run], axis=1) - windows[:, : len(run), 0]
    drift = np.abs((drift + 0.5) % 1.0 - 0.5)
    start = view.positions(view.input(windows[:, 0]), "inputs")
    velocity = view.velocities(view.input(windows[:, 0]), "inputs")
    report: dict[str, Any] = {"windows": len(windows)}
    for seconds in SECONDS:
        at = seconds * FPS - 1
        now = true[:, at]
        guesses = {
            "position_cm": poses[:, at],
            "last pose": start,
            "last pose + velocity": start + velocity * ((at + 1) / FPS),
            "mean pose": np.broadcast_to(view.mean_pose(), now.shape),
        }
        apart = {n: 100.0 * np.linalg.norm(pose - now, axis=-1) for n, pose in guesses.items()}
        off, far = {n: float(cm.mean()) for n, cm in apart.items()}, apart["position_cm"]
        report[f"{seconds} s"] = {
            "position_cm": off["position_cm"],
            "position_cm_p95": float(np.percentile(far, 95)),
            "position_cm_max": float(far.max()),
            "phase_error": float(drift[:, at].mean()),
            "baselines_cm": {name: off[name] for name in BASELINES},
        }
    count = poses.shape[1]
    ours = np.stack([world(poses[i], windows[i, :count, 2:6]) for i in range(len(windows))])
    theirs = np.stack(
        [world(true[i, :count], windows[i, :count, 2:6]) for i in range(len(windows))]
    )
    return report | _against(view, ours, theirs, windows[:, :count])


def _steps(
    view: View, windows: Array, pool: ThreadPoolExecutor
) -> Iterator[tuple[Array, Array, Array]]:
    """Pose from the root, phase and output, frame by frame, for all windows at once."""
    pose = slice(view.inputs["joint_position"].start, view.inputs["joint_position"].stop)
    rate = slice(view.inputs["joint_velocity"].start, view.inputs["joint_velocity"].stop)
    share = _share(view.model.tuning.get("pose_halflife", 1.0 / FPS))
    phase = windows[:, 0, 0].astype(float)
    fed: Array | None = None
    velocity = np.zeros(0)
    for frame in range(windows.shape[1]):
        rows = windows[:, frame]
        x = view.input(rows)
        if fed is not None:
            before = windows[:, frame - 1]
            # Heights count from the ground along this row's trajectory.
            told = fed - (rows[:, 3] - before[:, 3])[:, None, None] * np.array([0.0, 1.0, 0.0])
            x[:, pose] = (told * view.unit).reshape(len(rows), -1)
            x[:, rate] = (velocity / view.speed).reshape(len(rows), -1)
        y = view.predict(x, phase, pool)
        predicted, carried = view.positions(y), view.velocities(y)
        yield predicted, phase.copy(), y
        last, fed = fed, predicted
        if share < 1.0 and last is not None:
            # Where the pose before would have been carried, seen from this root.
            past = world(last, windows[:, frame - 1, 2:6]) + turned(carried, rows[:, 5]) / FPS
            fed = (1.0 - share) * seen_from(past, rows[:, 2:6]) + share * predicted
        velocity = carried
        phase = (phase + np.maximum(view.phase_rate(y), 0.0) / FPS) % 1.0


def _against(view: View, ours: Array, theirs: Array, rows: Array) -> dict[str, Any]:
    """Skate and jerk of motions in the world (N, T, J, 3), and of the capture's."""
    toes = [view.feet[1], view.feet[3]]
    columns = view.columns["output"]
    down = rows[:, :, columns][:, :, view.outputs["contacts"]][:, :, [1, 3]] > 0.5
    ground = rows[:, :, 3, None]
    found: dict[str, Any] = {}
    for name, motions in (("", ours), ("capture_", theirs)):
        above = motions[:, :, toes, 1] - ground
        floor = np.array([np.median(above[..., i][down[..., i]]) if down[..., i].any() else 0.0
                          for i in (0, 1)])  # fmt: skip
        slides = [
            skate(m[:, toes], a - floor, FPS).mean() for m, a in zip(motions, above, strict=True)
        ]
        found[f"{name}skate_cm_per_frame"] = float(np.mean(slides))
        found[f"{name}jerk_m_per_s3"] = float(np.mean([jerk(m, FPS).mean() for m in motions]))
    for what in ("skate_cm_per_frame", "jerk_m_per_s3"):
        found[f"{what.split('_')[0]}_ratio"] = found[what] / max(found[f"capture_{what}"], 1e-9)
    return found | {"skate_height_m": SKATE_HEIGHT}


# -- free -------------------------------------------------------------------------------------


def _free(view: View, windows: Array) -> dict[str, Any]:
    """The controller, asked for what the clip does: its smoothed velocity, facing and gait."""
    if not len(windows):
        return {}
    ours, true, off, turned, ratios = [], [], [], [], []
    poses: dict[str, list[Array]] = {name: [] for name in ("model", *BASELINES)}
    for window in windows:
        root, yaw = window[:, [2, 4]].astype(float), np.unwrap(window[:, 5].astype(float))
        wishes = _wishes(view, window, root, yaw)
        motion, way, facing = _walk(view.model, wishes, yaw[0])
        path = way - way[0]
        captured = root - root[0]
        off.append([np.linalg.norm(path[s * FPS - 1] - captured[s * FPS - 1]) for s in SECONDS])
        turned.append(np.abs((facing - yaw[: len(facing)] + np.pi) % (2 * np.pi) - np.pi).mean())
        gone = np.linalg.norm(np.diff(captured, axis=0), axis=1).sum()
        if gone > 1.0:
            ratios.append(np.linalg.norm(np.diff(path, axis=0), axis=1).sum() / gone)
        for name, pose in _free_poses(view, window, motion, way, facing).items():
            poses[name].append(pose)
        ours.append(motion)
        true.append(world(view.positions(view.output(window)), window[:, 2:6]))
    count = len(ours[0])
    return {
        "windows": len(windows),
        "path_error_m": dict(zip(map(str, SECONDS), np.mean(off, axis=0).tolist(), strict=True)),
        "heading_error_deg": float(np.degrees(np.mean(turned))),
        # A free run keeps its own time: the pose may be right and at another phase.
        "position_cm": _spread(poses["model"]),
        "baselines_cm": {name: _spread(poses[name])["mean"] for name in BASELINES},
        "distance_ratio": float(np.mean(ratios)) if ratios else None,
    } | _against(view, np.stack(ours), np.stack(true)[:, :count], _level(windows[:, :count]))


def _free_poses(
    view: View, window: Array, motion: Array, path: Array, facing: Array
) -> dict[str, Array]:
    """(T, J) distances in cm from the clip's pose of the same moment, seen from each one's root."""
    count = len(motion)
    roots = np.stack([path[:, 0], np.zeros(count), path[:, 1], facing], axis=1)
    now = view.positions(view.output(window))[:count]
    start = view.input(window[:1])
    first, velocity = view.positions(start, "inputs"), view.velocities(start, "inputs")
    seconds = (np.arange(count) + 1.0)[:, None, None] / FPS
    guesses = {
        "model": seen_from(motion, roots),
        "last pose": np.broadcast_to(first, now.shape),
        "last pose + velocity": first + velocity * seconds,
        "mean pose": np.broadcast_to(view.mean_pose(), now.shape),
    }
    return {name: 100.0 * np.linalg.norm(g - now, axis=-1) for name, g in guesses.items()}


def _spread(parts: Sequence[Array]) -> dict[str, float]:
    """Mean, 95th percentile and maximum over all frames and joints."""
    whole = np.concatenate([part.ravel() for part in parts])
    return {
        "mean": float(whole.mean()),
        "p95": float(np.percentile(whole, 95)),
        "max": float(whole.max()),
    }


def _level(windows: Array) -> Array:
    """The same rows on a floor at zero: a free run does not know the clip's ground."""
    windows = windows.copy()
    windows[..., 3] = 0.0
    return windows


def _wishes(view: View, window: Array, root: Array, yaw: Array) -> list[tuple[Array, Array, str]]:
    velocity = np.gradient(root, axis=0) * FPS
    kernel = np.hanning(31)
    kernel /= kernel.sum()
    padded = np.pad(velocity, ((15, 15), (0, 0)), mode="edge")
    smooth = np.stack([np.convolve(padded[:, i], kernel, "valid") for i in (0, 1)], axis=1)
    crouches = window[:, 1].astype(int) == CATEGORIES.index("crouch")
    facing = np.stack([np.sin(yaw), np.cos(yaw)], axis=1)
    return [
        (v, f, "crouch" if crouch else "auto")
        for v, f, crouch in zip(smooth, facing, crouches, strict=True)
    ]


def _walk(
    model: Model, wishes: list[tuple[Array, Array, str]], yaw: float
) -> tuple[Array, Array, Array]:
    """Joints and root (x, z) in the world, and facing, frame by frame."""
    character = Controller(model, facing=float(yaw), tuning={**model.tuning, "hold_feet": False})
    for _ in range(int(SETTLE * FPS)):
        velocity, facing, gait = wishes[0]
        character.step(1 / FPS, velocity.tolist(), gait=gait, facing=facing.tolist(), strafe=1.0)
    places, path, facings = [], [], []
    for velocity, facing, gait in wishes:
        x, _, z, now = character.root
        places.append(character.positions())
        path.append((x, z))
        facings.append(now)
        character.step(1 / FPS, velocity.tolist(), gait=gait, facing=facing.tolist(), strafe=1.0)
    return np.stack(places), np.array(path), np.array(facings)


def _share(halflife: float) -> float:
    """Share of the way to a target that a frame covers at a half-life in seconds."""
    return 1.0 if halflife <= 0.0 else float(1.0 - 0.5 ** (1.0 / FPS / halflife))
