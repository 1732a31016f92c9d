"""Least squares for contact forces: sums over the data, the prior, and the covariance.

The unknowns are the forces (3p,) on p nodes. Rows of data enter as A f = b with weights, and the
gain of the light, which is one more unknown with a prior, is eliminated exactly:

    min over f, γ of  Σ w (A f + d γ - b)² + ((γ - γ₀) / σ)²
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import cho_factor, cho_solve

Array = NDArray[np.float64]
STEPS = 400
TOLERANCE = 1e-4
_MARGIN = 1.05


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Hessian (3p, 3p) and gradient's constant part (3p,): minimise f·H f / 2 - g·f."""

    hessian: Array
    constant: Array

    @classmethod
    def of(cls, size: int) -> NormalEquations:
        """No data yet."""
        return cls(np.zeros((size, size)), np.zeros(size))

    def with_rows(self, rows: Array, values: Array, weight: Array) -> NormalEquations:
        """With the data rows (n, 3p), values (n,) and weights (n,)."""
        weighted = rows * np.sqrt(weight)[:, None]
        return NormalEquations(
            self.hessian + weighted.T @ weighted, self.constant + rows.T @ (weight * values)
        )

    def with_heights(
        self,
        slopes: sparse.csr_array,
        heights: Array,
        values: Array,
        weight: Array,
        by_gain: Array,
        gain: tuple[float, float],
    ) -> NormalEquations:
        """With data (n,) that depend on the heights of m nodes near the contact, and on the gain γ.

        Args:
            slopes: (n, m) derivative of the data by the heights.
            heights: (m, 3p) heights per force.
            values: (n,).
            weight: (n,).
            by_gain: (n,) derivative of the data by the gain.
            gain: Value and standard deviation of the gain beforehand.
        """
        weighted = sparse.csr_array(slopes.T @ sparse.diags_array(weight))
        hessian = heights.T @ ((weighted @ slopes) @ heights)
        constant = heights.T @ (weighted @ values)
        mixed = heights.T @ (weighted @ by_gain)
        expected, sigma = gain
        own = float(weight @ (by_gain * by_gain)) + sigma**-2
        seen = float(weight @ (by_gain * values)) + expected / sigma**2
        return NormalEquations(
            self.hessian + hessian - np.outer(mixed, mixed) / own,
            self.constant + constant - mixed * (seen / own),
        )

    def with_prior(
        self,
        neighbours: Array,
        area_mm2: Array,
        roughness_mpa: float,
        normal_mpa: float,
        tangential_mpa: float,
    ) -> NormalEquations:
        """With smooth tractions of limited size.

        Args:
            neighbours: (p, p) with 1 where nodes are neighbours.
            area_mm2: (p,) area of each node.
            roughness_mpa: Standard deviation of the difference between neighbours.
            normal_mpa: Standard deviation of the pressure.
            tangential_mpa: Standard deviation of the tangential traction.
        """
        laplacian = np.diag(neighbours.sum(axis=1)) - neighbours
        smooth = laplacian / roughness_mpa**2 / np.outer(area_mm2, area_mm2)
        hessian = self.hessian.copy()
        for axis, size in enumerate((tangential_mpa, tangential_mpa, normal_mpa)):
            hessian[axis::3, axis::3] += smooth + np.diag((size * area_mm2) ** -2.0)
        return NormalEquations(hessian, self.constant)

    def solved(self, start: Array, friction: float) -> Array:
        """(3p,) forces in Coulomb's cone that minimise, from those at the start (3p,)."""
        from ifem_export.inverse.contact_fit_kernel import descend, largest_eigenvalue

        force = np.ascontiguousarray(start, dtype=float).copy()
        step = 1.0 / (_MARGIN * largest_eigenvalue(self.hessian))
        slope = self.hessian @ force - self.constant
        descend(self.hessian, slope, force, friction, step, TOLERANCE, STEPS)
        return force

    def covariance_of(self, sums: Array, force: Array) -> Array:
        """Covariance (k, k) of linear functions `sums` (k, 3p) of the forces.

        Nodes that do not press stay free of force, and the others vary in all components.
        """
        pressing = np.repeat(force.reshape(-1, 3)[:, 2] < 0, 3)
        if not pressing.any():
            return np.zeros((len(sums), len(sums)))
        factor = cho_factor(self.hessian[np.ix_(pressing, pressing)])
        kept = sums[:, pressing]
        return np.asarray(kept @ cho_solve(factor, kept.T))


def huber(residual: Array, sigma: Array, limit: float) -> Array:
    """Weights (n,) of residuals, which grow linearly beyond `limit` standard deviations."""
    size = np.abs(residual) / sigma
    return np.asarray(np.minimum(1.0, limit / np.maximum(size, 1e-12)) / sigma**2)
