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

_LEAK_UNKNOWN = 0.6
"""Share of the motion of far markers by a load that the model of the gel may have wrong."""
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
        self._px_per_mm = np.linalg.inv(motion.view.mm_per_px)
        self._spread_mm = np.sqrt(np.mean(np.square(motion.points_mm[:, :2]), axis=0))
        self._kept_gains: tuple[bytes, Array, Array] | None = None
        self._drift = DriftNoise.of(self._gains(motion.interpolation)[1], field)

    def of_forces(self, reading: NormalReading, noise_px: float, drift: FrameDrift) -> Array:
        """(6, 6) in N and N mm for forces that the normal source found itself.

        They rest on the markers near the contact. A drift of the picture therefore changes them
        less than forces that follow from the motion of all markers. Such a source knows how the
        load moves the markers from which the drift follows, but for errors of its model.
        """
        assert reading.forces is not None
        besides = self._wrench.response[:, :, 2] @ reading.sigma_mm
        rigid = np.einsum("ani,nip->ap", reading.forces.by_marker, self._field.basis)
        corrected = noise_px * (rigid @ drift.gain.reshape(4, -1))
        found = reading.forces.covariance + np.outer(besides, besides)
        remaining = drift.covariance + _LEAK_UNKNOWN**2 * np.diag(drift.leak)
        return np.asarray(found + rigid @ remaining @ rigid.T + corrected @ corrected.T)

    def of_motion(
        self,
        interpolation: MarkerInterpolation,
        filled: FilledMotion,
        noise_px: float,
        reading: NormalReading | None,
        drift: FrameDrift,
    ) -> Array:
        """(6, 6) in N and N mm for forces that follow from the motion of the markers."""
        per_mm, per_px = self._gains(interpolation)
        rigid = self._drift.covariance(drift) + self._unseen(per_mm, filled)
        gains = self._drift.corrected(per_px, drift)
        sigma = np.full(gains.shape[1], noise_px)
        sigma[filled.unseen] = 0.0
        if reading is not None and reading.known:
            common = [
                self._wrench.by_error(
                    gains, error_mm, self._in_px(self._motion.compensation_change(error_mm))
                )
                for error_mm in reading.common_errors_mm
                if error_mm.any()
            ]
            found = self._wrench.covariance(gains, sigma, common)
            return rigid + found + self._hidden(reading.hidden_n)
        noise_mm = noise_px * self._motion.view.usual_mm_per_px
        apparent = self._motion.apparent_motion(filled.motion_mm, self._unknown_normal_mm, noise_mm)
        hidden = self._wrench.by_error(gains, None, self._in_px(apparent))
        return rigid + self._wrench.covariance(gains, sigma, [hidden])

    def _in_px(self, motion_mm: Array) -> Array:
        """(n, 2) motion in the picture of the followed markers, for motions (k, 2) of all."""
        return np.einsum("nij,nj->ni", self._px_per_mm, motion_mm[self._motion.markers])

    def _unseen(self, gains: Array, filled: FilledMotion) -> Array:
        """(6, 6) by the motion of the markers that were not seen; gains (6, k, 2) per mm."""
        found = np.zeros((6, 6))
        if len(filled.unseen):
            own = gains[:, self._motion.markers[filled.unseen]]
            for axis in range(2):
                found += own[..., axis] @ filled.covariance_mm2 @ own[..., axis].T
        return found

    def _hidden(self, normal_n: float) -> Array:
        """(6, 6) by a contact that is not seen, anywhere on the gel, but for its normal force."""
        x, y = self._spread_mm
        shear = _HIDDEN_SHEAR * normal_n
        sigma = np.array([shear, shear, 0.0, y * normal_n, x * normal_n, np.hypot(x, y) * shear])
        return np.diag(np.square(sigma))

    def _gains(self, interpolation: MarkerInterpolation) -> tuple[Array, Array]:
        """Wrench (6, k, 2) per mm of all markers and (6, n, 2) per px of the followed ones.

        They are computed anew only where other markers are lost.
        """
        lost = interpolation.lost.tobytes()
        if self._kept_gains is None or self._kept_gains[0] != lost:
            per_mm = self._wrench.gains(interpolation)
            scale = self._motion.view.mm_per_px
            per_px = np.einsum("ani,nij->anj", per_mm[:, self._motion.markers], scale)
            self._kept_gains = lost, per_mm, per_px
        return self._kept_gains[1:]
