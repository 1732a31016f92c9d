"""Whether a casting comes out of its mould along a straight line."""

from __future__ import annotations

import cadquery as cq
import numpy as np
from numpy.typing import NDArray

from gelslim_cad.export.brep import bare_copy

LINEAR_MM = 0.02
ANGLE_DEG = 5.0
SLOPE = 1e-4
"""Walls leaning by less (0.006°) count as parallel to the pull."""
OPENING_MM = 1e-6


def undercut_area_mm2(
    casting: cq.Shape, pull: tuple[float, float, float] = (0.0, 0.0, 1.0)
) -> float:
    """Area (mm²) of the casting's skin that the mould holds back when pulled along `pull`.

    The casting fills the cavity, whose opening is the plane farthest along `pull`. Skin whose
    outward normal leans towards `pull`, other than the opening itself, has mould above it. The
    skin is sampled on a mesh within 0.02 mm, with the exact normals of its surfaces: the facets
    of an upright cylinder may lean though the cylinder does not.
    """
    from OCP.BRepMesh import BRepMesh_IncrementalMesh

    axis = np.asarray(pull, dtype=float)
    axis = axis / np.linalg.norm(axis)
    meshed = bare_copy(casting)
    BRepMesh_IncrementalMesh(meshed.wrapped, LINEAR_MM, False, float(np.radians(ANGLE_DEG)), False)
    samples = [_triangles(face) for face in meshed.Faces()]
    corners = np.concatenate([points for points, _ in samples])
    normals = np.concatenate([directions for _, directions in samples])
    sides = corners[:, 1:] - corners[:, :1]
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2
    height = corners @ axis
    opening = height.min(axis=1) >= height.max() - OPENING_MM
    leaning = normals @ axis > SLOPE
    return float(area[leaning & ~opening].sum())


def undercut_free(
    casting: cq.Shape, pull: tuple[float, float, float] = (0.0, 0.0, 1.0), limit_mm2: float = 1e-3
) -> bool:
    """Whether less than `limit_mm2` of the casting is undercut along `pull`."""
    return undercut_area_mm2(casting, pull) < limit_mm2


def _triangles(face: cq.Face) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners (m, 3, 3) of a meshed face's triangles and their mean outward normals (m, 3)."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.gp import gp_Pnt, gp_Vec
    from OCP.TopAbs import TopAbs_Orientation
    from OCP.TopLoc import TopLoc_Location

    mesh = BRep_Tool.Triangulation_s(face.wrapped, TopLoc_Location())
    if mesh is None:
        return np.zeros((0, 3, 3)), np.zeros((0, 3))
    surface = BRepAdaptor_Surface(face.wrapped)
    point, along_u, along_v = gp_Pnt(), gp_Vec(), gp_Vec()
    nodes, normals = np.empty((mesh.NbNodes(), 3)), np.empty((mesh.NbNodes(), 3))
    for k in range(mesh.NbNodes()):
        place = mesh.UVNode(k + 1)
        surface.D1(place.X(), place.Y(), point, along_u, along_v)
        normal = along_u.Crossed(along_v)
        nodes[k] = point.X(), point.Y(), point.Z()
        normals[k] = normal.X(), normal.Y(), normal.Z()
    if face.wrapped.Orientation() == TopAbs_Orientation.TopAbs_REVERSED:
        normals = -normals
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(lengths > 0, lengths, 1.0)
    triangles = np.array([mesh.Triangle(k + 1).Get() for k in range(mesh.NbTriangles())]) - 1
    return nodes[triangles], normals[triangles].mean(axis=1)
