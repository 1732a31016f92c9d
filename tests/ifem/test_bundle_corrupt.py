import pickle

import numpy as np
import pytest
from ifem_bundles import edit, flip_byte, reseal

from ifem_export.bundle.files import load_bundle
from ifem_export.bundle.layout import bundle_arrays
from ifem_export.errors import BundleError

ARRAYS = [
    "nodes_mm",
    "hexes",
    "occupancy",
    "bonded_nodes",
    "free_nodes",
    "surface_nodes",
    "side_nodes",
    "element_matrix_n_per_mm",
    "self_test_displacement_mm",
    "self_test_force_n",
    "stiffness_data_n_per_mm",
    "stiffness_indices",
    "stiffness_indptr",
    "marker_positions_mm",
    "interpolation_data",
    "interpolation_indices",
    "interpolation_indptr",
    "thin_plate",
    "thin_plate_bending",
    "marker_row",
    "marker_kind",
]


def test_the_list_of_arrays_is_complete(bundle):
    assert sorted(bundle_arrays(bundle)) == sorted(ARRAYS)


@pytest.mark.parametrize("name", ARRAYS)
def test_a_flipped_byte_in_any_array_is_refused(stored, name):
    flip_byte(stored / f"{name}.npy", -9)
    with pytest.raises(BundleError, match=f"^{name}.npy: its SHA-256 differs.*copy the bundle"):
        load_bundle(stored)


@pytest.mark.parametrize("name", ARRAYS)
@pytest.mark.parametrize("verify", [True, False])
def test_a_truncated_array_is_refused_even_unverified(stored, name, verify):
    path = stored / f"{name}.npy"
    path.write_bytes(path.read_bytes()[:-8])
    with pytest.raises(BundleError, match=f"^{name}.npy: is truncated or damaged"):
        load_bundle(stored, verify=verify)


@pytest.mark.parametrize("name", ARRAYS)
def test_a_missing_array_is_refused(stored, name):
    (stored / f"{name}.npy").unlink()
    with pytest.raises(BundleError, match=f"^{name}.npy: is missing"):
        load_bundle(stored, verify=False)


@pytest.mark.parametrize("cut", [0, 5, 40])
def test_a_cut_header_is_refused(stored, cut):
    path = stored / "hexes.npy"
    path.write_bytes(path.read_bytes()[:cut])
    with pytest.raises(BundleError, match=r"^hexes\.npy: is "):
        load_bundle(stored)


