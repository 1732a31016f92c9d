"""Motion of the surface around a pressed ball at many points, from splines over the distance.

Motion and slope are continuous at the rim of the contact, but beside it the motion varies with the
power 3/2 of the distance from the rim. It is smooth over the root of that distance, over which each
side has a spline of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from gelslim_force.layer.ball_on_layer import BallOnLayer

Array = NDArray[np.float64]
_INSIDE, _OUTSIDE, _OUTSIDE_PER_THICKNESS = 28, 24, 8
"""Points on both sides of the rim, and further ones for each thickness beyond it: without friction
the splines are within 2e-5 mm."""


@dataclass(frozen=True, eq=False)
class RadialMotion:
    """Motion of the surface up to a distance from the middle of the ball.

    Attributes:
        contact_mm: Radius of contact.
        inside: Motion outwards and along z over the root of the distance from the rim.
        outside: The same beyond the rim.
    """

    contact_mm: float
    inside: CubicSpline
    outside: CubicSpline

    @classmethod
    def of(cls, contact: BallOnLayer, reach_mm: float) -> RadialMotion:
        """Sample a contact up to a distance (mm) from its middle."""
        rim = contact.contact_mm
        beyond = max(reach_mm - rim, contact.layer.thickness_mm)
        count = _OUTSIDE + int(_OUTSIDE_PER_THICKNESS * beyond / contact.layer.thickness_mm)
        inner = np.linspace(0, np.sqrt(rim), _INSIDE)
        outer = np.linspace(0, np.sqrt(beyond), count)
        radius = np.concatenate([np.maximum(rim - inner**2, 0.0), rim + outer**2])
        motion = np.column_stack(contact.motion(radius))
        return cls(rim, CubicSpline(inner, motion[:_INSIDE]), CubicSpline(outer, motion[_INSIDE:]))

    def at(self, offset_mm: Array) -> Array:
        """Motion (..., 3) at offsets (..., 2) from the middle of the ball."""
        away = np.hypot(offset_mm[..., 0], offset_mm[..., 1])
        root = np.sqrt(np.abs(away - self.contact_mm))
        under = (away < self.contact_mm)[..., None]
        found = np.where(under, self.inside(root), self.outside(root))
        outward = found[..., :1] / np.maximum(away, 1e-9)[..., None]
        return np.concatenate([offset_mm * outward, found[..., 1:]], axis=-1)

    @property
    def rim_outward_mm(self) -> float:
        """Motion outwards of the rim."""
        return float(self.outside(0.0)[0])
