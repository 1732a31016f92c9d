"""Cells scaled by their filled volume: fractions, assembly, convergence, solving."""

import math

import numpy as np
import pytest
from ifem_shapes import Polygon, Sphere, disc

from ifem_export.assembly.assembly import assemble_csr, mesh_stiffness
from ifem_export.bundle.bundle import geometry_hash
from ifem_export.bundle.self_test import elementwise_force
from ifem_export.elements.hex8 import hex8_stiffness
from ifem_export.elements.material import Material
from ifem_export.errors import MeshError, OutlineError
from ifem_export.finite_strain.neo_hookean import NeoHookeanPad
from ifem_export.mesh.crop import filled_cells
from ifem_export.mesh.crown import Paraboloid
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh
from ifem_export.mesh.vtu import write_vtu
from ifem_export.operators.pad_system import PadSystem
from ifem_export.operators.solver import inner_solver, pad_solver
from ifem_export.operators.surface_operator import one_layer, surface_operator

GEL = Material(0.147, 0.3223, 1070.0)
SIZE = (0.5, 0.7, 0.9)
TRIANGLE = Polygon(((-3.0, -2.0), (3.1, -2.2), (0.4, 3.3)))
DENT = Polygon(((-3.0, -2.0), (3.0, -2.0), (3.0, 2.0), (0.1, -0.7), (-3.0, 2.0)))
OUTLINES = {
    "disc": disc(3.03),
    "rounded": RoundedRectangle(6.1, 5.3, 1.7),
    "triangle": TRIANGLE,
    "dent": DENT,
    "long": RoundedRectangle(14.0, 2.1, 0.6),
}


def meshed(outline, **options):
    return build_pad_mesh(outline, 2.0, **{"pitch_mm": (0.5, 0.4), "layers": 3, **options})


def random_fill(seed, shape=(5, 4, 3)):
    rng = np.random.default_rng(seed)
    occupancy = rng.random(shape) < 0.8
    return occupancy, np.where(occupancy, rng.uniform(0.02, 1.0, shape), 0.0)


def uniform(mesh, direction):
    return np.tile(np.asarray(direction, dtype=float), (len(mesh.surface), 1))


@pytest.mark.parametrize("outline", OUTLINES.values(), ids=OUTLINES)
def test_fractions_add_up_to_the_area(outline):
    mesh, report = meshed(outline, weighting="volume_fraction", floor=1e-3)
    area = mesh.fill[:, :, 0].sum() * 0.5 * 0.4
    assert area == pytest.approx(outline.area_mm2, rel=2e-3)
    assert report.mesh_area_mm2 == pytest.approx(area)
    assert np.array_equal(mesh.fill > 0.0, mesh.occupancy)
    assert mesh.fill.max() <= 1.0
    assert (mesh.fill == 1.0).any()
    assert ((mesh.fill > 0.0) & (mesh.fill < 1.0)).any()


@pytest.mark.parametrize("crown", [Paraboloid(0.7, 4.3), Sphere(9.0)])
def test_fractions_add_up_to_the_volume_under_a_crown(crown):
    mesh, _ = build_pad_mesh(
        disc(3.03), 2.0, pitch_mm=0.5, layers=5, crown=crown, weighting="volume_fraction",
        floor=1e-4,
    )  # fmt: skip
    r = np.linspace(0.0, 3.03, 20001)
    exact = np.trapezoid(2 * math.pi * r * (2.0 + crown.height_mm(r, 0.0)), r)
    assert mesh.fill.sum() * np.prod(mesh.cell_size_mm) == pytest.approx(exact, rel=2e-3)


def test_fractions_of_a_rectangle_are_products():
    edges = (np.linspace(-2, 2, 9), np.linspace(-2, 2, 9), np.linspace(-1, 0, 3))
    _, fill = filled_cells(RoundedRectangle(2.5, 3.25), None, edges, "volume_fraction")
    wide = np.clip((1.25 - np.abs(edges[0][:-1] + 0.25) + 0.25) / 0.5, 0, 1)
    tall = np.clip((1.625 - np.abs(edges[1][:-1] + 0.25) + 0.25) / 0.5, 0, 1)
    assert fill[:, :, 1] == pytest.approx(np.outer(wide, tall), abs=0.02)
    assert np.array_equal(fill[:, :, 0], fill[:, :, 1])


