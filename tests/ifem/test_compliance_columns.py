"""The kept compliance against solves, its symmetry, and its file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from contact_pads import YOUNGS_MPA, dense_compliance, small_pad
from numpy.typing import NDArray
from scipy import sparse

from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.compliance import columns as module
from ifem_export.compliance import table_size
from ifem_export.compliance.columns import SurfaceCompliance, symmetries
from ifem_export.compliance.row_factor import LinAlgError, RowFactor
from ifem_export.elements.material import Material
from ifem_export.errors import MeshError
from ifem_export.mesh.crown import Paraboloid
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh

Array = NDArray[np.float64]
GEL = Material(YOUNGS_MPA, 0.49, 1000.0)


def bundle_of(mesh: PadMesh) -> Bundle:
    return build_bundle(mesh, GEL, "bbar", with_stiffness=False)


def pads() -> dict[str, tuple[Bundle, int]]:
    """Pads with the number of symmetries each has."""
    lopsided = np.ones((6, 5, 2), dtype=bool)
    lopsided[0, 0] = lopsided[1, 0] = False
    rounded, _ = build_pad_mesh(RoundedRectangle(7.0, 6.0, 2.0), 2.0, pitch_mm=1.0, layers=2)
    cut, _ = build_pad_mesh(
        RoundedRectangle(6.3, 6.3, 1.0), 2.0, pitch_mm=1.0, layers=2, weighting="volume_fraction"
    )
    domed, _ = build_pad_mesh(
        RoundedRectangle(6.0, 6.0), 2.0, cells=(6, 6, 3), crown=Paraboloid(0.4, 4.3),
        weighting="volume_fraction",
    )  # fmt: skip
    return {
        "square": (small_pad(0.49, 6, 2, 6.0), 8),
        "rounded": (bundle_of(rounded), 4),
        "lopsided": (
            bundle_of(PadMesh.from_occupancy(lopsided, (1, 1, 0.8), (5.0, -2.0, -1.6))),
            1,
        ),
        "one_layer": (small_pad(0.49, 6, 1, 6.0), 8),
        "cut": (bundle_of(cut), 1),
        "domed": (bundle_of(domed), 1),
    }


@pytest.mark.parametrize("name", ["square", "rounded", "lopsided", "one_layer", "cut", "domed"])
def test_columns_are_those_of_the_operator(name: str) -> None:
    pad, count = pads()[name]
    assert len(symmetries(pad.mesh)) == count
    kept = SurfaceCompliance(pad)
    nodes = np.random.default_rng(0).permutation(kept.nodes)
    force = np.random.default_rng(1).standard_normal((kept.nodes, 3))
    solved = pad.surface_operator("factor").displacement(force)
    size = np.abs(solved).max()
    np.testing.assert_allclose(kept.displacement(nodes, force[nodes]), solved, atol=2e-6 * size)
    np.testing.assert_allclose(kept.whole(force), solved, atol=1e-6 * size)
    some = nodes[:5]
    block = kept.block(some)
    np.testing.assert_array_equal(block, block.T)
    one = np.zeros_like(force)
    one[some[0], 1] = 1.0
    wanted = pad.surface_operator("factor").displacement(one)[some].reshape(-1)
    np.testing.assert_allclose(block[:, 1], wanted, atol=2e-6 * np.abs(wanted).max())


def test_images_are_not_solved_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "BATCH", 1)  # else neighbours fill the batch
    kept = SurfaceCompliance(small_pad(0.49, 6, 2, 6.0))
    assert len(np.unique(kept._originals)) == 10
    kept.require(np.array([0]))
    corners = np.flatnonzero(
        (np.abs(small_pad(0.49, 6, 2, 6.0).mesh.surface_mm[:, :2]) == 3).all(axis=1)
    )
    assert set(np.flatnonzero(kept._made)) == set(corners)


def test_columns_are_solved_once_in_whole_batches_of_neighbours(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A batch is filled up with the nearest numbers, on a symmetric pad with originals only."""
    monkeypatch.setattr(module, "BATCH", 4)
    batches: list[list[int]] = []
    solve = RowFactor.solve

    def watched(self: RowFactor, loads: Array) -> Array:
        nodes = (np.flatnonzero(loads.any(axis=1)) - (len(loads) - 3 * kept.nodes)) // 3
        batches.append(sorted(set(nodes.tolist())))
        assert loads.shape[1] == 3 * 4
        assert loads.sum() == 3 * len(batches[-1])
        return solve(self, loads)

    monkeypatch.setattr(RowFactor, "solve", watched)
    lopsided, symmetric = pads()["lopsided"][0], pads()["square"][0]
    kept = SurfaceCompliance(lopsided)
    kept.require(np.array([20]))
    kept.require(np.array([19, 22, 18]))
    kept.require(np.array([20, 23]))
    assert batches == [[18, 19, 20, 21], [22, 23, 24, 25]]
    batches.clear()
    kept = SurfaceCompliance(symmetric)
    kept.require(np.array([0]))
    kept.require(np.arange(kept.nodes))
    originals = sorted(node for batch in batches for node in batch)
    assert [len(batch) for batch in batches] == [4, 4, 2]
    assert len(set(originals)) == 10
    images = np.stack([s.image for s in symmetries(symmetric.mesh)])
    assert sorted(set(images.min(axis=0))) == originals


