"""Uniform Hex-8 mesh of the gel pad, cropped to its outline.

As in the GelSlim 2.0 paper, a box slightly larger than the gel is meshed with equal elements and
then cropped to the gel. z runs from -thickness (bonded to the acrylic) to 0 (outer surface).

The paper prints "1964 elements with 3698 nodes" for its one-layer mesh. 3698 nodes are two
layers of 1849 = 43 x 43, and 43 x 43 nodes bound 42 x 42 = 1764 elements. A one-layer mesh has
fewer elements than nodes per layer, so 1964 is a misprint of 1764.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ifem_export.errors import MeshError
from ifem_export.mesh.alignment import aligned_start, points_in_plane
from ifem_export.mesh.crop import (
    DEFAULT_FLOOR,
    CropReport,
    Weighting,
    filled_cells,
    keep_bonded_part,
)
from ifem_export.mesh.crown import Crown, crown_levels, require_thick, surface_of
from ifem_export.mesh.lattice import (
    Numbering,
    checked_cell_size,
    hexahedra,
    node_coordinates,
    node_sets,
    number_nodes,
)
from ifem_export.mesh.outline import Outline

_MAX_CELLS = 10_000_000
_ARRAYS = ("nodes_mm", "hexes", "bonded", "surface", "sides", "occupancy", "fill", "surface_shift")


@dataclass(frozen=True, eq=False)
class PadMesh:
    """Cropped uniform mesh of 8-node hexahedra; its arrays are read-only.

    Attributes:
        nodes_mm: (n, 3) node coordinates.
        hexes: (m, 8) int32 corner nodes in VTK_HEXAHEDRON order.
        bonded: int32 nodes fixed to the acrylic (lowest face).
        surface: int32 nodes of the outer surface.
        sides: int32 nodes of the lateral faces, rims included.
        cell_size_mm: (hx, hy, hz).
        origin_mm: (x, y, z) of the lowest corner of the lattice box.
        occupancy: (nx, ny, nz) bool, the cells of the lattice box that exist.
        fill: (nx, ny, nz) factor that scales each cell's stiffness; None where all are full.
        surface_shift: (s,) height of a crowned outer surface above its nodes in cells, from -1/2
            to 1/2 (see `ifem_export.mesh.crown`); None for a flat surface.
    """

    nodes_mm: NDArray[np.float64]
    hexes: NDArray[np.int32]
    bonded: NDArray[np.int32]
    surface: NDArray[np.int32]
    sides: NDArray[np.int32]
    cell_size_mm: tuple[float, float, float]
    origin_mm: tuple[float, float, float]
    occupancy: NDArray[np.bool_]
    fill: NDArray[np.float64] | None = None
    surface_shift: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        for name in _ARRAYS:
            array = getattr(self, name)
            if array is not None and array.flags.writeable:
                view = array.view()
                view.flags.writeable = False
                object.__setattr__(self, name, view)

    @classmethod
    def from_occupancy(
        cls,
        occupancy: NDArray[np.bool_],
        cell_size_mm: Sequence[float],
        origin_mm: Sequence[float],
        fill: NDArray[np.float64] | None = None,
    ) -> PadMesh:
        """Flat mesh of all existing cells, connected or not.

        Args:
            occupancy: (nx, ny, nz) bool.
            cell_size_mm: (hx, hy, hz), > 0.
            origin_mm: (x, y, z) of the lowest corner of the lattice box.
            fill: (nx, ny, nz) factor of each cell's stiffness, > 0 where the cell exists.

        Raises:
            MeshError: A size is not positive and finite, or no cell exists.
        """
        size = checked_cell_size(cell_size_mm)
        origin = np.array(origin_mm, dtype=float)
        if origin.shape != (3,) or not np.isfinite(origin).all():
            raise MeshError(
                f"origin_mm = {tuple(origin_mm)}: must be three finite numbers", field="origin_mm"
            )
        numbering = number_nodes(occupancy)
        sets = node_sets(occupancy, numbering)
        return cls(
            nodes_mm=node_coordinates(numbering, origin, size),
            hexes=hexahedra(occupancy, numbering),
            bonded=sets["bonded"],
            surface=sets["surface"],
            sides=sets["sides"],
            cell_size_mm=(float(size[0]), float(size[1]), float(size[2])),
            origin_mm=(float(origin[0]), float(origin[1]), float(origin[2])),
            occupancy=occupancy.copy(),
            fill=None if fill is None else fill.copy(),
        )

    def crowned(self, levels: NDArray[np.float64] | None) -> PadMesh:
        """The same cells with one surface node per column.

        Args:
            levels: (ny + 1, nx + 1) height of the outer surface in layers; None puts it on the
                highest nodes.

        Raises:
            MeshError: A column has a gap.
        """
        surface, shift = surface_of(np.asarray(self.occupancy), self.numbering, levels)
        return replace(self, surface=surface, surface_shift=shift)

    def stretched(self, ratio: float) -> PadMesh:
        """The same cells with their heights times `ratio`; z = 0 stays where it is.

        Raises:
            MeshError: The ratio is not positive and finite.
        """
        if not (math.isfinite(ratio) and ratio > 0):
            raise MeshError(
                f"thickness ratio = {ratio!r}: must be a finite number > 0", field="ratio"
            )
        (hx, hy, hz), (x, y, z) = self.cell_size_mm, self.origin_mm
        return replace(
            self,
            nodes_mm=self.nodes_mm * [1.0, 1.0, ratio],
            cell_size_mm=(hx, hy, hz * ratio),
            origin_mm=(x, y, z * ratio),
        )

    @property
    def n_nodes(self) -> int:
        """Number of nodes n."""
        return len(self.nodes_mm)

    @property
    def n_elements(self) -> int:
        """Number of elements m."""
        return len(self.hexes)

    @property
    def surface_mm(self) -> NDArray[np.float64]:
        """Points (s, 3) of the outer surface at its nodes."""
        points = np.array(self.nodes_mm[self.surface])
        if self.surface_shift is not None:
            points[:, 2] += self.surface_shift * self.cell_size_mm[2]
        return points

    @property
    def layers(self) -> int:
        """Layers of cells through the thickness."""
        return int(self.occupancy.shape[2])

    @cached_property
    def free(self) -> NDArray[np.int32]:
        """Sorted int32 nodes that are not bonded."""
        is_free = np.ones(self.n_nodes, dtype=bool)
        is_free[self.bonded] = False
        return np.flatnonzero(is_free).astype(np.int32)

    @cached_property
    def numbering(self) -> Numbering:
        """Node numbers of the lattice, computed from the occupancy."""
        return number_nodes(np.asarray(self.occupancy))


def build_pad_mesh(
    outline: Outline,
    thickness_mm: float,
    *,
    cells: tuple[int, int, int] | None = None,
    pitch_mm: float | tuple[float, float] | None = None,
    layers: int = 1,
    align_to_mm: ArrayLike | None = None,
    crown: Crown | None = None,
    weighting: Weighting = "cell_centre",
    floor: float = DEFAULT_FLOOR,
) -> tuple[PadMesh, CropReport]:
    """Mesh the gel inside `outline`, from z = -thickness (bonded) to z = 0 (surface).

    Args:
        outline: The gel seen from above.
        thickness_mm: Thickness of the gel, > 0; of a crowned gel at its apex.
        cells: (nx, ny, nz) cells along the sides of the outline's bounding box and through the
            thickness. Exactly one of `cells` and `pitch_mm` is given.
        pitch_mm: Cell size, one number or (hx, hy); the lattice is centred on the outline.
        layers: Layers through the thickness if `pitch_mm` is given.
        align_to_mm: (k, 2) or (k, 3) points (markers); the lattice is shifted so that as many of
            them as possible coincide with surface nodes, and the report tells how many do.
        crown: Outer surface of a crowned gel; None for a flat one at z = 0.
        weighting: Treatment of cells that the outline or the crown cuts: "cell_centre" keeps or
            drops them as a whole, "volume_fraction" scales their stiffness.
        floor: Filled fraction below which "volume_fraction" drops a cell.

    Returns:
        The mesh, and the report of what the cropping did.

    Raises:
        MeshError: A size is out of range, the lattice has too many cells, or no cell is inside
            the outline.
    """
    if not math.isfinite(thickness_mm) or thickness_mm <= 0.0:
        raise MeshError(
            f"thickness_mm = {thickness_mm!r}: must be a finite number > 0",
            field="thickness_mm",
            value=thickness_mm,
        )
    x_min, y_min, x_max, y_max = outline.bounds_mm
    extent = np.array([x_max - x_min, y_max - y_min])
    pitch, n_across, n_layers = _lattice_pitch(extent, cells, pitch_mm, layers)
    centre = np.array([x_min + x_max, y_min + y_max]) / 2.0
    start = centre - n_across * pitch / 2.0
    aligned, error = 0, 0.0
    if align_to_mm is not None:
        points = points_in_plane(align_to_mm, "align_to_mm")
        start, aligned, error = aligned_start(points, start, pitch)
    # With one spare cell on each side the box contains the gel, however the lattice is shifted.
    low = np.floor((np.array([x_min, y_min]) - start) / pitch).astype(int) - 1
    high = np.ceil((np.array([x_max, y_max]) - start) / pitch).astype(int) + 1
    _check_count(high - low, n_layers)
    hz = thickness_mm / n_layers
    x = np.asarray(start[0] + np.arange(low[0], high[0] + 1) * pitch[0], dtype=np.float64)
    y = np.asarray(start[1] + np.arange(low[1], high[1] + 1) * pitch[1], dtype=np.float64)
    z = np.asarray(np.arange(-n_layers, 1) * hz, dtype=np.float64)
    occupancy, fill = filled_cells(outline, crown, (x, y, z), weighting, floor)
    if not occupancy.any():
        raise _no_cell(pitch, weighting, floor)
    kept = keep_bonded_part(occupancy)
    share = None if fill is None else np.where(kept, fill, 0.0)
    window, first = _trim(kept)
    corner = start + (low + first) * pitch
    mesh = PadMesh.from_occupancy(
        np.ascontiguousarray(kept[window]),
        (pitch[0], pitch[1], hz),
        (corner[0], corner[1], -thickness_mm),
        None if share is None else share[window],
    )
    plan = kept.any(axis=2) if share is None else share.max(axis=2)
    report = CropReport(
        n_cells_inside=int(occupancy.sum()),
        n_cells_kept=int(kept.sum()),
        outline_area_mm2=outline.area_mm2,
        mesh_area_mm2=float(plan.sum() * pitch[0] * pitch[1]),
        aligned_points=aligned,
        alignment_error_mm=error,
    )
    mesh = _with_exact_faces(mesh, thickness_mm)
    if crown is None:
        return mesh, report
    require_thick(outline, crown, thickness_mm, n_layers, (x, y))
    if weighting == "cell_centre":
        return mesh.crowned(None), report
    levels = crown_levels(crown, mesh.occupancy.shape, mesh.origin_mm, mesh.cell_size_mm)
    return mesh.crowned(levels), report


def _no_cell(pitch_mm: NDArray[np.float64], weighting: Weighting, floor: float) -> MeshError:
    """The error of a lattice without a cell in the outline."""
    by_centre = weighting == "cell_centre"
    lacking = "has its centre" if by_centre else f"is filled by {floor:g} or more"
    return MeshError(
        f"no cell of the {pitch_mm[0]:g} x {pitch_mm[1]:g} mm lattice {lacking} inside the "
        "outline: use a finer pitch",
        field="pitch_mm",
        value=(float(pitch_mm[0]), float(pitch_mm[1])),
    )


def _lattice_pitch(
    extent_mm: NDArray[np.float64],
    cells: tuple[int, int, int] | None,
    pitch_mm: float | tuple[float, float] | None,
    layers: int,
) -> tuple[NDArray[np.float64], NDArray[np.int64], int]:
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


def _trim(
    occupancy: NDArray[np.bool_],
) -> tuple[tuple[slice, slice], NDArray[np.int64]]:
    """Smallest x-y box that contains all cells, and its first cell (i, j)."""
    along_x = np.flatnonzero(occupancy.any(axis=(1, 2)))
    along_y = np.flatnonzero(occupancy.any(axis=(0, 2)))
    window = (slice(along_x[0], along_x[-1] + 1), slice(along_y[0], along_y[-1] + 1))
    return window, np.array([along_x[0], along_y[0]])


def _with_exact_faces(mesh: PadMesh, thickness_mm: float) -> PadMesh:
    """The same mesh with its upper nodes at exactly z = 0, without rounding."""
    nodes = np.array(mesh.nodes_mm)
    nz = mesh.layers
    level = np.rint((nodes[:, 2] + thickness_mm) / thickness_mm * nz)
    nodes[:, 2] = (level - nz) / nz * thickness_mm
    return replace(mesh, nodes_mm=nodes)
