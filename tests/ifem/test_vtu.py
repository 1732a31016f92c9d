import os
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from ifem_export.mesh.vtu import write_vtu


def test_pyvista_reads_the_mesh_back(round_pad, tmp_path):
    pyvista = pytest.importorskip(
        "pyvista", reason="pyvista is not installed: the VTU is NOT checked by its own reader"
    )
    path = tmp_path / "pad.vtu"
    write_vtu(path, round_pad)
    grid = pyvista.read(path)
    assert np.array_equal(grid.points, round_pad.nodes_mm)
    assert grid.points.dtype == np.float64
    assert np.array_equal(grid.cells_dict[12], round_pad.hexes)
    bits = grid.point_data["node_set"]
    assert np.array_equal(np.flatnonzero(bits & 1), round_pad.bonded)
    assert np.array_equal(np.flatnonzero(bits & 2), round_pad.surface)
    assert np.array_equal(np.flatnonzero(bits & 4), round_pad.sides)
    # Positive cell volumes prove the corner order; their sum is the pad's volume.
    volumes = grid.compute_cell_sizes()["Volume"]
    assert volumes == pytest.approx(np.prod(round_pad.cell_size_mm), rel=1e-9)


def test_the_file_is_valid_xml_and_the_same_every_time(round_pad, tmp_path):
    write_vtu(tmp_path / "a.vtu", round_pad)
    write_vtu(tmp_path / "b.vtu", round_pad)
    first = (tmp_path / "a.vtu").read_bytes()
    assert first == (tmp_path / "b.vtu").read_bytes()
    piece = ET.fromstring(first).find("UnstructuredGrid/Piece")
    assert piece is not None
    assert piece.get("NumberOfPoints") == str(round_pad.n_nodes)
    assert sorted(os.listdir(tmp_path)) == ["a.vtu", "b.vtu"]
