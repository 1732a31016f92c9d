import pickle

import numpy as np
import pytest
from ifem_oracle import neo_hookean_energy, neo_hookean_force, random_occupancy
from scipy.optimize import brentq
from scipy.sparse.linalg import spsolve

from ifem_export.assembly.assembly import assemble_csr
from ifem_export.elements.hex8 import hex8_stiffness
from ifem_export.elements.material import Material
from ifem_export.errors import MeshError
from ifem_export.finite_strain.neo_hookean import FiniteStrainError, NeoHookeanPad
from ifem_export.mesh.pad_mesh import PadMesh

SIZE = (0.5, 0.7, 0.4)
NUS = [0.0, 0.3223, 0.49, 0.4999]


def crop(seed=0, shape=(5, 4, 3)):
    return PadMesh.from_occupancy(random_occupancy(seed, shape, 0.75), SIZE, (0.3, -0.2, 0.1))


def wobble(mesh, amplitude=0.03, seed=1):
    return amplitude * np.random.default_rng(seed).normal(size=(mesh.n_nodes, 3))


def rotation(seed):
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def scale_of(material):
    """Force of a unit strain on a cell face: what rounding is measured against."""
    return (material.bulk_modulus_mpa + material.shear_modulus_mpa) * max(SIZE) ** 2


@pytest.mark.parametrize("nu", NUS)
@pytest.mark.parametrize("seed", range(6))
def test_finite_rotations_and_translations_need_no_force(nu, seed):
    mesh, material = crop(seed), Material(0.147, nu, 1.0)
    moved = mesh.nodes_mm @ rotation(seed).T + [3.0, -2.0, 1.0]
    F = NeoHookeanPad(mesh, material).force(moved - mesh.nodes_mm)
    assert np.abs(F).max() < 1e-12 * scale_of(material)
    shift = np.broadcast_to([0.3, -0.2, 5.0], mesh.nodes_mm.shape)
    assert np.abs(NeoHookeanPad(mesh, material).force(shift)).max() < 1e-13 * scale_of(material)
    assert np.array_equal(NeoHookeanPad(mesh, material).force(0.0 * shift), 0.0 * shift)


@pytest.mark.parametrize("nu", NUS)
def test_objectivity(nu):
    """A rotated deformation has the rotated forces; the same one turned before has other ones."""
    mesh, material = crop(), Material(0.147, nu, 1.0)
    body = NeoHookeanPad(mesh, material)
    u, Q = wobble(mesh), rotation(4)
    F = body.force(u)
    turned = (mesh.nodes_mm + u) @ Q.T - mesh.nodes_mm
    assert np.abs(body.force(turned) - F @ Q.T).max() < 1e-12 * scale_of(material)
    assert np.abs(F).max() > 1e-3 * scale_of(material)


@pytest.mark.parametrize("nu", NUS)
def test_tangent_at_rest_is_the_bbar_stiffness(nu):
    mesh, material = crop(), Material(0.147, nu, 1.0)
    K = assemble_csr(mesh.occupancy, hex8_stiffness(SIZE, material, "bbar")).tobsr((3, 3))
    K.sort_indices()
    body = NeoHookeanPad(mesh, material)
    T = body.tangent(np.zeros((mesh.n_nodes, 3)))
    assert np.array_equal(T.indptr, K.indptr)
    assert np.array_equal(T.indices, K.indices)
    assert np.abs(T.data - K.data).max() < 1e-13 * np.abs(K.data).max()
    numeric = finite_differences(body.force, np.zeros((mesh.n_nodes, 3)), step=1e-3)
    assert np.abs(numeric - K.toarray()).max() < 1e-9 * np.abs(K.data).max()


