"""Displacement of the surface nodes from that of the markers, some of which may be lost.

Two interpolations share one interface. `sparse_interpolation` is bilinear in the cells of the
lattice: it has four weights per node, never amplifies the noise of the markers, and is constant
beyond the outermost markers. `thin_plate_interpolation` is a dense matrix: it is more accurate for
smooth fields, and affine beyond the outermost markers.

A lost marker is given the value that minimises the roughness dᵀ B d of the field. For the spline,
B is its bending energy; otherwise, the distance from locally fitted planes:

    B_RR d_R = -B_RK d_K     (R lost, K kept)

For the spline the result is the spline through the kept markers. Only B_RR has to be factored
again when other markers are lost.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import linalg, sparse
from scipy.spatial import cKDTree

from ifem_export.errors import InterpolationError
from ifem_export.markers.interpolation import checked_markers, marker_to_node
from ifem_export.markers.thin_plate import thin_plate
from ifem_export.mesh.alignment import points_in_plane

Array = NDArray[np.float64]
Operator: TypeAlias = Any
"""(n, k) dense or CSR, which share the operator @ and the selection of rows."""
NEIGHBOURS = 8
"""Number of markers around an inner marker of a square lattice."""
_TIE = 1.0 + 1e-6
_FLAT = 1e-6
_SINGULAR = 1e-12
_ON_A_LINE = 1e-9


@dataclass(frozen=True, eq=False)
class _Fill:
    """Values of the lost markers `lost` from those of the kept ones."""

    lost: NDArray[np.int64]
    rows: Operator
    factor: tuple[Array, bool]

    def __call__(self, kept: Array) -> Array:
        right = -(self.rows @ kept)
        return np.asarray(linalg.cho_solve(self.factor, right, check_finite=False))

    def transposed(self, lost: Array) -> Array:
        """The transpose, (k, m) from (r, m)."""
        solved = linalg.cho_solve(self.factor, lost, check_finite=False)
        return np.asarray(-(self.rows.T @ solved))


@dataclass(frozen=True, eq=False)
class MarkerInterpolation:
    """A matrix from markers to nodes, and a roughness that determines the values of lost markers.

    Attributes:
        markers_mm: (k, 2) positions at rest.
        to_nodes: (s, k), dense or CSR; rows sum to 1.
        roughness: (k, k), dense or CSR; symmetric, positive semi-definite, zero on affine
            fields.
        fill: Values of the lost markers from those of the kept ones; made by `with_missing`.
    """

    markers_mm: Array
    to_nodes: Operator
    roughness: Operator
    fill: _Fill | None = None

    @property
    def n_markers(self) -> int:
        """Markers k, lost ones included."""
        return int(self.to_nodes.shape[1])

    @property
    def n_nodes(self) -> int:
        """Surface nodes s."""
        return int(self.to_nodes.shape[0])

    @property
    def lost(self) -> NDArray[np.bool_]:
        """(k,) bool, the markers whose values are not read."""
        mask = np.zeros(self.n_markers, dtype=bool)
        if self.fill is not None:
            mask[self.fill.lost] = True
        return mask

    def __call__(self, values: ArrayLike) -> Array:
        """Values (s, m) at the nodes from (k, m) at the markers; lost markers may be NaN.

        Raises InterpolationError for a wrong shape or a kept value that is not finite.
        """
        d = np.array(values, dtype=float)
        if d.ndim != 2 or len(d) != self.n_markers:
            raise InterpolationError(
                f"marker values have shape {d.shape}: must be ({self.n_markers}, m), one row per "
                "marker",
                field="values",
                value=d.shape,
            )
        if self.fill is not None:
            d[self.fill.lost] = 0.0
        if not np.isfinite(d).all():
            first = int(np.flatnonzero(~np.isfinite(d).all(axis=1))[0])
            raise InterpolationError(
                f"the value of marker {first} is not finite: give lost markers to with_missing",
                field="marker",
                value=first,
            )
        if self.fill is not None:
            d[self.fill.lost] = self.fill(d)
        return np.asarray(self.to_nodes @ d)

    def transposed(self, values: ArrayLike) -> Array:
        """The transpose: (k, m) at the markers from (s, m) at the nodes, 0 at lost markers."""
        found = np.array(self.to_nodes.T @ np.asarray(values, dtype=float))
        if self.fill is not None:
            found += self.fill.transposed(found[self.fill.lost])
            found[self.fill.lost] = 0.0
        return found

    def with_missing(self, mask: ArrayLike) -> MarkerInterpolation:
        """The same without the markers in the (k,) bool `mask`, which replaces an earlier mask.

        Raises InterpolationError if the kept markers do not determine a field.
        """
        lost = np.asarray(mask)
        if lost.shape != (self.n_markers,) or lost.dtype != np.bool_:
            raise InterpolationError(
                f"the mask of lost markers has shape {lost.shape} and type {lost.dtype}: must be "
                f"({self.n_markers},) bool",
                field="mask",
                value=lost.shape,
            )
        where = np.flatnonzero(lost)
        if len(where) == 0:
            return self if self.fill is None else replace(self, fill=None)
        _require_field(self.markers_mm[~lost], self.markers_mm)
        rows = self.roughness[where]
        square = rows[:, where]
        block = square.toarray() if sparse.issparse(square) else square
        return replace(self, fill=_Fill(where, rows, _factored(np.asarray(block))))

    def dense(self) -> Array:
        """The effective matrix (s, k), with zero columns for lost markers."""
        found = self(np.where(self.lost[:, None], 0.0, np.eye(self.n_markers)))
        found[:, self.lost] = 0.0
        return found

    def noise_gain(self) -> Array:
        """Standard deviation (s,) at each node for independent unit noise on the markers."""
        return np.asarray(np.linalg.norm(self.dense(), axis=1))


def sparse_interpolation(markers_mm: ArrayLike, nodes_mm: ArrayLike) -> MarkerInterpolation:
    """Interpolation by `marker_to_node`; arguments and errors as there."""
    operator = marker_to_node(markers_mm, nodes_mm)
    markers = points_in_plane(markers_mm, "markers_mm", InterpolationError)
    return filled_sparse(markers, operator)


def filled_sparse(markers_mm: Array, to_nodes: sparse.csr_array) -> MarkerInterpolation:
    """The interpolation of a stored operator (s, k)."""
    return MarkerInterpolation(markers_mm, to_nodes, local_roughness(markers_mm))


def thin_plate_interpolation(markers_mm: ArrayLike, nodes_mm: ArrayLike) -> MarkerInterpolation:
    """Interpolation by `thin_plate`.

    Args:
        markers_mm: (k, 2) or (k, 3) positions at rest, 3 <= k <= 4000; only x and y are used.
        nodes_mm: (s, 2) or (s, 3).

    Raises:
        InterpolationError: As `marker_to_node`, or there are too many markers.
    """
    markers = checked_markers(markers_mm)
    nodes = points_in_plane(nodes_mm, "nodes_mm", InterpolationError)
    spline = thin_plate(markers, nodes)
    return MarkerInterpolation(markers, spline.to_nodes, spline.bending)


def _require_field(kept: Array, markers: Array) -> None:
    if len(kept) < 3:
        raise InterpolationError(
            f"{len(kept)} of {len(markers)} markers are left: a displacement field needs at "
            "least 3, not on one line",
            field="mask",
            value=len(kept),
        )
    spread = np.linalg.eigvalsh(np.cov(kept.T))
    if spread[0] <= _ON_A_LINE**2 * spread[1]:
        raise InterpolationError(
            f"the {len(kept)} markers left lie on one line: a field needs a second row",
            field="mask",
            value=len(kept),
        )


def _factored(block: Array) -> tuple[Array, bool]:
    """Cholesky factor of B_RR. Raises InterpolationError if the kept markers do not suffice."""
    scale = 1.0 / np.sqrt(np.diag(block)) if (np.diag(block) > 0).all() else None
    try:
        if scale is None:
            raise linalg.LinAlgError
        factor, lower = linalg.cho_factor(block, lower=True, check_finite=False)
        if (np.diag(factor) * scale).min() ** 2 <= _SINGULAR:
            raise linalg.LinAlgError
    except linalg.LinAlgError as error:
        raise InterpolationError(
            f"the markers left do not determine some of the {len(block)} lost ones: too many are "
            "missing in one region",
            field="mask",
            value=len(block),
        ) from error
    return factor, bool(lower)


def local_roughness(markers_mm: NDArray[np.float64]) -> sparse.csr_array:
    """Sum over the markers of the squared distance from the plane fitted to their neighbours.

    The neighbours of a marker are the eight nearest and all others at the distance of the eighth,
    so that a lattice is treated symmetrically.

    Args:
        markers_mm: (k, 2) distinct positions, k >= 3.

    Returns:
        (k, k) CSR B, symmetric and positive semi-definite: roughness = dᵀ B d. It is zero on
        affine fields, and only on those if the neighbourhoods overlap.
    """
    count = len(markers_mm)
    tree = cKDTree(markers_mm)
    nearest = min(NEIGHBOURS + 1, count)
    reach = tree.query(markers_mm, k=nearest)[0][:, -1]
    within = reach * _TIE
    around = tree.query_ball_point(markers_mm, within, return_sorted=True)
    rows, columns, values = [], [], []
    for marker, near in enumerate(around):
        offsets = (markers_mm[near] - markers_mm[marker]) / reach[marker]
        u, size, _ = np.linalg.svd(np.column_stack([np.ones(len(near)), offsets]), False)
        u = u[:, size > _FLAT * size[0]]
        residual = -u @ u[near.index(marker)]
        residual[near.index(marker)] += 1.0
        rows.append(np.full(len(near), marker))
        columns.append(near)
        values.append(residual)
    residuals = sparse.csr_array(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))),
        shape=(count, count),
    )
    form = sparse.csr_array(residuals.T @ residuals)
    form.sort_indices()
    return form
