"""A slow tracer of single rays: a reference for the compiled one, without its data structures.

Every ray is a point and a direction in space. It goes to the nearest face of the extruded profile
or end plane, is divided by Fresnel's equations in their form with angles, and both parts are
followed until they are weaker than a limit. Nothing is random.
"""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.guide.profile import Edge, Segment
from gelslim_optics.light.scene import AIR, GEL, LightScene
from gelslim_optics.light.source import Source

Vector = NDArray[np.float64]
Ledger = dict[str, float]
AHEAD_MM = 1e-7


@dataclass(frozen=True)
class Hit:
    """A face on a ray: its distance, its edge (None: a plane across x), and both media."""

    distance_mm: float
    edge: Edge | None
    normal: Vector
    """Unit normal along the ray."""
    before: str
    beyond: str
    entry: str
    """Name under which light that ends here is booked."""


@dataclass(frozen=True)
class Ray:
    point: Vector
    direction: Vector
    medium: str
    weight: float
    left_through: str


def _crossings(edge: Edge, ray: Ray) -> list[tuple[float, Vector]]:
    """Distances at which the ray's line meets an edge, and the normals to the edge's right."""
    (y, z), (dy, dz) = ray.point[1:], ray.direction[1:]
    curve = edge.curve
    if isinstance(curve, Segment):
        (ay, az), (by, bz) = curve.start, curve.end
        normal = np.array([bz - az, ay - by]) / math.dist(curve.start, curve.end)
        speed = normal @ (dy, dz)
        if speed == 0:
            return []
        t = float(normal @ (ay - y, az - z) / speed)
        place = np.array([y + t * dy - ay, z + t * dz - az])
        part = place @ (by - ay, bz - az) / math.dist(curve.start, curve.end) ** 2
        return [(t, normal)] if 0 <= part <= 1 else []
    centre = np.array(curve.centre)
    offset, way = np.array([y, z]) - centre, np.array([dy, dz])
    square = way @ way
    if square == 0:
        return []
    nearest = -float(offset @ way) / square
    half_chord = curve.radius_mm**2 - float(np.sum((offset + nearest * way) ** 2))
    if half_chord <= 0:
        return []
    found = []
    for t in (nearest - math.sqrt(half_chord / square), nearest + math.sqrt(half_chord / square)):
        outward = (offset + t * way) / curve.radius_mm
        turned = math.atan2(outward[1], outward[0]) - curve.start_rad
        sense = math.copysign(1, curve.sweep_rad)
        if (sense * turned) % (2 * math.pi) <= abs(curve.sweep_rad):
            found.append((t, sense * outward))
    return found


