"""What an error of the drift, and its correction, mean for the wrench.

The drift is p̂ = K d, linear in the motions d of the free markers in the picture. With the wrench
W = g (d - A p̂) of the corrected motion, the noise of d has the gains g - (g A) K, and what remains
of the drift besides has the gains g A. All gains are per px of motion in the picture.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.tracking.drift import FarField
from gelslim_force.tracking.drift_filter import FrameDrift

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DriftNoise:
    """Response of one sensor's wrench to drift.

    Attributes:
        rigid: (6, 4) wrench per shift x, shift y (px), scale and rotation.
    """

    rigid: Array

    @classmethod
    def of(cls, gains: Array, field: FarField) -> DriftNoise:
        """By the wrench's gains (6, n, 2) in N/px and N mm/px with all markers seen."""
        return cls(gains.reshape(6, -1) @ field.basis.reshape(-1, 4))

    def corrected(self, gains: Array, drift: FrameDrift) -> Array:
        """Gains (6, n, 2) of the markers' noise where the drift is taken off."""
        if not drift.gain.any():
            return gains
        return np.asarray(gains - (self.rigid @ drift.gain.reshape(4, -1)).reshape(gains.shape))

    def covariance(self, drift: FrameDrift) -> Array:
        """(6, 6) of the wrench for what remains of the drift, in N and N mm."""
        remaining = drift.covariance + np.diag(drift.leak)
        return np.asarray(self.rigid @ remaining @ self.rigid.T)
