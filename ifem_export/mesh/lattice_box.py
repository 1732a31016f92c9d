"""The lattice of equal cells that covers an outline: size of its cells, their number and place."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ifem_export.errors import MeshError
from ifem_export.mesh.alignment import aligned_start, points_in_plane
from ifem_export.mesh.outline import Outline

Array = NDArray[np.float64]
_MAX_CELLS = 10_000_000


@dataclass(frozen=True, eq=False)
class LatticeBox:
    """Planes between cells, with at least one spare cell on each side of the outline.

    Attributes:
        cell_mm: (hx, hy, hz).
        x, y, z: Planes in mm; z from -thickness to 0.
        aligned_points: Points that coincide with nodes of the surface.
        alignment_error_mm: Largest distance of these from their nodes.
    """

    cell_mm: Array
    x: Array
    y: Array
    z: Array
    aligned_points: int
    alignment_error_mm: float

    @property
    def planes_mm(self) -> tuple[Array, Array, Array]:
        """Planes in x, y and z."""
        return self.x, self.y, self.z


def lattice_box(
    outline: Outline,
    thickness_mm: float,
    cells: tuple[int, int, int] | None,
    pitch_mm: float | tuple[float, float] | None,
    layers: int,
    align_to_mm: ArrayLike | None,
) -> LatticeBox:
    """Cover an outline; arguments as in `build_pad_mesh`.

    Raises:
        MeshError: A size is out of range, or the lattice has too many cells.
    """
    if not math.isfinite(thickness_mm) or thickness_mm <= 0.0:
        raise MeshError(
            f"thickness_mm = {thickness_mm!r}: must be a finite number > 0",
            field="thickness_mm",
            value=thickness_mm,
        )
    bounds = np.reshape(outline.bounds_mm, (2, 2))
    pitch, n_across, n_layers = _pitch(bounds[1] - bounds[0], cells, pitch_mm, layers)
    start = (bounds[0] + bounds[1]) / 2.0 - n_across * pitch / 2.0
    aligned, error = 0, 0.0
    if align_to_mm is not None:
        points = points_in_plane(align_to_mm, "align_to_mm")
        start, aligned, error = aligned_start(points, start, pitch)
    # With one spare cell on each side the box contains the gel, however the lattice is shifted.
    low = np.floor((bounds[0] - start) / pitch).astype(int) - 1
    high = np.ceil((bounds[1] - start) / pitch).astype(int) + 1
    _check_count(high - low, n_layers)
    x, y = (start[k] + np.arange(low[k], high[k] + 1) * pitch[k] for k in range(2))
    cell_mm = np.array([*pitch, thickness_mm / n_layers])
    z = np.arange(-n_layers, 1) * cell_mm[2]
    return LatticeBox(cell_mm, x, y, z, aligned, error)


def _pitch(
    extent_mm: Array,
    cells: tuple[int, int, int] | None,
    pitch_mm: float | tuple[float, float] | None,
    layers: int,
) -> tuple[Array, NDArray[np.int64], int]:
    """Cell size (hx, hy), cells along the sides of the bounding box, and layers."""
    if (cells is None) == (pitch_mm is None):
        raise MeshError("give exactly one of cells=(nx, ny, nz) and pitch_mm", field="cells")
    if cells is not None:
        if len(cells) != 3 or any(int(c) != c or c < 1 for c in cells):
            raise MeshError(f"cells = {cells}: must be three whole numbers >= 1", field="cells")
        across = np.array(cells[:2], dtype=np.int64)
        return extent_mm / across, across, int(cells[2])
    if int(layers) != layers or layers < 1:
        raise MeshError(f"layers = {layers!r}: must be a whole number >= 1", field="layers")
    pitch = np.broadcast_to(np.asarray(pitch_mm, dtype=float), (2,)).copy()
    if not np.isfinite(pitch).all() or (pitch <= 0.0).any():
        raise MeshError(f"pitch_mm = {pitch_mm!r}: must be finite and > 0", field="pitch_mm")
    # Checked before the cast: a tiny pitch would overflow the count.
    _check_count(extent_mm / pitch, int(layers))
    return pitch, np.maximum(np.rint(extent_mm / pitch), 1).astype(np.int64), int(layers)


def _check_count(across: NDArray[Any], layers: int) -> None:
    total = float(across[0]) * float(across[1]) * layers
    if total > _MAX_CELLS:
        raise MeshError(
            f"the lattice would have {total:.3g} cells, the limit is {_MAX_CELLS}: "
            "use a coarser pitch or fewer layers",
            field="pitch_mm",
            value=total,
        )
