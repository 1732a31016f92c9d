"""The equations of flat, cut and crowned pads against slices of the complete stiffness matrix."""

from __future__ import annotations

import numpy as np
import pytest
from ifem_shapes import Polygon, Sphere

from ifem_export.assembly.assembly import mesh_stiffness
from ifem_export.elements.hex8 import hex8_stiffness
from ifem_export.elements.material import Material
from ifem_export.errors import IfemError
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh
from ifem_export.operators.adjoint_fields import adjoint_fields
from ifem_export.operators.condensed_operators import (
    CondensedOperator,
    DenseOperator,
    PaperOperator,
)
from ifem_export.operators.convolved_operator import ConvolvedOperator, missing_resultant
from ifem_export.operators.crowned_system import CrownedSystem, pad_system
from ifem_export.operators.layer_coupling import AssembledCoupling, LayerCoupling, coupling
from ifem_export.operators.layered_operator import (
    LayeredOperator,
    inner_compliance,
    inverse,
    layered_operator,
    padding_columns,
    surface_compliance,
    surface_stiffness,
)
from ifem_export.operators.pad_system import PadSystem, checked_field, node_weight
from ifem_export.operators.preconditioner import (
    EmbeddedPreconditioner,
    MirroredOperator,
    ScaledPreconditioner,
    mirrored_operator,
)
from ifem_export.operators.solver import (
    ConjugateGradients,
    GradientsThenFactor,
    SparseFactor,
    inner_solver,
    pad_solver,
)

GEL = Material(0.147, 0.3223, 1070.0)
OUTLINE = Polygon([(-2.6, -1.9), (2.6, -1.9), (2.6, 0.4), (0.3, 0.4), (0.3, 1.9), (-2.6, 1.9)])


def flat(weighting: str = "cell_centre", layers: int = 3) -> PadMesh:
    return build_pad_mesh(
        OUTLINE, 1.2, pitch_mm=(0.8, 0.6), layers=layers, weighting=weighting
    )[0]  # fmt: skip


def domed() -> PadMesh:
    outline = RoundedRectangle(5.0, 4.4, 1.3)
    return build_pad_mesh(
        outline, 2.0, cells=(6, 7, 4), crown=Sphere(6.0), weighting="volume_fraction"
    )[0]  # fmt: skip


def element(mesh: PadMesh) -> np.ndarray:
    return hex8_stiffness(mesh.cell_size_mm, GEL, "bbar")


def components(nodes: np.ndarray) -> np.ndarray:
    return (3 * np.asarray(nodes)[:, None] + np.arange(3)).reshape(-1)


@pytest.mark.parametrize("weighting", ["cell_centre", "volume_fraction"])
@pytest.mark.parametrize("layers", [1, 3])
def test_blocks_are_those_of_the_free_nodes(weighting: str, layers: int) -> None:
    mesh = flat(weighting, layers)
    system = PadSystem(mesh, element(mesh))
    whole = mesh_stiffness(mesh, element(mesh)).toarray()
    surface = components(mesh.surface)
    inner = components(np.setdiff1d(mesh.free, mesh.surface))
    assert (system.layers, system.columns) == (layers, len(mesh.surface))
    assert system.is_cut == (weighting == "volume_fraction")
    assert system.preconditioner_layers == (layers, layers - 1)
    free = components(mesh.free)
    for found, rows, columns in (
        (system.stiffness, free, free),
        (system.inner, inner, inner),
        (system.surface, surface, surface),
        (system.inner_to_surface, surface, inner),
        (system.surface_to_inner, inner, surface),
    ):
        assert np.array_equal(found.toarray(), whole[np.ix_(rows, columns)])
    at = np.asarray(mesh.nodes_mm)[mesh.surface][:, [1, 0]] - np.array(mesh.origin_mm)[[1, 0]]
    expected = at / np.array(mesh.cell_size_mm)[[1, 0]]
    assert system.lattice_positions == pytest.approx(expected, abs=1e-9)


def test_the_weight_of_a_node_is_that_of_its_mean_fill() -> None:
    mesh = flat("volume_fraction")
    fill, count = np.zeros(mesh.n_nodes), np.zeros(mesh.n_nodes)
    cells = np.asarray(mesh.fill).transpose(2, 1, 0)[mesh.occupancy.transpose(2, 1, 0)]
    for nodes, part in zip(mesh.hexes, cells, strict=True):
        fill[nodes] += part
        count[nodes] += 1
    assert (fill < count).any()
    assert node_weight(mesh) == pytest.approx((fill / count) ** -0.5)
    assert node_weight(flat()).tolist() == [1.0] * flat().n_nodes


