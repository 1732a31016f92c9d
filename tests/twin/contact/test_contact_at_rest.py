"""Contact where nodes meet the tool at rest, against a plain iteration and the neo-Hookean gel."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from contact_pads import Array, dense_compliance, small_pad

from gelslim_twin.contact.gel_state import GelState
from gelslim_twin.contact.nonlinear import NonlinearContact
from gelslim_twin.contact.solver import ContactSettings, ContactSolver, Geometry, geometry_of
from gelslim_twin.scene.indenter import Sphere
from gelslim_twin.scene.pose import Pose
from gelslim_twin.tools.tool import Tool
from ifem_export.compliance.columns import SurfaceCompliance

RADIUS_MM = 4.0
BALL = Tool.of([Sphere(shape="sphere", radius_mm=RADIUS_MM)], Path())


def pressed(
    pose: Pose, poisson: float, cells: int, geometry: Geometry, friction: float = 0.0
) -> GelState:
    settings = ContactSettings(1e-4, friction, geometry=geometry)
    solver = ContactSolver(SurfaceCompliance(small_pad(poisson, cells, 3)), BALL, settings)
    return solver.advanced(GelState.at_rest(len(solver.points_mm)), None, pose)


def by_gauss_seidel(compliance: Array, height: Array) -> Array:
    """f <= 0, C f <= height, f (C f - height) = 0, one node after the other."""
    force = np.zeros(len(height))
    for _ in range(600):
        for node in range(len(height)):
            others = compliance[node] @ force - compliance[node, node] * force[node]
            force[node] = min(0.0, (height[node] - others) / compliance[node, node])
    return force


def test_it_is_the_theory_of_small_displacements() -> None:
    """Heights over the nodes at rest, forces along z; a tilted ball is the same ball."""
    pad = small_pad(0.49, 12, 3)
    points = np.asarray(pad.mesh.surface_mm)
    x, y, depth = 0.3, -0.2, 0.4
    away = np.hypot(points[:, 0] - x, points[:, 1] - y)
    near = np.flatnonzero(away < 2.5)
    height = RADIUS_MM - depth - np.sqrt(RADIUS_MM**2 - away[near] ** 2)
    known = np.zeros(len(points))
    known[near] = by_gauss_seidel(dense_compliance(pad)[2::3, 2::3][np.ix_(near, near)], height)
    found = pressed(Pose(x_mm=x, y_mm=y, depth_mm=depth), 0.49, 12, "rest")
    assert not found.force_n[:, :2].any()
    np.testing.assert_allclose(found.force_n[:, 2], known, atol=1e-5 * -known.min())
    # Turned about its centre by 12°: the lowest point of the upright ball goes up and aside.
    tilt = np.radians(12.0)
    turned = Pose(
        x_mm=x - RADIUS_MM * np.sin(tilt),
        y_mm=y,
        depth_mm=depth - RADIUS_MM * (1 - np.cos(tilt)),
        tilt_y_deg=12.0,
    )
    again = pressed(turned, 0.49, 12, "rest")
    np.testing.assert_allclose(again.force_n[:, 2], known, atol=1e-5 * -known.min())


def test_with_friction_the_forces_stay_in_the_cone() -> None:
    state = pressed(Pose(depth_mm=0.4), 0.45, 12, "rest", 0.3)
    side = np.hypot(*state.force_n[:, :2].T)
    assert side.max() > 0
    assert (side <= 0.3 * -state.force_n[:, 2] * (1 + 1e-9)).all()


def test_it_is_chosen_for_nearly_incompressible_gels() -> None:
    assert [geometry_of(nu) for nu in (0.3, 0.3223, 0.45, 0.49)] == ["displaced"] * 2 + ["rest"] * 2


@pytest.mark.slow
@pytest.mark.parametrize("poisson", [0.45, 0.49])
@pytest.mark.parametrize("depth", [0.2, 0.4, 0.6])
def test_its_force_is_nearer_to_the_neo_hookean_gel(poisson: float, depth: float) -> None:
    one = ContactSolver(
        SurfaceCompliance(small_pad(poisson, 24, 3)), BALL, ContactSettings(1e-4)
    )  # fmt: skip
    exact = list(NonlinearContact(one, 1e-3).states((Pose(), Pose(1.0, depth_mm=depth))))[-1]
    known = exact.force_n[:, 2].sum()
    errors = {}
    for geometry in ("displaced", "rest"):
        found = pressed(Pose(depth_mm=depth), poisson, 24, geometry)
        errors[geometry] = found.force_n[:, 2].sum() / known - 1
    assert errors["displaced"] < -0.04
    assert abs(errors["rest"]) < 0.4 * abs(errors["displaced"])
