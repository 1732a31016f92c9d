"""Contact with a neo-Hookean gel by one correction of the contact with a linear one.

With the displacement u of the linear contact, the forces F(u) that hold the surface there at large
strain and the linear compliance C, the contact is solved once more with the displacement
u - C F(u) without contact forces. This is the first step of the iteration of `nonlinear`, and takes
a tenth of its time. The path is that of the linear contact, to which nothing is handed back.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.finite_strain import FiniteStrainForce
from gelslim_twin.contact.gel_state import ContactError, GelState
from gelslim_twin.contact.nonlinear import NonlinearContact, unfit
from gelslim_twin.contact.solver import Candidates, ContactSolver, is_stationary
from gelslim_twin.scene.pose import Pose
from ifem_export.finite_strain.neo_hookean import FiniteStrainError
from ifem_export.operators.solver import ConvergenceError

__all__ = ["CorrectedContact", "corrected", "correction_law", "linear_steps", "unfit"]

Array = NDArray[np.float64]
LAW_TOLERANCE, LAW_STEPS, INNER_RTOL = 3e-2, 20, 1e-2
"""Of the inner nodes: their error is a small part of what one correction leaves."""
TOLERANCE = 1e-2
"""Of Newton's method, at poses that cannot be corrected."""


def correction_law(solver: ContactSolver) -> FiniteStrainForce:
    """The neo-Hookean law of a solver's pad, as exact as one correction needs it."""
    return FiniteStrainForce(
        solver.compliance.bundle,
        tolerance=LAW_TOLERANCE,
        most_steps=LAW_STEPS,
        inner_rtol=INNER_RTOL,
    )


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


def corrected(
    solver: ContactSolver,
    law: FiniteStrainForce,
    step: LinearStep,
    found: GelState | None = None,
) -> GelState:
    """The contact of a linear step corrected once by the law at large strain.

    Args:
        solver: Solver of the linear contact; its candidates may grow.
        law: The law, for example from `correction_law`.
        step: The linear step.
        found: The result of an earlier correction, which is corrected once more.

    Returns:
        The corrected state.

    Raises:
        ContactError: The contact does not converge, or the displacement of the linear gel is too
            large for the law.
    """
    start = step.state if found is None else found
    u = start.displacement_mm
    try:
        offset = u - solver.compliance.whole(law.force(u))
    except (FiniteStrainError, ConvergenceError) as error:
        raise ContactError(str(error)) from error
    return solver.step(step.last, step.before, step.pose, offset, start)


@dataclass(eq=False)
class CorrectedContact:
    """Solves the contact along a sequence of poses, like `ContactSolver`, with one correction.

    Poses that cannot be corrected, because the linear displacement inverts a cell, are solved by
    `NonlinearContact` from the linear state before them.
    """

    solver: ContactSolver
    law: FiniteStrainForce = field(init=False)

    def __post_init__(self) -> None:
        """Raises ContactError for a pad to which the neo-Hookean law does not apply."""
        problem = unfit(self.solver.compliance.bundle)
        if problem is not None:
            raise ContactError("; ".join(problem))
        self.law = correction_law(self.solver)

    def states(self, poses: tuple[Pose, ...]) -> Iterator[GelState]:
        """A state per pose, starting from the undeformed gel. Raises ContactError."""
        state = GelState.at_rest(len(self.solver.points_mm))
        before: Pose | None = None
        for step in linear_steps(self.solver, poses):
            if before is None or not is_stationary(before, step.pose):
                state = self._corrected(step)
            before = step.pose
            yield GelState(state.displacement_mm, state.force_n, state.touch, state.solver)
        self.solver.compliance.store()

    def _corrected(self, step: LinearStep) -> GelState:
        if not step.state.force_n.any():
            return step.state
        path = self.solver.candidates
        try:
            return corrected(self.solver, self.law, step)
        except ContactError:
            self.solver.candidates = Candidates.none()
            whole = NonlinearContact(self.solver, TOLERANCE)
            return whole.advanced(step.last, step.before, step.pose)
        finally:
            self.solver.candidates = path
