"""Rules on what the camera sees."""

from __future__ import annotations

import numpy as np

from gelslim_cad.checks.rule import Finding, rule
from gelslim_cad.dimensions.fold.fold import Fold
from gelslim_cad.dimensions.registry import Real

TOLERANCE = 1e-4
"""Tolerance for limits at which the search places the design."""
TOLERANCE_OF_FOLD = 1e-6
MOST_CHANGE_OF_VIEW_PERCENT = 2.0
"""The scale may differ from the sheet's by as much as the calibration of a built finger allows."""


@rule(
    "coverage.along",
    title="Whole gel in the picture, along the finger",
    parameter="design.gel.length_mm",
    why="a part of the gel that is not seen gives no force",
    advice="shorten the gel, widen the field of view, or allow more thickness",
)
def coverage_along(view_along_use: Real, optics_image_margin: Real) -> Finding:
    """Gel corners against the image's height."""
    return Finding(view_along_use, 1 - optics_image_margin, tolerance=TOLERANCE)


@rule(
    "coverage.across",
    title="Whole gel in the picture, across the finger",
    parameter="design.gel.width_mm",
    why="the near edge of the gel is the tightest",
    advice="narrow the gel, widen the field of view, or allow more thickness",
)
def coverage_across(view_across_use: Real, optics_image_margin: Real) -> Finding:
    """Gel corners against the image's width."""
    return Finding(view_across_use, 1 - optics_image_margin, tolerance=TOLERANCE)


@rule(
    "focus.travel_mm",
    title="Lens can be focused on the gel",
    parameter="camera.lens_travel_mm",
    why="a lens focused on the distance s stands f²/(s - f) before its place for infinity",
    advice="unscrew the lens that far (a longer thread or a spacer), or use a closer-focusing lens",
)
def focus_travel(view_lens_travel_mm: Real, camera_lens_travel_mm: Real) -> Finding:
    """Needed against possible lens extension."""

    def reason() -> str:
        needed, there = float(view_lens_travel_mm), float(camera_lens_travel_mm)
        return (
            f"to focus on the gel the lens must be unscrewed by {needed:.2f} mm and its thread "
            f"allows {there:.2f} mm, {needed - there:.2f} mm too little"
        )

    return Finding(view_lens_travel_mm, camera_lens_travel_mm, tolerance=TOLERANCE, reason=reason)


@rule(
    "focus.view_percent",
    title="Field of view of the sheet holds at the gel",
    parameter="camera.field_of_view_at_mm",
    why="a lens that focuses inside changes its field of view with the distance",
    advice="give the field of view that the sheet states for the distance of the gel",
    unit="%",
)
def focus_view(
    camera_focusing: str,
    camera_focal_length_mm: Real,
    camera_field_of_view_at_mm: Real | None,
    view_focus_mm: Real,
) -> Finding:
    """Change of scale that a lens moved as a whole would show between the two distances."""
    at_mm = camera_field_of_view_at_mm
    if camera_focusing != "internal" or at_mm is None:
        return Finding(0 * view_focus_mm, MOST_CHANGE_OF_VIEW_PERCENT)
    per_distance = np.abs(1 / view_focus_mm - 1 / at_mm)
    return Finding(100 * camera_focal_length_mm * per_distance, MOST_CHANGE_OF_VIEW_PERCENT)


@rule(
    "blur.gel",
    title="Blur on the gel, in diameters of a marker or detail",
    parameter="design.optics.blur_per_diameter",
    why="markers wash out: 1/3 of a diameter is sharp, 1/2 is the limit",
    advice="stop the lens down, use larger markers, shorten the gel, or allow more thickness",
)
def blur_gel(view_near_blur_mm: Real, view_far_blur_mm: Real, markers_diameter_mm: Real) -> Finding:
    """Largest blur on the pad."""
    worst = np.maximum(view_near_blur_mm, view_far_blur_mm) / markers_diameter_mm
    return Finding(worst, 0.5, caution=1 / 3, tolerance=TOLERANCE)


@rule(
    "blur.limit",
    title="Blur the design allows",
    parameter="design.optics.blur_per_diameter",
    why="the search keeps this limit of the spec",
    advice="allow more blur, stop the lens down, or use larger markers",
    unit="mm",
)
def blur_limit(
    view_near_blur_mm: Real, view_far_blur_mm: Real, view_blur_limit_mm: Real
) -> Finding:
    """Largest blur on the pad against the design's own limit."""
    worst = np.maximum(view_near_blur_mm, view_far_blur_mm)
    return Finding(worst, view_blur_limit_mm, tolerance=TOLERANCE * view_blur_limit_mm)


@rule(
    "blur.image_px",
    title="Blur in the picture against the circle of confusion",
    parameter="camera.f_number",
    why="fine texture is softer than the sensor could show; markers are judged by blur on the gel",
    advice="stop the lens down for sharper texture, at the cost of light",
)
def blur_image(view_image_blur_px: Real, camera_circle_of_confusion_px: Real) -> Finding:
    """Blur at the far edge in the image."""
    return Finding(view_image_blur_px, camera_circle_of_confusion_px, advisory=True)


