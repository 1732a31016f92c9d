"""Mesh and surface matrices of a bundle, read back by small readers of their own or by meshio."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ifem_bundles import make_bundle
from numpy.typing import NDArray
from scipy.io import loadmat

from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.elements.material import Material
from ifem_export.errors import IfemError
from ifem_export.exports.export import ExportOptions, export_bundle, export_options
from ifem_export.exports.solid_mesh import solid_mesh
from ifem_export.exports.solver_files import export_mesh
from ifem_export.exports.surface_matrices import export_surface_matrix
from ifem_export.mesh.crown import Paraboloid
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh

GEL = Material(0.147, 0.3223, 1020.0)
CROWN = Paraboloid(0.6, 3.9)


def small_bundle() -> Bundle:
    return make_bundle(GEL)


def crowned_bundle() -> Bundle:
    outline = RoundedRectangle(6.0, 5.0, 0.0)
    mesh, _ = build_pad_mesh(
        outline, 2.0, pitch_mm=1.0, layers=4, crown=CROWN, weighting="volume_fraction"
    )
    return build_bundle(mesh, GEL, "bbar", spec_hash="5pec")


def blocks_of(path: Path) -> dict[str, list[str]]:
    """Data lines of an input file by their keyword line; continued lines joined."""
    blocks: dict[str, list[str]] = {}
    name = ""
    for line in path.read_text(encoding="ascii").splitlines():
        assert len(line) < 256
        if line.startswith("*"):
            name = line
            assert name not in blocks
            blocks[name] = []
        elif blocks[name] and blocks[name][-1].endswith(","):
            blocks[name][-1] += line
        else:
            blocks[name].append(line)
    return blocks


def numbers(lines: list[str]) -> NDArray[np.float64]:
    return np.array([[float(word) for word in line.split(",")] for line in lines])


@pytest.mark.parametrize(("element", "corners"), [("C3D8", 8), ("C3D20", 20)])
def test_an_input_file_has_nodes_cells_and_sets(tmp_path: Path, element: str, corners: int) -> None:
    bundle, path = small_bundle(), tmp_path / "pad.inp"
    export_bundle(bundle, path, export_options(path, element=element))
    blocks = blocks_of(path)
    nodes = numbers(blocks["*NODE, NSET=ALL"])
    n = bundle.mesh.n_nodes
    np.testing.assert_array_equal(nodes[:, 0], np.arange(len(nodes)) + 1)
    np.testing.assert_allclose(nodes[:n, 1:], bundle.mesh.nodes_mm, rtol=1e-12, atol=1e-15)
    cells = numbers(blocks[f"*ELEMENT, TYPE={element}, ELSET=PAD"]).astype(int)
    assert cells.shape == (bundle.mesh.n_elements, 1 + corners)
    np.testing.assert_array_equal(cells[:, 1:9] - 1, bundle.mesh.hexes)
    bonded = [int(w) for line in blocks["*NSET, NSET=BONDED"] for w in line.split(",")]
    low = nodes[:, 3] == nodes[:, 3].min()
    np.testing.assert_array_equal(np.array(bonded) - 1, np.flatnonzero(low))


def test_no_number_is_longer_than_calculix_reads(tmp_path: Path) -> None:
    path = tmp_path / "pad.inp"
    export_mesh(small_bundle(), path)
    words = [w for line in path.read_text("ascii").splitlines()[2:] for w in line.split(", ")]
    assert max(len(word) for word in words if not word.startswith("*")) <= 20


def test_middle_nodes_halve_their_edges() -> None:
    """The polynomial of a C3D20 gives a linear field exactly: its middles lie between corners."""
    mesh = solid_mesh(small_bundle().mesh, "C3D20")
    assert len(np.unique(mesh.nodes_mm.round(9), axis=0)) == len(mesh.nodes_mm)
    ends = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4),
            (0, 4), (1, 5), (2, 6), (3, 7)]  # fmt: skip
    places = mesh.nodes_mm[mesh.cells]
    for middle, (a, b) in enumerate(ends, 8):
        np.testing.assert_allclose(places[:, middle], (places[:, a] + places[:, b]) / 2, atol=1e-12)
    assert np.ptp(mesh.nodes_mm[mesh.sets["SURFACE"], 2]) == 0.0


def test_the_neo_hookean_constants_give_the_small_strain_moduli(tmp_path: Path) -> None:
    path = tmp_path / "pad.inp"
    export_mesh(small_bundle(), path, law="neo_hookean")
    ((c10, d1),) = numbers(blocks_of(path)["*HYPERELASTIC, NEO HOOKE"])
    shear, bulk = 2 * c10, 2 / d1
    assert 9 * bulk * shear / (3 * bulk + shear) == pytest.approx(0.147, rel=1e-12)
    assert (3 * bulk - 2 * shear) / (6 * bulk + 2 * shear) == pytest.approx(0.3223, rel=1e-9)


def test_cut_cells_keep_their_share_of_the_stiffness(tmp_path: Path) -> None:
    outline = RoundedRectangle(6.0, 5.0, 2.0)
    mesh, _ = build_pad_mesh(outline, 1.0, pitch_mm=0.7, layers=2, weighting="volume_fraction")
    bundle, path = build_bundle(mesh, GEL, "full", spec_hash="5pec"), tmp_path / "pad.inp"
    export_mesh(bundle, path)
    text = path.read_text("ascii").split("*ELSET, ELSET=")[1:]
    share = np.zeros(mesh.n_elements)
    for block in text:
        members, _, rest = block.partition("*MATERIAL")
        cells = [int(w) for line in members.splitlines()[1:] for w in line.split(",")]
        modulus = float(rest.split("*ELASTIC\n")[1].split(",")[0])
        share[np.array(cells) - 1] = modulus / 0.147
    assert mesh.fill is not None
    by_cell = mesh.fill[tuple(cells_at(mesh.nodes_mm, mesh.hexes, mesh).T)]
    np.testing.assert_allclose(share, by_cell, rtol=1e-11)
    assert (share < 1).any()


def cells_at(nodes: NDArray[np.float64], hexes: NDArray[np.int32], mesh) -> NDArray[np.int64]:
    """Place of each cell in the lattice, from its centre."""
    centres = nodes[hexes].mean(axis=1) - np.array(mesh.origin_mm)
    return np.floor(centres / np.array(mesh.cell_size_mm)).astype(int)


@pytest.mark.parametrize("element", ["C3D8", "C3D20"])
def test_gmsh_groups_are_the_faces_of_the_pad(tmp_path: Path, element: str) -> None:
    meshio = pytest.importorskip("meshio", reason="MESHIO NOT INSTALLED: the .msh was not read")
    bundle, path = small_bundle(), tmp_path / "pad.msh"
    export_bundle(bundle, path, export_options(path, element=element))
    read = meshio.read(path)
    kind = "hexahedron" if element == "C3D8" else "hexahedron20"
    mesh = solid_mesh(bundle.mesh, element)  # type: ignore[arg-type]
    np.testing.assert_array_equal(read.cells_dict[kind], mesh.cells)
    quads, groups = read.cells_dict["quad"], read.cell_data_dict["gmsh:physical"]["quad"]
    heights = read.points[quads][:, :, 2]
    assert np.ptp(heights[groups == read.field_data["SURFACE"][0]]) == 0.0
    area = bundle.mesh.cell_size_mm[0] * bundle.mesh.cell_size_mm[1]
    for name, sign in (("BONDED", -1), ("SURFACE", 1)):
        found = read.points[quads[groups == read.field_data[name][0]]]
        normal = np.cross(found[:, 1] - found[:, 0], found[:, 3] - found[:, 0])
        np.testing.assert_allclose(normal, [[0, 0, sign * area]] * len(found), atol=1e-12)


@pytest.mark.parametrize("make", [small_bundle, crowned_bundle])
def test_surface_matrices_are_those_of_the_operator(make, tmp_path: Path) -> None:
    bundle = make()
    export_surface_matrix(bundle, tmp_path / "s.npz", "surface_stiffness")
    export_surface_matrix(bundle, tmp_path / "c.mat", "surface_compliance")
    stiffness = np.load(tmp_path / "s.npz")
    compliance = loadmat(tmp_path / "c.mat")
    points = stiffness["nodes_mm"]
    np.testing.assert_array_equal(points, compliance["nodes_mm"])
    u = 1e-3 * np.random.default_rng(7).normal(size=points.shape)
    rung = "paper" if bundle.mesh.layers == 1 else "factor"
    force = bundle.surface_operator(rung).force(u)
    largest = np.abs(force).max()
    found = (stiffness["surface_stiffness"] @ u.ravel()).reshape(-1, 3)
    np.testing.assert_allclose(found, force, atol=1e-8 * largest)
    back = (compliance["surface_compliance"] @ force.ravel()).reshape(-1, 3)
    np.testing.assert_allclose(back, u, atol=1e-9)


def test_points_of_a_crown_lie_on_it() -> None:
    from ifem_export.exports.surface_matrices import surface_points_mm

    points = surface_points_mm(crowned_bundle())
    np.testing.assert_allclose(points[:, 2], CROWN.height_mm(points[:, 0], points[:, 1]), atol=1e-9)


@pytest.mark.parametrize(
    ("name", "options", "field"),
    [
        ("k.xyz", {}, "path"),
        ("k.npz", {}, "matrix"),
        ("k.mtx", {"matrix": "surface_stiffness"}, "matrix"),
        ("k.mat", {"matrix": "inverse"}, "matrix"),
        ("k.mat", {"element": "C3D8"}, "element"),
        ("k.inp", {"element": "C3D4"}, "element"),
        ("k.msh", {"law": "linear"}, "law"),
        ("k.inp", {"law": "ogden"}, "law"),
    ],
)
def test_options_that_do_not_belong_are_refused(
    name: str, options: dict[str, str], field: str
) -> None:
    with pytest.raises(IfemError) as caught:
        export_options(name, **options)
    assert caught.value.field == field


def test_the_default_of_mat_is_the_whole_pad(tmp_path: Path) -> None:
    assert export_options("k.mat") == ExportOptions()
    export_bundle(small_bundle(), tmp_path / "k.mat", ExportOptions())
    assert "stiffness" in loadmat(tmp_path / "k.mat")
