"""Whether a solid that was read back is valid, also for plates with thousands of holes.

The analyser of the CAD kernel intersects every boundary of a face with every other: seconds for a
stencil of 870 holes. Where all inner boundaries of a plane face are circles, their centres and
radii tell the same exactly: circles do not meet if the distance of their centres exceeds the sum of
their radii. The analyser then checks the outer boundary of such a face, all other faces, and that
the shell is closed.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

MANY = 50
"""Inner boundaries of a face beyond which the circles are compared here."""
Circles = NDArray[np.float64]


def is_valid(shape: Any) -> bool:
    """Whether a shape (`cadquery.Shape`, mm) is valid: as `shape.isValid()`, in less time."""
    crowded = [f for f in shape.Faces() if _is_crowded(f)]
    circles = [_circles(face) for face in crowded]
    if not crowded or not all(
        found is not None and _lie_apart(face, found)
        for face, found in zip(crowded, circles, strict=True)
    ):
        return bool(shape.isValid())
    others = (f for f in shape.Faces() if not any(f.isSame(c) for c in crowded))
    return all(map(_is_closed, shape.Shells())) and all(f.isValid() for f in others)


def _is_crowded(face: Any) -> bool:
    """Whether a face is plane and has many inner boundaries."""
    # The number of children is known at once and is at least that of the boundaries.
    if face.wrapped.NbChildren() <= MANY:
        return False
    return face.geomType() == "PLANE" and len(face.innerWires()) > MANY


def _is_closed(shell: Any) -> bool:
    """Whether each edge joins two faces of a shell that agree on which side is outside."""
    from OCP.BRepCheck import BRepCheck_Shell, BRepCheck_Status

    found = BRepCheck_Shell(shell.wrapped)
    good = BRepCheck_Status.BRepCheck_NoError
    return bool(found.Closed(False) == good and found.Orientation(False) == good)


def _circles(face: Any) -> Circles | None:
    """Centre and radius (n, 4) of the inner boundaries; None if one is not a single circle."""
    found = []
    for wire in face.innerWires():
        edges = wire.Edges()
        if len(edges) != 1 or edges[0].geomType() != "CIRCLE" or not edges[0].IsClosed():
            return None
        found.append((*edges[0].arcCenter().toTuple(), edges[0].radius()))
    return np.array(found)


def _lie_apart(face: Any, circles: Circles) -> bool:
    """Whether circles lie within the valid outer boundary of a face, meet nothing and are holes.

    False too where a centre is as near to the boundary as the largest radius: the analyser decides.
    """
    import cadquery as cq

    centres, radii = circles[:, :3], circles[:, 3]
    pairs = cKDTree(centres).query_pairs(2 * float(radii.max()), output_type="ndarray")
    apart = np.linalg.norm(centres[pairs[:, 0]] - centres[pairs[:, 1]], axis=1)
    if np.any(apart <= radii[pairs].sum(axis=1)):
        return False
    outer = cq.Face.makeFromWires(face.outerWire(), [])
    points = cq.Compound.makeCompound([cq.Vertex.makeVertex(*centre) for centre in centres])
    return (
        outer.isValid()
        and outer.outerWire().distance(points) > float(radii.max())
        and all(_within(outer, centre) for centre in centres)
        and math.isclose(face.Area() + math.pi * float(radii @ radii), outer.Area(), rel_tol=1e-9)
    )


def _within(face: Any, point: NDArray[np.float64]) -> bool:
    from OCP.BRepClass import BRepClass_FaceClassifier
    from OCP.gp import gp_Pnt
    from OCP.TopAbs import TopAbs_State

    found = BRepClass_FaceClassifier(face.wrapped, gp_Pnt(*point), 1e-7)
    return bool(found.State() == TopAbs_State.TopAbs_IN)
