import numpy as np
import pytest
from ifem_oracle import elasticity_matrix, rigid_modes

from ifem_export.elements.hex8 import FORMULATIONS, hex8_stiffness
from ifem_export.elements.kinematics import shape_gradients, strain_displacement
from ifem_export.elements.material import Material
from ifem_export.errors import MeshError
from ifem_export.mesh.lattice import VTK_CORNERS

SIZE = (0.5, 0.7, 0.4)


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("nu", [-0.3, 0.0, 0.3223, 0.49, 0.4999])
@pytest.mark.parametrize("size", [SIZE, (1.0, 1.0, 1.0), (0.5, 0.5, 0.01), (0.1, 5.0, 1.0)])
def test_symmetric_to_the_bit_with_exactly_the_six_rigid_modes(formulation, nu, size):
    K = hex8_stiffness(size, Material(0.147, nu, 1.0), formulation)
    assert np.array_equal(K, K.T)
    values = np.linalg.eigvalsh(K)
    assert np.abs(values[:6]).max() < 1e-12 * values[-1]
    # A thin nearly incompressible cell bends softly, a spurious mode would sit at 1e-16.
    assert values[6] > max(1e-11 * values[-1], 30.0 * np.abs(values[:6]).max())
    modes = rigid_modes(VTK_CORNERS * np.array(size))
    assert np.abs(K @ modes).max() < 1e-12 * np.abs(K).max() * np.abs(modes).max()


def test_full_integration_agrees_with_a_finer_rule(gel):
    """5x5x5 Gauss points by the virtual work of B, D: an independent route to the same matrix."""
    points, weights = np.polynomial.legendre.leggauss(5)
    grid = np.stack(np.meshgrid(points, points, points, indexing="ij"), axis=-1)
    weight = weights[:, None, None] * weights[None, :, None] * weights[None, None, :]
    b = strain_displacement(shape_gradients(SIZE, grid))
    volume = np.prod(SIZE) / 8.0
    reference = volume * np.einsum("abc,abcri,rs,abcsj->ij", weight, b, elasticity_matrix(gel), b)
    assert hex8_stiffness(SIZE, gel, "full") == pytest.approx(reference, rel=1e-12, abs=1e-14)


def test_elasticity_matrix_inverts_the_compliance(gel):
    e, nu = gel.youngs_modulus_mpa, gel.poissons_ratio
    compliance = np.zeros((6, 6))
    compliance[:3, :3] = (np.eye(3) * (1 + nu) - nu) / e
    compliance[3:, 3:] = np.eye(3) / gel.shear_modulus_mpa
    assert elasticity_matrix(gel) @ compliance == pytest.approx(np.eye(6), abs=1e-13)


def test_the_formulations_agree_on_any_linear_field(gel):
    gradient = np.random.default_rng(0).normal(size=(3, 3))
    u = (VTK_CORNERS * np.array(SIZE) @ gradient.T).ravel()
    full, bbar, incompatible = (hex8_stiffness(SIZE, gel, f) @ u for f in FORMULATIONS)
    assert full == pytest.approx(bbar, abs=1e-13)
    assert full == pytest.approx(incompatible, abs=1e-13)


def test_bbar_differs_and_is_never_stiffer():
    soft = Material(0.147, 0.49, 1.0)
    difference = hex8_stiffness(SIZE, soft, "full") - hex8_stiffness(SIZE, soft, "bbar")
    values = np.linalg.eigvalsh(difference)
    assert values[0] > -1e-10 * values[-1]
    assert values[-1] > 0.1


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_scaling_in_modulus_and_length(gel, formulation):
    K = hex8_stiffness(SIZE, gel, formulation)
    stiffer = Material(3.0 * gel.youngs_modulus_mpa, gel.poissons_ratio, 1.0)
    assert hex8_stiffness(SIZE, stiffer, formulation) == pytest.approx(3.0 * K, rel=1e-13)
    # In metres and pascals K is in N/m, a thousand times its value in N/mm.
    pascals = Material(gel.youngs_modulus_mpa * 1e6, gel.poissons_ratio, 1.0)
    metres = tuple(1e-3 * h for h in SIZE)
    assert hex8_stiffness(metres, pascals, formulation) == pytest.approx(1e3 * K, rel=1e-12)


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("order", [(1, 0, 2), (2, 1, 0), (1, 2, 0)])
def test_axis_permutation(gel, formulation, order):
    corner = {tuple(c): a for a, c in enumerate(VTK_CORNERS.tolist())}
    image = [corner[tuple(c[list(order)])] for c in VTK_CORNERS]
    unknown = [3 * image[a] + order.index(i) for a in range(8) for i in range(3)]
    turned = hex8_stiffness(tuple(SIZE[i] for i in order), gel, formulation)
    K = hex8_stiffness(SIZE, gel, formulation)
    assert turned[np.ix_(unknown, unknown)] == pytest.approx(K, rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("size", [(0.0, 1.0, 1.0), (1.0, 1.0), (np.nan, 1.0, 1.0)])
def test_impossible_cells_are_refused(gel, size):
    with pytest.raises(MeshError) as caught:
        hex8_stiffness(size, gel, "full")
    assert caught.value.field == "cell_size_mm"


def test_unknown_formulation_is_refused(gel):
    with pytest.raises(MeshError) as caught:
        hex8_stiffness(SIZE, gel, "reduced")
    assert (caught.value.field, caught.value.value) == ("formulation", "reduced")
