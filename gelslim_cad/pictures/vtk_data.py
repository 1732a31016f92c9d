"""Arrays as VTK's meshes and lines. VTK is imported when used."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np


def appended(polys: Sequence[Any]) -> Any:
    """Meshes as one; their vertices stay apart."""
    from vtkmodules.vtkFiltersCore import vtkAppendPolyData

    together = vtkAppendPolyData()
    for poly in polys:
        together.AddInputData(poly)
    together.Update()
    return together.GetOutput()


def producer(poly: Any) -> Any:
    """A source that gives this mesh."""
    from vtkmodules.vtkCommonExecutionModel import vtkTrivialProducer

    source = vtkTrivialProducer()
    source.SetOutput(poly)
    return source


def poly_data(vertices: np.ndarray, normals: np.ndarray | None, faces: np.ndarray) -> Any:
    """VTK's mesh, with normals of its vertices where they are known."""
    from vtkmodules.util.numpy_support import numpy_to_vtk

    poly = _points(vertices)
    poly.SetPolys(_cells(faces))
    if normals is not None:
        poly.GetPointData().SetNormals(numpy_to_vtk(normals.astype(np.float32), deep=True))
    return poly


def line_data(ends: Sequence[np.ndarray]) -> Any:
    """VTK's mesh of lines whose ends are arrays (k, 2, 3)."""
    points = np.concatenate(ends).reshape(-1, 3)
    poly = _points(points)
    poly.SetLines(_cells(np.arange(len(points)).reshape(-1, 2)))
    return poly


def _points(vertices: np.ndarray) -> Any:
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkPolyData

    points = vtkPoints()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(vertices, dtype=float), deep=True))
    poly = vtkPolyData()
    poly.SetPoints(points)
    return poly


def _cells(corners: np.ndarray) -> Any:
    """VTK's cells of vertex numbers (m, k)."""
    from vtkmodules.util.numpy_support import numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonDataModel import vtkCellArray

    cells = vtkCellArray()
    offsets = np.arange(0, corners.size + 1, corners.shape[1], dtype=np.int64)
    numbers = np.ascontiguousarray(corners, dtype=np.int64).ravel()
    cells.SetData(
        numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(numbers, deep=True)
    )
    return cells