@pytest.mark.parametrize("nu", NUS)
def test_tangent_is_the_derivative_of_the_force_far_from_rest(nu):
    mesh = crop(2, (2, 2, 2))
    body = NeoHookeanPad(mesh, Material(0.147, nu, 1.0))
    u = wobble(mesh, 0.06)
    T = body.tangent(u)
    assert np.array_equal(T.toarray(), T.toarray().T)
    numeric = finite_differences(body.force, u, step=1e-3)
    assert np.abs(T.toarray() - numeric).max() < 1e-8 * np.abs(T.data).max()


def finite_differences(force, u, step):
    """Sixth-order central differences of the force, column by column."""
    columns = []
    for index in np.ndindex(u.shape):
        d = np.zeros_like(u)
        d[index] = step
        f = [force(u + k * d) - force(u - k * d) for k in (1, 2, 3)]
        columns.append(((45.0 * f[0] - 9.0 * f[1] + f[2]) / (60.0 * step)).ravel())
    return np.stack(columns, axis=1)


@pytest.mark.parametrize("nu", NUS)
def test_force_is_the_gradient_of_the_energy(nu):
    mesh, material = crop(), Material(0.147, nu, 1.0)
    body = NeoHookeanPad(mesh, material)
    u = wobble(mesh)
    F = body.force(u)
    for seed in range(5):
        d = np.random.default_rng(seed).normal(size=u.shape)
        e = [
            neo_hookean_energy(body, u + k * 1e-4 * d) - neo_hookean_energy(body, u - k * 1e-4 * d)
            for k in (1, 2, 3)
        ]
        slope = (45.0 * e[0] - 9.0 * e[1] + e[2]) / 60.0 / 1e-4
        assert slope == pytest.approx((F * d).sum(), abs=1e-9 * np.abs(F * d).sum())
    assert neo_hookean_energy(body, 0.0 * u) == pytest.approx(0.0, abs=1e-14)
    assert neo_hookean_energy(body, u) > 0.0


@pytest.mark.parametrize("nu", NUS)
@pytest.mark.parametrize("stretch", [0.5, 0.9, 1.3, 2.0])
def test_uniaxial_stretch_with_free_sides(nu, stretch):
    """Closed form: principal stresses of the energy, lateral stretch from zero side stress."""
    material = Material(0.147, nu, 1.0)
    g, bulk = material.shear_modulus_mpa, material.bulk_modulus_mpa

    def nominal(along, across):
        j = along * across**2
        mean = (along**2 + 2.0 * across**2) / 3.0
        iso = g * j ** (-2.0 / 3.0)
        pressure = bulk * (j - 1.0) * j
        return [(iso * (s**2 - mean) + pressure) / s for s in (along, across)]

    across = brentq(lambda s: nominal(stretch, s)[1], 0.3, 2.5, xtol=1e-15, rtol=1e-15)
    mesh = PadMesh.from_occupancy(np.ones((3, 2, 4), dtype=bool), SIZE, (0.0, 0.0, 0.0))
    F = NeoHookeanPad(mesh, material).force(
        mesh.nodes_mm * ([across, across, stretch] - np.ones(3))
    )
    top = np.isclose(mesh.nodes_mm[:, 2], 4 * SIZE[2])
    area = 3 * SIZE[0] * 2 * SIZE[1]
    bound = 1e-12 * scale_of(material)
    expected = nominal(stretch, across)[0] * area
    assert F[top, 2].sum() == pytest.approx(expected, abs=10 * bound)
    assert np.abs(F[:, :2]).max() < bound
    assert np.abs(F[~top & (mesh.nodes_mm[:, 2] > 1e-9)]).max() < bound


def test_small_strain_limit_is_the_linear_law():
    """The difference to K u falls with the square of the displacement."""
    mesh, material = crop(), Material(0.147, 0.49, 1.0)
    K = assemble_csr(mesh.occupancy, hex8_stiffness(SIZE, material, "bbar"))
    u = wobble(mesh)
    gaps = []
    for shrink in (1e-2, 1e-3, 1e-4):
        linear = (K @ (shrink * u).ravel()).reshape(-1, 3)
        gaps.append(np.abs(NeoHookeanPad(mesh, material).force(shrink * u) - linear).max())
    assert gaps[0] / gaps[1] == pytest.approx(100.0, rel=0.05)
    assert gaps[1] / gaps[2] == pytest.approx(100.0, rel=0.05)