def test_emptier_cells_than_the_floor_are_dropped():
    kept = [
        meshed(disc(3.03), weighting="volume_fraction", floor=floor)[0].n_elements
        for floor in (1e-3, 0.1, 0.5, 1.0)
    ]
    assert kept == sorted(kept, reverse=True)
    assert len(set(kept)) == 4
    least = meshed(disc(3.03), weighting="volume_fraction", floor=0.1)[0].fill
    assert least[least > 0].min() >= 0.1


@pytest.mark.parametrize("seed", range(4))
def test_the_matrix_is_the_sum_of_scaled_elements(seed):
    occupancy, fill = random_fill(seed)
    mesh = PadMesh.from_occupancy(occupancy, SIZE, (0.0, 0.0, 0.0), fill)
    element = hex8_stiffness(SIZE, GEL, "bbar")
    expected = np.zeros((3 * mesh.n_nodes, 3 * mesh.n_nodes))
    cells = fill.transpose(2, 1, 0)[occupancy.transpose(2, 1, 0)]
    for nodes, scale in zip(mesh.hexes, cells, strict=True):
        unknowns = (3 * nodes[:, None] + np.arange(3)).reshape(-1)
        expected[np.ix_(unknowns, unknowns)] += scale * element
    found = assemble_csr(occupancy, element, fill)
    assert found.toarray() == pytest.approx(expected, abs=1e-13)
    assert (found != found.T).nnz == 0
    u = np.random.default_rng(seed).normal(size=(mesh.n_nodes, 3))
    assert elementwise_force(mesh, element, u).reshape(-1) == pytest.approx(found @ u.reshape(-1))


def test_full_cells_give_the_very_matrix_of_unscaled_ones():
    occupancy, _ = random_fill(5, (7, 6, 4))
    element = hex8_stiffness(SIZE, GEL, "incompatible")
    plain = assemble_csr(occupancy, element)
    scaled = assemble_csr(occupancy, element, occupancy.astype(float))
    for part in ("data", "indices", "indptr"):
        assert np.array_equal(getattr(plain, part), getattr(scaled, part))


def test_threads_do_not_change_a_bit():
    occupancy, fill = random_fill(6, (9, 8, 5))
    element = hex8_stiffness(SIZE, GEL, "bbar")
    one, three = (assemble_csr(occupancy, element, fill, threads=t) for t in (1, 3))
    assert np.array_equal(one.data, three.data)


@pytest.mark.parametrize(
    "fill", [np.ones((5, 4, 2)), np.zeros((5, 4, 3)), np.full((5, 4, 3), np.nan)]
)
def test_a_fill_that_does_not_fit_is_refused(fill):
    with pytest.raises(MeshError) as caught:
        assemble_csr(random_fill(0)[0], hex8_stiffness(SIZE, GEL, "bbar"), fill)
    assert caught.value.field == "fill"


def test_a_lattice_along_the_outline_has_the_plain_pad():
    outline = RoundedRectangle(6.0, 4.8)
    plain, _ = meshed(outline)
    full, _ = meshed(outline, weighting="volume_fraction")
    assert np.array_equal(full.occupancy, plain.occupancy)
    assert (full.fill == 1.0).all()
    element = hex8_stiffness(SIZE, GEL, "bbar")
    one, other = (PadSystem(m, element).stiffness for m in (plain, full))
    assert np.array_equal(one.data, other.data)
    assert np.array_equal(one.indices, other.indices)
    u = np.random.default_rng(0).normal(size=(len(plain.surface), 3))
    forces = [surface_operator(m, GEL, "bbar", "factor").force(u) for m in (plain, full)]
    # The forces of plain cells are summed in another order.
    np.testing.assert_allclose(*forces, rtol=1e-11, atol=1e-13)


