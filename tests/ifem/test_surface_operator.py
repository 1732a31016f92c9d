"""Surface operators and solvers against dense linear algebra, across crops, ν and shapes."""

from __future__ import annotations

import numpy as np
import pytest
from ifem_shapes import Polygon, disc

from ifem_export.assembly.assembly import assemble_csr
from ifem_export.elements.hex8 import hex8_stiffness
from ifem_export.elements.material import Material
from ifem_export.errors import IfemError, MeshError
from ifem_export.mesh.outline import Outline, RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh
from ifem_export.operators.pad_system import PadSystem
from ifem_export.operators.solver import (
    ConjugateGradients,
    ConvergenceError,
    SparseFactor,
    inner_solver,
    pad_solver,
)
from ifem_export.operators.surface_operator import RUNGS, one_layer, surface_operator

OUTLINES: dict[str, Outline] = {
    "rectangle": RoundedRectangle(9.0, 7.0, 1.5),
    "disc": disc(5.0),
    "polygon": Polygon([(-5, -4), (5, -4), (5, 1), (1, 1), (1, 4), (-5, 4)]),
    "long": RoundedRectangle(14.0, 3.4, 0.6),
}


def gel(nu: float = 0.3223) -> Material:
    return Material(0.147, nu, 1020.0)


def pad(name: str = "rectangle", layers: int = 3, pitch: float = 1.0) -> PadMesh:
    """Cells are 0.85 times as wide across as along, so that x and y cannot be exchanged."""
    return build_pad_mesh(OUTLINES[name], 2.0, pitch_mm=(pitch, 0.85 * pitch), layers=layers)[0]


def system(mesh: PadMesh, nu: float = 0.3223) -> PadSystem:
    return PadSystem(mesh, hex8_stiffness(mesh.cell_size_mm, gel(nu), "bbar"))


def dense_schur(mesh: PadMesh, nu: float) -> np.ndarray:
    """S from the complete stiffness matrix, the textbook way."""
    k = assemble_csr(
        np.asarray(mesh.occupancy), hex8_stiffness(mesh.cell_size_mm, gel(nu), "bbar")
    ).toarray()
    surface = (3 * np.asarray(mesh.surface)[:, None] + np.arange(3)).ravel()
    inner_nodes = np.setdiff1d(mesh.free, mesh.surface)
    inner = (3 * inner_nodes[:, None] + np.arange(3)).ravel()
    held = np.linalg.solve(k[np.ix_(inner, inner)], k[np.ix_(inner, surface)])
    return k[np.ix_(surface, surface)] - k[np.ix_(surface, inner)] @ held


@pytest.mark.parametrize("name", OUTLINES)
@pytest.mark.parametrize("nu", [0.3, 0.49])
def test_condensation_is_the_schur_complement(name: str, nu: float) -> None:
    mesh = pad(name)
    expected = dense_schur(mesh, nu)
    rng = np.random.default_rng(2)
    u = rng.normal(size=(len(mesh.surface), 3))
    force = (expected @ u.ravel()).reshape(-1, 3)
    for rung, options in (("factor", {}), ("pcg", {"rtol": 1e-12}), ("dense32", {})):
        found = surface_operator(mesh, gel(nu), "bbar", rung, **options).force(u)
        tolerance = 1e-6 if rung == "dense32" else 1e-10
        assert np.linalg.norm(found - force) < tolerance * np.linalg.norm(force), rung
    assert np.allclose(expected, expected.T)
    assert np.linalg.eigvalsh(expected).min() > 0


@pytest.mark.parametrize("rung", ["factor", "pcg", "dense32", "paper"])
def test_displacement_undoes_force(rung: str) -> None:
    mesh = pad("disc")
    operator = surface_operator(
        mesh, gel(), "bbar", rung, **({"rtol": 1e-10} if rung == "pcg" else {})
    )
    u = np.random.default_rng(0).normal(size=(len(mesh.surface), 3))
    back = operator.displacement(operator.force(u))
    np.testing.assert_allclose(back, u, atol=2e-4 if rung == "dense32" else 1e-6)


