"""Surface forces from noisy displacements.

The forces F = S u amplify noise, the more so the finer the mesh. Where the contact region is known,
the forces vanish outside it, only push (no adhesion) and satisfy Coulomb's law of friction:
`masked_force` fits the displacements of the whole surface with such forces. Where it is not known,
`smoothing` spreads each nodal force over its neighbours, which keeps the resultant exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.linalg import eigvalsh_tridiagonal
from scipy.spatial import cKDTree

from ifem_export.errors import IfemError
from ifem_export.operators.convolved_operator import ComplianceProducts
from ifem_export.operators.pad_system import checked_field
from ifem_export.operators.surface_operator import SurfaceOperator

Array = NDArray[np.float64]
LANCZOS_STEPS = 8
GOLDEN = 0.6180339887498949
"""Fractional part of the golden ratio, whose multiples are spread evenly."""
MARGIN = 1.05
"""Factor on the estimated largest eigenvalue, because Lanczos estimates it from below."""
MOST_BY_PRODUCTS = 200
"""Number of nodes up to which the products among them, (3n)², are faster than the operator."""
LAST_ROUND = 10.0
"""The rounds end when the change of a round is this many times the tolerance or less."""


@runtime_checkable
class ContactColumns(Protocol):
    """A surface compliance whose columns are known for nodes in contact."""

    def contact_products(self, nodes: NDArray[np.intp]) -> tuple[NDArray[np.float32], Array]:
        """Columns (3n, 3c) of nodes (n,) and their products (3n, 3n), in mm/N and mm²/N²."""


@dataclass(frozen=True, eq=False)
class MaskedForce:
    """Result of a fit of contact forces.

    Attributes:
        force_n: (c, 3) nodal forces.
        misfit: |C F - u| / |u|, the share of the displacements that the forces do not explain.
        change: Relative change of the forces in the last step.
        steps: Steps taken.
        converged: Whether `change` is within the tolerance.
    """

    force_n: Array
    misfit: float
    change: float
    steps: int
    converged: bool


@dataclass(frozen=True, eq=False)
class _Fit:
    """Minimise |C F - u|² over the friction cones of the nodes in contact."""

    operator: SurfaceOperator
    displacement_mm: Array
    in_contact: NDArray[np.bool_]
    friction: float
    most_steps: int
    tolerance: float

    def result(self, force: Array, residual: Array, change: float, steps: int) -> MaskedForce:
        misfit = float(np.linalg.norm(residual) / np.linalg.norm(self.displacement_mm))
        return MaskedForce(force, misfit, change, steps, change <= self.tolerance)

    def by_operator(self, force: Array) -> MaskedForce:
        """Accelerated projected gradients whose every step applies the compliance twice."""
        operator, u = self.operator, self.displacement_mm
        step = 1.0 / (MARGIN * _largest_eigenvalue(operator, self.in_contact))
        ahead, momentum, change, steps = force, 1.0, np.inf, 0
        while steps < self.most_steps and change > self.tolerance:
            steps += 1
            slope = operator.displacement(operator.displacement(ahead) - u)
            moved = _projected(ahead - step * slope, self.in_contact, self.friction)
            if float(np.vdot(ahead - moved, moved - force)) > 0:
                momentum = 1.0
            last, momentum = momentum, (1 + np.sqrt(1 + 4 * momentum * momentum)) / 2
            change = _relative_change(moved, force)
            ahead = moved + (last - 1) / momentum * (moved - force)
            force = moved
        return self.result(force, operator.displacement(force) - u, change, steps)

    def by_columns(self, compliance: ContactColumns, start: Array) -> MaskedForce:
        """The steps of `by_operator` with the exact products of the columns in contact."""
        from ifem_export.inverse.contact_fit_kernel import descend, largest_eigenvalue

        nodes = np.flatnonzero(self.in_contact)
        columns, gram = compliance.contact_products(nodes)
        u = self.displacement_mm.ravel()
        contact_force = np.ascontiguousarray(start[nodes]).ravel()
        slope = (columns @ (contact_force @ columns - u)).astype(float)
        step = 1.0 / (MARGIN * largest_eigenvalue(gram))
        change, steps = descend(
            gram, slope, contact_force, self.friction, step, self.tolerance, self.most_steps
        )
        force = np.zeros_like(start)
        force[nodes] = contact_force.reshape(-1, 3)
        return self.result(force, contact_force @ columns - u, change, steps)

    def by_products(self, products: ComplianceProducts, start: Array) -> MaskedForce:
        """Rounds of steps on a quadratic upper bound of the misfit.

        The bound touches the true misfit at the start of each round, so every round decreases it.
        Only the slope at the start of a round needs the operator.
        """
        from ifem_export.inverse.contact_fit_kernel import descend, largest_eigenvalue

        nodes = np.flatnonzero(self.in_contact)
        gram = products.block(nodes)
        step = 1.0 / (MARGIN * largest_eigenvalue(gram))
        contact_force = np.ascontiguousarray(start[nodes]).ravel()
        force = np.zeros_like(start)
        residual = self.operator.displacement(start) - self.displacement_mm
        steps, change = 0, np.inf
        while True:
            before = contact_force.copy()
            slope = self.operator.displacement(residual)[nodes].ravel()
            change, taken = descend(
                gram, slope, contact_force, self.friction, step, self.tolerance,
                self.most_steps - steps,
            )  # fmt: skip
            steps += taken
            force[nodes] = contact_force.reshape(-1, 3)
            residual = self.operator.displacement(force) - self.displacement_mm
            small = _relative_change(contact_force, before) <= LAST_ROUND * self.tolerance
            if steps >= self.most_steps or small:
                return self.result(force, residual, change, steps)


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
    """Fit forces on the nodes in contact to displacements of the whole surface, in least squares.

    Minimises |C F - u|² over F = 0 outside the contact, F_z <= 0 and |F_xy| <= friction · |F_z|,
    by accelerated projected gradients with restart (Beck and Teboulle 2009; O'Donoghue and Candès
    2015).

    Args:
        operator: Supplies the compliance C. `fft` is fast and wrong at the rim; columns
            (`ifem_export.compliance.rim_columns`) are fast and exact, once they are computed;
            condensed operators are exact and slow.
        displacement_mm: (c, 3) measured displacements of the surface nodes.
        mask: (c,) bool, the nodes in contact.
        friction: Coefficient of friction; inf leaves the tangential forces free.
        start_n: (c, 3) initial forces, such as those of the last frame; None for zero.
        most_steps: Number of steps after which the best forces so far are returned with
            `converged` False.
        tolerance: Relative change of the forces in a step at which the fit ends.

    Returns:
        The forces and how well they explain the displacements.

    Raises:
        IfemError: Shapes do not fit, a value is not finite, or the friction is negative.
    """
    in_contact = np.asarray(mask, dtype=bool)
    if in_contact.ndim != 1:
        raise IfemError(f"mask {in_contact.shape}: must be one-dimensional", field="mask")
    if not friction >= 0:
        raise IfemError(f"friction {friction}: must be >= 0", field="friction", value=friction)
    u = checked_field(displacement_mm, len(in_contact))
    if not in_contact.any() or not u.any():
        return MaskedForce(np.zeros_like(u), 1.0 if u.any() else 0.0, 0.0, 0, True)
    start = np.zeros_like(u) if start_n is None else checked_field(start_n, len(u))
    start = _projected(start, in_contact, friction)
    fit = _Fit(operator, u, in_contact, friction, most_steps, tolerance)
    if isinstance(operator, ContactColumns):
        return fit.by_columns(operator, start)
    products: Any = getattr(operator, "compliance_products", None)
    if isinstance(products, ComplianceProducts) and in_contact.sum() <= MOST_BY_PRODUCTS:
        return fit.by_products(products, start)
    return fit.by_operator(start)


def smoothing(points_mm: ArrayLike, width_mm: float) -> sparse.csr_array:
    """Matrix that spreads each nodal force over its neighbours with Gaussian weights.

    Args:
        points_mm: (c, 2) or (c, 3) surface nodes.
        width_mm: Standard deviation of the Gaussian, > 0.

    Returns:
        (c, c); its columns sum to 1, which keeps the resultant.

    Raises:
        IfemError: The width is not finite and positive.
    """
    if not (np.isfinite(width_mm) and width_mm > 0):
        raise IfemError(
            f"smoothing width_mm = {width_mm!r}: must be > 0", field="width_mm", value=width_mm
        )
    points = np.asarray(points_mm, dtype=float)[:, :2]
    pairs = cKDTree(points).query_pairs(3 * width_mm, output_type="ndarray")
    rows = np.concatenate([pairs[:, 0], pairs[:, 1], np.arange(len(points))])
    columns = np.concatenate([pairs[:, 1], pairs[:, 0], np.arange(len(points))])
    away = ((points[rows] - points[columns]) ** 2).sum(axis=1)
    weights = np.exp(-away / (2 * width_mm**2))
    spread = sparse.csr_array((weights, (rows, columns)), shape=(len(points), len(points)))
    return sparse.csr_array(spread @ sparse.diags_array(1.0 / spread.sum(axis=0)))


def _projected(force: Array, in_contact: NDArray[np.bool_], friction: float) -> Array:
    """Projection of the forces in contact onto the cones F_z <= 0, |F_xy| <= friction |F_z|."""
    from ifem_export.inverse.contact_fit_kernel import project

    contact_force = np.ascontiguousarray(force[in_contact]).ravel()
    project(contact_force, friction)
    projected = np.zeros_like(force)
    projected[in_contact] = contact_force.reshape(-1, 3)
    return projected


def _relative_change(force: Array, before: Array) -> float:
    size = float(np.linalg.norm(force))
    return float(np.linalg.norm(force - before)) / size if size > 0 else 0.0


def _largest_eigenvalue(operator: SurfaceOperator, in_contact: NDArray[np.bool_]) -> float:
    """Largest eigenvalue of P C C P, estimated from below by Lanczos steps.

    The force at the start differs from node to node, because from a uniform one the steps would not
    meet the modes that alternate.
    """
    x = np.zeros((len(in_contact), 3))
    count = 3 * int(in_contact.sum())
    uneven = (np.arange(1, count + 1) * GOLDEN) % 1.0 - 0.5
    x[in_contact] = np.array([0.3, 0.2, -1.0]) + uneven.reshape(-1, 3)
    x /= np.linalg.norm(x)
    before, beta = np.zeros_like(x), 0.0
    diagonal: list[float] = []
    off_diagonal: list[float] = []
    for _ in range(LANCZOS_STEPS):
        y = operator.displacement(operator.displacement(x))
        y[~in_contact] = 0.0
        diagonal.append(float(np.vdot(x, y)))
        y -= diagonal[-1] * x + beta * before
        beta = float(np.linalg.norm(y))
        if beta <= 1e-12 * diagonal[0]:
            break
        off_diagonal.append(beta)
        before, x = x, y / beta
    return float(eigvalsh_tridiagonal(diagonal, off_diagonal[: len(diagonal) - 1])[-1])
