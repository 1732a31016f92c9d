"""Margins of the rules that manufacture can break, of n built fingers at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from gelslim_cad.checks.optics import led_hidden
from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import has_markers
from gelslim_cad.geometry.led_strips import strip_sides, strip_wavelengths_nm
from gelslim_cad.sensor import marker_grid
from gelslim_cad.tolerance.assembly import Stage, assembled, border_points
from gelslim_cad.tolerance.built import Built, Errors
from gelslim_cad.tolerance.causes import no_errors
from gelslim_cad.tolerance.picture import Rays, blur_mm, image_distances_mm, on_sensor, rays, scales
from gelslim_force.calibration.camera_deviation import CameraTolerance
from gelslim_force.calibration.checks import MOST_SIGMAS

Array = NDArray[np.float64]
WORST = 1e3
"""Margins are cut off at plus and minus this, so that their variances are finite."""


@dataclass(frozen=True)
class Kept:
    """A rule that a built finger must keep.

    Attributes:
        title: What it demands.
        unit: Unit of its margin.
        rule: The design rule behind it, or what judges it.
        remedy: The first thing to change where it fails.
    """

    title: str
    unit: str
    rule: str
    remedy: str


RULES: Mapping[str, Kept] = {
    "coverage.along": Kept(
        "Gel in the picture, along the finger",
        "of half the picture",
        "view.along_use ≤ 1",
        "a larger design.optics.image_margin",
    ),
    "coverage.across": Kept(
        "Gel in the picture, across the finger",
        "of half the picture",
        "view.across_use ≤ 1",
        "a larger design.optics.image_margin",
    ),
    "coverage.markers": Kept(
        "Every marker whole in the picture",
        "of half the picture",
        "outermost markers",
        "a larger design.markers.edge_margin_mm",
    ),
    "blur": Kept(
        "Blur on the gel",
        "diameters of a marker or detail",
        "tolerance.largest_blur_per_diameter",
        "a smaller design.optics.blur_per_diameter, or larger markers",
    ),
    "marker.px": Kept(
        "Pixels across a marker or detail",
        "px",
        "tolerance.least_picture_ratio",
        "a larger design.optics.min_px_per_marker",
    ),
    "keystone": Kept(
        "Keystone", "", "tolerance.least_picture_ratio", "a smaller design.optics.max_keystone"
    ),
    "mirror.covers": Kept(
        "Mirror covers the view", "mm", "the view on the glass", "a larger design.mirror.border_mm"
    ),
    "led.hidden": Kept(
        "LEDs are hidden from the lens",
        "mm",
        "led.hidden_mm",
        "a larger design.light_guide.leg_length_mm",
    ),
    "light": Kept(
        "Light of each colour",
        "of nominal",
        "tolerance.least_light_ratio",
        "a measured sheet of acrylic, LEDs of one bin",
    ),
    "finger.thickness": Kept(
        "Thickness of the finger", "mm", "design.envelope.max_thickness_mm", "a thinner design"
    ),
    "calibration": Kept(
        "Calibration accepts the camera",
        "tolerances",
        "tolerances of gelslim calibrate",
        "a preloaded design.housing.camera_seat, or a smaller camera_play_mm in a loose one",
    ),
}
"""The rules in the order in which they are listed; a place of one is `rule@place`."""
ASSEMBLY: Mapping[Stage, str] = {
    "as_built": "The camera stays as it comes into its clamp; the lens is set with the jig.",
    "adjusted": "The camera is turned in its clamp until the gel lies upright in its frame in "
    "the live picture, and the lens until near and far edge are equally sharp; then it is glued.",
}
"""What a person does, by way of assembling."""


def margins(d: Dimensions, e: Errors, stage: Stage) -> dict[str, Array]:
    """Margins (n,) by `rule@place`; negative where a finger breaks the rule there.

    Args:
        d: Dimensions of the design.
        e: Errors (n,) by name.
        stage: How the fingers are assembled.

    Returns:
        The margins, finite, in the units of `RULES`.
    """
    finger = assembled(d, e, stage)
    border = rays(finger, *border_points(d, e))
    found = {
        **_coverage(d, finger, border),
        **_markers(d, e, finger),
        **_sharpness(d, e, finger, border),
        **_mirror(d, finger, border),
        **_light(d, e),
        "led.hidden@lens": _led_margin(d, finger),
        "calibration@worst": _calibration(d, e, finger),
    }
    limit = d["design.envelope.max_thickness_mm"]
    if limit is not None:
        thickness = d["finger.thickness_mm"] + e["gel_mm"] - e["body_z_mm"]
        found["finger.thickness@back"] = limit - thickness
    clipped = {k: np.clip(np.nan_to_num(v, nan=-WORST), -WORST, WORST) for k, v in found.items()}
    order = list(RULES)
    return {k: clipped[k] for k in sorted(clipped, key=lambda k: order.index(rule_of(k)))}


def rule_of(place: str) -> str:
    """The rule of a `rule@place`."""
    return place.partition("@")[0]


def worst_margins(places: Mapping[str, Array]) -> dict[str, Array]:
    """Margin (n,) of each rule: the least of its places."""
    rules = dict.fromkeys(map(rule_of, places))
    return {r: np.minimum.reduce([v for k, v in places.items() if rule_of(k) == r]) for r in rules}


def _coverage(d: Dimensions, finger: Built, border: Rays) -> dict[str, Array]:
    u, v = on_sensor(finger, border)
    rules = ("coverage.along", "coverage.along", "coverage.across", "coverage.across")
    return _in_picture(d, rules, u, v)


def _in_picture(d: Dimensions, rules: Sequence[str], u: Array, v: Array) -> dict[str, Array]:
    """Picture left beside points (n, m) at its four sides, as parts of the half picture."""
    half_u, half_v = d["view.sensor_across_mm"] / 2, d["view.sensor_along_mm"] / 2
    ends = (v.min(axis=1) / half_v, -v.max(axis=1) / half_v)
    room = (*ends, u.min(axis=1) / half_u, -u.max(axis=1) / half_u)
    places = map("@".join, zip(rules, ("near", "far", "left", "right"), strict=True))
    return {place: 1 + left for place, left in zip(places, room, strict=True)}


def _markers(d: Dimensions, e: Errors, finger: Built) -> dict[str, Array]:
    """The outermost points of the outermost markers, left out where there is no lattice."""
    points = _outermost(d)
    if points is None:
        return {}
    centre, out = points
    part = ((1 + e["print_percent"] / 100) * (1 - e["shrinkage_percent"] / 100))[:, None]
    jitter = e["jitter_mm"][:, None]
    x = part * centre[:, 0] + out[:, 0] + np.sign(out[:, 0]) * jitter
    y = part * centre[:, 1] + out[:, 1] + np.sign(out[:, 1]) * jitter
    x = x + (e["gel_x_mm"] + e["print_x_mm"])[:, None]
    y = y + (e["gel_y_mm"] + e["print_y_mm"])[:, None]
    u, v = on_sensor(finger, rays(finger, x, y))
    return _in_picture(d, ["coverage.markers"] * 4, u, v)


def _outermost(d: Dimensions) -> tuple[Array, Array] | None:
    """Centres (k, 2) of markers on the lattice's hull, and steps (k, 2) to their outer points."""
    if not has_markers(d):
        return None
    try:
        centres = marker_grid(d).positions_mm[:, :2]
        hull = centres[ConvexHull(centres).vertices]
    except (ValueError, QhullError):
        return None
    radius = d["design.markers.diameter_mm"] / 2
    steps = [np.stack([np.sign(hull[:, 0]) * radius, 0 * hull[:, 0]], axis=1)]
    steps.append(np.stack([0 * hull[:, 0], np.sign(hull[:, 1]) * radius], axis=1))
    return np.concatenate([hull, hull]), np.concatenate(steps)


