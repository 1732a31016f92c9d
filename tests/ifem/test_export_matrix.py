"""Exports of a bundle's matrices, each read back by its own reader."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ifem_bundles import make_bundle
from scipy.io import loadmat, mmread

from ifem_export.bundle.bundle import Bundle
from ifem_export.elements.material import Material
from ifem_export.errors import IfemError
from ifem_export.exports.matrix_files import export_matrix


def small_bundle() -> Bundle:
    return make_bundle(Material(0.147, 0.3223, 1020.0))


def test_matrix_market_reads_back_to_the_bit(tmp_path: Path) -> None:
    bundle = small_bundle()
    path = tmp_path / "k.mtx"
    export_matrix(bundle, path)
    read = mmread(path).tocsr()
    assert (abs(read - bundle.stiffness_matrix)).max() == 0.0
    assert b"symmetric" in path.read_bytes()[:60]


def test_mat_reads_back_and_counts_from_one(tmp_path: Path) -> None:
    bundle = small_bundle()
    path = tmp_path / "bundle.mat"
    export_matrix(bundle, path)
    read = loadmat(path)
    k = read["stiffness"]
    assert abs(k - bundle.stiffness_matrix.tocsc()).max() == 0.0
    np.testing.assert_array_equal(read["hexes"], bundle.mesh.hexes + 1)
    free = read["free_unknowns"].ravel() - 1
    u = np.asarray(bundle.self_test.displacement_mm).reshape(-1)
    force = k[:, free] @ u[free]
    np.testing.assert_allclose(force, np.asarray(bundle.self_test.force_n).reshape(-1), atol=1e-12)
    first = path.read_bytes()
    export_matrix(bundle, path)
    assert path.read_bytes() == first


def test_safetensors_read_back(tmp_path: Path) -> None:
    numpy_reader = pytest.importorskip(
        "safetensors.numpy", reason="SAFETENSORS NOT INSTALLED: its export was not checked"
    )
    from scipy.sparse import csr_array

    bundle = small_bundle()
    path = tmp_path / "bundle.safetensors"
    export_matrix(bundle, path)
    read = numpy_reader.load_file(path)
    n = 3 * bundle.mesh.n_nodes
    k = csr_array(
        (read["stiffness_data"], read["stiffness_indices"], read["stiffness_indptr"]), shape=(n, n)
    )
    assert abs(k - bundle.stiffness_matrix).max() == 0.0
    np.testing.assert_array_equal(read["nodes_mm"], bundle.mesh.nodes_mm)


def test_a_wrong_ending_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    with pytest.raises(IfemError) as caught:
        export_matrix(small_bundle(), tmp_path / "k.txt")
    assert (caught.value.field, caught.value.value) == ("path", ".txt")
    assert list(tmp_path.iterdir()) == []
