"""Covariance of a frame's wrench: noise of the markers, normal motion and drift together."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gelslim_force.contact.normal_source import NormalReading
from gelslim_force.forces.drift_noise import DriftNoise
from gelslim_force.forces.wrench import WrenchNoise
from gelslim_force.motion.surface_motion import SurfaceMotion
from gelslim_force.motion.unseen_motion import FilledMotion
from gelslim_force.tracking.drift import FarField
from gelslim_force.tracking.drift_filter import FrameDrift
from ifem_export.markers.interpolation_matrix import MarkerInterpolation

Array = NDArray[np.float64]

_HIDDEN_SHEAR = 0.2
"""Usual tangential force of a contact over its normal force."""


class WrenchCovariance:
    """Covariances for one sensor.

    Args:
        wrench: Linear propagation to the wrench.
        motion: From the markers to the surface.
        field: The fit of the drift.
        unknown_normal_mm: Depth that may remain unnoticed where the normal motion is unknown.
    """

    def __init__(
        self,
        wrench: WrenchNoise,
        motion: SurfaceMotion,
        field: FarField,
        unknown_normal_mm: float,
    ) -> None:
        self._wrench, self._motion = wrench, motion
        self._unknown_normal_mm = unknown_normal_mm
        self._field = field
        self._drift = DriftNoise.of(motion, wrench.gains(motion.interpolation), field)
        self._kept_gains: tuple[bytes, Array] | None = None

    def of_forces(self, reading: NormalReading, noise_px: float, drift: FrameDrift) -> Array:
        """(6, 6) in N and N mm for forces that the normal source found itself.

        They rest on the markers near the contact. A drift of the picture therefore changes them
        less than forces that follow from the motion of all markers.
        """
        assert reading.forces is not None
        besides = self._wrench.response[:, :, 2] @ reading.sigma_mm
        rigid = np.einsum("ani,nip->ap", reading.forces.by_marker, self._field.basis)
        corrected = noise_px * (rigid @ drift.gain.reshape(4, -1))
        found = reading.forces.covariance + np.outer(besides, besides)
        return np.asarray(found + rigid @ drift.covariance @ rigid.T + corrected @ corrected.T)

    def of_motion(
        self,
        interpolation: MarkerInterpolation,
        filled: FilledMotion,
        noise_px: float,
        reading: NormalReading | None,
        drift: FrameDrift,
    ) -> Array:
        """(6, 6) in N and N mm for forces that follow from the motion of the markers."""
        whole = self._gains(interpolation)
        gains = self._drift.corrected(whole, drift)
        rigid = self._drift.covariance(drift) + self._unseen(whole, filled)
        motion_mm, seen = filled.motion_mm, np.ones(len(filled.motion_mm), dtype=bool)
        seen[filled.unseen] = False
        spread = self._motion.covariance_mm2(seen, noise_px)
        if reading is not None and reading.known:
            lateral = self._motion.compensation_change(reading.sigma_mm)
            found = self._wrench.covariance(gains, spread, reading.sigma_mm, lateral)
            return rigid + found + self._hidden(reading.hidden_n)
        apparent = self._motion.apparent_motion(motion_mm, self._unknown_normal_mm)
        return rigid + self._wrench.covariance(gains, spread, lateral_sigma_mm=apparent)

    def _unseen(self, gains: Array, filled: FilledMotion) -> Array:
        """(6, 6) by the motion of the markers that were not seen."""
        own = gains[:, self._motion.markers[filled.unseen]]
        return np.einsum("ani,nm,bmi->ab", own, filled.covariance_mm2, own, optimize=True)

    def _hidden(self, normal_n: float) -> Array:
        """(6, 6) by a contact that is not seen, anywhere on the gel, but for its normal force."""
        x, y = np.sqrt(np.mean(np.square(self._motion.points_mm[:, :2]), axis=0))
        shear = _HIDDEN_SHEAR * normal_n
        sigma = np.array([shear, shear, 0.0, y * normal_n, x * normal_n, np.hypot(x, y) * shear])
        return np.diag(np.square(sigma))

    def _gains(self, interpolation: MarkerInterpolation) -> Array:
        """Wrench per motion of each marker; computed anew only where other markers are lost."""
        lost = interpolation.lost.tobytes()
        if self._kept_gains is None or self._kept_gains[0] != lost:
            self._kept_gains = lost, self._wrench.gains(interpolation)
        return self._kept_gains[1]
