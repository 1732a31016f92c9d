import os
import subprocess
import sys

import pytest

from gelslim_cad.markers.process import MARKING_PROCESSES
from gelslim_cad.markers.write import render_marker_files, write_marker_files
from ifem_export.markers.grid import build_marker_grid

SCRIPT = """
import hashlib
import numpy as np
from gelslim_cad.markers.nodes import nearest_nodes
from gelslim_cad.markers.outline import Outline
from gelslim_cad.markers.write import render_marker_files
from ifem_export.markers.grid import build_marker_grid
outline = Outline.rounded_rectangle(20, 21, 2)
grid = build_marker_grid(15, 17, 1.1, 0.4, "omitted")
nodes = nearest_nodes(grid.positions_mm, grid.positions_mm, np.arange(len(grid)))
for name, content in sorted(render_marker_files(grid, nodes, outline).items()):
    print(name, hashlib.sha256(content).hexdigest())
"""


@pytest.mark.slow
def test_two_fresh_processes_write_the_same_bytes():
    def digest(seed, zone):
        env = dict(os.environ, PYTHONHASHSEED=seed, TZ=zone)
        done = subprocess.run(
            [sys.executable, "-c", SCRIPT], env=env, capture_output=True, text=True, check=True
        )
        return done.stdout.splitlines()

    first, second = digest("1", "UTC"), digest("2", "Pacific/Auckland")
    assert len(first) == 10
    assert first == second


def test_files_are_written_whole_and_named(tmp_path, grid, nodes, outline):
    folder = tmp_path / "out" / "markers"
    paths = write_marker_files(folder, grid, nodes, outline)
    rendered = render_marker_files(grid, nodes, outline)
    assert [p.name for p in paths] == sorted(rendered)
    assert sorted(os.listdir(folder)) == sorted(rendered)
    for path in paths:
        assert path.read_bytes() == rendered[path.name]


def test_a_refused_design_leaves_the_folder_untouched(tmp_path, nodes, outline):
    (tmp_path / "markers.svg").write_text("before")
    with pytest.raises(ValueError, match="900"):
        write_marker_files(tmp_path, build_marker_grid(30, 30, 1.0, 0.4), nodes, outline)
    assert os.listdir(tmp_path) == ["markers.svg"]
    assert (tmp_path / "markers.svg").read_text() == "before"


def test_importing_the_package_loads_no_heavy_library():
    code = (
        "import sys, gelslim_cad.markers.write, ifem_export.markers.grid; "
        "print([m for m in ('ezdxf', 'reportlab', 'matplotlib', 'cadquery') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_processes_have_limits_reasons_and_files_that_exist(grid, nodes, outline):
    names = set(render_marker_files(grid, nodes, outline))
    assert set(MARKING_PROCESSES) == {
        "laser_opened_paint",
        "laser_etch",
        "uv_print",
        "stencil",
    }
    for name, process in MARKING_PROCESSES.items():
        assert process.name == name
        assert 0.1 < process.min_diameter_mm < 1.0
        assert 0.1 < process.min_gap_mm < 1.0
        assert len(process.reason) > 40
        assert set(process.files) <= names


def test_stencil_limit_is_the_area_ratio_of_a_round_hole():
    # d/(4t) = 0.66 for a foil of 0.1 mm.
    diameter = MARKING_PROCESSES["stencil"].min_diameter_mm
    assert diameter**2 / 4 / (diameter * 0.1) == pytest.approx(0.66, abs=1e-3)
