"""Low-pass of the force field, in each frame as wide as the noise requires.

A wide low-pass blurs the field, a narrow one leaves its noise. For forces f = f0 + e, with noise e
of covariance C, and a linear low-pass H, the expected error |H f - f0|^2 is estimated without f0
by |f - H f|^2 + 2 tr(H C) - tr(C) (Stein, Annals of Statistics 9, 1981). The width with the
smallest estimate is taken, separately for the tangential and the normal forces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from gelslim_force.motion.surface_motion import SurfaceMotion
from gelslim_force.tracking.marker_noise import robust_sigma
from ifem_export.inverse.contact_inverse import smoothing
from ifem_export.operators.surface_operator import SurfaceOperator

Array = NDArray[np.float64]
WIDTHS_IN_CELLS = (0.0, 0.5, 0.7, 1.0, 1.5)
"""Standard deviations that are tried; a Gaussian below half a cell hardly reaches a neighbour."""
_PARTS = (slice(0, 2), slice(2, 3))
_DRAWS, _SEED = 16, 20190521


@dataclass(frozen=True)
class MotionNoise:
    """Standard deviations of white noise in one frame."""

    marker_px: float = 0.0
    """Of one coordinate of a marker's position."""
    normal_mm: float = 0.0
    """Of the normal motion of a node, independent from node to node."""

    @property
    def variances(self) -> Array:
        """(2,) in px^2 and mm^2, in the order of `ForceNoise.draws`."""
        return np.array([self.marker_px**2, self.normal_mm**2])


@dataclass(frozen=True, eq=False)
class ForceNoise:
    """Forces that follow from motions of unit noise, drawn from a fixed seed."""

    draws: Array
    """(2, d, c, 3): N per px of marker noise, N per mm of noise of the normal motion."""

    @classmethod
    def of(cls, operator: SurfaceOperator, motion: SurfaceMotion) -> ForceNoise:
        """For one sensor's linear operator and the markers it follows."""
        rng = np.random.default_rng(_SEED)
        draws = np.empty((2, _DRAWS, len(motion.points_mm), 3))
        for k in range(_DRAWS):
            moved = motion.of_noise(rng.normal(size=(len(motion.view), 2)))
            draws[0, k] = operator.force(moved)
        for k in range(_DRAWS):
            moved = np.zeros_like(motion.points_mm)
            moved[:, 2] = rng.normal(size=len(moved))
            draws[1, k] = operator.force(moved)
        return cls(draws)

    @classmethod
    def none(cls, count: int) -> ForceNoise:
        """For `count` nodes whose motion has no noise."""
        return cls(np.zeros((2, 1, count, 3)))


@dataclass(frozen=True, eq=False)
class LowPass:
    """Low-passes of one surface of c nodes, and the unit noise that remains after each."""

    widths_mm: Array
    """(k,) standard deviations; 0 leaves the forces unchanged."""
    spreads: tuple[sparse.csr_array, ...]
    """k matrices (c, c) with columns that sum to 1, so that the resultant is kept."""
    traces: Array
    """(k, 2 parts, 2 sources) of H C, N^2 per px^2 and per mm^2."""
    variances: Array
    """(k, 2 parts, 2 sources, c) of each node's force after the low-pass."""

    @classmethod
    def of(cls, points_mm: Array, widths_mm: Array, noise: ForceNoise) -> LowPass:
        """For nodes (c, 3) and noise drawn as forces."""
        spreads = tuple(_spread(points_mm, float(width)) for width in widths_mm)
        draws = noise.draws
        after = np.stack([_applied(spread, draws) for spread in spreads])
        traces = [[_mean(draws[..., p] * a[..., p]).sum(axis=1) for p in _PARTS] for a in after]
        variances = [[_mean(a[..., p] ** 2) for p in _PARTS] for a in after]
        return cls(np.asarray(widths_mm), spreads, np.array(traces), np.array(variances))

    def applied(self, force_n: Array, noise: MotionNoise) -> SmoothedForce:
        """Forces (c, 3) after the low-pass with the smallest expected error.

        Wider low-passes cost more and are tried only while the estimate falls.
        """
        from gelslim_force.forces.low_pass_kernel import spread_out

        noisy = (2 * self.traces @ noise.variances).tolist()
        smooth, chosen, least = force_n.copy(), [0, 0], [np.inf, np.inf]
        tried = np.empty_like(smooth)
        for k, spread in enumerate(self.spreads):
            fell = False
            lost = spread_out(spread.indptr, spread.indices, spread.data, force_n, tried)
            for part, columns in enumerate(_PARTS):
                error = lost[part] + noisy[k][part]
                if error < least[part]:
                    fell, least[part], chosen[part] = True, error, k
                    smooth[:, columns] = tried[:, columns]
            if not fell:
                break
        sigma = [np.sqrt(noise.variances @ self.variances[k, p]) for p, k in enumerate(chosen)]
        return SmoothedForce(smooth, np.stack(sigma, axis=1), self.widths_mm[chosen])


@dataclass(frozen=True, eq=False)
class SmoothedForce:
    """Forces after a low-pass, and the noise that remains in them."""

    force_n: Array
    """(c, 3)."""
    sigma_n: Array
    """(c, 2) standard deviations of the tangential force's size and of the normal force."""
    width_mm: Array
    """(2,) standard deviation of the low-pass, tangential and normal."""


def normal_noise_mm(curvature: sparse.csr_array, w_mm: Array) -> float:
    """Standard deviation of one node's normal motion (c,), by `estimator.curvature_operator`.

    The lower quartile is not affected by the nodes that curve around a contact.
    """
    return robust_sigma(curvature @ w_mm) / np.sqrt(1.25)


def widths_mm(cell_mm: Array, fixed_mm: float | None) -> Array:
    """Widths to choose from, for cells (2,); a single one where it is given."""
    if fixed_mm is not None:
        return np.array([fixed_mm])
    return np.sqrt(np.prod(cell_mm)) * np.array(WIDTHS_IN_CELLS)


def _spread(points_mm: Array, width_mm: float) -> sparse.csr_array:
    if width_mm:
        return smoothing(points_mm, width_mm)
    return sparse.csr_array(sparse.eye_array(len(points_mm), format="csr"))


def _applied(spread: sparse.csr_array, draws: Array) -> Array:
    """Draws (2, d, c, 3) after one low-pass."""
    columns = np.moveaxis(draws, 2, 0)
    smooth = spread @ columns.reshape(len(columns), -1)
    return np.moveaxis(smooth.reshape(columns.shape), 0, 2)


def _mean(products: Array) -> Array:
    """(2, c) summed over the components, averaged over the draws of (2, d, c, n)."""
    return np.asarray(products.sum(axis=-1).mean(axis=1))