Convolution = LayeredOperator | MirroredOperator


def same_operator(found: Convolution, expected: Convolution) -> bool:
    return (
        found.shape == expected.shape
        and np.array_equal(found.columns, expected.columns)
        and np.allclose(found.blocks, expected.blocks, rtol=1e-12)
    )


@pytest.mark.parametrize("weighting", ["cell_centre", "volume_fraction"])
def test_operators_of_the_infinite_pad_have_the_pads_lattice(weighting: str) -> None:
    mesh = flat(weighting)
    system = PadSystem(mesh, element(mesh))
    extent = tuple(int(n) + 1 for n in system.lattice_positions.max(axis=0))
    padding = padding_columns(mesh.cell_size_mm, 3, extent)
    made = [
        make(element(mesh), 3, system.lattice_positions, padding, transform)
        for make, transform in (
            (layered_operator, surface_stiffness),
            (layered_operator, surface_compliance),
            (mirrored_operator, inverse),
            (mirrored_operator, inner_compliance),
        )
    ]
    assert same_operator(system.infinite_stiffness, made[0])
    assert same_operator(system.infinite_compliance, made[1])
    guesses = (system.preconditioner, system.inner_preconditioner)
    if weighting == "cell_centre":
        assert same_operator(guesses[0], made[2])
        assert same_operator(guesses[1], made[3])
        return
    weight = node_weight(mesh).reshape(4, -1)
    for guess, uniform, rows in zip(guesses, made[2:], (slice(1, 4), slice(1, 3)), strict=True):
        assert isinstance(guess, ScaledPreconditioner)
        assert same_operator(guess.uniform, uniform)
        assert np.array_equal(guess.weight, weight[rows])


@pytest.mark.slow
def test_a_crowned_pad_takes_the_displacement_of_its_true_surface_as_unknown() -> None:
    """Nodal displacements are u = T v, and the surface lies at the shift between two nodes."""
    mesh = domed()
    system = pad_system(mesh, element(mesh))
    assert isinstance(system, CrownedSystem)
    assert (system.columns, system.preconditioner_layers) == (len(mesh.surface), (1, 1))
    order = np.concatenate([np.setdiff1d(mesh.free, mesh.surface), mesh.surface])
    rank = {int(node): k for k, node in enumerate(order)}
    inner, hz = len(order) - len(mesh.surface), mesh.cell_size_mm[2]
    nodes = np.asarray(mesh.nodes_mm)
    unknowns = np.eye(len(order))
    for k, (node, shift) in enumerate(zip(mesh.surface, mesh.surface_shift, strict=True)):
        beyond = np.abs(nodes - nodes[node] - [0.0, 0.0, np.sign(shift) * hz]).max(axis=1) < 1e-9
        unknowns[inner + k, inner + k] = 1.0 - abs(shift)
        other = rank.get(int(np.flatnonzero(beyond)[0]))
        if other is not None and shift:
            unknowns[inner + k, other] = abs(shift)
    assert (np.asarray(mesh.surface_shift) > 0).any()
    assert (np.asarray(mesh.surface_shift) < 0).any()
    t = np.kron(np.linalg.inv(unknowns), np.eye(3))
    free = mesh_stiffness(mesh, element(mesh)).toarray()[np.ix_(*2 * [components(order)])]
    expected = t.T @ free @ t
    assert system.stiffness.toarray() == pytest.approx(expected, abs=1e-12 * np.abs(free).max())
    cut = 3 * inner
    assert system.inner.shape == (cut, cut)
    assert np.array_equal(system.inner.toarray(), system.stiffness.toarray()[:cut, :cut])
    whole, inside = system.preconditioner, system.inner_preconditioner
    for guess, used in ((whole, order), (inside, order[:inner])):
        assert isinstance(guess, EmbeddedPreconditioner)
        height = (nodes[used, 2] - nodes[:, 2].min()) / hz
        assert guess.layer == pytest.approx(height - 1)
        assert nodes[mesh.surface[guess.column], :2] == pytest.approx(nodes[used, :2])
        assert np.array_equal(guess.weight, node_weight(mesh)[used])
        assert (guess.layers, guess.columns) == (4, len(mesh.surface))
        extent = tuple(int(n) + 1 for n in system.lattice_positions.max(axis=0))
        padding = padding_columns(mesh.cell_size_mm, 4, extent)
        assert same_operator(
            guess.uniform,
            mirrored_operator(element(mesh), 4, system.lattice_positions, padding, inverse),
        )
    assert inside.transformation is None
    assert whole.transformation.toarray() == pytest.approx(unknowns)
    at = nodes[mesh.surface][:, [1, 0]] - np.array(mesh.origin_mm)[[1, 0]]
    assert system.lattice_positions == pytest.approx(at / np.array(mesh.cell_size_mm)[[1, 0]])


