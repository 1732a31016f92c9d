"""What the camera sees: dimensions that follow from the solved fold."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gelslim_cad.dimensions.fold import Fold
from gelslim_cad.dimensions.fold_problem import FoldProblem
from gelslim_cad.dimensions.registry import Real, dimension
from gelslim_cad.dimensions.solver import solve_fold
from gelslim_cad.geometry.names import Name

FOLD = "docs/physics.md#camera-and-fold"


@dimension("view.pixel_pitch_mm", formula="sensor width / image width")
def view_pixel_pitch_mm(camera_sensor_width_mm: Real, camera_image_width_px: Real) -> Real:
    """Size of one image pixel on the sensor."""
    return camera_sensor_width_mm / camera_image_width_px


@dimension("view.focal_px", formula="f / pixel pitch", source="pinhole camera")
def view_focal_px(camera_focal_length_mm: Real, view_pixel_pitch_mm: Real) -> Real:
    """Focal length in pixels."""
    return camera_focal_length_mm / view_pixel_pitch_mm


@dimension("view.across_fov_deg", formula="min(given, 2 atan(sensor width / 2f))", source=FOLD)
def view_across_fov_deg(
    camera_sensor_width_mm: Real,
    camera_focal_length_mm: Real,
    camera_horizontal_fov_deg: Real | None,
) -> Real:
    """Field of view across the finger."""
    return _fov_deg(camera_sensor_width_mm, camera_focal_length_mm, camera_horizontal_fov_deg)


@dimension("view.along_fov_deg", formula="min(given, 2 atan(sensor height / 2f))", source=FOLD)
def view_along_fov_deg(
    camera_sensor_height_mm: Real,
    camera_focal_length_mm: Real,
    camera_vertical_fov_deg: Real | None,
) -> Real:
    """Field of view along the finger."""
    return _fov_deg(camera_sensor_height_mm, camera_focal_length_mm, camera_vertical_fov_deg)


def _fov_deg(side_mm: Real, focal_mm: Real, given_deg: Real | None) -> Real:
    implied = np.degrees(2 * np.arctan(side_mm / 2 / focal_mm))
    return implied if given_deg is None else np.minimum(implied, given_deg)


@dimension("view.aperture_mm", formula="f / N", source="thin lens")
def view_aperture_mm(camera_focal_length_mm: Real, camera_f_number: Real) -> Real:
    """Diameter of the lens opening."""
    return camera_focal_length_mm / camera_f_number


@dimension("view.blur_limit_mm", formula="blur_per_diameter · marker diameter", source=FOLD)
def view_blur_limit_mm(optics_blur_per_diameter: Real, markers_diameter_mm: Real) -> Real:
    """Largest blur on the gel that the design allows."""
    return optics_blur_per_diameter * markers_diameter_mm


PROBLEM: dict[str, Name] = {
    "gel_length_mm": "design.gel.length_mm",
    "gel_width_mm": "design.gel.width_mm",
    "gel_total_mm": "stack.gel_total_mm",
    "gel_index": "material.gel.refractive_index",
    "guide_thickness_mm": "design.light_guide.thickness_mm",
    "guide_index": "material.acrylic.refractive_index",
    "half_horizontal_tan": "view.across_fov_deg",
    "half_vertical_tan": "view.along_fov_deg",
    "image_margin": "design.optics.image_margin",
    "focal_length_mm": "camera.focal_length_mm",
    "focal_px": "view.focal_px",
    "aperture_mm": "view.aperture_mm",
    "lens_travel_mm": "camera.lens_travel_mm",
    "focus_nearest_mm": "camera.focus_nearest_mm",
    "module_height_mm": "camera.module_height_mm",
    "module_depth_mm": "camera.module_depth_mm",
    "lens_diameter_mm": "camera.lens_diameter_mm",
    "lens_height_mm": "camera.lens_height_mm",
    "mirror_thickness_mm": "design.mirror.thickness_mm",
    "mirror_border_mm": "design.mirror.border_mm",
    "clearance_mm": "design.optics.clearance_mm",
    "ledge_depth_mm": "ledge.depth_mm",
    "ledge_reach_mm": "ledge.reach_mm",
    "guide_stack_mm": "guide.stack_mm",
    "marker_diameter_mm": "design.markers.diameter_mm",
    "blur_limit_mm": "view.blur_limit_mm",
    "min_px_per_marker": "design.optics.min_px_per_marker",
    "max_keystone": "design.optics.max_keystone",
}
"""From which value each field of the fold's problem comes; margin and angles give the tangents."""


