"""What the folded view must satisfy, from the spec and the dimensions before it."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""An array (n, ...) of n designs; one number where the compiled search calls the same function."""


NO_LIMIT_MM = 1e4


@dataclass(frozen=True)
class FoldProblem:
    """What the fold must satisfy, each (n, 1, 1) for n designs."""

    gel_length_mm: Array
    gel_width_mm: Array
    gel_total_mm: Array
    gel_index: Array
    guide_thickness_mm: Array
    guide_index: Array
    half_across_mm: Array
    """Half the sensor's width that the picture of the gel may use."""
    half_along_mm: Array
    pixel_pitch_mm: Array
    focal_length_mm: Array
    fixed_focus_mm: Array
    """Distance on which a lens that cannot be focused is sharp; 0 for one that can."""
    fixed_image_mm: Array
    """Image distance that is the same for every focus; 0 where it follows from the focus."""
    fisheye: Array
    """1 where the distortion is Kannala and Brandt's, 0 where it is Brown's."""
    k1: Array
    k2: Array
    k3: Array
    k4: Array
    p1: Array
    p2: Array
    most_tan: Array
    """Tangent of the ray to the sensor's corner, beyond which the distortion is not known."""
    moving_lens: Array
    """1 where the whole lens moves to focus, 0 where it stays in its place."""
    entrance_pupil_mm: Array
    """Entrance pupil before the housing's front face, the lens focused on infinity."""
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
    fit_clearance_mm: Array
    end_support_mm: Array
    tip_wall_mm: Array
    cable_behind_mm: Array
    cable_side: Array
    """Where the cable leaves the module: 1 at the top, -1 at the bottom, 0 behind."""
    cable_radius_mm: Array
    """Of the bend along the cable's middle."""
    cable_half_mm: Array
    """Half the cable's thickness across the bend."""
    cable_over_cover_mm: Array
    """Least from the cover to the cable's middle."""
    cable_under_skin_mm: Array
    """Least from the plane of the gel's top to the cable's middle."""
    mount_length_mm: Array
    baffle_inner_y_mm: Array
    clamp_width_mm: Array
    clamp_play_mm: Array
    max_depth_mm: Array
    """Depth below the window that the envelope allows; NO_LIMIT_MM where it says nothing."""
    max_length_mm: Array
    depth_worth: Array
    """What a millimetre of depth counts in the goal."""
    length_worth: Array
    pixel_worth_mm: Array
    """What a pixel more across the smallest marker counts in the goal."""

    def __len__(self) -> int:
        return len(self.gel_length_mm)

    def rows(self, chosen: slice | NDArray[np.intp] | NDArray[np.bool_]) -> FoldProblem:
        """The designs in `chosen`."""
        return FoldProblem(**{f.name: getattr(self, f.name)[chosen] for f in fields(self)})

    @property
    def window_z_mm(self) -> Array:
        """The guide's lower face, through which the camera looks."""
        return -(self.guide_thickness_mm + self.gel_total_mm)

    @property
    def widest_along_rad(self) -> Array:
        """Half the field of view along the finger, the lens focused on infinity."""
        image_mm = np.where(self.fixed_image_mm > 0, self.fixed_image_mm, self.focal_length_mm)
        return np.arctan(self.half_along_mm / image_mm)

    @cached_property
    def distorted(self) -> Array:
        """1 where the lens distorts, else 0."""
        parts = (self.fisheye, self.k1, self.k2, self.k3, self.k4, self.p1, self.p2)
        return np.any([part != 0 for part in parts], axis=0).astype(float)

    @property
    def most_tan_squared(self) -> Array:
        """r² at the sensor's corner."""
        return self.most_tan**2

    def records(self) -> NDArray[np.void]:
        """One record (n,) per design, with the same names: what the compiled search reads."""
        derived = ("window_z_mm", "widest_along_rad", "distorted", "most_tan_squared")
        names = [*(f.name for f in fields(self)), *derived]
        records = np.empty(len(self), dtype=[(name, float) for name in names])
        for name in names:
            records[name] = np.ravel(getattr(self, name))
        return records


def larger(a: Any, b: Any) -> Any:
    """The larger of two values.

    `search` compiles this and `smaller` to one comparison each. The functions of numba that
    replace `np.maximum` and `np.minimum` also test for NaN, which takes a fifth more time.
    """
    return np.maximum(a, b)


def smaller(a: Any, b: Any) -> Any:
    """The smaller of two values."""
    return np.minimum(a, b)
