"""The folded view by plane geometry, for single numbers: a slow reference for `fold`.

Points and directions in the mid-plane are complex numbers x + iz. Rays are refracted face by face
with Snell's law, lines are met by solving two equations, and the camera is turned as a whole.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import fields

from scipy.optimize import brentq

from gelslim_cad.dimensions.fold_problem import FoldProblem


class Problem:
    """One design's limits as plain numbers, under the names of `FoldProblem`."""

    def __init__(self, problem: FoldProblem, row: int) -> None:
        for field in fields(FoldProblem):
            setattr(self, field.name, float(getattr(problem, field.name)[row, 0, 0]))

    def __getattr__(self, name: str) -> float:
        raise AttributeError(name)


def in_layers_mm(p: Problem, angle_rad: float) -> float:
    """How far a ray of this angle in air goes sideways within guide and gel."""
    total = 0.0
    for height, index in ((p.guide_thickness_mm, p.guide_index), (p.gel_total_mm, p.gel_index)):
        total += height * math.tan(math.asin(math.sin(angle_rad) / index))
    return total


def met(start: complex, along: complex, other: complex, other_along: complex) -> float:
    """How far from `start` in units of `along` two lines meet."""
    apart = other - start
    return (apart.conjugate() * other_along).imag / (along.conjugate() * other_along).imag


