"""The lattice of the dots, found without knowledge of the print by growth from a seed.

Perspective makes the image of a lattice irregular, but locally it is affine. Growth starts at the
dot whose neighbours form the most regular cross and adds one ring of sites after the other. A
missing dot leaves a hole; a spurious dot fits no site.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gelslim_core.errors import GelslimError
from gelslim_force.detection.detections import Detections
from gelslim_force.lattice.homography import dots_across_gaps

_REACH = 2
_TOLERANCE = 0.28
_MAX_MISFIT = 0.22
_MAX_SEEDS = 12
_ENOUGH = 0.8
_MIN_DOTS = 12
_MAX_SKEW = 0.12
"""Largest sum of two opposite steps, relative to the sum of their lengths."""
_MIN_SINE = 0.6
"""Smallest sine of the angle between the axes of a seed."""
_MAX_CONDITION = 1e4
"""Largest condition number of the fit that predicts a site."""
_MAX_RINGS = 200
_MAX_BRIDGES, _NEARLY_ALL = 6, 0.9
_AROUND = np.array(
    [(a, b) for a in range(-_REACH, _REACH + 1) for b in range(-_REACH, _REACH + 1) if a or b]
)
"""Row and column offsets (24, 2) of the neighbours from which a site is predicted."""


class LatticeError(GelslimError, ValueError):
    """The dots form no lattice, or one that fits the print in more than one way."""


@dataclass(frozen=True, eq=False)
class Lattice:
    """k dots of a frame on a lattice whose origin, orientation and handedness are arbitrary."""

    sites: NDArray[np.int64]
    """(k, 2) row and column; the smallest of each is 0."""
    dots: NDArray[np.int64]
    """(k,) indices into the detections."""
    residual_px: NDArray[np.float64]
    """(k,) distance of each dot from the position its neighbours predict; NaN with too few."""
    pitch_px: float
    """Median distance between neighbours."""

    @property
    def shape(self) -> tuple[int, int]:
        """Extent (rows, columns) of the lattice, including holes."""
        rows, columns = self.sites.max(axis=0) + 1
        return int(rows), int(columns)


def grow_lattice(detections: Detections) -> Lattice:
    """Return the largest lattice that the dots form.

    Raises LatticeError if it has fewer than 12 dots, or if no dot has four regular neighbours.
    """
    points = detections.centres_px
    if len(points) < _MIN_DOTS:
        raise LatticeError(
            f"only {len(points)} dots found, a lattice needs {_MIN_DOTS}: check the dots' "
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
    if len(best) < _MIN_DOTS:
        raise LatticeError(
            f"the {len(points)} dots found form no lattice: the largest piece has {len(best)}; "
            "check the dots' diameters in the detector's settings"
        )
    return _lattice_of(points, best)


def _seeds(points: NDArray[np.float64], tree: cKDTree) -> list[tuple[int, NDArray[np.float64]]]:
    """Dots with two pairs of opposite neighbours, most regular first, and their steps (2, 2)."""
    _, near = tree.query(points, min(9, len(points)))
    steps = points[near[:, 1:]] - points[:, None]
    a, b = np.triu_indices(steps.shape[1], 1)
    length = np.hypot(steps[..., 0], steps[..., 1])
    length = length[:, a] + length[:, b]
    sums = steps[:, a] + steps[:, b]
    skew = np.hypot(sums[..., 0], sums[..., 1]) / np.maximum(length, 1e-9)
    half = (steps[:, a] - steps[:, b]) / 2
    opposite = skew < _MAX_SKEW
    every = np.arange(len(points))
    first = np.where(opposite, length, np.inf).argmin(axis=1)
    u = half[every, first][:, None]
    across = np.abs(u[..., 0] * half[..., 1] - u[..., 1] * half[..., 0])
    sizes = np.hypot(u[..., 0], u[..., 1]) * np.hypot(half[..., 0], half[..., 1])
    crossing = opposite & opposite.any(axis=1)[:, None] & (across > _MIN_SINE * sizes)
    second = np.where(crossing, length, np.inf).argmin(axis=1)
    irregular = skew[every, first] + skew[every, second]
    seeds = np.flatnonzero(crossing.any(axis=1))
    seeds = seeds[np.argsort(irregular[seeds], kind="stable")]
    found = [(int(i), half[i, [first[i], second[i]]]) for i in seeds]
    return found[:_MAX_SEEDS] + found[:: max(1, len(found) // (4 * _MAX_SEEDS))]


def _grown(
    points: NDArray[np.float64], tree: cKDTree, seed: int, basis: NDArray[np.float64]
) -> dict[tuple[int, int], int]:
    placed = {(0, 0): seed}
    used = {seed}
    for step, vector in (((1, 0), basis[0]), ((0, 1), basis[1])):
        for sign in (1, -1):
            gap, dot = tree.query(points[seed] + sign * vector)
            if gap < _TOLERANCE * np.hypot(*vector) and int(dot) not in used:
                placed[sign * step[0], sign * step[1]] = int(dot)
                used.add(int(dot))
    if len(placed) < 5:
        return placed
    for _ in range(_MAX_BRIDGES):
        _rings(points, tree, placed, used)
        if len(placed) > _NEARLY_ALL * len(points):
            break
        more = dots_across_gaps(points, placed)
        if not more:
            break
        placed.update(more)
        used.update(more.values())
    for _ in range(3):
        _rings(points, tree, placed, used)
        wrong = [site for site, gap in _misfits(points, placed).items() if gap > _MAX_MISFIT]
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
    """Add ring after ring of sites; in each ring the dot nearest to its prediction comes first."""
    barren: set[tuple[int, int]] = set()
    reach = 1
    for _ in range(_MAX_RINGS):
        offers: list[tuple[float, tuple[int, int], int]] = []
        rim = sorted(_rim(placed, reach) - barren)
        position, pitch, support = _predicted(points, placed, rim)
        gaps, dots = tree.query(position)
        for k, site in enumerate(rim):
            if support[k] < 4:
                continue
            gap, dot = float(gaps[k] / pitch[k]), int(dots[k])
            if gap < _TOLERANCE and dot not in used:
                offers.append((gap, site, dot))
            elif support[k] >= 8:
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


def _neighbours(
    placed: dict[tuple[int, int], int], sites: Sequence[tuple[int, int]]
) -> NDArray[np.int64]:
    """Dots (n, 24) up to two rows and columns away from n sites; -1 where there is none."""
    known = np.array(list(placed), dtype=np.int64)
    wanted = np.array(sites, dtype=np.int64).reshape(-1, 1, 2) + _AROUND
    both = np.vstack([known, wanted.reshape(-1, 2)])
    low, high = both.min(axis=0), both.max(axis=0)
    table = np.full(high - low + 1, -1, dtype=np.int64)
    table[tuple((known - low).T)] = list(placed.values())
    return table[tuple(np.moveaxis(wanted - low, -1, 0))]


def _predicted(
    points: NDArray[np.float64],
    placed: dict[tuple[int, int], int],
    sites: Sequence[tuple[int, int]],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Positions (n, 2) of sites by affine fits to their neighbours, and local pitches (n,).

    The third value is the number (n,) of neighbours, 0 where they determine no fit.
    """
    dots = _neighbours(placed, sites)
    design = np.column_stack([np.ones(len(_AROUND)), _AROUND])
    # Near neighbours have a larger weight, because an affine fit ignores perspective.
    weight = (dots >= 0) / np.hypot(*_AROUND.T)
    normal = np.einsum("nk,ki,kj->nij", weight, design, design, optimize=True)
    right = np.einsum("nk,ki,nkc->nic", weight, design, points[dots], optimize=True)
    support = (dots >= 0).sum(axis=1)
    normal[support < 4] = np.zeros((3, 3))
    fits = np.linalg.cond(normal) <= _MAX_CONDITION
    normal[~fits] = np.eye(3)
    fit = np.linalg.solve(normal, right)
    pitch = np.hypot(fit[:, 1:, 0], fit[:, 1:, 1]).min(axis=1)
    return fit[:, 0], np.maximum(pitch, 1e-6), np.where(fits, support, 0)