def test_a_dome_of_steps_has_the_nodes_themselves_as_unknowns() -> None:
    mesh = domed().crowned(None)
    system = CrownedSystem(mesh, element(mesh))
    order = np.concatenate([np.setdiff1d(mesh.free, mesh.surface), mesh.surface])
    whole = mesh_stiffness(mesh, element(mesh)).toarray()
    assert np.array_equal(system.stiffness.toarray(), whole[np.ix_(*2 * [components(order)])])


def test_the_missing_resultant_is_that_of_the_exact_operator() -> None:
    mesh = flat()
    system = PadSystem(mesh, element(mesh))
    inner = np.linalg.solve(system.inner.toarray(), system.surface_to_inner.toarray())
    exact = system.surface.toarray() - system.inner_to_surface.toarray() @ inner
    found = missing_resultant(adjoint_fields(system), system.infinite_stiffness)
    rough = ConvolvedOperator("fft", system, system.infinite_stiffness)
    mended = ConvolvedOperator("fft", system, system.infinite_stiffness, found)
    count = system.columns
    for unit in np.eye(3 * count)[::7]:
        u = unit.reshape(-1, 3)
        true = (exact @ unit).reshape(-1, 3).sum(axis=0)
        assert mended.force(u).sum(axis=0) == pytest.approx(true, abs=1e-9)
        added = mended.force(u) - rough.force(u)
        assert added == pytest.approx(np.einsum("nij,nj->ni", found, u), abs=1e-13)
    blocks = system.infinite_stiffness.blocks.nbytes
    assert (rough.n_bytes, mended.n_bytes) == (blocks, blocks + 8 * 9 * count)


@pytest.mark.parametrize("layers", [2, 3, 5])
def test_forces_between_surface_and_inner_nodes_need_no_matrix(layers: int) -> None:
    """Against the blocks of the assembled matrix, on a pad with a notch."""
    mesh = flat(layers=layers)
    system = PadSystem(mesh, element(mesh))
    quick, assembled = coupling(system), AssembledCoupling(system)
    assert isinstance(quick, LayerCoupling)
    rng = np.random.default_rng(layers)
    for _ in range(3):
        u = rng.normal(size=(system.columns, 3))
        inner = rng.normal(size=3 * (layers - 1) * system.columns)
        np.testing.assert_allclose(quick.on_inner(u), assembled.on_inner(u), atol=1e-13)
        found, expected = (c.on_surface(u, inner) for c in (quick, assembled))
        np.testing.assert_allclose(found, expected, atol=1e-13)
        of_inner = (system.inner_to_surface @ inner).reshape(-1, 3)
        np.testing.assert_allclose(quick.from_inner(inner), of_inner, atol=1e-13)


def matrix_bytes(*matrices) -> int:
    return sum(m.data.nbytes + m.indices.nbytes + m.indptr.nbytes for m in matrices)


