"""What the homography of a lattice predicts: dots across gaps, and which sites are in the picture.

The image of a plane lattice is a homography of its indices, apart from the distortion of the lens
and from refraction. Near the dots that are already assigned it is accurate to a part of a pitch.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

_BORDER_PX = 6.0
_MAX_GAP = 4
"""Largest distance, in sites, from an assigned dot to one that is added across a gap."""
_TOLERANCE = 0.2
_MIN_DOTS = 16


def dots_across_gaps(
    points: NDArray[np.float64], placed: dict[tuple[int, int], int]
) -> dict[tuple[int, int], int]:
    """Return further sites with their dots, up to four sites away from the assigned ones.

    `points` (n, 2) px are all dots and `placed` the dots of the sites assigned so far. A dot is
    taken if it lies within a fifth of a pitch of the position that the homography through the
    assigned dots predicts for a site. Each site and each dot is used once.
    """
    if len(placed) < _MIN_DOTS:
        return {}
    sites = np.array(list(placed), dtype=np.int64)
    matrix = fit_homography(sites.astype(float), points[list(placed.values())])
    low, high = sites.min(axis=0) - _MAX_GAP, sites.max(axis=0) + _MAX_GAP
    near = np.zeros(tuple(high - low + 1), dtype=bool)
    for a, b in sites - low:
        near[max(0, a - _MAX_GAP) : a + _MAX_GAP + 1, max(0, b - _MAX_GAP) : b + _MAX_GAP + 1] = (
            True
        )
    near[tuple((sites - low).T)] = False
    open_sites = np.argwhere(near) + low
    free = np.setdiff1d(np.arange(len(points)), list(placed.values()))
    if len(open_sites) == 0 or len(free) == 0:
        return {}
    positions = _mapped(matrix, open_sites)
    pitch = np.minimum(
        *(
            np.hypot(*(_mapped(matrix, open_sites + step) - positions).T)
            for step in (np.array([1, 0]), np.array([0, 1]))
        )
    )
    gap, dot = cKDTree(points[free]).query(positions)
    found: dict[tuple[int, int], int] = {}
    taken: set[int] = set()
    with np.errstate(invalid="ignore"):
        share = gap / pitch
    for k in np.argsort(share, kind="stable"):
        if not share[k] < _TOLERANCE:
            break
        if int(dot[k]) not in taken:
            taken.add(int(dot[k]))
            found[int(open_sites[k, 0]), int(open_sites[k, 1])] = int(free[dot[k]])
    return found


def _mapped(matrix: NDArray[np.float64], sites: NDArray[np.int64]) -> NDArray[np.float64]:
    """Positions (k, 2) of sites; far outside the picture for sites behind the camera."""
    image = np.column_stack([sites, np.ones(len(sites))]) @ matrix.T
    ahead = image[:, 2] > 1e-9
    positions = np.full((len(sites), 2), 1e9)
    positions[ahead] = image[ahead, :2] / image[ahead, 2:]
    return positions


def seen_sites(
    sites: NDArray[np.int64], points_px: NDArray[np.float64], reach: int, shape: tuple[int, int]
) -> NDArray[np.bool_]:
    """Return which sites are in the picture, as a table (rows + 2 reach, columns + 2 reach).

    A homography through the sites (k, 2) that were seen at `points_px` (k, 2) predicts the
    positions of the others. Site (0, 0) is at (reach, reach) of the table. Sites within 6 px of
    the border of a picture of `shape` (height, width) do not count.
    """
    rows, columns = sites.max(axis=0) + 1
    table = np.argwhere(np.ones((rows + 2 * reach, columns + 2 * reach), dtype=bool)) - reach
    matrix = fit_homography(sites.astype(float), points_px)
    image = np.column_stack([table, np.ones(len(table))]) @ matrix.T
    depth = image[:, 2]
    ahead = depth > 1e-3 * np.median(np.column_stack([sites, np.ones(len(sites))]) @ matrix[2])
    with np.errstate(divide="ignore", invalid="ignore"):
        x, y = image[:, 0] / depth, image[:, 1] / depth
    seen = ahead & (x > _BORDER_PX) & (y > _BORDER_PX)
    seen &= (x < shape[1] - 1 - _BORDER_PX) & (y < shape[0] - 1 - _BORDER_PX)
    return seen.reshape(rows + 2 * reach, columns + 2 * reach)


def fit_homography(source: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (3, 3) homography from points (k, 2) to points (k, 2), with positive depth there.

    Direct linear transform with normalised coordinates (R. Hartley, "In defense of the
    eight-point algorithm", IEEE TPAMI 19, 1997); it minimises the algebraic error.
    """
    from_, to = _normaliser(source), _normaliser(target)
    s = np.column_stack([source, np.ones(len(source))]) @ from_.T
    t = np.column_stack([target, np.ones(len(target))]) @ to.T
    zero = np.zeros_like(s)
    system = np.vstack(
        [
            np.hstack([s, zero, -t[:, :1] * s]),
            np.hstack([zero, s, -t[:, 1:2] * s]),
        ]
    )
    solution = np.linalg.eigh(system.T @ system)[1][:, 0].reshape(3, 3)
    matrix = np.linalg.inv(to) @ solution @ from_
    depth = np.column_stack([source, np.ones(len(source))]) @ matrix[2]
    result: NDArray[np.float64] = matrix * np.sign(np.median(depth))
    return result


def _normaliser(points: NDArray[np.float64]) -> NDArray[np.float64]:
    middle = points.mean(axis=0)
    size = float(np.sqrt(2) / max(np.hypot(*(points - middle).T).mean(), 1e-12))
    return np.array([[size, 0, -size * middle[0]], [0, size, -size * middle[1]], [0, 0, 1.0]])
