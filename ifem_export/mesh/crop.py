"""Cropping: which cells of a lattice belong to the pad, and how full they are.

A cell that the outline or the crown cuts is treated in one of two ways. By cell centre it is kept
or dropped as a whole; this moves the boundary by up to half a cell at random. By volume fraction
its stiffness is scaled by its filled fraction; this keeps area and volume, and with them the
resultant forces.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from ifem_export.errors import MeshError
from ifem_export.mesh.crown import Crown
from ifem_export.mesh.outline import Outline

Array = NDArray[np.float64]
Weighting = Literal["cell_centre", "volume_fraction"]
WEIGHTINGS: tuple[Weighting, ...] = get_args(Weighting)
DEFAULT_FLOOR = 0.01
"""Cells filled less are dropped: they carry almost no force and slow the iterations down."""
_PROBES, _SAMPLES, _SAMPLES_INSIDE = 3, 32, 8


@dataclass(frozen=True)
class CropReport:
    """Result of cropping the lattice to the outline.

    Attributes:
        n_cells_inside: Cells inside the outline.
        n_cells_kept: Cells of the largest face-connected part that reaches the bonded face.
        outline_area_mm2: Exact area of the outline.
        mesh_area_mm2: Area of the kept cells seen from above.
        aligned_points: Number of alignment points that coincide with surface nodes.
        alignment_error_mm: Largest distance of such a point, along an axis, from the nearest
            lattice line (0 without alignment).
    """

    n_cells_inside: int
    n_cells_kept: int
    outline_area_mm2: float
    mesh_area_mm2: float
    aligned_points: int = 0
    alignment_error_mm: float = 0.0

    @property
    def area_error(self) -> float:
        """Relative error of the meshed area, (mesh - outline) / outline."""
        return (self.mesh_area_mm2 - self.outline_area_mm2) / self.outline_area_mm2


def filled_cells(
    outline: Outline,
    crown: Crown | None,
    edges_mm: tuple[Array, Array, Array],
    weighting: Weighting = "cell_centre",
    floor: float = DEFAULT_FLOOR,
) -> tuple[NDArray[np.bool_], Array | None]:
    """Cells of a lattice that the gel fills.

    Args:
        outline: The gel seen from above.
        crown: Its outer surface; None for a flat one at the lattice's upper face.
        edges_mm: Equally spaced cell boundaries along x, y and z.
        weighting: "cell_centre" keeps the cells whose centre is in the gel, "volume_fraction"
            those filled by at least `floor`.
        floor: Smallest filled fraction of a kept cell, 0 < floor <= 1.

    Returns:
        The occupancy (nx, ny, nz), and the filled fraction of each kept cell with 0 elsewhere
        (None for weighting by cell centre).

    Raises:
        MeshError: The weighting is unknown or the floor is out of range.
    """
    if weighting not in WEIGHTINGS:
        raise MeshError(
            f"weighting {weighting!r}: must be one of {', '.join(WEIGHTINGS)}",
            field="weighting",
            value=weighting,
        )
    if not 0.0 < floor <= 1.0:
        raise MeshError(
            f"weighting floor = {floor!r}: must be > 0 and <= 1", field="floor", value=floor
        )
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
        (_SAMPLES, _possibly_cut(probes)),
        (_SAMPLES_INSIDE, (probes == 1.0) & ~_possibly_cut(probes)),
    ):
        i, j = np.nonzero(chosen)
        fraction[i, j] = _sampled(outline, crown, (x, y, z), i, j, samples)
    occupancy = fraction >= floor
    return occupancy, np.where(occupancy, fraction, 0.0)


def _probed(outline: Outline, x: Array, y: Array) -> Array:
    """Share (nx, ny) of 3 x 3 points on each cell's corners, sides and centre that lie inside."""
    at = np.linspace(0.0, 1.0, _PROBES)
    px = x[:-1, None] + at * np.diff(x)[:, None]
    py = y[:-1, None] + at * np.diff(y)[:, None]
    inside = outline.contains(px[:, None, :, None], py[None, :, None, :])
    return np.asarray(inside.mean(axis=(2, 3)))


def _possibly_cut(probes: Array) -> NDArray[np.bool_]:
    """Cells that the outline may cut: those with probes on both sides, and their neighbours."""
    mixed = np.pad((probes > 0.0) & (probes < 1.0), 1)
    # An outline along cell boundaries leaves full cells next to empty ones, none of them mixed.
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
    """Filled fractions (n, nz) of the n columns (i, j): midpoint rule in x and y, exact in z."""
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


def keep_bonded_part(occupancy: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Keep the largest face-connected part that reaches the bonded face (lowest layer).

    Two parts that share only an edge or a vertex would rotate about it without any stiffness. Of
    equally large parts the first in lattice order is kept.

    Args:
        occupancy: (nx, ny, nz) bool.

    Raises:
        MeshError: No cell lies on the bonded face.
    """
    labels, n_parts = ndimage.label(occupancy, ndimage.generate_binary_structure(3, 1))
    sizes = np.bincount(labels.ravel(), minlength=n_parts + 1)
    bonded = np.unique(labels[:, :, 0])
    bonded = bonded[bonded > 0]
    if len(bonded) == 0:
        raise MeshError(
            "no cell lies on the bonded face: use a finer pitch or check the outline",
            field="occupancy",
        )
    return np.asarray(labels == bonded[np.argmax(sizes[bonded])])
