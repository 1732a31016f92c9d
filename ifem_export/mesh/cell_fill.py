"""How much of each lattice cell the gel fills.

A cell that outline or crown cuts is either kept whole or dropped by its centre, or kept with its
stiffness scaled by the filled fraction of its volume. The first moves the boundary by up to half a
cell at random; the second keeps area and volume, and with them what the resultants follow.
"""

from __future__ import annotations

import itertools
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ifem_export.errors import MeshError
from ifem_export.mesh.crown import Crown
from ifem_export.mesh.outline import Outline

Array = NDArray[np.float64]
Weighting = Literal["cell_centre", "volume_fraction"]
WEIGHTINGS: tuple[Weighting, ...] = get_args(Weighting)
DEFAULT_FLOOR = 0.01
"""Emptier cells are dropped: they bear next to nothing and slow iterations down."""
_PROBES, _SAMPLES, _SAMPLES_INSIDE = 3, 32, 8


def filled_cells(
    outline: Outline,
    crown: Crown | None,
    edges_mm: tuple[Array, Array, Array],
    weighting: Weighting = "cell_centre",
    floor: float = DEFAULT_FLOOR,
) -> tuple[NDArray[np.bool_], Array | None]:
    """Cells of a lattice that the gel fills.

    Args:
        outline: the gel seen from above.
        crown: its outer surface; None is flat at the lattice's upper face.
        edges_mm: equally spaced cell boundaries along x, y and z.
        weighting: "cell_centre" keeps cells whose centre is in the gel, "volume_fraction"
            those filled by at least `floor`.
        floor: 0 < floor <= 1.

    Returns:
        The occupancy (nx, ny, nz) and the filled fraction of each kept cell, 0 elsewhere; None
        by cell centres.

    Raises:
        MeshError: unknown weighting or a floor out of range.
    """
    if weighting not in WEIGHTINGS:
        raise MeshError(f"weighting {weighting!r}: must be one of {', '.join(WEIGHTINGS)}")
    if not 0.0 < floor <= 1.0:
        raise MeshError(f"weighting floor = {floor!r}: must be > 0 and <= 1")
    x, y, z = edges_mm
    if weighting == "cell_centre":
        mid_x, mid_y, mid_z = ((e[1:] + e[:-1]) / 2 for e in edges_mm)
        inside = outline.contains(mid_x[:, None], mid_y[None, :])
        if crown is None:
            return np.repeat(inside[:, :, None], len(mid_z), axis=2), None
        height = crown.height_mm(mid_x[:, None], mid_y[None, :])
        return inside[:, :, None] & (mid_z <= height[:, :, None]), None
    fraction = np.zeros((len(x) - 1, len(y) - 1, len(z) - 1))
    probes = _probed(outline, x, y)
    for samples, chosen in (
        (_SAMPLES, _grown(probes)),
        (_SAMPLES_INSIDE, (probes == 1.0) & ~_grown(probes)),
    ):
        i, j = np.nonzero(chosen)
        fraction[i, j] = _sampled(outline, crown, (x, y, z), i, j, samples)
    occupancy = fraction >= floor
    return occupancy, np.where(occupancy, fraction, 0.0)


def _probed(outline: Outline, x: Array, y: Array) -> Array:
    """Share of 3 x 3 points on corners, sides and centre that lie inside; (nx, ny)."""
    at = np.linspace(0.0, 1.0, _PROBES)
    px = x[:-1, None] + at * np.diff(x)[:, None]
    py = y[:-1, None] + at * np.diff(y)[:, None]
    inside = outline.contains(px[:, None, :, None], py[None, :, None, :])
    return np.asarray(inside.mean(axis=(2, 3)))


def _grown(probes: Array) -> NDArray[np.bool_]:
    """Cells that the outline may cut: mixed ones and their neighbours."""
    mixed = np.pad((probes > 0.0) & (probes < 1.0), 1)
    # An outline that runs along cell boundaries leaves full and empty cells side by side.
    full, empty = np.pad(probes == 1.0, 1), np.pad(probes == 0.0, 1, constant_values=True)
    near = np.zeros(probes.shape, dtype=bool)
    nx, ny = probes.shape
    for dx in (0, 1, 2):
        for dy in (0, 1, 2):
            window = (slice(dx, dx + nx), slice(dy, dy + ny))
            near |= mixed[window] | (full[window] & (probes == 0.0))
            near |= empty[window] & (probes == 1.0)
    return near


def _sampled(
    outline: Outline,
    crown: Crown | None,
    edges_mm: tuple[Array, Array, Array],
    i: NDArray[np.int64],
    j: NDArray[np.int64],
    samples: int,
) -> Array:
    """Filled fractions (cells, nz) of columns (i, j), by midpoints across, exact along z."""
    x, y, z = edges_mm
    at = (np.arange(samples) + 0.5) / samples
    px = (x[i, None] + at * (x[1] - x[0]))[:, :, None]
    py = (y[j, None] + at * (y[1] - y[0]))[:, None, :]
    inside = outline.contains(px, py)
    if crown is None:
        return np.repeat(inside.mean(axis=(1, 2))[:, None], len(z) - 1, axis=1)
    height = crown.height_mm(px, py)
    layers = [
        (inside * np.clip((height - low) / (high - low), 0.0, 1.0)).mean(axis=(1, 2))
        for low, high in itertools.pairwise(z)
    ]
    return np.stack(layers, axis=1)
