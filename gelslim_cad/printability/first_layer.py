"""What stands on the plate: area, sharp edges that the first layer squeezes out, openings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gelslim_cad.printability.surface import Array, Numbers, Surface

ON_PLATE_MM = 1e-3
FLAT = 0.999
UPRIGHT = 0.35
"""Walls within 20° of the vertical form a sharp edge with the plate; a chamfer does not."""


@dataclass(frozen=True)
class FirstLayer:
    """What stands on the plate.

    Attributes:
        area_mm2: Area on the plate.
        sharp_mm: Length of edges without a chamfer: there the first layer, which is squeezed flat,
            stands out by 0.1 to 0.3 mm ("elephant foot").
        openings: Holes and windows that begin at the plate with a sharp edge; they get narrower.
    """

    area_mm2: float
    sharp_mm: float
    openings: int


def first_layer(surface: Surface) -> FirstLayer:
    """Measure the face on the plate."""
    low = surface.corners_mm[:, :, 2].max(axis=1) < ON_PLATE_MM
    standing = low & (surface.normals[:, 2] < -FLAT)
    pairs, edges = surface.edges
    border = standing[pairs].sum(axis=1) == 1
    pairs, edges = pairs[border], edges[border]
    beyond = np.where(standing[pairs[:, 0]], pairs[:, 1], pairs[:, 0])
    sharp = np.abs(surface.normals[beyond, 2]) < UPRIGHT
    ends = surface.mesh.vertices_mm[edges[sharp]]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    area = float(surface.areas_mm2[standing].sum())
    return FirstLayer(area, float(lengths.sum()), _openings(surface, edges, sharp))


def _openings(surface: Surface, edges: Numbers, sharp: Array) -> int:
    """Loops of edges that another loop surrounds, most of them sharp."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    if not len(edges):
        return 0
    used, compact = np.unique(edges, return_inverse=True)
    compact = compact.reshape(-1, 2)
    graph = coo_array((np.ones(len(edges)), (compact[:, 0], compact[:, 1])), shape=(len(used),) * 2)
    count, labels = connected_components(graph, directed=False)
    loop = labels[compact[:, 0]]
    points = surface.mesh.vertices_mm[used, :2]
    openings = 0
    for number in range(count):
        own = loop == number
        within = any(
            _surrounds(points[labels == other], points[labels == number])
            for other in range(count)
            if other != number
        )
        openings += bool(within and sharp[own].mean() > 0.5)
    return openings


def _surrounds(outer: Array, inner: Array) -> bool:
    """Whether the box of one loop holds that of another."""
    holds_low = (outer.min(axis=0) <= inner.min(axis=0)).all()
    return bool(holds_low and (outer.max(axis=0) >= inner.max(axis=0)).all())
