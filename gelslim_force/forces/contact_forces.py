"""Which estimate of the forces a frame takes, by what is known of its contact.

A fit on the contact asks an operator many times, and the quick one takes the pad for a periodic
layer: within a thickness or so of the edge its forces are off by a tenth and more. There `auto`
takes the forces straight from the stiffness, which knows the edge.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gelslim_force.forces.estimator import ForceEstimator
from gelslim_force.forces.frame_result import ForceField
from gelslim_force.motion.surface_lattice import edge_distance_mm

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
REACH = 1.5
"""Thicknesses from the edge within which a periodic layer errs more than noise does."""


@dataclass(frozen=True, eq=False)
class ContactForces:
    """The two estimators of one pad."""

    straight: ForceEstimator
    """Of the operator chosen."""
    fitter: ForceEstimator
    """Of the operator that a fit can afford."""

    def estimate(
        self, displacement_mm: Array, touched: Mask | None, start_n: Array | None, noise_px: float
    ) -> ForceField:
        """Forces for a motion (c, 3); arguments and errors as `ForceEstimator.estimate`."""
        if touched is None or self.fitter.settings.method not in ("auto", "masked"):
            return self.straight.estimate(displacement_mm, touched, start_n, noise_px)
        if self.fitter.settings.method == "auto" and (touched & self.beyond_fit).any():
            found = self.straight.estimate(displacement_mm, None, None, noise_px)
            return replace(found, contact=touched)
        return self.fitter.estimate(displacement_mm, touched, start_n, noise_px)

    def prepare(self) -> None:
        """Make now what a first contact would have to wait for, at the edge or elsewhere."""
        _ = self.straight.low_pass, self.straight.curvature, self.fitter.beside, self.beyond_fit

    @cached_property
    def beyond_fit(self) -> Mask:
        """(c,) nodes too near the edge for the fitter's operator."""
        mesh = self.fitter.mesh
        if not self.fitter.operator.name.startswith("fft"):
            return np.zeros(len(self.fitter.points_mm), dtype=bool)
        thickness_mm = mesh.layers * mesh.cell_size_mm[2]
        near = edge_distance_mm(self.fitter.points_mm, mesh.cell_size_mm[:2])
        return np.asarray(near < REACH * thickness_mm)
