"""Compiled data of the markers and sums of normal equations. Import only where they run (numba)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
_TOGETHER = 8


@njit(**COMPILED)
def marker_data(
    used: Any,
    lateral: Any,
    model: Any,
    bent: Any,
    by_height: Any,
    noise: Any,
    errors: Any,
    residual: Any,
    weight: Any,
) -> None:
    """Lateral motion of m of n markers less that of the model, and its weights.

    Residuals count linearly beyond a number of standard deviations. These hold an error that all
    markers have, the noise of each, and a share of what linear interpolation leaves of its motion
    as the picture shows it: the root mean square over both axes.

    Args:
        used: (m,) numbers of the markers.
        lateral: (m, 2) motion that the picture shows.
        model: (n, 3) motion by the model.
        bent: (n, 3) what cubic interpolation between the nodes would add to it.
        by_height: (n, 2) lateral motion that a picture shows per mm less of height.
        noise: (n,) standard deviation by the noise of the image.
        errors: Standard deviation of all, share of the bending, and limit of the residuals.
        residual: Receives (2m,).
        weight: Receives (2m,).
    """
    common, share, limit = errors
    for k in range(len(used)):
        n = used[k]
        x = bent[n, 0] - by_height[n, 0] * bent[n, 2]
        y = bent[n, 1] - by_height[n, 1] * bent[n, 2]
        variance = common * common + noise[n] * noise[n] + share * share * (x * x + y * y) / 2
        for axis in range(2):
            left = lateral[k, axis] - model[n, axis]
            size = abs(left) / math.sqrt(variance)
            residual[2 * k + axis] = left
            weight[2 * k + axis] = min(1.0, limit / max(size, 1e-12)) / variance


@njit(**COMPILED)
def sparse_rows(starts: Any, columns: Any, values: Any, rows: Any, right: Any, found: Any) -> None:
    """Some rows (m,) of the product of a sparse matrix by rows and `right` (c, 3).

    Args:
        starts: (n + 1,) first entry of each row of the sparse matrix.
        columns: Of its entries.
        values: Of its entries.
        rows: (m,) of it.
        right: (c, 3).
        found: (n, 3), of which these rows are written.
    """
    for row in rows:
        x = y = z = 0.0
        for k in range(starts[row], starts[row + 1]):
            value, at = values[k], columns[k]
            x += value * right[at, 0]
            y += value * right[at, 1]
            z += value * right[at, 2]
        found[row, 0], found[row, 1], found[row, 2] = x, y, z


@njit(**COMPILED, fastmath={"contract", "nsz"})
def sparse_product(matrix: Any, right: Any, found: Any) -> None:
    """Product of a matrix (m, m), most of which is zero, and `right` (m, q), to `found` (m, q)."""
    size = len(matrix)
    at, value = np.empty(size + _TOGETHER, np.intp), np.empty(size + _TOGETHER, right.dtype)
    for i in range(size):
        count = 0
        for j in range(size):
            if matrix[i, j] != 0:
                at[count], value[count] = j, matrix[i, j]
                count += 1
        at[count : count + _TOGETHER], value[count : count + _TOGETHER] = i, 0
        out = found[i]
        out[:] = 0
        # Eight rows at a time, so that the sums are seldom read and written.
        for n in range(0, count, _TOGETHER):
            a, b, c, d = right[at[n]], right[at[n + 1]], right[at[n + 2]], right[at[n + 3]]
            e, f, g, h = right[at[n + 4]], right[at[n + 5]], right[at[n + 6]], right[at[n + 7]]
            s, t, u, v = value[n], value[n + 1], value[n + 2], value[n + 3]
            w, x, y, z = value[n + 4], value[n + 5], value[n + 6], value[n + 7]
            for k in range(len(out)):
                first = s * a[k] + t * b[k] + u * c[k] + v * d[k]
                out[k] += first + (w * e[k] + x * f[k] + y * g[k] + z * h[k])


@njit(**COMPILED)
def add_light(hessian: Any, gram: Any, mixed: Any, over: Any, found: Any) -> None:
    """Write `hessian` (q, q) + `gram` (q, q) - `over` m mᵀ, with `mixed` m (q,), to `found`."""
    for i in range(len(mixed)):
        scaled = over * mixed[i]
        for j in range(len(mixed)):
            found[i, j] = hessian[i, j] + gram[i, j] - scaled * mixed[j]


@njit(**COMPILED)
def add_prior(
    neighbours: Any, area: Any, roughness: Any, sizes: Any, start: Any, hessian: Any, slope: Any
) -> None:
    """Add the prior of smooth tractions of limited size.

    Args:
        neighbours: (p, p) with 1 where nodes are neighbours.
        area: (p,) of the nodes.
        roughness: Standard deviation of the difference of the traction of neighbours.
        sizes: (3,) standard deviation of each component of the traction.
        start: (3p,) forces.
        hessian: (3p, 3p), to which it is added.
        slope: (3p,), to which its gradient at the start is added.
    """
    nodes = len(area)
    for i in range(nodes):
        count = 0.0
        for j in range(nodes):
            if neighbours[i, j] == 0:
                continue
            count += neighbours[i, j]
            stiff = -neighbours[i, j] / (roughness * roughness * area[i] * area[j])
            for axis in range(3):
                hessian[3 * i + axis, 3 * j + axis] += stiff
                slope[3 * i + axis] += stiff * start[3 * j + axis]
        for axis in range(3):
            traction = 1 / (sizes[axis] * area[i])
            stiff = count / (roughness * area[i]) ** 2 + traction * traction
            hessian[3 * i + axis, 3 * i + axis] += stiff
            slope[3 * i + axis] += stiff * start[3 * i + axis]


@njit(**COMPILED)
def free_common_shear(
    numbers: Any, neighbours: Any, area: Any, push: Any, part: Any, sizes: Any, start: Any,
    hessian: Any, slope: Any,
) -> None:  # fmt: skip
    """Free what the tangential tractions of a contact have in common; see `common_shear`.

    Args:
        numbers: (2, p) of the unknown forces along x and y.
        neighbours: (p, p) with 1 where nodes are neighbours.
        area: (p,) of the nodes.
        push: (p,) normal forces, 0 where there is none.
        part: (p,) number of the contact of each node, 0 for none.
        sizes: Standard deviations of the difference of neighbours, of a deviation, and of the
            common ratio.
        start: (k,) all unknown forces at the start.
        hessian: (k, k), from which its part is taken.
        slope: (k,), likewise.
    """
    rough, size, ratio = sizes
    nodes = len(area)
    pull = np.empty(nodes)
    for number in range(1, part.max() + 1):
        weight = 1 / (ratio * ratio)
        for i in range(nodes):
            own = push[i] / area[i] if part[i] == number else 0.0
            pull[i] = own / (size * size * area[i])
            for j in range(nodes):
                if neighbours[i, j] != 0:
                    other = push[j] / area[j] if part[j] == number else 0.0
                    pull[i] += neighbours[i, j] * (own - other) / (rough * rough * area[i])
            if part[i] == number:
                weight += push[i] * pull[i]
        for axis in range(2):
            at, common = numbers[axis], 0.0
            for i in range(nodes):
                common += pull[i] * start[at[i]]
            for i in range(nodes):
                if pull[i] == 0:
                    continue
                slope[at[i]] -= pull[i] * common / weight
                for j in range(nodes):
                    hessian[at[i], at[j]] -= pull[i] * pull[j] / weight


@njit(**COMPILED)
def take_nodes(rows: Any, nodes: Any, found: Any) -> None:
    """Write the three columns of each node (q,) of `rows` (n, 3p) to `found` (n, 3q)."""
    for i in range(len(rows)):
        row, out = rows[i], found[i]
        for k in range(len(nodes)):
            for axis in range(3):
                out[3 * k + axis] = row[3 * nodes[k] + axis]


@njit(**COMPILED)
def take_triangle(matrix: Any, which: Any, found: Any) -> None:
    """Write rows and columns `which` (q,) of a matrix to the lower triangle of `found` (q, q)."""
    for i in range(len(which)):
        row, out = matrix[which[i]], found[i]
        for j in range(i + 1):
            out[j] = row[which[j]]
