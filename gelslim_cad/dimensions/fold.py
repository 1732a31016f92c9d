"""Camera, mirror and gel in the finger's mid-plane: one candidate of the folded view.

Coordinates x (towards the tip) and z (out of the gel) of the sensor frame. A candidate is given
by the air angles of the two marginal rays that end on the gel's edges and by the mirror angle;
everything else follows in closed form, exact refraction included (PHYSICS: camera, fold mirror).
Every field is an array; candidates broadcast against designs.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.refraction import lateral_reach, ray_slope

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FoldProblem:
    """What the fold must satisfy, each (n, 1, 1) for n designs."""

    gel_length_mm: Array
    gel_width_mm: Array
    gel_total_mm: Array
    gel_index: Array
    guide_thickness_mm: Array
    guide_index: Array
    half_horizontal_tan: Array
    half_vertical_tan: Array
    focal_length_mm: Array
    focal_px: Array
    aperture_mm: Array
    lens_travel_mm: Array
    focus_nearest_mm: Array
    module_height_mm: Array
    module_depth_mm: Array
    lens_diameter_mm: Array
    lens_height_mm: Array
    mirror_thickness_mm: Array
    mirror_border_mm: Array
    clearance_mm: Array
    ledge_depth_mm: Array
    ledge_reach_mm: Array
    guide_stack_mm: Array
    marker_diameter_mm: Array
    blur_limit_mm: Array
    min_px_per_marker: Array
    max_keystone: Array

    def __len__(self) -> int:
        return len(self.gel_length_mm)

    def rows(self, chosen: slice | NDArray[np.intp]) -> FoldProblem:
        """The designs in `chosen`."""
        return FoldProblem(**{f.name: getattr(self, f.name)[chosen] for f in fields(self)})


@dataclass(frozen=True)
class Fold:
    """One candidate (or, solved, one layout) per design; lengths mm, angles rad."""

    near_ray_rad: Array
    far_ray_rad: Array
    tilt_rad: Array
    air_height_mm: Array
    virtual_x_mm: Array
    virtual_z_mm: Array
    mirror_rad: Array
    pitch_rad: Array
    mirror_upper_x_mm: Array
    mirror_upper_z_mm: Array
    mirror_lower_x_mm: Array
    mirror_lower_z_mm: Array
    mirror_half_width_mm: Array
    camera_x_mm: Array
    camera_z_mm: Array
    camera_top_z_mm: Array
    camera_bottom_z_mm: Array
    camera_front_x_mm: Array
    camera_rear_x_mm: Array
    ledge_edge_x_mm: Array
    near_distance_mm: Array
    far_distance_mm: Array
    corner_horizontal_tan: Array
    corner_vertical_tan: Array
    mirror_depth_mm: Array
    camera_depth_mm: Array
    depth_mm: Array
    violations: dict[str, Array]
    """Per constraint, how far it is missed as a part of its scale; <= 0 holds."""

    def worst(self) -> Array:
        """Sum of the missed parts over all constraints; 0 where the candidate is feasible."""
        total = np.zeros_like(self.depth_mm)
        for value in self.violations.values():
            total = total + np.maximum(value, 0.0)
        return total


def fold(p: FoldProblem, mid_rad: Array, spread: Array, mirror_rad: Array) -> Fold:
    """Lay out candidates: mean ray angle, spread as a part of the field of view, mirror angle."""
    half_view = np.arctan(p.half_vertical_tan)
    near, far = mid_rad - spread * half_view, mid_rad + spread * half_view
    sn, sf = np.tan(near), np.tan(far)
    thin = ([p.guide_thickness_mm, p.gel_total_mm], [p.guide_index, p.gel_index])
    reach_n, reach_f = lateral_reach(sn, *thin), lateral_reach(sf, *thin)
    air = (p.gel_length_mm - (reach_f - reach_n)) / (sf - sn)
    window_z = -(p.guide_thickness_mm + p.gel_total_mm)
    vx = -p.gel_length_mm / 2 - (np.maximum(air, 1.0) * sn + reach_n)
    vz = window_z - np.maximum(air, 1.0)
    air = np.maximum(air, 1.0)
    corners = [_corner(p, x, vx, air) for x in (-p.gel_length_mm / 2, p.gel_length_mm / 2)]
    shallowest = np.minimum(sn, corners[0].slope_x)
    steepest = np.maximum(sf, corners[1].slope_x)
    lowest, highest = np.arctan(shallowest), np.arctan(steepest)
    tilt = np.clip(0.0, highest - half_view, lowest + half_view)
    apparent = air + p.guide_thickness_mm / p.guide_index + p.gel_total_mm / p.gel_index
    z_near = apparent / np.cos(near) * np.cos(near - tilt)
    z_far = apparent / np.cos(far) * np.cos(far - tilt)

    ca, sa = np.cos(mirror_rad), np.sin(mirror_rad)
    upper_z = window_z - p.clearance_mm - p.mirror_border_mm * sa
    upper_x = vx + steepest * (upper_z - vz)
    down = (upper_x - vx - shallowest * (upper_z - vz)) / (ca - shallowest * sa)
    lower_x, lower_z = upper_x - down * ca, upper_z - down * sa
    away = (vx - upper_x) * -sa + (vz - upper_z) * ca
    cx, cz = vx + 2 * away * sa, vz - 2 * away * ca
    pitch = np.pi / 2 - 2 * mirror_rad - tilt
    housing = _housing_corners(p, cx, cz, pitch)
    top = np.max([z for _, z in housing], axis=0)
    bottom = np.min([z for _, z in housing], axis=0)
    front = np.max([x for x, _ in housing], axis=0)
    rear = np.min([x for x, _ in housing], axis=0)
    half_width = np.maximum(
        corners[0].slope_y * (lower_z - vz), corners[1].slope_y * (upper_z - vz)
    )
    ledge_z = window_z - p.ledge_depth_mm
    ledge_edge = np.minimum(
        -p.gel_length_mm / 2 - 0.2, vx + shallowest * (ledge_z - vz) - p.clearance_mm
    )
    mirror_depth = window_z - (lower_z - p.mirror_border_mm * sa - p.mirror_thickness_mm * ca)
    camera_depth = window_z - bottom + p.clearance_mm
    depth = np.maximum(np.maximum(mirror_depth, camera_depth), p.guide_stack_mm)

    horizontal = np.max([c.horizontal(tilt) for c in corners], axis=0)
    vertical = np.tan(np.maximum(highest - tilt, tilt - lowest))
    # An axis tilted back makes the far edge the nearer one: limits hold whichever way it leans.
    least, most = np.minimum(z_near, z_far), np.maximum(z_near, z_far)
    blur = p.aperture_mm * (most - least) / (2 * least)
    focus = 2 * z_near * z_far / (z_near + z_far)
    travel = np.where(
        focus >= p.focus_nearest_mm,
        0.0,
        p.focal_length_mm**2 / np.maximum(focus - p.focal_length_mm, 1e-3),
    )
    px = p.focal_px * p.marker_diameter_mm / most * np.minimum(1.0, apparent / most)
    view_edge = [x - (vx + shallowest * (z - vz)) + p.clearance_mm for x, z in housing]
    behind_mirror = [
        p.clearance_mm - ((x - upper_x) * -sa + (z - upper_z) * ca) for x, z in housing
    ]
    lower_end_x = lower_x - p.mirror_border_mm * ca
    before_mirror = [x - lower_end_x + p.clearance_mm for x, _ in housing]
    ledge_x = ledge_edge - p.ledge_reach_mm
    under_ledge = [np.minimum(x - ledge_x, z - ledge_z + p.clearance_mm) for x, z in housing]
    # The view from the camera to the mirror's upper end passes below ledge and beam.
    climb = (upper_z - cz) / (upper_x - cx)
    in_view = [
        np.where(x > cx, cz + climb * (x - cx), -np.inf) + p.clearance_mm - ledge_z
        for x in (ledge_edge, ledge_x)
    ]
    violations = {
        "field of view along": vertical / p.half_vertical_tan - 1,
        "field of view across": horizontal / p.half_horizontal_tan - 1,
        "blur": blur / p.blur_limit_mm - 1,
        "pixels per marker": p.min_px_per_marker / px - 1,
        "keystone": most / least / p.max_keystone - 1,
        "lens travel": (travel - p.lens_travel_mm) / np.maximum(p.lens_travel_mm, 0.1),
        "air gap": 2.0 - air,
        "mirror below window": np.maximum(-down, vz - lower_z) / 10,
        "camera below window": (top - window_z + p.clearance_mm) / 10,
        "camera beside view": np.max(view_edge, axis=0) / 10,
        "camera clear of mirror": np.minimum(
            np.max(behind_mirror, axis=0), np.max(before_mirror, axis=0)
        )
        / 10,
        "view below ledge": np.maximum(in_view[0], in_view[1]) / 10,
        "mirror before camera": (lower_end_x * -1 + cx + p.clearance_mm) / 10,
        "camera clear of ledge": np.maximum(
            np.max(under_ledge, axis=0),
            p.clearance_mm - _outside_camera(p, ledge_x - cx, ledge_z - cz, pitch),
        )
        / 10,
    }
    return Fold(
        near_ray_rad=near,
        far_ray_rad=far,
        tilt_rad=tilt,
        air_height_mm=air,
        virtual_x_mm=vx,
        virtual_z_mm=vz,
        mirror_rad=mirror_rad + 0 * air,
        pitch_rad=pitch,
        mirror_upper_x_mm=upper_x,
        mirror_upper_z_mm=upper_z,
        mirror_lower_x_mm=lower_x,
        mirror_lower_z_mm=lower_z,
        mirror_half_width_mm=half_width,
        camera_x_mm=cx,
        camera_z_mm=cz,
        camera_top_z_mm=top,
        camera_bottom_z_mm=bottom,
        camera_front_x_mm=front,
        camera_rear_x_mm=rear,
        ledge_edge_x_mm=ledge_edge,
        near_distance_mm=z_near,
        far_distance_mm=z_far,
        corner_horizontal_tan=horizontal,
        corner_vertical_tan=vertical,
        mirror_depth_mm=mirror_depth,
        camera_depth_mm=camera_depth,
        depth_mm=depth,
        violations=violations,
    )


@dataclass(frozen=True)
class _Corner:
    """Slopes dx/dz and dy/dz, in air, of the ray to a corner of the gel."""

    slope_x: Array
    slope_y: Array

    def horizontal(self, tilt: Array) -> Array:
        return self.slope_y / (self.slope_x * np.sin(tilt) + np.cos(tilt))


def _corner(p: FoldProblem, x: Array, vx: Array, air: Array) -> _Corner:
    along, across = x - vx, p.gel_width_mm / 2
    reach = np.hypot(along, across)
    heights = [air, p.guide_thickness_mm, p.gel_total_mm]
    slope = ray_slope(reach, heights, [1.0, p.guide_index, p.gel_index])
    return _Corner(slope * along / reach, slope * across / reach)


def _outside_camera(p: FoldProblem, dx: Array, dz: Array, pitch: Array) -> Array:
    """How far a point before or above the camera is outside housing and lens barrel."""
    c, s = np.cos(pitch), np.sin(pitch)
    ahead, above = dx * c - dz * s, dx * s + dz * c
    housing = np.maximum(ahead + p.lens_height_mm, above - p.module_height_mm / 2)
    barrel = np.maximum(ahead, above - p.lens_diameter_mm / 2)
    return np.minimum(housing, barrel)


def _housing_corners(
    p: FoldProblem, cx: Array, cz: Array, pitch: Array
) -> list[tuple[Array, Array]]:
    """Corners (x, z) of housing and lens barrel; the pinhole lies in the barrel's front face."""
    c, s = np.cos(pitch), np.sin(pitch)
    half, radius = p.module_height_mm / 2, p.lens_diameter_mm / 2
    face, rear = -p.lens_height_mm, -p.lens_height_mm - p.module_depth_mm
    local = [(0 * face, radius), (0 * face, -radius)]
    local += [(a, b) for a in (face, rear) for b in (half, -half)]
    return [(cx + a * c + b * s, cz - a * s + b * c) for a, b in local]
