"""Contact with a neo-Hookean gel by one or two corrections of the contact with a linear one.

With the displacement u of a contact, the forces F(u) that hold the surface there at large strain
and the linear compliance C, the contact is solved once more with the displacement u - C F(u)
without contact forces. This is one step of the iteration of `nonlinear`, which needs several and
checks what is left.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.finite_strain import FiniteStrainForce
from gelslim_twin.contact.gel_state import ContactError, GelState
from gelslim_twin.contact.nonlinear import NonlinearContact, unfit
from gelslim_twin.contact.solver import Candidates, ContactSolver, is_stationary
from gelslim_twin.scene.pose import Pose
from ifem_export.bundle.bundle import Bundle
from ifem_export.finite_strain.neo_hookean import FiniteStrainError
from ifem_export.operators.solver import ConvergenceError, Solver, pad_solver

__all__ = [
    "CorrectedContact",
    "Correction",
    "LinearStep",
    "corrected_twice",
    "linear_steps",
    "unfit",
]

Array = NDArray[np.float64]
LAW_TOLERANCE, LAW_STEPS, INNER_RTOL, REST_RTOL = 3e-2, 20, 1e-2, 1e-2
"""Of the inner nodes, and of the motion by what is left of the forces: these errors are a small
part of what one correction leaves."""
TOLERANCE = 1e-2
"""Of Newton's method, at poses that cannot be corrected."""


@dataclass(frozen=True, eq=False)
class Correction:
    """The difference of the neo-Hookean law to a linear one, as exact as one correction needs it.

    Its equations are solved by conjugate gradients, so that nothing is factored.
    """

    bundle: Bundle

    @cached_property
    def _law(self) -> FiniteStrainForce:
        return FiniteStrainForce(
            self.bundle, tolerance=LAW_TOLERANCE, most_steps=LAW_STEPS, inner_rtol=INNER_RTOL
        )

    @cached_property
    def _solver(self) -> Solver:
        return pad_solver(self._law.system, "iterative")

    def offset_mm(self, state: GelState, offset_mm: Array) -> Array:
        """Displacement (c, 3) without contact forces that makes a linear gel that of `state`.

        With u = C f + offset it is u - C F(u) = offset - C (F(u) - f), in which only the difference
        of the forces is solved for.

        Args:
            state: A contact with its forces f and displacement u.
            offset_mm: (c, 3) the displacement without contact forces that it was solved with.

        Raises:
            ContactError: The displacement is too large for the law.
        """
        try:
            rest = self._law.force(state.displacement_mm) - state.force_n
            load = np.zeros((len(self.bundle.mesh.free), 3))
            load[-len(rest) :] = rest
            moved = self._solver.solve(load, REST_RTOL).x.reshape(-1, 3)
        except (FiniteStrainError, ConvergenceError) as error:
            raise ContactError(str(error)) from error
        return np.asarray(offset_mm - moved[-len(rest) :])


@dataclass(frozen=True, eq=False)
class LinearStep:
    """The linear contact at a pose, and the load step that led to it.

    Attributes:
        state: Contact at `pose`.
        last: Contact at `before`.
        before: Pose at the start of the last load step; None for the first.
        pose: The pose.
    """

    state: GelState
    last: GelState
    before: Pose | None
    pose: Pose


def linear_steps(solver: ContactSolver, poses: tuple[Pose, ...]) -> Iterator[LinearStep]:
    """The linear contact along a path. Raises ContactError."""
    state = last = GelState.at_rest(len(solver.points_mm))
    before: Pose | None = None
    for pose in poses:
        for middle in solver.steps_to(state, before, pose):
            last, start = state, before
            state, before = solver.advanced(last, start, middle), middle
        yield LinearStep(state, last, start, pose)


def corrected_twice(
    solver: ContactSolver, correction: Correction, step: LinearStep
) -> tuple[GelState, GelState]:
    """The contact of a linear step corrected by the law at large strain once, and once more.

    Args:
        solver: Solver of the linear contact; its candidates may grow.
        correction: The difference of the laws.
        step: The linear step.

    Returns:
        Both states.

    Raises:
        ContactError: The contact does not converge, or the displacement of the linear gel is too
            large for the law.
    """
    found, offset_mm = [step.state], np.zeros_like(solver.points_mm)
    for _ in range(2):
        offset_mm = correction.offset_mm(found[-1], offset_mm)
        found.append(solver.step(step.last, step.before, step.pose, offset_mm, found[-1]))
    return found[1], found[2]


@dataclass(eq=False)
class CorrectedContact:
    """Solves the contact along a sequence of poses, like `ContactSolver`, with few corrections.

    Every pose starts from the difference of the two laws at the pose before, so that along a path
    of small steps little is left to correct. Poses that cannot be corrected, because the
    displacement inverts a cell, are solved by `NonlinearContact`.
    """

    solver: ContactSolver
    corrections: int = 1
    """Corrections per pose."""

    def __post_init__(self) -> None:
        """Raises ContactError for a pad to which the neo-Hookean law does not apply."""
        problem = unfit(self.solver.compliance.bundle)
        if problem is not None:
            raise ContactError("; ".join(problem))
        self._correction = Correction(self.solver.compliance.bundle)
        self._offset = np.zeros_like(self.solver.points_mm)

    def states(self, poses: tuple[Pose, ...]) -> Iterator[GelState]:
        """A state per pose, starting from the undeformed gel. Raises ContactError."""
        state = GelState.at_rest(len(self.solver.points_mm))
        before: Pose | None = None
        for pose in poses:
            if before is None or not is_stationary(before, pose):
                state = self._advanced(state, before, pose)
            before = pose
            yield GelState(state.displacement_mm, state.force_n, state.touch, state.solver)
        self.solver.compliance.store()

    def _advanced(self, last: GelState, before: Pose | None, pose: Pose) -> GelState:
        try:
            return self._corrected(last, before, pose)
        except ContactError:
            self.solver.candidates = Candidates.none()
            whole = NonlinearContact(self.solver, TOLERANCE)
            return whole.advanced(last, before, pose)

    def _corrected(self, last: GelState, before: Pose | None, pose: Pose) -> GelState:
        start = now = last
        for middle in self.solver.steps_to(last, before, pose):
            start, now = now, self.solver.step(now, before, middle, self._offset)
            before, came = middle, before
        if not now.force_n.any():
            self._offset = np.zeros_like(self._offset)
            return GelState.at_rest(len(self._offset))
        for _ in range(self.corrections):
            self._offset = self._correction.offset_mm(now, self._offset)
            now = self.solver.step(start, came, pose, self._offset, now)
        return now
