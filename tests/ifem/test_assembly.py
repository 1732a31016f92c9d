import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from ifem_oracle import random_occupancy, rigid_modes, triplet_assembly
from ifem_shapes import disc
from sampled import quick
from scipy import sparse
from scipy.sparse.linalg import spsolve

import ifem_export
from ifem_export.assembly.assembly import assemble_csr, block_pattern
from ifem_export.elements.hex8 import FORMULATIONS, hex8_stiffness
from ifem_export.elements.material import Material
from ifem_export.errors import MeshError
from ifem_export.mesh.lattice import number_nodes
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh

SIZE = (0.5, 0.7, 0.4)
ROOT = Path(ifem_export.__file__).parents[1]


def pad(occupancy, size=SIZE):
    return PadMesh.from_occupancy(occupancy, size, (0.0, 0.0, 0.0))


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("fill", [0.15, 0.5, 0.9])
def test_agrees_with_triplets_on_random_crops(gel, seed, fill):
    occupancy = random_occupancy(seed, (6, 5, 4), fill)
    Ke = hex8_stiffness(SIZE, gel, "bbar")
    reference = triplet_assembly(pad(occupancy), Ke)
    K = assemble_csr(occupancy, Ke)
    assert K.shape == reference.shape
    assert np.array_equal(K.indptr, reference.indptr)
    assert np.array_equal(K.indices, reference.indices)
    assert np.abs(K.data - reference.data).max() <= 1e-14 * np.abs(reference.data).max()
    indptr, indices = block_pattern(pad(occupancy).numbering)
    blocks = reference.tobsr((3, 3))
    blocks.sort_indices()
    assert np.array_equal(indptr, blocks.indptr)
    assert np.array_equal(indices, blocks.indices)


@pytest.mark.parametrize("shape", [(1, 1, 1), (42, 42, 1), (1, 7, 2), (3, 1, 1)])
def test_agrees_with_triplets_on_full_boxes(gel, shape):
    occupancy = np.ones(shape, dtype=bool)
    Ke = hex8_stiffness(SIZE, gel, "full")
    difference = assemble_csr(occupancy, Ke) - triplet_assembly(pad(occupancy), Ke)
    assert np.abs(difference.data).max(initial=0.0) <= 1e-14 * Ke.max()


def test_agrees_with_scikit_fem(gel, round_pad):
    skfem = pytest.importorskip(
        "skfem", reason="scikit-fem is not installed: K is NOT checked against another library"
    )
    from skfem.helpers import ddot, eye, sym_grad, trace

    # scikit-fem's reference hexahedron has its own corner order: find each by its position.
    reference = skfem.MeshHex.init_refdom().p.T
    corner = {(0, 0, 0): 0, (1, 0, 0): 1, (1, 1, 0): 2, (0, 1, 0): 3}
    corner |= {(x, y, 1): a + 4 for (x, y, _), a in list(corner.items())}
    order = [corner[tuple(int(v) for v in p)] for p in reference]
    mesh = skfem.MeshHex(
        np.ascontiguousarray(round_pad.nodes_mm.T),
        np.ascontiguousarray(round_pad.hexes[:, order].T.astype(np.int64)),
    )
    assert np.array_equal(mesh.p.T, round_pad.nodes_mm)
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex1()), intorder=4)
    lam, g = gel.lame_lambda_mpa, gel.shear_modulus_mpa

    @skfem.BilinearForm
    def elasticity(u, v, _):
        strain = sym_grad(u)
        return ddot(2.0 * g * strain + lam * eye(trace(strain), 3), sym_grad(v))

    unknown = basis.nodal_dofs.T.ravel()
    theirs = sparse.csr_array(elasticity.assemble(basis))[unknown][:, unknown]
    ours = assemble_csr(round_pad.occupancy, hex8_stiffness(round_pad.cell_size_mm, gel, "full"))
    assert np.abs((ours - theirs).toarray()).max() <= 1e-12 * np.abs(ours.data).max()


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_symmetric_to_the_bit_and_sorted(gel, round_pad, formulation):
    K = assemble_csr(round_pad.occupancy, hex8_stiffness(round_pad.cell_size_mm, gel, formulation))
    transposed = K.T.tocsr()
    transposed.sort_indices()
    assert np.array_equal(K.indptr, transposed.indptr)
    assert np.array_equal(K.indices, transposed.indices)
    assert np.array_equal(K.data, transposed.data)
    fresh = sparse.csr_array((K.data, K.indices, K.indptr), shape=K.shape)
    assert fresh.has_canonical_format


@pytest.mark.parametrize("nu", [0.3223, 0.49])
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_connected_pad_has_six_rigid_modes_and_is_otherwise_definite(formulation, nu):
    mesh, _ = build_pad_mesh(disc(2.0), 1.0, pitch_mm=(0.7, 0.8), layers=2)
    Ke = hex8_stiffness(mesh.cell_size_mm, Material(0.147, nu, 1.0), formulation)
    K = assemble_csr(mesh.occupancy, Ke)
    values = np.linalg.eigvalsh(K.toarray())
    assert np.abs(values[:6]).max() < 1e-12 * values[-1]
    assert values[6] > 1e-6 * values[-1]
    modes = rigid_modes(mesh.nodes_mm)
    assert np.abs(K @ modes).max() < 1e-12 * np.abs(K.data).max() * np.abs(modes).max()


