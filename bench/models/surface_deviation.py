"""How far a mesh of a solid is off the solid's exact surface."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.export.brep import bare_copy
from gelslim_cad.export.mesh import Patch

Array = NDArray[np.float64]
Distance = Callable[[Array], Array]
"""Distances (n,) in mm of points (n, 3) from an untrimmed surface."""
DIVISIONS = 4
"""Points per side of a triangle; its corners lie on the surface already."""


def deviation_um(solid: Any, patches: Sequence[Patch]) -> float:
    """Largest distance in µm from a solid's mesh (`face_patches`) to the faces' surfaces.

    Points are a lattice on every triangle, the middles of its sides among them, from corners
    rounded to float32 as the files hold them. Neighbouring faces share the chords of their common
    edge, so the trim of each is judged on the surface of the other.
    """
    faces = bare_copy(solid).Faces()
    worst = 0.0
    for face, patch in zip(faces, patches, strict=True):
        worst = max(worst, float(distance_from(face)(lattice(patch)).max()))
    return 1000 * worst


def lattice(patch: Patch) -> Array:
    """Points (n, 3) on the triangles of a patch."""
    weights = [
        (i / DIVISIONS, j / DIVISIONS, 1 - (i + j) / DIVISIONS)
        for i in range(DIVISIONS + 1)
        for j in range(DIVISIONS + 1 - i)
        if DIVISIONS not in (i, j) and i + j > 0
    ]
    nodes = patch.nodes_mm.astype(np.float32).astype(np.float64)
    return np.einsum("wk,tkc->twc", np.array(weights), nodes[patch.triangles]).reshape(-1, 3)


def distance_from(face: Any) -> Distance:
    """Distance from the surface under a face: closed forms, a search for free forms."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.GeomAbs import GeomAbs_SurfaceType as Kind

    surface = BRepAdaptor_Surface(face.wrapped)
    kind = surface.GetType()
    if kind == Kind.GeomAbs_Plane:
        place = frame(surface.Plane().Position())
        return lambda p: np.abs(place(p)[1])
    if kind == Kind.GeomAbs_Cylinder:
        cylinder = surface.Cylinder()
        place, radius = frame(cylinder.Position()), cylinder.Radius()
        return lambda p: np.abs(place(p)[0] - radius)
    if kind == Kind.GeomAbs_Cone:
        return from_cone(surface.Cone())
    if kind == Kind.GeomAbs_Sphere:
        sphere = surface.Sphere()
        place, radius = frame(sphere.Position()), sphere.Radius()
        return lambda p: np.abs(np.hypot(*place(p)) - radius)
    if kind == Kind.GeomAbs_Torus:
        torus = surface.Torus()
        place, major, minor = frame(torus.Position()), torus.MajorRadius(), torus.MinorRadius()
        return lambda p: np.abs(np.hypot(place(p)[0] - major, place(p)[1]) - minor)
    return searched(face)


def frame(position: Any) -> Callable[[Array], tuple[Array, Array]]:
    """Distance from the axis of a placement and height along it, of points (n, 3)."""
    at, way = position.Location(), position.Direction()
    origin, axis = np.array([at.X(), at.Y(), at.Z()]), np.array([way.X(), way.Y(), way.Z()])

    def cylindrical(points: Array) -> tuple[Array, Array]:
        away = points - origin
        return np.linalg.norm(np.cross(away, axis), axis=1), away @ axis

    return cylindrical


def from_cone(cone: Any) -> Distance:
    """Near its surface, not beyond its apex."""
    place, radius, angle = frame(cone.Position()), cone.RefRadius(), cone.SemiAngle()

    def distance(points: Array) -> Array:
        across, along = place(points)
        return np.asarray(np.abs(across - radius - along * np.tan(angle)) * np.cos(angle))

    return distance


def searched(face: Any) -> Distance:
    """Nearest point by OCCT's search."""
    from OCP.BRep import BRep_Tool
    from OCP.GeomAPI import GeomAPI_ProjectPointOnSurf
    from OCP.gp import gp_Pnt

    surface = BRep_Tool.Surface_s(face.wrapped)

    def distance(points: Array) -> Array:
        found = (GeomAPI_ProjectPointOnSurf(gp_Pnt(*p), surface) for p in points)
        return np.array([f.LowerDistance() for f in found])

    return distance
