"""Surface forces of a neo-Hookean pad from the motion of its outer surface.

No external force acts on inner nodes. Their motion is found by Newton steps with the linear
stiffness,

    u_i <- u_i - K_ii⁻¹ F_i(u),

with Anderson acceleration. The iteration starts from the linear extension of the surface motion,
or from a motion of the pad that is near, extended by what the surface has moved since. The residual
of the last evaluation is condensed onto the surface. A pad of one layer has no inner nodes and
needs one evaluation.

The linear equations of a step may be those of the infinite pad, which transforms solve at once. The
forces are the same within the tolerance. Near the edge of the gel more steps are needed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from ifem_export.bundle.bundle import Bundle
from ifem_export.elements.skin import Membrane
from ifem_export.finite_strain.neo_hookean import FiniteStrainError, NeoHookeanPad
from ifem_export.operators.layer_coupling import LayerCoupling
from ifem_export.operators.pad_system import PadSystem, checked_field
from ifem_export.operators.solver import ConvergenceError, Solver, inner_solver

Array = NDArray[np.float64]
DEEP_SHARE = 0.1
"""Depth over the thickness from which `DepthLaw` takes the gel as neo-Hookean."""


class Linear(Protocol):
    """A law from the surface motion to the forces."""

    def force(self, displacement_mm: ArrayLike) -> Array:
        """Forces (c, 3) in N that hold the surface in a motion (c, 3) in mm."""


@dataclass(frozen=True, eq=False)
class HeldPad:
    """A pad whose surface is held in a motion.

    Attributes:
        force_n: (c, 3) forces that hold it, in N.
        motion_mm: (n, 3) motion of all nodes, with which inner nodes are in balance.
    """

    force_n: Array
    motion_mm: Array


@dataclass(frozen=True, eq=False)
class FiniteStrainForce:
    """Forces (c, 3) in N for motions (c, 3) in mm of `PadMesh.surface`."""

    bundle: Bundle
    tolerance: float = 0.01
    """Residual force on the inner nodes, relative to the surface forces."""
    most_steps: int = 12
    inner_rtol: float | None = 1e-3
    """Of the linear equations of a step; None takes those of the infinite pad."""
    membranes: tuple[Membrane, ...] = ()
    """Coat and fabric on the gel, as a linear law has them."""

    @classmethod
    def per_frame(cls, bundle: Bundle) -> FiniteStrainForce:
        """The law of a pad in its skin, within 0.5 % of the resultant in the least time."""
        return cls(bundle, tolerance=0.03, inner_rtol=None, membranes=bundle.membranes)

    @cached_property
    def system(self) -> PadSystem:
        """Linear stiffness of the pad. Raises MeshError for a pad whose layers differ."""
        return PadSystem(self.bundle.mesh, np.asarray(self.bundle.element_matrix))

    @cached_property
    def pad(self) -> NeoHookeanPad:
        """The pad at large strain."""
        return NeoHookeanPad(self.bundle.mesh, self.bundle.material)

    @cached_property
    def coupling(self) -> LayerCoupling:
        """Of the surface and the nodes below it, in a linear pad of several layers."""
        return LayerCoupling(self.system)

    @cached_property
    def inner(self) -> Solver:
        """Solver of the inner nodes."""
        return inner_solver(self.system, "iterative")

    def force(self, displacement_mm: ArrayLike) -> Array:
        """Forces that hold the surface in a motion (c, 3); errors as of `held`."""
        return self.held(displacement_mm).force_n

    def held(self, displacement_mm: ArrayLike, near: HeldPad | None = None) -> HeldPad:
        """The pad with its surface held in a motion.

        Args:
            displacement_mm: (c, 3) motion of the surface.
            near: The pad in another motion, from which the iteration starts.

        Raises:
            IfemError: The motion has a wrong shape.
            FiniteStrainError: It inverts a cell.
            ConvergenceError: The iteration does not converge.
        """
        u = checked_field(displacement_mm, self.system.columns)
        pad = self._held(u, near)
        if not self.membranes:
            return pad
        return HeldPad(pad.force_n + (self._skin @ u.ravel()).reshape(-1, 3), pad.motion_mm)

    @cached_property
    def _skin(self) -> sparse.csr_array:
        """Stiffness (3c, 3c) of the membranes, whose strain stays small."""
        from ifem_export.elements.membrane import membrane_stiffness

        return membrane_stiffness(self.bundle.mesh, self.membranes)

    def _held(self, u: Array, near: HeldPad | None) -> HeldPad:
        motion = np.zeros((self.bundle.mesh.n_nodes, 3))
        motion[-self.system.columns :] = u
        if self.system.layers == 1:
            return HeldPad(np.asarray(self.pad.force(motion)[-self.system.columns :]), motion)
        columns = self.system.columns
        inside = slice(columns, -columns)
        if near is None:
            motion[inside] = self._extension(u)
        else:
            since = u - near.motion_mm[-columns:]
            motion[inside] = near.motion_mm[inside] + self._extension(since)
        anderson = Anderson()
        residuals: list[float] = []
        for _ in range(self.most_steps):
            found = self.pad.force(motion)
            residual, force = found[inside], found[-columns:]
            size = float(np.linalg.norm(force))
            residuals.append(float(np.linalg.norm(residual)))
            done = residuals[-1] <= self.tolerance * size or size == 0.0
            step = self.inner_step(-residual.reshape(-1), done)
            if done:
                return HeldPad(np.asarray(force + self.coupling.from_inner(step)), motion)
            motion[inside] = anderson.next(motion[inside].reshape(-1), step).reshape(-1, 3)
        shown = ", ".join(f"{t:.2g}" for t in residuals)
        raise ConvergenceError(
            f"the inner nodes of the neo-Hookean pad are out of balance after {self.most_steps} "
            f"steps (residuals {shown} N): the strain is too large for steps with the linear "
            "stiffness"
        )

    def _extension(self, u: Array) -> Array:
        """Motion (m, 3) of the inner nodes of a linear pad whose surface moves by u (c, 3)."""
        return self.inner_step(self.coupling.on_inner(-u)).reshape(-1, 3)

    def inner_step(self, force_n: Array, last: bool = False) -> Array:
        """Motion (3m,) of the inner nodes of a linear pad under forces (3m,) on them."""
        if self.inner_rtol is not None:
            return self.inner.solve(force_n, 0.05 if last else self.inner_rtol).x
        field = force_n.reshape(self.system.layers - 1, -1, 3)
        return self.system.inner_preconditioner(field).ravel()


@dataclass(frozen=True, eq=False)
class LawForce:
    """What a law gives.

    Attributes:
        force_n: (c, 3) forces that hold the surface, in N.
        by_linear_law: Whether they are those of a linear gel although the contact is deep.
    """

    force_n: Array
    by_linear_law: bool = False


@dataclass(frozen=True, eq=False)
class DepthLaw:
    """The linear law for shallow contacts, and the neo-Hookean one from a depth on.

    Under a ball of 10 mm radius on the gel of gelslim2 the linear law gives 4 % less normal force
    than the neo-Hookean one at a tenth of the thickness, and 15 % less at three eighths.

    Attributes:
        linear: Linear law, from motion (c, 3) to forces (c, 3).
        strained: The neo-Hookean one.
        from_mm: Depth from which it is used.
    """

    linear: Linear
    strained: FiniteStrainForce
    from_mm: float

    def force(self, displacement_mm: ArrayLike) -> Array:
        """Forces that hold the surface in a motion (c, 3); raises as the linear law."""
        return self.of(displacement_mm).force_n

    def of(self, displacement_mm: ArrayLike) -> LawForce:
        """The same, with whether the forces of a deep contact are those of a linear gel.

        They are where the neo-Hookean law has none, because the motion inverts a cell of the mesh
        or the inner nodes do not come to balance.
        """
        motion = np.asarray(displacement_mm, dtype=float)
        if -float(motion[:, 2].min(initial=0.0)) < self.from_mm:
            return LawForce(self.linear.force(motion))
        try:
            return LawForce(self.strained.force(motion))
        except (FiniteStrainError, ConvergenceError):
            return LawForce(self.linear.force(motion), by_linear_law=True)


def deep_mm(bundle: Bundle) -> float:
    """Depth from which the gel of a bundle is taken as neo-Hookean."""
    return float(DEEP_SHARE * bundle.mesh.layers * bundle.mesh.cell_size_mm[2])


def law_of(bundle: Bundle, gel: str) -> str:
    """The law of the gel that a setting gives: `auto` is `linear` for crowned pads and cut cells.

    These have no neo-Hookean law; the standard deviations then hold what the linear one leaves out.
    """
    plain = bundle.mesh.fill is None and bundle.mesh.surface_shift is None
    return gel if gel != "auto" or plain else "linear"


class Anderson:
    """Anderson acceleration of x <- x + step(x) (Walker and Ni 2011, type II)."""

    def __init__(self, depth: int = 4) -> None:
        self.depth = depth
        self.iterates: list[Array] = []
        self.steps: list[Array] = []

    def next(self, x: Array, step: Array) -> Array:
        """The next x, from this one and its step without acceleration."""
        self.iterates = [*self.iterates[-self.depth :], x.copy()]
        self.steps = [*self.steps[-self.depth :], step]
        if len(self.steps) == 1:
            return np.asarray(x + step)
        step_changes = np.diff(np.array(self.steps), axis=0).T
        x_changes = np.diff(np.array(self.iterates), axis=0).T
        weights = np.linalg.lstsq(step_changes, step, rcond=None)[0]
        return np.asarray(x + step - (x_changes + step_changes) @ weights)
