"""The view before it is folded: the camera's mirror image straight below the gel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gelslim_cad.dimensions.fold_problem import Array, FoldProblem
from gelslim_optics.camera.rays import ray_slope
from gelslim_optics.camera.refraction import lateral_reach

LEAST_AIR_MM = 1.0
"""Candidates with less air are laid out with this much, so that the closed forms hold."""
WANTED_AIR_MM = 2.0


@dataclass(frozen=True)
class Sight:
    """What the two ray angles fix; slopes are dx/dz in air."""

    near_ray_rad: Array
    far_ray_rad: Array
    tilt_rad: Array
    air_height_mm: Array
    virtual_x_mm: Array
    virtual_z_mm: Array
    shallowest: Array
    """Slope of the outermost ray on the near side, corners of the gel included."""
    steepest: Array
    """Slope of the outermost ray on the far side."""
    near_corner_across: Array
    """Slope dy/dz of the ray to a near corner."""
    far_corner_across: Array
    near_distance_mm: Array
    far_distance_mm: Array
    apparent_depth_mm: Array
    corner_horizontal_tan: Array
    corner_vertical_tan: Array

    def near_edge_x_mm(self, z_mm: Array) -> Array:
        """Where the view's near edge passes the height z."""
        return self.virtual_x_mm + self.shallowest * (z_mm - self.virtual_z_mm)

    def far_edge_x_mm(self, z_mm: Array) -> Array:
        """Where the view's far edge passes the height z."""
        return self.virtual_x_mm + self.steepest * (z_mm - self.virtual_z_mm)

    def missed(self, p: FoldProblem) -> dict[str, Array]:
        """How far the limits of the picture are missed, as parts of their scales."""
        # An axis tilted back makes the far edge the nearer one: limits hold whichever way it leans.
        least = np.minimum(self.near_distance_mm, self.far_distance_mm)
        most = np.maximum(self.near_distance_mm, self.far_distance_mm)
        blur = p.aperture_mm * (most - least) / (2 * least)
        px = (
            p.focal_px * p.marker_diameter_mm / most
            * np.minimum(1.0, self.apparent_depth_mm / most)
        )  # fmt: skip
        travel = self._lens_travel_mm(p)
        return {
            "field of view along": self.corner_vertical_tan / p.half_vertical_tan - 1,
            "field of view across": self.corner_horizontal_tan / p.half_horizontal_tan - 1,
            "blur": blur / p.blur_limit_mm - 1,
            "pixels per marker": p.min_px_per_marker / px - 1,
            "keystone": most / least / p.max_keystone - 1,
            "lens travel": (travel - p.lens_travel_mm) / np.maximum(p.lens_travel_mm, 0.1),
            "air gap": WANTED_AIR_MM - self.air_height_mm,
        }

    def _lens_travel_mm(self, p: FoldProblem) -> Array:
        """How far the lens moves out to focus between the near and the far edge."""
        near, far = self.near_distance_mm, self.far_distance_mm
        focus = 2 * near * far / (near + far)
        return np.where(
            focus >= p.focus_nearest_mm,
            0.0,
            p.focal_length_mm**2 / np.maximum(focus - p.focal_length_mm, 1e-3),
        )


def sight(p: FoldProblem, mid_rad: Array, spread: Array) -> Sight:
    """Virtual camera for a mean ray angle and a spread as a part of the field of view."""
    half_view = np.arctan(p.half_vertical_tan)
    near, far = mid_rad - spread * half_view, mid_rad + spread * half_view
    near_slope, far_slope = np.tan(near), np.tan(far)
    layers = ([p.guide_thickness_mm, p.gel_total_mm], [p.guide_index, p.gel_index])
    near_reach, far_reach = lateral_reach(near_slope, *layers), lateral_reach(far_slope, *layers)
    air = (p.gel_length_mm - (far_reach - near_reach)) / (far_slope - near_slope)
    air = np.maximum(air, LEAST_AIR_MM)
    virtual_x = -p.gel_length_mm / 2 - (air * near_slope + near_reach)
    near_corner = _corner(p, -p.gel_length_mm / 2 - virtual_x, air)
    far_corner = _corner(p, p.gel_length_mm / 2 - virtual_x, air)
    shallowest = np.minimum(near_slope, near_corner.along)
    steepest = np.maximum(far_slope, far_corner.along)
    lowest, highest = np.arctan(shallowest), np.arctan(steepest)
    tilt = np.clip(0.0, highest - half_view, lowest + half_view)
    apparent = air + p.guide_thickness_mm / p.guide_index + p.gel_total_mm / p.gel_index
    return Sight(
        near_ray_rad=near,
        far_ray_rad=far,
        tilt_rad=tilt,
        air_height_mm=air,
        virtual_x_mm=virtual_x,
        virtual_z_mm=p.window_z_mm - air,
        shallowest=shallowest,
        steepest=steepest,
        near_corner_across=near_corner.across,
        far_corner_across=far_corner.across,
        near_distance_mm=apparent / np.cos(near) * np.cos(near - tilt),
        far_distance_mm=apparent / np.cos(far) * np.cos(far - tilt),
        apparent_depth_mm=apparent,
        corner_horizontal_tan=np.maximum(near_corner.seen(tilt), far_corner.seen(tilt)),
        corner_vertical_tan=np.tan(np.maximum(highest - tilt, tilt - lowest)),
    )


@dataclass(frozen=True)
class _Corner:
    """Slopes dx/dz and dy/dz, in air, of the ray to a corner of the gel."""

    along: Array
    across: Array

    def seen(self, tilt_rad: Array) -> Array:
        """Tangent across the picture, the axis tilted."""
        return self.across / (self.along * np.sin(tilt_rad) + np.cos(tilt_rad))


def _corner(p: FoldProblem, along_mm: Array, air_mm: Array) -> _Corner:
    across_mm = p.gel_width_mm / 2
    reach = np.hypot(along_mm, across_mm)
    heights = [air_mm, p.guide_thickness_mm, p.gel_total_mm]
    slope = ray_slope(reach, heights, [1.0, p.guide_index, p.gel_index])
    return _Corner(slope * along_mm / reach, slope * across_mm / reach)
