"""The markers of a sensor and the interpolation from them to the surface nodes."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from ifem_export.errors import IfemError
from ifem_export.markers.interpolation import marker_to_node
from ifem_export.markers.interpolation_matrix import MarkerInterpolation, filled_sparse
from ifem_export.markers.thin_plate import MOST_MARKERS, ThinPlate, thin_plate
from ifem_export.mesh.pad_mesh import PadMesh

Array = NDArray[np.float64]
MOST_STORED_BYTES = 128_000_000
"""A larger spline is not stored in the bundle."""


@dataclass(frozen=True, eq=False)
class MarkerField:
    """Markers and the interpolation of their displacements to the surface nodes.

    Attributes:
        positions_mm: (k, 2) or (k, 3) positions at rest in the sensor frame.
        to_surface: (s, k) CSR, node displacement = to_surface @ marker displacement, for the s
            nodes of `PadMesh.surface`; rows sum to 1.
        arrays: Further arrays of length k by name, such as lattice row, column and diameter.
        spline: The thin-plate spline through the same markers, or None.
    """

    positions_mm: Array
    to_surface: sparse.csr_array
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    spline: ThinPlate | None = None

    @cached_property
    def sparse(self) -> MarkerInterpolation:
        """Interpolation by `to_surface`; its `with_missing` handles lost markers."""
        return filled_sparse(np.asarray(self.positions_mm)[:, :2], self.to_surface)

    @cached_property
    def thin_plate(self) -> MarkerInterpolation:
        """Interpolation by the stored spline.

        Raises:
            IfemError: No spline is stored.
        """
        if self.spline is None:
            raise IfemError(
                "the bundle holds no thin-plate spline: rebuild it (gelslim bundle SPEC), or use "
                "thin_plate_interpolation(markers.positions_mm, mesh.nodes_mm[mesh.surface])",
                field="spline",
            )
        positions = np.asarray(self.positions_mm)[:, :2]
        return MarkerInterpolation(positions, self.spline.to_nodes, self.spline.bending)


def marker_field(
    mesh: PadMesh,
    positions_mm: ArrayLike | None,
    arrays: Mapping[str, ArrayLike] | None = None,
) -> MarkerField | None:
    """Markers on a pad; None if no positions are given.

    The thin-plate spline is included up to 4000 markers and 128 MB.

    Args:
        mesh: The pad.
        positions_mm: (k, 2) or (k, 3) in the sensor frame.
        arrays: Further arrays of length k by name.

    Raises:
        IfemError: The markers do not determine a field, or an array has another length or an
            unusable name.
    """
    if positions_mm is None:
        if arrays:
            raise IfemError(
                "marker arrays without marker positions: give both", field="marker_positions_mm"
            )
        return None
    positions = np.array(positions_mm, dtype=float)
    surface = mesh.nodes_mm[mesh.surface]
    operator = marker_to_node(positions, surface)
    count = len(positions)
    fits = count <= MOST_MARKERS and 8 * count * (count + len(surface)) <= MOST_STORED_BYTES
    spline = thin_plate(positions[:, :2], surface[:, :2]) if fits else None
    return MarkerField(positions, operator, _checked_arrays(count, arrays or {}), spline)


def _checked_arrays(count: int, arrays: Mapping[str, ArrayLike]) -> dict[str, NDArray[Any]]:
    checked: dict[str, NDArray[Any]] = {}
    for name, values in arrays.items():
        if not re.fullmatch(r"[a-z][a-z0-9_]{0,40}", name) or name == "positions_mm":
            raise IfemError(
                f"marker array name {name!r}: use lower-case letters, digits and _", field=name
            )
        array = np.array(values)
        if array.shape[:1] != (count,) or array.dtype.kind not in "biufU":
            raise IfemError(
                f"marker array {name!r} has shape {array.shape} and type {array.dtype}: must be "
                f"numbers or text, one per marker ({count})",
                field=name,
            )
        checked[name] = array
    return checked
