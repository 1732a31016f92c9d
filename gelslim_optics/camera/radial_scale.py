"""How a lens scales the distance of an image point from the axis, for arrays and single numbers.

Both models give the distorted image r g(r²) of a ray at the tangent r = tan θ from the axis.
Brown's polynomial (Brown 1966) is g = 1 + k1 r² + k2 r⁴ + k3 r⁶; that of Kannala and Brandt (2006),
for wide lenses, is g = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸) / r. Both are OpenCV's conventions.
The functions use only operations that mean the same for an array and a number (`fold.search` and
`undistort_kernel` compile them).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gelslim_optics.camera.refraction_newton import choose

SMALLEST = 1e-12
"""Square of a radius below which the angle is taken as here."""


def radial_scale(squared: Any, fisheye: Any, k1: Any, k2: Any, k3: Any, k4: Any) -> tuple[Any, Any]:
    """The scale g and its derivative by r², at r² = `squared`; `fisheye` tells Kannala-Brandt."""
    base, base_slope, turn, turn_slope = 1.0, 0.0, squared, 1.0
    if np.any(fisheye):
        safe = choose(squared > SMALLEST, squared, SMALLEST)
        radius = np.sqrt(safe)
        angle = np.arctan(radius)
        inverse = 1 / (1 + safe)
        base = choose(fisheye, angle / radius, 1.0)
        base_slope = choose(fisheye, (inverse - angle / radius) / (2 * safe), 0.0)
        turn = choose(fisheye, angle * angle, squared)
        turn_slope = choose(fisheye, angle / radius * inverse, 1.0)
    value = 1 + turn * (k1 + turn * (k2 + turn * (k3 + turn * k4)))
    slope = k1 + turn * (2 * k2 + turn * (3 * k3 + turn * (4 * k4)))
    return base * value, base_slope * value + base * slope * turn_slope


def undistorted_tan(
    image_tan: Any, fisheye: Any, k1: Any, k2: Any, k3: Any, k4: Any, steps: int = 30
) -> Any:
    """The tangent r of the ray with the image r g(r²) = `image_tan`, by Newton's method."""
    r = image_tan
    for _ in range(steps):
        g, slope = radial_scale(r * r, fisheye, k1, k2, k3, k4)
        r = r - (r * g - image_tan) / (g + 2 * r * r * slope)
    return r


SHARED = (radial_scale, undistorted_tan)
"""The functions that others compile."""
