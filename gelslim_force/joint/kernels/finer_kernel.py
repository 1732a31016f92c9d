"""Compiled steps of a fit of forces at half the pitch. Import only where they run (numba)."""

from __future__ import annotations

from typing import Any

from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}


@njit(**COMPILED)
def mark_columns(starts: Any, columns: Any, rows: Any, found: Any) -> None:
    """Mark with 0 in `found` the columns that some rows of a sparse matrix by rows have."""
    for row in rows:
        for k in range(starts[row], starts[row + 1]):
            found[columns[k]] = 0


@njit(**COMPILED)
def interpolated_rows(
    starts: Any, columns: Any, values: Any, rows: Any, row_of: Any, right: Any, found: Any
) -> None:
    """Some rows (m,) of the product of a sparse matrix by rows and a full one.

    Args:
        starts: (f + 1,) first entry of each row of the sparse matrix.
        columns: Of its entries.
        values: Of its entries.
        rows: (m,) of it.
        row_of: (c,) row of `right` for each column.
        right: (n, q).
        found: Receives (m, q).
    """
    for i in range(len(rows)):
        out = found[i]
        out[:] = 0
        for k in range(starts[rows[i]], starts[rows[i] + 1]):
            row, weight = right[row_of[columns[k]]], right.dtype.type(values[k])
            for j in range(len(out)):
                out[j] += weight * row[j]


@njit(**COMPILED)
def stencil_columns(stencil: Any, at: Any, places: Any, columns: Any, found: Any) -> None:
    """Add the heights about forces at places (q, 2) of a lattice to their columns.

    Args:
        stencil: (2r + 1, 2r + 1) height by the distance.
        at: (q, 2).
        places: (m, 2) of the heights on the lattice.
        columns: (q, s) of `found`, whose mean each force is.
        found: (m, k), to which the heights are added.
    """
    size, share = stencil.shape[0], 1 / columns.shape[1]
    for i in range(len(places)):
        x, y, out = places[i, 0] + size // 2, places[i, 1] + size // 2, found[i]
        for n in range(len(at)):
            a, b = x - at[n, 0], y - at[n, 1]
            if 0 <= a < size and 0 <= b < size:
                height = share * stencil[a, b]
                for k in range(columns.shape[1]):
                    out[columns[n, k]] += height


@njit(**COMPILED)
def columns_in_parts(rows: Any, corners: Any, source: Any, found: Any) -> None:
    """Columns of normal forces that split evenly on four nodes, and of tangential ones on all.

    Args:
        rows: (n, 3p) by the forces on p nodes.
        corners: (f, 4) nodes of each normal force.
        source: (f, 4) of the q unknown normal forces, whose mean each force is.
        found: Receives (n, q + 2p).
    """
    nodes = rows.shape[1] // 3
    sixteenth, half = rows.dtype.type(1 / 16), found.shape[1] - 2 * nodes
    for i in range(len(rows)):
        row, out = rows[i], found[i]
        out[:half] = 0
        for k in range(len(corners)):
            value = row[3 * corners[k, 0] + 2] + row[3 * corners[k, 1] + 2]
            value += row[3 * corners[k, 2] + 2] + row[3 * corners[k, 3] + 2]
            if source[k, 0] == source[k, 3]:
                out[source[k, 0]] += 4 * sixteenth * value
                continue
            for corner in range(4):
                out[source[k, corner]] += sixteenth * value
        for n in range(nodes):
            out[half + 2 * n] = row[3 * n]
            out[half + 2 * n + 1] = row[3 * n + 1]


@njit(**COMPILED)
def add_smoothness(
    places: Any, area: Any, roughness: Any, size: Any, source: Any, force: Any, hessian: Any,
    slope: Any,
) -> None:  # fmt: skip
    """Add the prior of a smooth traction of limited size along one axis.

    Args:
        places: (f, 2) of the forces on a lattice; those one step apart are neighbours.
        area: (f,) of the places.
        roughness: Standard deviation of the difference of the traction of neighbours.
        size: Standard deviation of the traction.
        source: (f, 4) numbers of the unknown forces whose mean each force is.
        force: (f,) as they are.
        hessian: (k, k) of all unknown forces, to which it is added.
        slope: (k,), to which its gradient is added.
    """
    for i in range(len(places)):
        x, y, count, pull = places[i, 0], places[i, 1], 0, 0.0
        for j in range(len(places)):
            if abs(places[j, 0] - x) + abs(places[j, 1] - y) == 1:
                count += 1
                stiff = -1 / (roughness * roughness * area[i] * area[j])
                pull += stiff * force[j]
                for a in range(4):
                    for b in range(4):
                        hessian[source[i, a], source[j, b]] += stiff / 16
        stiff = (count / (roughness * roughness) + 1 / (size * size)) / (area[i] * area[i])
        pull += stiff * force[i]
        for a in range(4):
            slope[source[i, a]] += pull / 4
            for b in range(4):
                hessian[source[i, a], source[i, b]] += stiff / 16
