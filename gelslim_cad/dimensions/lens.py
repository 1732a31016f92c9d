"""The lens: where it stands when it is focused on the gel, and how large it draws.

A data sheet's focal length and field of view hold for an object at infinity. A lens focused on the
distance s forms the image at v = f s / (s - f) behind it, which sets the scale of the picture; a
lens that moves as a whole then stands v - f farther out, with its entrance pupil and its front.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gelslim_cad.dimensions.distortion import RADIAL, image_of, tangent_of
from gelslim_cad.dimensions.fold.fold import Fold
from gelslim_cad.dimensions.registry import Real, dimension

LENS = "docs/physics.md#a-camera-focused-close-up"


@dimension("view.pixel_pitch_mm", formula="sensor width / image width")
def view_pixel_pitch_mm(camera_sensor_width_mm: Real, camera_image_width_px: Real) -> Real:
    """Size of one image pixel on the sensor."""
    return camera_sensor_width_mm / camera_image_width_px


@dimension(
    "view.sheet_image_mm",
    formula="f a / (a - f), a = the distance at which the sheet states the field of view; else f",
    source=LENS,
)
def view_sheet_image_mm(
    camera_focal_length_mm: Real, camera_field_of_view_at_mm: Real | None
) -> Real:
    """Image distance at which the field of view of the data sheet holds."""
    f, at = camera_focal_length_mm, camera_field_of_view_at_mm
    return f if at is None else f * at / (at - f)


SHEET = (*RADIAL, "view.sheet_image_mm", "camera.focusing")


@dimension(
    "view.sensor_across_mm",
    formula="min(sensor width, 2 v sheet r g(r²)), r = tan(given / 2); the sensor width for "
    "internal focusing",
    source=LENS,
    inputs=(*SHEET, "camera.sensor_width_mm", "camera.horizontal_fov_deg"),
)
def view_sensor_across_mm(values: Mapping[str, Any]) -> Real:
    """Width of the sensor that the lens fills with the picture."""
    return _filled_mm(values, values["camera.sensor_width_mm"], values["camera.horizontal_fov_deg"])


@dimension(
    "view.sensor_along_mm",
    formula="min(sensor height, 2 v sheet r g(r²)), r = tan(given / 2); the sensor height for "
    "internal focusing",
    source=LENS,
    inputs=(*SHEET, "camera.sensor_height_mm", "camera.vertical_fov_deg"),
)
def view_sensor_along_mm(values: Mapping[str, Any]) -> Real:
    """Height of the sensor that the lens fills with the picture."""
    return _filled_mm(values, values["camera.sensor_height_mm"], values["camera.vertical_fov_deg"])


def _filled_mm(values: Mapping[str, Any], side_mm: Real, given_deg: Real | None) -> Real:
    if given_deg is None or values["camera.focusing"] == "internal":
        return side_mm
    image = image_of(values, np.tan(np.radians(given_deg) / 2))
    return np.minimum(side_mm, 2 * values["view.sheet_image_mm"] * image)


@dimension("view.aperture_mm", formula="f / N", source="thin lens")
def view_aperture_mm(camera_focal_length_mm: Real, camera_f_number: Real) -> Real:
    """Diameter of the lens opening."""
    return camera_focal_length_mm / camera_f_number


@dimension(
    "view.fixed_focus_mm",
    formula="focus_distance of a fixed lens; 0 for a lens that is focused on the gel",
    source=LENS,
)
def view_fixed_focus_mm(camera_focusing: str, camera_focus_distance_mm: Real | None) -> Real:
    """Distance on which a lens is sharp that cannot be focused."""
    given = camera_focus_distance_mm
    return given if camera_focusing == "fixed" and given is not None else 0.0


@dimension(
    "view.fixed_image_mm",
    formula="internal: sensor width / (2 r g(r²)), r = tan(given / 2); fixed: f s / (s - f); "
    "unit: 0",
    source=LENS,
    inputs=(
        *RADIAL,
        "camera.focusing",
        "camera.sensor_width_mm",
        "camera.horizontal_fov_deg",
        "camera.focal_length_mm",
        "view.fixed_focus_mm",
    ),
)
def view_fixed_image_mm(values: Mapping[str, Any]) -> Real:
    """Image distance of a lens that stays in its place."""
    focusing, given_deg = values["camera.focusing"], values["camera.horizontal_fov_deg"]
    if focusing == "internal" and given_deg is not None:
        image = image_of(values, np.tan(np.radians(given_deg) / 2))
        return values["camera.sensor_width_mm"] / 2 / image
    if focusing == "fixed":
        f, s = values["camera.focal_length_mm"], values["view.fixed_focus_mm"]
        return f * s / (s - f)
    return 0.0


@dimension(
    "camera_pose.pupil_mm",
    formula="entrance_pupil, or the lens height where it is not given",
    source=LENS,
)
def camera_pose_pupil_mm(
    camera_entrance_pupil_mm: Real | None, camera_lens_height_mm: Real
) -> Real:
    """Entrance pupil before the housing's front face, the lens focused on infinity."""
    given = camera_entrance_pupil_mm
    return camera_lens_height_mm if given is None else given