def test_work_is_reciprocal() -> None:
    mesh = pad("polygon", layers=4)
    operator = surface_operator(mesh, gel(0.45), "bbar", "factor")
    rng = np.random.default_rng(5)
    u, v = rng.normal(size=(2, len(mesh.surface), 3))
    assert np.vdot(v, operator.force(u)) == pytest.approx(np.vdot(u, operator.force(v)), rel=1e-9)


def test_the_paper_is_one_layer_of_full_elements() -> None:
    mesh = pad("disc", layers=4)
    flat = one_layer(mesh)
    assert flat.layers == 1
    k = assemble_csr(np.asarray(flat.occupancy), hex8_stiffness(flat.cell_size_mm, gel(), "full"))
    u = np.random.default_rng(1).normal(size=(len(mesh.surface), 3))
    every_node = np.zeros((flat.n_nodes, 3))
    every_node[flat.surface] = u
    expected = (k @ every_node.ravel()).reshape(-1, 3)[flat.surface]
    found = surface_operator(mesh, gel(), "bbar", "paper").force(u)
    np.testing.assert_allclose(found, expected, atol=1e-13)


@pytest.mark.parametrize("name", OUTLINES)
def test_iterations_hardly_grow_towards_incompressibility(name: str) -> None:
    mesh = pad(name, layers=4, pitch=0.5)
    rng = np.random.default_rng(3)
    counts = {}
    for nu in (0.3, 0.45, 0.49, 0.499, 0.4999):
        pad_equations = system(mesh, nu)
        found = pad_solver(pad_equations, "pcg").solve(
            rng.normal(size=pad_equations.stiffness.shape[0]), 1e-8
        )
        assert found.residual <= 1e-8
        counts[nu] = found.iterations
    assert counts[0.4999] <= 2 * counts[0.3], counts
    assert counts[0.3] < 60


def test_solvers_agree_and_report_the_true_residual() -> None:
    pad_equations = system(pad("polygon", layers=3))
    b = np.random.default_rng(4).normal(size=pad_equations.stiffness.shape[0])
    direct = pad_solver(pad_equations, "direct").solve(b)
    iterative = pad_solver(pad_equations, "pcg").solve(b, 1e-10)
    np.testing.assert_allclose(iterative.x, direct.x, atol=1e-8 * np.abs(direct.x).max())
    for found in (direct, iterative):
        truth = np.linalg.norm(b - pad_equations.stiffness @ found.x) / np.linalg.norm(b)
        assert found.residual == pytest.approx(truth, abs=1e-14)
    assert isinstance(pad_solver(pad_equations), SparseFactor)


def test_no_convergence_is_an_error_with_a_diagnosis() -> None:
    pad_equations = system(pad(layers=4, pitch=0.5))
    b = np.random.default_rng(0).normal(size=pad_equations.stiffness.shape[0])
    short = ConjugateGradients(
        pad_equations.stiffness, pad_equations.preconditioner, 4, most_iterations=2
    )
    with pytest.raises(ConvergenceError) as caught:
        short.solve(b, 1e-10)
    assert (caught.value.iterations, caught.value.rtol) == (2, 1e-10)
    assert 1e-10 < caught.value.residual < 1.0
    with pytest.raises(ConvergenceError) as caught:
        pad_solver(pad_equations, "pcg").solve(b, 1e-30)
    assert 1e-30 < caught.value.residual < 1e-10


@pytest.mark.parametrize(
    ("thickness", "pitch"), [(0.05, 1.0), (0.2, 1.0), (2.0, 1.0), (20.0, 1.0), (2.0, 0.08)]
)
def test_flat_and_tall_cells(thickness: float, pitch: float) -> None:
    outline = RoundedRectangle(12 * pitch, 10 * pitch, pitch)
    mesh, _ = build_pad_mesh(outline, thickness, pitch_mm=pitch, layers=4)
    for nu in (0.3, 0.49):
        pad_equations = system(mesh, nu)
        b = np.random.default_rng(6).normal(size=pad_equations.stiffness.shape[0])
        expected = pad_solver(pad_equations, "direct").solve(b).x
        found = pad_solver(pad_equations, "pcg").solve(b, 1e-9)
        np.testing.assert_allclose(found.x, expected, atol=1e-6 * np.abs(expected).max())


