"""Contacts of one ball on one layer at all sizes, by interpolation among exact solutions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from gelslim_force.layer.ball_on_layer import BallOnLayer

Array = NDArray[np.float64]
_SIZES, _RINGS = 32, 16
_LEAST, _MOST = 0.03, 0.9
"""Smallest and largest radius of contact, over that of the ball."""
_HELD = 0.75
"""Motion of the rim over that of a contact without friction. Without slip it is about 0.5; friction
is not known, so that the middle between 0.5 and 1 is taken."""
_HELD_SIGMA = 0.25
_PASSES = 3


@dataclass(frozen=True, eq=False)
class BallTable:
    """Depth, force and motion of the rim as smooth functions of the radius of contact a.

    Attributes:
        ball_mm: Radius R of the ball.
        rings: (k,) radii of rings in the contact, over a.
    """

    ball_mm: float
    rings: Array
    _by_size: CubicSpline
    """Depth and motion of the rim in a²/R, and forces (k,) on the rings in E a³/R, by ln a."""

    @classmethod
    def of(
        cls, ball_mm: float, thickness_mm: float, poissons_ratio: float, skin_mm: float
    ) -> BallTable:
        """Solve for all sizes; arguments and errors are those of `BallOnLayer.at`."""
        sizes = ball_mm * np.geomspace(_LEAST, _MOST, _SIZES)
        # Near the rim the pressure is proportional to t = √(1 - r²/a²), and r dr = -a² t dt.
        nodes, weight = np.polynomial.legendre.leggauss(_RINGS)
        t = (nodes + 1) / 2
        rings = np.sqrt(1 - t * t)
        rows = []
        for a in map(float, sizes):
            ball = BallOnLayer.at(a, ball_mm, thickness_mm, poissons_ratio, skin_mm=skin_mm)
            share = weight * t * ball.pressure(a * rings)
            force = ball.force_n_per_mpa * share / share.sum()
            outward = float(ball.motion(np.array([a]))[0][0])
            rows.append(ball_mm / a**2 * np.array([ball.depth_mm, outward, *(force / a)]))
        return cls(ball_mm, rings, CubicSpline(np.log(sizes), np.array(rows)))

    def holds(self, size_mm: float) -> bool:
        """Whether a radius of contact is within the range of the table."""
        return _LEAST * self.ball_mm <= size_mm <= _MOST * self.ball_mm

    def depth_mm(self, size_mm: float) -> float:
        """Depth of the ball's lowest point below the rest surface."""
        return float(self._at(size_mm)[0]) * size_mm**2 / self.ball_mm

    def forces_per_mpa(self, size_mm: float | Array) -> Array:
        """Forces (..., k) on the rings over Young's modulus, for one size or more (...)."""
        unit = np.asarray(size_mm) ** 3 / self.ball_mm
        return np.asarray(self._at(size_mm)[..., 2:] * unit[..., None])

    def at_rest(self, seen_mm: float) -> tuple[float, float]:
        """Radius of contact in the gel at rest, and its standard deviation, of a patch as seen.

        The rim moves with the gel: by how much depends on the friction, which is not known.
        """
        size = seen_mm
        for _ in range(_PASSES):
            size = seen_mm - _HELD * self.outward_mm(size)
        return size, _HELD_SIGMA * abs(self.outward_mm(size))

    def outward_mm(self, size_mm: float) -> float:
        """Motion outwards of the rim of a contact without friction."""
        return float(self._at(size_mm)[1]) * size_mm**2 / self.ball_mm

    def _at(self, size_mm: float | Array) -> Array:
        return np.asarray(self._by_size(np.log(size_mm)))
