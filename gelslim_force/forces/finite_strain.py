"""Surface forces of a neo-Hookean pad from the motion of its outer surface.

No external force acts on inner nodes. Their motion is found by Newton steps with the linear
stiffness,

    u_i <- u_i - K_ii⁻¹ F_i(u),

with Anderson acceleration. The iteration starts from the linear extension of the surface motion.
The residual of the last evaluation is condensed onto the surface. A pad of one layer has no inner
nodes and needs one evaluation.
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
from ifem_export.finite_strain.neo_hookean import NeoHookeanPad
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
class FiniteStrainForce:
    """Forces (c, 3) in N for motions (c, 3) in mm of `PadMesh.surface`."""

    bundle: Bundle
    tolerance: float = 0.01
    """Residual force on the inner nodes, relative to the surface forces."""
    most_steps: int = 12
    inner_rtol: float = 1e-3
    membranes: tuple[Membrane, ...] = ()
    """Coat and fabric on the gel, as a linear law has them."""

    @cached_property
    def system(self) -> PadSystem:
        """Linear stiffness of the pad. Raises MeshError for a pad whose layers differ."""
        return PadSystem(self.bundle.mesh, np.asarray(self.bundle.element_matrix))

    @cached_property
    def pad(self) -> NeoHookeanPad:
        """The pad at large strain."""
        return NeoHookeanPad(self.bundle.mesh, self.bundle.material)

    @cached_property
    def inner(self) -> Solver:
        """Solver of the inner nodes."""
        return inner_solver(self.system, "iterative")

    def force(self, displacement_mm: ArrayLike) -> Array:
        """Forces that hold the surface in a motion (c, 3).

        Raises IfemError for a wrong shape, FiniteStrainError for a motion that inverts a cell,
        ConvergenceError if the iteration does not converge.
        """
        u = checked_field(displacement_mm, self.system.columns)
        if not self.membranes:
            return self._gel_force(u)
        return self._gel_force(u) + (self._skin @ u.ravel()).reshape(-1, 3)

    @cached_property
    def _skin(self) -> sparse.csr_array:
        """Stiffness (3c, 3c) of the membranes, whose strain stays small."""
        from ifem_export.elements.membrane import membrane_stiffness

        return membrane_stiffness(self.bundle.mesh, self.membranes)

    def _gel_force(self, u: Array) -> Array:
        motion = np.zeros((self.bundle.mesh.n_nodes, 3))
        motion[-self.system.columns :] = u
        if self.system.layers == 1:
            return np.asarray(self.pad.force(motion)[-self.system.columns :])
        return self._condensed(motion, u)

    def _condensed(self, motion: Array, u: Array) -> Array:
        columns = self.system.columns
        inside = slice(columns, -columns)
        coupling = self.system.surface_to_inner @ u.reshape(-1)
        motion[inside] = self.inner.solve(-coupling, self.inner_rtol).x.reshape(-1, 3)
        anderson = Anderson()
        residuals: list[float] = []
        for _ in range(self.most_steps):
            found = self.pad.force(motion)
            residual, force = found[inside], found[-columns:]
            size = float(np.linalg.norm(force))
            residuals.append(float(np.linalg.norm(residual)))
            done = residuals[-1] <= self.tolerance * size or size == 0.0
            step = self.inner.solve(-residual.reshape(-1), 0.05 if done else self.inner_rtol).x
            if done:
                condensed = self.system.inner_to_surface @ step
                return np.asarray(force + condensed.reshape(-1, 3))
            motion[inside] = anderson.next(motion[inside].reshape(-1), step).reshape(-1, 3)
        shown = ", ".join(f"{t:.2g}" for t in residuals)
        raise ConvergenceError(
            f"the inner nodes of the neo-Hookean pad are out of balance after {self.most_steps} "
            f"steps (residuals {shown} N): the strain is too large for steps with the linear "
            "stiffness"
        )


@dataclass(frozen=True, eq=False)
class DepthLaw:
    """The linear law for shallow contacts, and the neo-Hookean one from a depth on.

    Under a ball of 10 mm radius on the gel of gelslim2 the linear law gives 4 % less normal force
    than the neo-Hookean one at a tenth of the thickness, and 15 % less at three eighths. The
    neo-Hookean law takes about ten times as long.

    Attributes:
        linear: Linear law, from motion (c, 3) to forces (c, 3).
        strained: The neo-Hookean one.
        from_mm: Depth from which it is used.
    """

    linear: Linear
    strained: FiniteStrainForce
    from_mm: float

    def force(self, displacement_mm: ArrayLike) -> Array:
        """Forces that hold the surface in a motion (c, 3); raises as both laws."""
        motion = np.asarray(displacement_mm, dtype=float)
        deep = -float(motion[:, 2].min(initial=0.0)) >= self.from_mm
        return (self.strained if deep else self.linear).force(motion)


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
