"""Shared gel and pads."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from ifem_bundles import make_bundle

from ifem_export.bundle.files import write_bundle
from ifem_export.elements.material import Material
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import PadMesh, build_pad_mesh


@pytest.fixture(scope="session")
def gel() -> Material:
    """The paper's gel, its modulus read as kPa (0.147 MPa)."""
    return Material(0.147, 0.3223, 1070.0)


@pytest.fixture(scope="session")
def round_pad() -> PadMesh:
    """A cropped two-layer pad with three different cell sides."""
    mesh, _ = build_pad_mesh(RoundedRectangle(8.0, 6.0, 2.0), 1.4, pitch_mm=(0.8, 0.6), layers=2)
    return mesh


@pytest.fixture(scope="session")
def bundle(gel):
    return make_bundle(gel)


@pytest.fixture(scope="session")
def pristine(bundle, tmp_path_factory):
    path = tmp_path_factory.mktemp("bundles") / "good"
    write_bundle(path, bundle)
    return path


@pytest.fixture
def stored(pristine, tmp_path):
    return Path(shutil.copytree(pristine, tmp_path / "bundle"))
