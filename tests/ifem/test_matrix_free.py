"""The product without a matrix against the assembled matrix, and its operator against another."""

from __future__ import annotations

import numpy as np
import pytest
from ifem_shapes import Polygon

from ifem_export.elements.hex8 import hex8_stiffness
from ifem_export.elements.material import Material
from ifem_export.errors import IfemError, MeshError
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh
from ifem_export.operators import ladder
from ifem_export.operators.condensed_operators import CondensedOperator
from ifem_export.operators.crowned_system import pad_system
from ifem_export.operators.ladder import (
    REFERENCE_RTOL,
    _contacts,
    _prescribed,
    bumps,
    edge_bumps,
    measure_ladder,
    reference_of,
    refined,
)
from ifem_export.operators.matrix_free import LatticeMatrix, LatticeProduct, MatrixFreeOperator
from ifem_export.operators.pad_system import PadSystem
from ifem_export.operators.solver import inner_solver
from ifem_export.operators.surface_operator import system_operator
from ifem_export.operators.symmetric_matrix import matrix_bytes

GEL = Material(0.147, 0.3223, 1070.0)
NEARLY_INCOMPRESSIBLE = Material(0.147, 0.4999, 1070.0)
ANGLED = Polygon([(-2.6, -1.9), (2.6, -1.9), (2.6, 0.4), (0.3, 0.4), (0.3, 1.9), (-2.6, 1.9)])
OUTLINES = {"angled": ANGLED, "rounded": RoundedRectangle(6.0, 4.0, 1.1)}


def pad(outline: str, layers: int, weighting: str = "cell_centre") -> PadMesh:
    return build_pad_mesh(
        OUTLINES[outline], 1.2, pitch_mm=(0.5, 0.4), layers=layers, weighting=weighting
    )[0]  # fmt: skip


def equations(mesh: PadMesh, gel: Material = GEL, formulation: str = "bbar") -> PadSystem:
    return pad_system(mesh, hex8_stiffness(mesh.cell_size_mm, gel, formulation))


@pytest.mark.parametrize("outline", OUTLINES)
@pytest.mark.parametrize("layers", [1, 2, 5])
@pytest.mark.parametrize("formulation", ["full", "bbar"])
def test_the_product_is_that_of_the_assembled_matrix(
    outline: str, layers: int, formulation: str
) -> None:
    system = equations(pad(outline, layers), formulation=formulation)
    product, rng = LatticeProduct(system), np.random.default_rng(layers)
    for _ in range(2):
        field = rng.normal(size=(layers, system.columns, 3))
        expected = system.stiffness @ field.ravel()
        assert product(field).ravel() == pytest.approx(expected, abs=1e-14 * abs(expected).max())


def test_held_layers_leave_the_block_of_the_others() -> None:
    system = equations(pad("angled", 4))
    product, rng = LatticeProduct(system), np.random.default_rng(0)
    for layers, block in ((3, system.inner), (4, system.stiffness)):
        matrix = LatticeMatrix(product, layers, lambda block=block: block)
        assert matrix.shape == block.shape
        assert matrix.tocsr() is block
        x = rng.normal(size=block.shape[0])
        assert matrix @ x == pytest.approx(block @ x, abs=1e-13)


@pytest.mark.parametrize("outline", OUTLINES)
@pytest.mark.parametrize("gel", [GEL, NEARLY_INCOMPRESSIBLE])
def test_forces_and_displacements_are_those_of_a_factor(outline: str, gel: Material) -> None:
    system = equations(pad(outline, 4), gel)
    found, expected = MatrixFreeOperator(system, 1e-10), system_operator(system, "factor")
    u = np.random.default_rng(1).normal(size=(system.columns, 3))
    for method in ("force", "displacement"):
        due = getattr(expected, method)(u)
        assert getattr(found, method)(u) == pytest.approx(due, abs=1e-6 * np.abs(due).max())
    assert found.n_bytes < expected.n_bytes


def test_conjugate_gradients_of_a_whole_pad_read_no_inner_matrix() -> None:
    """The iterations are those with the matrix, so that the forces agree to rounding."""
    system = equations(pad("angled", 4))
    found = system_operator(system, "pcg", rtol=1e-2)
    stored = CondensedOperator(system, "pcg", inner_solver(system, "pcg"), 1e-2, found.adjoint)
    u = np.random.default_rng(2).normal(size=(system.columns, 3))
    assert found.force(u) == pytest.approx(stored.force(u), abs=1e-12)
    saved = matrix_bytes(system.inner) - LatticeProduct(system).n_bytes
    assert stored.n_bytes - found.n_bytes == saved > 0


def test_cut_cells_and_wrong_fields_are_errors() -> None:
    with pytest.raises(MeshError, match="cut"):
        LatticeProduct(equations(pad("angled", 2, "volume_fraction")))
    operator = MatrixFreeOperator(equations(pad("angled", 2)), 1e-8)
    for method in (operator.force, operator.displacement):
        with pytest.raises(IfemError, match="shape"):
            method(np.zeros((3, 3)))


def test_only_cut_pads_have_a_reference_with_a_matrix() -> None:
    whole, cut = (
        reference_of(pad("angled", 2, w), GEL) for w in ("cell_centre", "volume_fraction")
    )
    assert isinstance(whole, MatrixFreeOperator)
    assert (whole.rtol, cut.name) == (REFERENCE_RTOL, "pcg")


@pytest.mark.slow
@pytest.mark.parametrize("gel", [GEL, NEARLY_INCOMPRESSIBLE])
def test_the_ladder_is_the_one_that_an_assembled_reference_gives(
    gel: Material, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All motions and forces agree to a tenth of what the ladder prints, and so does the ladder."""
    mesh = build_pad_mesh(
        RoundedRectangle(14.0, 10.0, 2.0), 2.0, pitch_mm=(0.7, 0.7), layers=4
    )[0]  # fmt: skip
    fine = refined(mesh)
    cheap = reference_of(fine, gel)
    system = equations(fine, gel)
    assembled = CondensedOperator(system, "pcg", inner_solver(system, "iterative"), REFERENCE_RTOL)
    assert isinstance(cheap, MatrixFreeOperator)
    motions = [*bumps(mesh), *edge_bumps(mesh)]
    found, expected = (
        [*_prescribed(mesh, motions, one, fine), *_contacts(mesh, one, fine).values()]
        for one in (cheap, assembled)
    )
    for one, due in zip(found, expected, strict=True):
        for name in ("motion_mm", "force_n"):
            miss = np.linalg.norm(getattr(one, name) - getattr(due, name))
            assert miss < 1e-7 * np.linalg.norm(getattr(due, name))
    measured = measure_ladder(mesh, gel, "bbar", timed=False)
    monkeypatch.setattr(ladder, "reference_of", lambda fine, gel: assembled)
    slow = measure_ladder(mesh, gel, "bbar", timed=False)
    for one, due in zip(measured.rungs, slow.rungs, strict=True):
        assert one.errors == pytest.approx(due.errors, abs=2e-6)
        assert one.worst_resultant == pytest.approx(due.worst_resultant, abs=2e-6)
