"""From the motion of the surface nodes to the forces on them.

The method `direct` is F = S u, as in the paper. It amplifies noise. The method `low_pass` spreads
each nodal force over its neighbours, as widely as the noise of the frame requires, and keeps the
resultant. Where the contact region is known, `masked` fits the whole motion by forces that act
there only, push, and stay within Coulomb's cone.

Where the normal motion is unknown, the tangential forces are those of S (u_x, u_y, 0) and the
normal forces are unknown. The tangential resultant and the torque about z are right all the same,
because in a wide pad the tangential forces of a normal motion have no resultant.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from gelslim_core.immutable import frozen
from gelslim_force.forces.finite_strain import DepthLaw, LawForce
from gelslim_force.forces.frame_result import ForceField
from gelslim_force.forces.low_pass import (
    ForceNoise,
    LowPass,
    MotionNoise,
    SmoothedForce,
    normal_noise_mm,
    widths_mm,
)
from gelslim_force.motion.surface_motion import SurfaceMotion
from ifem_export.inverse.contact_inverse import masked_force
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.mesh.surface_lattice import (
    neighbour_matrix,
    surface_share_mm2,
)
from ifem_export.operators.adjoint_fields import AdjointFields
from ifem_export.operators.surface_operator import SurfaceOperator

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Method = Literal["auto", "direct", "low_pass", "masked"]
METHODS: tuple[Method, ...] = get_args(Method)
_CONTACT_SIGMAS = 5.0


class SurfaceForce(Protocol):
    """A law, linear or not, from the surface motion (c, 3) in mm to the forces (c, 3) in N."""

    def force(self, displacement_mm: ArrayLike) -> Array:
        """Forces that hold the surface in this motion."""


@dataclass(frozen=True)
class ForceSettings:
    """How forces are estimated from the motion of the surface.

    Attributes:
        method: `auto` fits masked forces where the contact region is known and takes low-passed
            ones elsewhere; `direct`, `low_pass` and `masked` are described in the module.
        friction: Coulomb coefficient of the cone and of the slip margin.
        low_pass_mm: Standard deviation of the low-pass in mm; None takes in each frame the one
            with the smallest expected error, which is no low-pass at all without noise.
        most_steps: Most steps of the masked fit per frame; it starts from the last frame's forces.
        tolerance: Change of one step, relative to the forces, at which the masked fit stops.

    Raises:
        ValueError: A value is impossible.
    """

    method: Method = "auto"
    friction: float = 1.0
    low_pass_mm: float | None = None
    most_steps: int = 60
    tolerance: float = 3e-3

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise ValueError(f"method = {self.method!r}: must be one of {', '.join(METHODS)}")
        if not (np.isfinite(self.friction) and self.friction >= 0):
            raise ValueError(f"friction = {self.friction!r}: must be a number >= 0")
        width = self.low_pass_mm
        if width is not None and not (np.isfinite(width) and width > 0):
            raise ValueError(f"low_pass_mm = {width!r}: must be > 0")
        if self.most_steps < 1 or not 0 < self.tolerance < 1:
            raise ValueError("most_steps must be >= 1 and tolerance must be between 0 and 1")


@dataclass(frozen=True, eq=False)
class ForceEstimator:
    """Forces on one pad. Fields are (c, 3) over the nodes of `PadMesh.surface`."""

    mesh: PadMesh
    operator: SurfaceOperator
    """Linear operator of the masked fit, and of the other methods unless `law` is given."""
    settings: ForceSettings
    law: SurfaceForce | None = None
    """Another law of the gel, such as a neo-Hookean one. A masked fit then fits the motion that
    the forces of this law would cause in a linear gel."""
    motion: SurfaceMotion | None = None
    """The sensor's markers. Their noise sets the low-pass and the threshold of contact; without
    them the motion is taken to be free of noise."""
    adjoint: AdjointFields | None = None
    """Adjoint fields of the linear pad, with which force and torque of `direct` and `low_pass` are
    exact. They are not used with another law."""

    @cached_property
    def points_mm(self) -> Array:
        """(c, 3) at rest, read-only, so that no result copies them."""
        return frozen(np.asarray(self.mesh.surface_mm))

    @cached_property
    def area_mm2(self) -> Array:
        """(c,) share of the surface."""
        return surface_share_mm2(self.mesh)

    @cached_property
    def low_pass(self) -> LowPass:
        """The low-pass of the methods `direct` (of width 0) and `low_pass`."""
        cell_mm = np.asarray(self.mesh.cell_size_mm[:2])
        fixed_mm = 0.0 if self.settings.method == "direct" else self.settings.low_pass_mm
        if self.motion is None:
            noise = ForceNoise.none(len(self.points_mm))
        else:
            noise = ForceNoise.of(self.operator, self.motion)
        return LowPass.of(self.points_mm, widths_mm(cell_mm, fixed_mm), noise)

    @cached_property
    def neighbours(self) -> sparse.csr_array:
        """(c, c) neighbours on the surface, see `neighbour_matrix`."""
        return neighbour_matrix(self.points_mm, self.mesh.cell_size_mm[:2])

    @cached_property
    def curvature(self) -> sparse.csr_array:
        """(i, c) operator by which the noise of the normal motion is estimated."""
        return curvature_operator(self.neighbours)

    def estimate(
        self,
        displacement_mm: Array,
        touched: Mask | None = None,
        start_n: Array | None = None,
        noise_px: float = 0.0,
    ) -> ForceField:
        """Forces for a motion (c, 3) in mm whose z is NaN where the normal motion is unknown.

        Args:
            displacement_mm: (c, 3).
            touched: (c,) nodes in contact; None where the contact is not known.
            start_n: (c, 3) forces of the last frame.
            noise_px: Standard deviation of a marker's position. It sets the low-pass, and the
                threshold of contact where `touched` is None.

        Raises:
            IfemError: x or y is not finite, or the shape is wrong.
        """
        normal_known = bool(np.isfinite(displacement_mm[:, 2]).all())
        u = displacement_mm if normal_known else displacement_mm * [1.0, 1.0, 0.0]
        if not normal_known:
            u[:, 2] = 0.0
        misfit, smoothed, given = 0.0, None, self._by_law(u)
        if self._masked(touched if normal_known else None):
            assert touched is not None
            moved = u if given is None else self.operator.displacement(given.force_n)
            force, misfit = self._fitted(moved, touched, start_n)
        else:
            noise = MotionNoise(noise_px, normal_noise_mm(self.curvature, u[:, 2]))
            whole = self.operator.force(u) if given is None else given.force_n
            smoothed = self.low_pass.applied(whole, noise)
            force = smoothed.force_n
            if self.adjoint is not None and given is None:
                force = self.adjoint.completed(force, u)
        if touched is None:
            assert smoothed is not None
            touched = _above_noise(smoothed, normal_known)
        if not normal_known:
            force[:, 2] = np.nan
        width = None if smoothed is None else smoothed.width_mm
        by_linear_law = given is not None and given.by_linear_law
        return self.field_of(force, displacement_mm, touched, misfit, width, by_linear_law)

    def _by_law(self, u: Array) -> LawForce | None:
        """Forces of another law at a motion (c, 3); None without one. Raises as the law."""
        if isinstance(self.law, DepthLaw):
            return self.law.of(u)
        return None if self.law is None else LawForce(self.law.force(u))

    def field_of(
        self,
        force_n: Array,
        displacement_mm: Array,
        touched: Mask | None,
        misfit: float = 0.0,
        low_pass_mm: Array | None = None,
        by_linear_law: bool = False,
    ) -> ForceField:
        """Field of forces (c, 3) at a motion (c, 3); without `touched` all that press touch."""
        contact = np.asarray(force_n[:, 2] < 0) if touched is None else touched
        return ForceField(
            points_mm=self.points_mm,
            displacement_mm=displacement_mm,
            force_n=force_n,
            traction_mpa=force_n / self.area_mm2[:, None],
            contact=contact,
            centre_of_pressure_mm=self._centre(force_n),
            slip_margin=self._slip_margin(force_n),
            misfit=misfit,
            low_pass_mm=low_pass_mm,
            by_linear_law=by_linear_law,
        )

    def _masked(self, touched: Mask | None) -> bool:
        return touched is not None and self.settings.method in ("auto", "masked")

    def _fitted(self, u: Array, touched: Mask, start_n: Array | None) -> tuple[Array, float]:
        fit = masked_force(
            self.operator,
            u,
            with_neighbours(touched, self.neighbours),
            friction=self.settings.friction,
            start_n=start_n,
            most_steps=self.settings.most_steps,
            tolerance=self.settings.tolerance,
        )
        return fit.force_n, fit.misfit

    def _centre(self, force: Array) -> Array:
        push = np.maximum(-force[:, 2], 0.0)
        total = push.sum()
        if not total > 0:
            return np.full(2, np.nan)
        return np.asarray(push @ self.points_mm[:, :2] / total)

    def _slip_margin(self, force: Array) -> float:
        total = np.ones(len(force)) @ force
        if not total[2] < 0 or self.settings.friction == 0:
            return float("nan")
        return float(1 - np.hypot(total[0], total[1]) / (self.settings.friction * -total[2]))


def curvature_operator(neighbours: sparse.csr_array) -> sparse.csr_array:
    """(i, c) that gives the value of each inner node minus the mean of its four neighbours.

    White noise has 1.25 times its variance there.
    """
    inner = np.flatnonzero(neighbours.sum(axis=1) == 4)
    identity = sparse.eye_array(neighbours.shape[0], format="csr")
    return sparse.csr_array((identity - neighbours / 4)[inner])


def with_neighbours(touched: NDArray[np.bool_], neighbours: sparse.csr_array) -> NDArray[np.bool_]:
    """(c,) the touched nodes and their neighbours.

    A node's force is the pressure weighted by its shape function, which reaches one cell beyond
    the node: pressure at the rim of a contact also loads nodes outside the contact.
    """
    return touched | (neighbours @ touched.astype(float) > 0)


def _above_noise(smoothed: SmoothedForce, normal_known: bool) -> Mask:
    """(c,) nodes whose force is too large to be noise."""
    force, sigma = smoothed.force_n, smoothed.sigma_n
    if not normal_known:
        force, sigma = force[:, :2], sigma[:, :1]
    size, noise = (np.einsum("ij,ij->i", v, v) for v in (force, sigma))
    return np.asarray(size > _CONTACT_SIGMAS**2 * noise)
