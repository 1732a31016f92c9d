"""Contact of a rigid tool with a linear gel of many nodes, whose compliance is not a table.

The infinite pad's compliance C solves the contact. What the rim of the pad adds to the motion under
the forces f, e = (C_exact - C) f, enters as a displacement without contact forces. It is found
along with the tangent planes of the tool. Near the rim the exact pad is up to some times more
compliant than the infinite one, so that e uses Anderson acceleration.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.finite_strain import Anderson
from gelslim_twin.contact.contact_forces import ContactForces
from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.contact.solver import ContactSolver
from ifem_export.compliance.convolved import ConvolvedCompliance

Array = NDArray[np.float64]
Nodes = NDArray[np.intp]
LEAST_RTOL, SHARE, MOST_RTOL = 1e-9, 1e-2, 0.1
"""Relative residual of the exact solutions: this share of the tolerance, with its limits."""


@dataclass(eq=False)
class ExactMotion:
    """Exact displacement under contact forces. Only what changed in the forces is solved for."""

    compliance: ConvolvedCompliance
    rtol: float

    def __post_init__(self) -> None:
        shape = (self.compliance.nodes, 3)
        self._force, self._motion = np.zeros(shape), np.zeros(shape)

    def under(self, nodes: Nodes, force_n: Array) -> Array:
        """Displacement (c, 3) in mm under forces (n, 3) in N on `nodes` (n,)."""
        force = np.zeros_like(self._force)
        force[nodes] = force_n
        change = force - self._force
        size, allowed = (float(np.linalg.norm(part)) for part in (change, self.rtol * force))
        if size > allowed:
            relative = min(MOST_RTOL, allowed / size)
            self._motion = self._motion + self.compliance.whole(change, relative)
            self._force = force
        return self._motion


@dataclass(eq=False)
class RimCorrection:
    """The `Correction` of the candidate nodes (n,) of a contact."""

    motion: ExactMotion
    nodes: Nodes
    given_mm: Array
    """Displacement (n, 3) without contact forces of the exact pad."""

    def __post_init__(self) -> None:
        self._accelerated = Anderson()

    def first_mm(self, force_n: Array) -> Array:
        """See `Correction`."""
        self._accelerated = Anderson()
        if not force_n.any():
            return self.given_mm
        exact = self.motion.under(self.nodes, force_n)[self.nodes]
        infinite = self.motion.compliance.displacement(self.nodes, force_n)[self.nodes]
        return np.asarray(exact - infinite + self.given_mm)

    def corrected(self, force_n: Array, motion_mm: Array, offset_mm: Array) -> tuple[Array, float]:
        """See `Correction`."""
        exact = self.motion.under(self.nodes, force_n)[self.nodes] + self.given_mm
        missing = exact - motion_mm - offset_mm
        touched = force_n.any(axis=1)
        error = float(np.abs(missing[touched]).max(initial=0.0))
        ahead = self._accelerated.next(offset_mm.ravel(), missing.ravel())
        return ahead.reshape(offset_mm.shape), error


@dataclass(eq=False)
class FineContact(ContactSolver):
    """`ContactSolver` on a `ConvolvedCompliance`: exact up to the rim of the pad."""

    def _begin(self, last: GelState, offset_mm: Array) -> None:
        assert isinstance(self.compliance, ConvolvedCompliance)
        rtol = max(LEAST_RTOL, SHARE * self.settings.tolerance)
        self._motion = ExactMotion(self.compliance, rtol)
        self._given = offset_mm

    def _correction(self, nodes: Nodes) -> RimCorrection:
        return RimCorrection(self._motion, nodes, self._given[nodes])

    def _displacement(self, nodes: Nodes, balance: ContactForces) -> Array:
        return self._motion.under(nodes, balance.force_n)