def _sharpness(d: Dimensions, e: Errors, finger: Built, border: Rays) -> dict[str, Array]:
    sagittal, tangential = image_distances_mm(finger, border)
    diameter = d["design.markers.diameter_mm"]
    blur = blur_mm(finger, sagittal, tangential) / diameter
    most = d["tolerance.largest_blur_per_diameter"]
    x, y = border_points(d, e)
    least, _ = scales(finger, x[:, ::3], y[:, ::3])
    px = least * diameter / d["view.pixel_pitch_mm"]
    share = d["tolerance.least_picture_ratio"]
    least_px = share * d["design.optics.min_px_per_marker"]
    near, far = sagittal[:, 0], sagittal[:, 3]
    keystone = np.maximum(near, far) / np.minimum(near, far)
    return {
        "blur@near": most - blur[:, :3].max(axis=1),
        "blur@far": most - blur[:, 3:].max(axis=1),
        "marker.px@near": px[:, 0] - least_px,
        "marker.px@far": px[:, 1] - least_px,
        "keystone@middle": d["design.optics.max_keystone"] / share - keystone,
    }


def _mirror(d: Dimensions, finger: Built, border: Rays) -> dict[str, Array]:
    """Glass beyond the chief rays of the border, at the mirror's ends and at its sides."""
    ray = np.stack([border.slope_x, border.slope_y, np.ones_like(border.slope_x)], axis=2)
    start = finger.position_mm[:, None, :]
    normal, point = finger.mirror_normal[:, None, :], finger.mirror_point_mm[:, None, :]
    crossing = np.einsum("nmi,nmi->nm", ray, np.broadcast_to(normal, ray.shape))
    away = ((point - start) * normal).sum(axis=2) / np.where(
        np.abs(crossing) < 1e-6, 1e-6, crossing
    )
    met = start + away[:, :, None] * ray - point
    along, across = met @ finger.mirror_along, met[:, :, 1]
    half_length, half_width = d["mirror.length_mm"] / 2, d["mirror.width_mm"] / 2
    return {
        "mirror.covers@upper": half_length - along.max(axis=1),
        "mirror.covers@lower": half_length + along.min(axis=1),
        "mirror.covers@left": half_width + across.min(axis=1),
        "mirror.covers@right": half_width - across.max(axis=1),
    }


