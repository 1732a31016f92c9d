"""Dots put on a lattice without knowing the print: grown from a seed by local affine prediction.

A lattice seen through a tilted camera is nowhere regular, but locally it is affine. Growth
starts where a dot and its neighbours form the cleanest cross and takes one ring after the other;
a missing dot leaves a hole, a spurious one fits no site.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gelslim_core.errors import GelslimError
from gelslim_force.detection.detections import Detections
from gelslim_force.lattice.bridge import bridged

_REACH = 2
_GATE = 0.28
_MISFIT = 0.22
_SEEDS = 12
_ENOUGH = 0.8
_SMALLEST = 12
_RINGS = 200
_BRIDGES, _WHOLE = 6, 0.9


class LatticeError(GelslimError, ValueError):
    """The dots found form no lattice, or one that cannot be told from another."""


@dataclass(frozen=True, eq=False)
class Lattice:
    """k of a frame's dots on a lattice whose origin, turn and handedness are arbitrary."""

    sites: NDArray[np.int64]
    """(k, 2) lattice indices, smallest 0 along each axis."""
    dots: NDArray[np.int64]
    """(k,) indices into the detections."""
    residual_px: NDArray[np.float64]
    """(k,) distance of each dot from the place its neighbours predict; NaN with too few."""
    pitch_px: float
    """Median distance between neighbours."""

    @property
    def shape(self) -> tuple[int, int]:
        """Lattice extent (rows, columns), holes included."""
        rows, columns = self.sites.max(axis=0) + 1
        return int(rows), int(columns)


def grow_lattice(detections: Detections) -> Lattice:
    """Return the largest lattice among the dots.

    Raises LatticeError where fewer than 12 dots, or no cross of five, form one.
    """
    points = detections.centres_px
    if len(points) < _SMALLEST:
        raise LatticeError(
            f"only {len(points)} dots found, a lattice needs {_SMALLEST}: check the dots' "
            "diameters in the detector's settings, the light and the focus"
        )
    tree = cKDTree(points)
    best: dict[tuple[int, int], int] = {}
    taken: set[int] = set()
    for seed, basis in _seeds(points, tree):
        if seed in taken:
            continue
        placed = _grown(points, tree, seed, basis)
        taken.update(placed.values())
        if len(placed) > len(best):
            best = placed
        if len(best) >= _ENOUGH * len(points):
            break
    if len(best) < _SMALLEST:
        raise LatticeError(
            f"the {len(points)} dots found form no lattice: the largest piece has {len(best)}; "
            "check the dots' diameters in the detector's settings"
        )
    return _finished(points, best)


