import os
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from ifem_export.errors import MeshError
from ifem_export.mesh.vtu import write_vtu


def test_pyvista_reads_the_mesh_back(round_pad, tmp_path):
    pyvista = pytest.importorskip(
        "pyvista", reason="pyvista is not installed: the VTU is NOT checked by its own reader"
    )
    rng = np.random.default_rng(0)
    displacement = rng.normal(size=(round_pad.n_nodes, 3))
    energy = rng.normal(size=round_pad.n_elements).astype(np.float32)
    path = tmp_path / "pad.vtu"
    write_vtu(
        path,
        round_pad,
        point_data={"displacement_mm": displacement},
        cell_data={"energy": energy, "kept": energy > 0},
    )
    grid = pyvista.read(path)
    assert np.array_equal(grid.points, round_pad.nodes_mm)
    assert grid.points.dtype == np.float64
    assert np.array_equal(grid.cells_dict[12], round_pad.hexes)
    assert np.array_equal(grid.point_data["displacement_mm"], displacement)
    assert np.array_equal(grid.cell_data["energy"], energy)
    assert np.array_equal(grid.cell_data["kept"], energy > 0)
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


@pytest.mark.parametrize("shape", [(3,), (3, 3, 3), ()])
def test_fields_that_do_not_fit_leave_no_file(round_pad, tmp_path, shape):
    wrong_type = np.zeros(round_pad.n_nodes, complex)
    for name, values in (("f", np.zeros(shape)), ("c", wrong_type), ("ü", wrong_type.real)):
        with pytest.raises(MeshError) as caught:
            write_vtu(tmp_path / "a.vtu", round_pad, point_data={name: values})
        assert caught.value.field == name
    assert os.listdir(tmp_path) == []
