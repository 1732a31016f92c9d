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
        motions: (6, c, 3), three translations and three rotations about the middle of the surface.
            Rotations are divided by the surface's size, so that all are of order one.
        forces: (6, c, 3) in N for motions in mm.
    """

    motions: Array
    forces: Array

    def completed(self, force_n: Array, displacement_mm: Array) -> Array:
        """Forces (c, 3) of a motion, with exact force and torque.

        Args:
            force_n: (c, 3) of an approximate operator.
            displacement_mm: (c, 3) to which they belong.
        """
        due = self._forces @ displacement_mm.ravel()
        lacking = due - self.motions.reshape(6, -1) @ force_n.ravel()
        share = np.linalg.solve(self._stiffness, lacking)
        return np.asarray(force_n + (share @ self._forces).reshape(-1, 3))

    @property
    def n_bytes(self) -> int:
        """Bytes that a call reads."""
        return int(self.motions.nbytes + self.forces.nbytes)

    @property
    def _forces(self) -> Array:
        return self.forces.reshape(6, -1)

    @cached_property
    def _stiffness(self) -> Array:
        """Resultants (6, 6) of the six motions, symmetric and positive definite."""
        return np.asarray(self.motions.reshape(6, -1) @ self._forces.T)


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


def rigid_motions(points_mm: Array) -> Array:
    """Rigid motions (6, n, 3) of points (n, 3), see `RigidAnswer.motions`."""
    arms = points_mm - points_mm.mean(axis=0)
    arms = arms / np.sqrt((arms**2).sum(axis=1).mean())
    axes = np.eye(3)
    moved = [np.broadcast_to(axis, arms.shape) for axis in axes]
    turned = [np.cross(axis, arms) for axis in axes]
    return np.array(moved + turned)


def _computed(system: PadSystem) -> RigidAnswer:
    motions = rigid_motions(system.mesh.surface_mm)
    solver = inner_solver(system)
    forces = np.empty_like(motions)
    for motion, force in zip(motions, forces, strict=True):
        u = motion.ravel()
        inner = solver.solve(-(system.surface_to_inner @ u), RIGID_RTOL).x
        force[:] = (system.surface @ u + system.inner_to_surface @ inner).reshape(-1, 3)
    return RigidAnswer(motions, forces)
