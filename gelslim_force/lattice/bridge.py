"""Gaps in a growing lattice bridged: where half the dots are missing, neighbours give out.

Seen through a camera a plane lattice is a homography of its indices, but for the lens and the
bending of the light. Near the dots placed already it is true to a part of a pitch.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from gelslim_force.lattice.view import fit_homography

_SPAN = 4
"""Sites that are bridged at most."""
_GATE = 0.2
_FEWEST = 16


def bridged(
    points: NDArray[np.float64], placed: dict[tuple[int, int], int]
) -> dict[tuple[int, int], int]:
    """Return more sites and their dots, up to four sites from those `placed`; may be none.

    `points` (n, 2) px are all dots. A dot counts that lies within a fifth of a pitch of a site's
    place by the homography of the sites placed, and a site and a dot are used once.
    """
    if len(placed) < _FEWEST:
        return {}
    sites = np.array(list(placed), dtype=np.int64)
    matrix = fit_homography(sites.astype(float), points[list(placed.values())])
    low, high = sites.min(axis=0) - _SPAN, sites.max(axis=0) + _SPAN
    near = np.zeros(tuple(high - low + 1), dtype=bool)
    for a, b in sites - low:
        near[max(0, a - _SPAN) : a + _SPAN + 1, max(0, b - _SPAN) : b + _SPAN + 1] = True
    near[tuple((sites - low).T)] = False
    open_sites = np.argwhere(near) + low
    free = np.setdiff1d(np.arange(len(points)), list(placed.values()))
    if len(open_sites) == 0 or len(free) == 0:
        return {}
    places = _mapped(matrix, open_sites)
    pitch = np.minimum(
        *(
            np.hypot(*(_mapped(matrix, open_sites + step) - places).T)
            for step in (np.array([1, 0]), np.array([0, 1]))
        )
    )
    gap, dot = cKDTree(points[free]).query(places)
    found: dict[tuple[int, int], int] = {}
    taken: set[int] = set()
    with np.errstate(invalid="ignore"):
        share = gap / pitch
    for k in np.argsort(share, kind="stable"):
        if not share[k] < _GATE:
            break
        if int(dot[k]) not in taken:
            taken.add(int(dot[k]))
            found[int(open_sites[k, 0]), int(open_sites[k, 1])] = int(free[dot[k]])
    return found


def _mapped(matrix: NDArray[np.float64], sites: NDArray[np.int64]) -> NDArray[np.float64]:
    """Places (k, 2) of sites; infinitely far where they lie behind the camera."""
    image = np.column_stack([sites, np.ones(len(sites))]) @ matrix.T
    ahead = image[:, 2] > 1e-9
    places = np.full((len(sites), 2), 1e9)
    places[ahead] = image[ahead, :2] / image[ahead, 2:]
    return places
