"""Sparse interpolation of a displacement field from markers to surface nodes.

The weights depend only on the positions at rest, so they are computed once. A node inside a
lattice cell with all four markers has bilinear weights. Any other node inside the convex hull of
the markers has linear weights in its Delaunay triangle. A node outside takes the value of the
nearest point of the hull. Rows sum to one, and linear fields are exact inside the hull.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.spatial import Delaunay, QhullError, cKDTree

from ifem_export.errors import InterpolationError
from ifem_export.mesh.alignment import points_in_plane

_WEIGHT_FLOOR = 1e-12


def marker_to_node(markers_mm: ArrayLike, nodes_mm: ArrayLike) -> sparse.csr_array:
    """Matrix that interpolates from markers to nodes.

    Args:
        markers_mm: (k, 2) or (k, 3) marker positions at rest, k >= 3; only x and y are used.
            The markers may form a lattice with missing or additional markers, or be scattered.
        nodes_mm: (n, 2) or (n, 3) node positions at rest; only x and y are used.

    Returns:
        (n, k) CSR, float64 and int32, sorted; rows sum to 1.

    Raises:
        InterpolationError: A shape is wrong, a value is not finite, two markers coincide, or all
            markers lie on one line.
    """
    markers = checked_markers(markers_mm)
    nodes = points_in_plane(nodes_mm, "nodes_mm", InterpolationError)
    triangulation = _triangulate(markers)
    columns, weights = _in_lattice(markers, nodes)
    rest = np.flatnonzero(weights.sum(axis=1) == 0.0)
    columns[rest], weights[rest] = _in_triangles(triangulation, nodes[rest])
    outside = np.flatnonzero(weights.sum(axis=1) == 0.0)
    columns[outside], weights[outside] = _on_hull(triangulation, nodes[outside])
    weights = np.where(weights < _WEIGHT_FLOOR, 0.0, weights)
    weights /= weights.sum(axis=1, keepdims=True)
    rows = np.broadcast_to(np.arange(len(nodes))[:, None], weights.shape)
    operator = sparse.coo_array(
        (weights.ravel(), (rows.ravel(), columns.ravel())), shape=(len(nodes), len(markers))
    ).tocsr()
    operator.eliminate_zeros()
    operator.sort_indices()
    operator.indices = operator.indices.astype(np.int32)
    operator.indptr = operator.indptr.astype(np.int32)
    return operator


def checked_markers(markers_mm: ArrayLike) -> NDArray[np.float64]:
    """Coordinates x and y (k, 2) of markers that determine a field.

    Raises:
        InterpolationError: There are fewer than 3 markers, two coincide, all lie on one line, or a
            value is not finite.
    """
    markers = points_in_plane(markers_mm, "markers_mm", InterpolationError)
    if len(markers) < 3:
        raise InterpolationError(
            f"{len(markers)} markers: a displacement field needs at least 3, not on one line",
            field="markers_mm",
            value=len(markers),
        )
    extent = float(np.ptp(markers, axis=0).max())
    pairs = cKDTree(markers).query_pairs(1e-9 * extent)
    if pairs:
        a, b = min(pairs)
        raise InterpolationError(
            f"markers {a} and {b} are at the same position "
            f"({markers[a][0]:g}, {markers[a][1]:g}) mm: remove one",
            field="markers_mm",
            value=(a, b),
        )
    spread = np.linalg.svd(markers - markers.mean(axis=0), compute_uv=False)
    if spread[1] <= 1e-9 * spread[0]:
        raise InterpolationError(
            "the markers lie on one line: a field needs a second row", field="markers_mm"
        )
    return markers


def _triangulate(markers: NDArray[np.float64]) -> Delaunay:
    try:
        return Delaunay(markers)
    except QhullError as error:
        raise InterpolationError(
            f"the markers cannot be triangulated: {error}", field="markers_mm"
        ) from error


def _lines(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Distinct coordinates up to rounding, and the index of the one that each value belongs to."""
    order = np.argsort(values, kind="stable")
    ordered = values[order]
    step = np.concatenate([[0], np.diff(ordered) > 1e-9 * np.ptp(values)]).astype(np.int64)
    line = np.empty(len(values), dtype=np.int64)
    line[order] = np.cumsum(step)
    centre = np.bincount(line, weights=values) / np.bincount(line)
    return centre, line