def test_cells_joined_at_an_edge_have_a_seventh_zero_mode(gel):
    """Why the crop drops them: the hinge costs no energy."""
    occupancy = np.zeros((2, 2, 1), dtype=bool)
    occupancy[0, 0, 0] = occupancy[1, 1, 0] = True
    K = assemble_csr(occupancy, hex8_stiffness(SIZE, gel, "full")).toarray()
    values = np.linalg.eigvalsh(K)
    assert (np.abs(values) < 1e-12 * values[-1]).sum() == 7


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("seed", range(4))
def test_patch_test_on_an_irregular_crop(gel, formulation, seed):
    """A linear field needs exactly the constant stress's tractions, and nothing inside."""
    occupancy = random_occupancy(seed, (6, 5, 4), 0.75)
    mesh = pad(occupancy)
    gradient = np.random.default_rng(seed).normal(size=(3, 3))
    u = mesh.nodes_mm @ gradient.T + [0.1, -0.2, 0.3]
    K = assemble_csr(occupancy, hex8_stiffness(SIZE, gel, formulation))
    F = (K @ u.ravel()).reshape(-1, 3)
    strain = (gradient + gradient.T) / 2.0
    stress = 2 * gel.shear_modulus_mpa * strain
    stress += gel.lame_lambda_mpa * np.trace(strain) * np.eye(3)

    expected = np.zeros_like(F)
    padded = np.pad(occupancy, 1)
    node_index = mesh.numbering.node_index.reshape(mesh.numbering.shape)
    for i, j, k in np.argwhere(occupancy):
        for axis in range(3):
            for end in (0, 1):
                there = [i + 1, j + 1, k + 1]
                there[axis] += 2 * end - 1
                if padded[tuple(there)]:
                    continue
                area = np.prod(SIZE) / SIZE[axis]
                pull = (2 * end - 1) * stress[:, axis] * area / 4.0
                for p in (0, 1):
                    for q in (0, 1):
                        at = [p, q]
                        at.insert(axis, end)
                        expected[node_index[k + at[2], j + at[1], i + at[0]]] += pull
    scale = np.abs(stress).max() * max(SIZE) ** 2
    assert np.abs(F - expected).max() < 1e-13 * scale * 10
    interior = np.bincount(mesh.hexes.ravel(), minlength=mesh.n_nodes) == 8
    assert interior.any()
    assert np.abs(F[interior]).max() < 1e-13 * scale * 10


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_uniform_compression_gives_the_constrained_modulus(gel, round_pad, formulation):
    """Bonded pad pressed 5 % with its sides held: F_z = M ε A."""
    strain = -0.05
    u = np.zeros((round_pad.n_nodes, 3))
    u[:, 2] = strain * (round_pad.nodes_mm[:, 2] + 1.4)
    K = assemble_csr(round_pad.occupancy, hex8_stiffness(round_pad.cell_size_mm, gel, formulation))
    F = (K @ u.ravel()).reshape(-1, 3)
    hx, hy, _ = round_pad.cell_size_mm
    area = round_pad.occupancy[:, :, 0].sum() * hx * hy
    top = F[round_pad.surface].sum(axis=0)
    assert top[2] == pytest.approx(
        (gel.lame_lambda_mpa + 2 * gel.shear_modulus_mpa) * strain * area, rel=1e-12
    )
    assert np.abs(top[:2]).max() < 1e-12


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_simple_shear_gives_the_shear_modulus(gel, round_pad, formulation):
    gamma = 0.03
    u = np.zeros((round_pad.n_nodes, 3))
    u[:, 0] = gamma * (round_pad.nodes_mm[:, 2] + 1.4)
    K = assemble_csr(round_pad.occupancy, hex8_stiffness(round_pad.cell_size_mm, gel, formulation))
    F = (K @ u.ravel()).reshape(-1, 3)
    hx, hy, _ = round_pad.cell_size_mm
    area = round_pad.occupancy[:, :, 0].sum() * hx * hy
    assert F[round_pad.surface, 0].sum() == pytest.approx(
        gel.shear_modulus_mpa * gamma * area, rel=1e-12
    )
    assert F[round_pad.bonded, 0].sum() == pytest.approx(-F[round_pad.surface, 0].sum(), rel=1e-12)


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("axis", quick([0, 1, 2], lambda axis: axis == 1))
def test_mirror_image_of_a_crop(gel, formulation, axis):
    occupancy = random_occupancy(7, (4, 3, 3), 0.6)
    mirrored = np.ascontiguousarray(np.flip(occupancy, axis))
    Ke = hex8_stiffness(SIZE, gel, formulation)
    unknown = _mapped_unknowns(occupancy, mirrored, lambda p: _flip(p, axis, occupancy.shape))
    sign = np.tile(np.where(np.arange(3) == axis, -1.0, 1.0), len(unknown) // 3)
    K = assemble_csr(occupancy, Ke).toarray()
    image = assemble_csr(mirrored, Ke).toarray()[np.ix_(unknown, unknown)]
    assert image * np.outer(sign, sign) == pytest.approx(K, rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize(
    "order", quick([(1, 0, 2), (2, 1, 0), (1, 2, 0)], lambda order: order == (1, 2, 0))
)
def test_axis_permutation_of_a_crop(gel, formulation, order):
    occupancy = random_occupancy(8, (4, 3, 2), 0.6)
    turned = np.ascontiguousarray(occupancy.transpose(order))
    unknown = _mapped_unknowns(occupancy, turned, lambda p: p[list(order)])
    within = [order.index(i) for i in range(3)]
    unknown = (unknown.reshape(-1, 3)[:, within]).ravel()
    K = assemble_csr(occupancy, hex8_stiffness(SIZE, gel, formulation)).toarray()
    size = tuple(SIZE[i] for i in order)
    image = assemble_csr(turned, hex8_stiffness(size, gel, formulation)).toarray()
    assert image[np.ix_(unknown, unknown)] == pytest.approx(K, rel=1e-12, abs=1e-15)


def _flip(point, axis, shape):
    flipped = point.copy()
    flipped[axis] = shape[axis] - point[axis]
    return flipped


def _mapped_unknowns(source, image, move):
    """Unknowns of the image that correspond to those of the source, node by node."""
    of, to = number_nodes(source), number_nodes(image)
    lookup = to.node_index.reshape(to.shape)
    found = []
    for position in of.positions:
        k, j, i = np.unravel_index(position, of.shape)
        x, y, z = move(np.array([i, j, k]))
        node = lookup[z, y, x]
        assert node >= 0
        found += [3 * node, 3 * node + 1, 3 * node + 2]
    return np.array(found)


def test_bbar_relieves_locking_from_two_layers_on():
    """Local press of a bonded pad at ν = 0.49, held against eight B-bar layers."""
    soft = Material(0.147, 0.49, 1.0)

    def resultant(layers, formulation):
        mesh, _ = build_pad_mesh(disc(4.0), 2.0, pitch_mm=0.8, layers=layers)
        K = assemble_csr(mesh.occupancy, hex8_stiffness(mesh.cell_size_mm, soft, formulation))
        r = np.hypot(mesh.nodes_mm[:, 0], mesh.nodes_mm[:, 1])
        pressed = np.intersect1d(mesh.surface, np.flatnonzero(r < 1.5))
        fixed = np.zeros((mesh.n_nodes, 3), dtype=bool)
        fixed[mesh.bonded] = True
        fixed[pressed] = True
        u = np.zeros((mesh.n_nodes, 3))
        u[pressed, 2] = -0.1
        free = np.flatnonzero(~fixed.ravel())
        flat = u.ravel()
        flat[free] = spsolve(K[free][:, free].tocsc(), -(K @ flat)[free])
        return (K @ flat).reshape(-1, 3)[pressed, 2].sum()

    reference = resultant(8, "bbar")
    error = {(n, f): abs(resultant(n, f) / reference - 1.0) for n in (2, 4) for f in FORMULATIONS}
    for layers in (2, 4):
        assert abs(resultant(layers, "bbar")) < abs(resultant(layers, "full"))
        assert error[layers, "bbar"] < error[layers, "full"]
    assert error[4, "bbar"] < error[2, "bbar"]


def test_threads_give_the_same_bits(gel):
    occupancy = random_occupancy(3, (20, 15, 4), 0.8)
    Ke = hex8_stiffness(SIZE, gel, "bbar")
    one, seven = (assemble_csr(occupancy, Ke, threads=n) for n in (1, 7))
    for name in ("indptr", "indices", "data"):
        assert np.array_equal(getattr(one, name), getattr(seven, name))


@pytest.mark.parametrize(
    ("occupancy", "element", "options", "field"),
    [
        (np.zeros((2, 2, 2), dtype=bool), np.eye(24), {}, "occupancy"),
        (np.ones((2, 2, 2)), np.eye(24), {}, "occupancy"),
        (np.ones((2, 2, 2), dtype=bool), np.eye(12), {}, "element_matrix"),
        (np.ones((2, 2, 2), dtype=bool), np.full((24, 24), np.nan), {}, "element_matrix"),
        (np.ones((2, 2, 2), dtype=bool), np.eye(24), {"threads": 0}, "threads"),
    ],
)
def test_bad_input_is_refused(occupancy, element, options, field):
    with pytest.raises(MeshError) as caught:
        assemble_csr(occupancy, element, **options)
    assert caught.value.field == field


def test_importing_the_package_loads_neither_numba_nor_vtk_nor_cad():
    code = (
        "import sys, ifem_export.bundle.files, ifem_export.mesh.vtu;"
        "print([m for m in ('numba', 'vtk', 'vtkmodules', 'pyvista', 'OCP', 'cadquery',"
        " 'gelslim_cad', 'matplotlib') if m in sys.modules])"
    )
    out = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert out.stdout.strip() == "[]"
