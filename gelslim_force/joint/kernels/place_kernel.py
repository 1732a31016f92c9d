"""Compiled search for the places of bins on the gel. Import this module only where it runs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

COMPILED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
_TURNS = 3
"""Steps of the iteration for the place at rest."""
_WHOLLY = 0.999


@njit(**COMPILED)
def _cell(place: Any, count: Any) -> Any:
    """First node of a cell along one axis, and the fraction of the cell, on the lattice."""
    first = min(max(int(np.floor(place)), 0), count - 2)
    return first, min(max(place - first, 0.0), 1.0)


@njit(**COMPILED)
def bins_at_rest(
    valid: Any,
    about: Any,
    nearest: Any,
    rest: Any,
    lean: Any,
    displacement: Any,
    near: Any,
    lattice: Any,
    bins: Any,
    places: Any,
) -> Any:
    """The bins whose line of sight meets the deformed gel in cells near a contact.

    A bin that is seen at rest at r, and along whose line of sight a point moves by l per mm of
    height, shows the point at rest p = r + l w(p) - v(p), with the height w and the lateral motion
    v of the surface, interpolated bilinearly between the nodes.

    Args:
        valid: (n,) bins that may be used.
        about: (c,) nodes in whose surroundings bins are looked at.
        nearest: (n,) the node nearest to each bin.
        rest: (n, 2) where the bins meet the gel at rest.
        lean: (n, 2) l of each bin.
        displacement: (c, 3) motion of the nodes.
        near: (c,) nodes near the contact.
        lattice: Origin (2,), step (2,) and number (nx, ny) of the nodes; -1 where there is none.
        bins: (n,) receives the numbers of bins in cells that have all nodes and are near.
        places: (n, 2) receives their places at rest.

    Returns:
        The number of bins found.
    """
    origin, step, number = lattice
    rows, columns = number.shape
    found = 0
    for k in range(len(valid)):
        if not (valid[k] and about[nearest[k]]):
            continue
        x, y = rest[k, 0], rest[k, 1]
        for _ in range(_TURNS):
            i, u = _cell((x - origin[0]) / step[0], rows)
            j, v = _cell((y - origin[1]) / step[1], columns)
            moved_x = moved_y = moved_z = 0.0
            for di in range(2):
                for dj in range(2):
                    node = number[i + di, j + dj]
                    if node >= 0:
                        weight = (u if di else 1 - u) * (v if dj else 1 - v)
                        moved_x += weight * displacement[node, 0]
                        moved_y += weight * displacement[node, 1]
                        moved_z += weight * displacement[node, 2]
            x = rest[k, 0] + lean[k, 0] * moved_z - moved_x
            y = rest[k, 1] + lean[k, 1] * moved_z - moved_y
        at_x, at_y = (x - origin[0]) / step[0], (y - origin[1]) / step[1]
        # Also false for a place that is no number.
        if not (0 <= at_x < rows - 1 and 0 <= at_y < columns - 1):
            continue
        i, u = _cell(at_x, rows)
        j, v = _cell(at_y, columns)
        whole, held = True, 0.0
        for di in range(2):
            for dj in range(2):
                node = number[i + di, j + dj]
                whole &= node >= 0
                if node >= 0 and near[node]:
                    held += (u if di else 1 - u) * (v if dj else 1 - v)
        if whole and held > _WHOLLY:
            bins[found], places[found, 0], places[found, 1] = k, x, y
            found += 1
    return found


@njit(**COMPILED)
def sums_of_taps(nodes: Any, along: Any, across: Any, values: Any, found: Any) -> None:
    """Slopes (n, 2) of values (c,): sums over taps (n, 16) weighted by `along` and `across`."""
    for k in range(len(nodes)):
        x = y = 0.0
        for tap in range(nodes.shape[1]):
            value = values[nodes[k, tap]]
            x += along[k, tap] * value
            y += across[k, tap] * value
        found[k, 0], found[k, 1] = x, y


@njit(**COMPILED)
def plane_turns(nodes: Any, along: Any, across: Any, lateral: Any, least: Any, found: Any) -> None:
    """F⁻ᵀ (n, 2, 2) with the deformation gradient F of the plane.

    Args:
        nodes: (n, 16).
        along: (n, 16) weights of the slope along x, by places at rest.
        across: (n, 16) those along y.
        lateral: (c, 2) motion of the nodes in the plane.
        least: Determinant of F that is taken in place of a smaller one.
        found: Receives (n, 2, 2).
    """
    for k in range(len(nodes)):
        xx, xy, yx, yy = 1.0, 0.0, 0.0, 1.0
        for tap in range(nodes.shape[1]):
            x, y = lateral[nodes[k, tap], 0], lateral[nodes[k, tap], 1]
            xx += along[k, tap] * x
            xy += across[k, tap] * x
            yx += along[k, tap] * y
            yy += across[k, tap] * y
        over = 1 / max(xx * yy - xy * yx, least)
        found[k, 0, 0], found[k, 0, 1] = yy * over, -yx * over
        found[k, 1, 0], found[k, 1, 1] = -xy * over, xx * over


@njit(**COMPILED)
def turn_slopes(along: Any, across: Any, turn: Any, turned_along: Any, turned_across: Any) -> None:
    """Multiply slopes, the weights (n, 16) along x and y, by matrices (n, 2, 2).

    Args:
        along: (n, 16).
        across: (n, 16).
        turn: (n, 2, 2).
        turned_along: Receives (n, 16).
        turned_across: Receives (n, 16).
    """
    for k in range(len(turn)):
        for tap in range(along.shape[1]):
            a, b = along[k, tap], across[k, tap]
            turned_along[k, tap] = turn[k, 0, 0] * a + turn[k, 0, 1] * b
            turned_across[k, tap] = turn[k, 1, 0] * a + turn[k, 1, 1] * b


@njit(**COMPILED)
def mark_adjacent(places: Any, found: Any) -> None:
    """Set `found` (p, p) to 1 where two of the places (p, 2) are one step along an axis apart."""
    for i in range(len(places)):
        x, y = places[i, 0], places[i, 1]
        for j in range(i):
            if abs(places[j, 0] - x) + abs(places[j, 1] - y) == 1:
                found[i, j] = found[j, i] = 1.0
