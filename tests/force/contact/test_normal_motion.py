"""Depth, motion and force from a contact patch, against closed forms and brute force."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from bonded_layer import layer_contact, strip_contact
from pad_samples import depth_sigma_mm, node_forces_n
from scipy.linalg import cholesky
from scipy.optimize import nnls

from gelslim_force.contact.indenter import Cylinder, Flat, Sphere
from gelslim_force.contact.normal_compliance import NormalCompliance
from gelslim_force.contact.normal_motion import NormalModel
from gelslim_force.contact.patch import ContactPatch
from ifem_export.bundle.bundle import build_bundle
from ifem_export.compliance import contact_columns
from ifem_export.elements.material import Material
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh
from ifem_export.operators.surface_operator import surface_operator

E_MPA, THICK_MM = 0.147, 2.0
BALL = Sphere(10.0)


def pad(cells, pitch_mm, nu=0.48, layers=4, hole=False):
    occupied = np.ones((*cells, layers), dtype=bool)
    if hole:
        occupied[0, 0] = False
    size = (pitch_mm, pitch_mm, THICK_MM / layers)
    corner = (-cells[0] * pitch_mm / 2, -cells[1] * pitch_mm / 2, -THICK_MM)
    mesh = PadMesh.from_occupancy(occupied, size, corner)
    operator = surface_operator(mesh, Material(E_MPA, nu, 1000.0), "bbar", "factor")
    return operator, mesh.nodes_mm[mesh.surface]


@cache
def wide_model(nu=0.48):
    operator, points = pad((44, 44), 0.5, nu)
    return NormalModel(operator, points)


@cache
def small():
    """Model of a small pad with its compliance made one solve at a time."""
    operator, points = pad((20, 16), 0.5)
    columns = []
    for node in range(len(points)):
        force = np.zeros((len(points), 3))
        force[node, 2] = 1.0
        columns.append(operator.displacement(force)[:, 2])
    return NormalModel(operator, points), np.array(columns)


def reference_push(compliance, gap):
    """q ≥ 0 with C q ≥ gap and no push across a gap: the least of qCq/2 - gap q, by NNLS."""
    factor = cholesky(compliance)
    cut = np.where(np.isfinite(gap), gap, -1e3)
    push, _ = nnls(factor, np.linalg.solve(factor.T, cut), maxiter=20000)
    return push


def disc(x=0.0, y=0.0, a=2.0, sigma=0.0):
    return ContactPatch("disc", np.array([x, y]), a, covariance=np.eye(4) * sigma**2)


@pytest.mark.slow
def test_truth_is_hertz_on_a_thick_layer():
    nu = 0.4
    truth = layer_contact(lambda r: r * r / 20, 1.0, 25.0, E_MPA, nu)
    hertz = 4 / 3 * E_MPA / (1 - nu**2) / 10
    # a thick layer sinks less than a half-space by about 1.3 a/h of its depth (Hayes 1972)
    assert truth.depth_mm == pytest.approx(0.1, rel=0.06)
    assert truth.force_n == pytest.approx(hertz, rel=1e-3)


@pytest.mark.parametrize(
    ("nu", "radius"),
    [
        *(
            pytest.param(*case, marks=pytest.mark.slow)
            for case in (
                (0.48, 1.5),
                (0.3223, 1.5),
                (0.3223, 2.2),
                (0.3223, 3.1),
                (0.48, 2.2),
                (0.48, 3.1),
            )
        ),
    ],
)
def test_depth_motion_and_force_of_a_sphere(radius, nu):
    """Elastic layer on a rigid base, by Hankel transforms; the patch anywhere on the lattice."""
    model = wide_model(nu)
    truth = layer_contact(lambda r: BALL.profile(r, 0 * r), radius, THICK_MM, E_MPA, nu)
    rng = np.random.default_rng(5)
    depth, force, field, cap, bulge = [], [], [], [], []
    for centre in rng.uniform(-0.5, 0.5, (5, 2)):
        patch = disc(*centre, radius)
        motion = model.motion(patch, BALL)
        r = np.hypot(*(model.points_mm - centre).T)
        exact = np.where(r < radius, BALL.profile(r, 0 * r) - truth.depth_mm, -truth.sinking(r))
        paper = model.cap_only(patch, BALL)
        depth.append(motion.depth_mm / truth.depth_mm - 1)
        force.append(node_forces_n(model, motion).sum() / truth.force_n - 1)
        field.append(np.linalg.norm(motion.w_mm - exact) / np.linalg.norm(exact))
        cap.append(np.linalg.norm(paper.w_mm - exact) / np.linalg.norm(exact))
        beside = (r > 1.25 * radius) & (r < radius + 4)
        bulge.append(np.abs(motion.w_mm - exact)[beside].max() / truth.depth_mm)
        assert abs(motion.depth_mm - truth.depth_mm) < 4 * depth_sigma_mm(model, motion, centre)
    assert abs(np.mean(depth)) < 0.03
    assert np.abs(depth).max() < 0.04
    assert np.abs(force).max() < 0.08
    assert abs(np.mean(force)) < 0.05
    assert np.max(field) < 0.12
    assert np.max(bulge) < 0.03
    assert np.min(cap) > 3 * np.mean(field)


@pytest.mark.parametrize(
    ("patch", "indenter", "depth"),
    [
        (disc(0.1, -0.3, 1.7), BALL, 0.16),
        (disc(4.6, 0.2, 1.7), BALL, 0.16),
        (ContactPatch("strip", np.array([0.0, 0.4]), 1.3, angle_deg=25.0), Cylinder(6.0), 0.15),
        (disc(0.0, 0.0, 1.6), Flat(radius_mm=1.6), 0.1),
        (
            ContactPatch("outline", np.array([1.0, 0.0]), 1.5, 70.0, 2.5),
            Flat(half_sizes_mm=(1.5, 2.5)),
            0.1,
        ),
    ],
)
def test_contact_at_a_known_depth_is_that_of_brute_force(patch, indenter, depth):
    model, compliance = small()
    motion = model.motion(patch, indenter, depth_mm=depth)
    gap = depth - indenter.profile(*patch.local(*model.points_mm.T))
    push = reference_push(compliance, gap)
    found = node_forces_n(model, motion)
    np.testing.assert_allclose(found, push, atol=2e-4 * push.max())
    np.testing.assert_allclose(motion.w_mm, -compliance @ push, atol=2e-4 * depth)
    assert (motion.touched == (push > 1e-6 * push.max())).mean() > 0.995
    assert (found >= -1e-9 * push.max()).all()


@pytest.mark.slow
def test_depth_at_the_pads_edge():
    """The patch of a contact that the edge cuts, by brute force at half the node spacing."""
    fine, points = pad((32, 32), 0.25)
    table = NormalCompliance(fine, len(points))
    table.prepare()
    depth, centre = 0.30, np.array([3.0, 0.0])
    r = np.hypot(*(points[:, :2] - centre).T)
    push = reference_push(table.block(np.arange(len(points))), depth - BALL.profile(r, 0 * r))
    weight = np.where(np.isclose(np.abs(points[:, 0]), 4.0), 0.5, 1.0)
    area = (weight * (push > 0)).sum() / 16
    radii = np.linspace(1, 4, 3001)
    half = np.arccos(np.clip(1.0 / radii, -1, 1))
    segment = radii**2 * (half - np.sin(half) * np.cos(half))
    radius = float(np.interp(area, np.pi * radii**2 - segment, radii))
    operator, nodes = pad((16, 16), 0.5)
    model = NormalModel(operator, nodes)
    motion = model.motion(disc(*centre, radius), BALL)
    assert motion.depth_mm == pytest.approx(depth, rel=0.08)
    assert node_forces_n(model, motion).sum() == pytest.approx(push.sum(), rel=0.16)


@pytest.mark.slow
@pytest.mark.parametrize("half", [1.4, 2.3])
def test_depth_and_force_of_a_cylinder(half):
    """Line contact on a bonded layer in plane strain; the pad's ends make a small difference."""
    model = wide_model()
    depth, line = strip_contact(lambda x: BALL.profile(x, 0 * x), half, THICK_MM, E_MPA, 0.48)
    for angle, y in ((0.0, 0.0), (0.0, 0.1), (90.0, 0.0), (33.0, 0.2)):
        patch = ContactPatch("strip", np.array([0.0, y]), half, angle_deg=angle)
        motion = model.motion(patch, Cylinder(10.0))
        length = 22.0 / max(abs(np.cos(np.deg2rad(angle))), abs(np.sin(np.deg2rad(angle))))
        assert motion.depth_mm == pytest.approx(depth, rel=0.08)
        assert node_forces_n(model, motion).sum() == pytest.approx(line * length, rel=0.15)


