"""Surface forces from noisy motion: least squares on a contact mask, or a low-pass without one.

F = S u amplifies noise, the more the finer. Where the contact is known, forces vanish elsewhere,
only push (no adhesion) and keep Coulomb's cone: `masked_force` fits the whole surface's motion
with such forces. Where it is not, `smoothed_force` spreads each nodal force over its neighbours,
which keeps the resultant exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.linalg import eigvalsh_tridiagonal
from scipy.spatial import cKDTree

from ifem_export.errors import IfemError
from ifem_export.operators.compliance_gram import ComplianceGram, gram_of
from ifem_export.operators.surface_field import checked
from ifem_export.operators.surface_operator import SurfaceOperator

Array = NDArray[np.float64]
LANCZOS_STEPS = 4
MARGIN = 1.05
"""Room above the estimated largest eigenvalue: Lanczos comes from below."""
MOST_BY_GRAM = 200
"""Nodes up to which products among them, (3n)², are quicker than the operator."""
ROUND = 10.0
"""Change of a round over that of a step at which the rounds end."""


@dataclass(frozen=True, eq=False)
class MaskedForce:
    """Forces (c, 3) in N, how much of the motion they explain, and steps taken.

    `misfit` is |C F - u| / |u|; `change` the last step's size over the forces' own.
    """

    force_n: Array
    misfit: float
    change: float
    steps: int
    converged: bool


def masked_force(
    operator: SurfaceOperator,
    displacement_mm: ArrayLike,
    mask: ArrayLike,
    *,
    friction: float = 1.0,
    start_n: ArrayLike | None = None,
    most_steps: int = 200,
    tolerance: float = 1e-3,
) -> MaskedForce:
    """Forces on the masked nodes that fit the motion best in least squares.

    Minimises |C F - u|² over F = 0 off the mask, F_z <= 0 and |F_xy| <= friction · |F_z|, by
    accelerated projected gradients with restart (Beck and Teboulle 2009; O'Donoghue and Candès
    2015) from `start_n`, the last frame's forces.

    Args:
        operator: supplies C; `fft` is quick, the condensed ones are exact at the rim.
        displacement_mm: (c, 3) measured motion of the surface nodes.
        mask: (c,) bool, nodes in contact.
        friction: Coulomb coefficient; inf leaves the tangential forces free.
        start_n: (c, 3) or None.
        most_steps: steps after which the best so far is returned with `converged` False.
        tolerance: change of a step, relative to the forces, at which to stop.

    Raises:
        IfemError: shapes that do not fit, values that are not finite, a negative friction.
    """
    u = checked(displacement_mm, len(np.asarray(mask)))
    touched = np.asarray(mask, dtype=bool)
    if touched.ndim != 1 or not friction >= 0:
        raise IfemError(f"mask {touched.shape} must be one-dimensional, friction {friction} >= 0")
    if not touched.any() or not u.any():
        return MaskedForce(np.zeros_like(u), 1.0 if u.any() else 0.0, 0.0, 0, True)
    start = np.zeros_like(u) if start_n is None else checked(start_n, len(u))
    start = _projected(start, touched, friction)
    gram = gram_of(operator)
    if gram is not None and touched.sum() <= MOST_BY_GRAM:
        return _by_gram(operator, gram, u, touched, friction, start, most_steps, tolerance)
    return _by_operator(operator, u, touched, friction, start, most_steps, tolerance)


def _by_operator(
    operator: SurfaceOperator,
    u: Array,
    touched: NDArray[np.bool_],
    friction: float,
    force: Array,
    most_steps: int,
    tolerance: float,
) -> MaskedForce:
    """Every step asks the operator twice."""
    step = 1.0 / (MARGIN * _largest(operator, touched))
    ahead, pace, change, steps = force, 1.0, np.inf, 0
    while steps < most_steps and change > tolerance:
        steps += 1
        slope = operator.displacement(operator.displacement(ahead) - u)
        moved = _projected(ahead - step * slope, touched, friction)
        if float(np.vdot(ahead - moved, moved - force)) > 0:
            pace = 1.0
        last, pace = pace, (1 + np.sqrt(1 + 4 * pace * pace)) / 2
        size = float(np.linalg.norm(moved))
        change = float(np.linalg.norm(moved - force)) / size if size > 0 else 0.0
        ahead = moved + (last - 1) / pace * (moved - force)
        force = moved
    misfit = float(np.linalg.norm(operator.displacement(force) - u) / np.linalg.norm(u))
    return MaskedForce(force, misfit, change, steps, change <= tolerance)


def _by_gram(
    operator: SurfaceOperator,
    gram: ComplianceGram,
    u: Array,
    touched: NDArray[np.bool_],
    friction: float,
    start: Array,
    most_steps: int,
    tolerance: float,
) -> MaskedForce:
    """The operator is asked for the slope at the start of each round; the steps of a round follow
    a quadratic that lies above the true one and touches it there, so that every round descends."""
    from ifem_export.inverse.contact_fit_kernel import descend, largest

    nodes = np.flatnonzero(touched)
    product = gram.block(nodes)
    step = 1.0 / (MARGIN * largest(product))
    found = np.ascontiguousarray(start[touched]).reshape(-1)
    force, left = np.zeros_like(u), operator.displacement(start) - u
    steps, change = 0, np.inf
    while True:
        before = found.copy()
        slope = operator.displacement(left)[touched].reshape(-1)
        change, taken = descend(
            product, slope, found, friction, step, tolerance, most_steps - steps
        )
        steps += taken
        force[touched] = found.reshape(-1, 3)
        left = operator.displacement(force) - u
        size = float(np.linalg.norm(found))
        gone = float(np.linalg.norm(found - before)) / size if size > 0 else 0.0
        if steps >= most_steps or gone <= ROUND * tolerance or taken <= 1:
            break
    misfit = float(np.linalg.norm(left) / np.linalg.norm(u))
    return MaskedForce(force, misfit, change, steps, change <= tolerance)


def smoothing(points_mm: ArrayLike, width_mm: float) -> sparse.csr_array:
    """Spreads a nodal force over its neighbours as a Gaussian of standard deviation `width_mm`.

    Args:
        points_mm: (c, 2) or (c, 3) surface nodes.
        width_mm: > 0.

    Returns:
        (c, c); columns sum to 1, so that the resultant is kept.
    """
    if not (np.isfinite(width_mm) and width_mm > 0):
        raise IfemError(f"smoothing width_mm = {width_mm!r}: must be > 0")
    points = np.asarray(points_mm, dtype=float)[:, :2]
    pairs = cKDTree(points).query_pairs(3 * width_mm, output_type="ndarray")
    rows = np.concatenate([pairs[:, 0], pairs[:, 1], np.arange(len(points))])
    columns = np.concatenate([pairs[:, 1], pairs[:, 0], np.arange(len(points))])
    away = ((points[rows] - points[columns]) ** 2).sum(axis=1)
    weights = np.exp(-away / (2 * width_mm**2))
    spread = sparse.csr_array((weights, (rows, columns)), shape=(len(points), len(points)))
    return sparse.csr_array(spread @ sparse.diags_array(1.0 / spread.sum(axis=0)))


def smoothed_force(
    operator: SurfaceOperator, displacement_mm: ArrayLike, spread: sparse.csr_array
) -> Array:
    """Forces (c, 3) in N, S u low-passed by `smoothing`; their sum is that of S u."""
    return np.asarray(spread @ operator.force(displacement_mm))


def _projected(force: Array, touched: NDArray[np.bool_], friction: float) -> Array:
    """Nearest forces on the mask that push and keep the cone |F_xy| <= friction |F_z|."""
    kept = np.zeros_like(force)
    pull, side = force[touched, 2], np.hypot(force[touched, 0], force[touched, 1])
    push = -pull
    if np.isinf(friction):
        kept[touched] = force[touched]
        kept[touched, 2] = -np.maximum(push, 0.0)
        return kept
    inside = side <= friction * push
    # Beyond the polar cone the nearest point is the tip, else one on the cone's surface.
    along = np.where(
        inside, push, np.maximum((push + friction * side) / (1 + friction * friction), 0.0)
    )
    scale = np.where(inside, 1.0, friction * along / np.where(side > 0, side, 1.0))
    kept[touched, 0] = force[touched, 0] * scale
    kept[touched, 1] = force[touched, 1] * scale
    kept[touched, 2] = -np.where(inside, push, along)
    return kept


def _largest(operator: SurfaceOperator, touched: NDArray[np.bool_]) -> float:
    """Largest eigenvalue of P C C P, from below, by Lanczos steps from a uniform push.

    Four tell as much as a dozen power steps: within 3 % on masks from two nodes to the whole pad.
    """
    x = np.zeros((len(touched), 3))
    x[touched] = (0.3, 0.2, -1.0)
    x /= np.linalg.norm(x)
    before, beta = np.zeros_like(x), 0.0
    diagonal: list[float] = []
    beside: list[float] = []
    for _ in range(LANCZOS_STEPS):
        y = operator.displacement(operator.displacement(x))
        y[~touched] = 0.0
        diagonal.append(float(np.vdot(x, y)))
        y -= diagonal[-1] * x + beta * before
        beta = float(np.linalg.norm(y))
        if beta <= 1e-12 * diagonal[0]:
            break
        beside.append(beta)
        before, x = x, y / beta
    return float(eigvalsh_tridiagonal(diagonal, beside[: len(diagonal) - 1])[-1])
