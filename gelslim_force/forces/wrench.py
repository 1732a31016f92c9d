"""Resultant of the surface forces about the sensor's origin, and its covariance.

The covariance follows by linear propagation. The wrench is linear in the motion d of the markers,
W = G S M d, with S the surface stiffness, M the interpolation from markers to nodes and G the
resultant about the origin. S is symmetric, so the six adjoint fields S Gᵀ serve every frame. A
masked fit uses the same motion with fewer unknowns; its covariance is smaller, so that the one
given here is an upper estimate.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_core.immutable import Immutable
from gelslim_core.uncertainty import two_digits, with_sigma
from gelslim_force.forces.record import RecordReader, plain
from ifem_export.markers.interpolation_matrix import MarkerInterpolation
from ifem_export.operators.adjoint_fields import AdjointFields, resultants, rigid_motions
from ifem_export.operators.surface_operator import SurfaceOperator

Array = NDArray[np.float64]
_UNKNOWN_WITHOUT_NORMAL = [2, 3, 4]
"""Indices of F_z, T_x and T_y in the wrench."""
_ROWS = (
    ("<i>F<sub>x</sub></i>", "N"),
    ("<i>F<sub>y</sub></i>", "N"),
    ("<i>F<sub>z</sub></i>", "N"),
    ("<i>T<sub>x</sub></i>", "N mm"),
    ("<i>T<sub>y</sub></i>", "N mm"),
    ("<i>T<sub>z</sub></i>", "N mm"),
)


@dataclass(frozen=True, eq=False)
class Wrench(Immutable):
    """Force and torque on the gel about the sensor's origin, in the sensor frame.

    In a notebook a wrench shows itself as a table. Its arrays are read-only.

    Attributes:
        force_n: (3,) in N; z is NaN where the normal motion is unknown.
        torque_nmm: (3,) in N mm; x and y are NaN where the normal motion is unknown.
        covariance: (6, 6) of (force, torque) in N and N mm, from the noise of the markers, of the
            normal motion and of the drift; NaN where unknown.
    """

    force_n: Array
    torque_nmm: Array
    covariance: Array

    def to_record(self) -> dict[str, Any]:
        """The attributes as lists that JSON holds; null where unknown."""
        record: dict[str, Any] = plain(self)
        return record

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> Wrench:
        """Read what `to_record` gave. Raises RecordError."""
        read = RecordReader(record, "wrench")
        parts = read.reals("force_n", 3), read.reals("torque_nmm", 3)
        return cls(*parts, read.reals("covariance", 6, 6))

    @classmethod
    def unknown(cls) -> Wrench:
        """A wrench of which nothing is known."""
        return cls(np.full(3, np.nan), np.full(3, np.nan), np.full((6, 6), np.nan))

    @property
    def vector(self) -> Array:
        """(6,) force, then torque."""
        return np.concatenate([self.force_n, self.torque_nmm])

    @property
    def standard_deviation(self) -> Array:
        """(6,) in N and N mm."""
        return np.sqrt(np.diag(self.covariance))

    def lines(self) -> list[tuple[str, str]]:
        """Name of each component, and its value and standard deviation as text."""
        return [
            (name, text if text == "unknown" else f"{text} {unit}")
            for name, unit, text in zip(
                ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz"),
                (unit for _, unit in _ROWS),
                map(with_sigma, self.vector, self.standard_deviation),
                strict=True,
            )
        ]

    def __str__(self) -> str:
        """One line: value and standard deviation of each component."""
        return ", ".join(f"{name} {text}" for name, text in self.lines())

    def _repr_html_(self) -> str:
        """Table of the six components for a notebook."""
        rows = [
            f"<tr><td>{name}</td><td>{with_sigma(value, sigma).split(' ±')[0]}</td>"
            f"<td>{two_digits(sigma)}</td>"
            f"<td>{unit}</td></tr>"
            for (name, unit), value, sigma in zip(
                _ROWS, self.vector, self.standard_deviation, strict=True
            )
        ]
        head = "<tr><th>component</th><th>value</th><th>&sigma;</th><th>unit</th></tr>"
        return f"<table><thead>{head}</thead><tbody>{''.join(rows)}</tbody></table>"


@dataclass(frozen=True, eq=False)
class WrenchNoise:
    """Linear propagation of noise to the wrench, for one pad."""

    points_mm: Array
    """(c, 3) nodes of the surface."""
    response: Array
    """(6, c, 3) product G S, in N/mm and N."""

    @classmethod
    def of(
        cls, operator: SurfaceOperator, points_mm: Array, adjoint: AdjointFields | None = None
    ) -> WrenchNoise:
        """By the pad's adjoint fields; without, by the operator's forces in six rigid motions."""
        if adjoint is not None:
            return cls(points_mm, adjoint.forces)
        rows = [operator.force(motion) for motion in rigid_motions(points_mm)]
        return cls(points_mm, np.stack(rows))

    def gains(self, interpolation: MarkerInterpolation) -> Array:
        """Wrench (6, k, 2) per lateral motion of each marker, N/mm and N; 0 for lost ones.

        W = (G S) M d needs the transpose of M: the interpolation of unit motions.
        """
        rows = [interpolation.transposed(self.response[:, :, i].T) for i in (0, 1)]
        return np.stack([r.T for r in rows], axis=2)

    def covariance(self, gains: Array, sigma: Array, common: Sequence[Array] = ()) -> Array:
        """Covariance (6, 6) of the wrench in N and N mm.

        Args:
            gains: (6, n, 2) wrench per motion of each marker, in px or mm.
            sigma: (n,) standard deviation of a coordinate of each marker, in the same unit.
            common: (6,) changes of the wrench by errors that nodes and markers have in common, as
                `by_error` gives them; these errors do not depend on each other.
        """
        noise = gains.reshape(6, -1) * np.repeat(sigma, 2)
        return np.asarray(noise @ noise.T + sum(np.outer(change, change) for change in common))

    def by_error(self, gains: Array, normal_mm: Array | None, lateral: Array) -> Array:
        """(6,) change of the wrench by an error of the normal motion.

        Args:
            gains: (6, n, 2) as in `covariance`.
            normal_mm: (c,) the error at the nodes; None where the motion is unknown.
            lateral: (n, 2) change of the markers' lateral motion with it, in the unit of the gains:
                their apparent motion is taken off for a depth that is wrong or unknown.
        """
        found = gains.reshape(6, -1) @ lateral.reshape(-1)
        if normal_mm is not None:
            found = found + self.response[:, :, 2] @ normal_mm
        return np.asarray(found)

    def wrench(self, force_n: Array, covariance: Array) -> Wrench:
        """Wrench of nodal forces (c, 3); NaN for what an unknown normal motion leaves open."""
        force, torque = resultant(self.points_mm, force_n)
        if not np.isfinite(force[2]):
            covariance = covariance.copy()
            covariance[_UNKNOWN_WITHOUT_NORMAL, :] = np.nan
            covariance[:, _UNKNOWN_WITHOUT_NORMAL] = np.nan
            tangential = force_n.copy()
            tangential[:, 2] = 0.0
            force, torque = resultant(self.points_mm, tangential)
            force[2] = torque[0] = torque[1] = np.nan
        return Wrench(force, torque, covariance)


def resultant(points_mm: ArrayLike, force_n: ArrayLike) -> tuple[Array, Array]:
    """Sum of forces (c, 3) and their torque about the origin, acting at points (c, 3)."""
    points, force = np.asarray(points_mm, dtype=float), np.asarray(force_n, dtype=float)
    found = resultants(points, force)
    return found[:3], found[3:]
