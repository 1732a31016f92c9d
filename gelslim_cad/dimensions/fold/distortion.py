"""How the lens's distortion moves the border of the gel's picture, and what then fits.

A ray of the slopes a = dx/dz and b = dy/dz has the ideal image (h, v), in image distances, on an
axis of the tilt γ, with v = tan(α - γ), α = atan a, and h = c sqrt(1 + v²), c = b cos α. Distorted,
v is a function of itself and c, which Newton's method inverts. With barrel distortion the middle
of an edge reaches out farthest, with pincushion distortion a corner, with both a point between.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from gelslim_cad.dimensions.fold.focus import SeenPoint
from gelslim_cad.dimensions.fold.problem import Array, FoldProblem, larger, smaller
from gelslim_optics.camera.radial_scale import radial_scale
from gelslim_optics.camera.refraction_newton import choose, newton_slope

NEWTON_STEPS = 7
PEAK_WIDTHS = (0.5, 0.1)
LAST_WIDTH = PEAK_WIDTHS[-1]
"""Half widths of the parabolas that look for the peak of an edge, as parts of it."""
SIDE_PARTS = 4
"""Parts of a side of the gel between the points whose distorted images are followed."""
FAR, NEAR = 1.0, -1.0
"""Towards which edge of the gel a coordinate is positive."""

Three = tuple[Array, Array, Array]


class Edge(NamedTuple):
    """Points of an edge of the gel: its middle, one between, a corner."""

    angle_rad: Three
    """α of the ray to each, in air."""
    across: Three
    """c of each."""


def _scale(p: FoldProblem, squared: Array) -> tuple[Array, Array]:
    """Scale g of the image and its derivative by r²; outside the sensor g is as at its corner."""
    inside = squared < p.most_tan_squared
    held = smaller(squared, p.most_tan_squared)
    g, slope = radial_scale(held, p.fisheye > 0, p.k1, p.k2, p.k3, p.k4)
    return g, choose(inside, slope, 0.0)


def image_along(p: FoldProblem, v: Array, across: Array, way: float) -> tuple[Array, Array]:
    """How far out a point appears along the finger, and the derivative by v; `way` is FAR or NEAR.

    Of the two points left and right of the axis it is the outer one.
    """
    stretch = 1 + v * v
    across_squared = across * across
    image_squared = across_squared * stretch
    g, slope = _scale(p, v * v + image_squared)
    root = np.sqrt(stretch)
    first, second = way * p.p1, 2 * np.abs(p.p2) * across
    value = v * g + first * (3 * v * v + image_squared) + second * v * root
    growth = g + 2 * slope * v * v * (1 + across_squared) + first * 2 * v * (3 + across_squared)
    return value, growth + second * (stretch + v * v) / root


def image_across(p: FoldProblem, h: Array, v: Array) -> Array:
    """How far out a point appears across the finger, the outer one of left and right."""
    g, _ = _scale(p, h * h + v * v)
    return h * g + 2 * p.p1 * h * v + np.abs(p.p2) * (3 * h * h + v * v)


def ideal_along(p: FoldProblem, image: Array, across: Array, way: float) -> Array:
    """The v of which `image_along` makes `image`."""
    v = image
    for _ in range(NEWTON_STEPS):
        value, growth = image_along(p, v, across, way)
        v = v + (image - value) / growth
    return v


def image_scale(p: FoldProblem, v: Array, across: Array) -> tuple[Array, Array]:
    """How much longer than ideal short lines are drawn at a point: across, along the finger.

    On the axis these are the radial (r g)' and, sideways, g.
    """
    image_squared = across * across * (1 + v * v)
    g, slope = _scale(p, v * v + image_squared)
    shear = 4 * slope * slope * image_squared * v * v
    wide, high = g + 2 * slope * image_squared, g + 2 * slope * v * v
    return np.sqrt(wide * wide + shear), np.sqrt(high * high + shear)


def largest_along(p: FoldProblem, edge: Edge, tilt_rad: Array, way: float) -> Array:
    """How far out an edge appears along the finger on an axis of this tilt."""
    found: Any = -np.inf
    for k in range(len(edge.angle_rad)):
        v = np.tan(way * (edge.angle_rad[k] - tilt_rad))
        found = larger(found, image_along(p, v, edge.across[k], way)[0])
    return found


def least_tilt_rad(p: FoldProblem, far: Edge, image: Array) -> Array:
    """Smallest tilt at which the far edge appears no farther out than `image`."""
    found: Any = -np.inf
    for k in range(len(far.angle_rad)):
        at = np.arctan(ideal_along(p, image, far.across[k], FAR))
        found = larger(found, far.angle_rad[k] - at)
    return found


def most_tilt_rad(p: FoldProblem, near: Edge, image: Array) -> Array:
    """Largest tilt at which the near edge appears no farther out than `image`."""
    found: Any = np.inf
    for k in range(len(near.angle_rad)):
        at = np.arctan(ideal_along(p, image, near.across[k], NEAR))
        found = smaller(found, near.angle_rad[k] + at)
    return found


def outermost_share(
    p: FoldProblem, middle: Array, corner: Array, across: Array, tilt_rad: Array, way: float
) -> Array:
    """Where on an edge, as a share of the way to its corner, its image may reach out most.

    Parabolas through three images tell, over the square of the share, in which the distortion is
    nearly one: the first through middle and corner, the second about the peak of the first.

    Args:
        p: The lens.
        middle: Slope dx/dz of the ray to the edge's middle.
        corner: That of the ray to its corner.
        across: Slope dy/dz of the ray to its corner.
        tilt_rad: Tilt of the axis.
        way: FAR or NEAR.
    """
    part = 0.5 + 0.0 * middle
    for width in PEAK_WIDTHS:
        images = (middle, middle, middle)
        for k in range(-1, 2):
            squared = part + k * width
            angle = np.arctan(middle + (corner - middle) * squared)
            v = np.tan(way * (angle - tilt_rad))
            image, _ = image_along(p, v, across * np.sqrt(squared) * np.cos(angle), way)
            images = (images[1], images[2], image)
        place = peak(images[0], images[1], images[2])[1]
        part = smaller(larger(part + width * place, LAST_WIDTH), 1 - LAST_WIDTH)
    return np.sqrt(part)


def peak(first: Array, middle: Array, last: Array) -> tuple[Array, Array]:
    """The top of the parabola through three values at -1, 0 and 1: its value, and where it is.

    Where it has none between them, the value is the largest of the three and the place 0.
    """
    bend = smaller(first - 2 * middle + last, -1e-15)
    lean = last - first
    inside = np.abs(lean) < -2 * bend
    largest = larger(larger(first, last), middle)
    top = choose(inside, middle - lean * lean / (8 * bend), largest)
    return top, choose(inside, -lean / (2 * bend), 0.0)


def one_point(angle_rad: Array) -> Edge:
    """An edge of which the ideal lens shows no more than its outermost point."""
    none = 0.0 * angle_rad
    return Edge((angle_rad, angle_rad, angle_rad), (none, none, none))


def edge_points(
    p: FoldProblem,
    middle: SeenPoint,
    corner: SeenPoint,
    corner_across: Array,
    along_mm: Array,
    air_mm: Array,
    tilt_rad: Array,
    way: float,
) -> Edge:
    """Three points of an edge that may reach out most in a distorted picture."""
    share = outermost_share(p, middle.along, corner.along, corner_across, tilt_rad, way)
    along, across = border_slopes(p, along_mm, share * p.gel_width_mm / 2, air_mm)
    angles = (np.arctan(middle.along), np.arctan(along), np.arctan(corner.along))
    return Edge(
        angles, (0.0 * across, across * np.cos(angles[1]), corner_across * np.cos(angles[2]))
    )


def sides_reach(p: FoldProblem, near_mm: Array, air_mm: Array, tilt_rad: Array) -> Array:
    """How far out the gel's sides appear across the finger: at points, and at the peak they tell.

    Args:
        p: Gel, layers and lens.
        near_mm: From below the camera to the near edge, along the finger.
        air_mm: Air between camera and window.
        tilt_rad: Tilt of the axis.
    """
    part = p.gel_length_mm / SIDE_PARTS
    before = last = _side_image(p, near_mm, air_mm, tilt_rad)
    found, top, top_mm = last, last, near_mm
    for k in range(1, SIDE_PARTS + 1):
        at = near_mm + part * k
        image = _side_image(p, at, air_mm, tilt_rad)
        found = larger(found, image)
        if k > 1:
            value, place = peak(before, last, image)
            higher = value > top
            top, top_mm = (
                choose(higher, value, top),
                choose(higher, at + part * (place - 1), top_mm),
            )
        before, last = last, image
    return larger(found, _side_image(p, top_mm, air_mm, tilt_rad))


def _side_image(p: FoldProblem, along_mm: Array, air_mm: Array, tilt_rad: Array) -> Array:
    """How far out a point of the gel's side appears across the finger."""
    along, across = border_slopes(p, along_mm, p.gel_width_mm / 2, air_mm)
    cos, sin = np.cos(tilt_rad), np.sin(tilt_rad)
    ahead = along * sin + cos
    return image_across(p, across / ahead, (along * cos - sin) / ahead)


def border_slopes(
    p: FoldProblem, along_mm: Array, across_mm: Array, air_mm: Array
) -> tuple[Array, Array]:
    """Slopes dx/dz and dy/dz, in air, of the ray to a point so far from below the camera."""
    reach = np.sqrt(along_mm * along_mm + across_mm * across_mm)
    heights = (air_mm, p.guide_thickness_mm, p.gel_total_mm)
    slope = newton_slope(reach, heights, (1.0, p.guide_index, p.gel_index))
    return slope * along_mm / reach, slope * across_mm / reach


SHARED = (
    _scale,
    image_along,
    image_across,
    ideal_along,
    image_scale,
    largest_along,
    least_tilt_rad,
    most_tilt_rad,
    outermost_share,
    peak,
    one_point,
    edge_points,
    sides_reach,
    _side_image,
    border_slopes,
)
