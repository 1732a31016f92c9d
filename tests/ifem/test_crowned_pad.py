"""Domed pads: where their surface lies, its stiffness, and how both converge."""

import numpy as np
import pytest
from ifem_bundles import edit, reseal
from ifem_shapes import Sphere, disc
from scipy import sparse

from ifem_export.assembly.assembly import mesh_stiffness
from ifem_export.bundle.bundle import build_bundle, geometry_hash
from ifem_export.bundle.files import load_bundle, write_bundle
from ifem_export.elements.hex8 import hex8_stiffness
from ifem_export.elements.material import Material
from ifem_export.errors import BundleError, MeshError
from ifem_export.mesh.crown import Paraboloid
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh
from ifem_export.operators.crowned_system import CrownedSystem, pad_system
from ifem_export.operators.ladder import measure_ladder, refined
from ifem_export.operators.pad_system import PadSystem
from ifem_export.operators.solver import pad_solver
from ifem_export.operators.surface_operator import surface_operator

GEL = Material(0.147, 0.3223, 1070.0)
DOME = Sphere(12.0)
WEIGHTINGS = ["cell_centre", "volume_fraction"]


class Level:
    """A flat surface below z = 0, wherever in a cell it falls."""

    def __init__(self, depth_mm):
        self.depth_mm = depth_mm

    def height_mm(self, x_mm, y_mm):
        return np.broadcast_arrays(x_mm, y_mm)[0] * 0.0 - self.depth_mm


def domed(weighting="volume_fraction", cells=(8, 9, 4), crown=DOME, **options):
    outline = RoundedRectangle(8.0, 7.0, 2.3)
    return build_pad_mesh(outline, 2.0, cells=cells, crown=crown, weighting=weighting, **options)[0]


def bump(points):
    square = ((points[:, :2] - [2.2, 1.1]) ** 2).sum(axis=1)
    return 0.1 * np.exp(-square / (2 * 1.5**2))[:, None] * [0.3, 0.2, -1.0]


def traced(mesh):
    """P (c, n): the lattice's own interpolation at the points of the surface, by coordinates."""
    rows = np.zeros((len(mesh.surface), mesh.n_nodes))
    nodes, hz = np.asarray(mesh.nodes_mm), mesh.cell_size_mm[2]
    for row, point in zip(rows, mesh.surface_mm, strict=True):
        column = np.flatnonzero(np.hypot(*(nodes[:, :2] - point[:2]).T) < 1e-9)
        row[column] = np.maximum(1.0 - np.abs(nodes[column, 2] - point[2]) / hz, 0.0)
    return rows


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_every_column_has_one_surface_node(weighting):
    mesh = domed(weighting)
    across = np.round(np.asarray(mesh.nodes_mm)[:, :2], 9)
    assert len(mesh.surface) == len(np.unique(across, axis=0)) == len(mesh.bonded)
    assert len(np.unique(across[mesh.surface], axis=0)) == len(mesh.surface)
    assert (np.diff(mesh.surface) > 0).all()
    assert len(np.unique(np.asarray(mesh.nodes_mm)[mesh.surface, 2])) > 1


def test_the_surface_lies_on_the_crown():
    mesh = domed(cells=(16, 14, 5))
    points = mesh.surface_mm
    gap = points[:, 2] - DOME.height_mm(points[:, 0], points[:, 1])
    inside = RoundedRectangle(8.0, 7.0, 2.3).contains(points[:, 0], points[:, 1])
    assert np.abs(gap[inside]).max() < 1e-12
    assert np.abs(mesh.surface_shift).max() <= 0.5
    assert (mesh.surface_shift > 0).any()
    assert (mesh.surface_shift < 0).any()


def test_by_cell_centres_the_surface_is_the_top_of_the_steps():
    mesh = domed("cell_centre", cells=(16, 14, 5))
    assert mesh.fill is None
    assert not mesh.surface_shift.any()
    nodes = np.asarray(mesh.nodes_mm)
    for node in mesh.surface:
        above = np.abs(nodes[:, :2] - nodes[node, :2]).max(axis=1) < 1e-9
        assert nodes[above, 2].max() == nodes[node, 2]
    centres = nodes[mesh.hexes].mean(axis=1)
    assert (centres[:, 2] <= DOME.height_mm(centres[:, 0], centres[:, 1]) + 1e-12).all()