def test_compliance_by_symmetry_is_that_of_single_solves():
    model, columns = small()
    model.prepare()
    assert model.compliance.ready == 1.0
    every = np.arange(len(columns))
    np.testing.assert_allclose(model.compliance.block(every), columns, atol=2e-7 * columns.max())
    # a pad with a corner cut off has one mirror line only
    operator, points = pad((9, 9), 1.0, hole=True)
    table = NormalCompliance(operator, len(points))
    force = np.zeros((len(points), 3))
    for node in (0, 17, 55):
        force[:] = 0
        force[node, 2] = 1.0
        exact = operator.displacement(force)[:, 2]
        np.testing.assert_allclose(
            table.apply(np.array([node]), np.ones(1)), exact, atol=1e-6 * exact.max()
        )
    assert 0 < table.ready < 1


@pytest.mark.parametrize("rung", ["paper", "factor", "pcg", "dense32"])
def test_operators_with_the_full_system_are_factored_once(rung, monkeypatch):
    """One factorisation with many right-hand sides, not one solve for every node."""
    mesh = PadMesh.from_occupancy(np.ones((7, 5, 2), bool), (1.0, 1.2, 1.0), (-3.5, -3, -2))
    operator = surface_operator(mesh, Material(E_MPA, 0.4, 1000.0), "bbar", rung)
    columns = len(mesh.surface_mm)
    exact = np.column_stack(
        [operator.displacement(np.eye(3 * columns)[3 * k + 2].reshape(-1, 3))[:, 2]
         for k in range(columns)]
    )  # fmt: skip
    table = NormalCompliance(operator, columns)
    monkeypatch.setattr(NormalCompliance, "_one", None)
    table.prepare()
    found = table.block(np.arange(columns))
    np.testing.assert_allclose(found, exact, atol=1e-6 * exact.max())


