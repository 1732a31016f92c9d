"""Random contacts for the tests of batches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gelslim_twin.stepping.step_batch import StepBatch

Array = NDArray[np.float64]


def contacts(
    count: int,
    height_mm: float,
    *,
    depths_mm: Sequence[float] = (0.05, 0.4),
    reach_mm: float = 4.0,
    tilt_deg: float = 0.0,
    seed: int = 5,
) -> Array:
    """Rigid motions (count, 4, 4) of a body whose lowest point is `height_mm` below its origin."""
    rng = np.random.default_rng(seed)
    found = np.tile(np.eye(4), (count, 1, 1))
    found[:, :2, 3] = rng.uniform(-reach_mm, reach_mm, (count, 2))
    found[:, 2, 3] = height_mm - rng.uniform(*depths_mm, count)
    angles = np.column_stack(
        [rng.uniform(-tilt_deg, tilt_deg, (count, 2)), rng.uniform(-180, 180, count)]
    )
    found[:, :3, :3] = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
    return found


def apart(one: StepBatch, other: StepBatch) -> Array:
    """Largest difference (n,) of the nodal forces, over the largest force of the same contact."""
    size = np.abs(one.force_n).max(axis=(1, 2))
    off = np.abs(one.force_n - other.force_n).max(axis=(1, 2))
    return np.asarray(off / np.where(size > 0, size, 1.0))
