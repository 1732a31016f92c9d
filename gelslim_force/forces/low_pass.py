"""Low-pass of the force field, in each frame as wide as its noise calls for.

A wide low-pass blurs the field, a narrow one leaves its noise. For forces f = f0 + e, with noise e
of covariance C, and a linear low-pass H, the expected error |H f - f0|^2 is estimated without f0
by |f - H f|^2 + 2 tr(H C) - tr(C) (Stein, Annals of Statistics 9, 1981). The width of the least
estimate is taken, for the tangential and the normal forces apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from gelslim_force.forces.noise import ForceNoise, MotionNoise
from ifem_export.inverse.contact_inverse import smoothing

Array = NDArray[np.float64]
WIDTHS_IN_CELLS = (0.0, 0.5, 0.7, 1.0, 1.5)
"""Standard deviations that are tried; below half a cell a Gaussian leaves a node to itself."""
TANGENTIAL, NORMAL = 0, 1
_PARTS = (slice(0, 2), slice(2, 3))


@dataclass(frozen=True, eq=False)
class LowPass:
    """Low-passes of one surface of c nodes, and what unit noise leaves behind each."""

    widths_mm: Array
    """(k,) standard deviations; 0 takes the forces as they come."""
    spreads: tuple[sparse.csr_array, ...]
    """k of (c, c) with columns that sum to 1, so that the resultant is kept."""
    traces: Array
    """(k, 2 parts, 2 sources) of H C, N^2 per px^2 and per mm^2."""
    variances: Array
    """(k, 2 parts, 2 sources, c) of each node's force behind the low-pass."""

    @classmethod
    def of(cls, points_mm: Array, widths_mm: Array, noise: ForceNoise) -> LowPass:
        """For nodes (c, 3) and noise drawn as forces."""
        spreads = tuple(_spread(points_mm, float(width)) for width in widths_mm)
        behind = np.stack([_applied(spread, noise.draws) for spread in spreads])
        draws = noise.draws
        traces = [[_mean(draws[..., p] * b[..., p]).sum(axis=1) for p in _PARTS] for b in behind]
        variances = [[_mean(b[..., p] ** 2) for p in _PARTS] for b in behind]
        return cls(np.asarray(widths_mm), spreads, np.array(traces), np.array(variances))

    def applied(self, force_n: Array, noise: MotionNoise) -> SmoothedForce:
        """Forces (c, 3) behind the low-pass of the least expected error.

        Wider ones are dearer and are tried only while the estimate falls.
        """
        noisy = 2 * self.traces @ noise.variances
        smooth, chosen, least = force_n.copy(), [0, 0], [np.inf, np.inf]
        for k, spread in enumerate(self.spreads):
            tried = spread @ force_n if self.widths_mm[k] else force_n
            fell = False
            for part, columns in enumerate(_PARTS):
                left = ((force_n[:, columns] - tried[:, columns]) ** 2).sum()
                if left + noisy[k, part] < least[part]:
                    fell, least[part], chosen[part] = True, left + noisy[k, part], k
                    smooth[:, columns] = tried[:, columns]
            if not fell:
                break
        sigma = [np.sqrt(noise.variances @ self.variances[k, p]) for p, k in enumerate(chosen)]
        return SmoothedForce(smooth, np.stack(sigma, axis=1), self.widths_mm[chosen])


@dataclass(frozen=True, eq=False)
class SmoothedForce:
    """Forces behind a low-pass, and what noise leaves in them."""

    force_n: Array
    """(c, 3)."""
    sigma_n: Array
    """(c, 2): of the size of the tangential force, and of the normal force."""
    width_mm: Array
    """(2,) standard deviation of the low-pass, tangential and normal."""


def widths_mm(cell_mm: Array, fixed_mm: float | None) -> Array:
    """Widths to choose from on cells (2,): one where it is given."""
    if fixed_mm is not None:
        return np.array([fixed_mm])
    return np.sqrt(np.prod(cell_mm)) * np.array(WIDTHS_IN_CELLS)


def _spread(points_mm: Array, width_mm: float) -> sparse.csr_array:
    if width_mm:
        return smoothing(points_mm, width_mm)
    return sparse.csr_array(sparse.eye_array(len(points_mm), format="csr"))


def _applied(spread: sparse.csr_array, draws: Array) -> Array:
    """Draws (2, d, c, 3) behind one low-pass."""
    columns = np.moveaxis(draws, 2, 0)
    smooth = spread @ columns.reshape(len(columns), -1)
    return np.moveaxis(smooth.reshape(columns.shape), 0, 2)


def _mean(products: Array) -> Array:
    """(2, c) summed over the components, averaged over the draws of (2, d, c, n)."""
    return np.asarray(products.sum(axis=-1).mean(axis=1))
