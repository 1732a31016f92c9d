"""Faces that hang in the air while a part is printed: their area and how far they span.

|  wall  |            support          A region of facets steeper than the limit rests on the
|        |______________|   |          walls that go down from its edges. Its span is twice
|       region          |   |          the largest distance of a point of it to them: the
|________               |   |          width of a bridge, twice the length of a cantilever.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gelslim_cad.printability.surface import Array, Numbers, Surface, points_on

ON_PLATE_MM = 1e-3
ANGLE_TOLERANCE_DEG = 1.0
"""Facets of a cone at the limit differ from it by less."""
LEAST_AREA_MM2 = 0.5
"""Smaller regions, as the tops of small bores, print well in every process."""
SPACING_MM = 0.1
"""Of the points along the walls, from which distances are taken."""
POINTS_PER_MM2 = 4.0
LEAST_POINTS, MOST_POINTS = 200, 4000
SEED = 7


@dataclass(frozen=True)
class Overhang:
    """A region that hangs in the air.

    Attributes:
        area_mm2: Its area.
        span_mm: Twice the largest distance to a wall that carries it; infinite where none does.
        over_part: Whether the part itself lies below, so that a support would stand on it.
        steepest_deg: Steepest angle from the vertical; 90 for a ceiling.
        at_mm: Its point farthest from the walls.
    """

    area_mm2: float
    span_mm: float
    over_part: bool
    steepest_deg: float
    at_mm: tuple[float, float, float]


def overhangs(surface: Surface, limit_deg: float) -> tuple[Overhang, ...]:
    """Regions of facets that lean out farther than a limit, the widest span first.

    Args:
        surface: The part as it stands on the plate.
        limit_deg: Steepest angle from the vertical that needs no support.

    Returns:
        All regions above the plate of at least 0.5 mm².
    """
    down = -surface.normals[:, 2]
    limit = math.sin(math.radians(min(limit_deg + ANGLE_TOLERANCE_DEG, 89.5)))
    above = surface.corners_mm[:, :, 2].max(axis=1) > ON_PLATE_MM
    hanging = (down > limit) & above & (surface.areas_mm2 > 0)
    labels, count = _regions(surface, hanging)
    found = [_overhang(surface, labels, number) for number in range(count)]
    return tuple(sorted((o for o in found if o is not None), key=lambda o: -o.span_mm))


def _regions(surface: Surface, members: Array) -> tuple[Numbers, int]:
    """Number of each facet's region (m,), -1 outside, and how many there are."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    pairs, _ = surface.edges
    inner = pairs[members[pairs].all(axis=1)]
    size = len(members)
    graph = coo_array((np.ones(len(inner)), (inner[:, 0], inner[:, 1])), shape=(size, size))
    _, labels = connected_components(graph, directed=False)
    kept, numbers = np.unique(labels[members], return_inverse=True)
    result = np.full(size, -1, dtype=np.int64)
    result[members] = numbers
    return result, len(kept)


def _overhang(surface: Surface, labels: Numbers, number: int) -> Overhang | None:
    facets = np.flatnonzero(labels == number)
    area = float(surface.areas_mm2[facets].sum())
    if area < LEAST_AREA_MM2:
        return None
    steepest = math.degrees(math.asin(min(1.0, float(-surface.normals[facets, 2].min()))))
    carried = _carrying_points(surface, labels, number)
    points = _points_in(surface, facets, area)
    farthest, span = 0, math.inf
    if len(carried):
        from scipy.spatial import cKDTree

        distances, _ = cKDTree(carried[:, :2]).query(points[:, :2])
        farthest = int(np.argmax(distances))
        span = 2 * float(distances[farthest])
    return Overhang(
        area, span, _part_below(surface, points[farthest]), steepest, _rounded(points[farthest])
    )


def _part_below(surface: Surface, point: Array) -> bool:
    """Whether something of the part lies between a point and the plate."""
    x, y, z = point
    corners = surface.corners_mm
    near = (corners[:, :, 2].max(axis=1) < z - ON_PLATE_MM) & (corners[:, :, 2].max(axis=1) > 0)
    low, high = corners[:, :, :2].min(axis=1), corners[:, :, :2].max(axis=1)
    box = near & (low <= (x, y)).all(axis=1) & (high >= (x, y)).all(axis=1)
    a, b, c = (corners[box, k, :2] - (x, y) for k in range(3))
    turns = [p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0] for p, q in ((a, b), (b, c), (c, a))]
    signs = np.sign(np.array(turns))
    return bool(((signs >= 0).all(axis=0) | (signs <= 0).all(axis=0)).any()) if box.any() else False


def _carrying_points(surface: Surface, labels: Numbers, number: int) -> Array:
    """Points along the edges of a region from which the part goes down, or on the plate (n, 3)."""
    pairs, edges = surface.edges
    ours = labels[pairs] == number
    border = ours[:, 0] != ours[:, 1]
    pairs, edges, ours = pairs[border], edges[border], ours[border]
    beyond = np.where(ours[:, 0], pairs[:, 1], pairs[:, 0])
    ends = surface.mesh.vertices_mm[edges]
    along = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(along, axis=1)
    into = surface.opposite_mm(beyond, edges) - ends[:, 0]
    share = np.einsum("nd,nd->n", into, along) / np.maximum(length, 1e-12) ** 2
    into = into - share[:, None] * along
    on_plate = ends[:, :, 2].max(axis=1) < ON_PLATE_MM
    goes_down = into[:, 2] < -1e-6 * np.maximum(np.linalg.norm(into, axis=1), 1e-9)
    carries = goes_down | on_plate
    ends, length = ends[carries], length[carries]
    counts = np.maximum(2, np.ceil(length / SPACING_MM).astype(np.int64) + 1)
    which = np.repeat(np.arange(len(ends)), counts)
    place = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
    part = (place / (counts[which] - 1))[:, None]
    return np.asarray(ends[which, 0] * (1 - part) + ends[which, 1] * part)


def _points_in(surface: Surface, facets: Numbers, area_mm2: float) -> Array:
    """Points spread evenly over a region, and its corners (n, 3)."""
    rng = np.random.default_rng(SEED)
    count = int(np.clip(area_mm2 * POINTS_PER_MM2, LEAST_POINTS, MOST_POINTS))
    share = np.cumsum(surface.areas_mm2[facets])
    places = (np.arange(count) + rng.random(count)) / count * share[-1]
    chosen = facets[np.minimum(np.searchsorted(share, places), len(facets) - 1)]
    corners = surface.corners_mm[facets].reshape(-1, 3)
    return np.concatenate([points_on(surface.corners_mm[chosen], rng), corners])


def _rounded(point: Array) -> tuple[float, float, float]:
    x, y, z = np.round(point, 3).tolist()
    return x, y, z