def _misfits(
    points: NDArray[np.float64], placed: dict[tuple[int, int], int]
) -> dict[tuple[int, int], float]:
    """Distance in pitches of every dot with enough neighbours from their prediction."""
    sites = list(placed)
    position, pitch, support = _predicted(points, placed, sites)
    off = points[list(placed.values())] - position
    gaps = np.hypot(off[:, 0], off[:, 1]) / pitch
    return {sites[k]: float(gaps[k]) for k in np.flatnonzero(support >= 4)}


def _lattice_of(points: NDArray[np.float64], placed: dict[tuple[int, int], int]) -> Lattice:
    placed = _without_single_dots(_upright(points, placed))
    order = sorted(placed)
    sites = np.array(order, dtype=np.int64)
    dots = np.array([placed[site] for site in order], dtype=np.int64)
    residual = np.array([_quadratic_residual(points, placed, site) for site in order])
    steps = np.vstack([_steps(points, placed, 1, 0), _steps(points, placed, 0, 1)])
    return Lattice(
        sites=sites - sites.min(axis=0),
        dots=dots,
        residual_px=residual,
        pitch_px=float(np.median(np.hypot(*steps.T))),
    )


def _without_single_dots(placed: dict[tuple[int, int], int]) -> dict[tuple[int, int], int]:
    """Remove outermost rows and columns that have a single dot, which may be dirt."""
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
    """Vectors (n, 2) in px from every dot to the dot that is so many rows and columns away."""
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
    """Make the two shortest steps the axes, by Lagrange's reduction of the median steps.

    A seed with a missing neighbour may have taken a diagonal for an axis.
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


def _quadratic_residual(
    points: NDArray[np.float64], placed: dict[tuple[int, int], int], site: tuple[int, int]
) -> float:
    """Distance in px from a quadratic fit to the 5 x 5 neighbours; NaN if they are too few."""
    dots = _neighbours(placed, [site])[0]
    there = dots >= 0
    if np.count_nonzero(there) < 9:
        return float("nan")
    a, b = _AROUND[there].T
    design = np.column_stack([np.ones(len(a)), a, b, a * a, a * b, b * b])
    fit, _, rank, _ = np.linalg.lstsq(design, points[dots[there]], rcond=None)
    if rank < 6:
        return float("nan")
    return float(np.hypot(*(points[placed[site]] - fit[0])))
