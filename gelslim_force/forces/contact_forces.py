"""Which estimator of the forces is used for a contact: in the middle of the gel or at its edge."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.estimator import ForceEstimator
from gelslim_force.forces.frame_result import ForceField
from ifem_export.compliance.contact_columns import ContactCompliance, near_edge
from ifem_export.operators.surface_operator import SurfaceOperator

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class ContactForces:
    """Chooses among the estimators of one pad by what is known of the contact.

    A fit evaluates its operator many times, so it uses the fast one. That operator takes the pad
    for a periodic layer: within about a thickness of the edge its forces are off by a tenth to
    twice their size. Contacts there are fitted with columns of the compliance that are exact up to
    the edge. Without these, `auto` computes the forces directly from the stiffness.
    """

    direct: ForceEstimator
    """With the operator that the user chose."""
    fit: ForceEstimator
    """With an operator that is fast enough for a fit."""
    edge: ForceEstimator | None = None
    """With the columns of the compliance, for contacts near the edge; None where there are none."""

    @classmethod
    def of(
        cls,
        direct: ForceEstimator,
        compliance: SurfaceOperator,
        columns: ContactCompliance | None,
    ) -> ContactForces:
        """For one pad: `direct` with other operators for the fits, without noise of the markers."""
        fit = replace(direct, operator=compliance, motion=None, adjoint=None)
        return cls(direct, fit, None if columns is None else replace(fit, operator=columns))

    def estimate(
        self, displacement_mm: Array, touched: Mask | None, start_n: Array | None, noise_px: float
    ) -> ForceField:
        """Forces for a motion (c, 3); arguments and errors as in `ForceEstimator.estimate`."""
        if touched is None or self.fit.settings.method not in ("auto", "masked"):
            return self.direct.estimate(displacement_mm, touched, start_n, noise_px)
        near_edge = (touched & self.near_edge).any()
        if near_edge and self.edge is not None:
            return self.edge.estimate(displacement_mm, touched, start_n, noise_px)
        if near_edge and self.fit.settings.method == "auto":
            found = self.direct.estimate(displacement_mm, None, None, noise_px)
            return replace(found, contact=touched)
        return self.fit.estimate(displacement_mm, touched, start_n, noise_px)

    def prepare(self) -> None:
        """Compute now all that the first contact would otherwise wait for.

        The columns near the edge are left to `prepare_edge`, because not every source of the normal
        motion says where the gel is touched.
        """
        _ = self.direct.low_pass, self.direct.curvature, self.fit.neighbours, self.near_edge

    def prepare_edge(self) -> None:
        """Compute the columns near the edge now."""
        if self.edge is not None and isinstance(self.edge.operator, ContactCompliance):
            self.edge.operator.prepare()
            _ = self.edge.neighbours

    @cached_property
    def near_edge(self) -> Mask:
        """(c,) nodes that are too near the edge for the operator of the fit."""
        if not self.fit.operator.name.startswith("fft"):
            # Condensed operators are exact but slow in a fit, so that columns are used everywhere.
            return np.full(len(self.fit.points_mm), self.edge is not None)
        return near_edge(self.fit.mesh)
