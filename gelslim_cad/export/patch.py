"""Triangulated CAD faces, with the topology that joins them into one closed mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.export import ExportError
from gelslim_cad.export.brep import bare_copy

Key = tuple[int, ...]


@dataclass(frozen=True)
class Patch:
    """One CAD face as triangles that turn counter-clockwise seen from outside the solid.

    `nodes_mm (k,3)`; `normals (k,3)`, unit vectors of the exact surface, pointing out of the
    solid; `triangles (m,3)`, indices of nodes; `keys`, which identify each node by its CAD vertex,
    its position on a CAD edge or its position in the face. Equal keys are the same point.
    """

    nodes_mm: NDArray[np.float64]
    normals: NDArray[np.float64]
    triangles: NDArray[np.int64]
    keys: tuple[Key, ...]


def face_patches(shape: Any, linear_mm: float, angular_deg: float) -> list[Patch]:
    """Triangulate a copy of a shape and return one patch per face, in topological order.

    Raises:
        ExportError: a tolerance is not positive, or a face could not be triangulated.
    """
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp
    from OCP.TopTools import TopTools_IndexedMapOfShape

    if not (linear_mm > 0 and angular_deg > 0):
        raise ExportError(
            f"tessellation: linear {linear_mm} mm and angular {angular_deg} deg must both be > 0"
        )
    bare = bare_copy(shape)
    BRepMesh_IncrementalMesh(bare.wrapped, linear_mm, False, float(np.radians(angular_deg)), False)
    maps = []
    for kind in (TopAbs_ShapeEnum.TopAbs_VERTEX, TopAbs_ShapeEnum.TopAbs_EDGE):
        found = TopTools_IndexedMapOfShape()
        TopExp.MapShapes_s(bare.wrapped, kind, found)
        maps.append(found)
    faces = [face.wrapped for face in bare.Faces()]
    return [_patch(face, number, *maps) for number, face in enumerate(faces)]


def _patch(face: Any, number: int, vertices: Any, edges: Any) -> Patch:
    from OCP.BRep import BRep_Tool
    from OCP.StdPrs import StdPrs_ToolTriangulatedShape
    from OCP.TopAbs import TopAbs_Orientation
    from OCP.TopLoc import TopLoc_Location

    placement = TopLoc_Location()
    mesh = BRep_Tool.Triangulation_s(face, placement)
    if mesh is None or mesh.NbTriangles() == 0:
        raise ExportError(
            f"face {number} could not be triangulated; check the solid with isValid() and rebuild "
            "the fillet or cut that made the face"
        )
    StdPrs_ToolTriangulatedShape.ComputeNormals_s(face, mesh)
    transform = placement.Transformation()
    count = mesh.NbNodes()
    nodes = np.array([_xyz(mesh.Node(i).Transformed(transform)) for i in range(1, count + 1)])
    normals = np.array([_xyz(mesh.Normal(i).Transformed(transform)) for i in range(1, count + 1)])
    triangles = np.array([mesh.Triangle(i).Get() for i in range(1, mesh.NbTriangles() + 1)]) - 1
    if face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED:
        triangles, normals = triangles[:, [0, 2, 1]], -normals
    keys = _keys(face, number, mesh, placement, vertices, edges)
    return Patch(nodes, normals, triangles.astype(np.int64), keys)


def _xyz(point: Any) -> tuple[float, float, float]:
    return point.X(), point.Y(), point.Z()


def _keys(
    face: Any, number: int, mesh: Any, placement: Any, vertices: Any, edges: Any
) -> tuple[Key, ...]:
    from OCP.BRep import BRep_Tool
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp, TopExp_Explorer
    from OCP.TopoDS import TopoDS

    on_edge: dict[int, Key] = {}
    on_vertex: dict[int, Key] = {}
    explorer = TopExp_Explorer(face, TopAbs_ShapeEnum.TopAbs_EDGE)
    while explorer.More():
        edge = TopoDS.Edge_s(explorer.Current())
        explorer.Next()
        polygon = BRep_Tool.PolygonOnTriangulation_s(edge, mesh, placement)
        if polygon is None:
            continue
        count = polygon.NbNodes()
        places = [polygon.Node(i) - 1 for i in range(1, count + 1)]
        edge_id = edges.FindIndex(edge)
        first = vertices.FindIndex(TopExp.FirstVertex_s(edge, False))
        last = vertices.FindIndex(TopExp.LastVertex_s(edge, False))
        if BRep_Tool.Degenerated_s(edge):
            on_vertex.update(dict.fromkeys(places, (0, first)))
            continue
        on_edge.update({node: (1, edge_id, count, i) for i, node in enumerate(places)})
        on_vertex[places[0]] = (0, first)
        on_vertex[places[-1]] = (0, last)
    inside = ((2, number, node) for node in range(mesh.NbNodes()))
    return tuple(on_vertex.get(k[2], on_edge.get(k[2], k)) for k in inside)
