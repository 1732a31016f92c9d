"""What marker noise and an uncertain normal motion make of the wrench: linear propagation.

The wrench is linear in the motion of the markers, W = G S M d, with S the surface stiffness, M
the interpolation from markers to nodes and G the resultant about the origin. S is symmetric, so
six products S Gᵀ serve every frame. A masked fit uses the same motion with fewer unknowns; its
covariance is smaller, and the one given here is an upper estimate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.wrench import Wrench, resultant
from ifem_export.markers.interpolation_matrix import MarkerInterpolation
from ifem_export.operators.surface_operator import SurfaceOperator

Array = NDArray[np.float64]
UNKNOWN_WITHOUT_NORMAL = [2, 3, 4]
"""Places of f_z, t_x and t_y in the wrench."""


@dataclass(frozen=True, eq=False)
class WrenchNoise:
    """Propagation for one pad: `response` (6, c, 3) is G S in N/mm and N."""

    points_mm: Array
    response: Array

    @classmethod
    def of(cls, operator: SurfaceOperator, points_mm: Array) -> WrenchNoise:
        """Apply the operator to the six rigid motions of the surface."""
        rows = [operator.force(motion) for motion in rigid_motions(points_mm)]
        return cls(points_mm, np.stack(rows))

    def gains(self, interpolation: MarkerInterpolation) -> Array:
        """Wrench (6, k, 2) per lateral motion of each marker, N/mm and N; 0 for lost ones.

        W = (G S) M d is read off the transpose of M: the interpolation of unit motions.
        """
        rows = [interpolation.transposed(self.response[:, :, i].T) for i in (0, 1)]
        return np.stack([r.T for r in rows], axis=2)

    def covariance(
        self,
        gains: Array,
        marker_covariance_mm2: Array,
        normal_sigma_mm: Array | None = None,
        lateral_sigma_mm: Array | None = None,
    ) -> Array:
        """Covariance (6, 6) of the wrench in N and N mm.

        Args:
            gains: of the interpolation in use.
            marker_covariance_mm2: (k, 2, 2) of each marker's lateral motion.
            normal_sigma_mm: (c,) standard deviation of the normal motion, which errs in one
                piece: a depth too large is too large everywhere.
            lateral_sigma_mm: (k, 2) standard deviation of the markers' lateral motion, in one
                piece likewise: what projection makes of an unknown depth.
        """
        count = len(marker_covariance_mm2)
        spread = (gains[:, :, None, :] @ marker_covariance_mm2)[:, :, 0, :]
        total = spread.reshape(6, 2 * count) @ gains.reshape(6, 2 * count).T
        if normal_sigma_mm is not None:
            lean = self.response[:, :, 2] @ normal_sigma_mm
            total = total + np.outer(lean, lean)
        if lateral_sigma_mm is not None:
            lean = gains.reshape(6, 2 * count) @ lateral_sigma_mm.reshape(-1)
            total = total + np.outer(lean, lean)
        return np.asarray(total)

    def wrench(self, force_n: Array, covariance: Array) -> Wrench:
        """Wrench of nodal forces (c, 3); what a missing normal motion leaves open is NaN."""
        force, torque = resultant(self.points_mm, force_n)
        if not np.isfinite(force[2]):
            covariance = covariance.copy()
            covariance[UNKNOWN_WITHOUT_NORMAL, :] = np.nan
            covariance[:, UNKNOWN_WITHOUT_NORMAL] = np.nan
            flat = force_n.copy()
            flat[:, 2] = 0.0
            force, torque = resultant(self.points_mm, flat)
            force[2] = torque[0] = torque[1] = np.nan
        return Wrench(force, torque, covariance)


def rigid_motions(points_mm: Array) -> Array:
    """Motions (6, c, 3): unit translations, then unit rotations e × p, of points (c, 3)."""
    count = len(points_mm)
    motions = [np.broadcast_to(axis, (count, 3)) for axis in np.eye(3)]
    motions += [np.cross(axis, points_mm) for axis in np.eye(3)]
    return np.stack(motions)
