"""The contacts that a ladder is measured with, by the closed forms of their pressures."""

from __future__ import annotations

import numpy as np
import pytest
from ifem_shapes import disc as round_outline

from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh
from ifem_export.operators.ladder_contacts import (
    Disc,
    nodal_forces,
    standard_contacts,
)
from ifem_export.operators.operator_ladder import CONTACTS


@pytest.mark.parametrize("is_sharp", [False, True])
@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_the_force_within_a_circle_is_that_of_the_pressure(is_sharp: bool, share: float) -> None:
    """Integrals of sqrt(1 - r^2) and of its inverse over the disc."""
    one = Disc(np.array([0.4, -0.2]), 1.5, np.array([0.0, 0.0, -2.0]), is_sharp)
    away = np.hypot(*(one.points_mm() - one.centre_mm).T)
    assert away.max() <= 1.5
    expected = 1 - (1 - share**2) ** (0.5 if is_sharp else 1.5)
    assert (away < share * 1.5).mean() == pytest.approx(expected, abs=1e-3)


def test_nodal_forces_keep_force_and_moment() -> None:
    mesh, _ = build_pad_mesh(RoundedRectangle(12.0, 10.0, 1.0), 2.0, cells=(15, 14, 2))
    force = np.array([0.4, -0.3, -1.0])
    found = nodal_forces(mesh, (Disc(np.array([1.1, -0.7]), 1.5, force),))
    assert found.sum(axis=0) == pytest.approx(force, abs=1e-12)
    centre = np.asarray(mesh.surface_mm)[:, :2].T @ found[:, 2] / found[:, 2].sum()
    assert centre == pytest.approx([1.1, -0.7], abs=2e-3)
    # Half of a ball whose centre is on the edge presses on air.
    cut = nodal_forces(mesh, (Disc(np.array([6.0, 0.0]), 1.5, force),))
    assert cut.sum(axis=0) == pytest.approx(force / 2, rel=5e-3)


@pytest.mark.parametrize("outline", [RoundedRectangle(16.0, 12.0, 2.0), round_outline(6.0)])
def test_contacts_lie_where_their_names_say(outline) -> None:
    mesh, _ = build_pad_mesh(outline, 2.0, pitch_mm=(0.6, 0.5), layers=2)
    contacts = standard_contacts(mesh)
    assert list(contacts) == list(CONTACTS)
    totals = {k: nodal_forces(mesh, c).sum(axis=0) for k, c in contacts.items()}
    due = {k: sum(d.force_n for d in c) for k, c in contacts.items()}
    for name in ("small_ball", "sharp_punch", "two_contacts"):
        assert totals[name] == pytest.approx(due[name], abs=1e-9)
    assert 0.4 < totals["edge"][2] / due["edge"][2] < 0.95
    first, second = contacts["two_contacts"]
    apart = np.linalg.norm(first.centre_mm - second.centre_mm)
    assert apart > first.radius_mm + second.radius_mm
    assert [d.is_sharp for d in contacts["sharp_punch"]] == [True]