@pytest.mark.parametrize("depth", [0.05, 0.3, 0.5, 0.62, 0.9])
@pytest.mark.parametrize(("way", "modulus"), [((0, 0, -0.1), 0.147), ((0.1, 0, 0), 0.147 / 2)])
def test_a_surface_anywhere_in_a_cell_has_its_columns_true_stiffness(depth, way, modulus):
    """Without lateral contraction and free of edges' bending: F = modulus · area / height · u.

    A shear of the whole pad is free of edge effects only where the sides carry no stress: their
    share falls with height over width and is far below the tolerance's 20 % for the lattice's top.
    """
    gel = Material(0.147, 0.0, 1070.0)
    outline = RoundedRectangle(8.0, 8.0)
    mesh, _ = build_pad_mesh(
        outline, 2.0, cells=(8, 8, 4), crown=Level(depth), weighting="volume_fraction", floor=1e-6
    )
    u = np.tile(np.asarray(way, dtype=float), (len(mesh.surface), 1))
    force = surface_operator(mesh, gel, "bbar", "factor").force(u).sum(axis=0)
    expected = modulus * 64.0 / (2.0 - depth) * np.asarray(way)
    if way[2]:
        assert force == pytest.approx(expected, abs=1e-12 + 1e-9 * np.abs(expected).max())
    else:
        low, _ = build_pad_mesh(outline, 2.0 - depth, cells=(8, 8, 4))
        flat = np.tile(np.asarray(way, dtype=float), (len(low.surface), 1))
        expected = surface_operator(low, gel, "bbar", "factor").force(flat).sum(axis=0)
        assert force[0] == pytest.approx(expected[0], rel=0.02)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
