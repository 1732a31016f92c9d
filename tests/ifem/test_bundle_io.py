import json
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ifem_bundles import CAMERA, flip_byte, make_bundle

import ifem_export
from gelslim_core.files import replaced_folder
from ifem_export.bundle import files as bundle_io
from ifem_export.bundle.bundle import build_bundle
from ifem_export.bundle.files import load_bundle, summarise_bundle, write_bundle
from ifem_export.bundle.layout import bundle_arrays
from ifem_export.errors import BundleError, IfemError
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh

ROOT = Path(ifem_export.__file__).parents[1]


def is_mapped(array) -> bool:
    while array is not None and not isinstance(array, np.memmap):
        array = getattr(array, "base", None)
    return array is not None


def test_round_trip(bundle, stored):
    back = load_bundle(stored)
    ours, theirs = bundle_arrays(bundle.with_adjoint()), bundle_arrays(back)
    assert ours.keys() == theirs.keys()
    for name, array in ours.items():
        assert np.array_equal(array, theirs[name]), name
        assert array.dtype == theirs[name].dtype, name
    assert back.material == bundle.material
    assert back.formulation == "full"
    assert back.camera == CAMERA
    assert back.spec_hash == "5pec"
    assert back.geometry_hash == bundle.geometry_hash
    assert back.mesh.cell_size_mm == bundle.mesh.cell_size_mm
    assert back.mesh.origin_mm == bundle.mesh.origin_mm
    assert (back.stiffness_matrix != bundle.stiffness_matrix).nnz == 0


def test_recipe_alone_rebuilds_the_same_matrix(gel, bundle, tmp_path):
    write_bundle(tmp_path / "recipe", make_bundle(gel, with_stiffness=False))
    assert not (tmp_path / "recipe" / "stiffness_data_n_per_mm.npy").exists()
    back = load_bundle(tmp_path / "recipe")
    assert back.stiffness is None
    difference = back.stiffness_matrix - bundle.stiffness
    assert difference.nnz == 0 or np.abs(difference.data).max() == 0.0


def test_arrays_are_mapped_and_read_only(stored):
    back = load_bundle(stored)
    assert is_mapped(back.stiffness.data)
    assert is_mapped(back.stiffness.indices)
    for name, array in bundle_arrays(back).items():
        assert is_mapped(array) or name == "free_nodes", name
    with pytest.raises(ValueError, match="read-only"):
        back.stiffness.data[0] = 1.0


def test_opening_is_lazy(stored):
    """Without verification the matrix is not read, so a flipped byte goes unseen until then."""
    flip_byte(stored / "stiffness_data_n_per_mm.npy")
    back = load_bundle(stored, verify=False)
    assert is_mapped(back.stiffness.data)
    with pytest.raises(BundleError) as caught:
        load_bundle(stored)
    assert caught.value.file == "stiffness_data_n_per_mm.npy"


def test_an_inconsistent_bundle_is_not_written(bundle, tmp_path):
    broken = bundle.stiffness.copy()
    broken.data[0] = np.nan
    changed = type(bundle)(**{**vars_of(bundle), "stiffness": broken})
    with pytest.raises(BundleError) as caught:
        write_bundle(tmp_path / "b", changed)
    assert caught.value.file == "stiffness_data_n_per_mm.npy"
    assert list(tmp_path.iterdir()) == []


def vars_of(bundle):
    return {name: getattr(bundle, name) for name in bundle.__dataclass_fields__}


def test_writing_replaces_a_bundle_and_only_a_bundle(gel, bundle, stored):
    write_bundle(stored, make_bundle(gel, with_stiffness=False))
    assert load_bundle(stored).stiffness is None
    assert [p.name for p in stored.parent.iterdir()] == ["bundle"]
    other = stored.parent / "other"
    other.mkdir()
    (other / "thesis.txt").write_text("mine")
    with pytest.raises(BundleError) as caught:
        write_bundle(other, bundle)
    assert caught.value.file == str(other)
    assert (other / "thesis.txt").read_text() == "mine"