def test_linear_fields_are_in_balance_inside_cut_pads():
    """Patch test: nodes whose cells are all full feel no force in a state of uniform strain."""
    mesh, _ = meshed(disc(3.03), weighting="volume_fraction")
    strain = np.array([[0.1, -0.05, 0.02], [0.03, 0.2, 0.01], [0.0, 0.04, -0.1]])
    element = hex8_stiffness(mesh.cell_size_mm, GEL, "bbar")
    force = elementwise_force(mesh, element, mesh.nodes_mm @ strain.T)
    cells = mesh.fill.transpose(2, 1, 0)[mesh.occupancy.transpose(2, 1, 0)]
    touched = np.zeros(mesh.n_nodes, dtype=bool)
    touched[mesh.hexes[cells < 1.0]] = True
    inner = ~touched
    for nodes in (mesh.bonded, mesh.surface, mesh.sides):
        inner[nodes] = False
    assert inner.sum() > 50
    assert np.abs(force[inner]).max() < 1e-13
    assert np.abs(force[touched]).max() > 1e-4


def test_cut_pads_are_symmetric_definite_and_rigid_motions_cost_nothing():
    mesh, _ = meshed(disc(2.03), weighting="volume_fraction", floor=1e-3)
    matrix = mesh_stiffness(mesh, hex8_stiffness(mesh.cell_size_mm, GEL, "bbar")).toarray()
    values = np.linalg.eigvalsh(matrix)
    assert np.abs(values[:6]).max() < 1e-12 < values[6]
    system = PadSystem(mesh, hex8_stiffness(mesh.cell_size_mm, GEL, "bbar"))
    assert np.linalg.eigvalsh(system.stiffness.toarray())[0] > 0.0


def resultants(outline, cells, weighting, layers):
    mesh, _ = build_pad_mesh(outline, 2.0, cells=(cells, cells, layers), weighting=weighting)
    operator = surface_operator(mesh, GEL, "bbar", "pcg", rtol=1e-7)
    down = operator.force(uniform(mesh, (0, 0, -0.1))).sum(axis=0)[2]
    along = operator.force(uniform(mesh, (0.1, 0, 0))).sum(axis=0)[0]
    return np.array([down, along])


@pytest.mark.parametrize("outline", [disc(4.0), RoundedRectangle(8.0, 7.0, 2.3)])
def test_volume_fractions_converge_steadily_where_cell_centres_jump(outline):
    """Scatter about the fitted line of log error against log pitch, and its slope."""
    counts = (8, 11, 13, 16, 19, 23)
    expected = resultants(outline, 48, "volume_fraction", 3)
    errors = {
        weighting: np.array(
            [np.abs(resultants(outline, n, weighting, 3) / expected - 1).max() for n in counts]
        )
        for weighting in ("cell_centre", "volume_fraction")
    }
    pitch = np.log(1.0 / np.array(counts))
    scatter = {}
    for weighting, error in errors.items():
        slope, offset = np.polyfit(pitch, np.log(error), 1)
        scatter[weighting] = np.std(np.log(error) - slope * pitch - offset)
        if weighting == "volume_fraction":
            assert slope > 0.9
    assert (np.diff(errors["volume_fraction"]) < 0).all()
    assert scatter["volume_fraction"] < 0.35 * scatter["cell_centre"]


@pytest.mark.parametrize("nu", [0.3, 0.45, 0.49])
def test_conjugate_gradients_manage_cut_cells(nu):
    gel = Material(0.147, nu, 1070.0)
    mesh, _ = build_pad_mesh(disc(6.0), 2.0, cells=(24, 24, 4), weighting="volume_fraction")
    system = PadSystem(mesh, hex8_stiffness(mesh.cell_size_mm, gel, "bbar"))
    load = np.random.default_rng(0).normal(size=system.stiffness.shape[0])
    found = pad_solver(system, "pcg").solve(load)
    assert found.iterations < 130
    assert found.x == pytest.approx(pad_solver(system, "direct").solve(load).x, rel=1e-4, abs=1e-4)