class Layout:
    """One candidate: every length of `Fold`, and the limits that it misses."""

    def __init__(self, p: Problem, mid_rad: float, spread: float, mirror_rad: float) -> None:
        self.p = p
        self.window_z = -(p.guide_thickness_mm + p.gel_total_mm)
        self.half_rad = math.atan(p.half_vertical_tan)
        self.near_rad, self.far_rad = (mid_rad + k * spread * self.half_rad for k in (-1, 1))
        self.mirror_rad = mirror_rad
        self._place_virtual_camera()
        self._corners_of_the_gel()
        self._mirror()
        self._camera()

    def _place_virtual_camera(self) -> None:
        p = self.p
        needed = p.gel_length_mm - in_layers_mm(p, self.far_rad) + in_layers_mm(p, self.near_rad)
        self.air = max(needed / (math.tan(self.far_rad) - math.tan(self.near_rad)), 1.0)
        reach = self.air * math.tan(self.near_rad) + in_layers_mm(p, self.near_rad)
        self.virtual = complex(-p.gel_length_mm / 2 - reach, self.window_z - self.air)

    def _ray_to_corner(self, sign: int) -> tuple[float, float]:
        """Slopes dx/dz and dy/dz in air of the ray to a corner of the gel."""
        p = self.p
        along = sign * p.gel_length_mm / 2 - self.virtual.real
        across = p.gel_width_mm / 2
        reach = math.hypot(along, across)

        def beyond(angle_rad: float) -> float:
            return self.air * math.tan(angle_rad) + in_layers_mm(p, angle_rad) - reach

        slope = math.tan(brentq(beyond, 0.0, math.pi / 2 - 1e-9, xtol=1e-15))
        return slope * along / reach, slope * across / reach

    def _corners_of_the_gel(self) -> None:
        near, far = self._ray_to_corner(-1), self._ray_to_corner(1)
        self.near_across, self.far_across = near[1], far[1]
        self.near_slope = min(math.tan(self.near_rad), near[0])
        self.far_slope = max(math.tan(self.far_rad), far[0])
        low, high = math.atan(self.near_slope), math.atan(self.far_slope)
        # Upright, unless the far rays are then outside of the picture.
        self.tilt = min(max(0.0, high - self.half_rad), low + self.half_rad)
        axis = (math.sin(self.tilt), math.cos(self.tilt))
        self.horizontal_tan = max(c[1] / (c[0] * axis[0] + axis[1]) for c in (near, far))
        self.vertical_tan = math.tan(max(high - self.tilt, self.tilt - low))

    def _mirror(self) -> None:
        p = self.p
        self.up_the_mirror = cmath.rect(1.0, self.mirror_rad)
        near_ray, far_ray = complex(self.near_slope, 1.0), complex(self.far_slope, 1.0)
        self.near_ray = near_ray
        glass_z = self.window_z - p.clearance_mm
        view_z = glass_z - (p.mirror_border_mm * self.up_the_mirror).imag
        self.upper = self.virtual + (view_z - self.virtual.imag) * far_ray
        self.length = -met(self.upper, self.up_the_mirror, self.virtual, near_ray)
        self.lower = self.upper - self.length * self.up_the_mirror
        self.glass_end = self.lower - p.mirror_border_mm * self.up_the_mirror
        back = self.glass_end - 1j * self.up_the_mirror * p.mirror_thickness_mm
        self.mirror_depth = self.window_z - back.imag

    def reflected(self, point: complex) -> complex:
        turned = (point - self.upper) / self.up_the_mirror
        return self.upper + turned.conjugate() * self.up_the_mirror

    def _camera(self) -> None:
        p = self.p
        self.pinhole = self.reflected(self.virtual)
        towards_gel = complex(math.sin(self.tilt), math.cos(self.tilt))
        self.ahead = self.reflected(self.virtual + towards_gel) - self.pinhole
        self.above = 1j * self.ahead
        rear = p.lens_height_mm + p.module_depth_mm
        half, radius = p.module_height_mm / 2, p.lens_diameter_mm / 2
        self.corners = [
            self.pinhole + back * -self.ahead + sign * side * self.above
            for back, side in ((0.0, radius), (p.lens_height_mm, half), (rear, half))
            for sign in (1, -1)
        ]
        self.bottom = min(c.imag for c in self.corners)
        self.camera_depth = self.window_z - self.bottom + p.clearance_mm
        self.depth = max(self.mirror_depth, self.camera_depth, p.guide_stack_mm)

    @property
    def apparent_mm(self) -> tuple[float, float, float]:
        """Distances along the axis to the images of both edges, and along the normal."""
        p = self.p
        height = self.air + p.guide_thickness_mm / p.guide_index + p.gel_total_mm / p.gel_index
        axis = complex(math.sin(self.tilt), math.cos(self.tilt))
        near, far = (
            (complex(height * math.tan(a), height) * axis.conjugate()).real
            for a in (self.near_rad, self.far_rad)
        )
        return near, far, height

    @property
    def keystone(self) -> float:
        near, far, _ = self.apparent_mm
        return max(near / far, far / near)

    def near_edge_x(self, z: float) -> float:
        return (self.virtual + (z - self.virtual.imag) * self.near_ray).real

    @property
    def ledge_z(self) -> float:
        return self.window_z - self.p.ledge_depth_mm

    @property
    def ledge_x(self) -> float:
        before_view = self.near_edge_x(self.ledge_z) - self.p.clearance_mm
        return min(-self.p.gel_length_mm / 2 - 0.2, before_view)

    def missed(self) -> dict[str, float]:
        """Every limit, as a part of its scale."""
        lengths = {
            "mirror below window": max(-self.length, (self.virtual - self.lower).imag),
            "camera below window": max(c.imag for c in self.corners)
            - (self.window_z - self.p.clearance_mm),
            "camera beside view": max(c.real - self.near_edge_x(c.imag) for c in self.corners)
            + self.p.clearance_mm,
            "camera clear of mirror": self._camera_in_mirror(),
            "view below ledge": max(
                self._view_in_ledge(self.ledge_x),
                self._view_in_ledge(self.ledge_x - self.p.ledge_reach_mm),
            ),
            "mirror before camera": (self.pinhole - self.glass_end).real + self.p.clearance_mm,
            "camera clear of ledge": self._camera_in_ledge(),
        }
        return {**self._picture(), **{name: value / 10 for name, value in lengths.items()}}

    def _picture(self) -> dict[str, float]:
        p = self.p
        near, far, height = self.apparent_mm
        # Focused so that both edges are equally blurred, relative to their distance.
        focus = 1 / ((1 / near + 1 / far) / 2)
        blur = max(p.aperture_mm * abs(d - focus) / focus for d in (near, far))
        most = max(near, far)
        px = p.focal_px * p.marker_diameter_mm / most * min(1.0, height / most)
        travel = 0.0
        if focus < p.focus_nearest_mm:
            beyond_focal = max(focus - p.focal_length_mm, 1e-3)
            travel = p.focal_length_mm**2 / beyond_focal
        return {
            "field of view along": self.vertical_tan / p.half_vertical_tan - 1,
            "field of view across": self.horizontal_tan / p.half_horizontal_tan - 1,
            "blur": blur / p.blur_limit_mm - 1,
            "pixels per marker": p.min_px_per_marker / px - 1,
            "keystone": self.keystone / p.max_keystone - 1,
            "lens travel": (travel - p.lens_travel_mm) / max(p.lens_travel_mm, 0.1),
            "air gap": 2.0 - self.air,
        }

    def _camera_in_mirror(self) -> float:
        gap = self.p.clearance_mm
        heights = [((c - self.upper) / self.up_the_mirror).imag for c in self.corners]
        below = gap - min(heights)
        behind = max(c.real for c in self.corners) - self.glass_end.real + gap
        return min(below, behind)

    def _view_in_ledge(self, x: float) -> float:
        if x <= self.pinhole.real:
            return -math.inf
        part = (x - self.pinhole.real) / (self.upper - self.pinhole).real
        seen_z = (self.pinhole + part * (self.upper - self.pinhole)).imag
        return seen_z + self.p.clearance_mm - self.ledge_z

    def _camera_in_ledge(self) -> float:
        p = self.p
        edge = complex(self.ledge_x - p.ledge_reach_mm, self.ledge_z)
        local = (edge - self.pinhole) / self.ahead
        outside = min(
            max(local.real + p.lens_height_mm, local.imag - p.module_height_mm / 2),
            max(local.real, local.imag - p.lens_diameter_mm / 2),
        )
        under = [min((c - edge).real, (c - edge).imag + p.clearance_mm) for c in self.corners]
        return max(p.clearance_mm - outside, *under)

    def worst(self) -> float:
        return sum(max(value, 0.0) for value in self.missed().values())

    def objective(self) -> float:
        rear = min(c.real for c in self.corners)
        if self.worst() > 1e-9:
            return 1000 * (1 + self.worst())
        return self.depth + 0.02 * (self.keystone - 1) - 0.002 * rear