@dimension(
    "fold.layout",
    formula="thinnest fold that keeps all limits (search over two ray angles and the mirror)",
    source=FOLD,
    internal=True,
    inputs=tuple(PROBLEM.values()),
)
def fold_layout(values: Mapping[str, Any]) -> Fold:
    """The solved fold of camera and mirror."""
    given = {field: values[name] for field, name in PROBLEM.items()}
    free = 1 - given.pop("image_margin")
    for side in ("half_horizontal_tan", "half_vertical_tan"):
        given[side] = np.tan(np.radians(given[side]) / 2) * free
    flat = np.broadcast_arrays(*(np.atleast_1d(np.asarray(v, float)) for v in given.values()))
    columns = dict(zip(given, (v.reshape(-1, 1, 1) for v in flat), strict=True))
    return solve_fold(FoldProblem(**columns))


@dimension("view.near_ray_deg", formula="solved", source=FOLD)
def view_near_ray_deg(fold_layout: Fold) -> Real:
    """Air angle of the ray to the near (proximal) gel edge, from the gel's normal."""
    return np.degrees(fold_layout.near_ray_rad)


@dimension("view.far_ray_deg", formula="solved", source=FOLD)
def view_far_ray_deg(fold_layout: Fold) -> Real:
    """Air angle of the ray to the far (tip) gel edge, from the gel's normal."""
    return np.degrees(fold_layout.far_ray_rad)


@dimension(
    "view.tilt_deg", formula="γ = smallest tilt that keeps both edges in the image", source=FOLD
)
def view_tilt_deg(fold_layout: Fold) -> Real:
    """Tilt of the virtual axis from the gel's normal."""
    return np.degrees(fold_layout.tilt_rad)


@dimension("view.virtual_x_mm", formula="-L/2 - r(θ near)", source=FOLD)
def view_virtual_x_mm(fold_layout: Fold) -> Real:
    """Virtual camera position along the finger."""
    return fold_layout.virtual_x_mm


@dimension(
    "view.virtual_z_mm",
    formula="window bottom - (L - Δr layers) / (tan θ far - tan θ near)",
    source=FOLD,
)
def view_virtual_z_mm(fold_layout: Fold) -> Real:
    """Virtual camera position across the thickness."""
    return fold_layout.virtual_z_mm


@dimension("view.near_distance_mm", formula="(h_air + t/n + g/n_g) cos(θ-γ) / cos θ", source=FOLD)
def view_near_distance_mm(fold_layout: Fold) -> Real:
    """Apparent distance along the axis to the near gel edge, Z near."""
    return fold_layout.near_distance_mm


@dimension("view.far_distance_mm", formula="(h_air + t/n + g/n_g) cos(θ-γ) / cos θ", source=FOLD)
def view_far_distance_mm(fold_layout: Fold) -> Real:
    """Apparent distance along the axis to the far gel edge, Z far."""
    return fold_layout.far_distance_mm


@dimension("view.depth_range_mm", formula="Z far - Z near (L sin γ in air)", source=FOLD)
def view_depth_range_mm(view_far_distance_mm: Real, view_near_distance_mm: Real) -> Real:
    """Depth of field the picture needs."""
    return view_far_distance_mm - view_near_distance_mm


@dimension("view.keystone", formula="k = Z far / Z near", source=FOLD)
def view_keystone(view_far_distance_mm: Real, view_near_distance_mm: Real) -> Real:
    """Keystone ratio."""
    return view_far_distance_mm / view_near_distance_mm


@dimension("view.focus_mm", formula="s = 2 Zn Zf / (Zn + Zf)", source=FOLD)
def view_focus_mm(view_near_distance_mm: Real, view_far_distance_mm: Real) -> Real:
    """Best focus distance: equal blur in the image at both edges."""
    n, f = view_near_distance_mm, view_far_distance_mm
    return 2 * n * f / (n + f)


