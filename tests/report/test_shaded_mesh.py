"""Creases, smooth normals and outlines of meshes, against VTK's filters and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
import report_sample
import trimesh

from gelslim_cad.pictures.shaded_mesh import CREASE_DEG, ShadedMesh, joined, shaded_mesh

pytest.importorskip("vtkmodules", reason="VTK is not installed: no still pictures")


def perforated() -> ShadedMesh:
    """A block with a round hole: flat and curved faces, sharp edges between them."""
    block = report_sample.block((20, 14, 6), (0, 0, 0))
    hole = trimesh.creation.cylinder(radius=4.0, height=20.0, sections=40)
    made = block.difference([hole])
    return shaded_mesh(made.vertices, made.faces)


def edges(points: np.ndarray) -> set[tuple[tuple[float, ...], ...]]:
    """Edges by their ends (k, 2, 3), whatever their direction."""
    rounded = np.round(points, 4) + 0.0
    return {tuple(sorted((tuple(a.tolist()), tuple(b.tolist())))) for a, b in rounded}


def test_creases_are_those_of_vtk() -> None:
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkFiltersCore import vtkFeatureEdges

    from gelslim_cad.pictures.vtk_data import poly_data

    mesh = perforated()
    found = vtkFeatureEdges()
    found.SetInputData(poly_data(mesh.vertices_mm, None, mesh.faces))
    found.SetFeatureAngle(CREASE_DEG)
    found.Update()
    lines = found.GetOutput()
    points = vtk_to_numpy(lines.GetPoints().GetData())
    ends = vtk_to_numpy(lines.GetLines().GetConnectivityArray()).reshape(-1, 2)
    assert len(mesh.creases) == 92
    assert edges(mesh.vertices_mm[mesh.creases]) == edges(points[ends])


def test_corners_and_normals_are_those_of_vtk() -> None:
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkFiltersCore import vtkPolyDataNormals

    from gelslim_cad.pictures.vtk_data import poly_data

    mesh = perforated()
    found = vtkPolyDataNormals()
    found.SetInputData(poly_data(mesh.vertices_mm, None, mesh.faces))
    found.SetFeatureAngle(CREASE_DEG)
    found.Update()
    points = vtk_to_numpy(found.GetOutput().GetPoints().GetData())
    normals = vtk_to_numpy(found.GetOutput().GetPointData().GetNormals())
    mine = np.column_stack([mesh.vertices_mm[mesh.corners], mesh.corner_normals])
    theirs = np.column_stack([points, normals])
    assert mine.shape == theirs.shape

    def ranked(rows: np.ndarray) -> np.ndarray:
        return rows[np.lexsort(np.round(rows, 3).T)]

    np.testing.assert_allclose(ranked(mine), ranked(theirs), atol=2e-5)


def test_a_box_has_twelve_creases_and_a_corner_for_each_side_of_a_vertex() -> None:
    box = report_sample.block((4, 5, 6), (0, 0, 0))
    mesh = shaded_mesh(box.vertices, box.faces)
    assert (len(mesh.creases), len(mesh.corners), len(mesh.folds)) == (12, 24, 18)
    assert np.abs(mesh.corner_normals).max(axis=1) == pytest.approx(np.ones(24))


def test_the_outline_of_a_box_seen_aslant_is_a_hexagon() -> None:
    box = report_sample.block((4, 5, 6), (0, 0, 0))
    mesh = shaded_mesh(box.vertices, box.faces)
    assert len(mesh.outline(np.array([0.6, 0.5, 0.62]))) == 6
    above = mesh.vertices_mm[mesh.outline(np.array([0.0, 0.0, 1.0]))]
    assert len(above) == 4
    assert above[..., 2] == pytest.approx(np.full((4, 2), 3.0))


def test_the_outline_of_a_ball_is_a_great_circle() -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=5.0)
    mesh = shaded_mesh(ball.vertices, ball.faces)
    towards = np.array([1.0, -2.0, 2.0]) / 3.0
    outline = mesh.outline(towards)
    points = mesh.vertices_mm[outline.ravel()]
    # No point of the outline is farther from the true one than an edge of the mesh is long.
    assert np.abs(points @ towards).max() < 0.45
    radii = np.linalg.norm(np.cross(points, towards), axis=1)
    assert radii.min() > np.sqrt(5.0**2 - 0.45**2)
    assert set(np.unique(outline, return_counts=True)[1].tolist()) == {2}


def test_vertices_are_welded_and_slivers_left_out() -> None:
    """A mesh of loose triangles is the same as one of shared vertices."""
    box = report_sample.block((4, 5, 6), (0, 0, 0))
    loose = box.vertices[box.faces].reshape(-1, 3)
    sliver = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 4e-6]], dtype=float)
    faces = np.arange(len(loose) + 3).reshape(-1, 3)
    mesh = shaded_mesh(np.concatenate([loose, sliver]), faces)
    assert mesh.faces.shape == (12, 3)
    assert len(mesh.creases) == 12


def test_an_open_mesh_ends_in_creases() -> None:
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
    mesh = shaded_mesh(square, np.array([[0, 1, 2], [0, 2, 3]]))
    assert len(mesh.creases) == 4
    assert len(mesh.corners) == 4


def test_joined_meshes_are_moved_and_numbered_on() -> None:
    box = report_sample.block((2, 2, 2), (0, 0, 0))
    mesh = shaded_mesh(box.vertices, box.faces)
    points, normals, faces = joined([(mesh, np.zeros(3)), (mesh, np.array([5.0, 0.0, 0.0]))])
    assert points.shape == normals.shape == (48, 3)
    assert faces.max() == 47
    np.testing.assert_allclose(points[24:], points[:24] + np.array([5.0, 0.0, 0.0]))
