"""Least squares for contact forces: sums over linear data, the prior, and the covariance.

The unknowns are changes x (3p,) of the forces on p nodes from a start f. Rows of data enter as
r - A x with weights, and the gain of the light, which is one more unknown with a prior, is
eliminated exactly:

    min over x, γ of  Σ w (r - A x - d γ)² + ((γ - γ₀) / σ)²

Written for changes, the sums can be made in single precision: its error is one of the step, and
vanishes with the step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

if TYPE_CHECKING:
    from gelslim_force.joint.light.sums import LightSums
    from gelslim_force.joint.markers.rows import MarkerRows
from gelslim_force.joint.strained_gel import Excess

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]
STEPS = 400
TOLERANCE = 1e-4
_MARGIN = 1.05


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Hessian (3p, 3p) and slope (3p,) at the start: minimise x·H x / 2 + slope·x."""

    hessian: Array
    slope: Array

    @classmethod
    def of(cls, size: int) -> NormalEquations:
        """No data yet."""
        return cls(np.zeros((size, size)), np.zeros(size))

    def with_rows(self, rows: Any, residual: Array, weight: Array) -> NormalEquations:
        """With the data rows (n, 3p), residuals (n,) and weights (n,)."""
        root = np.sqrt(weight).astype(rows.dtype)
        weighted = rows * root[:, None]
        pull = weighted.T @ (root * residual.astype(rows.dtype))
        return NormalEquations(self.hessian + weighted.T @ weighted, self.slope - pull)

    def with_light(
        self, light: LightSums, heights: Any, gain: tuple[float, float]
    ) -> NormalEquations:
        """With sums over the light, and a gain that is not known.

        Args:
            light: By the heights of m nodes.
            heights: (m, 3p) heights per force.
            gain: Expected change of the gain, and its standard deviation.
        """
        from gelslim_force.joint.kernels.fit_kernel import add_light, sparse_product

        expected, sigma = gain
        own = light.by_gain + sigma**-2
        seen = (light.gain_pull + expected / sigma**2) / own
        sums = np.column_stack([light.pull - light.mixed * seen, light.mixed])
        pull, mixed = (heights.T @ sums.astype(heights.dtype)).T.astype(float)
        # Heights of nodes that are far apart share no bin.
        product = np.empty_like(heights)
        sparse_product(light.matrix.astype(heights.dtype), heights, product)
        hessian = np.empty_like(self.hessian)
        half = len(mixed) // 2
        gram = np.empty(hessian.shape, dtype=heights.dtype)
        # The lower left quarter is the image of the upper right one.
        np.matmul(heights.T[:half], product, out=gram[:half])
        np.matmul(heights.T[half:], product[:, half:], out=gram[half:, half:])
        gram[half:, :half] = gram[:half, half:].T
        add_light(self.hessian, gram, mixed, 1 / own, hessian)
        return NormalEquations(hessian, self.slope - pull)

    def with_prior(
        self,
        start: Array,
        neighbours: Array,
        area_mm2: Array,
        roughness_mpa: float,
        normal_mpa: float,
        tangential_mpa: float,
    ) -> NormalEquations:
        """With smooth tractions of limited size.

        Args:
            start: (3p,) forces at the start.
            neighbours: (p, p) with 1 where nodes are neighbours.
            area_mm2: (p,) area of each node.
            roughness_mpa: Standard deviation of the difference between neighbours.
            normal_mpa: Standard deviation of the pressure.
            tangential_mpa: Standard deviation of the tangential traction.
        """
        from gelslim_force.joint.kernels.fit_kernel import add_prior

        hessian, slope = self.hessian.copy(), self.slope.copy()
        sizes = np.array([tangential_mpa, tangential_mpa, normal_mpa])
        add_prior(neighbours, area_mm2, roughness_mpa, sizes, start, hessian, slope)
        return NormalEquations(hessian, slope)

    def solved(self, start: Array, friction: float, tolerance: float = TOLERANCE) -> Array:
        """(3p,) forces in Coulomb's cone that minimise, from those at the start (3p,).

        The relative change of the last step is within the tolerance.
        """
        from ifem_export.inverse.contact_fit_kernel import descend, largest_eigenvalue

        gram, slope = (a.astype(np.float32) for a in (self.hessian, self.slope))
        step = 1.0 / (_MARGIN * largest_eigenvalue(gram))
        force = start.astype(np.float32)
        descend(gram, slope, force, friction, np.float32(step), tolerance, STEPS)
        return force.astype(float)

    def spread_of(self, sums: Array, free: NDArray[np.bool_]) -> Array:
        """Product (k, q) of linear functions `sums` (k, q) of the forces with their covariance.

        Only forces that are `free` (q,) vary.
        """
        from gelslim_force.joint.kernels.fit_kernel import take_triangle

        found = np.zeros(sums.shape)
        if free.any():
            varied = np.flatnonzero(free)
            block = np.empty((len(varied), len(varied)))
            take_triangle(self.hessian, varied, block)
            # The upper triangle of the transposed block, in the order of LAPACK.
            factor = cho_factor(block.T, overwrite_a=True, check_finite=False)
            found[:, varied] = cho_solve(factor, sums[:, varied].T, check_finite=False).T
        return found


