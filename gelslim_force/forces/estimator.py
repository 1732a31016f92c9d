"""From the motion of the surface nodes to the forces on them.

`direct` is F = S u, as in the paper. It amplifies noise; `low_pass` spreads each nodal force over
its neighbours, as far as the frame's noise calls for, and keeps the resultant. Where the contact is
known, `masked` fits the whole motion by forces there that push and keep Coulomb's cone.

Without the normal motion the tangential forces are those of S (u_x, u_y, 0). Their resultant and
their torque about z are right all the same, because in a wide pad a normal motion calls for
tangential forces without a resultant; normal forces are left unknown.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from gelslim_force.forces.frame_result import ForceField
from gelslim_force.forces.low_pass import LowPass, SmoothedForce, widths_mm
from gelslim_force.forces.noise import ForceNoise, MotionNoise, normal_noise_mm
from gelslim_force.forces.surface_share import surface_share_mm2
from gelslim_force.motion.surface_lattice import curvature, neighbours, with_rim
from gelslim_force.motion.surface_motion import SurfaceMotion
from ifem_export.inverse.contact_inverse import masked_force
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.surface_operator import SurfaceOperator

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Method = Literal["auto", "direct", "low_pass", "masked"]
METHODS: tuple[Method, ...] = get_args(Method)
_CONTACT_SIGMAS = 5.0


class SurfaceForce(Protocol):
    """What turns a surface motion (c, 3) in mm into forces (c, 3) in N, linear or not."""

    def force(self, displacement_mm: ArrayLike) -> Array:
        """Forces that hold the surface so."""


@dataclass(frozen=True)
class ForceSettings:
    """How forces are made from motion. Raises ValueError for impossible values."""

    method: Method = "auto"
    """`auto`: masked where the contact is known, else low-passed."""
    friction: float = 1.0
    """Coulomb coefficient of the cone and of the slip margin."""
    low_pass_mm: float | None = None
    """Standard deviation of the low-pass; None takes in each frame the one of the least expected
    error, which is none at all without noise."""
    most_steps: int = 60
    """Steps of the masked fit per frame; it starts from the last frame's forces."""
    tolerance: float = 3e-3
    """Change of a step, relative to the forces, at which the masked fit stops."""

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise ValueError(f"method = {self.method!r}: must be one of {', '.join(METHODS)}")
        if not (np.isfinite(self.friction) and self.friction >= 0):
            raise ValueError(f"friction = {self.friction!r}: must be a number >= 0")
        width = self.low_pass_mm
        if width is not None and not (np.isfinite(width) and width > 0):
            raise ValueError(f"low_pass_mm = {width!r}: must be > 0")
        if self.most_steps < 1 or not 0 < self.tolerance < 1:
            raise ValueError("most_steps must be >= 1 and tolerance in 0 ... 1")


@dataclass(frozen=True, eq=False)
class ForceEstimator:
    """Forces on one pad. Fields are (c, 3) over the nodes of `PadMesh.surface`."""

    mesh: PadMesh
    operator: SurfaceOperator
    """Linear operator of the masked fit, and of the others unless `law` is given."""
    settings: ForceSettings
    law: SurfaceForce | None = None
    """Another law of the gel, such as a neo-Hookean one. A masked fit then fits the motion that
    its forces would make of a linear gel."""
    motion: SurfaceMotion | None = None
    """The sensor's markers, whose noise the low-pass and the contact are judged by; without them
    the motion is taken to be free of noise."""

    @cached_property
    def points_mm(self) -> Array:
        """(c, 3) at rest."""
        return np.asarray(self.mesh.surface_mm)

    @cached_property
    def area_mm2(self) -> Array:
        """(c,) share of the surface."""
        return surface_share_mm2(self.mesh)

    @cached_property
    def low_pass(self) -> LowPass:
        """What `direct` and `low_pass` pass the forces through; of width 0 for `direct`."""
        cell_mm = np.asarray(self.mesh.cell_size_mm[:2])
        fixed_mm = 0.0 if self.settings.method == "direct" else self.settings.low_pass_mm
        if self.motion is None:
            noise = ForceNoise.none(len(self.points_mm))
        else:
            noise = ForceNoise.of(self.operator, self.motion)
        return LowPass.of(self.points_mm, widths_mm(cell_mm, fixed_mm), noise)

    @cached_property
    def beside(self) -> sparse.csr_array:
        """(c, c) neighbours on the surface, see `surface_lattice`."""
        return neighbours(self.points_mm, self.mesh.cell_size_mm[:2])

    @cached_property
    def curvature(self) -> sparse.csr_array:
        """(i, c) by which noise of the normal motion is told, see `surface_lattice`."""
        return curvature(self.beside)

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
            touched: (c,) nodes in contact, or None where that is not known.
            start_n: (c, 3) forces of the frame before.
            noise_px: standard deviation of a marker's place; sets the low-pass, and tells the
                contact where `touched` is None.

        Raises:
            IfemError: x or y not finite, or a wrong shape.
        """
        normal_known = bool(np.isfinite(displacement_mm[:, 2]).all())
        u = displacement_mm if normal_known else displacement_mm * [1.0, 1.0, 0.0]
        if not normal_known:
            u[:, 2] = 0.0
        misfit, smoothed = 0.0, None
        if self._masked(touched if normal_known else None):
            assert touched is not None
            force, misfit = self._fitted(u, touched, start_n)
        else:
            noise = MotionNoise(noise_px, normal_noise_mm(self.curvature, u[:, 2]))
            smoothed = self.low_pass.applied((self.law or self.operator).force(u), noise)
            force = smoothed.force_n
        if touched is None:
            assert smoothed is not None
            touched = _above_noise(smoothed, normal_known)
        if not normal_known:
            force[:, 2] = np.nan
        return ForceField(
            points_mm=self.points_mm,
            displacement_mm=displacement_mm,
            force_n=force,
            traction_mpa=force / self.area_mm2[:, None],
            contact=touched,
            centre_of_pressure_mm=self._centre(force),
            slip_margin=self._slip_margin(force),
            misfit=misfit,
            low_pass_mm=None if smoothed is None else smoothed.width_mm,
        )

    def _masked(self, touched: Mask | None) -> bool:
        return touched is not None and self.settings.method in ("auto", "masked")

    def _fitted(self, u: Array, touched: Mask, start_n: Array | None) -> tuple[Array, float]:
        if self.law is not None:
            u = self.operator.displacement(self.law.force(u))
        fit = masked_force(
            self.operator,
            u,
            with_rim(touched, self.beside),
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
        total = force.sum(axis=0)
        if not total[2] < 0 or self.settings.friction == 0:
            return float("nan")
        return float(1 - np.hypot(total[0], total[1]) / (self.settings.friction * -total[2]))


def _above_noise(smoothed: SmoothedForce, normal_known: bool) -> Mask:
    """(c,) nodes whose force noise alone does not reach."""
    parts = slice(0, 3) if normal_known else slice(0, 2)
    size = np.linalg.norm(smoothed.force_n[:, parts], axis=1)
    sigma = np.linalg.norm(smoothed.sigma_n[:, : 2 if normal_known else 1], axis=1)
    return np.asarray(size > _CONTACT_SIGMAS * sigma)
