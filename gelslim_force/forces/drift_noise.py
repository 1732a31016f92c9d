"""What an error of the drift, and its correction, mean for the wrench.

The drift is p̂ = K d, linear in the motions d of the free markers in the picture. With the wrench
W = g (d - A p̂) of the corrected motion, the noise of d has the gains g - (g A) K, and what remains
of the drift besides has the gains g A.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.motion.surface_motion import SurfaceMotion
from gelslim_force.tracking.drift import FarField
from gelslim_force.tracking.drift_filter import FrameDrift

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DriftNoise:
    """Response of one sensor's wrench to drift.

    Attributes:
        markers: (n,) ids of the followed markers among the k of the sensor.
        px_per_mm: (n, 2, 2) motion in the picture per motion on the gel.
        rigid: (6, 4) wrench per shift x, shift y (px), scale and rotation.
    """

    markers: NDArray[np.int64]
    px_per_mm: Array
    rigid: Array

    @classmethod
    def of(cls, motion: SurfaceMotion, gains: Array, field: FarField) -> DriftNoise:
        """By the wrench's gains (6, k, 2) in N/mm and N with all markers seen."""
        scale = motion.view.mm_per_px
        rigid = np.einsum("ani,nij,njp->ap", gains[:, motion.markers], scale, field.basis)
        return cls(motion.markers, np.asarray(np.linalg.inv(scale)), rigid)

    def corrected(self, gains: Array, drift: FrameDrift) -> Array:
        """Gains (6, k, 2) of the markers' noise where the drift is taken off."""
        if not drift.gain.any():
            return gains
        taken = np.einsum("ap,pnj,nji->ani", self.rigid, drift.gain, self.px_per_mm, optimize=True)
        found = gains.copy()
        found[:, self.markers] -= taken
        return found

    def covariance(self, drift: FrameDrift) -> Array:
        """(6, 6) of the wrench for what remains of the drift, in N and N mm."""
        return np.asarray(self.rigid @ drift.covariance @ self.rigid.T)
