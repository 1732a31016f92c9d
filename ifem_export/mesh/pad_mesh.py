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

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ifem_export.errors import MeshError
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
from ifem_export.mesh.lattice_box import LatticeBox, lattice_box
from ifem_export.mesh.outline import Outline

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
    box = lattice_box(outline, thickness_mm, cells, pitch_mm, layers, align_to_mm)
    occupancy, fill = filled_cells(outline, crown, box.planes_mm, weighting, floor)
    if not occupancy.any():
        raise _no_cell(box.cell_mm, weighting, floor)
    kept = keep_bonded_part(occupancy)
    share = None if fill is None else np.where(kept, fill, 0.0)
    flat = _cropped(box, thickness_mm, kept, share)
    plan = kept.any(axis=2) if share is None else share.max(axis=2)
    report = CropReport(
        n_cells_inside=int(occupancy.sum()),
        n_cells_kept=int(kept.sum()),
        outline_area_mm2=outline.area_mm2,
        mesh_area_mm2=float(plan.sum() * box.cell_mm[0] * box.cell_mm[1]),
        aligned_points=box.aligned_points,
        alignment_error_mm=box.alignment_error_mm,
    )
    if crown is None:
        return flat, report
    require_thick(outline, crown, thickness_mm, flat.layers, (box.x, box.y))
    if weighting == "cell_centre":
        return flat.crowned(None), report
    levels = crown_levels(crown, flat.occupancy.shape, flat.origin_mm, flat.cell_size_mm)
    return flat.crowned(levels), report


def _cropped(
    box: LatticeBox,
    thickness_mm: float,
    kept: NDArray[np.bool_],
    share: NDArray[np.float64] | None,
) -> PadMesh:
    """The mesh of the cells that are kept, with a flat surface."""
    window, first = _trim(kept)
    hx, hy, hz = box.cell_mm
    mesh = PadMesh.from_occupancy(
        np.ascontiguousarray(kept[window]),
        (hx, hy, hz),
        (box.x[first[0]], box.y[first[1]], -thickness_mm),
        None if share is None else share[window],
    )
    return _with_exact_faces(mesh, thickness_mm)


def _no_cell(cell_mm: NDArray[np.float64], weighting: Weighting, floor: float) -> MeshError:
    """The error of a lattice without a cell in the outline."""
    by_centre = weighting == "cell_centre"
    lacking = "has its centre" if by_centre else f"is filled by {floor:g} or more"
    return MeshError(
        f"no cell of the {cell_mm[0]:g} x {cell_mm[1]:g} mm lattice {lacking} inside the "
        "outline: use a finer pitch",
        field="pitch_mm",
        value=(float(cell_mm[0]), float(cell_mm[1])),
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