class SlowTracer:
    """Follows rays of one source through a scene and books where their weight goes."""

    def __init__(
        self, scene: LightScene, source: Source, cut: float, bins: tuple[int, int]
    ) -> None:
        self.scene, self.cut = scene, cut
        self.colour = source.colour, source.wavelength_um
        self.book: Ledger = defaultdict(float)
        self.map = np.zeros(bins)
        gel = [e for e in scene.profile.edges if GEL in (e.left, e.right)]
        self.gel_outline = np.array(
            [
                e.curve.at(k / 200)
                for e in (scene.profile.outline(GEL) if gel else ())
                for k in range(201)
            ]
        )

    def index(self, medium: str) -> float:
        return self.scene.media[medium].index_for(*self.colour)

    def follow(self, first: Ray) -> None:
        waiting = [first]
        while waiting:
            ray = waiting.pop()
            if ray.weight < self.cut:
                self.book["truncated"] += ray.weight
                continue
            waiting.extend(self.step(ray))

    def step(self, ray: Ray) -> list[Ray]:
        self.book["crossings"] += 1
        hit = min(self._hits(ray), key=lambda h: h.distance_mm, default=None)
        if hit is None:
            self.book[f"leaked.{ray.left_through}"] += ray.weight
            return []
        point = ray.point + hit.distance_mm * ray.direction
        if hit.edge is None:
            planes = (*self.scene.x_mm, *self.scene.gel_x_mm)
            point[0] = min(planes, key=lambda x: abs(x - point[0]))
        lost = self.scene.media[ray.medium].absorption_per_mm * hit.distance_mm
        weight = ray.weight * math.exp(-lost)
        self.book["absorbed"] += ray.weight - weight
        if hit.before in self.scene.surfaces or (
            ray.medium == AIR and hit.entry in self.scene.feet
        ):
            self.book[f"leaked.{ray.left_through}"] += weight
            return []
        cosine = float(ray.direction @ hit.normal)
        mirrored = ray.direction - 2 * cosine * hit.normal
        if hit.beyond in self.scene.surfaces:
            if hit.entry == self.scene.face:
                self._arrive(point, ray.direction, hit, weight)
            kept = weight * self.scene.surfaces[hit.beyond].reflectance
            ends = hit.edge is None
            self.book["stopped.ends" if ends else f"stopped.{hit.entry}"] += weight - kept
            return [Ray(point, mirrored, ray.medium, kept, ray.left_through)] if kept else []
        share, onward = self._divided(ray, hit, cosine)
        inside = (1 - share) * weight
        parts = [Ray(point, mirrored, ray.medium, share * weight, ray.left_through)]
        parts += self._passed(ray, hit, point, onward, inside)
        return [part for part in parts if part.weight > 0]

    def _divided(self, ray: Ray, hit: Hit, cosine: float) -> tuple[float, Vector]:
        """The reflected share, and the direction of the refracted ray."""
        n1, n2 = self.index(ray.medium), self.index(hit.beyond)
        along_face = ray.direction - cosine * hit.normal
        sine = float(np.linalg.norm(along_face))
        if n1 * sine >= n2:
            return 1.0, ray.direction
        i, t = math.asin(min(sine, 1.0)), math.asin(n1 * sine / n2)
        onward = n1 / n2 * along_face + math.cos(t) * hit.normal
        if n1 == n2:
            return 0.0, onward
        if i < 1e-7:
            return ((n1 - n2) / (n1 + n2)) ** 2, onward
        s, p = math.sin(i - t) / math.sin(i + t), math.tan(i - t) / math.tan(i + t)
        return (s * s + p * p) / 2, onward

    def _passed(
        self, ray: Ray, hit: Hit, point: Vector, onward: Vector, weight: float
    ) -> list[Ray]:
        """What becomes of the refracted part."""
        if weight == 0:
            return []
        if hit.edge is not None and self._bonded(hit.edge):
            self.book["entered_gel"] += weight * ((hit.beyond == GEL) - (ray.medium == GEL))
        at_end = hit.edge is None and point[0] in self.scene.x_mm
        if hit.beyond == AIR and (at_end or hit.entry in self.scene.feet):
            kind = "returned" if hit.entry in self.scene.feet else "leaked"
            self.book[f"{kind}.{hit.entry}"] += weight
            return []
        left = ray.left_through
        if hit.beyond == AIR and ray.medium != AIR:
            left = hit.entry
        return [Ray(point, onward, hit.beyond, weight, left)]

    def _arrive(self, point: Vector, direction: Vector, hit: Hit, weight: float) -> None:
        assert hit.edge is not None
        tangent = np.array([0.0, -hit.normal[2], hit.normal[1]])
        tangent *= math.copysign(1, tangent[1])
        cosine = float(direction @ hit.normal)
        self.book["arrived"] += weight
        self.book["elevation"] += weight * (math.pi / 2 - math.acos(min(cosine, 1.0)))
        self.book["slope"] -= weight * float(direction @ tangent) / cosine
        self.book["slope_along"] -= weight * float(direction[0]) / cosine
        curve = hit.edge.curve
        if isinstance(curve, Segment):
            part = math.dist(curve.start, point[1:]) / curve.length_mm
        else:
            angle = math.atan2(point[2] - curve.centre[1], point[1] - curve.centre[0])
            part = (angle - curve.start_rad) % (2 * math.pi) / abs(curve.sweep_rad)
            if curve.sweep_rad < 0:
                part = (curve.start_rad - angle) % (2 * math.pi) / abs(curve.sweep_rad)
        if curve.start[0] > curve.end[0]:
            part = 1 - part
        low, high = self.scene.gel_x_mm
        nx, ny = self.map.shape
        self.map[int(nx * (point[0] - low) / (high - low)), int(ny * part)] += weight

    def _bonded(self, edge: Edge) -> bool:
        others = {edge.left, edge.right} - {GEL, AIR}
        return GEL in (edge.left, edge.right) and others <= set(self.scene.media) and bool(others)

    def _hits(self, ray: Ray) -> list[Hit]:
        return [*self._edge_hits(ray), *self._plane_hits(ray)]

    def _edge_hits(self, ray: Ray) -> list[Hit]:
        hits = []
        for edge in self.scene.profile.edges:
            for t, right in _crossings(edge, ray):
                x = ray.point[0] + t * ray.direction[0]
                if t < AHEAD_MM or not self.scene.x_mm[0] <= x <= self.scene.x_mm[1]:
                    continue
                media = [edge.left, edge.right]
                if GEL in media and not self.scene.gel_x_mm[0] <= x <= self.scene.gel_x_mm[1]:
                    if not self._bonded(edge):
                        continue
                    media[media.index(GEL)] = AIR
                if right @ ray.direction[1:] < 0:
                    right, media = -right, media[::-1]
                seen = media[0] == ray.medium or (
                    ray.medium == AIR and media[0] in self.scene.surfaces
                )
                if seen:
                    normal = np.array([0.0, *right])
                    hits.append(Hit(t, edge, normal, media[0], media[1], edge.name))
        return hits

    def _plane_hits(self, ray: Ray) -> list[Hit]:
        """End planes of guide and gel; from the air only those of the gel where the gel is."""
        dx = ray.direction[0]
        if dx == 0:
            return []
        normal = np.array([math.copysign(1, dx), 0.0, 0.0])
        if ray.medium != AIR:
            low, high = self.scene.gel_x_mm if ray.medium == GEL else self.scene.x_mm
            plane = high if dx > 0 else low
            t = float((plane - ray.point[0]) / dx)
            beyond = self.scene.ends if plane in self.scene.x_mm else AIR
            entry = "gel_ends" if ray.medium == GEL else "ends"
            return [Hit(max(t, 0.0), None, normal, ray.medium, beyond, entry)]
        low, high = self.scene.gel_x_mm
        plane = low if dx > 0 else high
        t = float((plane - ray.point[0]) / dx)
        if t < AHEAD_MM or not len(self.gel_outline):
            return []
        if not self._in_gel(ray.point[1:] + t * ray.direction[1:]):
            return []
        return [Hit(t, None, normal, AIR, GEL, "gel_ends")]

    def _in_gel(self, place: Vector) -> bool:
        """Whether a point of the section is in the gel, by the angle that its outline turns."""
        corners = self.gel_outline - place
        angles = np.unwrap(np.arctan2(corners[:, 1], corners[:, 0]))
        return abs(float(angles[-1] - angles[0])) > math.pi