@pytest.mark.parametrize("rung", ["paper", "fft", "truncated", "pcg"])
def test_compliance_of_every_operator_is_its_own(rung):
    mesh = PadMesh.from_occupancy(np.ones((10, 8, 2), bool), (1.0, 1.0, 1.0), (-5, -4, -2))
    operator = surface_operator(mesh, Material(E_MPA, 0.4, 1000.0), "bbar", rung)
    points = mesh.nodes_mm[mesh.surface]
    model = NormalModel(operator, points)
    motion = model.motion(disc(1.2, 0.4, 2.3), BALL)
    assert motion.known
    push = np.zeros((len(points), 3))
    push[:, 2] = -node_forces_n(model, motion)
    w = operator.displacement(push)[:, 2]
    np.testing.assert_allclose(motion.w_mm, w, atol=1e-4 * motion.depth_mm)


@pytest.mark.slow
def test_uncertainty_is_that_of_drawn_patches():
    model = wide_model()
    sigma = np.array([0.05, 0.03, 0.04])
    mean = np.array([0.1, 0.2, 2.5])
    patch = ContactPatch("disc", mean[:2], mean[2], covariance=np.diag([*sigma**2, 0.0]))
    motion = model.motion(patch, BALL)
    rng = np.random.default_rng(2)
    draws = [model.motion(disc(x, y, a), BALL) for x, y, a in rng.normal(mean, sigma, (150, 3))]
    depths = np.array([d.depth_mm for d in draws])
    stated = depth_sigma_mm(model, motion, mean[:2])
    assert stated == pytest.approx(depths.std(), rel=0.25)
    pushes = np.array([d.push_n for d in draws])
    assert motion.push_sigma_n == pytest.approx(pushes.std(), rel=0.25)
    seen = np.std([d.w_mm for d in draws], axis=0)
    stated = motion.sigma_mm
    clear = seen > 0.3 * seen.max()
    assert np.median(stated[clear] / seen[clear]) == pytest.approx(1.0, abs=0.2)
    # nodes that only some draws touch move by a law of their own
    assert (stated[clear] > 0.6 * seen[clear]).mean() > 0.9


