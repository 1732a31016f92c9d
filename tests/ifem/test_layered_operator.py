"""Operators of the infinite pad against dense periodic matrices."""

from __future__ import annotations

import numpy as np
import pytest

from ifem_export.assembly.assembly import assemble_csr
from ifem_export.elements.hex8 import hex8_stiffness
from ifem_export.elements.material import Material
from ifem_export.errors import IfemError
from ifem_export.mesh.pad_mesh import PadMesh
from ifem_export.operators.convolved_operator import ComplianceProducts, truncated
from ifem_export.operators.layered_operator import (
    LayeredOperator,
    even_fast_length,
    inner_compliance,
    inverse,
    layered_operator,
    padding_columns,
    stiffness_symbol,
    surface_compliance,
    surface_stiffness,
)
from ifem_export.operators.preconditioner import (
    EmbeddedPreconditioner,
    ScaledPreconditioner,
    mirrored_operator,
)

SIZE = (0.5, 0.7, 0.4)
LAYERS, ROWS, COLUMNS = 3, 4, 6
ELEMENT = hex8_stiffness(SIZE, Material(0.147, 0.4, 1.0), "bbar")
EVERYWHERE = np.argwhere(np.ones((ROWS, COLUMNS), dtype=bool))


def periodic_stiffness() -> np.ndarray:
    """(rows columns layers 3)² stiffness of a pad whose opposite sides are joined."""
    cells = np.ones((COLUMNS, ROWS, LAYERS), dtype=bool)
    mesh = PadMesh.from_occupancy(cells, SIZE, (0.0, 0.0, 0.0))
    whole = assemble_csr(cells, ELEMENT).toarray()
    z, y, x = np.unravel_index(mesh.numbering.positions, mesh.numbering.shape)
    joined = ((y % ROWS * COLUMNS + x % COLUMNS) * LAYERS + z - 1).astype(int)
    fold = np.zeros((mesh.n_nodes, ROWS * COLUMNS * LAYERS))
    fold[np.arange(mesh.n_nodes)[z > 0], joined[z > 0]] = 1.0
    fold = np.kron(fold, np.eye(3))
    return fold.T @ whole @ fold


def dense(operator: LayeredOperator, size: int) -> np.ndarray:
    """The matrix of an operator on all columns, in the order of `periodic_stiffness`."""
    count = len(operator.columns)
    found = []
    for unit in np.eye(3 * size * count):
        field = unit.reshape(count, size, 3).transpose(1, 0, 2)
        found.append(operator(field).transpose(1, 0, 2).reshape(-1))
    return np.array(found).T


def blocks_of(transform=lambda blocks: blocks) -> LayeredOperator:
    symbol = stiffness_symbol(ELEMENT, LAYERS, (ROWS, COLUMNS))
    return LayeredOperator(transform(symbol), EVERYWHERE, (ROWS, COLUMNS))


def test_the_convolution_is_the_stiffness_of_a_periodic_pad() -> None:
    expected = periodic_stiffness()
    assert dense(blocks_of(), LAYERS) == pytest.approx(expected, abs=1e-14)
    found = dense(blocks_of(inverse), LAYERS)
    assert found @ expected == pytest.approx(np.eye(len(expected)), abs=1e-10)


def test_surface_and_inner_operators_are_the_schur_complements() -> None:
    whole = periodic_stiffness()
    unknown = np.arange(len(whole)).reshape(-1, LAYERS, 3)
    top, inner = unknown[:, -1].reshape(-1), unknown[:, :-1].reshape(-1)
    held = np.linalg.inv(whole[np.ix_(inner, inner)])
    coupling = whole[np.ix_(inner, top)]
    schur = whole[np.ix_(top, top)] - coupling.T @ held @ coupling
    assert dense(blocks_of(surface_stiffness), 1) == pytest.approx(schur, abs=1e-13)
    assert dense(blocks_of(surface_compliance), 1) == pytest.approx(np.linalg.inv(schur), abs=1e-9)
    assert dense(blocks_of(inner_compliance), LAYERS - 1) == pytest.approx(held, abs=1e-9)
    single = stiffness_symbol(ELEMENT, 1, (ROWS, COLUMNS))
    assert np.array_equal(surface_stiffness(single), single)


def test_a_cropped_operator_takes_its_columns_of_the_padded_lattice() -> None:
    columns = np.array([[0, 0], [0, 3], [2, 1], [2, 2], [1, 3]])
    small = layered_operator(ELEMENT, LAYERS, columns, (1, 2), inverse)
    assert small.shape == (4, 6)
    assert np.array_equal(small.columns, columns)
    padded = dense(blocks_of(inverse), LAYERS)
    padded = padded.reshape(ROWS * COLUMNS, 3 * LAYERS, ROWS * COLUMNS, 3 * LAYERS)
    at = columns @ [COLUMNS, 1]
    expected = padded[at][:, :, at].reshape(3 * LAYERS * len(at), -1)
    # The extent of the columns is (3, 4), so that the padded lattice is the one above.
    assert dense(small, LAYERS) == pytest.approx(expected, abs=1e-11)
    wider = layered_operator(ELEMENT, LAYERS, columns, (4, 9), inverse)
    assert wider.shape == (8, 16)


