import numpy as np
import pytest
from ifem_bundles import MARKERS
from ifem_oracle import triplet_assembly

from ifem_export.bundle.bundle import Bundle, build_bundle, geometry_hash
from ifem_export.elements.material import Material
from ifem_export.errors import IfemError
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh


def force(bundle: Bundle, displacement_mm: np.ndarray) -> np.ndarray:
    """Nodal forces (n, 3) of a displacement (n, 3) of all nodes."""
    return (bundle.stiffness_matrix @ displacement_mm.ravel()).reshape(-1, 3)


@pytest.fixture(scope="module")
def paper_pad():
    """One layer, all free nodes on the outer surface."""
    return build_pad_mesh(RoundedRectangle(8.0, 6.0, 1.0), 2.0, pitch_mm=(0.4, 0.3))[0]


def test_force_is_k_times_u(paper_pad, gel):
    bundle = build_bundle(paper_pad, gel, "full")
    u = np.zeros((paper_pad.n_nodes, 3))
    u[paper_pad.free] = np.random.default_rng(0).normal(size=(len(paper_pad.free), 3))
    K = triplet_assembly(paper_pad, bundle.element_matrix)
    expected = (K @ u.ravel()).reshape(-1, 3)
    assert force(bundle, u) == pytest.approx(expected, abs=1e-13)
    assert np.abs(force(bundle, u).sum(axis=0)).max() < 1e-11


def test_force_without_stored_k_is_the_same(paper_pad, gel):
    stored = build_bundle(paper_pad, gel, "full")
    recipe = build_bundle(paper_pad, gel, "full", with_stiffness=False)
    assert recipe.stiffness is None
    u = stored.self_test.displacement_mm
    assert np.array_equal(force(stored, u), force(recipe, u))
    assert force(stored, u) == pytest.approx(stored.self_test.force_n, abs=1e-13)


def test_press_reads_the_closed_form_for_a_flat_punch_on_the_whole_face(paper_pad, gel):
    """The resultant F_z = (M/h) ∫ u_z dA of a bonded pad, for a uniform u_z."""
    bundle = build_bundle(paper_pad, gel, "full")
    u = np.zeros((paper_pad.n_nodes, 3))
    u[paper_pad.surface, 2] = -0.2
    hx, hy, _ = paper_pad.cell_size_mm
    area = paper_pad.n_elements * hx * hy
    total = force(bundle, u)[paper_pad.surface].sum(axis=0)
    assert total[2] == pytest.approx(
        (gel.lame_lambda_mpa + 2 * gel.shear_modulus_mpa) * (-0.1) * area, rel=1e-12
    )


def test_147_mpa_would_give_thousands_of_newtons(gel):
    """A 1 mm press of a 10 mm sphere: about 3 N at 0.147 MPa, kN at the printed 147 MPa."""
    mesh, _ = build_pad_mesh(RoundedRectangle(16.0, 16.0), 2.0, pitch_mm=0.25)
    u = np.zeros((mesh.n_nodes, 3))
    xy = mesh.nodes_mm[mesh.surface, :2]
    gap = np.hypot(*xy.T) ** 2 / (2 * 5.0)
    u[mesh.surface, 2] = -np.maximum(1.0 - gap, 0.0)
    newton = -force(build_bundle(mesh, gel, "full"), u)[mesh.surface, 2].sum()
    assert 1.0 < newton < 6.0
    stiff = Material(147.0, gel.poissons_ratio, gel.density_kg_m3)
    again = -force(build_bundle(mesh, stiff, "full"), u)[mesh.surface, 2].sum()
    assert again == pytest.approx(1000.0 * newton, rel=1e-12)


def test_markers_reach_the_surface_nodes(paper_pad, gel):
    bundle = build_bundle(paper_pad, gel, "full", marker_positions_mm=MARKERS)
    shear = np.tile([0.2, -0.1, 0.0], (len(MARKERS), 1))
    u = np.zeros((paper_pad.n_nodes, 3))
    u[paper_pad.surface] = bundle.markers.to_surface @ shear
    assert u[paper_pad.surface] == pytest.approx(
        np.tile([0.2, -0.1, 0.0], (len(paper_pad.surface), 1)), abs=1e-13
    )
    total = force(bundle, u)[paper_pad.surface].sum(axis=0)
    hx, hy, hz = paper_pad.cell_size_mm
    area = paper_pad.n_elements * hx * hy
    assert total[0] == pytest.approx(gel.shear_modulus_mpa * 0.2 / hz * area, rel=1e-12)
    assert total[1] == pytest.approx(-gel.shear_modulus_mpa * 0.1 / hz * area, rel=1e-12)


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"camera": {"f": float("nan")}}, "camera"),
        ({"camera": {"f": {1, 2}}}, "camera"),
        ({"marker_arrays": {"row": [1]}}, "marker_positions_mm"),
        ({"marker_positions_mm": MARKERS, "marker_arrays": {"row": [1]}}, "row"),
        ({"marker_positions_mm": MARKERS, "marker_arrays": {"../row": [1] * 35}}, "../row"),
        ({"marker_positions_mm": MARKERS, "marker_arrays": {"o": [{}] * 35}}, "o"),
    ],
)
def test_bad_parts_are_refused(paper_pad, gel, arguments, field):
    with pytest.raises(IfemError) as caught:
        build_bundle(paper_pad, gel, "full", **arguments)
    assert caught.value.field == field
    assert caught.value.to_dict()["field"] == field


def test_a_bundle_shows_itself_in_a_line(paper_pad, gel):
    bundle = build_bundle(paper_pad, gel, "full", marker_positions_mm=MARKERS)
    shown = str(bundle)
    assert repr(bundle) == shown
    assert "\n" not in shown
    assert len(shown) < 160
    for part in (
        f"{len(paper_pad.surface)} surface nodes",
        f"{len(MARKERS)} markers",
        "no traced light",
    ):
        assert part in shown


def test_geometry_hash_tells_pads_apart(paper_pad, gel):
    bundle = build_bundle(paper_pad, gel, "full", marker_positions_mm=MARKERS)
    softer = build_bundle(
        paper_pad, Material(0.1, 0.3, 1000.0), "bbar", marker_positions_mm=MARKERS
    )
    assert bundle.geometry_hash == softer.geometry_hash
    others = {
        geometry_hash(paper_pad, None),
        build_bundle(paper_pad, gel, "full", marker_positions_mm=MARKERS + 1e-3).geometry_hash,
    }
    for size, pitch in ((RoundedRectangle(8.0, 6.0, 2.0), 0.4), (RoundedRectangle(8, 6, 1), 0.41)):
        others.add(geometry_hash(build_pad_mesh(size, 2.0, pitch_mm=pitch)[0], bundle.markers))
    assert len(others) == 4
    assert bundle.geometry_hash not in others
