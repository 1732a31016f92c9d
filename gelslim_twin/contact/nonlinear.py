"""Contact with a neo-Hookean gel: the linear contact, moved by what the gel differs.

With F(u) the forces that hold the surface at u (`FiniteStrainForce`) and C the linear compliance,

    u = [u - C F(u)] + C f

holds where F(u) = f. The bracket is put into the linear contact as a motion that is there without
forces, and the whole is iterated with Anderson's acceleration. A pose whose gel would turn inside
out on the way, or does not settle, is approached in halves.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gelslim_force.anderson import Anderson
from gelslim_force.finite_strain_force import FiniteStrainForce
from gelslim_twin.contact.contact_error import ContactError
from gelslim_twin.contact.solver import ContactSolver
from gelslim_twin.scene.pose import Pose
from gelslim_twin.simulation.gel_state import GelState
from ifem_export.finite_strain import FiniteStrainError
from ifem_export.solver import ConvergenceError

Array = NDArray[np.float64]
COORDINATES = ("time_s", "x_mm", "y_mm", "depth_mm", "twist_deg", "tilt_x_deg", "tilt_y_deg")


@dataclass(eq=False)
class NonlinearContact:
    """Follows a tool along poses like `ContactSolver`, on a neo-Hookean gel."""

    solver: ContactSolver
    tolerance: float = 1e-2
    """|F(u) - f| over |f|."""
    most_steps: int = 60
    most_halvings: int = 6
    law: FiniteStrainForce = field(init=False)

    def __post_init__(self) -> None:
        inner = min(3e-3, 0.3 * self.tolerance)
        self.law = FiniteStrainForce(
            self.solver.compliance.bundle, tolerance=inner, most_steps=40, inner_rtol=inner
        )
        self._zero = np.zeros_like(self.solver.points_mm)

    def states(self, poses: tuple[Pose, ...]) -> Iterator[GelState]:
        """A state per pose, from the untouched gel on. Raises ContactError."""
        state, before = GelState.at_rest(len(self._zero)), None
        for pose in poses:
            state = self._reached(state, before, pose, 0)
            before = pose
            yield state
        self.solver.compliance.store()

    def _reached(self, last: GelState, before: Pose | None, pose: Pose, halved: int) -> GelState:
        try:
            return self._step(last, before, pose)
        except (FiniteStrainError, ConvergenceError, ContactError) as error:
            if halved == self.most_halvings or before is None:
                raise ContactError(
                    f"the neo-Hookean gel finds no balance at depth {pose.depth_mm:g} mm, "
                    f"t = {pose.time_s:g} s, even in {2**halved} smaller steps: {error}"
                ) from error
        middle = halfway(before, pose)
        state = self._reached(last, before, middle, halved + 1)
        return self._reached(state, middle, pose, halved + 1)

    def _step(self, last: GelState, before: Pose | None, pose: Pose) -> GelState:
        now = self.solver.step(last, before, pose, self._offset(last.displacement_mm))
        memory, trail = Anderson(), []
        u = now.displacement_mm
        for done in range(1, self.most_steps + 1):
            if not now.force_n.any() and not u.any():
                return now
            offset = self._offset(u)
            found = self.solver.step(last, before, pose, offset, now)
            # C (f - F(u)) is the step; what it is in force is judged against the forces.
            step = found.displacement_mm - u
            size = float(np.abs(found.displacement_mm).max())
            trail.append(float(np.abs(step).max()))
            if trail[-1] <= 0.1 * self.tolerance * size:
                return self._checked(found, done)
            u = memory.next(u.reshape(-1), step.reshape(-1)).reshape(-1, 3)
            now = found
            if len(trail) > 8 and trail[-1] > 4 * min(trail):
                memory = Anderson()
        raise ContactError(
            f"surface still moves by {trail[-1]:.1e} mm after {self.most_steps} steps"
        )

    def _checked(self, state: GelState, steps: int) -> GelState:
        """The state, with how far its forces are from those of the gel."""
        held = self.law.force(state.displacement_mm)
        size = float(np.linalg.norm(state.force_n))
        off = float(np.linalg.norm(held - state.force_n))
        residual = off / size if size > 0 else float(off > 0)
        if residual > 3 * self.tolerance and size > 0:
            raise ContactError(f"forces are off balance by {residual:.1%}")
        report = {**state.solver, "residual": residual, "iterations": float(steps)}
        return replace(state, solver=report)

    def _offset(self, u: Array) -> Array:
        if not u.any():
            return self._zero
        return np.asarray(u - self.solver.compliance.whole(self.law.force(u)))


def halfway(before: Pose, after: Pose) -> Pose:
    """The pose in the middle of two."""
    return Pose(**{n: (getattr(before, n) + getattr(after, n)) / 2 for n in COORDINATES})