@dimension(
    "view.lens_extension_mm",
    formula="f²/(s - f) from the infinity position; 0 where s is in the delivered range",
    source="thin lens",
)
def view_lens_extension_mm(
    view_focus_mm: Real, camera_focal_length_mm: Real, camera_focus_nearest_mm: Real
) -> Real:
    """How far the lens must be unscrewed."""
    moved = camera_focal_length_mm**2 / np.maximum(view_focus_mm - camera_focal_length_mm, 1e-3)
    return np.where(view_focus_mm >= camera_focus_nearest_mm, 0.0, moved)


@dimension("view.near_blur_mm", formula="A (s - Zn) / s", source=FOLD)
def view_near_blur_mm(
    view_aperture_mm: Real, view_focus_mm: Real, view_near_distance_mm: Real
) -> Real:
    """Blur on the gel at the near edge."""
    return view_aperture_mm * np.abs(view_near_distance_mm - view_focus_mm) / view_focus_mm


@dimension("view.far_blur_mm", formula="A (Zf - s) / s", source=FOLD)
def view_far_blur_mm(
    view_aperture_mm: Real, view_focus_mm: Real, view_far_distance_mm: Real
) -> Real:
    """Blur on the gel at the far edge."""
    return view_aperture_mm * np.abs(view_far_distance_mm - view_focus_mm) / view_focus_mm


@dimension(
    "view.image_blur_px", formula="(f²/N) (Zf - s) / (Zf (s - f)) / pixel pitch", source=FOLD
)
def view_image_blur_px(
    view_aperture_mm: Real,
    camera_focal_length_mm: Real,
    view_focus_mm: Real,
    view_far_distance_mm: Real,
    view_pixel_pitch_mm: Real,
) -> Real:
    """Blur diameter in the image at the far edge; at the best focus the near edge has the same."""
    f, s, z = camera_focal_length_mm, view_focus_mm, view_far_distance_mm
    return (
        view_aperture_mm * f * np.abs(z - s) / (z * np.maximum(s - f, 1e-3)) / view_pixel_pitch_mm
    )


@dimension("view.marker_across_px", formula="f_px d / max(Zn, Zf)", source=FOLD)
def view_marker_across_px(
    view_focal_px: Real,
    markers_diameter_mm: Real,
    view_near_distance_mm: Real,
    view_far_distance_mm: Real,
) -> Real:
    """Width in the image of the marker that is farthest from the camera."""
    farthest = np.maximum(view_near_distance_mm, view_far_distance_mm)
    return view_focal_px * markers_diameter_mm / farthest


@dimension(
    "view.marker_along_px",
    formula="f_px d D / max(Zn, Zf)², D = apparent height above the gel's plane",
    source=FOLD,
)
def view_marker_along_px(
    fold_layout: Fold,
    view_near_distance_mm: Real,
    view_far_distance_mm: Real,
    view_marker_across_px: Real,
) -> Real:
    """Height in the image of the marker that is farthest from the camera, foreshortened."""
    height = fold_layout.far_distance_mm * np.cos(fold_layout.far_ray_rad)
    height = height / np.cos(fold_layout.far_ray_rad - fold_layout.tilt_rad)
    farthest = np.maximum(view_near_distance_mm, view_far_distance_mm)
    return view_marker_across_px * np.minimum(1.0, height / farthest)


@dimension("view.across_use", formula="largest image x of the gel / half image", source=FOLD)
def view_across_use(fold_layout: Fold, view_across_fov_deg: Real) -> Real:
    """Part of the half image width that the gel fills; above 1 it is not seen whole."""
    return fold_layout.corner_horizontal_tan / np.tan(np.radians(view_across_fov_deg) / 2)


@dimension("view.along_use", formula="largest image y of the gel / half image", source=FOLD)
def view_along_use(fold_layout: Fold, view_along_fov_deg: Real) -> Real:
    """Part of the half image height that the gel fills; above 1 it is not seen whole."""
    return fold_layout.corner_vertical_tan / np.tan(np.radians(view_along_fov_deg) / 2)
