"""The infinite pad's layers, eliminated one by one, against the inverse of the whole blocks."""

from __future__ import annotations

import numpy as np
import pytest
from contact_pads import small_pad

from ifem_export.operators.layer_elimination import layer_elimination
from ifem_export.operators.layered_operator import (
    inner_compliance,
    inverse,
    layered_operator,
    padding_columns,
    surface_stiffness,
)
from ifem_export.operators.pad_system import PadSystem
from ifem_export.operators.preconditioner import mirrored_operator


def given(layers: int) -> tuple[PadSystem, tuple[int, int]]:
    pad = small_pad(0.49, 9, layers, 6.0)
    system = PadSystem(pad.mesh, np.asarray(pad.element_matrix))
    return system, padding_columns(pad.mesh.cell_size_mm, layers, (10, 10))


@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("layers", [2, 5])
def test_it_is_the_inverse_of_the_whole_blocks(layers: int, held: bool) -> None:
    system, padding = given(layers)
    args = (np.asarray(system.element_matrix), layers, system.lattice_positions, padding)
    field = np.random.default_rng(layers).standard_normal((layers - held, system.columns, 3))
    expected = mirrored_operator(*args, inner_compliance if held else inverse)(field)
    found = layer_elimination(*args, surface_held=held)(field)
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("layers", [1, 4])
def test_what_is_left_is_the_surface_stiffness(layers: int) -> None:
    system, padding = given(layers)
    args = (np.asarray(system.element_matrix), layers, system.lattice_positions, padding)
    made = layer_elimination(*args)
    whole = layered_operator(*args, surface_stiffness).blocks[: made.shape[0] // 2 + 1]
    turn = np.array([1.0, 1.0, 1j])
    real = turn.conj()[:, None] * whole * turn
    np.testing.assert_allclose(real.imag, 0.0, atol=1e-10 * np.abs(whole).max())
    np.testing.assert_allclose(made.stiffness, real.real, atol=1e-10 * np.abs(whole).max())
    force = np.random.default_rng(0).standard_normal((1, system.columns, 3))
    load = np.zeros((layers, system.columns, 3))
    load[-1] = force
    np.testing.assert_allclose(made.surface_compliance(force)[0], made(load)[-1], atol=1e-10)