def test_a_failed_write_leaves_the_old_bundle(bundle, stored, monkeypatch):
    before = {p.name: p.read_bytes() for p in stored.iterdir()}

    def full_disk(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(bundle_io, "describe", full_disk)
    with pytest.raises(BundleError) as caught:
        write_bundle(stored, bundle)
    assert caught.value.file == str(stored)
    assert "No space left" in caught.value.reason
    assert {p.name: p.read_bytes() for p in stored.iterdir()} == before
    assert [p.name for p in stored.parent.iterdir()] == ["bundle"]


def test_a_failed_swap_puts_the_old_bundle_back(bundle, stored, monkeypatch):
    rename = replaced_folder.os.rename

    def refuse_new(source, target):
        if str(source).endswith(".building"):
            raise OSError(13, "Permission denied")
        rename(source, target)

    # As where the system cannot exchange two folders in one step.
    monkeypatch.setattr(replaced_folder, "_exchanged", lambda staging, place: False)
    monkeypatch.setattr(replaced_folder.os, "rename", refuse_new)
    with pytest.raises(BundleError) as caught:
        write_bundle(stored, bundle)
    assert caught.value.file == str(stored)
    monkeypatch.undo()
    load_bundle(stored)
    assert [p.name for p in stored.parent.iterdir()] == ["bundle"]


@pytest.mark.slow
def test_the_same_pad_gives_the_same_bytes_in_a_fresh_process(pristine, tmp_path):
    code = (
        "import sys; sys.path.insert(0, 'tests/ifem');"
        "from ifem_bundles import make_bundle;"
        "from ifem_export.bundle.files import write_bundle;"
        "from ifem_export.elements.material import Material;"
        "write_bundle(sys.argv[1], make_bundle(Material(0.147, 0.3223, 1070.0)))"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "b")], check=True, cwd=ROOT)
    ours = {p.name: p.read_bytes() for p in pristine.iterdir()}
    theirs = {p.name: p.read_bytes() for p in (tmp_path / "b").iterdir()}
    assert ours.keys() == theirs.keys()
    assert all(ours[name] == theirs[name] for name in ours)


def test_summary(stored, bundle):
    summary = summarise_bundle(stored)
    json.dumps(summary)
    assert summary["format"] == "gelslim-bundle/1"
    assert summary["verification"] == {"ok": True}
    assert summary["mesh"]["nodes"] == bundle.mesh.n_nodes
    assert summary["mesh"]["cells"] == [20, 12, 1]
    assert summary["mesh"]["elements"] == 20 * 12 - 4 * cells_cut_per_corner()
    assert summary["markers"] == {
        "count": 35,
        "arrays": ["kind", "row"],
        "thin_plate": True,
    }
    assert summary["total_bytes"] == sum(p.stat().st_size for p in stored.glob("*.npy"))
    flip_byte(stored / "hexes.npy")
    verification = summarise_bundle(stored)["verification"]
    assert verification["ok"] is False
    assert verification["file"] == "hexes.npy"
    (stored / "hexes.npy").unlink()
    assert summarise_bundle(stored)["arrays"]["hexes"]["bytes"] is None


def cells_cut_per_corner():
    """Cells of one corner whose centre lies beyond the 1 mm corner radius."""
    x, y = np.meshgrid(0.2 + 0.4 * np.arange(3), 0.25 + 0.5 * np.arange(2))
    return int(((x < 1) & (y < 1) & (np.hypot(x - 1, y - 1) > 1)).sum())


def test_bundle_errors_survive_pickling():
    error = pickle.loads(pickle.dumps(BundleError("a.npy", "is missing", "copy it")))
    assert (error.file, error.reason, error.remedy) == ("a.npy", "is missing", "copy it")


def test_bundle_of_a_bare_pad(gel, tmp_path):
    mesh, _ = build_pad_mesh(RoundedRectangle(3.0, 2.0), 1.0, cells=(1, 1, 1))
    write_bundle(tmp_path / "one", build_bundle(mesh, gel, "bbar"))
    back = load_bundle(tmp_path / "one")
    assert back.markers is None
    assert back.formulation == "bbar"


def test_both_interpolations_come_back(bundle, pristine):
    from ifem_export.markers.interpolation_matrix import thin_plate_interpolation

    back = load_bundle(pristine).markers
    motion = np.random.default_rng(5).normal(size=(35, 3))
    lost = np.zeros(35, dtype=bool)
    lost[[3, 17]] = True
    for name in ("sparse", "thin_plate"):
        made, read = getattr(bundle.markers, name), getattr(back, name)
        assert np.array_equal(read(motion), made(motion))
        assert np.array_equal(read.with_missing(lost)(motion), made.with_missing(lost)(motion))
    surface = bundle.mesh.nodes_mm[bundle.mesh.surface]
    anew = thin_plate_interpolation(back.positions_mm, surface)
    assert back.thin_plate(motion) == pytest.approx(anew(motion), abs=1e-9)
    assert np.array_equal(back.sparse(motion), back.to_surface @ motion)


def test_a_bundle_without_a_spline_says_so(bundle, tmp_path):
    bare = replace(bundle, markers=replace(bundle.markers, spline=None))
    write_bundle(tmp_path / "bare", bare)
    back = load_bundle(tmp_path / "bare").markers
    assert back.spline is None
    with pytest.raises(IfemError) as caught:
        _ = back.thin_plate
    assert caught.value.field == "spline"