@pytest.mark.parametrize("transform", [inverse, inner_compliance])
@pytest.mark.parametrize(("layers", "padding"), [(2, (1, 2)), (4, (5, 3))])
@pytest.mark.parametrize("formulation", ["full", "bbar"])
def test_half_the_blocks_as_reals_are_the_whole_operator(
    transform, layers: int, padding: tuple[int, int], formulation: str
) -> None:
    columns = np.array([[0, 0], [0, 3], [2, 1], [2, 2], [1, 3]])
    element = hex8_stiffness(SIZE, Material(0.147, 0.4, 1.0), formulation)
    made = mirrored_operator(element, layers, columns, padding, transform)
    expected = layered_operator(element, layers, columns, padding, transform)
    size = expected.blocks.shape[-1] // 3
    found, whole = dense(made, size), dense(expected, size)
    assert found == pytest.approx(whole, abs=1e-13 * np.abs(whole).max())
    field = np.random.default_rng(0).normal(size=(size, len(columns), 3))
    by_transforms = made.by_transforms(field)
    assert made(field) == pytest.approx(by_transforms, abs=1e-12 * np.abs(by_transforms).max())
    rows = expected.shape[0]
    assert made.blocks.nbytes / expected.blocks.nbytes == (rows // 2 + 1) / (2 * rows)


def test_an_element_that_is_not_its_mirror_image_has_no_real_blocks() -> None:
    sheared = ELEMENT.copy()
    sheared[0, 1] *= 1.01
    sheared[1, 0] *= 1.01
    with pytest.raises(IfemError, match="mirror"):
        mirrored_operator(sheared, LAYERS, EVERYWHERE, (1, 2), inverse)


def random_operator(seed: int, layers: int = 2) -> LayeredOperator:
    kernel = np.random.default_rng(seed).normal(size=(ROWS, COLUMNS, 3 * layers, 3 * layers))
    return LayeredOperator(np.fft.rfft2(kernel, axes=(0, 1)), EVERYWHERE, (ROWS, COLUMNS))


def test_preconditioners_scale_embed_and_transform() -> None:
    uniform, rng = random_operator(0), np.random.default_rng(1)
    count = ROWS * COLUMNS
    matrix = dense(uniform, 2).reshape(count, 2, 3, count, 2, 3)
    weight, field = rng.uniform(1.0, 3.0, (2, count)), rng.normal(size=(2, count, 3))
    scaled = ScaledPreconditioner(uniform, weight)
    expected = np.einsum("lc,clidmj,md,mdj->lci", weight, matrix, weight, field)
    assert scaled(field) == pytest.approx(expected, abs=1e-10)
    assert scaled.blocks is uniform.blocks
    nodes = rng.permutation(2 * count)[:20]
    layer, column = nodes // count, nodes % count
    transformation, weight = rng.normal(size=(20, 20)), rng.uniform(1.0, 3.0, 20)
    field = rng.normal(size=(1, 20, 3))
    part = matrix[column, layer].transpose(2, 3, 0, 1, 4)[column, layer]
    for transform in (None, transformation):
        one = EmbeddedPreconditioner(uniform, 2, count, layer, column, weight, transform)
        t = np.eye(20) if transform is None else transform
        loads = weight[:, None] * (t.T @ field[0])
        expected = t @ (weight[:, None] * np.einsum("baij,bj->ai", part, loads))
        assert one(field)[0] == pytest.approx(expected, abs=1e-9)
        assert one.blocks is uniform.blocks


def test_lengths_are_the_smallest_even_products_of_two_three_and_five() -> None:
    def is_fast(length: int) -> bool:
        for prime in (2, 3, 5):
            while length % prime == 0:
                length //= prime
        return length == 1

    for least in range(1, 140):
        expected = next(n for n in range(least, 4 * least + 4) if n % 2 == 0 and is_fast(n))
        assert even_fast_length(least) == expected


def test_padding_is_1_7_thicknesses_within_its_bounds() -> None:
    assert padding_columns((0.5, 0.8, 0.6), 5, (40, 30)) == (7, 11)
    assert padding_columns((0.5, 0.8, 0.6), 5, (3, 4)) == (7, 8)
    assert padding_columns((0.5, 0.8, 0.6), 5, (4, 2)) == (7, 8)
    assert padding_columns((5.0, 0.3, 0.6), 1, (40, 30)) == (4, 4)
    assert padding_columns((0.1, 0.2, 1.0), 4, (3, 5)) == (10, 10)


@pytest.mark.parametrize("radius", [1, 2, 3])
def test_truncation_lumps_what_is_beyond_the_radius(radius: int) -> None:
    whole = random_operator(2, 1)
    near = truncated(whole, radius)
    matrix = dense(whole, 1).reshape(ROWS, COLUMNS, 3, ROWS, COLUMNS, 3)
    found = dense(near, 1).reshape(ROWS, COLUMNS, 3, ROWS, COLUMNS, 3)
    for y, x in EVERYWHERE:
        dy = min(y, ROWS - y)
        dx = min(x, COLUMNS - x)
        if (y, x) == (0, 0):
            assert found[y, x, :, 0, 0].sum() != pytest.approx(matrix[y, x, :, 0, 0].sum())
        elif dy * dy + dx * dx <= radius * radius:
            assert found[y, x, :, 0, 0] == pytest.approx(matrix[y, x, :, 0, 0], abs=1e-11)
        else:
            assert np.abs(found[y, x, :, 0, 0]).max() < 1e-11
    assert found.sum(axis=(0, 1)) == pytest.approx(matrix.sum(axis=(0, 1)), abs=1e-10)
    with pytest.raises(IfemError) as caught:
        truncated(whole, 0)
    assert (caught.value.field, caught.value.value) == ("radius", 0)


def test_products_of_a_compliance_are_those_of_its_periodic_matrix() -> None:
    compliance = random_operator(3, 1)
    matrix = dense(compliance, 1)
    nodes = np.array([5, 0, 13, 22])
    unknowns = (3 * nodes[:, None] + np.arange(3)).reshape(-1)
    expected = (matrix.T @ matrix)[np.ix_(unknowns, unknowns)]
    found = ComplianceProducts(compliance).block(nodes)
    assert found == pytest.approx(expected, abs=1e-10)
    assert np.array_equal(found, found.T)