@dataclass(frozen=True, eq=False)
class Linearised:
    """Data by the forces on p nodes.

    Attributes:
        nodes: (p,) those whose forces are sought.
        start: (3p,) their forces to start from.
        moved_mm: (c, 3) motion of the surface in the estimate.
        excess: The part of it by which a gel at large strain moves further.
        gain: Of the light in the estimate.
        deepness: Of the contact in the estimate.
        equations: Of the data, without a prior.
        markers: Data of the markers.
        light: Data of the light; None without light.
        heights: (m, 3r) heights of the nodes of `light` per force on the r nodes of the estimate;
            None without light.
        step: (3r,) change of the forces from the estimate to the start; None for no change.
        free: (3p,) numbers of the forces sought among those; None for all.
    """

    nodes: Nodes
    start: Array
    moved_mm: Array
    excess: Excess
    gain: float
    deepness: float
    equations: NormalEquations
    markers: MarkerRows
    light: LightSums | None
    heights: Any
    step: Array | None = None
    free: Nodes | None = None

    def heights_after(self, force: Array) -> Array | None:
        """Change (m,) of the heights from the estimate to forces (3p,); None without light."""
        if self.light is None:
            return None
        step = force - self.start
        if self.step is not None:
            whole = self.step.copy()
            whole[self.free] = step
            step = whole
        return np.asarray(self.heights @ step.astype(self.heights.dtype), dtype=float)

    def on(self, nodes: Nodes) -> Linearised:
        """The same data where only some of the nodes (q,) may press; the others bear no force.

        The data must be those of all nodes.
        """
        from gelslim_force.joint.kernels.fit_kernel import take_nodes

        kept = np.flatnonzero(np.isin(self.nodes, nodes, assume_unique=True))
        free = (3 * kept[:, None] + np.arange(3)).ravel()
        step = -self.start
        step[free] = 0.0
        hessian, own = self.equations.hessian, np.empty((len(free), len(free)))
        take_nodes(hessian[free], kept, own)
        rows = np.empty((len(self.markers.rows), len(free)), dtype=self.markers.rows.dtype)
        take_nodes(self.markers.rows, kept, rows)
        return replace(
            self,
            nodes=nodes,
            start=self.start[free],
            equations=NormalEquations(own, (self.equations.slope + hessian @ step)[free]),
            markers=replace(self.markers.after(step), rows=rows),
            step=step,
            free=free,
        )


def huber(residual: Array, sigma: Array, limit: float) -> Array:
    """Weights (n,) of residuals, which grow linearly beyond `limit` standard deviations."""
    size = np.abs(residual) / sigma
    return np.asarray(np.minimum(1.0, limit / np.maximum(size, 1e-12)) / sigma**2)
