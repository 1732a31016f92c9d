"""The folded view by plane geometry, for single numbers: a slow reference for `fold`.

Points and directions in the mid-plane are complex numbers x + iz. Rays are refracted face by face
with Snell's law, lines are met by solving two equations, and the camera is turned as a whole.
"""

from __future__ import annotations

import cmath
import math
from copy import copy
from dataclasses import fields
from typing import TypeVar

import numpy as np
from scipy.optimize import brentq

from gelslim_cad.dimensions.fold.problem import FoldProblem


class Problem:
    """One design's limits as plain numbers, under the names of `FoldProblem`."""

    def __init__(self, problem: FoldProblem, row: int) -> None:
        for field in fields(FoldProblem):
            setattr(self, field.name, float(getattr(problem, field.name)[row, 0, 0]))

    def __getattr__(self, name: str) -> float:
        raise AttributeError(name)


Number = TypeVar("Number", float, complex)
Images = tuple[tuple[float, float], tuple[float, float]]
Points = np.ndarray
NODES = 65
"""Points of an edge of the gel at which a distorted picture is looked at."""
STEP = 1e-20
"""Imaginary part of an angle by which a derivative is exact to rounding."""


def in_layers_mm(p: Problem, angle_rad: Number) -> Number:
    """How far a ray of this angle in air goes sideways within guide and gel."""
    m = cmath if isinstance(angle_rad, complex) else math
    total = 0.0 * angle_rad
    for height, index in ((p.guide_thickness_mm, p.guide_index), (p.gel_total_mm, p.gel_index)):
        total += height * m.tan(m.asin(m.sin(angle_rad) / index))
    return total


def met(start: complex, along: complex, other: complex, other_along: complex) -> float:
    """How far from `start` in units of `along` two lines meet."""
    apart = other - start
    return (apart.conjugate() * other_along).imag / (along.conjugate() * other_along).imag


def drawn(p: Problem, at: Points) -> Points:
    """Where the ideal image points h + iv are drawn; beyond the sensor as large as at its rim."""
    r = np.maximum(np.minimum(abs(at), p.most_tan), 1e-9)
    if p.fisheye:
        t = np.arctan(r)
        seen = t + p.k1 * t**3 + p.k2 * t**5 + p.k3 * t**7 + p.k4 * t**9
    else:
        seen = r + p.k1 * r**3 + p.k2 * r**5 + p.k3 * r**7 + p.k4 * r**9
    h, v, squared = at.real, at.imag, abs(at) ** 2
    across = 2 * p.p1 * h * v + p.p2 * (squared + 2 * h * h)
    along = p.p1 * (squared + 2 * v * v) + 2 * p.p2 * h * v
    return at * (seen / r) + across + 1j * along


def drawn_scale(p: Problem, at: complex) -> tuple[float, float]:
    """How much longer than ideal short lines across and along are drawn, but for decentring."""
    plain = copy(p)
    plain.p1 = plain.p2 = 0.0
    steps = 1e-6 * np.array([1, 1j])
    moved = drawn(plain, at + steps) - drawn(plain, at - steps)
    return tuple(abs(moved) / 2e-6)


