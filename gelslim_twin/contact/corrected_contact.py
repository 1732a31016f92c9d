"""Contact with a neo-Hookean gel by few corrections of the contact with a linear one.

With the displacement u of a contact, the forces F(u) that hold the surface there at large strain
and the linear compliance C, the contact is solved once more with the displacement u - C F(u)
without contact forces. This is one step of the iteration of `nonlinear`.

A correction shows how much it changes. A later one at the same pose changes a fraction of that, so
that the change limits what is left. Between poses the displacement without contact forces is kept
as long as the gel has moved so little that a correction is expected to change less than the
tolerance. The error is thus controlled along the path, without knowledge of the scene.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import islice
from math import inf, isinf

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.finite_strain import FiniteStrainForce
from gelslim_twin.contact.gel_state import ContactError, GelState
from gelslim_twin.contact.load_steps import is_stationary
from gelslim_twin.contact.nonlinear import NonlinearContact, unfit
from gelslim_twin.contact.solver import Candidates, ContactSolver
from gelslim_twin.scene.pose import Pose
from ifem_export.bundle.bundle import Bundle
from ifem_export.finite_strain.neo_hookean import FiniteStrainError
from ifem_export.operators.pad_system import PadSystem
from ifem_export.operators.solver import ConvergenceError, Solver, pad_solver

__all__ = [
    "CorrectedContact",
    "Correction",
    "LinearStep",
    "corrected",
    "linear_steps",
    "unfit",
]

Array = NDArray[np.float64]
LAW_TOLERANCE, LAW_STEPS = 3e-2, 40
"""Of the inner nodes: this error is a small part of what one correction leaves."""
LAW_SHARE, SOLVED_SHARE = 3.0, 1 / 3
"""The law's tolerance over that of a contact where that is less, and that of linear equations over
the law's."""
CONTACT_SHARE = 2.0
"""Root of the largest tolerance of the linear contact over that of a corrected one, since the error
of displacements grows with the root: what a correction changes must not be the error before it."""
LEFT, MOST_LEFT = 0.5, 9.0
"""What is left after a correction over what it has changed where no rate is known, and at most: a
second correction changes 0.05 to 0.3 of what the first does in the scenes of the gallery."""
RATE_SAFETY, LEAST_RATE = 2.0, 0.05
"""Factor on the rate at which corrections were last seen to become smaller, and its least value."""
GROWTH = 3.0
"""Factor on what the next correction is expected to change: the two laws differ by the square of
the displacement, so that the change per displacement grows along a path. It grows with the size of
the contact, where that becomes larger again after a release."""
MOST_CORRECTIONS = 6
CONVERGED, CONVERGED_SHARE, CONVERGED_STEPS = 1e-2, 0.2, 40
"""Largest tolerance of `NonlinearContact` where corrections do not converge, as a share of the
tolerance here, and most iterations at a pose. Where these do not converge either, that contact
takes smaller load steps, which are another path of friction. With 25 iterations it did so under a
sliding cone, and the gel was 5 % of its displacement beside that of one step per pose."""


@dataclass(frozen=True, eq=False)
class Correction:
    """The difference of the neo-Hookean law to a linear one, as exact as one correction needs it.

    Its equations are solved by conjugate gradients, so that nothing is factored.
    """

    bundle: Bundle
    tolerance: float = LAW_TOLERANCE
    """Of the equilibrium of the inner nodes, over the forces at the surface."""

    @property
    def _solved(self) -> float:
        return SOLVED_SHARE * self.tolerance

    @cached_property
    def _law(self) -> FiniteStrainForce:
        law = FiniteStrainForce(
            self.bundle, tolerance=self.tolerance, most_steps=LAW_STEPS, inner_rtol=self._solved
        )
        # A probe and the run after it share the stiffness; solvers, which learn, are their own.
        law.__dict__["system"] = _linear_system(self.bundle)
        return law

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
            moved = self._solver.solve(load, self._solved).x.reshape(-1, 3)
        except (FiniteStrainError, ConvergenceError) as error:
            raise ContactError(str(error)) from error
        return np.asarray(offset_mm - moved[-len(rest) :])


