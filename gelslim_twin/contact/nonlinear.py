"""Contact with a neo-Hookean gel by a fixed-point iteration over linear contacts.

With the forces F(u) that hold the surface at u (`FiniteStrainForce`) and the linear compliance C,

    u = [u - C F(u)] + C f

holds where F(u) = f. The bracket enters the linear contact as a displacement without contact
forces, and the iteration uses Anderson acceleration. At larger depths it does not converge; then
Newton's method on the whole gel takes over until the tool leaves it (`newton_contact`), with load
steps that are halved where necessary.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.finite_strain import Anderson, FiniteStrainForce
from gelslim_twin.contact.gel_body import GelBody
from gelslim_twin.contact.gel_state import ContactError, GelState, anchor_mm
from gelslim_twin.contact.load_steps import is_stationary, with_halved_steps
from gelslim_twin.contact.newton_contact import NewtonContact, SolidState
from gelslim_twin.contact.solver import ContactSolver
from gelslim_twin.scene.pose import Pose
from ifem_export.bundle.bundle import Bundle
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.compliance.table_size import has_room
from ifem_export.finite_strain.neo_hookean import FiniteStrainError
from ifem_export.operators.solver import ConvergenceError

Array = NDArray[np.float64]


def unfit(bundle: Bundle) -> tuple[str, str] | None:
    """Why the neo-Hookean law does not apply to a pad, and the remedy; None where it applies.

    The law is implemented for flat pads of whole cells whose table of columns fits in memory.
    """
    mesh = bundle.mesh
    if not has_room(len(mesh.surface)):
        return (
            f"the sensor's pad has {len(mesh.surface)} surface nodes, more than large deformation "
            "takes",
            "switch it off for the linear gel (effects: {nonlinearity: off}) or lower the "
            "sensor's mesh.nodes_per_marker_pitch",
        )
    if mesh.surface_shift is None and mesh.fill is None:
        return None
    crowned = mesh.surface_shift is not None
    what = "the sensor's gel is crowned" if crowned else "the sensor's pad has cut cells"
    change = "design.gel.crown_height_mm to 0" if crowned else "mesh.weighting to cell_centre"
    return (
        f"{what}, large deformation takes flat pads of whole cells only",
        "switch it off for the linear gel (effects: {nonlinearity: off}) or set the sensor's "
        + change,
    )


@dataclass(eq=False)
class NonlinearContact:
    """Solves the contact along a sequence of poses, like `ContactSolver`, on a neo-Hookean gel."""

    solver: ContactSolver
    tolerance: float = 1e-2
    """Largest |F(u) - f| over |f|."""
    most_steps: int = 25
    most_halvings: int = 6
    law: FiniteStrainForce = field(init=False)

    def __post_init__(self) -> None:
        """Raises ContactError for a pad to which the neo-Hookean law does not apply."""
        problem = unfit(self.solver.compliance.bundle)
        if problem is not None:
            raise ContactError("; ".join(problem))
        inner = min(3e-3, 0.3 * self.tolerance)
        self.law = FiniteStrainForce(
            self.solver.compliance.bundle, tolerance=inner, most_steps=40, inner_rtol=inner
        )
        self._zero = np.zeros_like(self.solver.points_mm)
        body = GelBody(self.solver.compliance.bundle)
        self._newton = NewtonContact(self.solver, body, self.tolerance)

    def states(self, poses: tuple[Pose, ...]) -> Iterator[GelState]:
        """A state per pose, starting from the undeformed gel. Raises ContactError."""
        state: GelState = GelState.at_rest(len(self._zero))
        before: Pose | None = None
        for pose in poses:
            state, before = self.advanced(state, before, pose), pose
            yield GelState(state.displacement_mm, state.force_n, state.touch, state.solver)
        self.solver.compliance.store()

    def advanced(self, last: GelState, before: Pose | None, pose: Pose) -> GelState:
        """State at `pose` from the state `last` at `before`, in as many load steps as necessary.

        Raises ContactError.
        """
        state = last
        for middle in self.solver.steps_to(last, before, pose):
            if before is None or not is_stationary(before, middle):
                state = self._step_to(state, before or middle, middle)
            before = middle
        return state

    def forget(self) -> None:
        """Drop what the last poses left to start from, on which the last bits of a state depend."""
        self._newton.forget()

    def compliance(self, state: GelState, nodes: NDArray[np.intp]) -> Array:
        """Compliance (3n, 3n) in mm/N among surface nodes (n,) of the gel deformed as in `state`.

        Raises ContactError for a gel that only the tool keeps from buckling.
        """
        body = self._newton.body
        whole = state.whole_mm if isinstance(state, SolidState) else None
        whole = self._whole(state.displacement_mm) if whole is None else whole
        unheld = np.zeros((len(body.surface), 3, 3))
        pressure = body.pad.predicted_pressure_mpa(whole, np.zeros_like(whole))
        tangent = body.tangent(whole, pressure, unheld)
        if tangent.stiffened:
            raise ContactError("the gel would buckle if the tool did not hold it")
        return tangent.block(nodes)

    def _step_to(self, last: GelState, before: Pose, pose: Pose) -> GelState:
        if not isinstance(last, SolidState) or not last.force_n.any():
            try:
                return self._step(last, before, pose)
            except (FiniteStrainError, ConvergenceError, ContactError):
                last = self._solid(last, before)
        return with_halved_steps(self._newton_step, last, before, pose, self.most_halvings)

    def _newton_step(self, last: SolidState, before: Pose, pose: Pose) -> SolidState:
        try:
            return self._newton.step(last, before, pose)
        except FiniteStrainError as error:
            raise ContactError(str(error)) from error

    def _solid(self, state: GelState, pose: Pose) -> SolidState:
        """The state with the displacement of the whole gel."""
        guess = SolidState(
            state.displacement_mm,
            state.force_n,
            state.touch,
            {},
            anchor_mm(state),
            self._whole(state.displacement_mm),
        )
        return self._newton_step(guess, pose, pose) if state.force_n.any() else guess

    def _whole(self, u: Array) -> Array:
        """Displacement (n, 3) of the whole gel in equilibrium with the surface displacement u."""
        body, system = self._newton.body, self.law.system
        whole = np.zeros((self.solver.compliance.bundle.mesh.n_nodes, 3))
        whole[body.surface] = u
        if system.layers == 1 or not u.any():
            return whole
        inside, memory = slice(system.columns, -system.columns), Anderson()
        pull = system.surface_to_inner @ u.reshape(-1)
        whole[inside] = self.law.inner_step(-pull).reshape(-1, 3)
        for _ in range(self.law.most_steps):
            force = body.pad.force(whole)
            rest = force[inside].reshape(-1)
            if np.linalg.norm(rest) <= self.law.tolerance * np.linalg.norm(force[body.surface]):
                break
            step = self.law.inner_step(-rest)
            whole[inside] = memory.next(whole[inside].reshape(-1), step).reshape(-1, 3)
        return whole

    def _step(self, last: GelState, before: Pose, pose: Pose) -> GelState:
        now = self.solver.step(last, before, pose, self._offset(last.displacement_mm))
        memory, trail = Anderson(), []
        u = now.displacement_mm
        for done in range(1, self.most_steps + 1):
            if not now.force_n.any() and not u.any():
                return now
            offset = self._offset(u)
            found = self.solver.step(last, before, pose, offset, now)
            # The step is C (f - F(u)).
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
            f"the surface still moves by {trail[-1]:.1e} mm after {self.most_steps} iterations"
        )

    def _checked(self, state: GelState, steps: int) -> GelState:
        """The state with its residual, the difference of contact forces and forces of the gel."""
        held = self.law.force(state.displacement_mm)
        size = float(np.linalg.norm(state.force_n))
        off = float(np.linalg.norm(held - state.force_n))
        residual = off / size if size > 0 else float(off > 0)
        if residual > 3 * self.tolerance and size > 0:
            raise ContactError(f"the residual is {residual:.1%} of the forces")
        report = {**state.solver, "residual": residual, "iterations": float(steps)}
        return replace(state, solver=report)

    def _offset(self, u: Array) -> Array:
        if not u.any():
            return self._zero
        compliance = self.solver.compliance
        assert isinstance(compliance, SurfaceCompliance), "large strain takes rigid bodies"
        return np.asarray(u - compliance.whole(self.law.force(u)))
