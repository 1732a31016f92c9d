"""Motion and force of a ball at coarse node spacings, against the layer's exact solution."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from bonded_layer import layer_contact
from scipy.linalg import cholesky
from scipy.optimize import brentq, nnls

from gelslim_force.contact.ball_model import BallModel, PadLayer, contact_model
from gelslim_force.contact.indenter import Cylinder, Sphere
from gelslim_force.contact.normal_compliance import NormalCompliance
from gelslim_force.contact.normal_motion import NormalModel
from gelslim_force.contact.patch import ContactPatch
from ifem_export.bundle.bundle import build_bundle
from ifem_export.elements.material import Material
from ifem_export.mesh.crown import Paraboloid
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh
from ifem_export.operators.surface_operator import SurfaceOperator, surface_operator

E_MPA, NU, THICK_MM, BALL = 0.147, 0.3223, 2.0, Sphere(8.0)


def pad(cells: tuple[int, int], pitch_mm: float) -> tuple[SurfaceOperator, np.ndarray]:
    corner = (-cells[0] * pitch_mm / 2, -cells[1] * pitch_mm / 2, -THICK_MM)
    size = (pitch_mm, pitch_mm, THICK_MM / 4)
    mesh = PadMesh.from_occupancy(np.ones((*cells, 4), dtype=bool), size, corner)
    operator = surface_operator(mesh, Material(E_MPA, NU, 1000.0), "bbar", "factor")
    return operator, mesh.nodes_mm[mesh.surface]


@cache
def coarse() -> BallModel:
    """A pad of 18.7 x 17.4 mm with a node every 0.67 mm."""
    mesh = NormalModel(*pad((28, 26), 2 / 3))
    return BallModel(mesh, PadLayer(E_MPA, NU, THICK_MM), BALL.radius_mm)


def disc(x: float, y: float, a: float, sigma: float = 0.0) -> ContactPatch:
    return ContactPatch("disc", np.array([x, y]), a, covariance=np.eye(4) * sigma**2)


@pytest.mark.parametrize(("size", "field"), [(0.9, 0.1), (1.4, 0.07), (2.4, 0.045), (3.4, 0.04)])
def test_force_and_motion_are_those_of_the_layer(size: float, field: float) -> None:
    """The radius is given as it is at rest: the rim moves by less than a hundredth of it."""
    model = coarse()
    truth = layer_contact(lambda r: BALL.profile(r, 0 * r), size, THICK_MM, E_MPA, NU)
    mesh = []
    for place in np.random.default_rng(5).uniform(-0.5, 0.5, (4, 2)):
        seen = size + 0.75 * model._table.outward_mm(size)
        found = model.motion(disc(*place, seen), BALL)
        away = np.hypot(*(model.points_mm - place).T)
        profile = BALL.profile(away, 0 * away)
        exact = np.where(away < size, profile - truth.depth_mm, -truth.sinking(away))
        assert found.push_n == pytest.approx(truth.force_n, rel=5e-3)
        assert found.depth_mm == pytest.approx(truth.depth_mm, rel=5e-3)
        assert np.linalg.norm(found.w_mm - exact) < field * np.linalg.norm(exact)
        forces = model.mesh.compliance._operator.force(
            np.column_stack([np.zeros((len(exact), 2)), found.w_mm])
        )
        assert found.touched.any()
        # Under the motion found, held aside, the pad presses back with the force and more.
        assert -forces[:, 2].sum() == pytest.approx(truth.force_n, rel=0.08)
        mesh.append(model.mesh.motion(disc(*place, size), BALL, truth.depth_mm).push_n)
    # What a sharp contact on the mesh loses.
    assert np.mean(mesh) < 0.985 * truth.force_n


def test_the_motion_is_that_of_the_pad_under_the_pressure() -> None:
    model = coarse()
    found = model.motion(disc(0.3, -0.2, 1.9), BALL)
    nodes, push = model._pushes(disc(0.3, -0.2, model._table.at_rest(1.9)[0]))
    force = np.zeros((len(model.points_mm), 3))
    force[nodes, 2] = -push[:, 0]
    moved = model.mesh.compliance._operator.displacement(force)[:, 2]
    np.testing.assert_allclose(found.w_mm, moved, atol=2e-4 * found.depth_mm)
    # Bilinear functions keep the force and where it acts.
    np.testing.assert_allclose(
        push[:, 0] @ model.points_mm[nodes] / found.push_n, [0.3, -0.2], atol=1e-4
    )


def test_force_and_depth_at_the_pads_edge() -> None:
    """What the edge changes, by brute force at three tenths of the node spacing."""
    fine, points = pad((40, 40), 0.2)
    table = NormalCompliance(fine, len(points))
    table.prepare()
    factor = cholesky(table.block(np.arange(len(points))))
    model = BallModel(NormalModel(*pad((12, 12), 2 / 3)), PadLayer(E_MPA, NU, THICK_MM), 8.0)
    depth = 0.22
    middle, edge = np.array([0.02, 0.1]), np.array([2.42, 0.1])

    def brute(place: np.ndarray) -> tuple[float, float]:
        """Force, and width of the contact along the edge as the root of its second moment."""
        away = points[:, :2] - place
        gap = depth - BALL.profile(*away.T)
        push, _ = nnls(factor, np.linalg.solve(factor.T, gap), maxiter=20000)
        return float(push.sum()), float(np.sqrt(push @ away[:, 1] ** 2 / push.sum()))

    (free, width), (cut, narrow) = brute(middle), brute(edge)
    size = brentq(lambda a: model._table.depth_mm(a) - depth, 0.5, 3.0)
    found = {}
    for place, a in ((middle, size), (edge, size * narrow / width)):
        seen = a + 0.75 * model._table.outward_mm(a)
        found[place[0]] = model.motion(disc(*place, seen), BALL)
        assert found[place[0]].depth_mm == pytest.approx(depth, rel=0.04)
    assert cut < 0.95 * free
    assert found[2.42].push_n / found[0.02].push_n == pytest.approx(cut / free, rel=0.03)


def test_errors_are_those_of_drawn_patches() -> None:
    model = coarse()
    sigma, mean = np.array([0.05, 0.03, 0.03]), np.array([0.1, 0.2, 2.3])
    patch = disc(*mean)
    patch = replace(patch, covariance=np.diag([*sigma**2, 0.0]))
    found = model.motion(patch, BALL)
    draws = [
        model.motion(disc(*at), BALL)
        for at in np.random.default_rng(2).normal(mean, sigma, (300, 3))
    ]
    push = np.std([d.push_n for d in draws])
    friction = model._table.at_rest(2.3)[1] / sigma[2]
    besides = np.hypot(push * np.hypot(1, friction), 0.01 * found.push_n)
    assert found.push_sigma_n == pytest.approx(besides, rel=0.12)
    moved = np.array([d.w_mm for d in draws])
    # The errors add up to the covariance between nodes, not only to the deviation of each.
    some = np.argsort(found.w_mm)[[0, 8, 20, 35, 50]]
    seen = np.cov(moved[:, some].T)
    stated = found.errors_mm[:, some].T @ found.errors_mm[:, some]
    assert np.linalg.norm(stated - seen) < 0.35 * np.linalg.norm(seen)
    np.testing.assert_allclose(found.sigma_mm, np.linalg.norm(found.errors_mm, axis=0))


def test_what_the_layer_cannot_tell_has_the_motion_of_the_mesh() -> None:
    model = coarse()
    rod = ContactPatch("strip", np.array([0.0, 0.1]), 1.2)
    for patch, indenter, depth in (
        (rod, Cylinder(8.0), None),
        (disc(0.2, 0.1, 1.8), BALL, 0.25),
        (disc(0.2, 0.1, 1.8), Sphere(5.0), None),
        (disc(0.2, 0.1, 7.5), BALL, None),
    ):
        found, mesh = (m.motion(patch, indenter, depth) for m in (model, model.mesh))
        np.testing.assert_array_equal(found.w_mm, mesh.w_mm)
        assert found.errors_mm is None


def test_a_flat_pad_under_a_ball_has_the_model() -> None:
    outline = RoundedRectangle(length_mm=12.0, width_mm=10.0, corner_radius_mm=1.0)
    made = {}
    for crown in (None, Paraboloid(0.3, 7.0)):
        mesh, _ = build_pad_mesh(outline, 2.0, cells=(18, 15, 3), crown=crown)
        bundle = build_bundle(mesh, Material(E_MPA, NU, 1000.0), "bbar", with_stiffness=False)
        model = NormalModel(bundle.surface_operator("factor"), mesh.surface_mm)
        for shape in (BALL, Cylinder(8.0)):
            made[crown is None, shape] = contact_model(model, bundle, shape)
    assert [isinstance(m, BallModel) for m in made.values()] == [True, False, False, False]
    layer = made[True, BALL].layer
    assert (layer.thickness_mm, layer.young_mpa, layer.skin_mm) == (2.0, E_MPA, 0.0)
