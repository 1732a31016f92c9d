"""What the camera sees: dimensions that follow from the solved fold."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from gelslim_cad.dimensions.cable import LEAST_ROOF_MM, SIDES, over_cover_mm
from gelslim_cad.dimensions.distortion import is_fisheye
from gelslim_cad.dimensions.fold.fold import Fold
from gelslim_cad.dimensions.fold.problem import NO_LIMIT_MM, FoldProblem
from gelslim_cad.dimensions.fold.solver import solve_fold
from gelslim_cad.dimensions.registry import Real, dimension
from gelslim_cad.geometry.names import Name

FOLD = "docs/physics.md#camera-and-fold"
KEPT_FOLDS = 64
"""Folds that are kept: rules, prices and tolerances of a design ask for the same ones."""


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
    "half_across_mm": "view.sensor_across_mm",
    "half_along_mm": "view.sensor_along_mm",
    "image_margin": "design.optics.image_margin",
    "pixel_pitch_mm": "view.pixel_pitch_mm",
    "focal_length_mm": "camera.focal_length_mm",
    "fisheye": "camera.distortion.model",
    "k1": "view.distortion_k1",
    "k2": "camera.distortion.k2",
    "k3": "camera.distortion.k3",
    "k4": "camera.distortion.k4",
    "p1": "camera.distortion.p1",
    "p2": "camera.distortion.p2",
    "most_tan": "view.corner_tan",
    "moving_lens": "camera.focusing",
    "fixed_focus_mm": "view.fixed_focus_mm",
    "fixed_image_mm": "view.fixed_image_mm",
    "entrance_pupil_mm": "camera_pose.pupil_mm",
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
    "fit_clearance_mm": "design.housing.fit_clearance_mm",
    "end_support_mm": "design.light_guide.end_support_mm",
    "tip_wall_mm": "design.housing.tip_wall_mm",
    "cable_behind_mm": "cable.behind_mm",
    "cable_side": "camera.cable_exit",
    "cable_radius_mm": "cable.radius_mm",
    "cable_half_mm": "cable.thickness_mm",
    "shim_thickness_mm": "design.housing.shim_thickness_mm",
    "cable_squeeze_mm": "cable.squeeze_mm",
    "gel_proud_mm": "design.housing.gel_proud_mm",
    "mount_length_mm": "mount.length_mm",
    "baffle_inner_y_mm": "baffle.inner_y_mm",
    "clamp_width_mm": "clamp.width_mm",
    "clamp_play_mm": "clamp.play_mm",
    "max_depth_mm": "design.envelope.max_thickness_mm",
    "back_wall_mm": "design.housing.back_wall_mm",
    "max_length_mm": "design.envelope.max_length_mm",
    "tip_depth_mm": "led.tip_depth_mm",
    "goal": "design.envelope.goal",
    "length_worth": "design.envelope.length_worth",
    "pixel_worth_mm": "design.envelope.pixel_worth_mm",
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
    for side in ("half_across_mm", "half_along_mm"):
        given[side] = given[side] / 2 * free
    given["fisheye"] = is_fisheye(given["fisheye"])
    given["moving_lens"] = float(given["moving_lens"] == "unit")
    given |= _worths(given.pop("goal"), given["length_worth"], given["pixel_worth_mm"])
    given |= _cable_room(given)
    taken_mm = given.pop("back_wall_mm") + given["guide_thickness_mm"] + given["gel_total_mm"]
    given["max_depth_mm"] = _limit_mm(given["max_depth_mm"]) - taken_mm
    # The strip at the tip lengthens every fold alike.
    given["max_length_mm"] = _limit_mm(given["max_length_mm"]) - given.pop("tip_depth_mm")
    flat = np.broadcast_arrays(*(np.atleast_1d(np.asarray(v, float)) for v in given.values()))
    if flat[0].size == 1:
        return _solved_alone(tuple(given), tuple(float(v[0]) for v in flat))
    columns = dict(zip(given, (v.reshape(-1, 1, 1) for v in flat), strict=True))
    return solve_fold(FoldProblem(**columns))


@lru_cache(maxsize=KEPT_FOLDS)
def _solved_alone(names: tuple[str, ...], values: tuple[float, ...]) -> Fold:
    """The fold of one design; read-only, because designs that differ elsewhere share it."""
    columns = {n: np.full((1, 1, 1), v) for n, v in zip(names, values, strict=True)}
    found = solve_fold(FoldProblem(**columns))
    for value in vars(found).values():
        for array in value.values() if isinstance(value, dict) else (value,):
            array.setflags(write=False)
    return found


def _cable_room(given: dict[str, Any]) -> dict[str, Real]:
    """What the cable asks of the fold; takes what only this needs out of the given values."""
    half = given["cable_half_mm"] / 2
    pad = given.pop("shim_thickness_mm") - given.pop("cable_squeeze_mm")
    return {
        "cable_side": SIDES[given["cable_side"]],
        "cable_half_mm": half,
        "cable_over_cover_mm": over_cover_mm(half, pad, given["back_wall_mm"]),
        "cable_under_skin_mm": half + given.pop("gel_proud_mm") + LEAST_ROOF_MM,
    }


def _limit_mm(given_mm: Real | None) -> Real:
    return NO_LIMIT_MM if given_mm is None else given_mm


def _worths(goal: str, length_worth: Real, pixel_worth_mm: Real) -> dict[str, Real]:
    """What depth, length and pixels count: one of them alone, or thickness with weights."""
    if goal == "shortest":
        return {"depth_worth": 0.0, "length_worth": 1.0, "pixel_worth_mm": 0.0}
    if goal == "best_picture":
        return {"depth_worth": 0.0, "length_worth": 0.0, "pixel_worth_mm": 1.0}
    return {
        "depth_worth": 1.0,
        "length_worth": length_worth,
        "pixel_worth_mm": pixel_worth_mm,
    }


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


@dimension(
    "view.near_distance_mm",
    formula="(h_air / cos θ + t / (n cos θ_n) + g / (n_g cos θ_g)) cos(θ-γ)",
    source=FOLD,
)
def view_near_distance_mm(fold_layout: Fold) -> Real:
    """Apparent distance along the axis to the near gel edge, by sagittal rays, Z near."""
    return fold_layout.near_distance_mm


@dimension(
    "view.far_distance_mm",
    formula="(h_air / cos θ + t / (n cos θ_n) + g / (n_g cos θ_g)) cos(θ-γ)",
    source=FOLD,
)
def view_far_distance_mm(fold_layout: Fold) -> Real:
    """Apparent distance along the axis to the far gel edge, by sagittal rays, Z far."""
    return fold_layout.far_distance_mm


TANGENTIAL = "(h_air / cos θ + t cos²θ / (n cos³θ_n) + g cos²θ / (n_g cos³θ_g)) cos(axis, ray)"
SAGITTAL = "(h_air / cos θ + t / (n cos θ_n) + g / (n_g cos θ_g)) cos(axis, ray)"


@dimension("view.near_tangential_mm", formula=TANGENTIAL, source=FOLD)
def view_near_tangential_mm(fold_layout: Fold) -> Real:
    """Distance along the axis of the nearest image of the near edge, corners included."""
    return fold_layout.near_tangential_mm


@dimension("view.near_sagittal_mm", formula=SAGITTAL, source=FOLD)
def view_near_sagittal_mm(fold_layout: Fold) -> Real:
    """Distance along the axis of the farthest image of the near edge, corners included."""
    return fold_layout.near_sagittal_mm


@dimension("view.far_tangential_mm", formula=TANGENTIAL, source=FOLD)
def view_far_tangential_mm(fold_layout: Fold) -> Real:
    """Distance along the axis of the nearest image of the far edge, corners included."""
    return fold_layout.far_tangential_mm


@dimension("view.far_sagittal_mm", formula=SAGITTAL, source=FOLD)
def view_far_sagittal_mm(fold_layout: Fold) -> Real:
    """Distance along the axis of the farthest image of the far edge, corners included."""
    return fold_layout.far_sagittal_mm


@dimension("view.depth_range_mm", formula="farthest - nearest image of the edges", source=FOLD)
def view_depth_range_mm(
    view_far_sagittal_mm: Real,
    view_near_sagittal_mm: Real,
    view_far_tangential_mm: Real,
    view_near_tangential_mm: Real,
) -> Real:
    """Depth of field the picture needs."""
    most = np.maximum(view_far_sagittal_mm, view_near_sagittal_mm)
    return most - np.minimum(view_far_tangential_mm, view_near_tangential_mm)


@dimension("view.keystone", formula="k = Z far / Z near", source=FOLD)
def view_keystone(view_far_distance_mm: Real, view_near_distance_mm: Real) -> Real:
    """Keystone ratio."""
    return view_far_distance_mm / view_near_distance_mm


@dimension(
    "view.focus_mm",
    formula="s = 2 Z Z' / (Z + Z'), the least and the largest distance; a fixed lens's own",
    source=FOLD,
)
def view_focus_mm(fold_layout: Fold) -> Real:
    """Distance in focus: the blur in the image is equal at the nearest and the farthest image."""
    return fold_layout.focus_mm


@dimension(
    "view.near_blur_mm", formula="A |Z - s| / s, by the image that is less sharp", source=FOLD
)
def view_near_blur_mm(
    view_aperture_mm: Real,
    view_focus_mm: Real,
    view_near_sagittal_mm: Real,
    view_near_tangential_mm: Real,
) -> Real:
    """Largest blur on the gel at the near edge, corners included."""
    off = _farther_off(view_near_sagittal_mm, view_near_tangential_mm, view_focus_mm)
    return view_aperture_mm * off / view_focus_mm


@dimension(
    "view.far_blur_mm", formula="A |Z - s| / s, by the image that is less sharp", source=FOLD
)
def view_far_blur_mm(
    view_aperture_mm: Real,
    view_focus_mm: Real,
    view_far_sagittal_mm: Real,
    view_far_tangential_mm: Real,
) -> Real:
    """Largest blur on the gel at the far edge, corners included."""
    off = _farther_off(view_far_sagittal_mm, view_far_tangential_mm, view_focus_mm)
    return view_aperture_mm * off / view_focus_mm


def _farther_off(sagittal_mm: Real, tangential_mm: Real, focus_mm: Real) -> Real:
    return np.maximum(np.abs(sagittal_mm - focus_mm), np.abs(tangential_mm - focus_mm))


@dimension(
    "view.marker_across_px",
    formula="f_px d / max(Zn, Zf), times what the distortion scales it at the edge's middle or end",
    source=FOLD,
)
def view_marker_across_px(
    fold_layout: Fold, markers_diameter_mm: Real, view_focal_px: Real
) -> Real:
    """Width in the image of the marker that is drawn narrowest."""
    per_mm = fold_layout.across_scale / fold_layout.image_distance_mm
    return view_focal_px * markers_diameter_mm * per_mm


@dimension(
    "view.marker_along_px",
    formula="f_px d cos θ / (Zt cos(θ-γ)) at the edge where it is smaller, Zt tangential; "
    "distorted likewise",
    source=FOLD,
)
def view_marker_along_px(fold_layout: Fold, markers_diameter_mm: Real, view_focal_px: Real) -> Real:
    """Height in the image of the marker that is most foreshortened."""
    per_mm = fold_layout.along_scale / fold_layout.image_distance_mm
    return view_focal_px * markers_diameter_mm * per_mm


@dimension("view.across_use", formula="largest image x of the gel / half image", source=FOLD)
def view_across_use(
    fold_layout: Fold, view_image_distance_mm: Real, view_sensor_across_mm: Real
) -> Real:
    """Part of the half image width that the gel fills; above 1 it is not seen whole."""
    return fold_layout.corner_horizontal_tan * view_image_distance_mm * 2 / view_sensor_across_mm


@dimension("view.along_use", formula="largest image y of the gel / half image", source=FOLD)
def view_along_use(
    fold_layout: Fold, view_image_distance_mm: Real, view_sensor_along_mm: Real
) -> Real:
    """Part of the half image height that the gel fills; above 1 it is not seen whole."""
    return fold_layout.corner_vertical_tan * view_image_distance_mm * 2 / view_sensor_along_mm
