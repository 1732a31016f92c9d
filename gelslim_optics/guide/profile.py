"""Cross-section of a light guide: segments and arcs with the media on both sides.

The plane is (y, z): y across the finger, z out of the gel. The same profile is certified, traced
and extruded to the CAD solid. A face that two bodies share is one edge with a left and a right
medium, never two coincident edges.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Point = tuple[float, float]
Array = NDArray[np.float64]
CLOSED_MM = 1e-9


@dataclass(frozen=True)
class Segment:
    """Straight edge from `start` to `end`."""

    start: Point
    end: Point

    @property
    def length_mm(self) -> float:
        """Distance of the two ends."""
        return math.dist(self.start, self.end)

    def at(self, part: float) -> Point:
        """Point at the fraction `part` (0 to 1) of the length."""
        (a, b), (c, d) = self.start, self.end
        return (a + part * (c - a), b + part * (d - b))


@dataclass(frozen=True)
class Arc:
    """Circular edge about `centre` through `sweep_rad`, which is above 0 counter-clockwise."""

    centre: Point
    radius_mm: float
    start_rad: float
    sweep_rad: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.radius_mm) and self.radius_mm > 0):
            raise ValueError(f"arc radius_mm = {self.radius_mm!r}: must be a finite length > 0")
        if not 0 < abs(self.sweep_rad) <= 2 * math.pi:
            raise ValueError(f"arc sweep_rad = {self.sweep_rad!r}: must be in ±(0, 2π]")

    @property
    def start(self) -> Point:
        """First point."""
        return self.at(0.0)

    @property
    def end(self) -> Point:
        """Last point."""
        return self.at(1.0)

    @property
    def length_mm(self) -> float:
        """Length along the arc."""
        return self.radius_mm * abs(self.sweep_rad)

    def at(self, part: float) -> Point:
        """Point at the fraction `part` (0 to 1) of the length."""
        angle = self.start_rad + part * self.sweep_rad
        y, z = self.centre
        return (y + self.radius_mm * math.cos(angle), z + self.radius_mm * math.sin(angle))


@dataclass(frozen=True)
class Edge:
    """An edge with the names of the media on its left and right, seen along its direction."""

    name: str
    curve: Segment | Arc
    left: str
    right: str

    def reversed(self) -> Edge:
        """The same face in the opposite direction; its media change sides."""
        c = self.curve
        if isinstance(c, Segment):
            turned: Segment | Arc = Segment(c.end, c.start)
        else:
            turned = Arc(c.centre, c.radius_mm, c.start_rad + c.sweep_rad, -c.sweep_rad)
        return Edge(self.name, turned, self.right, self.left)


@dataclass(frozen=True)
class Bend:
    """Two concentric arcs that bound the guide, with inner radius R and thickness t."""

    centre: Point
    inner_radius_mm: float
    outer_radius_mm: float
    sweep_rad: float

    @property
    def thickness_mm(self) -> float:
        """Thickness t, outer less inner radius."""
        return self.outer_radius_mm - self.inner_radius_mm

    @property
    def ratio(self) -> float:
        """R / t."""
        return self.inner_radius_mm / self.thickness_mm


@dataclass(frozen=True)
class GuideProfile:
    """All edges of a cross-section. Media are names; the scene gives their refractive indices.

    Attributes:
        edges: The edges, in any order.

    Raises:
        ValueError: An edge has the same medium on both sides, or no length.
    """

    edges: tuple[Edge, ...]

    def __post_init__(self) -> None:
        for edge in self.edges:
            if edge.left == edge.right:
                raise ValueError(f"edge {edge.name} has {edge.left} on both sides")
            if not edge.curve.length_mm > CLOSED_MM:
                raise ValueError(f"edge {edge.name} has no length")

    def edge(self, name: str) -> Edge:
        """The edge with the given name. Raises KeyError where there is none."""
        for edge in self.edges:
            if edge.name == name:
                return edge
        raise KeyError(f"the profile has no edge called {name}")

    def outline(self, medium: str) -> tuple[Edge, ...]:
        """The closed loop of edges around `medium`, counter-clockwise, the medium on the left.

        Raises ValueError where the edges do not form one closed loop.
        """
        free = [e if e.left == medium else e.reversed() for e in self.edges if touches(e, medium)]
        if not free:
            raise ValueError(f"the profile contains no {medium}")
        loop = [free.pop(0)]
        while free:
            end = loop[-1].curve.end
            following = [e for e in free if math.dist(e.curve.start, end) <= CLOSED_MM]
            if not following:
                raise ValueError(f"the outline of {medium} is open after edge {loop[-1].name}")
            free.remove(following[0])
            loop.append(following[0])
        if math.dist(loop[-1].curve.end, loop[0].curve.start) > CLOSED_MM:
            raise ValueError(f"the outline of {medium} is open after edge {loop[-1].name}")
        return tuple(loop)

    def area_mm2(self, medium: str) -> float:
        """Area of the region of a medium, exact for arcs (Green's theorem)."""
        return sum(_swept(edge.curve) for edge in self.outline(medium))

    def contains(self, medium: str, y_mm: Array, z_mm: Array) -> NDArray[np.bool_]:
        """Whether points lie in the regions of a medium, exact for arcs.

        The winding number about a point is that of the polygon of the chords, plus 1 for each
        counter-clockwise arc with the point between it and its chord, less 1 for each clockwise
        one.

        Args:
            medium: The name of the medium; False everywhere for one that no edge meets.
            y_mm: Coordinates across the finger, of any shape.
            z_mm: Coordinates out of the gel, of the same shape.

        Returns:
            True for the points within, of the shape of `y_mm`.
        """
        y, z = np.asarray(y_mm, dtype=float), np.asarray(z_mm, dtype=float)
        turns = np.zeros(y.shape, dtype=np.int64)
        for edge in self.edges:
            if touches(edge, medium):
                curve = (edge if edge.left == medium else edge.reversed()).curve
                for piece in half_turns(curve):
                    turns += _winding(piece, y, z)
        return np.asarray(turns > 0)

    def bends(self, medium: str = "acrylic") -> tuple[Bend, ...]:
        """Pairs of concentric arcs of equal sweep around `medium`, in the order of the edges."""
        arcs = [
            (e, e.curve if e.left == medium else e.reversed().curve)
            for e in self.edges
            if touches(e, medium) and isinstance(e.curve, Arc)
        ]
        outer = [c for _, c in arcs if isinstance(c, Arc) and c.sweep_rad > 0]
        inner = [c for _, c in arcs if isinstance(c, Arc) and c.sweep_rad < 0]
        return tuple(
            Bend(o.centre, i.radius_mm, o.radius_mm, o.sweep_rad)
            for o in outer
            for i in inner
            if math.dist(o.centre, i.centre) <= 1e-6 * o.radius_mm
            and abs(o.sweep_rad + i.sweep_rad) <= 1e-6
            and i.radius_mm < o.radius_mm
        )


def touches(edge: Edge, medium: str) -> bool:
    """Whether a medium is on one side of the edge."""
    return medium in (edge.left, edge.right)


def half_turns(curve: Segment | Arc) -> tuple[Segment | Arc, ...]:
    """The curve itself, or the two halves of an arc above 180 degrees."""
    if isinstance(curve, Segment) or abs(curve.sweep_rad) <= math.pi * (1 + 1e-12):
        return (curve,)
    half = curve.sweep_rad / 2
    first = Arc(curve.centre, curve.radius_mm, curve.start_rad, half)
    return first, Arc(curve.centre, curve.radius_mm, curve.start_rad + half, half)


def _winding(curve: Segment | Arc, y: Array, z: Array) -> NDArray[np.int64]:
    """Part of one curve in the winding number about each point; see `GuideProfile.contains`."""
    (ay, az), (by, bz) = curve.start, curve.end
    left = (by - ay) * (z - az) - (bz - az) * (y - ay)
    upward, downward = (az <= z) & (z < bz) & (left > 0), (bz <= z) & (z < az) & (left < 0)
    turns = upward.astype(np.int64) - downward.astype(np.int64)
    if isinstance(curve, Arc):
        (cy, cz), sense = curve.centre, math.copysign(1, curve.sweep_rad)
        within = np.hypot(y - cy, z - cz) < curve.radius_mm
        turns += int(sense) * (within & (sense * left < 0))
    return turns


def _swept(curve: Segment | Arc) -> float:
    """½ ∮ (y dz - z dy) along one edge."""
    (a, b), (c, d) = curve.start, curve.end
    if isinstance(curve, Segment):
        return (a * d - b * c) / 2
    (y, z), r = curve.centre, curve.radius_mm
    return (y * (d - b) - z * (c - a) + r * r * curve.sweep_rad) / 2