def test_a_single_cell_and_a_single_layer() -> None:
    for layers in (1, 2):
        mesh, _ = build_pad_mesh(RoundedRectangle(1.0, 1.0, 0.0), 1.0, cells=(1, 1, layers))
        u = np.random.default_rng(8).normal(size=(4, 3))
        found = surface_operator(mesh, gel(), "bbar", "factor").force(u)
        if layers == 2:
            expected = (dense_schur(mesh, 0.3223) @ u.ravel()).reshape(-1, 3)
            np.testing.assert_allclose(found, expected, atol=1e-12)
        assert np.isfinite(found).all()
    with pytest.raises(IfemError) as caught:
        inner_solver(system(pad(layers=1)))
    assert (caught.value.field, caught.value.value) == ("layers", 1)


def test_the_infinite_pad_is_good_inside_and_bad_at_a_rim_near_incompressibility() -> None:
    mesh, _ = build_pad_mesh(RoundedRectangle(24.0, 24.0, 2.0), 2.0, pitch_mm=(0.8, 0.7), layers=4)
    points = np.asarray(mesh.nodes_mm)[mesh.surface]

    def off(nu: float, at: float) -> float:
        u = np.zeros((len(points), 3))
        u[:, 2] = -np.exp(-((points[:, 0] - at) ** 2 + points[:, 1] ** 2) / 8)
        exact = surface_operator(mesh, gel(nu), "bbar", "factor").force(u)
        quick = surface_operator(mesh, gel(nu), "bbar", "fft").force(u)
        return float(np.linalg.norm(quick - exact) / np.linalg.norm(exact))

    assert off(0.3223, 0.0) < 1e-3
    assert off(0.49, 9.0) > 0.1


def test_a_wider_truncation_errs_less() -> None:
    mesh, _ = build_pad_mesh(RoundedRectangle(24.0, 24.0, 2.0), 2.0, pitch_mm=(0.8, 0.7), layers=4)
    points = np.asarray(mesh.nodes_mm)[mesh.surface]
    u = np.zeros((len(points), 3))
    u[:, 0] = np.exp(-(points[:, 0] ** 2 + points[:, 1] ** 2) / 8)
    exact = surface_operator(mesh, gel(), "bbar", "factor").force(u)
    errors = []
    for radius in (2, 4, 8):
        found = surface_operator(mesh, gel(), "bbar", "truncated", radius=radius).force(u)
        errors.append(float(np.linalg.norm(found - exact) / np.linalg.norm(exact)))
    assert errors[0] > errors[1] > errors[2]
    with pytest.raises(IfemError) as caught:
        surface_operator(mesh, gel(), "bbar", "truncated", radius=0)
    assert (caught.value.field, caught.value.value) == ("radius", 0)


def test_bad_fields_and_names_are_refused() -> None:
    mesh = pad()
    for rung in RUNGS:
        operator = surface_operator(mesh, gel(), "bbar", rung)
        bad = np.zeros((len(mesh.surface), 3))
        bad[4, 1] = np.nan
        for field, name, value in ((np.zeros((3, 3)), "shape", (3, 3)), (bad, "node", 4)):
            with pytest.raises(IfemError) as caught:
                operator.force(field)
            assert (caught.value.field, caught.value.value) == (name, value)
    with pytest.raises(IfemError) as caught:
        surface_operator(mesh, gel(), "bbar", "magic")  # type: ignore[arg-type]
    assert (caught.value.field, caught.value.value) == ("rung", "magic")
    with pytest.raises(IfemError) as caught:
        pad_solver(system(mesh)).solve(np.zeros(5))
    assert (caught.value.field, caught.value.value) == ("b", 5)


def test_a_crowned_mesh_is_refused_by_name() -> None:
    cells = np.ones((4, 4, 2), dtype=bool)
    cells[0, 0, 1] = False
    with pytest.raises(MeshError) as caught:
        system(PadMesh.from_occupancy(cells, (1.0, 1.0, 1.0), (0.0, 0.0, -2.0)))
    assert caught.value.field == "mesh"
