"""Cross-section of a light guide: segments and arcs with the media on both sides.

The plane is (y, z): y across the finger, z out of the gel. The same profile is certified, traced
and extruded to the CAD solid. A face that two bodies share is one edge with a left and a right
medium, never two coincident edges.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

Point = tuple[float, float]
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


def _swept(curve: Segment | Arc) -> float:
    """½ ∮ (y dz - z dy) along one edge."""
    (a, b), (c, d) = curve.start, curve.end
    if isinstance(curve, Segment):
        return (a * d - b * c) / 2
    (y, z), r = curve.centre, curve.radius_mm
    return (y * (d - b) - z * (c - a) + r * r * curve.sweep_rad) / 2


def facetted_profile(
    profile: GuideProfile, facet_deg: float, margin_deg: float, *, allow: bool = False
) -> GuideProfile:
    """The profile with each arc of acrylic replaced by equal chords, as in a mesh.

    The normal of a facet differs from that of the arc by up to half the angle of the facet.
    Light that the arc guides with a smaller margin θ - θc than this may leak, however small the
    distance between chord and arc is.

    Args:
        profile: The profile with arcs.
        facet_deg: Largest angle of one chord, above 0 and at most 90.
        margin_deg: Margin of total reflection of the light that the arcs guide.
        allow: Whether facets above twice the margin are allowed.

    Returns:
        The profile; the chords of an arc keep its name.

    Raises:
        ValueError: `facet_deg` is out of range, or above twice the margin without `allow`.
    """
    if not 0 < facet_deg <= 90:
        raise ValueError(f"facet_deg = {facet_deg!r}: must be over 0 and at most 90")
    if facet_deg / 2 > margin_deg and not allow:
        raise ValueError(
            f"facets of {facet_deg:g}° turn the normal by up to {facet_deg / 2:g}°, more than the "
            f"margin of total reflection of {margin_deg:g}°, and would leak light that the arc "
            "guides; trace the exact arcs, or use smaller facets"
        )
    edges: list[Edge] = []
    for edge in profile.edges:
        edges.extend(_chords(edge, facet_deg))
    return GuideProfile(tuple(edges))


def _chords(edge: Edge, facet_deg: float) -> list[Edge]:
    arc = edge.curve
    if not isinstance(arc, Arc) or not touches(edge, "acrylic"):
        return [edge]
    count = max(1, math.ceil(math.degrees(abs(arc.sweep_rad)) / facet_deg - 1e-9))
    corners: list[Point] = [arc.at(i / count) for i in range(count + 1)]
    return [replace(edge, curve=Segment(a, b)) for a, b in pairwise(corners)]
