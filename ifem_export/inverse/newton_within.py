"""Newton's method for contact forces that push, with tangential forces within given limits.

The energy slope·d + d·gram d / 2 of changes d of the forces is quadratic, so that it is least after
one step as soon as it is known which limits the forces keep to. Each step solves for the directions
that the present limits leave free. Two to five steps find the limits where first order methods
take some hundred products with the matrix. Where a step does not lower the energy, steps along the
gradient follow. (Bertsekas, "Projected Newton methods for optimization problems with simple
constraints", SIAM J. Control Optim. 20, 1982.)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dpotrs, spotrf, spotrs

_MARGIN, _GRADIENT_STEPS, _GRADIENT_TOLERANCE = 1.05, 30, 1e-3
_LAPACK = {np.dtype(np.float32): (spotrf, spotrs), np.dtype(np.float64): (dpotrf, dpotrs)}


@dataclass(frozen=True, eq=False)
class FreeForces:
    """Directions (r,) in which forces vary within limits, with the Cholesky factor of their energy.

    Attributes:
        first: (r,) number of a force of each direction.
        second: (r,) that of another one.
        weights: (r, 2) of these.
        factor: (r, r) in the upper triangle.
    """

    first: NDArray[np.intp]
    second: NDArray[np.intp]
    weights: Any
    factor: Any

    def solved(self, pull: Any) -> Any:
        """Solution (r,) or (r, k) along the directions."""
        return _LAPACK[self.factor.dtype][1](self.factor, pull, lower=0)[0]

    def spread_of(self, sums: NDArray[np.float64]) -> NDArray[np.float64]:
        """Product (k, q) of linear functions `sums` (k, q) of the forces with their covariance."""
        along = sums[:, self.first] * self.weights[:, 0] + sums[:, self.second] * self.weights[:, 1]
        solved = np.asarray(self.solved(along.T.astype(self.factor.dtype)).T, dtype=float)
        found = np.zeros(sums.shape)
        # A force is in one direction only.
        found[:, self.second] = solved * self.weights[:, 1]
        found[:, self.first] = solved * self.weights[:, 0]
        return found


def newton_within(
    gram: Any, slope: Any, force: Any, limit: Any, tolerance: float, most: int
) -> tuple[int, FreeForces | None]:
    """Improve forces (q + 2p,) in place.

    The error is about the square of the last change, as soon as the limits do not change.

    Args:
        gram: (q + 2p, q + 2p) positive definite, in single or double precision.
        slope: (q + 2p,) gradient at the start.
        force: (q + 2p,) q normal forces, which push where they are negative, and p tangential ones.
        limit: (p,) most of each tangential force.
        tolerance: Relative change of the forces below which a step is the last one.
        most: Number of steps.

    Returns:
        The number of steps, and what varied freely in the last of them; None where nothing did.
    """
    from ifem_export.inverse.contact_fit_kernel import project_within
    from ifem_export.inverse.newton_kernel import stepped

    start, free = force.copy(), None
    project_within(force, limit)
    gradient = slope + gram @ (force - start)
    for number in range(1, most + 1):
        free, pull = _free(gram, gradient, force, limit)
        part = 0.0
        if free is not None:
            along = free.first, free.second, free.weights
            step = free.solved(-pull)
            part, change = stepped(gram, gradient, *along, step, limit, force)
            if part == 1.0 and change < tolerance:
                return number, free
        if part == 0.0:
            _along_gradient(gram, gradient, force, limit)
    return most, free


def _free(gram: Any, gradient: Any, force: Any, limit: Any) -> tuple[FreeForces | None, Any]:
    """What varies freely, and the gradient along it; None if it is nothing, or ill-conditioned."""
    from ifem_export.inverse.newton_kernel import free_directions, reduced

    size = len(force)
    first, second = np.empty((2, size), dtype=np.intp)
    weights, curvature = np.empty((size, 2), dtype=gram.dtype), np.empty(size, dtype=gram.dtype)
    count = free_directions(force, gradient, limit, first, second, weights, curvature)
    along = first[:count], second[:count], weights[:count]
    block, pull = np.empty((count, count), dtype=gram.dtype), np.empty(count, dtype=gram.dtype)
    if count == 0:
        return None, pull
    reduced(gram, gradient, *along, curvature[:count], block, pull)
    # The lower triangle by rows is the upper one in the order of LAPACK.
    factor, failed = _LAPACK[gram.dtype][0](block.T, lower=0, clean=0, overwrite_a=1)
    return (None if failed else FreeForces(*along, factor)), pull


def _along_gradient(gram: Any, gradient: Any, force: Any, limit: Any) -> None:
    """Some accelerated steps along the gradient; it and the forces are changed."""
    from ifem_export.inverse.contact_fit_kernel import descend_within, largest_eigenvalue

    before = force.copy()
    step = gram.dtype.type(1 / (_MARGIN * largest_eigenvalue(gram)))
    descend_within(gram, gradient.copy(), force, limit, step, _GRADIENT_TOLERANCE, _GRADIENT_STEPS)
    gradient += gram @ (force - before)
