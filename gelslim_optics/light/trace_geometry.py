"""A light scene as arrays for the compiled tracer."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from gelslim_optics.guide.profile import CLOSED_MM, Edge, Segment, half_turns
from gelslim_optics.light.scene import AIR, GEL, LightScene

ALWAYS, BONDED, GEL_ONLY = 0, 1, 2
NONE = -1
# Faces that are not edges of the profile: end of the guide, end of the gel.
END, GEL_END = -2, -3
CORNER_PART = 1e-9
# Columns of `facts` after the media on the left and right.
PRESENCE, OWNER, EXIT, CIRCLE = range(2, 6)


class TraceGeometry(NamedTuple):
    """The arrays of the kernel; arcs above 180 degrees are split into two edges.

    Attributes:
        shape: (e, 8) start and end (y, z), identical to the last bit where edges join, so that
            corners have no gaps; then centre, radius and sense ±1 of an arc, or the unit normal to
            the right of a segment and two zeros.
        facts: (e, 6) media on the left and right, where the edge is present along x, number of its
            name, whether light ends behind it, and a number for its circle (-1 for segments).
        near: (m, 1 + e) number and list of the edges that bound a medium; all for air, medium 0.
        coats: (m, 3) opaque, reflectance, diffuse.
        box: First and last x of the guide and of the gel, and the size of a corner in mm.
        marks: Medium beyond the end faces, gel, mapped edge.
    """

    shape: Any
    facts: Any
    near: Any
    coats: Any
    box: Any
    marks: Any


def pack(scene: LightScene) -> tuple[TraceGeometry, dict[str, int], tuple[float, float]]:
    """Arrays, numbers of the media, and the middle (y, z) of the profile, their origin."""
    names = [AIR, *(m for m in scene.media if m != AIR), *scene.surfaces]
    number = {name: i for i, name in enumerate(names)}
    middle, extent = _box(scene)
    faces = face_names(scene)
    pieces = [(faces.index(e.name), p) for e in scene.profile.edges for p in _pieces(e)]
    shape, circle = _shapes([p for _, p in pieces], middle)
    facts = [
        (number[p.left], number[p.right], _presence(scene, p), i, p.name in scene.feet, circle[k])
        for k, (i, p) in enumerate(pieces)
    ]
    geometry = TraceGeometry(
        shape=shape,
        facts=np.array(facts, dtype=np.int64),
        near=_near(facts, len(names)),
        coats=np.array([_coat(scene, name) for name in names], dtype=float),
        box=np.array([*scene.x_mm, *scene.gel_x_mm, CORNER_PART * extent], dtype=float),
        marks=np.array(
            [
                number[scene.ends],
                number.get(GEL, NONE),
                faces.index(scene.face) if scene.face in faces else NONE,
            ]
        ),
    )
    return geometry, number, middle


def face_names(scene: LightScene) -> tuple[str, ...]:
    """Names of the edges of the profile, each once, in order; flux is tallied by them."""
    return tuple(dict.fromkeys(edge.name for edge in scene.profile.edges))


def _box(scene: LightScene) -> tuple[tuple[float, float], float]:
    ends = [p for e in scene.profile.edges for p in (e.curve.start, e.curve.end)]
    low, high = np.min(ends, axis=0), np.max(ends, axis=0)
    middle = (float(low[0] + high[0]) / 2, float(low[1] + high[1]) / 2)
    return middle, float(np.max(high - low))


def _pieces(edge: Edge) -> list[Edge]:
    return [Edge(edge.name, curve, edge.left, edge.right) for curve in half_turns(edge.curve)]


def _shapes(pieces: list[Edge], middle: tuple[float, float]) -> tuple[Any, list[int]]:
    corners: list[tuple[float, float]] = []

    def corner(point: tuple[float, float]) -> tuple[float, float]:
        place = (point[0] - middle[0], point[1] - middle[1])
        for known in corners:
            if math.dist(known, place) <= CLOSED_MM:
                return known
        corners.append(place)
        return place

    rows, circle = [], []
    circles: list[tuple[float, float, float]] = []
    for piece in pieces:
        c = piece.curve
        ends = (*corner(c.start), *corner(c.end))
        if isinstance(c, Segment):
            (ay, az), (by, bz) = c.start, c.end
            normal = ((bz - az) / c.length_mm, (ay - by) / c.length_mm)
            rows.append((*ends, *normal, 0.0, 0.0))
            circle.append(NONE)
            continue
        ring = (c.centre[0] - middle[0], c.centre[1] - middle[1], c.radius_mm)
        if ring not in circles:
            circles.append(ring)
        rows.append((*ends, *ring, math.copysign(1.0, c.sweep_rad)))
        circle.append(circles.index(ring))
    return np.array(rows), circle


def _near(facts: list[tuple[int, int, int, int, bool, int]], media: int) -> Any:
    near = np.zeros((media, 1 + len(facts)), dtype=np.int64)
    for medium in range(media):
        edges = [e for e, fact in enumerate(facts) if medium == 0 or medium in fact[:2]]
        near[medium, : 1 + len(edges)] = [len(edges), *edges]
    return near


def _coat(scene: LightScene, name: str) -> tuple[float, float, float]:
    coat = scene.surfaces.get(name)
    if name in scene.media or coat is None:
        return (0.0, 0.0, 0.0)
    return (1.0, coat.reflectance, float(coat.diffuse))


def _presence(scene: LightScene, edge: Edge) -> int:
    if GEL not in (edge.left, edge.right):
        return ALWAYS
    other = edge.right if edge.left == GEL else edge.left
    return BONDED if other in scene.media and other != AIR else GEL_ONLY


# Columns of the sums; then one per edge for each of leaked, stopped and returned flux.
ABSORBED, MISSED, FOOT_REFLECTION, TRUNCATED, LOST, ENDS, GEL_ENDS, ENDS_STOPPED = range(8)
ARRIVED, ELEVATION, SLOPE, SLOPE_ALONG, ENTERED_GEL, CROSSINGS, CORNERS, PER_EDGE = range(8, 16)


def columns(edges: int) -> int:
    """Number of sums for a profile of that many edges."""
    return PER_EDGE + 3 * edges
