"""The promise of a budget for a nearly incompressible gel."""

from __future__ import annotations

import numpy as np
import pytest

from gelslim_core.budget.budget import Budget, BudgetError
from ifem_export.elements.material import Material
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh
from ifem_export.operators.ladder import lumped, measure_ladder, refined
from ifem_export.operators.ladder_contacts import Disc, contact_motions, nodal_forces
from ifem_export.operators.surface_operator import surface_operator

GEL = Material(0.147, 0.49, 1020.0)
RADIUS_MM = 1.5


@pytest.mark.slow
def test_an_error_is_kept_by_a_small_ball_near_the_edge() -> None:
    """`--error 10%` took a residual of 1e-2, whose normal force was off by half to all of it."""
    mesh, _ = build_pad_mesh(RoundedRectangle(28.0, 28.0, 1.0), 2.0, cells=(42, 42, 4))
    ladder = measure_ladder(mesh, GEL, "bbar", timed=False)
    with pytest.raises(BudgetError):
        ladder.choose(Budget(0.1))
    loose, tight = (ladder.named(f"pcg (rtol {rtol:g})") for rtol in (1e-2, 1e-4))
    assert loose is not None
    assert tight is not None
    assert loose.error > 0.25 > 0.2 > tight.error
    assert ladder.choose(Budget(0.2)).rung.name == tight.label
    fine = refined(mesh)
    discs = [Disc(np.array([x, 1.2]), RADIUS_MM, np.array([0.3, 0.1, -1.0])) for x in (3.1, 12, 13)]
    forces = [nodal_forces(fine, (disc,)) for disc in discs]
    exact = surface_operator(fine, GEL, "bbar", "pcg", rtol=1e-8)
    moved = contact_motions(exact, fine, mesh, forces)
    chosen = surface_operator(mesh, GEL, "bbar", tight.rung, **tight.parameters)
    for u, force in zip(moved, forces, strict=True):
        found, expected = chosen.force(u), lumped(force, fine, mesh)
        assert np.linalg.norm(found - expected) < 0.2 * np.linalg.norm(expected)
        assert abs(found[:, 2].sum() / expected[:, 2].sum() - 1) < 0.2
