"""Closed triangle meshes of solids: welded, as fine as needed, turned for printing.

A solid is triangulated face by face; the topology joins the patches into one closed mesh.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.export import ExportError
from gelslim_cad.export.brep import bare_copy

Tolerances = tuple[float, float]
RUNGS: tuple[Tolerances, ...] = (
    (0.20, 30.0),
    (0.10, 20.0),
    (0.05, 15.0),
    (0.03, 10.0),
    (0.02, 7.5),
    (0.01, 5.0),
    (0.007, 4.0),
    (0.005, 3.0),
    (0.002, 1.5),
)
"""Linear (mm) and angular (deg) tolerance, coarse to fine. Both fall together, because a linear
tolerance alone leaves small curved faces coarse."""
FIRST = 2
"""The first rung for files to print. It deviates by at most 10 µm on a finger's parts, less than a
printer resolves. Coarser rungs keep the volume too, but show their facets."""
Key = tuple[int, ...]


class TriangleMesh(NamedTuple):
    """`vertices_mm (n,3)` and `faces (m,3)`, counter-clockwise seen from outside."""

    vertices_mm: NDArray[np.float64]
    faces: NDArray[np.int64]


def tessellate(shape: Any, linear_mm: float, angular_deg: float) -> TriangleMesh:
    """Mesh a copy of a solid, so that no export depends on the tessellation of an earlier one.

    `linear_mm` limits the distance from chord to curve, `angular_deg` the angle between
    neighbouring chords. Vertices are joined by topology, not by distance: the mesh of a solid
    is closed wherever OCCT divided both sides of an edge in the same way.

    Raises:
        ExportError: a tolerance is not positive, or a face could not be triangulated.
    """
    return welded(_patches(shape, linear_mm, angular_deg, with_normals=False))


def welded(patches: Sequence[Patch]) -> TriangleMesh:
    """Join patches at equal keys and drop the triangles that collapse."""
    index: dict[Key, int] = {}
    points: list[NDArray[np.float64]] = []
    faces = []
    for patch in patches:
        numbers = np.empty(len(patch.keys), dtype=np.int64)
        for node, key in enumerate(patch.keys):
            if key not in index:
                index[key] = len(points)
                points.append(patch.nodes_mm[node])
            numbers[node] = index[key]
        faces.append(numbers[patch.triangles])
    return stored(TriangleMesh(np.array(points), np.concatenate(faces)))


def stored(mesh: TriangleMesh) -> TriangleMesh:
    """Round vertices to what a file can hold (float32) and merge those that become equal.

    A reader of STL merges equal vertices. They are merged before, so that collapsed triangles can
    be removed while the mesh is still known to be closed.
    """
    rounded = np.asarray(mesh.vertices_mm, dtype=np.float32).astype(np.float64) + 0.0
    points, merged = np.unique(rounded, axis=0, return_inverse=True)
    faces = merged.reshape(-1)[mesh.faces]
    a, b, c = faces.T
    faces = _without_folds(faces[(a != b) & (b != c) & (c != a)])
    used, compact = np.unique(faces, return_inverse=True)
    return TriangleMesh(points[used], compact.reshape(-1, 3).astype(np.int64))


def _without_folds(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Remove pairs of triangles on the same three vertices that face each other."""
    _, same, counts = np.unique(
        np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    same = same.reshape(-1)
    return faces[counts[same] == 1] if (counts > 1).any() else faces


def bad_edges(mesh: TriangleMesh) -> NDArray[np.int64]:
    """Edges `(k,2)`, as vertex numbers, that are not used exactly once each way.

    Such an edge borders a hole, joins triangles of opposite orientation, or is where a solid
    touches itself.
    """
    count = len(mesh.vertices_mm)
    starts, ends = mesh.faces.ravel(), np.roll(mesh.faces, -1, axis=1).ravel()
    edges = np.minimum(starts, ends) * count + np.maximum(starts, ends)
    edges, place = np.unique(edges, return_inverse=True)
    ways = [np.bincount(place[way], minlength=len(edges)) for way in (starts < ends, starts > ends)]
    bad = edges[(ways[0] != 1) | (ways[1] != 1)]
    return np.column_stack([bad // count, bad % count])


def volume_mm3(mesh: TriangleMesh) -> float:
    """Volume inside a closed mesh, positive if it faces outwards (divergence theorem)."""
    corners = mesh.vertices_mm[mesh.faces] - mesh.vertices_mm.mean(axis=0)
    return float(np.linalg.det(corners).sum() / 6.0)


def mesh_for(shape: Any, volume_tolerance: float = 1e-3) -> tuple[TriangleMesh, Tolerances]:
    """Mesh a solid on the coarsest rung from `FIRST` on that is closed and keeps its volume.

    The rung comes with the mesh.

    Raises:
        ExportError: the solid has no positive volume, or no rung qualifies; the message says
            whether the mesh leaked or was too coarse.
    """
    exact = float(shape.Volume())
    if not exact > 0:
        raise ExportError(f"tessellation: volume is {exact:g} mm3, must be > 0; solid inside out?")
    reason = ""
    for rung in RUNGS[FIRST:]:
        mesh = tessellate(shape, *rung)
        error = abs(volume_mm3(mesh) / exact - 1.0)
        bad = bad_edges(mesh)
        if len(bad):
            middle = np.round(mesh.vertices_mm[bad[0]].mean(axis=0), 3)
            reason = f"{len(bad)} edges are not shared by 2 faces, one at {middle.tolist()} mm"
        elif error > volume_tolerance:
            reason = f"volume is off by {error:.2e} at {rung[0]} mm / {rung[1]} deg"
        else:
            return mesh, rung
    raise ExportError(
        f"tessellation: no rung keeps the volume within {volume_tolerance:g}: {reason}; "
        "move features that only touch along an edge apart or into each other, keep a sphere's "
        "pole off other faces, or allow a larger tolerance"
    )


def rotation(angles_deg: tuple[float, float, float]) -> NDArray[np.float64]:
    """Matrix `(3,3)` that turns about x, then y, then z of the fixed frame.

    Multiples of 90 degrees come out exact, so that a flat face stays flat on the plate.
    """
    from scipy.spatial.transform import Rotation

    return Rotation.from_euler("xyz", angles_deg, degrees=True).as_matrix().round(15) + 0.0


def print_mesh(mesh: TriangleMesh, angles_deg: tuple[float, float, float]) -> TriangleMesh:
    """Turn a mesh, centre its bounding box on the plate and put its lowest point at z = 0."""
    turned = mesh.vertices_mm @ rotation(angles_deg).T
    low, high = turned.min(axis=0), turned.max(axis=0)
    middle = (low + high) / 2.0
    return stored(TriangleMesh(turned - np.array([middle[0], middle[1], low[2]]), mesh.faces))


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
    return _patches(shape, linear_mm, angular_deg, with_normals=True)


def _patches(
    shape: Any, linear_mm: float, angular_deg: float, *, with_normals: bool
) -> list[Patch]:
    """As `face_patches`; without normals, which take as long as the nodes, those are empty."""
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.IMeshTools import IMeshTools_MeshAlgoType, IMeshTools_Parameters
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp
    from OCP.TopTools import TopTools_IndexedMapOfShape

    if not (linear_mm > 0 and angular_deg > 0):
        raise ExportError(
            f"tessellation: linear {linear_mm} mm and angular {angular_deg} deg must both be > 0"
        )
    bare = bare_copy(shape)
    wanted = IMeshTools_Parameters()
    wanted.Deflection = linear_mm
    wanted.Angle = float(np.radians(angular_deg))
    # Watson's algorithm, the default, takes a time that grows with the square of the nodes.
    wanted.MeshAlgo = IMeshTools_MeshAlgoType.IMeshTools_MeshAlgoType_Delabella
    BRepMesh_IncrementalMesh(bare.wrapped, wanted)
    maps = []
    for kind in (TopAbs_ShapeEnum.TopAbs_VERTEX, TopAbs_ShapeEnum.TopAbs_EDGE):
        found = TopTools_IndexedMapOfShape()
        TopExp.MapShapes_s(bare.wrapped, kind, found)
        maps.append(found)
    faces = [face.wrapped for face in bare.Faces()]
    vertices, edges = maps
    return [_patch(f, n, vertices, edges, with_normals) for n, f in enumerate(faces)]


def _patch(face: Any, number: int, vertices: Any, edges: Any, with_normals: bool) -> Patch:
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
    count = mesh.NbNodes()
    nodes = _coordinates(mesh.Node, count, placement)
    normals = np.zeros((0, 3))
    if with_normals:
        StdPrs_ToolTriangulatedShape.ComputeNormals_s(face, mesh)
        normals = _coordinates(mesh.Normal, count, placement)
    triangles = np.array([mesh.Triangle(i).Get() for i in range(1, mesh.NbTriangles() + 1)]) - 1
    if face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED:
        triangles, normals = triangles[:, [0, 2, 1]], -normals
    keys = _keys(face, number, mesh, placement, vertices, edges)
    return Patch(nodes, normals, triangles.astype(np.int64), keys)


def _coordinates(found: Callable[[int], Any], count: int, placement: Any) -> NDArray[np.float64]:
    """Coordinates (count, 3) of points or directions that are numbered from 1, once placed."""
    numbered: Iterable[Any] = map(found, range(1, count + 1))
    if not placement.IsIdentity():
        transform = placement.Transformation()
        numbered = (each.Transformed(transform) for each in numbered)
    return np.array([each.Coord() for each in numbered])


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