class Bomb:
    """Unpickling this would touch the file it is told to."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return (open, (self.path, "w"))


@pytest.mark.parametrize("form", ["npy", "bare"])
def test_pickled_objects_are_refused_and_never_run(stored, tmp_path, form):
    witness = tmp_path / "witness"
    bomb = Bomb(str(witness))
    if form == "npy":
        np.save(stored / "nodes_mm.npy", np.array([bomb], dtype=object), allow_pickle=True)
    else:
        (stored / "nodes_mm.npy").write_bytes(pickle.dumps(bomb))
    for verify in (True, False):
        with pytest.raises(BundleError, match=r"^nodes_mm\.npy: holds pickled Python objects"):
            load_bundle(stored, verify=verify)
    assert not witness.exists()


def test_an_array_of_another_shape_is_refused(stored):
    edit(stored, "nodes_mm", lambda a: a[:-1])
    with pytest.raises(BundleError, match=r"^nodes_mm\.npy: holds float64 .* the manifest says"):
        load_bundle(stored, verify=False)
    reseal(stored)
    with pytest.raises(BundleError, match=r"^nodes_mm\.npy: holds .* expected"):
        load_bundle(stored, verify=False)


def put(index, value):
    def change(array):
        array[index] = value

    return change


@pytest.mark.parametrize(
    ("name", "change", "reason"),
    [
        ("stiffness_data_n_per_mm", put(5, np.nan), "1 values that are not finite"),
        ("nodes_mm", put((3, 1), np.inf), "not finite"),
        ("self_test_force_n", put((3, 1), np.nan), "not finite"),
        ("marker_positions_mm", put((0, 0), np.nan), "not finite"),
        ("interpolation_data", put(0, np.nan), "not finite"),
        ("stiffness_data_n_per_mm", lambda a: a * (1 + 1e-6), "K gives other forces"),
        ("element_matrix_n_per_mm", lambda a: a * (1 + 1e-6), "element of this material"),
        ("self_test_force_n", lambda a: a * 1.001, "recipe gives other forces"),
        ("self_test_force_n", lambda a: a * 0.0, "zero everywhere"),
        ("nodes_mm", lambda a: a + 0.01, "does not follow from the occupancy"),
        ("hexes", put((2, 3), 0), "does not follow from the occupancy"),
        ("hexes", put((2, 3), 10**6), "does not follow from the occupancy"),
        ("surface_nodes", put(0, 0), "does not follow from the occupancy"),
        ("side_nodes", put(0, -5), "does not follow from the occupancy"),
        ("free_nodes", put(0, 0), "does not follow from the bonded nodes"),
        ("stiffness_indices", put(0, 10**6), "out of range"),
        ("stiffness_indices", put(0, -1), "out of range"),
        ("stiffness_indptr", put(7, 0), "out of order"),
        ("interpolation_indices", put(0, 99), "out of range"),
        ("interpolation_data", lambda a: a * 1.01, "sum to one"),
        ("thin_plate", put((3, 4), np.nan), "not finite"),
        ("thin_plate", lambda a: a * 1.01, "sum to one"),
        ("thin_plate_bending", put((3, 4), 9.0), "bending energy"),
        ("thin_plate_bending", lambda a: a + a.max(), "bending energy"),
    ],
)
def test_wrong_content_with_honest_checksums_is_refused(stored, name, change, reason):
    edit(stored, name, change)
    reseal(stored)
    with pytest.raises(BundleError, match=f"^{name}.npy: .*{reason}.*rebuild"):
        load_bundle(stored)


def test_another_occupancy_is_refused(stored):
    edit(stored, "occupancy", put((5, 5, 0), False))
    reseal(stored)
    with pytest.raises(BundleError, match="does not follow from the occupancy"):
        load_bundle(stored)


def test_moved_markers_no_longer_match_the_geometry_hash(stored):
    edit(stored, "marker_positions_mm", lambda a: a + 0.01)
    reseal(stored)
    with pytest.raises(BundleError, match=r"manifest\.json: geometry hash does not match"):
        load_bundle(stored)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda m: m["material"].update(youngs_modulus_mpa=0.2), "element of this material"),
        (lambda m: m["material"].update(poissons_ratio=0.7), "poissons_ratio"),
        (lambda m: m["material"].update(colour="red"), "malformed"),
        (lambda m: m["element"].update(formulation="bbar"), "element of this material"),
        (lambda m: m["element"].update(formulation="magic"), "must be one of full, bbar"),
        (lambda m: m["mesh"].update(cell_size_mm=[0.4, 0.4]), "3 values"),
        (lambda m: m["mesh"].pop("nodes"), "malformed"),
        (lambda m: m["arrays"].pop("hexes"), r"hexes\.npy: is not listed"),
        (lambda m: m["arrays"]["hexes"].update(file="../../hexes.npy"), "malformed"),
        (lambda m: m["arrays"]["hexes"].update(dtype="|O"), "malformed"),
        (lambda m: m["arrays"]["hexes"].update(shape=[-1, 8]), "malformed"),
        (lambda m: m.pop("camera"), "'camera' is missing"),
        (lambda m: m.update(markers={}), "'markers' is malformed"),
    ],
)
def test_wrong_manifests_with_an_honest_seal_are_refused(stored, change, reason):
    reseal(stored, change, rehash=False)
    with pytest.raises(BundleError, match=reason):
        load_bundle(stored)


def test_an_edited_manifest_is_refused_without_verification_too(stored):
    path = stored / "manifest.json"
    path.write_text(path.read_text().replace("0.147", "0.148"))
    with pytest.raises(BundleError, match=r"manifest\.json: .*altered"):
        load_bundle(stored, verify=False)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "not valid JSON"),
        (b"{", "not valid JSON"),
        (b"\xff\xfe", "not valid JSON"),
        (b"[" * 100_000, "not valid JSON"),
        (b"[1]", "not a JSON object"),
        (b"{}", "format is None"),
        (b'{"format": "gelslim-bundle/2"}', "gelslim-bundle/2.*use the release that wrote it"),
    ],
)
def test_broken_manifests_are_refused(stored, content, reason):
    (stored / "manifest.json").write_bytes(content)
    with pytest.raises(BundleError, match=reason):
        load_bundle(stored)


def test_another_sensors_bundle_is_refused(stored, bundle):
    load_bundle(stored, expected_geometry_hash=bundle.geometry_hash)
    with pytest.raises(BundleError, match=r"belongs to another sensor.*built for this sensor"):
        load_bundle(stored, verify=False, expected_geometry_hash="0" * 64)


def test_wrong_paths_are_refused(tmp_path):
    with pytest.raises(BundleError, match="does not exist"):
        load_bundle(tmp_path / "nothing")
    (tmp_path / "file").write_text("")
    with pytest.raises(BundleError, match="is a file"):
        load_bundle(tmp_path / "file")
    (tmp_path / "empty").mkdir()
    with pytest.raises(BundleError, match=r"manifest\.json: is missing"):
        load_bundle(tmp_path / "empty")