@rule(
    "marker.far_px",
    title="Pixels across a marker or detail at the far edge",
    parameter="design.optics.min_px_per_marker",
    why="below about 6 px the centre of a dot gets uncertain",
    advice="use larger markers, more pixels, a longer lens, or allow more thickness",
)
def marker_far(
    view_marker_across_px: Real, view_marker_along_px: Real, optics_min_px_per_marker: Real
) -> Finding:
    """Smaller image axis of a far marker."""
    least = np.minimum(view_marker_across_px, view_marker_along_px)
    slack = TOLERANCE * optics_min_px_per_marker
    return Finding(least, optics_min_px_per_marker, least=True, tolerance=slack)


@rule(
    "view.keystone",
    title="Keystone",
    parameter="design.optics.max_keystone",
    why="marker size and resolution vary by this ratio over the pad",
    advice="allow more keystone or more thickness",
)
def keystone(view_keystone: Real, optics_max_keystone: Real) -> Finding:
    """Ratio of far to near distance, or its inverse where the axis is tilted back."""
    ratio = np.maximum(view_keystone, 1 / np.asarray(view_keystone))
    return Finding(ratio, optics_max_keystone, tolerance=TOLERANCE)


@rule(
    "mirror.before_camera_mm",
    title="Mirror stands before the camera",
    parameter="design.gel.length_mm",
    why="a mirror beside or behind the lens cannot fold its view",
    advice="no such finger exists for this camera and gel; change the gel's length or the lens",
)
def mirror_before_camera(mirror_lower_x_mm: Real, camera_pose_front_x_mm: Real) -> Finding:
    """Gap between the camera's front and the mirror's lower end."""
    return Finding(mirror_lower_x_mm - camera_pose_front_x_mm, 0.0, least=True)


@rule(
    "fold.feasible",
    title="Camera, mirror and gel fit each other",
    parameter="design.gel.length_mm",
    why="every limit of the folded view must hold at once",
    advice="see the other rules that fail and the advice on what limits the thickness",
)
def fold_feasible(fold_layout: Fold) -> Finding:
    """Sum of the parts by which limits of the fold are missed."""

    def reason() -> str:
        missed = {n: float(np.max(v)) for n, v in fold_layout.violations.items()}
        words = [f"{n} by {v:.1%}" for n, v in missed.items() if v > TOLERANCE_OF_FOLD]
        return "no fold keeps every limit; the least bad one misses " + ", ".join(words)

    return Finding(fold_layout.worst(), 0.0, tolerance=TOLERANCE_OF_FOLD, reason=reason)


@rule(
    "led.hidden_mm",
    title="LEDs are hidden from the lens",
    parameter="design.light_guide.leg_length_mm",
    why="direct light from an LED blinds the camera",
    advice="lengthen the legs, so that the LEDs sit deeper behind the baffle",
)
def led_hidden(
    baffle_top_z_mm: Real,
    baffle_inner_y_mm: Real,
    led_y_mm: Real,
    led_top_z_mm: Real,
    leds_package_mm: Real,
    camera_pose_z_mm: Real,
    camera_lens_diameter_mm: Real,
) -> Finding:
    """Baffle above the highest straight line from an LED to the square around the lens."""
    radius, half = camera_lens_diameter_mm / 2, leds_package_mm / 2
    rise = camera_pose_z_mm + radius - led_top_z_mm
    # Of lines that rise the steepest is the highest, of lines that fall the flattest.
    shares = [
        (led_y_mm + side * half - baffle_inner_y_mm) / (led_y_mm + side * half - end * radius)
        for side in (-1, 1)
        for end in (-1, 1)
    ]
    highest = np.max(np.broadcast_arrays(*(share * rise for share in shares)), axis=0)
    line = led_top_z_mm + highest
    return Finding(baffle_top_z_mm - line, 0.0, least=True)


@rule(
    "mirror.between_baffles_mm",
    title="Mirror fits between the baffles",
    parameter="design.light_guide.bend_radius_ratio",
    why="mirror and seat stand between the baffles",
    advice="use a larger bend radius, a wider side margin, or a smaller mirror border",
)
def mirror_between(
    mirror_width_mm: Real, baffle_inner_y_mm: Real, housing_fit_clearance_mm: Real
) -> Finding:
    """Gap between the mirror and the baffle on each side."""
    room = baffle_inner_y_mm - mirror_width_mm / 2
    return Finding(room, 2 * housing_fit_clearance_mm, least=True)


@rule(
    "view.between_baffles_mm",
    title="View passes between the baffles",
    parameter="design.light_guide.bend_radius_ratio",
    why="a baffle in the view shades the gel's side",
    advice="use a larger bend radius or a wider side margin",
)
def view_between(baffle_inner_y_mm: Real, gel_width_mm: Real) -> Finding:
    """Baffles outside the gel's width, above which the view lies."""
    return Finding(baffle_inner_y_mm - gel_width_mm / 2, 0.0, least=True)