def test_a_factor_stands_in_where_iterations_fail():
    gel = Material(0.147, 0.4999, 1070.0)
    mesh, _ = build_pad_mesh(disc(6.0), 2.0, cells=(24, 24, 4), weighting="volume_fraction")
    system = PadSystem(mesh, hex8_stiffness(mesh.cell_size_mm, gel, "bbar"))
    load = np.random.default_rng(0).normal(size=system.inner.shape[0])
    found = inner_solver(system, "auto").solve(load, 1e-8)
    assert found.residual <= 1e-8


def test_the_paper_operator_of_a_cut_pad_is_its_stiffness():
    mesh, _ = meshed(disc(3.03), weighting="volume_fraction")
    flat = one_layer(mesh)
    assert flat.fill.shape == (*mesh.fill.shape[:2], 1)
    u = np.random.default_rng(1).normal(size=(len(flat.surface), 3))
    whole = np.zeros((flat.n_nodes, 3))
    whole[flat.surface] = u
    element = hex8_stiffness(flat.cell_size_mm, GEL, "full")
    expected = elementwise_force(flat, element, whole)[flat.surface]
    operator = surface_operator(mesh, GEL, "bbar", "paper")
    assert operator.force(u) == pytest.approx(expected, abs=1e-12)
    assert operator.n_bytes > 0


def test_the_infinite_pads_operators_keep_the_resultant():
    mesh, _ = build_pad_mesh(disc(6.03), 2.0, pitch_mm=0.5, layers=4, weighting="volume_fraction")
    point = mesh.nodes_mm[mesh.surface]
    u = 0.1 * np.exp(-((point[:, :2] - 1.0) ** 2).sum(axis=1) / 4)[:, None] * [0.3, 0.1, -1.0]
    expected = surface_operator(mesh, GEL, "bbar", "factor").force(u)
    for rung, options in (("truncated", {}), ("fft", {"lumped": True})):
        found = surface_operator(mesh, GEL, "bbar", rung, **options).force(u)
        assert found.sum(axis=0) == pytest.approx(expected.sum(axis=0), rel=1e-6)
        assert np.linalg.norm(found - expected) < 0.3 * np.linalg.norm(expected)


def test_fractions_belong_to_the_geometry():
    plain, _ = meshed(RoundedRectangle(6.0, 5.0))
    full, _ = meshed(RoundedRectangle(6.0, 5.0), weighting="volume_fraction")
    less, _ = meshed(RoundedRectangle(5.9, 5.0), weighting="volume_fraction", pitch_mm=None,
                     cells=(12, 12, 3))  # fmt: skip
    assert len({geometry_hash(m, None) for m in (plain, full, less)}) == 3


def test_what_cannot_be_meshed_is_refused():
    for options, field in (
        ({"weighting": "volume"}, "weighting"),
        ({"weighting": "volume_fraction", "floor": 0.0}, "floor"),
        ({"weighting": "volume_fraction", "floor": 1.1}, "floor"),
    ):
        with pytest.raises(MeshError) as caught:
            meshed(disc(3.0), **options)
        assert caught.value.field == field
    with pytest.raises(OutlineError) as refused:
        Paraboloid(math.nan, 3.0)
    assert refused.value.field == "crown_mm"
    mesh, _ = meshed(disc(3.03), weighting="volume_fraction")
    with pytest.raises(MeshError) as caught:
        NeoHookeanPad(mesh, GEL)
    assert caught.value.field == "mesh"


@pytest.mark.slow
def test_the_written_mesh_shows_the_fractions(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    mesh, _ = meshed(TRIANGLE, weighting="volume_fraction")
    write_vtu(tmp_path / "pad.vtu", mesh)
    grid = pyvista.read(tmp_path / "pad.vtu")
    volume = (grid.compute_cell_sizes()["Volume"] * grid["fill"]).sum()
    assert volume == pytest.approx(TRIANGLE.area_mm2 * 2.0, rel=5e-3)
