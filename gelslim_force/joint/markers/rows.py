"""The markers near a contact as data of its forces, and what they say of their own weights."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_PROBES = 8
"""Random sums for a trace: of 227 residuals, it leaves 3 % of their mean square uncertain."""


@dataclass(frozen=True, eq=False)
class MarkerRows:
    """Lateral motion of m of n markers by the forces on p nodes.

    Attributes:
        used: (m,) markers.
        rows: (2m, 3p) motion in x and y of each by the forces.
        residual: (2m,) in mm.
        weight: (2m,) in 1/mm².
    """

    used: NDArray[np.intp]
    rows: Any
    residual: Array
    weight: Array

    @classmethod
    def of(
        cls,
        used: NDArray[np.intp],
        rows: Any,
        lateral_mm: Array,
        motion: tuple[Array, Array, Array, Array],
        errors: tuple[float, float, float],
    ) -> MarkerRows:
        """Residuals and weights, see `fit_kernel.marker_data`.

        Args:
            used: (m,) of n markers.
            rows: (2m, 3p).
            lateral_mm: (m, 2) motion that the picture shows.
            motion: (n, 3) motion by the model, (n, 3) what cubic interpolation adds to it, (n, 2)
                lateral motion that the picture shows per mm less of height, and (n,) deviation by
                the noise.
            errors: Deviation of all, share of the bending, and limit of the residuals.
        """
        from gelslim_force.joint.kernels.fit_kernel import marker_data

        residual, weight = np.empty((2, 2 * len(used)))
        marker_data(used, lateral_mm, *motion, errors, residual, weight)
        return cls(used, rows, residual, weight)

    def after(self, step_n: Array) -> MarkerRows:
        """The same with the residuals that are left after a change (3p,) of the forces."""
        moved = self.rows @ step_n.astype(self.rows.dtype)
        return replace(self, residual=self.residual - moved)

    def by_motion(self, spread: Array) -> Array:
        """Change (6, m, 2) per mm of six sums of the forces where a used marker moves further.

        Args:
            spread: (6, q) product of the sums with the covariance of the forces. It is taken in
                the precision of the rows, which are not converted.
        """
        by_mm = (spread.astype(self.rows.dtype) @ self.rows.T) * self.weight
        return np.asarray(by_mm.reshape(len(spread), -1, 2))

    def response(self, by_motion: Array, mm_per_px: Array) -> Array:
        """Change (6, n, 2) per px of six sums of the forces where a marker is seen elsewhere.

        Args:
            by_motion: As found by the method of this name.
            mm_per_px: (n, 2, 2) of the markers.
        """
        found = np.zeros((len(by_motion), len(mm_per_px), 2))
        scale = mm_per_px[self.used]
        found[:, self.used] = by_motion[..., :1] * scale[:, 0] + by_motion[..., 1:] * scale[:, 1]
        return found

    def probes(self) -> Array:
        """(k, q) sums of the weighted rows with random signs; see `determined`."""
        weighted = _signs(len(self.weight)) * np.sqrt(self.weight)
        return np.asarray(weighted.astype(self.rows.dtype) @ self.rows)

    def determined(self, probes: Array, spread: Array) -> float:
        """Number of combinations of the forces that the markers determine.

        It is the trace of H⁻¹ Aᵀ W A with the rows A, their weights W and the Hessian H of all data
        and the prior, estimated from k sums with random signs: M. F. Hutchinson, "A stochastic
        estimator of the trace of the influence matrix", Commun. Stat. Simul. 19, 1990.

        Args:
            probes: (k, q), as found by the method of this name.
            spread: (k, q) their product with the covariance of the forces.
        """
        return float(np.vdot(probes, spread)) / len(probes)

    def overstated(self, by_motion: Array, determined: float) -> Array:
        """Part (6, 6) of the covariance of the sums that the residuals show to be too large.

        The weights hold errors of mesh and print that not every contact has. Where the residuals
        are smaller than the weights expect, the variance of the markers is that of the residuals:
        K. R. Koch, "Parameter estimation and hypothesis testing in linear models", 1999, §3.6,
        on variance components.

        Args:
            by_motion: As found by the method of this name.
            determined: As found by the method of this name.
        """
        count = len(self.residual) - determined
        seen = float(self.weight @ np.square(self.residual)) / max(count, 1.0)
        gain = by_motion.reshape(len(by_motion), -1) / np.sqrt(self.weight)
        return np.asarray(max(0.0, 1.0 - seen) * gain @ gain.T)


@lru_cache(maxsize=64)
def _signs(count: int) -> Array:
    """(k, count) random signs, the same each time."""
    return np.random.default_rng(0).choice([-1.0, 1.0], (_PROBES, count))


def rms_length(rows: Array) -> float:
    """Root mean square of the lengths of vectors (n, k); 0 without any."""
    return math.sqrt(float(np.vdot(rows, rows)) / len(rows)) if len(rows) else 0.0