def _in_lattice(
    markers: NDArray[np.float64], nodes: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Bilinear weights (n, 4) of nodes in complete lattice cells; zero rows elsewhere."""
    columns = np.zeros((len(nodes), 4), dtype=np.int64)
    weights = np.zeros((len(nodes), 4))
    x_lines, i = _lines(markers[:, 0])
    y_lines, j = _lines(markers[:, 1])
    # Each scattered marker has lines of its own; the table is useful for a lattice only.
    if len(x_lines) * len(y_lines) > 4 * len(markers):
        return columns, weights
    table = np.full((len(x_lines), len(y_lines)), -1, dtype=np.int64)
    table[i, j] = np.arange(len(markers))
    ci, s, in_x = _bracket(x_lines, nodes[:, 0])
    cj, t, in_y = _bracket(y_lines, nodes[:, 1])
    corners = np.stack(
        [table[ci, cj], table[ci + 1, cj], table[ci, cj + 1], table[ci + 1, cj + 1]], axis=1
    )
    found = in_x & in_y & (corners >= 0).all(axis=1)
    bilinear = np.stack([(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t], axis=1)
    columns[found], weights[found] = corners[found], bilinear[found]
    return columns, weights


def _bracket(
    lines: NDArray[np.float64], values: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.bool_]]:
    """Interval of each value between sorted lines, its fraction there, and whether it is inside.

    A value outside by rounding only is left to the triangles and the hull, which agree there.
    """
    cell = np.minimum(np.searchsorted(lines, values, side="right") - 1, len(lines) - 2)
    fraction = (values - lines[cell]) / (lines[cell + 1] - lines[cell])
    return cell, fraction, (values >= lines[0]) & (values <= lines[-1])


def _in_triangles(
    triangulation: Delaunay, nodes: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Barycentric weights (n, 4), of which the fourth is not used; zero rows outside the hull."""
    columns = np.zeros((len(nodes), 4), dtype=np.int64)
    weights = np.zeros((len(nodes), 4))
    triangle = triangulation.find_simplex(nodes, tol=1e-9)
    a, b, c = (triangulation.points[triangulation.simplices[:, v]] for v in range(3))
    double_areas = _cross(b - a, c - a)
    # Rounding can produce a flat triangle on a straight side of the hull, which has no weights.
    flat = np.abs(double_areas) <= 1e-12 * np.ptp(triangulation.points, axis=0).prod()
    inside = np.flatnonzero((triangle >= 0) & ~flat[triangle])
    corners = triangulation.simplices[triangle[inside]]
    a, b, c = (triangulation.points[corners[:, v]] for v in range(3))
    p, double_area = nodes[inside], double_areas[triangle[inside]]
    barycentric = np.stack([_cross(b - p, c - p), _cross(c - p, a - p), _cross(a - p, b - p)], 1)
    columns[inside, :3] = corners
    weights[inside, :3] = np.clip(barycentric / double_area[:, None], 0.0, None)
    return columns, weights


def _cross(u: NDArray[Any], v: NDArray[Any]) -> NDArray[Any]:
    return np.asarray(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def _on_hull(
    triangulation: Delaunay, nodes: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Weights (n, 4) of the nearest point of the hull; the last two are not used."""
    edges = triangulation.convex_hull.astype(np.int64)
    a, b = triangulation.points[edges[:, 0]], triangulation.points[edges[:, 1]]
    u = b - a
    along = np.einsum("nej,ej->ne", nodes[:, None, :] - a, u) / np.einsum("ej,ej->e", u, u)
    along = np.clip(along, 0.0, 1.0)
    foot = a + along[:, :, None] * u
    nearest = np.argmin(np.linalg.norm(nodes[:, None, :] - foot, axis=2), axis=1)
    t = along[np.arange(len(nodes)), nearest]
    columns = np.zeros((len(nodes), 4), dtype=np.int64)
    weights = np.zeros((len(nodes), 4))
    columns[:, :2] = edges[nearest]
    weights[:, 0], weights[:, 1] = 1.0 - t, t
    return columns, weights