@pytest.mark.slow
def test_height_of_the_rim_moves_the_patch_along_the_line_of_sight():
    model = wide_model()
    tilted = ContactPatch(
        "disc", np.zeros(2), 2.0, parallax=np.array([3.0, 0.0]), growth_per_mm=0.04
    )
    motion = model.motion(tilted, BALL)
    rim = float(BALL.profile(2.0, 0.0)) - motion.depth_mm
    plain = model.motion(disc(3.0 * rim, 0.0, 2.0 * (1 + 0.04 * rim)), BALL, motion.depth_mm)
    np.testing.assert_allclose(motion.w_mm, plain.w_mm, atol=0.01 * motion.depth_mm)
    upright = model.motion(disc(), BALL)
    assert np.abs(motion.w_mm - upright.w_mm).max() > 0.04 * motion.depth_mm


def test_what_is_not_known_is_not_invented():
    model = wide_model()
    flat = model.motion(disc(), Flat(radius_mm=2.0))
    assert not flat.known
    assert flat.problem
    assert np.isnan(flat.w_mm).all()
    assert np.isnan(flat.depth_mm)
    wide = model.motion(disc(a=3.0), Sphere(2.0))
    assert "wider than the indenter" in wide.problem
    beside = model.motion(disc(40.0, 0.0, 1.0), BALL)
    assert not beside.known
    assert beside.touched is None
    with pytest.raises(ValueError, match="depth_mm"):
        model.motion(disc(), BALL, depth_mm=-1.0)
    with pytest.raises(ValueError, match="surface nodes"):
        NormalModel(None, np.zeros(3))


@pytest.mark.parametrize("x_mm", [5.0, 7.5])
def test_a_press_near_the_edge_is_that_of_the_exact_pad(x_mm, monkeypatch):
    """The infinite pad alone overestimated the force by up to two thirds."""
    monkeypatch.setattr(contact_columns, "FEW", 0)
    bundle = edge_pad()
    points = np.asarray(bundle.mesh.surface_mm)
    exact, quick = (bundle.surface_operator(rung) for rung in ("factor", "fft"))
    patch = disc(x_mm, 0.4)
    found = {}
    for name, model in {
        "exact": NormalModel(exact, points),
        "mixed": NormalModel(quick, points, contact_columns.ContactCompliance(bundle)),
        "quick": NormalModel(quick, points),
    }.items():
        motion = model.motion(patch, BALL)
        found[name] = motion.depth_mm, node_forces_n(model, motion).sum(), motion.w_mm
    assert found["mixed"][0] == pytest.approx(found["exact"][0], rel=0.02)
    assert found["mixed"][1] == pytest.approx(found["exact"][1], rel=0.02)
    size = np.linalg.norm(found["exact"][2])
    assert np.linalg.norm(found["mixed"][2] - found["exact"][2]) < 0.02 * size
    if x_mm > 7.0:
        assert found["quick"][1] > 1.15 * found["exact"][1]


@cache
def edge_pad():
    mesh, _ = build_pad_mesh(RoundedRectangle(16.0, 12.0, 1.0), THICK_MM, cells=(24, 18, 3))
    return build_bundle(mesh, Material(E_MPA, 0.48, 1000.0), "bbar", with_stiffness=False)