def test_memory_is_that_of_the_arrays_which_a_call_reads() -> None:
    mesh = flat()
    system = PadSystem(mesh, element(mesh))
    count, masks = system.columns, system.mesh.numbering.masks
    on_surface, below = masks[-count:], masks[-2 * count : -count]
    coupled = 8 * (2 * count + 27 * count)
    coupled += 8 * 81 * (2 * len(np.unique(on_surface)) + len(np.unique(below)))
    factor, gradients = inner_solver(system, "direct"), inner_solver(system, "pcg")
    assert isinstance(factor, SparseFactor)
    exact = CondensedOperator(system, "factor", factor, 1e-10)
    assert exact.n_bytes == coupled + matrix_bytes(system.inner) + 12 * factor.factor.nnz
    quick = CondensedOperator(system, "pcg", gradients, 1e-10)
    gradients_read = matrix_bytes(system.inner) + system.inner_preconditioner.blocks.nbytes
    assert quick.n_bytes == coupled + gradients_read
    cut = PadSystem(flat("volume_fraction"), element(flat("volume_fraction")))
    parts = (cut.surface, cut.surface_to_inner, cut.inner_to_surface)
    assert coupling(cut).n_bytes == matrix_bytes(*parts)
    assert DenseOperator(system).n_bytes == 4 * (3 * system.columns) ** 2
    for weighting in ("cell_centre", "volume_fraction"):
        thin = flat(weighting, 1)
        paper = PaperOperator(PadSystem(thin, element(thin)))
        count, kinds = len(thin.surface), len(np.unique(thin.numbering.masks[-len(thin.surface) :]))
        stencil = 8 * (count + 9 * count + 81 * kinds)
        cut = weighting == "volume_fraction"
        assert paper.n_bytes == (matrix_bytes(paper.system.stiffness) if cut else stencil)


@pytest.mark.parametrize("weighting", ["cell_centre", "volume_fraction"])
def test_condensed_operators_are_dense_linear_algebra(weighting: str) -> None:
    thin, thick = flat(weighting, 1), flat(weighting, 3)
    u = np.random.default_rng(4).normal(size=(len(thick.surface), 3))
    system = PadSystem(thick, element(thick))
    inner = np.linalg.solve(system.inner.toarray(), system.surface_to_inner.toarray())
    schur = system.surface.toarray() - system.inner_to_surface.toarray() @ inner
    plain = PadSystem(thin, element(thin))
    for operator, matrix, tolerance in (
        (PaperOperator(plain), plain.stiffness.toarray(), 1e-13),
        (DenseOperator(system), schur, 1e-6),
        (CondensedOperator(system, "factor", inner_solver(system, "direct"), 1e-10), schur, 1e-10),
        (CondensedOperator(system, "pcg", inner_solver(system, "pcg"), 1e-10), schur, 1e-9),
    ):
        force = (matrix @ u.reshape(-1)).reshape(-1, 3)
        assert operator.force(u) == pytest.approx(force, abs=tolerance * np.abs(force).max())
        assert operator.displacement(force) == pytest.approx(u, abs=1e-6)
    dense = DenseOperator(system).matrix
    assert np.array_equal(dense, dense.T)
    assert dense == pytest.approx(schur, abs=1e-7)


def test_size_and_method_decide_the_solver() -> None:
    """Below 2000 unknowns a factor; others may need one after all."""
    cells = np.ones((17, 15, 4), dtype=bool)
    large, cut = (
        PadMesh.from_occupancy(cells, (0.5, 0.6, 0.5), (0.0, 0.0, -2.0), fill)
        for fill in (None, np.full(cells.shape, 0.5))
    )
    for mesh, method, whole, inside in (
        (flat(), "auto", SparseFactor, SparseFactor),
        (flat(), "direct", SparseFactor, SparseFactor),
        (flat(), "pcg", ConjugateGradients, ConjugateGradients),
        (flat(), "iterative", GradientsThenFactor, GradientsThenFactor),
        (large, "auto", GradientsThenFactor, GradientsThenFactor),
        (large, "direct", SparseFactor, SparseFactor),
        (large, "pcg", ConjugateGradients, ConjugateGradients),
        (cut, "auto", GradientsThenFactor, GradientsThenFactor),
        (cut, "direct", SparseFactor, SparseFactor),
        (cut, "pcg", ConjugateGradients, ConjugateGradients),
    ):
        system = PadSystem(mesh, element(mesh))
        assert type(pad_solver(system, method)) is whole
        assert type(inner_solver(system, method)) is inside


def test_fields_that_do_not_fit_are_refused() -> None:
    field = np.zeros((5, 3))
    assert np.array_equal(checked_field(field, 5), field)
    field[[3, 4], [2, 0]] = np.inf
    for values, count, name, value in ((field, 5, "node", 3), (field, 4, "shape", (5, 3))):
        with pytest.raises(IfemError) as caught:
            checked_field(values, count)
        assert (caught.value.field, caught.value.value) == (name, value)