@pytest.mark.parametrize("nu", [0.3223, 0.49])
def test_forces_are_those_of_the_constrained_minimum(weighting, nu):
    """Least energy with the surface held, by a dense saddle point: an independent formulation."""
    gel = Material(0.147, nu, 1070.0)
    mesh = domed(weighting)
    whole = mesh_stiffness(mesh, hex8_stiffness(mesh.cell_size_mm, gel, "bbar")).toarray()
    held = (3 * mesh.bonded[:, None] + np.arange(3)).reshape(-1)
    free = np.setdiff1d(np.arange(3 * mesh.n_nodes), held)
    trace = np.kron(traced(mesh), np.eye(3))[:, free]
    n, c = len(free), len(trace)
    saddle = np.block([[whole[np.ix_(free, free)], trace.T], [trace, np.zeros((c, c))]])
    u = np.random.default_rng(3).normal(size=(c // 3, 3))
    solved = np.linalg.solve(saddle, np.concatenate([np.zeros(n), u.reshape(-1)]))
    expected = -solved[n:].reshape(-1, 3)
    reaction = (whole[np.ix_(held, free)] @ solved[:n]).reshape(-1, 3)
    for rung, options, tolerance in (
        ("factor", {}, 1e-9),
        ("pcg", {"rtol": 1e-10}, 1e-8),
        ("dense32", {}, 1e-5),
    ):
        operator = surface_operator(mesh, gel, "bbar", rung, **options)
        found = operator.force(u)
        assert np.abs(found - expected).max() < tolerance * np.abs(expected).max()
        assert found.sum(axis=0) == pytest.approx(-reaction.sum(axis=0), abs=1e-4)
        assert operator.displacement(expected) == pytest.approx(u, abs=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_equations_are_symmetric_and_definite(weighting):
    mesh = domed(weighting, floor=1e-3)
    system = pad_system(mesh, hex8_stiffness(mesh.cell_size_mm, GEL, "bbar"))
    assert isinstance(system, CrownedSystem)
    assert (system.stiffness != system.stiffness.T).nnz == 0
    assert np.linalg.eigvalsh(system.stiffness.toarray())[0] > 0.0
    size = system.stiffness.shape[0]
    guess = system.preconditioner
    columns = np.stack([guess(e.reshape(1, -1, 3)).reshape(-1) for e in np.eye(size)])
    assert columns == pytest.approx(columns.T, abs=1e-9 * np.abs(columns).max())
    assert np.linalg.eigvalsh((columns + columns.T) / 2)[0] > 0.0


def test_conjugate_gradients_manage_a_dome():
    mesh = domed(cells=(24, 21, 4))
    system = pad_system(mesh, hex8_stiffness(mesh.cell_size_mm, GEL, "bbar"))
    load = np.random.default_rng(0).normal(size=system.stiffness.shape[0])
    found = pad_solver(system, "pcg").solve(load)
    assert found.iterations < 60


def forces_of(weighting, cells, layers):
    mesh = domed(weighting, cells=(cells, cells, layers))
    operator = surface_operator(mesh, GEL, "bbar", "pcg", rtol=1e-7)
    moves = [np.tile(way, (len(mesh.surface), 1)) for way in ([0, 0, -0.1], [0.1, 0, 0])]
    return np.concatenate(
        [operator.force(u).sum(axis=0) for u in (*moves, bump(mesh.surface_mm))]
    ).reshape(3, 3)


@pytest.mark.slow
def test_volume_fractions_converge_faster_than_steps():
    expected = forces_of("volume_fraction", 40, 10)
    sizes = [(8, 3), (11, 4), (14, 5), (19, 6)]
    slopes = {}
    errors = {}
    for weighting in WEIGHTINGS:
        found = [forces_of(weighting, *size) for size in sizes]
        off = [np.linalg.norm(f - expected, axis=1) for f in found]
        errors[weighting] = np.array(off) / np.linalg.norm(expected, axis=1)
        pitch = np.log([1.0 / n for n, _ in sizes])
        slopes[weighting] = np.polyfit(pitch, np.log(errors[weighting].max(axis=1)), 1)[0]
    assert (errors["volume_fraction"] < 0.9 * errors["cell_centre"]).all()
    assert (errors["volume_fraction"][-1] < 0.5 * errors["cell_centre"][-1]).all()
    assert slopes["volume_fraction"] > 1.1
    assert slopes["volume_fraction"] > slopes["cell_centre"] + 0.2


def test_a_shallow_dome_gives_the_sum_of_its_columns():
    """A thin pad without lateral contraction is a bed of springs: F = ∫ E / h dA · u."""
    gel = Material(0.147, 0.0, 1070.0)
    crown, radius = Paraboloid(0.4, 10.0), 10.0
    mesh, _ = build_pad_mesh(
        disc(radius), 1.0, cells=(40, 40, 4), crown=crown, weighting="volume_fraction"
    )
    r = np.linspace(0.0, radius, 20001)
    exact = np.trapezoid(2 * np.pi * r * 0.147 / (1.0 + crown.height_mm(r, 0.0)), r)
    push = np.tile([0.0, 0.0, -1.0], (len(mesh.surface), 1))
    found = -surface_operator(mesh, gel, "bbar", "pcg").force(push).sum(axis=0)[2]
    assert found == pytest.approx(exact, rel=0.01)
    flat = 0.147 * np.pi * radius**2 / 1.0
    assert exact > 1.2 * flat


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_bundles_of_crowned_pads_come_back(weighting, tmp_path):
    mesh = domed(weighting)
    markers = np.stack(np.meshgrid(np.arange(-3, 4.0), np.arange(-2, 3.0)), -1).reshape(-1, 2)
    made = build_bundle(mesh, GEL, "bbar", marker_positions_mm=markers)
    write_bundle(tmp_path / "crowned", made)
    back = load_bundle(tmp_path / "crowned")
    assert np.array_equal(back.mesh.surface_shift, mesh.surface_shift)
    assert np.array_equal(back.mesh.surface, mesh.surface)
    assert (back.mesh.fill is None) == (weighting == "cell_centre")
    u = bump(mesh.surface_mm)
    expected = made.surface_operator("factor").force(u)
    assert np.array_equal(back.surface_operator("factor").force(u), expected)
    flat, _ = build_pad_mesh(RoundedRectangle(8.0, 7.0, 2.3), 2.0, cells=(8, 7, 4))
    assert geometry_hash(mesh, None) != geometry_hash(flat, None)


@pytest.mark.parametrize(
    ("name", "change", "file"),
    [
        ("surface_shift", lambda a: a + 0.6, "surface_shift.npy"),
        ("surface_shift", lambda a: np.full_like(a, np.nan), "surface_shift.npy"),
        ("surface_shift", lambda a: a * 0.5, "manifest.json"),
        ("surface_nodes", lambda a: a[::-1].copy(), "surface_nodes.npy"),
        ("surface_nodes", lambda a: np.full_like(a, a[0]), "surface_nodes.npy"),
        ("cell_fill", lambda a: a * 0.0, "cell_fill.npy"),
        ("cell_fill", lambda a: a * 2.0, "cell_fill.npy"),
        ("cell_fill", lambda a: a * 0.9, "self_test_force_n.npy"),
    ],
)
def test_a_damaged_crown_is_refused(name, change, file, tmp_path):
    write_bundle(tmp_path / "bad", build_bundle(domed(), GEL, "bbar"))
    edit(tmp_path / "bad", name, change)
    reseal(tmp_path / "bad")
    with pytest.raises(BundleError) as caught:
        load_bundle(tmp_path / "bad")
    assert caught.value.file == file


@pytest.mark.slow
def test_the_ladder_of_a_dome_has_the_exact_rungs():
    mesh = domed(cells=(10, 9, 4))
    fine = build_pad_mesh(
        RoundedRectangle(8.0, 7.0, 2.3), 2.0, crown=DOME, layers=8, weighting="volume_fraction",
        pitch_mm=tuple(h / 2 for h in mesh.cell_size_mm[:2]),
        align_to_mm=mesh.nodes_mm[mesh.surface[:1]],
    )[0]  # fmt: skip
    ladder = measure_ladder(mesh, GEL, "bbar", reference=fine)
    assert {r.rung for r in ladder.rungs} == {"pcg", "factor"}
    best = min(ladder.rungs, key=lambda r: r.error_field)
    assert best.error_operator < 1e-3
    assert best.error_field < 0.15
    assert best.error_resultant < 0.05
    with pytest.raises(MeshError) as caught:
        refined(mesh)
    assert caught.value.field == "reference"


def test_what_needs_one_thickness_says_so():
    mesh = domed()
    for rung in ("paper", "truncated", "fft"):
        with pytest.raises(MeshError) as caught:
            surface_operator(mesh, GEL, "bbar", rung)
        assert (caught.value.field, caught.value.value) == ("rung", rung)
    with pytest.raises(MeshError) as caught:
        PadSystem(mesh, hex8_stiffness(mesh.cell_size_mm, GEL, "bbar"))
    assert caught.value.field == "mesh"
    for options, field in (({"cells": (8, 7, 1)}, "layers"), ({"crown": Level(-0.1)}, "crown")):
        with pytest.raises(MeshError) as caught:
            domed(**options)
        assert caught.value.field == field


def test_columns_with_gaps_have_no_surface():
    cells = np.ones((3, 3, 4), dtype=bool)
    cells[1, 1, 2:] = False
    pad = PadMesh.from_occupancy(cells, (1.0, 1.0, 1.0), (0.0, 0.0, -4.0))
    assert pad.crowned(None).nodes_mm[pad.crowned(None).surface, 2].tolist() == [0.0] * 16
    cells[1, 1, 3] = True
    gap = PadMesh.from_occupancy(cells, (1.0, 1.0, 1.0), (0.0, 0.0, -4.0))
    with pytest.raises(MeshError) as caught:
        gap.crowned(None)
    assert caught.value.field == "occupancy"


def test_the_trace_of_the_test_is_a_partition_of_one():
    rows = traced(domed())
    assert rows.sum(axis=1) == pytest.approx(np.ones(len(rows)))
    assert sparse.csr_array(rows).nnz > len(rows)


@pytest.mark.slow
@pytest.mark.parametrize("nu", [0.45, 0.4999])
def test_thin_cells_under_a_crown_are_solved_for_a_nearly_incompressible_gel(nu):
    """Conjugate gradients give up here, and a factor takes their place."""
    mesh = build_pad_mesh(
        RoundedRectangle(14.0, 12.0, 2.3), 2.0, cells=(24, 24, 6), crown=Sphere(40.0),
        weighting="volume_fraction",
    )[0]  # fmt: skip
    force = np.zeros((len(mesh.surface), 3))
    force[len(force) // 2] = [0.03, 0.0, -0.1]
    iterated, factored = (
        surface_operator(mesh, Material(0.147, nu, 1020.0), "bbar", rung).displacement(force)
        for rung in ("pcg", "factor")
    )
    np.testing.assert_allclose(iterated, factored, atol=1e-6 * np.abs(factored).max())
