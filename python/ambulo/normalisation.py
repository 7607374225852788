"""How loud each number is to the network: means a column, deviations averaged over blocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ambulo.data import Dataset, Rows


@dataclass(frozen=True)
class Normalisation:
    """The network sees (x − input_mean) / input_std and gives (y − output_mean) / output_std."""

    input_mean: Rows
    input_std: Rows
    output_mean: Rows
    output_std: Rows
    pose_std: Rows
    """Deviations of the input's joint positions and velocities before they are weighted."""


# Deviation of an input that the network is not to see: float32 still divides by it.
HIDDEN = 1e10


def normalisation(
    dataset: Dataset,
    *,
    joint_weight: float = 1.0,
    masked_joints: tuple[str, ...] = (),
    floor: float = 1e-4,
    hide_constant: bool = True,
) -> Normalisation:
    """Means a column, deviations averaged over blocks, as the authors have them.

    A deviation a column would make the smallest motion of a stiff joint as loud as a step.

    Args:
        dataset: whose statistics are used.
        joint_weight: how loud the input's joints are: their deviation is divided by it (0.1 in
            the published network).
        masked_joints: names of joints whose input is hidden.
        floor: the least deviation, in the layout's units.
        hide_constant: hide input columns that never change in training: what they would do to the
            network, once they do change, nobody has taught it.
    """
    stats = dataset.statistics
    x_std, y_std = (
        _averaged(dataset.blocks[side], getattr(stats, name), floor)
        for side, name in (("inputs", "input_std"), ("outputs", "output_std"))
    )
    pose = [dataset.blocks["inputs"][name] for name in ("joint_position", "joint_velocity")]
    pose_std = np.concatenate([x_std[block] for block in pose])
    masked = np.repeat(np.isin(dataset.joints, masked_joints), 3)
    for block in pose:
        x_std[block] /= joint_weight
        x_std[block][masked] = HIDDEN
    if hide_constant:
        x_std[stats.input_std < floor] = HIDDEN
    return Normalisation(stats.input_mean, x_std, stats.output_mean, y_std, pose_std)


def _averaged(blocks: dict[str, slice], std: Rows, floor: float) -> Rows:
    groups: dict[str, list[int]] = {}
    outputs = "root_velocity" in blocks
    for name, block in blocks.items():
        groups.setdefault(_group(name, outputs), []).extend(range(block.start, block.stop))
    averaged = np.empty_like(std)
    for columns in groups.values():
        averaged[columns] = std[columns].mean(dtype=np.float64)
    return np.maximum(averaged, floor).astype(np.float32)


def _group(name: str, outputs: bool) -> str:
    """Blocks of one group share a deviation, as in the published training."""
    kind = name.split("_")[0]
    together = ("gait", "terrain", *(("trajectory", "direction") if outputs else ()))
    return kind if kind in together else name
