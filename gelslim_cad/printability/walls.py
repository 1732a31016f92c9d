"""Least thickness of the walls of a part, by rays from its surface inwards."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gelslim_cad.printability.surface import Array, Surface

LONGEST_MM = 4.0
"""Thicker walls are no concern of any process."""
SKIN_MM = 1e-4
"""How far within the surface a ray begins, so that it misses its own facet."""
FACING = -0.94
"""Cosine between the normals of both sides (160°): wedges at an edge are no walls."""
LEAST_AREA_MM2 = 1.0
"""A wall is as thin as the thinnest 1 mm² of it: corners between facets do not count."""
AREA_OF_RAY_MM2 = 0.4
"""Surface for each ray: five rays meet a wall of 1 mm², two sides of it."""
MOST_PAIRS = 6e7
"""Of rays and facets; it limits the rays of a part with many facets."""
LEAST_RAYS = 500
SEED = 5


@dataclass(frozen=True)
class Wall:
    """The thinnest wall: its thickness and a point on it, mm."""

    thickness_mm: float
    at_mm: tuple[float, float, float]


def least_wall(surface: Surface) -> Wall | None:
    """The thinnest wall of a part; None where all are thicker than `LONGEST_MM`.

    Rays begin at points spread evenly over the surface and run inwards along the normal. Where one
    leaves through a facet that faces the first, the distance is a thickness, and stands for an
    equal share of the surface; the thinnest 1 mm² on one side counts.
    """
    from gelslim_cad.printability.thickness_kernel import first_hits

    area = float(surface.areas_mm2.sum())
    count = int(max(LEAST_RAYS, min(area / AREA_OF_RAY_MM2, MOST_PAIRS / len(surface.areas_mm2))))
    points, facets = surface.samples(count, SEED)
    inwards = -surface.normals[facets]
    distances, hits = first_hits(
        points + SKIN_MM * inwards, inwards, surface.corners_mm, LONGEST_MM
    )
    facing = np.einsum("nd,nd->n", surface.normals[hits], surface.normals[facets]) < FACING
    found = np.flatnonzero((hits >= 0) & facing)
    if not len(found):
        return None
    order = found[np.argsort(distances[found], kind="stable")]
    # Both sides of a wall are sampled, so that 1 mm² of wall has 2 mm² of surface.
    needed = int(np.ceil(2 * LEAST_AREA_MM2 / (area / count)))
    if len(order) < needed:
        return None
    chosen = order[needed - 1]
    thickness = float(distances[chosen]) + SKIN_MM
    return Wall(round(thickness, 4), _rounded(points[chosen]))


def _rounded(point: Array) -> tuple[float, float, float]:
    x, y, z = np.round(point, 3).tolist()
    return x, y, z
