"""Thin-plate spline from markers to nodes as one dense matrix.

Of all fields through the markers the spline has the smallest ∫ (u_xx² + 2 u_xy² + u_yy²) dA
(J. Duchon, "Splines minimizing rotation-invariant semi-norms in Sobolev spaces", 1977). It is

    u(x) = Σ_i w_i φ(|x - x_i|) + a_0 + a_1 x + a_2 y,   φ(r) = r² log r,   Σ w_i (1, x_i, y_i) = 0.

The weights w = B d are linear and the bending energy 8π dᵀ B d is quadratic in the values d of the
markers. Both matrices depend only on the positions at rest and are computed once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, special
from scipy.spatial.distance import cdist

from ifem_export.errors import InterpolationError
from ifem_export.operators.single_thread import single_threaded

Array = NDArray[np.float64]
MOST_MARKERS = 4000
"""The size of the matrices grows with the square of this number, the time with its cube."""


@dataclass(frozen=True, eq=False)
class ThinPlate:
    """The spline of one set of markers.

    Attributes:
        to_nodes: (s, k), node value = to_nodes @ marker values; rows sum to 1, and affine
            fields are exact, also outside the convex hull of the markers.
        bending: (k, k) B, symmetric and positive semi-definite, zero on affine fields:
            ∫ |D²u|² dA = 8π dᵀ B d for the interpolating spline.
    """

    to_nodes: Array
    bending: Array


@single_threaded
def thin_plate(markers_mm: Array, nodes_mm: Array) -> ThinPlate:
    """Matrices of the thin-plate spline.

    Args:
        markers_mm: (k, 2) distinct positions at rest, 3 <= k <= 4000, not on one line.
        nodes_mm: (s, 2) node positions at rest.

    Raises:
        InterpolationError: There are too many markers, or they do not determine a field.
    """
    count = len(markers_mm)
    if count > MOST_MARKERS:
        raise InterpolationError(
            f"{count} markers: a dense thin-plate spline takes at most {MOST_MARKERS}; use the "
            "sparse interpolation",
            field="markers_mm",
            value=count,
        )
    # Scale to unit spacing: another unit of length changes r² log r by an affine field only.
    centre = markers_mm.mean(axis=0)
    unit = float(np.sqrt(np.ptp(markers_mm, axis=0).max() ** 2 / count))
    markers, nodes = (markers_mm - centre) / unit, (nodes_mm - centre) / unit
    energy = kernel(markers, markers)
    q, r = linalg.qr(affine(markers))
    if np.abs(np.diag(r)).min() <= 1e-9 * np.abs(r).max():
        raise InterpolationError(
            "the markers lie on one line: a field needs a second row", field="markers_mm"
        )
    orthogonal = q[:, 3:]
    try:
        factor = linalg.cho_factor(orthogonal.T @ energy @ orthogonal, lower=True)
    except linalg.LinAlgError as error:
        raise InterpolationError(
            "the thin-plate spline cannot be solved for: two markers almost coincide",
            field="markers_mm",
        ) from error
    half = linalg.solve_triangular(factor[0], orthogonal.T, lower=True)
    bending = half.T @ half
    plane = linalg.solve_triangular(r[:3], q[:, :3].T @ (np.eye(count) - energy @ bending))
    to_nodes = kernel(nodes, markers) @ bending + affine(nodes) @ plane
    # The two parts cancel far from the markers, so correct the rounding errors of affine fields.
    gap = affine(nodes) - to_nodes @ affine(markers)
    to_nodes += gap @ linalg.solve_triangular(r[:3], q[:, :3].T)
    return ThinPlate(to_nodes, bending / unit**2)


def kernel(a: Array, b: Array) -> Array:
    """φ(r) = r² log r (n, k) of the distances between points a (n, 2) and b (k, 2)."""
    square = cdist(a, b, "sqeuclidean")
    return np.asarray(0.5 * special.xlogy(square, square))


def affine(points: Array) -> Array:
    """Columns 1, x, y (n, 3) at points (n, 2)."""
    return np.column_stack([np.ones(len(points)), points])