@dimension(
    "view.image_distance_mm",
    formula="v = f s / (s - f); the given field of view's for internal focusing",
    source=LENS,
)
def view_image_distance_mm(fold_layout: Fold) -> Real:
    """Distance of the sensor from the lens's rear principal plane."""
    return fold_layout.image_distance_mm


@dimension("view.focal_px", formula="v / pixel pitch", source=LENS)
def view_focal_px(view_image_distance_mm: Real, view_pixel_pitch_mm: Real) -> Real:
    """Scale of the picture: the image distance in pixels."""
    return view_image_distance_mm / view_pixel_pitch_mm


@dimension(
    "view.across_fov_deg",
    formula="2 atan r, r g(r²) = sensor across / 2v",
    source=LENS,
    inputs=(*RADIAL, "view.sensor_across_mm", "view.image_distance_mm"),
)
def view_across_fov_deg(values: Mapping[str, Any]) -> Real:
    """Field of view across the finger, the lens focused on the gel."""
    image = values["view.sensor_across_mm"] / 2 / values["view.image_distance_mm"]
    return np.degrees(2 * np.arctan(tangent_of(values, image)))


@dimension(
    "view.along_fov_deg",
    formula="2 atan r, r g(r²) = sensor along / 2v",
    source=LENS,
    inputs=(*RADIAL, "view.sensor_along_mm", "view.image_distance_mm"),
)
def view_along_fov_deg(values: Mapping[str, Any]) -> Real:
    """Field of view along the finger, the lens focused on the gel."""
    image = values["view.sensor_along_mm"] / 2 / values["view.image_distance_mm"]
    return np.degrees(2 * np.arctan(tangent_of(values, image)))


@dimension(
    "view.lens_extension_mm", formula="v - f if the whole lens moves to focus, else 0", source=LENS
)
def view_lens_extension_mm(fold_layout: Fold) -> Real:
    """How far the lens stands before its place for infinity."""
    return fold_layout.lens_extension_mm


@dimension(
    "view.lens_travel_mm",
    formula="lens extension; 0 where s is in the delivered range",
    source=LENS,
)
def view_lens_travel_mm(
    view_lens_extension_mm: Real, view_focus_mm: Real, camera_focus_nearest_mm: Real
) -> Real:
    """How far the lens must be unscrewed."""
    return np.where(view_focus_mm >= camera_focus_nearest_mm, 0.0, view_lens_extension_mm)


@dimension(
    "view.image_blur_px", formula="A v |Z - s| / (Z s) / pixel pitch, undistorted", source=LENS
)
def view_image_blur_px(
    view_aperture_mm: Real,
    view_focal_px: Real,
    view_focus_mm: Real,
    view_near_sagittal_mm: Real,
    view_far_sagittal_mm: Real,
    view_near_tangential_mm: Real,
    view_far_tangential_mm: Real,
) -> Real:
    """Largest blur diameter in the image; at best focus that of the nearest and farthest image."""
    near = (view_near_sagittal_mm, view_near_tangential_mm)
    far = (view_far_sagittal_mm, view_far_tangential_mm)
    worst = np.maximum.reduce([np.abs(z - view_focus_mm) / z for z in (*near, *far)])
    return view_aperture_mm * view_focal_px * worst / view_focus_mm
