"""From the motion of the surface nodes to the forces on them.

`direct` is F = S u, as in the paper. It amplifies noise; `low_pass` spreads each nodal force over
its neighbours and keeps the resultant. Where the contact is known, `masked` fits the whole motion
by forces there that push and keep Coulomb's cone.

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

from gelslim_force.frame_result import ForceField
from gelslim_force.surface_share import surface_share_mm2
from ifem_export.contact_inverse import masked_force, smoothing
from ifem_export.pad_mesh import PadMesh
from ifem_export.surface_operator import SurfaceOperator

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Method = Literal["auto", "direct", "low_pass", "masked"]
METHODS: tuple[Method, ...] = get_args(Method)


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
    low_pass_mm: float = 0.4
    """Standard deviation of the low-pass."""
    most_steps: int = 60
    """Steps of the masked fit per frame; it starts from the last frame's forces."""
    tolerance: float = 3e-3
    """Change of a step, relative to the forces, at which the masked fit stops."""

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise ValueError(f"method = {self.method!r}: must be one of {', '.join(METHODS)}")
        if not (np.isfinite(self.friction) and self.friction >= 0):
            raise ValueError(f"friction = {self.friction!r}: must be a number >= 0")
        if not (np.isfinite(self.low_pass_mm) and self.low_pass_mm > 0):
            raise ValueError(f"low_pass_mm = {self.low_pass_mm!r}: must be > 0")
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
    """Another law for `direct` and `low_pass`, such as a neo-Hookean pad."""

    @cached_property
    def points_mm(self) -> Array:
        """(c, 3) at rest."""
        return np.asarray(self.mesh.surface_mm)

    @cached_property
    def area_mm2(self) -> Array:
        """(c,) share of the surface."""
        return surface_share_mm2(self.mesh)

    @cached_property
    def spread(self) -> sparse.csr_array:
        """The low-pass (c, c)."""
        return smoothing(self.points_mm, self.settings.low_pass_mm)

    @property
    def low_passed(self) -> SurfaceForce:
        """The linear operator with the low-pass."""
        return _LowPassed(self.operator, self.spread)

    def estimate(
        self,
        displacement_mm: Array,
        touched: Mask | None = None,
        start_n: Array | None = None,
        least_force_n: Array | float = 0.0,
    ) -> ForceField:
        """Forces for a motion (c, 3) in mm whose z is NaN where the normal motion is unknown.

        Args:
            displacement_mm: (c, 3).
            touched: (c,) nodes in contact, or None where that is not known.
            start_n: (c, 3) forces of the frame before.
            least_force_n: one or (c,), that noise alone does not reach; tells the contact where
                `touched` is None.

        Raises:
            IfemError: x or y not finite, or a wrong shape.
        """
        normal_known = bool(np.isfinite(displacement_mm[:, 2]).all())
        u = displacement_mm if normal_known else displacement_mm * [1.0, 1.0, 0.0]
        if not normal_known:
            u[:, 2] = 0.0
        force, misfit = self._force(u, touched if normal_known else None, start_n)
        contact = touched
        if contact is None:
            sizes = np.linalg.norm(force[:, : 3 if normal_known else 2], axis=1)
            contact = sizes > least_force_n
        if not normal_known:
            force[:, 2] = np.nan
        return ForceField(
            points_mm=self.points_mm,
            displacement_mm=displacement_mm,
            force_n=force,
            traction_mpa=force / self.area_mm2[:, None],
            contact=contact,
            centre_of_pressure_mm=self._centre(force),
            slip_margin=self._slip_margin(force),
            misfit=misfit,
        )

    def _force(self, u: Array, touched: Mask | None, start_n: Array | None) -> tuple[Array, float]:
        method = self.settings.method
        if method == "auto":
            method = "low_pass" if touched is None else "masked"
        if method == "masked" and touched is not None:
            fit = masked_force(
                self.operator,
                u,
                touched,
                friction=self.settings.friction,
                start_n=start_n,
                most_steps=self.settings.most_steps,
                tolerance=self.settings.tolerance,
            )
            return fit.force_n, fit.misfit
        force = np.array((self.law or self.operator).force(u))
        return (force if method == "direct" else np.asarray(self.spread @ force)), 0.0

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


@dataclass(frozen=True, eq=False)
class _LowPassed:
    operator: SurfaceOperator
    spread: sparse.csr_array

    def force(self, displacement_mm: ArrayLike) -> Array:
        """S u, low-passed."""
        return np.asarray(self.spread @ self.operator.force(displacement_mm))
