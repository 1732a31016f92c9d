"""Compliance of a fine pad by convolution: exact columns, windows, memory and adjoint fields."""

from __future__ import annotations

import numpy as np
import pytest
from contact_pads import YOUNGS_MPA, dense_compliance, small_pad

from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.compliance.convolved import ConvolvedCompliance
from ifem_export.elements.material import Material
from ifem_export.errors import MeshError
from ifem_export.mesh.crown import Paraboloid
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh
from ifem_export.operators import adjoint_fields as adjoint
from ifem_export.operators.pad_system import PadSystem


def rounded() -> Bundle:
    """A pad of 9 x 7 x 2 mm with rounded corners, whose sides differ."""
    mesh, _ = build_pad_mesh(RoundedRectangle(9.0, 7.0, 2.0), 2.0, cells=(12, 9, 2))
    return build_bundle(mesh, Material(YOUNGS_MPA, 0.45, 1000.0), "bbar", with_stiffness=False)


def nodes_at(bundle: Bundle, *places: tuple[float, float]) -> list[int]:
    points = np.asarray(bundle.mesh.surface_mm)[:, :2]
    return [int(np.argmin(np.linalg.norm(points - place, axis=1))) for place in places]


def test_columns_at_middle_edge_and_corner_are_exact() -> None:
    pad = rounded()
    fine, exact = ConvolvedCompliance(pad), dense_compliance(pad)
    for node in nodes_at(pad, (0.0, 0.0), (4.5, 0.0), (0.0, -3.5), (4.0, 3.0)):
        for axis in range(3):
            force = np.zeros((fine.nodes, 3))
            force[node, axis] = 1.0
            column = exact[:, 3 * node + axis].reshape(-1, 3)
            found = fine.whole(force, 1e-10)
            np.testing.assert_allclose(found, column, atol=1e-7 * np.abs(column).max())


def test_the_infinite_pad_is_exact_in_the_middle_and_not_at_the_edge() -> None:
    """What `infinite` lacks is 1 % of the column in the middle, and a third of it at the edge."""
    pad = small_pad(0.45, 20, 2, 20.0)
    fine = ConvolvedCompliance(pad)
    middle, edge = nodes_at(pad, (0.0, 0.0), (10.0, 0.0))
    lacks = []
    for node in (middle, edge):
        force = np.zeros((fine.nodes, 3))
        force[node, 2] = 1.0
        column = fine.whole(force)
        infinite = fine.displacement(np.array([node]), force[[node]])
        lacks.append(np.abs(column - infinite).max() / np.abs(column).max())
    assert lacks[0] < 0.01
    assert lacks[1] > 0.3


@pytest.mark.parametrize("reach", [0.0, 1.6, 4.0])
def test_the_window_of_a_box_is_the_whole_convolution(reach: float) -> None:
    pad = rounded()
    fine = ConvolvedCompliance(pad)
    points = np.asarray(pad.mesh.surface_mm)[:, :2]
    nodes = np.flatnonzero((np.abs(points - [0.8, 0.3]) < max(reach, 0.4)).all(axis=1))
    force = np.random.default_rng(1).standard_normal((len(nodes), 3))
    among = fine.block(nodes)
    whole = fine.displacement(nodes, force)
    np.testing.assert_allclose(
        among.displacement(force), whole[nodes], atol=1e-12 * np.abs(whole).max()
    )
    one = fine.displacement(nodes[:1], np.eye(3)[:1])[nodes[0]]
    np.testing.assert_allclose(among.own[:, 0], one, atol=1e-12 * np.abs(one).max())


def test_what_is_known_is_kept() -> None:
    fine = ConvolvedCompliance(rounded())
    nodes = np.array([3, 8])
    known = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    np.testing.assert_array_equal(fine.displacement(nodes, np.ones((2, 3)), known)[nodes], known)


def test_memory_grows_with_the_nodes() -> None:
    """Blocks per node stay the same while the table of columns per node grows fourfold."""
    sizes = [ConvolvedCompliance(small_pad(0.45, n, 3, 12.0)).n_bytes for n in (40, 80, 160)]
    slopes = np.diff(np.log(sizes)) / np.log(4)
    assert (slopes < 1.05).all(), slopes


@pytest.mark.parametrize("crown", [Paraboloid(0.4, 9.0), None])
def test_other_pads_are_refused(crown: Paraboloid | None) -> None:
    mesh, _ = build_pad_mesh(
        RoundedRectangle(8.3, 8.3, 1.0), 2.0, cells=(8, 8, 2), crown=crown,
        weighting="volume_fraction",
    )  # fmt: skip
    pad = build_bundle(mesh, Material(YOUNGS_MPA, 0.45, 1000.0), "bbar", with_stiffness=False)
    with pytest.raises(MeshError) as caught:
        ConvolvedCompliance(pad)
    assert caught.value.field == "mesh"


def test_adjoint_fields_need_no_matrix(monkeypatch: pytest.MonkeyPatch) -> None:
    pad = rounded()
    element = np.asarray(pad.element_matrix)
    expected = adjoint.adjoint_fields(PadSystem(pad.mesh, element)).forces
    monkeypatch.setattr(adjoint, "MOST_ASSEMBLED", 10)
    system = PadSystem(pad.mesh, element)
    found = adjoint.adjoint_fields(system).forces
    assert "_holder" not in system.__dict__
    np.testing.assert_allclose(found, expected, atol=1e-8 * np.abs(expected).max())
