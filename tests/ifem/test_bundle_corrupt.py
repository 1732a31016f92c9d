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


def refused_file(folder, **options) -> str:
    """Name of the file that loading the bundle finds fault with."""
    with pytest.raises(BundleError) as caught:
        load_bundle(folder, **options)
    assert caught.value.reason
    assert caught.value.remedy
    assert caught.value.to_dict()["file"] == caught.value.file
    return caught.value.file


def test_the_list_of_arrays_is_complete(bundle):
    assert sorted(bundle_arrays(bundle)) == sorted(ARRAYS)


@pytest.mark.parametrize("name", ARRAYS)
def test_a_flipped_byte_in_any_array_is_refused(stored, name):
    flip_byte(stored / f"{name}.npy", -9)
    assert refused_file(stored) == f"{name}.npy"


@pytest.mark.parametrize("name", ARRAYS)
@pytest.mark.parametrize("verify", [True, False])
def test_a_truncated_array_is_refused_even_unverified(stored, name, verify):
    path = stored / f"{name}.npy"
    path.write_bytes(path.read_bytes()[:-8])
    assert refused_file(stored, verify=verify) == f"{name}.npy"


@pytest.mark.parametrize("name", ARRAYS)
def test_a_missing_array_is_refused(stored, name):
    (stored / f"{name}.npy").unlink()
    assert refused_file(stored, verify=False) == f"{name}.npy"


@pytest.mark.parametrize("cut", [0, 5, 40])
def test_a_cut_header_is_refused(stored, cut):
    path = stored / "hexes.npy"
    path.write_bytes(path.read_bytes()[:cut])
    assert refused_file(stored) == "hexes.npy"


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
        assert refused_file(stored, verify=verify) == "nodes_mm.npy"
    assert not witness.exists()


def test_an_array_of_another_shape_is_refused(stored):
    edit(stored, "nodes_mm", lambda a: a[:-1])
    assert refused_file(stored, verify=False) == "nodes_mm.npy"
    reseal(stored)
    assert refused_file(stored, verify=False) == "nodes_mm.npy"


def put(index, value):
    def change(array):
        array[index] = value

    return change


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("stiffness_data_n_per_mm", put(5, np.nan)),
        ("nodes_mm", put((3, 1), np.inf)),
        ("self_test_force_n", put((3, 1), np.nan)),
        ("marker_positions_mm", put((0, 0), np.nan)),
        ("interpolation_data", put(0, np.nan)),
        ("stiffness_data_n_per_mm", lambda a: a * (1 + 1e-6)),
        ("element_matrix_n_per_mm", lambda a: a * (1 + 1e-6)),
        ("self_test_force_n", lambda a: a * 1.001),
        ("self_test_force_n", lambda a: a * 0.0),
        ("nodes_mm", lambda a: a + 0.01),
        ("nodes_mm", lambda a: a[:, [1, 0, 2]].copy()),
        ("hexes", put((2, 3), 0)),
        ("hexes", put((2, 3), 10**6)),
        ("surface_nodes", put(0, 0)),
        ("side_nodes", put(0, -5)),
        ("free_nodes", put(0, 0)),
        ("stiffness_indices", put(0, 10**6)),
        ("stiffness_indices", put(0, -1)),
        ("stiffness_indptr", put(7, 0)),
        ("interpolation_indices", put(0, 99)),
        ("interpolation_data", lambda a: a * 1.01),
        ("thin_plate", put((3, 4), np.nan)),
        ("thin_plate", lambda a: a * 1.01),
        ("thin_plate_bending", put((3, 4), 9.0)),
        ("thin_plate_bending", lambda a: a + a.max()),
    ],
)
def test_wrong_content_with_honest_checksums_is_refused(stored, name, change):
    edit(stored, name, change)
    reseal(stored)
    assert refused_file(stored) == f"{name}.npy"


def test_another_occupancy_is_refused(stored):
    edit(stored, "occupancy", put((5, 5, 0), False))
    reseal(stored)
    assert refused_file(stored) == "hexes.npy"


def test_moved_markers_no_longer_match_the_geometry_hash(stored):
    edit(stored, "marker_positions_mm", lambda a: a + 0.01)
    reseal(stored)
    assert refused_file(stored) == "manifest.json"


@pytest.mark.parametrize(
    ("change", "file"),
    [
        (lambda m: m["material"].update(youngs_modulus_mpa=0.2), "element_matrix_n_per_mm.npy"),
        (lambda m: m["material"].update(poissons_ratio=0.7), "manifest.json"),
        (lambda m: m["material"].update(colour="red"), "manifest.json"),
        (lambda m: m["element"].update(formulation="bbar"), "element_matrix_n_per_mm.npy"),
        (lambda m: m["element"].update(formulation="magic"), "manifest.json"),
        (lambda m: m["mesh"].update(cell_size_mm=[0.4, 0.4]), "manifest.json"),
        (lambda m: m["mesh"]["cell_size_mm"].reverse(), "element_matrix_n_per_mm.npy"),
        (lambda m: m["mesh"].pop("nodes"), "manifest.json"),
        (lambda m: m["arrays"].pop("hexes"), "hexes.npy"),
        (lambda m: m["arrays"]["hexes"].update(file="../../hexes.npy"), "manifest.json"),
        (lambda m: m["arrays"]["hexes"].update(dtype="|O"), "manifest.json"),
        (lambda m: m["arrays"]["hexes"].update(shape=[-1, 8]), "manifest.json"),
        (lambda m: m.pop("camera"), "manifest.json"),
        (lambda m: m.update(markers={}), "manifest.json"),
    ],
)
def test_wrong_manifests_with_an_honest_seal_are_refused(stored, change, file):
    reseal(stored, change, rehash=False)
    assert refused_file(stored) == file


def test_an_edited_manifest_is_refused_without_verification_too(stored):
    path = stored / "manifest.json"
    path.write_text(path.read_text().replace("0.147", "0.148"))
    assert refused_file(stored, verify=False) == "manifest.json"


@pytest.mark.parametrize(
    "content",
    [b"", b"{", b"\xff\xfe", b"[" * 100_000, b"[1]", b"{}", b'{"format": "gelslim-bundle/2"}'],
)
def test_broken_manifests_are_refused(stored, content):
    (stored / "manifest.json").write_bytes(content)
    assert refused_file(stored) == "manifest.json"


def test_wrong_paths_are_refused(tmp_path):
    assert refused_file(tmp_path / "nothing") == str(tmp_path / "nothing")
    (tmp_path / "file").write_text("")
    assert refused_file(tmp_path / "file") == str(tmp_path / "file")
    (tmp_path / "empty").mkdir()
    assert refused_file(tmp_path / "empty") == "manifest.json"
