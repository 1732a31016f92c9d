"""Where refraction makes the gel appear, and how a lens focused on it draws it.

A point behind plane layers has two images on its ray, by rays side by side (sagittal) and by rays
in the plane of incidence (tangential). The lens is focused between the nearest and the farthest.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gelslim_cad.dimensions.fold_problem import Array, FoldProblem, larger, smaller
from gelslim_optics.camera.refraction_newton import choose


class SeenPoint(NamedTuple):
    """A point of the gel: its ray in air, and where it is seen along the ray from the camera."""

    along: Array
    """Slope dx/dz of the ray."""
    cos_ray: Array
    sagittal_mm: Array
    tangential_mm: Array


class SeenBorder(NamedTuple):
    """Points of the gel's border: the middle and a corner of each edge."""

    near: SeenPoint
    near_corner: SeenPoint
    far: SeenPoint
    far_corner: SeenPoint


class Apparent(NamedTuple):
    """Apparent distances along the camera's axis of a point of the gel, by the fan of rays."""

    sagittal_mm: Array
    """By rays side by side. The scale across the finger follows from it in the mid-plane."""
    tangential_mm: Array
    """By rays in the plane of incidence. Refraction brings this image nearer."""
    cos_ray: Array
    cos_off_axis: Array


Span = tuple[Array, Array]


class Distances(NamedTuple):
    """How far the gel seems to be from the camera, along its axis."""

    near: Apparent
    """The middle of the near edge."""
    far: Apparent
    near_span_mm: Span
    """Nearest and farthest image of the near edge, its corners included."""
    far_span_mm: Span
    focus_mm: Array
    """To the plane that is sharp."""
    image_mm: Array
    """From the lens to the sensor."""


def edge_blur_mm(aperture_mm: Array, span_mm: Span, focus_mm: Array) -> Array:
    """Largest blur b = A |Z - s| / s on the gel of an edge, by the image that is less sharp."""
    off = larger(np.abs(span_mm[0] - focus_mm), np.abs(span_mm[1] - focus_mm))
    return aperture_mm * off / focus_mm


def across_scale(edge: Apparent, image_mm: Array) -> Array:
    """Length in the image of a unit length on the gel across the finger, v / Zs."""
    return image_mm / edge.sagittal_mm


def along_scale(edge: Apparent, image_mm: Array) -> Array:
    """Length in the image of a unit length along the finger, v cos θ / (Zt cos(θ - γ))."""
    return image_mm * edge.cos_ray / (edge.tangential_mm * edge.cos_off_axis)


def seen_point(p: FoldProblem, along: Array, across: Array | float, air_mm: Array) -> SeenPoint:
    """Images of a point of the gel through plane layers, by Coddington's equations.

    Its ray has the slopes `along` = dx/dz and `across` = dy/dz in air.
    """
    cos_squared = 1 / (1 + along * along + across * across)
    cos = np.sqrt(cos_squared)
    guide_squared = 1 - (1 - cos_squared) / (p.guide_index * p.guide_index)
    gel_squared = 1 - (1 - cos_squared) / (p.gel_index * p.gel_index)
    guide = p.guide_thickness_mm / (p.guide_index * np.sqrt(guide_squared))
    gel = p.gel_total_mm / (p.gel_index * np.sqrt(gel_squared))
    return SeenPoint(
        along=along,
        cos_ray=cos,
        sagittal_mm=air_mm / cos + guide + gel,
        tangential_mm=air_mm / cos + (guide / guide_squared + gel / gel_squared) * cos_squared,
    )


def _on_axis(point: SeenPoint, cos_tilt: Array, sin_tilt: Array) -> Apparent:
    """The same images by their distances along an axis of this tilt."""
    cos_off = (cos_tilt + point.along * sin_tilt) * point.cos_ray
    return Apparent(
        sagittal_mm=point.sagittal_mm * cos_off,
        tangential_mm=point.tangential_mm * cos_off,
        cos_ray=point.cos_ray,
        cos_off_axis=cos_off,
    )


def focused(p: FoldProblem, border: SeenBorder, cos_tilt: Array, sin_tilt: Array) -> Distances:
    """Distances along an axis of this tilt, the largest and the least blur in the image equal."""
    near = _on_axis(border.near, cos_tilt, sin_tilt)
    far = _on_axis(border.far, cos_tilt, sin_tilt)
    near_span = _span_mm(near, _on_axis(border.near_corner, cos_tilt, sin_tilt))
    far_span = _span_mm(far, _on_axis(border.far_corner, cos_tilt, sin_tilt))
    least, most = smaller(near_span[0], far_span[0]), larger(near_span[1], far_span[1])
    focus = choose(p.fixed_focus_mm > 0, p.fixed_focus_mm, 2 * least * most / (least + most))
    return Distances(
        near=near,
        far=far,
        near_span_mm=near_span,
        far_span_mm=far_span,
        focus_mm=focus,
        image_mm=image_distance_mm(p, focus),
    )


def _span_mm(middle: Apparent, corner: Apparent) -> Span:
    """The nearest and the farthest image of an edge."""
    return (
        smaller(middle.tangential_mm, corner.tangential_mm),
        larger(middle.sagittal_mm, corner.sagittal_mm),
    )


def image_distance_mm(p: FoldProblem, focus_mm: Array) -> Array:
    """Image distance v = f s / (s - f) of a lens focused on the distance s."""
    # A lens at its own focal length from the gel has no image; the limit of its travel says so.
    image = p.focal_length_mm * focus_mm / larger(focus_mm - p.focal_length_mm, 1e-3)
    return choose(p.fixed_image_mm > 0, p.fixed_image_mm, image)


SHARED = (
    edge_blur_mm,
    across_scale,
    along_scale,
    seen_point,
    _on_axis,
    focused,
    _span_mm,
    image_distance_mm,
)
