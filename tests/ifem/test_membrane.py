"""Membranes on the gel: strain energy, waves on a bonded layer, both ways to a compliance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from contact_pads import YOUNGS_MPA, dense_compliance, small_pad
from numpy.typing import NDArray

from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.bundle.files import load_bundle, write_bundle
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.compliance.convolved import ConvolvedCompliance
from ifem_export.elements.material import Material
from ifem_export.elements.membrane import membrane_stiffness
from ifem_export.elements.skin import Membrane, Skin, restiffened
from ifem_export.errors import IfemError, MeshError
from ifem_export.mesh.crown import Paraboloid
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh
from ifem_export.operators.pad_system import PadSystem
from ifem_export.operators.surface_operator import Rung

Array = NDArray[np.float64]
COAT, FABRIC = Membrane(0.04, 0.45), Membrane(0.3, 0.2)
N, NU = FABRIC.stiffness_n_per_mm, FABRIC.poissons_ratio


def bundle_of(mesh: PadMesh) -> Bundle:
    return build_bundle(mesh, Material(YOUNGS_MPA, 0.45, 1000.0), "bbar", with_stiffness=False)


def wave_stiffness(cells: int, layers: int, waves: int) -> Array:
    """Force per area over displacement (3, 3) of a wave along x on an endless gel in fabric.

    The lattice of a pad of 12 x 12 x 2 mm is periodic with its padding, so that the wave fits.
    """
    fine = ConvolvedCompliance(small_pad(0.45, cells, layers), (FABRIC,))
    made = fine.infinite
    return np.asarray(made.stiffness[0, waves]) / (12.0 / cells) ** 2


def wave_number(cells: int, waves: int) -> float:
    made = ConvolvedCompliance(small_pad(0.45, cells, 2)).infinite
    return 2 * np.pi * waves / (made.shape[1] * 12.0 / cells)


@pytest.mark.parametrize(("axis", "of_skin"), [(0, N / (1 - NU**2)), (1, N / (2 * (1 + NU)))])
def test_energy_of_stretch_and_shear(axis: int, of_skin: float) -> None:
    """A pad of 9 x 7 mm with rounded corners, stretched or sheared by 1 % along x."""
    mesh, _ = build_pad_mesh(RoundedRectangle(9.0, 7.0, 2.0), 2.0, cells=(12, 9, 2))
    area = np.asarray(mesh.occupancy)[:, :, -1].sum() * np.prod(mesh.cell_size_mm[:2])
    u = np.zeros((len(mesh.surface), 3))
    u[:, axis] = 0.01 * np.asarray(mesh.surface_mm)[:, 0]
    energy = 0.5 * u.ravel() @ membrane_stiffness(mesh, (FABRIC,)) @ u.ravel()
    assert energy == pytest.approx(0.5 * of_skin * 0.01**2 * area, rel=1e-12)


def test_turning_and_lifting_cost_nothing() -> None:
    mesh = small_pad(0.45, 6, 2, 6.0).mesh
    x, y, _ = np.asarray(mesh.surface_mm).T
    turned = np.column_stack([-y, x, np.sin(x) + y**2])
    stiffness = membrane_stiffness(mesh, (COAT, FABRIC))
    np.testing.assert_allclose(stiffness @ turned.ravel(), 0.0, atol=1e-14)


def test_a_shear_wave_on_a_layer_in_fabric() -> None:
    """Motion along y that varies along x: G k coth(k h) of the layer and N k²/(2 (1 + ν))."""
    cells, waves, thick = 96, 6, 2.0
    k, shear = wave_number(cells, waves), YOUNGS_MPA / (2 * 1.45)
    layer = shear * k / np.tanh(k * thick)
    skin = N / (2 * (1 + NU)) * k**2
    # The skin has a share that the test can see.
    assert skin > 2 * layer
    found = wave_stiffness(cells, 8, waves)[1, 1]
    assert found == pytest.approx(layer + skin, rel=1e-2)


def test_a_stretching_wave_adds_to_the_layer() -> None:
    """Motion along x that varies along x: N k²/(1 - ν²) more than the bare gel."""
    cells, waves = 96, 6
    k = wave_number(cells, waves)
    bare = ConvolvedCompliance(small_pad(0.45, cells, 3)).infinite.stiffness[0, waves]
    added = wave_stiffness(cells, 3, waves) - bare / (12.0 / cells) ** 2
    expected = np.zeros((3, 3))
    expected[0, 0] = N / (1 - NU**2) * k**2
    expected[1, 1] = N / (2 * (1 + NU)) * k**2
    np.testing.assert_allclose(added, expected, atol=0.01 * expected.max())


@pytest.mark.parametrize("rounded", [False, True])
def test_both_compliances_are_the_inverse_of_the_sum(rounded: bool) -> None:
    mesh, _ = build_pad_mesh(RoundedRectangle(9.0, 7.0, 2.0), 2.0, cells=(12, 9, 2))
    pad, skin = bundle_of(mesh) if rounded else small_pad(0.45, 10, 2, 8.0), (COAT, FABRIC)
    whole = np.linalg.inv(dense_compliance(pad)) + membrane_stiffness(pad.mesh, skin).toarray()
    expected = np.linalg.inv(whole)
    force = np.random.default_rng(2).standard_normal((len(pad.mesh.surface), 3))
    moved = (expected @ force.ravel()).reshape(-1, 3)
    table = SurfaceCompliance(pad, None, skin)
    nodes = np.arange(len(force))
    close = {"atol": 2e-6 * np.abs(moved).max()}
    np.testing.assert_allclose(table.displacement(nodes, force), moved, **close)
    np.testing.assert_allclose(table.whole(force), moved, **close)
    np.testing.assert_allclose(ConvolvedCompliance(pad, skin).whole(force, 1e-9), moved, **close)


def test_a_skin_has_columns_of_its_own() -> None:
    pad = small_pad(0.45, 6, 2, 6.0)
    keys = {SurfaceCompliance(pad, None, skin).key for skin in ((), (COAT,), (FABRIC,))}
    assert len(keys) == 3


def test_a_bundle_keeps_its_skin(tmp_path) -> None:
    bare = small_pad(0.45, 6, 2, 6.0)
    for name, skin in (("coat", Skin(COAT, friction=0.7)), ("both", Skin(COAT, FABRIC))):
        made = build_bundle(bare.mesh, bare.material, "bbar", with_stiffness=False, skin=skin)
        write_bundle(tmp_path / name, made)
        assert load_bundle(tmp_path / name).skin == skin
    write_bundle(tmp_path / "bare", bare)
    assert load_bundle(tmp_path / "bare").skin is None
    assert '"skin"' not in (tmp_path / "bare" / "manifest.json").read_text()


@pytest.mark.parametrize(
    ("values", "field"),
    [((0.0, 0.3), "stiffness_n_per_mm"), ((np.nan, 0.3), "stiffness_n_per_mm"),
     ((1.0, 0.5), "poissons_ratio"), ((1.0, -0.1), "poissons_ratio")],
)  # fmt: skip
def test_what_is_no_membrane(values: tuple[float, float], field: str) -> None:
    with pytest.raises(IfemError) as caught:
        Membrane(*values)
    assert caught.value.field == field


def test_no_skin_on_a_crown() -> None:
    mesh, _ = build_pad_mesh(
        RoundedRectangle(8.0, 8.0, 1.0), 2.0, cells=(8, 8, 2), crown=Paraboloid(0.4, 9.0)
    )
    with pytest.raises(MeshError) as caught:
        membrane_stiffness(mesh, (FABRIC,))
    assert caught.value.field == "mesh"


EXACT: tuple[tuple[Rung, float], ...] = (
    ("factor", 1e-9), ("pcg", 1e-4), ("dense32", 1e-5), ("paper", 1e-9),
)  # fmt: skip


@pytest.mark.parametrize(("rung", "close"), EXACT)
def test_operators_contain_the_skin_of_a_bundle(rung: Rung, close: float) -> None:
    """The forces of the bare operator and those of the membranes, and back."""
    pad = replace(small_pad(0.45, 10, 2, 8.0), skin=Skin(COAT, FABRIC))
    motion = np.random.default_rng(1).standard_normal((len(pad.mesh.surface), 3))
    own = (membrane_stiffness(pad.mesh, pad.membranes) @ motion.ravel()).reshape(-1, 3)
    expected = own + pad.surface_operator(rung, membranes=()).force(motion)
    operator = pad.surface_operator(rung)
    force = operator.force(motion)
    np.testing.assert_allclose(force, expected, atol=close * np.abs(own).max())
    np.testing.assert_allclose(operator.displacement(force), motion, atol=max(close, 1e-6) * 4)


@pytest.mark.parametrize("membranes", [(), (COAT, FABRIC)])
def test_the_mirrored_compliance_is_that_of_the_infinite_pad(
    membranes: tuple[Membrane, ...],
) -> None:
    pad = small_pad(0.45, 9, 3, 8.0)
    system = PadSystem(pad.mesh, np.asarray(pad.element_matrix), membranes)
    force = np.random.default_rng(2).standard_normal((1, system.columns, 3))
    found, expected = system.mirrored_compliance(force), system.infinite_compliance(force)
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())


def test_convolutions_contain_the_skin_within_the_pad() -> None:
    """On a smooth bump in the middle, which no edge sees."""
    pad = replace(small_pad(0.45, 24, 2, 14.0), skin=Skin(FABRIC))
    x, y = np.asarray(pad.mesh.surface_mm)[:, :2].T
    motion = np.zeros((len(x), 3))
    motion[:, 0] = (x + 0.5 * y) * np.exp(-(x**2 + y**2) / 4)
    motion[:, 1] = y * np.exp(-(x**2 + y**2) / 4)
    exact = pad.surface_operator("factor")
    force = exact.force(motion)
    bare = pad.surface_operator("factor", membranes=()).force(motion)
    assert np.abs(force - bare).max() > 0.3 * np.abs(force).max()
    for rung, close in (("fft", 0.02), ("truncated", 0.05)):
        found = pad.surface_operator(rung).force(motion)
        np.testing.assert_allclose(found, force, atol=close * np.abs(force).max())
    moved = pad.surface_operator("fft", lumped=1).displacement(force)
    np.testing.assert_allclose(moved, motion, atol=0.02 * np.abs(motion).max())


def test_force_and_torque_of_a_motion_do_not_know_the_skin() -> None:
    pad = small_pad(0.45, 10, 2, 8.0)
    worn = replace(pad, skin=Skin(COAT, FABRIC))
    motion = np.random.default_rng(2).standard_normal((len(pad.mesh.surface), 3))
    points = np.asarray(pad.mesh.surface_mm)
    force = worn.surface_operator("factor").force(motion)
    found = np.concatenate([force.sum(axis=0), np.cross(points, force).sum(axis=0)])
    np.testing.assert_allclose(found, pad.adjoint.wrench(motion), atol=1e-9)
    np.testing.assert_allclose(found, worn.adjoint.wrench(motion), atol=1e-9)


def test_a_crowned_pad_counts_as_bare() -> None:
    mesh, _ = build_pad_mesh(
        RoundedRectangle(8.0, 8.0, 1.0), 2.0, cells=(8, 8, 2), crown=Paraboloid(0.4, 9.0)
    )
    pad = replace(bundle_of(mesh), skin=Skin(FABRIC))
    assert pad.membranes == ()
    with pytest.raises(MeshError) as caught:
        pad.surface_operator("pcg", membranes=(FABRIC,))
    assert caught.value.field == "mesh"


def test_another_stiffness_keeps_the_proportion_of_the_layers() -> None:
    skin = restiffened(Skin(COAT, FABRIC, 0.6), 0.17)
    assert skin.stiffness_n_per_mm == pytest.approx(0.17)
    assert skin.coat is not None
    assert skin.fabric is not None
    assert skin.fabric.stiffness_n_per_mm / skin.coat.stiffness_n_per_mm == pytest.approx(
        0.3 / 0.04
    )
    assert skin.plane_stiffness_n_per_mm == pytest.approx(0.02 / (1 - 0.45**2) + 0.15 / (1 - 0.04))
    assert skin.friction == 0.6
    assert restiffened(None, 0.2).membranes == (Membrane(0.2),)
    assert restiffened(Skin(COAT), 0.0).membranes == ()
    with pytest.raises(IfemError):
        restiffened(None, -0.1)
