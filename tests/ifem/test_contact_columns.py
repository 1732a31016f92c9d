"""Fits of forces with the columns of the compliance, which are exact up to the pad's edge."""

from __future__ import annotations

import numpy as np
import pytest
from ifem_shapes import Sphere

from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.compliance.contact_columns import ContactCompliance
from ifem_export.elements.material import Material
from ifem_export.errors import MeshError
from ifem_export.inverse.contact_inverse import masked_force
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh

SIDE_MM = 14.0
RADIUS_MM = 1.8


def bundle_of(nu: float = 0.49, crowned: bool = False) -> Bundle:
    options = {"crown": Sphere(60.0), "weighting": "volume_fraction"} if crowned else {}
    cells = (10, 9, 3) if crowned else (18, 18, 3)
    mesh, _ = build_pad_mesh(RoundedRectangle(SIDE_MM, SIDE_MM, 1.0), 2.0, cells=cells, **options)
    return build_bundle(mesh, Material(0.147, nu, 1020.0), "bbar", with_stiffness=False)


@pytest.fixture(scope="module")
def pad() -> Bundle:
    return bundle_of()


@pytest.fixture(scope="module")
def columns(pad: Bundle) -> ContactCompliance:
    return ContactCompliance(pad)


def pressed(points: np.ndarray, gap_mm: float) -> np.ndarray:
    """Hertz's pressure with shear, on a disc at this distance from the edge; it may be cut."""
    x = SIDE_MM / 2 - gap_mm - RADIUS_MM
    square = ((points[:, :2] - [x, 0.7]) ** 2).sum(axis=1) / RADIUS_MM**2
    share = np.sqrt(np.maximum(1 - square, 0.0))
    return share[:, None] * np.array([0.3, 0.1, -1.0]) / share.sum()


@pytest.mark.parametrize("gap_mm", [2.0, 0.0, -1.3])
def test_a_fit_is_right_up_to_the_edge(pad, columns, gap_mm: float) -> None:
    """The motion comes from the full stiffness; the infinite pad's fit is up to 14 times off."""
    force = pressed(np.asarray(pad.mesh.surface_mm), gap_mm)
    moved = pad.surface_operator("factor").displacement(force)
    touched = np.abs(force).sum(axis=1) > 0

    def error(operator) -> float:
        found = masked_force(operator, moved, touched, most_steps=2000, tolerance=1e-6).force_n
        return float(np.linalg.norm(found - force) / np.linalg.norm(force))

    assert error(columns) < 0.01
    if gap_mm < 1.0:
        assert error(pad.surface_operator("fft", lumped=1)) > 0.3


def test_products_are_kept_from_contact_to_contact(columns) -> None:
    rng = np.random.default_rng(4)
    nodes = rng.permutation(len(columns.bundle.mesh.surface))[:40]
    for chosen in (nodes[:25], np.sort(nodes[10:]), nodes[30:], nodes[:25]):
        rows, products = columns.contact_products(chosen)
        expected = rows.astype(float) @ rows.astype(float).T
        assert rows.shape == (3 * len(chosen), 3 * len(columns.bundle.mesh.surface))
        np.testing.assert_allclose(products, expected, rtol=0, atol=1e-5 * expected.max())


def test_a_crowned_pad_has_columns_too() -> None:
    pad = bundle_of(0.45, crowned=True)
    columns = ContactCompliance(pad)
    one = np.zeros((len(pad.mesh.surface), 3))
    some = np.array([3, len(one) // 2])
    one[some[1], 2] = 1.0
    expected = pad.surface_operator("factor").displacement(one)
    rows, _ = columns.contact_products(some)
    np.testing.assert_allclose(rows[5].reshape(-1, 3), expected, atol=1e-6 * expected.max())
    np.testing.assert_allclose(columns.displacement(one), expected, atol=1e-9 * expected.max())
    np.testing.assert_allclose(columns.force(expected), one, atol=1e-6)


@pytest.mark.parametrize("few", [512, 10])
def test_columns_near_the_edge_can_be_computed_ahead(few: int, monkeypatch) -> None:
    from ifem_export.compliance import contact_columns

    monkeypatch.setattr(contact_columns, "FEW", few)
    mesh, _ = build_pad_mesh(RoundedRectangle(16.0, 14.0, 1.0), 1.0, cells=(16, 14, 2))
    pad = build_bundle(mesh, Material(0.147, 0.45, 1020.0), "bbar", with_stiffness=False)
    columns = ContactCompliance(pad)
    columns.prepare()
    made = columns.compliance._made
    away = np.minimum(8 - np.abs(mesh.surface_mm[:, 0]), 7 - np.abs(mesh.surface_mm[:, 1]))
    np.testing.assert_array_equal(columns.near_edge[away < 1.4], True)
    assert made[away < 2.9].all()
    assert made.all() == (few == 512)
    monkeypatch.setattr(type(columns.compliance), "_solved", None)
    near = np.flatnonzero(away < 2.9)[::9]
    rows, _ = columns.contact_products(near)
    one = np.zeros((len(made), 3))
    one[near[3], 1] = 1.0
    expected = pad.surface_operator("factor").displacement(one)
    np.testing.assert_allclose(
        rows[10].reshape(-1, 3), expected, atol=1e-6 * np.abs(expected).max()
    )


def test_a_compliance_is_shared_by_those_that_use_a_bundle() -> None:
    first, second = bundle_of(), bundle_of()
    kept = ContactCompliance.shared(first)
    assert ContactCompliance.shared(first) is kept
    assert ContactCompliance.shared(second) is not kept


def test_a_pad_of_too_many_nodes_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    from ifem_export.compliance import table_size as table

    monkeypatch.setattr(table, "MOST_BYTES", 1000)
    with pytest.raises(MeshError) as caught:
        ContactCompliance(bundle_of())
    assert caught.value.field == "mesh"