@pytest.mark.parametrize("nu", NUS)
def test_forces_balance_in_the_deformed_place(nu):
    mesh, material = crop(3), Material(0.147, nu, 1.0)
    u = wobble(mesh)
    F = NeoHookeanPad(mesh, material).force(u)
    total = np.abs(F).sum()
    assert np.abs(F.sum(axis=0)).max() < 1e-14 * total
    assert np.abs(np.cross(mesh.nodes_mm + u, F).sum(axis=0)).max() < 1e-13 * total
    assert np.abs(np.cross(mesh.nodes_mm, F).sum(axis=0)).max() > 1e-6 * total


@pytest.mark.parametrize("nu", NUS)
@pytest.mark.parametrize("shape", [(1, 1, 1), (3, 1, 1), (5, 4, 3), (17, 9, 2)])
def test_numpy_and_compiled_agree(nu, shape):
    mesh, material = crop(5, shape), Material(0.147, nu, 1.0)
    body = NeoHookeanPad(mesh, material)
    u = wobble(mesh)
    gap = np.abs(body.force(u) - neo_hookean_force(body, u)).max()
    assert gap < 2e-14 * scale_of(material)


@pytest.mark.parametrize(("least", "most"), [(0.251, 3.99), (0.02, 30.0)])
def test_cells_of_any_volume_ratio(least, most):
    """Each cell of a row has another ratio J, up to the ends of the approximation and beyond."""
    ratio = np.geomspace(least, most, 37)
    mesh = PadMesh.from_occupancy(np.ones((37, 1, 1), dtype=bool), SIZE, (0.0, 0.0, 0.0))
    body = NeoHookeanPad(mesh, Material(0.147, 0.3223, 1.0))
    place = SIZE[0] * np.concatenate([[0.0], np.cumsum(ratio)])
    u = np.zeros((mesh.n_nodes, 3))
    u[:, 0] = place[np.rint(mesh.nodes_mm[:, 0] / SIZE[0]).astype(int)] - mesh.nodes_mm[:, 0]
    expected = neo_hookean_force(body, u)
    assert np.abs(body.force(u) - expected).max() < 1e-13 * np.abs(expected).max()


def test_scaling_mirror_and_input_forms():
    mesh = crop(7)
    material, u = Material(0.147, 0.49, 1.0), wobble(mesh)
    F = NeoHookeanPad(mesh, material).force(u)
    assert NeoHookeanPad(mesh, Material(0.441, 0.49, 1.0)).force(u) == pytest.approx(
        3.0 * F, rel=1e-12
    )
    larger = tuple(2.0 * h for h in SIZE)
    twice = PadMesh.from_occupancy(mesh.occupancy, larger, (0.0, 0.0, 0.0))
    assert NeoHookeanPad(twice, material).force(2.0 * u) == pytest.approx(4.0 * F)
    mirrored = PadMesh.from_occupancy(mesh.occupancy[:, ::-1].copy(), SIZE, (0.0, 0.0, 0.0))
    lookup = mirrored.numbering.node_index.reshape(mirrored.numbering.shape)[:, ::-1].ravel()
    image = lookup[mesh.numbering.positions]
    flip = np.array([1.0, -1.0, 1.0])
    v = np.empty_like(u)
    v[image] = u * flip
    assert NeoHookeanPad(mirrored, material).force(v)[image] * flip == pytest.approx(F, abs=1e-13)


