"""What a gel at large strain moves further, against the law itself with tight tolerances."""

from __future__ import annotations

import numpy as np
import pytest
from sensor_samples import sensor_bundle

from gelslim_force.forces.finite_strain import FiniteStrainForce, deep_mm
from gelslim_force.joint.strained_gel import Excess, StrainedGel


@pytest.mark.parametrize("centre_mm", [(0.0, 0.0), (7.0, 4.0)])
def test_steps_lead_to_the_motion_that_the_forces_hold(centre_mm: tuple[float, float]) -> None:
    """A Hertz pressure with shear, to a third of the thickness."""
    bundle = sensor_bundle()
    points = np.asarray(bundle.mesh.surface_mm)
    apart = ((points[:, :2] - centre_mm) ** 2).sum(axis=1)
    share = np.sqrt(np.maximum(1 - apart / 3.0**2, 0.0))
    force = share[:, None] * np.array([0.2, -0.1, -1.0]) / share.sum()
    linear = bundle.surface_operator("factor").displacement(force)
    thickness = bundle.mesh.layers * bundle.mesh.cell_size_mm[2]
    size = 0.3 * thickness / -linear[:, 2].min()
    force, linear = size * force, size * linear
    gel = StrainedGel.of(bundle, deep_mm(bundle))
    excess = Excess(np.zeros_like(linear))
    changes = []
    for _ in range(12):
        last = excess.moved_mm
        excess = gel.excess(linear + last, force, excess)
        changes.append(float(np.abs(excess.moved_mm - last).max()))
    exact = FiniteStrainForce(bundle, tolerance=1e-8, inner_rtol=1e-9, most_steps=60)
    held = exact.force(linear + excess.moved_mm)
    assert np.linalg.norm((held - force).sum(axis=0)) < 0.01 * np.linalg.norm(force.sum(axis=0))
    assert np.linalg.norm(held - force) < 0.02 * np.linalg.norm(force)
    # The gel stiffens, by more than the steps leave.
    assert excess.moved_mm[:, 2].max() > 0.03 * thickness
    assert changes[-1] < 0.1 * changes[0]
