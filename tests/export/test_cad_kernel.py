"""The CAD kernel without all of VTK."""

from __future__ import annotations

import subprocess
import sys

import pytest

from gelslim_cad.export.cad_kernel import _standing_in

LOADED = """
import sys
from gelslim_cad.export.cad_kernel import load_cad_kernel
load_cad_kernel()
assert "cadquery" in sys.modules and "vtk" not in sys.modules
import cadquery
assert cadquery.Solid.makeBox(1, 2, 3).toVtkPolyData(0.1, 0.1).GetNumberOfCells() > 12
import vtk
assert vtk.vtkSphereSource().GetRadius() == 0.5
"""


@pytest.mark.slow
def test_the_kernel_works_without_vtk_which_can_be_imported_afterwards() -> None:
    found = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True)
    assert found.returncode == 0, found.stderr


def test_a_stand_in_leaves_no_trace() -> None:
    with _standing_in("no_such_library"):
        assert "no_such_library" in sys.modules
    assert "no_such_library" not in sys.modules


def test_a_loaded_library_is_left_alone() -> None:
    before = sys.modules["subprocess"]
    with _standing_in("subprocess"):
        assert sys.modules["subprocess"] is before
    assert sys.modules["subprocess"] is before