def _light(d: Dimensions, e: Errors) -> dict[str, Array]:
    """Flux that enters a leg, or the window at the tip, over nominal.

    It is the share of the LED's package before that face, whose height is that of the acrylic.
    """
    package = d["design.leds.package_mm"]
    leg = np.maximum(d["design.light_guide.thickness_mm"] + e["acrylic_mm"], 0.0)

    def entering(leg_mm: Array, off_mm: Array) -> Array:
        inside = np.minimum(leg_mm / 2, off_mm + package / 2)
        return np.maximum(inside - np.maximum(-leg_mm / 2, off_mm - package / 2), 0.0)

    still = np.zeros_like(leg)
    share = entering(leg, e["led_mm"]) / entering(
        still + d["design.light_guide.thickness_mm"], still
    )
    return {
        f"light@{name}": share * (1 + e[f"{side}_flux_percent"] / 100)
        - d["tolerance.least_light_ratio"]
        for name, side in zip(strip_wavelengths_nm(d), strip_sides(d), strict=True)
    }


def _led_margin(d: Dimensions, finger: Built) -> Array:
    """The rule `led.hidden_mm` with the camera where it is."""
    found = led_hidden(
        d["baffle.top_z_mm"],
        d["baffle.inner_y_mm"],
        d["led.y_mm"],
        d["led.top_z_mm"],
        d["design.leds.package_mm"],
        finger.camera_z_mm,
        d["camera.lens_diameter_mm"],
    )
    return np.asarray(found.value)


def _calibration(d: Dimensions, e: Errors, finger: Built) -> Array:
    """Room below the largest deviation, in tolerances, that `gelslim calibrate` accepts.

    A tilt and an offset of the principal point shift the picture alike; one picture tells only
    their sum.
    """
    design = assembled(d, no_errors(d), "as_built")
    right, down, _ = design.axes[0]
    t = CameraTolerance()
    offset = finger.principal_mm / design.image_mm
    allowed = t.principal_share * d["camera.image_width_px"] / d["view.focal_px"]
    tilt = np.hypot(np.radians(t.tilt_deg), allowed)
    forward = finger.axes[:, 2]
    shift = finger.position_mm - design.position_mm
    ratios = [
        (forward @ right - offset[:, 0]) / tilt,
        (forward @ down - offset[:, 1]) / tilt,
        finger.axes[:, 0] @ down / np.radians(t.turn_deg),
        (shift[:, 0] - e["gel_x_mm"] - e["print_x_mm"]) / t.lateral_mm,
        (shift[:, 1] - e["gel_y_mm"] - e["print_y_mm"]) / t.lateral_mm,
        (finger.heights_mm[0] - design.heights_mm[0])[:, 0] / t.height_mm,
        100 * (finger.image_mm / design.image_mm - 1) / t.focal_percent,
    ]
    return MOST_SIGMAS - np.maximum.reduce(np.abs(ratios))