def _seeds(points: NDArray[np.float64], tree: cKDTree) -> list[tuple[int, NDArray[np.float64]]]:
    """Dots with two pairs of opposite neighbours, cleanest first, and their steps (2, 2)."""
    _, near = tree.query(points, min(9, len(points)))
    found: list[tuple[float, int, NDArray[np.float64]]] = []
    for i, neighbours in enumerate(near):
        steps = points[neighbours[1:]] - points[i]
        length = np.hypot(*steps.T)
        pairs: list[tuple[float, float, NDArray[np.float64]]] = []
        for a in range(len(steps)):
            for b in range(a + 1, len(steps)):
                skew = float(np.hypot(*(steps[a] + steps[b]))) / float(length[a] + length[b])
                if skew < 0.12:
                    pairs.append((float(length[a] + length[b]), skew, (steps[a] - steps[b]) / 2))
        pairs.sort(key=lambda pair: pair[0])
        for second in pairs[1:]:
            u, v = pairs[0][2], second[2]
            sine = abs(u[0] * v[1] - u[1] * v[0]) / float(np.hypot(*u) * np.hypot(*v))
            if sine > 0.6:
                found.append((pairs[0][1] + second[1], i, np.array([u, v])))
                break
    found.sort(key=lambda item: item[0])
    spread = found[:: max(1, len(found) // (4 * _SEEDS))]
    return [(i, basis) for _, i, basis in found[:_SEEDS] + spread]


def _grown(
    points: NDArray[np.float64], tree: cKDTree, seed: int, basis: NDArray[np.float64]
) -> dict[tuple[int, int], int]:
    placed = {(0, 0): seed}
    used = {seed}
    for step, vector in (((1, 0), basis[0]), ((0, 1), basis[1])):
        for sign in (1, -1):
            gap, dot = tree.query(points[seed] + sign * vector)
            if gap < _GATE * np.hypot(*vector) and int(dot) not in used:
                placed[sign * step[0], sign * step[1]] = int(dot)
                used.add(int(dot))
    if len(placed) < 5:
        return placed
    for _ in range(_BRIDGES):
        _rings(points, tree, placed, used)
        if len(placed) > _WHOLE * len(points):
            break
        more = bridged(points, placed)
        if not more:
            break
        placed.update(more)
        used.update(more.values())
    for _ in range(3):
        _rings(points, tree, placed, used)
        wrong = [site for site, gap in _misfits(points, placed).items() if gap > _MISFIT]
        if not wrong:
            break
        for site in wrong:
            used.discard(placed.pop(site))
    return placed


def _rings(
    points: NDArray[np.float64],
    tree: cKDTree,
    placed: dict[tuple[int, int], int],
    used: set[int],
) -> None:
    """Add ring after ring of sites, the surest dot of each ring first."""
    barren: set[tuple[int, int]] = set()
    reach = 1
    for _ in range(_RINGS):
        offers: list[tuple[float, tuple[int, int], int]] = []
        for site in sorted(_rim(placed, reach) - barren):
            place, pitch, support = _predicted(points, placed, site)
            if support < 4:
                continue
            gap, dot = tree.query(place)
            if gap < _GATE * pitch and int(dot) not in used:
                offers.append((float(gap / pitch), site, int(dot)))
            elif support >= 8:
                barren.add(site)
        added = 0
        for _, site, dot in sorted(offers):
            if dot not in used and site not in placed:
                placed[site] = dot
                used.add(dot)
                added += 1
        if added:
            reach = 1
        elif reach < _REACH:
            reach += 1
        else:
            return


def _rim(placed: dict[tuple[int, int], int], reach: int) -> set[tuple[int, int]]:
    around = range(-reach, reach + 1)
    rim = {(i + a, j + b) for i, j in placed for a in around for b in around}
    return rim - placed.keys()


def _predicted(
    points: NDArray[np.float64], placed: dict[tuple[int, int], int], site: tuple[int, int]
) -> tuple[NDArray[np.float64], float, int]:
    """Place (2,) of a site by the affine fit to its neighbours, pitch there, and their number."""
    around = range(-_REACH, _REACH + 1)
    offsets = [
        (a, b, placed[site[0] + a, site[1] + b])
        for a in around
        for b in around
        if (a or b) and (site[0] + a, site[1] + b) in placed
    ]
    if len(offsets) < 4:
        return np.zeros(2), 1.0, 0
    table = np.array(offsets)
    design = np.column_stack([np.ones(len(table)), table[:, :2]])
    # Near neighbours weigh more: the fit leaves out the keystone's curvature.
    weight = 1.0 / np.hypot(table[:, 0], table[:, 1])
    normal = design.T @ (design * weight[:, None])
    if np.linalg.cond(normal) > 1e4:
        return np.zeros(2), 1.0, 0
    fit = np.linalg.solve(normal, design.T @ (points[table[:, 2]] * weight[:, None]))
    pitch = float(min(np.hypot(*fit[1]), np.hypot(*fit[2])))
    return fit[0], max(pitch, 1e-6), len(table)


def _misfits(
    points: NDArray[np.float64], placed: dict[tuple[int, int], int]
) -> dict[tuple[int, int], float]:
    """Distance of every dot with enough neighbours from their prediction, in pitches."""
    gaps = {}
    for site, dot in placed.items():
        place, pitch, support = _predicted(points, placed, site)
        if support >= 4:
            gaps[site] = float(np.hypot(*(points[dot] - place))) / pitch
    return gaps


def _finished(points: NDArray[np.float64], placed: dict[tuple[int, int], int]) -> Lattice:
    placed = _without_lone_rims(_upright(points, placed))
    order = sorted(placed)
    sites = np.array(order, dtype=np.int64)
    dots = np.array([placed[site] for site in order], dtype=np.int64)
    residual = np.array([_even_residual(points, placed, site) for site in order])
    steps = np.vstack([_steps(points, placed, 1, 0), _steps(points, placed, 0, 1)])
    return Lattice(
        sites=sites - sites.min(axis=0),
        dots=dots,
        residual_px=residual,
        pitch_px=float(np.median(np.hypot(*steps.T))),
    )


def _without_lone_rims(placed: dict[tuple[int, int], int]) -> dict[tuple[int, int], int]:
    """Take off outermost rows and columns of a single dot: dirt beside the print fits as well."""
    while True:
        sites = np.array(list(placed))
        lone: set[tuple[int, int]] = set()
        for axis in (0, 1):
            for rim in (sites[:, axis].min(), sites[:, axis].max()):
                on = sites[sites[:, axis] == rim]
                if len(on) == 1:
                    lone.add((int(on[0, 0]), int(on[0, 1])))
        if not lone:
            return placed
        placed = {site: dot for site, dot in placed.items() if site not in lone}


def _steps(
    points: NDArray[np.float64], placed: dict[tuple[int, int], int], rows: int, columns: int
) -> NDArray[np.float64]:
    """Vectors (n, 2) in px from every dot to the one so many rows and columns on."""
    pairs = [
        (dot, placed[i + rows, j + columns])
        for (i, j), dot in placed.items()
        if (i + rows, j + columns) in placed
    ]
    ends = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    return points[ends[:, 1]] - points[ends[:, 0]]


def _upright(
    points: NDArray[np.float64], placed: dict[tuple[int, int], int]
) -> dict[tuple[int, int], int]:
    """Undo a seed's choice of diagonals for axes: the two shortest steps become the axes.

    Lagrange's reduction of the median steps; a missing neighbour at the seed makes it needed.
    """
    u, v = (np.median(_steps(points, placed, *axis), axis=0) for axis in ((1, 0), (0, 1)))
    # Rows: the new axes in terms of the old ones.
    change = np.eye(2, dtype=np.int64)
    for _ in range(20):
        if u @ u > v @ v:
            u, v, change = v, u, change[::-1].copy()
        times = int(np.rint((u @ v) / (u @ u)))
        if times == 0:
            break
        v = v - times * u
        change[1] -= times * change[0]
    inverse = np.rint(np.linalg.inv(change)).astype(np.int64)
    return {
        (int(i * inverse[0, 0] + j * inverse[1, 0]), int(i * inverse[0, 1] + j * inverse[1, 1])): d
        for (i, j), d in placed.items()
    }


def _even_residual(
    points: NDArray[np.float64], placed: dict[tuple[int, int], int], site: tuple[int, int]
) -> float:
    """Distance from the quadratic surface through the 5 x 5 neighbours, in px; NaN if too few."""
    around = range(-_REACH, _REACH + 1)
    near = [
        (a, b, placed[site[0] + a, site[1] + b])
        for a in around
        for b in around
        if (a or b) and (site[0] + a, site[1] + b) in placed
    ]
    if len(near) < 9:
        return float("nan")
    table = np.array(near)
    a, b = table[:, 0], table[:, 1]
    design = np.column_stack([np.ones(len(table)), a, b, a * a, a * b, b * b])
    fit, _, rank, _ = np.linalg.lstsq(design, points[table[:, 2]], rcond=None)
    if rank < 6:
        return float("nan")
    return float(np.hypot(*(points[placed[site]] - fit[0])))