def test_file_is_taken_up_and_renewed(tmp_path: Path) -> None:
    pad = small_pad(0.49, 6, 2, 6.0)
    first = SurfaceCompliance(pad, tmp_path)
    force = np.random.default_rng(0).standard_normal((3, 3))
    moved = first.displacement(np.arange(3), force)
    first.store()
    (path,) = tmp_path.iterdir()
    stamp = path.read_bytes()
    again = SurfaceCompliance(pad, tmp_path)
    again._solved = None  # type: ignore[method-assign, assignment]
    np.testing.assert_array_equal(again.displacement(np.arange(3), force), moved)
    again.store()
    assert path.read_bytes() == stamp
    other = SurfaceCompliance(pad.with_gel(Material(0.2, 0.49, 1000.0)), tmp_path)
    assert not other._made.any()


@pytest.mark.parametrize("damage", [b"", b"nonsense", None])
def test_damaged_file_is_made_again(tmp_path: Path, damage: bytes | None) -> None:
    pad = small_pad(0.49, 6, 2, 6.0)
    kept = SurfaceCompliance(pad, tmp_path)
    kept.require(np.arange(4))
    kept.store()
    (path,) = tmp_path.iterdir()
    path.write_bytes(path.read_bytes()[:-1000] if damage is None else damage)
    again = SurfaceCompliance(pad, tmp_path)
    np.testing.assert_array_equal(again.block(np.arange(4)), kept.block(np.arange(4)))
    again.store()
    assert SurfaceCompliance(pad, tmp_path)._made.any()


def test_a_folder_that_cannot_be_written_does_not_matter(tmp_path: Path) -> None:
    kept = SurfaceCompliance(small_pad(0.49, 6, 2, 6.0), tmp_path / "missing")
    kept.require(np.arange(2))
    kept.store()
    assert not (tmp_path / "missing").exists()


def test_too_large_a_pad_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(table_size, "MOST_BYTES", 1000)
    with pytest.raises(MeshError, match="larger cells"):
        SurfaceCompliance(small_pad(0.49, 6, 2, 6.0))


def test_row_factor() -> None:
    rng = np.random.default_rng(4)
    row = rng.integers(0, 6, 60)
    root = rng.standard_normal((60, 60))
    dense = np.where(np.abs(row[:, None] - row) <= 1, root + root.T, 0.0) + 40 * np.eye(60)
    factor = RowFactor.of(sparse.csr_array(dense), row)
    loads = rng.standard_normal((60, 4))
    np.testing.assert_allclose(factor.solve(loads), np.linalg.solve(dense, loads), atol=1e-12)
    np.testing.assert_allclose(
        factor.solve(loads[:, 0]), np.linalg.solve(dense, loads[:, 0]), atol=1e-12
    )
    some = rng.permutation(60)[:17]
    inverse = np.linalg.inv(dense)[np.ix_(some, some)]
    np.testing.assert_allclose(factor.compliance(some), inverse, atol=1e-12)
    with pytest.raises(LinAlgError):
        RowFactor.of(sparse.csr_array(dense - 80 * np.eye(60)), row)
    with pytest.raises(ValueError, match="coupled"):
        RowFactor.of(sparse.csr_array(dense), np.where(row == 3, 9, row) * (row != 2))


def test_dense_reference_agrees() -> None:
    pad = small_pad(0.49, 6, 2, 6.0)
    block = SurfaceCompliance(pad).block(np.arange(len(pad.mesh.surface)))
    np.testing.assert_allclose(block, dense_compliance(pad), atol=1e-6 * block.max())