@lru_cache(maxsize=1)
def _linear_system(bundle: Bundle) -> PadSystem:
    return FiniteStrainForce(bundle).system


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


def corrected(solver: ContactSolver, correction: Correction, step: LinearStep) -> GelState:
    """The contact of a linear step corrected once by the law at large strain.

    Args:
        solver: Solver of the linear contact; its candidates may grow.
        correction: The difference of the laws.
        step: The linear step.

    Raises:
        ContactError: The contact does not converge, or the displacement of the linear gel is too
            large for the law.
    """
    offset_mm = correction.offset_mm(step.state, np.zeros_like(solver.points_mm))
    return solver.step(step.last, step.before, step.pose, offset_mm, step.state)


@dataclass(frozen=True, eq=False)
class _LastCorrected:
    """The last corrected pose, and what its first correction changed per change of the contact."""

    state: GelState
    per_mm: float = inf
    """Change of the displacement over that of the contact since the correction before."""
    per_n: float = inf
    """Change of the resultant, likewise."""

    def expected(self, now: GelState) -> tuple[float, float]:
        """What a correction of `now` would change of displacement in mm and resultant in N."""
        if not self.state.force_n.any():
            return inf, inf
        mm, n = _apart(now, self.state)
        grown_mm, grown_n = map(_growth, _size(now), _size(self.state))
        return grown_mm * self.per_mm * mm, grown_n * self.per_n * n


def _size(state: GelState) -> tuple[float, float]:
    """Largest displacement in mm, and the resultant in N."""
    resultant_n = float(np.linalg.norm(state.force_n.sum(axis=0)))
    return float(np.abs(state.displacement_mm).max()), resultant_n


def _growth(now: float, before: float) -> float:
    """How much the change per displacement grows to a contact of another size."""
    return max(GROWTH, GROWTH * now / before if before > 0 else inf)


@dataclass(frozen=True, eq=False)
class _Rates:
    """Rates at which corrections of a pose become smaller, as they were last seen."""

    of_mm: float = inf
    of_n: float = inf
    at_mm: float = inf
    """Largest displacement when they were seen. The laws differ by the square of the displacement,
    so that the rates grow with it."""

    def left(self, mm: float, n: float, most_mm: float) -> tuple[float, float]:
        """What is left after a correction that has changed the contact by `mm` and `n`."""
        if isinf(self.at_mm):
            return LEFT * mm, LEFT * n
        grown = RATE_SAFETY * max(1.0, most_mm / self.at_mm)
        return mm * _remainder(grown * self.of_mm), n * _remainder(grown * self.of_n)


def _remainder(rate: float) -> float:
    """Sum of the geometric series of later changes over the last one, at most `MOST_LEFT`."""
    rate = max(LEAST_RATE, rate)
    return min(MOST_LEFT, rate / (1 - rate)) if rate < 1 else MOST_LEFT


