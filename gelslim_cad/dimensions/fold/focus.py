"""Where refraction makes the gel appear, and how a lens focused on it draws it.

A point behind plane layers has two images on its ray, by rays side by side (sagittal) and by rays
in the plane of incidence (tangential). The lens is focused between the nearest and the farthest.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gelslim_cad.dimensions.fold.problem import Array, FoldProblem, larger, smaller
from gelslim_optics.camera.refraction_newton import choose


class SeenPoint(NamedTuple):
    """A point of the gel: its ray in air, and how deep under the camera its two images are."""

    along: Array
    """Slope dx/dz of the ray."""
    cos_ray: Array
    sagittal_depth_mm: Array
    tangential_depth_mm: Array


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
        sagittal_depth_mm=air_mm + (guide + gel) * cos,
        tangential_depth_mm=(
            air_mm + (guide / guide_squared + gel / gel_squared) * (cos_squared * cos)
        ),
    )


def _on_axis(point: SeenPoint, cos_tilt: Array, sin_tilt: Array) -> Apparent:
    """The images of a point by their distances along an axis of this tilt."""
    per_depth = cos_tilt + point.along * sin_tilt
    return Apparent(
        sagittal_mm=point.sagittal_depth_mm * per_depth,
        tangential_mm=point.tangential_depth_mm * per_depth,
        cos_ray=point.cos_ray,
        cos_off_axis=per_depth * point.cos_ray,
    )


def distances(p: FoldProblem, border: SeenBorder, cos_tilt: Array, sin_tilt: Array) -> Distances:
    """Distances along an axis of this tilt, the lens in focus."""
    near_span, far_span = _spans_mm(border, cos_tilt, sin_tilt)
    focus = _focus_mm(p, near_span, far_span)
    return Distances(
        near=_on_axis(border.near, cos_tilt, sin_tilt),
        far=_on_axis(border.far, cos_tilt, sin_tilt),
        near_span_mm=near_span,
        far_span_mm=far_span,
        focus_mm=focus,
        image_mm=image_distance_mm(p, focus),
    )


def focused_image_mm(p: FoldProblem, border: SeenBorder, cos: Array, sin: Array) -> Array:
    """Image distance of a lens in focus whose axis has the tilt of this cosine and sine."""
    near_span, far_span = _spans_mm(border, cos, sin)
    return image_distance_mm(p, _focus_mm(p, near_span, far_span))


def _spans_mm(border: SeenBorder, cos: Array, sin: Array) -> tuple[Span, Span]:
    """The nearest and the farthest image of each edge along the axis."""
    near = _edge_span_mm(border.near, border.near_corner, cos, sin)
    return near, _edge_span_mm(border.far, border.far_corner, cos, sin)


def _edge_span_mm(middle: SeenPoint, corner: SeenPoint, cos: Array, sin: Array) -> Span:
    at_middle, at_corner = cos + middle.along * sin, cos + corner.along * sin
    return (
        smaller(middle.tangential_depth_mm * at_middle, corner.tangential_depth_mm * at_corner),
        larger(middle.sagittal_depth_mm * at_middle, corner.sagittal_depth_mm * at_corner),
    )


def _focus_mm(p: FoldProblem, near_mm: Span, far_mm: Span) -> Array:
    """Distance at which the largest and the least blur in the image are equal."""
    least, most = smaller(near_mm[0], far_mm[0]), larger(near_mm[1], far_mm[1])
    return choose(p.fixed_focus_mm > 0, p.fixed_focus_mm, 2 * least * most / (least + most))


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
    distances,
    focused_image_mm,
    _spans_mm,
    _edge_span_mm,
    _focus_mm,
    image_distance_mm,
)
