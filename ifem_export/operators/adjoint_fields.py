"""Exact force and torque of every motion, from six adjoint fields of the pad.

Force and torque of a motion u of the surface are the products r·(S u) with the six rigid motions
r. The stiffness S is symmetric, so that they equal (S r)·u: products of the motion with the six
fields S r, the adjoint fields, which are solved for once per pad. An operator that only
approximates S misses these resultants. Of all corrections that supply what is missing, `completed`
adds the one with the least traction, ∫ |t|² dA: nodal forces a (t + ω × p) at points p with the
shares a of the surface. What an approximate operator misses is spread over the whole pad,
because its error is that of the pad's inner nodes; a correction of the contact region alone would
be up to a hundred times as wrong in the field.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ifem_export.errors import IfemError
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.mesh.surface_lattice import surface_share_mm2
from ifem_export.operators.pad_system import PadSystem, checked_field
from ifem_export.operators.single_thread import single_threaded
from ifem_export.operators.solver import ConvergenceError, Solver, inner_solver

Array = NDArray[np.float64]
ADJOINT_RTOL = 1e-10
LARGEST_RESIDUAL = 1e-6
"""Where rounding keeps the residual above `ADJOINT_RTOL`, up to this one is accepted."""
MOST_ASSEMBLED = 500_000
"""Number of inner unknowns above which the matrix is not assembled: about 1.5 GB."""


@dataclass(frozen=True, eq=False)
class AdjointFields:
    """The forces that hold the surface in the six unit rigid motions about the sensor's origin.

    Attributes:
        points_mm: (c, 3) surface of the pad.
        area_mm2: (c,) share of the surface of each point.
        forces: (6, c, 3) for translations along x, y and z in N/mm, then for rotations about
            x, y and z in N/rad.
    """

    points_mm: Array
    area_mm2: Array
    forces: Array

    def wrench(self, displacement_mm: ArrayLike) -> Array:
        """Force in N and torque in N mm (6,) about the origin that hold a motion (c, 3) in mm.

        Raises IfemError for a wrong shape or a value that is not finite.
        """
        u = checked_field(displacement_mm, len(self.points_mm))
        return np.asarray(self.forces.reshape(6, -1) @ u.ravel())

    def completed(self, force_n: Array, displacement_mm: Array) -> Array:
        """Forces (c, 3) of an approximate operator, corrected to the exact force and torque.

        Args:
            force_n: (c, 3) in N.
            displacement_mm: (c, 3) or (3c,), the motion to which they belong.
        """
        force = np.asarray(force_n, dtype=float)
        due = self.forces.reshape(6, -1) @ np.ravel(displacement_mm)
        share = self._spread @ (due - self._motions @ force.ravel())
        return force + (share @ self._weighted).reshape(force.shape)

    @property
    def n_bytes(self) -> int:
        """Bytes that a call of `completed` reads."""
        return int(self.forces.nbytes + self._motions.nbytes + self._weighted.nbytes)

    @cached_property
    def _motions(self) -> Array:
        """(6, 3c) the rigid motions; their products with forces are force and torque."""
        return rigid_motions(self.points_mm).reshape(6, -1)

    @cached_property
    def _weighted(self) -> Array:
        """(6, 3c) nodal forces of tractions that are the rigid motions."""
        return np.asarray(self._motions * np.repeat(self.area_mm2, 3))

    @cached_property
    def _spread(self) -> Array:
        """Rigid motion (6, 6) whose forces, weighted by the area, have unit resultants."""
        return np.asarray(np.linalg.inv(self._weighted @ self._motions.T))


def rigid_motions(points: Array) -> Array:
    """Motions (6, c, 3): unit translations, then unit rotations e × p, of points p (c, 3)."""
    axes = np.eye(3)
    moved = [np.broadcast_to(axis, points.shape) for axis in axes]
    return np.stack(moved + [np.cross(axis, points) for axis in axes])


def resultants(points: Array, force: Array) -> Array:
    """Force and torque (6,) about the origin of forces (c, 3) at points (c, 3)."""
    moments = points.T @ force
    torque = [moments[k - 2, k - 1] - moments[k - 1, k - 2] for k in range(3)]
    return np.array([*force.sum(axis=0), *torque])


_KNOWN: WeakKeyDictionary[PadSystem, AdjointFields] = WeakKeyDictionary()


def adjoint_fields(system: PadSystem) -> AdjointFields:
    """The adjoint fields of a pad, computed once for each system.

    Raises ConvergenceError where the inner nodes cannot be solved for to `LARGEST_RESIDUAL`.
    """
    known = _KNOWN.get(system)
    if known is None:
        known = _KNOWN[system] = stored_fields(system.mesh, _computed(system))
    return known


def stored_fields(mesh: PadMesh, forces: ArrayLike) -> AdjointFields:
    """Adjoint fields of a pad from stored forces (6, c, 3). Raises IfemError for another shape."""
    points, found = np.asarray(mesh.surface_mm), np.asarray(forces, dtype=float)
    if found.shape != (6, *points.shape):
        raise IfemError(
            f"adjoint fields of shape {found.shape}: must be (6, {len(points)}, 3)",
            field="adjoint",
            value=found.shape,
        )
    return AdjointFields(points, surface_share_mm2(mesh), found)


def use_stored(system: PadSystem, fields: AdjointFields) -> None:
    """Let `adjoint_fields` return these instead of computing them."""
    _KNOWN[system] = fields


@single_threaded
def _computed(system: PadSystem) -> Array:
    motions = rigid_motions(np.asarray(system.mesh.surface_mm))
    if system.layers == 1:
        forces = [system.surface @ motion.ravel() for motion in motions]
        return np.reshape(forces, motions.shape)
    if not system.is_cut and 3 * (system.layers - 1) * system.columns > MOST_ASSEMBLED:
        return np.stack([_without_matrix(system, motion) for motion in motions])
    solver = inner_solver(system)
    return np.stack([_held(system, solver, motion.ravel()) for motion in motions])


def _without_matrix(system: PadSystem, motion: Array) -> Array:
    """Forces (c, 3) of a motion (c, 3) of a pad whose matrix would take gigabytes."""
    from ifem_export.operators.matrix_free import MatrixFreeOperator

    try:
        return MatrixFreeOperator(system, ADJOINT_RTOL).force(motion)
    except ConvergenceError as error:
        if not error.residual <= LARGEST_RESIDUAL:
            raise
        return MatrixFreeOperator(system, 2 * error.residual).force(motion)


def _held(system: PadSystem, solver: Solver, u: Array) -> Array:
    """Forces (c, 3) of a motion (3c,) by exact condensation."""
    load = -(system.surface_to_inner @ u)
    try:
        inner = solver.solve(load, ADJOINT_RTOL).x
    except ConvergenceError as error:
        if not error.residual <= LARGEST_RESIDUAL:
            raise
        inner = solver.solve(load, 2 * error.residual).x
    return np.asarray(system.surface @ u + system.inner_to_surface @ inner).reshape(-1, 3)