def test_newton_finds_the_pressed_pad_in_quadratic_steps():
    """A quarter of the thickness pressed in: stiffer than the linear law says."""
    material = Material(0.147, 0.45, 1.0)
    mesh = PadMesh.from_occupancy(np.ones((6, 6, 2), dtype=bool), (1.0, 1.0, 1.0), (0, 0, -2))
    body = NeoHookeanPad(mesh, material)
    held = np.zeros((mesh.n_nodes, 3), dtype=bool)
    held[mesh.bonded] = True
    centre = np.hypot(mesh.nodes_mm[:, 0] - 3.0, mesh.nodes_mm[:, 1] - 3.0)
    pressed = np.intersect1d(mesh.surface, np.flatnonzero(centre < 1.5))
    held[pressed] = True
    free = np.flatnonzero(~held.ravel())
    u = np.zeros((mesh.n_nodes, 3))
    linear = None
    for push in (-0.25, -0.5):
        rate = np.zeros_like(u)
        rate[pressed, 2] = push - u[pressed, 2]
        residuals = []
        for _ in range(12):
            T = body.tangent(u).tocsr()
            F = body.force(u).ravel() + T @ rate.ravel()
            change = rate.ravel().copy()
            change[free] -= spsolve(T[free][:, free].tocsc(), F[free])
            u = u + change.reshape(-1, 3)
            rate[:] = 0.0
            residuals.append(np.abs(body.force(u).ravel()[free]).max())
            if linear is None:
                linear = (T @ u.ravel()).reshape(-1, 3)[pressed, 2].sum() * 2.0
            if residuals[-1] < 1e-13:
                break
        assert residuals[-1] < 1e-13
        assert len(residuals) <= 7
    assert body.force(u)[pressed, 2].sum() < 1.05 * linear < 0.0


def test_an_inverted_cell_is_named():
    mesh = PadMesh.from_occupancy(np.ones((4, 3, 2), dtype=bool), SIZE, (0.0, 0.0, 0.0))
    body = NeoHookeanPad(mesh, Material(0.147, 0.49, 1.0))
    u = np.zeros((mesh.n_nodes, 3))
    top = np.flatnonzero(np.isclose(mesh.nodes_mm, [2.0, 2.1, 0.8]).all(axis=1))
    u[top, 2] = -3.0
    for method in (body.force, body.tangent):
        with pytest.raises(FiniteStrainError) as caught:
            method(u)
        assert caught.value.cell == (3, 2, 1)
        assert caught.value.volume_ratio < 0.0
    again = pickle.loads(pickle.dumps(caught.value))
    assert (str(again), again.cell) == (str(caught.value), (3, 2, 1))
    assert again.volume_ratio == caught.value.volume_ratio
    flat = mesh.nodes_mm * [1.0, 1.0, 0.0] - mesh.nodes_mm
    with pytest.raises(FiniteStrainError) as caught:
        body.force(flat)
    assert caught.value.cell == (0, 0, 0)
    assert abs(caught.value.volume_ratio) < 1e-9
    with pytest.raises(FiniteStrainError) as caught:
        body.force(mesh.nodes_mm * 1e200)
    assert caught.value.cell == (0, 0, 0)


def test_bad_input_is_refused():
    mesh, material = crop(), Material(0.147, 0.49, 1.0)
    pad = NeoHookeanPad(mesh, material)
    u = wobble(mesh)
    lost = u.copy()
    lost[[4, 9], [1, 0]] = np.nan
    for displacement, field, value in (
        (u[:-1], "displacement_mm", (len(u) - 1, 3)),
        (lost, "node", 4),
        ([["a", "b", "c"]], "displacement_mm", None),
    ):
        with pytest.raises(FiniteStrainError) as caught:
            pad.force(displacement)
        assert (caught.value.field, caught.value.value) == (field, value)
    with pytest.raises(MeshError) as refused:
        PadMesh.from_occupancy(mesh.occupancy, (1.0, -1.0, 1.0), (0.0, 0.0, 0.0))
    assert refused.value.field == "cell_size_mm"
