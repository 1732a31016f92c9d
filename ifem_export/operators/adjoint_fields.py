"""Exact force and torque for operators that only approximate the pad's stiffness S.

Force and torque of a motion u are the products of S u with the rigid motions r of the surface, and
S is symmetric: r·(S u) = (S r)·u. The forces S r that hold the surface in six rigid motions,
computed once, therefore give the resultants of every motion. What an approximate operator lacks of
them is added as the forces of that rigid motion which has them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ifem_export.operators.pad_system import PadSystem
from ifem_export.operators.solver import inner_solver

Array = NDArray[np.float64]
RIGID_RTOL = 1e-10


@dataclass(frozen=True, eq=False)
class RigidAnswer:
    """What the pad answers to rigid motions of its surface.

    Attributes:
        arms: (c, 3) places of the surface's points about their middle, divided by the root
            of their mean square, so that all six motions are of order one.
        forces: (6, c, 3) in N per mm: for three translations, then for three rotations.
    """

    arms: Array
    forces: Array

    @property
    def motions(self) -> Array:
        """The motions (6, c, 3): a unit of translation or of rotation, ω × arm, about each axis."""
        return rigid_motions(self.arms)

    def completed(self, force_n: Array, displacement_mm: Array) -> Array:
        """Forces (c, 3) of a motion, with exact force and torque.

        Args:
            force_n: (c, 3) of an approximate operator.
            displacement_mm: (c, 3) to which they belong.
        """
        due = self._forces @ displacement_mm.ravel()
        share = self._compliance @ (due - self._resultants(force_n))
        return np.asarray(force_n + (share @ self._forces).reshape(-1, 3))

    @property
    def n_bytes(self) -> int:
        """Bytes that a call reads."""
        return int(self.arms.nbytes + self.forces.nbytes)

    def _resultants(self, force: Array) -> Array:
        """Force and torque (6,), the products with the six motions."""
        moments = self.arms.T @ force
        torque = [moments[k - 2, k - 1] - moments[k - 1, k - 2] for k in range(3)]
        return np.array([*force.sum(axis=0), *torque])

    @property
    def _forces(self) -> Array:
        return self.forces.reshape(6, -1)

    @cached_property
    def _compliance(self) -> Array:
        """Motions (6, 6) for unit resultants, symmetric and positive definite."""
        return np.linalg.inv(np.array([self._resultants(force) for force in self.forces]).T)


def rigid_motions(points: Array) -> Array:
    """Motions (6, c, 3): unit translations, then unit rotations e × p, of points p (c, 3)."""
    axes = np.eye(3)
    moved = [np.broadcast_to(axis, points.shape) for axis in axes]
    return np.stack(moved + [np.cross(axis, points) for axis in axes])


_KNOWN: WeakKeyDictionary[PadSystem, RigidAnswer] = WeakKeyDictionary()


def rigid_answer(system: PadSystem) -> RigidAnswer:
    """The answer of a pad, computed once for each system.

    Raises ConvergenceError where the inner nodes cannot be solved for to `RIGID_RTOL`, and
    IfemError for a pad of one layer.
    """
    known = _KNOWN.get(system)
    if known is None:
        known = _KNOWN[system] = _computed(system)
    return known


def _computed(system: PadSystem) -> RigidAnswer:
    points = system.mesh.surface_mm
    arms = points - points.mean(axis=0)
    arms = arms / np.sqrt((arms**2).sum(axis=1).mean())
    forces = np.empty((6, *arms.shape))
    answer = RigidAnswer(arms, forces)
    solver = inner_solver(system)
    for motion, force in zip(answer.motions, forces, strict=True):
        u = motion.ravel()
        inner = solver.solve(-(system.surface_to_inner @ u), RIGID_RTOL).x
        force[:] = (system.surface @ u + system.inner_to_surface @ inner).reshape(-1, 3)
    return answer