class Layout:
    """One candidate: every length of `Fold`, and the limits that it misses."""

    def __init__(
        self, p: Problem, rays_rad: tuple[float, float], mirror_rad: float, tilt_rad: float
    ) -> None:
        """A layout between two rays to the gel's edges; its axis is tilted as it is told."""
        self.p = p
        self.window_z = -(p.guide_thickness_mm + p.gel_total_mm)
        self.near_rad, self.far_rad = rays_rad
        self.mirror_rad = mirror_rad
        self.tilt = tilt_rad
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
        p = self.p
        self.corner_rays = near, far = self._ray_to_corner(-1), self._ray_to_corner(1)
        self.near_across, self.far_across = near[1], far[1]
        self.near_slope = min(math.tan(self.near_rad), near[0])
        self.far_slope = max(math.tan(self.far_rad), far[0])
        ends = [
            (complex(math.tan(angle)), complex(*corner))
            for angle, corner in zip((self.near_rad, self.far_rad), self.corner_rays, strict=True)
        ]
        self.edges = [np.array(pair) for pair in ends]
        self.side = np.array([complex(*near), complex(*far)])
        if self.distorted:
            x, y = p.gel_length_mm / 2, np.linspace(0, p.gel_width_mm / 2, NODES)
            self.edges = [
                np.append(edge, self._rays_to(sign * x, y))
                for edge, sign in zip(self.edges, (-1, 1), strict=True)
            ]
            along = np.linspace(-x, x, NODES)
            self.side = np.append(self.side, self._rays_to(along, p.gel_width_mm / 2))
        images = self._images_of(self.side, self.tilt)
        mirrored = np.append(images, -images.conjugate())
        self.horizontal_tan = abs(drawn(p, mirrored).real).max()
        self.vertical_tan = max(self._reach_along(k, self.tilt) for k in (0, 1))

    @property
    def distorted(self) -> bool:
        p = self.p
        return any((p.fisheye, p.k1, p.k2, p.k3, p.k4, p.p1, p.p2))

    def _rays_to(self, x: Points | float, y: Points | float) -> Points:
        """Slopes dx/dz + i dy/dz in air of rays to points of the gel, by a table of angles."""
        angles = np.linspace(0, 1.55, 20_001)
        reach = self.air * np.tan(angles)
        for height, index in (
            (self.p.guide_thickness_mm, self.p.guide_index),
            (self.p.gel_total_mm, self.p.gel_index),
        ):
            reach += height * np.tan(np.arcsin(np.sin(angles) / index))
        away = (x - self.virtual.real) + 1j * y
        return np.tan(np.interp(abs(away), reach, angles)) * away / abs(away)

    def _images_of(self, slopes: Points, tilt: float) -> Points:
        """Ideal images h + iv of rays."""
        ahead = slopes.real * math.sin(tilt) + math.cos(tilt)
        return (slopes.imag + 1j * (slopes.real * math.cos(tilt) - math.sin(tilt))) / ahead

    def _reach_along(self, edge: int, tilt: float) -> float:
        """How far out the near (0) or far (1) edge is drawn along the finger."""
        images = self._images_of(self.edges[edge], tilt)
        found = drawn(self.p, np.append(images, -images.conjugate())).imag
        return float(found.max() if edge else -found.min())

    def least_tilt_rad(self) -> float:
        """Upright, unless the far rays are then outside of the picture of a lens focused there."""

        def too_small(tilt: float) -> float:
            half = self.p.half_along_mm / self.image_mm(self.spans_at_mm(tilt))
            near, far = (self._reach_along(k, tilt) / half - 1 for k in (0, 1))
            return min(max(-tilt, far), -near)

        return brentq(too_small, *self._tilts(), xtol=1e-13)

    def _tilts(self) -> tuple[float, float]:
        """Tilts between which both edges are before the camera."""
        return math.atan(self.far_slope) - 1.55, math.atan(self.near_slope) + 1.55

    def focus_mm(self, spans: Images) -> float:
        """Where the nearest and the farthest image are equally blurred, relative to distance."""
        nearest, farthest = (f(f(edge) for edge in spans) for f in (min, max))
        return self.p.fixed_focus_mm or 1 / ((1 / nearest + 1 / farthest) / 2)

    def image_mm(self, spans: Images) -> float:
        """1/f = 1/s + 1/v, unless the image stays in its place."""
        beyond_focal = max(self.focus_mm(spans) - self.p.focal_length_mm, 1e-3)
        image = self.p.focal_length_mm * self.focus_mm(spans) / beyond_focal
        return self.p.fixed_image_mm or image

    @property
    def extension_mm(self) -> float:
        moved = self.image_mm(self.spans_mm) - self.p.focal_length_mm
        return moved if self.p.moving_lens else 0.0

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
        front, face = p.entrance_pupil_mm - p.lens_height_mm, p.entrance_pupil_mm
        face += self.extension_mm
        self.face, self.front = face, front
        half, radius = p.module_height_mm / 2, p.lens_diameter_mm / 2
        self.corners = [
            self.pinhole + back * -self.ahead + sign * side * self.above
            for back, side in ((front, radius), (face, half), (face + p.module_depth_mm, half))
            for sign in (1, -1)
        ]
        self.bottom = min(c.imag for c in self.corners)
        self.camera_depth = self.window_z - self.bottom + p.clearance_mm
        self.depth = max(self.mirror_depth, self.camera_depth, p.guide_stack_mm)

    @property
    def images_mm(self) -> Images:
        """Distances along the axis to the middle of both edges, by sagittal and tangential rays."""
        return self._edge_at_mm(self.near_rad, self.tilt), self._edge_at_mm(self.far_rad, self.tilt)

    @property
    def spans_mm(self) -> Images:
        return self.spans_at_mm(self.tilt)

    def spans_at_mm(self, tilt_rad: float) -> Images:
        """The nearest and the farthest image of each edge, its corners included."""
        near, far = (
            (*self._edge_at_mm(angle, tilt_rad), *self._corner_at_mm(corner, tilt_rad))
            for angle, corner in zip((self.near_rad, self.far_rad), self.corner_rays, strict=True)
        )
        return (min(near), max(near)), (min(far), max(far))

    def _edge_at_mm(self, angle_rad: float, tilt_rad: float) -> tuple[float, float]:
        """A fan of rays from the pupil, turned about the normal or widened, sets the distance."""
        turned, widened = self._seen_along_ray_mm(angle_rad)
        cos = math.cos(angle_rad - tilt_rad)
        return turned * cos, widened * cos

    def _corner_at_mm(self, slopes: tuple[float, float], tilt_rad: float) -> tuple[float, float]:
        turned, widened = self._seen_along_ray_mm(math.atan(math.hypot(*slopes)))
        ray, axis = (*slopes, 1.0), (math.sin(tilt_rad), 0.0, math.cos(tilt_rad))
        cos = sum(map(math.prod, zip(ray, axis, strict=True))) / math.hypot(*ray)
        return turned * cos, widened * cos

    def _seen_along_ray_mm(self, angle_rad: float) -> tuple[float, float]:
        reach = self._reach_mm(complex(angle_rad, STEP))
        widened = reach.imag / STEP
        turned = reach.real / math.sin(angle_rad) if abs(angle_rad) > 1e-9 else widened
        return turned, widened * math.cos(angle_rad)

    def _reach_mm(self, angle_rad: complex) -> complex:
        return self.air * cmath.tan(angle_rad) + in_layers_mm(self.p, angle_rad)

    def along_scale(self, angle_rad: float) -> float:
        """Length in the image of a unit length along the finger."""
        ray = complex(angle_rad, STEP)
        image = self.image_mm(self.spans_mm) * cmath.tan(ray - self.tilt)
        return image.imag / self._reach_mm(ray).imag

    @property
    def keystone(self) -> float:
        (near, _), (far, _) = self.images_mm
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
        focus, image = self.focus_mm(self.spans_mm), self.image_mm(self.spans_mm)
        distances = (d for edge in self.spans_mm for d in edge)
        blur = max(p.aperture_mm * abs(d - focus) / focus for d in distances)
        least = min(map(min, self.scales()))
        px = least * p.marker_diameter_mm / p.pixel_pitch_mm
        travel = self.extension_mm if focus < p.focus_nearest_mm else 0.0
        return {
            "field of view along": self._beyond_half_view(image) - 1,
            "field of view across": self.horizontal_tan / (p.half_across_mm / image) - 1,
            "blur": blur / p.blur_limit_mm - 1,
            "pixels per marker": p.min_px_per_marker / px - 1,
            "keystone": self.keystone / p.max_keystone - 1,
            "lens travel": (travel - p.lens_travel_mm) / max(p.lens_travel_mm, 0.1),
            "air gap": 2.0 - self.air,
        }

    def _beyond_half_view(self, image: float) -> float:
        """Image of the far rim of a view whose near rim is the picture's, by half the picture."""
        half = (1 - 1e-6) * self.p.half_along_mm / image
        tilt = brentq(lambda t: self._reach_along(0, t) - half, *self._tilts(), xtol=1e-15)
        return self._reach_along(1, tilt) * image / self.p.half_along_mm

    def scales(self) -> list[tuple[float, float]]:
        """Length in the image of a unit length across and along each edge, as it is drawn."""
        found = []
        image = self.image_mm(self.spans_mm)
        for k, angle in enumerate((self.near_rad, self.far_rad)):
            ends = self._images_of(self.edges[k][:2], self.tilt)
            stretch = np.min([drawn_scale(self.p, at) for at in ends], axis=0)
            ideal = image / self.images_mm[k][0], self.along_scale(angle)
            found.append(tuple(np.array(ideal) * (stretch if self.distorted else 1)))
        return found

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
            max(local.real + self.face, local.imag - p.module_height_mm / 2),
            max(local.real + self.front, local.imag - p.lens_diameter_mm / 2),
        )
        under = [min((c - edge).real, (c - edge).imag + p.clearance_mm) for c in self.corners]
        return max(p.clearance_mm - outside, *under)

    def worst(self) -> float:
        return sum(max(value, 0.0) for value in self.missed().values())

    def _on_camera(self, before_face: float, z: float) -> complex:
        """The point at a height on the plane so far before the housing's front face."""
        start = self.pinhole + (before_face - self.face) * self.ahead
        return start + met(start, self.above, complex(0.0, z), 1.0 + 0.0j) * self.above

    @property
    def length_mm(self) -> float:
        """From the tip to the end of the mount block."""
        p, fit = self.p, self.p.fit_clearance_mm
        start = self.upper + p.mirror_border_mm * self.up_the_mirror
        mirror_rear = (start - 1j * self.up_the_mirror * p.mirror_thickness_mm).real
        ledge = p.gel_length_mm / 2 + 0.2
        if p.clearance_mm < p.ledge_depth_mm + fit:
            ledge = max(ledge, mirror_rear + fit)
        tip = max(ledge + p.end_support_mm, mirror_rear) + fit + p.tip_wall_mm
        bar = -(p.module_depth_mm + p.clamp_play_mm + 1.5)
        foot = self._on_camera(bar, self.window_z - self.depth)
        top = self.pinhole + (bar - self.face) * self.ahead + p.module_height_mm / 2 * self.above
        rear = min(foot.real, top.real, *(c.real for c in self.corners))
        bezel = self.ledge_x - p.end_support_mm - fit - p.tip_wall_mm
        chamber = min(rear - p.cable_behind_mm - fit, bezel - 1.0)
        return tip - chamber + p.mount_length_mm

    def beyond(self) -> dict[str, float]:
        """Every limit of the housing, in mm."""
        p, fit = self.p, self.p.fit_clearance_mm
        half_width = p.mirror_border_mm + max(
            self.near_across * (self.lower - self.virtual).imag,
            self.far_across * (self.upper - self.virtual).imag,
        )
        play = p.clamp_play_mm
        lips = play + max(min(1.2, self.face - self.front - play - 0.2), 0.0)
        ends = (self.window_z - self.depth, self.glass_end.imag)
        foremost = max(self._on_camera(lips, z).real for z in ends)
        channel = self.ledge_x - p.end_support_mm - fit - 1.2
        beside = max(
            p.baffle_inner_y_mm - p.clamp_width_mm / 2, channel - max(c.real for c in self.corners)
        )
        cable, cover_z = self._cable_z(), self.window_z - self.depth
        return {
            "thickness": self.depth - p.max_depth_mm,
            "length": self.length_mm - p.max_length_mm,
            "mirror between baffles": half_width + 2 * fit - p.baffle_inner_y_mm,
            "clamp before seat": foremost + fit + 1.0 - self.glass_end.real,
            "clamp beside channel": 0.15 - beside,
            "cable over cover": p.cable_over_cover_mm - (cable - cover_z),
            "cable under roof": cable + p.cable_under_skin_mm,
            "clamp floor": 1.0 - (self._clamp_bottom_z() - cover_z) if p.cable_side == -1 else -1e4,
        }

    def _cable_z(self) -> float:
        """Height at which the cable runs: behind the end of a bend that turns it to -x."""
        p = self.p
        rear = self.pinhole - (self.face + p.module_depth_mm) * self.ahead
        if p.cable_side == 0:
            out, start = -self.ahead, rear - (p.clamp_play_mm + 1.5) * self.ahead
        else:
            out = p.cable_side * self.above
            start = rear + p.cable_half_mm * self.ahead + p.module_height_mm / 2 * out
        # An arc to the left or right ends in the direction of -x.
        turn = math.copysign(1.0, out.imag)
        end = start + turn * p.cable_radius_mm * (1j * out - 1j * -1.0)
        return float(end.imag)

    def _clamp_bottom_z(self) -> float:
        """Lowest point under the module between its front face and the clamp's rear."""
        p = self.p
        below = -(p.module_height_mm / 2 + p.clamp_play_mm) * self.above
        rear = -(p.module_depth_mm + p.clamp_play_mm + 1.5)
        ends = [self.pinhole + (part - self.face) * self.ahead + below for part in (0.0, rear)]
        return float(min(end.imag for end in ends))

    def objective(self) -> float:
        if self.worst() > 1e-9:
            return 1e6 * (1 + self.worst())
        thickness, length, *clashes = self.beyond().values()
        if (beyond := max(thickness, length, *(1000 * clash for clash in clashes))) > 1e-9:
            return 1e5 + beyond
        return self.goal()

    def goal(self) -> float:
        p, missed = self.p, self.missed()
        use = 1 + max(missed["field of view along"], missed["field of view across"])
        px = p.min_px_per_marker / (1 + missed["pixels per marker"])
        wanted = p.depth_worth * self.depth + p.length_worth * self.length_mm
        tie = 1e-4 * self.length_mm - 2e-3 * use + 1e-3 * self.keystone
        return wanted - p.pixel_worth_mm * px + tie