@dataclass(eq=False)
class CorrectedContact:
    """Solves the contact along a sequence of poses, like `ContactSolver`, on a neo-Hookean gel.

    From a pose on where corrections do not converge, for example because the displacement inverts
    a cell, the states are those of `NonlinearContact`; with `restarts` those of all poses are.
    """

    solver: ContactSolver
    tolerance: float = 0.02
    """Error of displacements and of the resultant, over the largest so far."""
    by_rate: bool = True
    """Whether what a correction leaves follows from the rate at which they become smaller. For a
    tool with walls it should not: which nodes a wall holds takes corrections to spare."""
    restarts: bool = False
    """Whether a path of which one pose cannot be corrected is converged from its first pose on, so
    that the states come once all are found. The poses before it are the hardest for corrections:
    sliding walls then hold other nodes."""

    def __post_init__(self) -> None:
        """Raises ContactError for a pad to which the neo-Hookean law does not apply."""
        problem = unfit(self.solver.compliance.bundle)
        if problem is not None:
            raise ContactError("; ".join(problem))
        law = min(LAW_TOLERANCE, LAW_SHARE * self.tolerance)
        settings = self._asked = self.solver.settings
        most = (CONTACT_SHARE * self.tolerance) ** 2
        self.solver.settings = replace(settings, tolerance=min(settings.tolerance, most))
        self._correction = Correction(self.solver.compliance.bundle, law)
        self._none = np.zeros_like(self.solver.points_mm)
        self._restart()

    def states(self, poses: tuple[Pose, ...]) -> Iterator[GelState]:
        """A state per pose, starting from the undeformed gel. Raises ContactError."""
        found = self._along(poses)
        if not self.restarts:
            yield from self._or_converged(found, poses)
            return
        try:
            states = [*found]
        except ContactError:
            self.solver.settings = self._asked
            yield from self._converged(poses)
        else:
            yield from states

    def _or_converged(
        self, found: Iterator[GelState], poses: tuple[Pose, ...]
    ) -> Iterator[GelState]:
        """The states found, and those of `NonlinearContact` from where there is none."""
        number = 0
        try:
            for state in found:
                number += 1
                yield state
        except ContactError:
            yield from islice(self._converged(poses), number, None)

    def _along(self, poses: tuple[Pose, ...]) -> Iterator[GelState]:
        """A state per pose. Raises ContactError for the first that cannot be corrected."""
        state = GelState.at_rest(len(self._none))
        before: Pose | None = None
        self._most_mm = self._most_n = 0.0
        self._restart()
        for pose in poses:
            if before is None or not is_stationary(before, pose):
                state = self._corrected(state, before, pose)
            before = pose
            yield GelState(state.displacement_mm, state.force_n, state.touch, state.solver)
        self.solver.compliance.store()

    def _converged(self, poses: tuple[Pose, ...]) -> Iterator[GelState]:
        """The states by `NonlinearContact`.

        They start at the first pose: which nodes a sliding wall holds depends on the path.
        """
        self.solver.candidates = Candidates.none()
        tolerance = min(CONVERGED, CONVERGED_SHARE * self.tolerance)
        return NonlinearContact(self.solver, tolerance, CONVERGED_STEPS).states(poses)

    def _restart(self) -> None:
        """Start from a gel at rest, of which only is known that it needs a correction."""
        self._offset, self._last = self._none, _LastCorrected(GelState.at_rest(len(self._none)))
        self._rates = _Rates()

    def _corrected(self, last: GelState, before: Pose | None, pose: Pose) -> GelState:
        start = now = last
        for middle in self.solver.steps_to(last, before, pose):
            start, now = now, self.solver.step(now, before, middle, self._offset)
            before, came = middle, before
        if not now.force_n.any():
            self._restart()
            return GelState.at_rest(len(self._none))
        if self._is_within(*self._last.expected(now)):
            return now
        uncorrected, changes = now, list[tuple[float, float]]()
        for _ in range(MOST_CORRECTIONS):
            self._offset = self._correction.offset_mm(now, self._offset)
            found = self.solver.step(start, came, pose, self._offset, now)
            mm, n = _apart(found, now)
            now = found
            self._most_mm = max(self._most_mm, float(np.abs(now.displacement_mm).max()))
            self._most_n = max(self._most_n, float(np.linalg.norm(now.force_n.sum(axis=0))))
            changes.append((mm, n))
            if self.by_rate and len(changes) > 1:
                by_mm, by_n = map(_rate, changes[-1], changes[-2])
                self._rates = _Rates(by_mm, by_n, self._most_mm)
            left = self._rates.left(mm, n, self._most_mm)
            if self._is_within(*left):
                moved = _apart(uncorrected, self._last.state)
                self._last = _LastCorrected(now, *map(_rate, changes[0], moved))
                return now
        raise ContactError(f"corrections still move the surface by {mm:.1e} mm")

    def _is_within(self, mm: float, n: float) -> bool:
        return mm <= self.tolerance * self._most_mm and n <= self.tolerance * self._most_n


def _rate(change: float, of: float) -> float:
    return change / of if of > 0 else inf


def _apart(one: GelState, other: GelState) -> tuple[float, float]:
    """Largest difference of displacements in mm, and that of the resultants in N."""
    moved = one.displacement_mm - other.displacement_mm
    lost = (one.force_n - other.force_n).sum(axis=0)
    return float(np.linalg.norm(moved, axis=1).max()), float(np.linalg.norm(lost))
