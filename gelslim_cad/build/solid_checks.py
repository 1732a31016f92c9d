"""Design rules that need the solids: free view, no interference, a mould that can be used."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import partial
from typing import Literal

import cadquery as cq
import numpy as np
from numpy.typing import NDArray

from gelslim_cad.checks import Check
from gelslim_cad.dimensions import Dimensions
from gelslim_cad.export.mesh import face_patches
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.geometry.optics import corner_rays
from gelslim_cad.geometry.part import Part
from gelslim_cad.proof.solids import TOLERANCE_MM3, bounding_box, interferences
from gelslim_cad.solids.own_parts import OWN, own_source
from gelslim_cad.solids.shapes import Hole, single

UNDERCUT_MM2 = 1e-3
LEAST_WALL_MM = 3.0
"""Between the cavity and the nearest hole: the wall holds liquid silicone and a clamp's force."""
LEAST_WEB_MM = 0.8
"""Between two openings of the lid: two passes of a common nozzle, more than a laser's kerf."""
LEAST_VENTS = 2
OPTICAL_PARTS = frozenset({"light_guide", "gel_pad", "mirror", "camera"})
"""Parts that bound the view or that the light passes through."""
INSET_MM = 0.02
Points = NDArray[np.float64]
LINEAR_MM = 0.02
ANGLE_DEG = 5.0
SLOPE = 1e-4
"""Walls inclined by less than this (0.006°) count as parallel to the pull."""
OPENING_MM = 1e-6


def check_solids(d: Dimensions, parts: Sequence[Part]) -> tuple[Check, ...]:
    """Line of sight past the actual solids, and interference between all pairs of parts."""
    blocked = blocked_volumes(d, parts)
    pairs = interferences(parts)
    own = {p.name: f"{p.name} ({own_source(p)})" for p in parts if OWN in p.tags}
    return (
        _check(
            ("view.line_of_sight", "View from gel over mirror to camera is free"),
            (sum(blocked.values()), 0.0, "mm³"),
            "in the way: "
            + ", ".join(f"{own.get(n, n)} ({v:.2f} mm³)" for n, v in blocked.items()),
            ("design.optics.clearance_mm", "give the view more clearance"),
        ),
        _check(
            ("assembly.interference", "No two parts share space"),
            (sum(p.volume_mm3 for p in pairs), TOLERANCE_MM3, "mm³"),
            "; ".join(
                f"{own.get(p.first, p.first)} and {own.get(p.second, p.second)} share "
                f"{p.volume_mm3:.3f} mm³"
                for p in pairs
            ),
            ("design.housing.fit_clearance_mm", "give the parts more room"),
        ),
    )


def check_mould(d: Dimensions) -> tuple[Check, ...]:
    """Undercut of the cavity, thickness of its walls, webs between the lid's openings, vents."""
    from gelslim_cad.solids.tooling.mould import cavity_in_mould, plan_mould

    plan = plan_mould(d)
    wall_mm = _least_wall_mm(plan.cavity, (*plan.bolts, *plan.dowels))
    web_mm = _least_web_mm((plan.gate, *plan.vents))
    return (
        _mould_check(
            ("mould.undercut_mm2", "Gel comes out of its mould along a straight line"),
            (undercut_area_mm2(cavity_in_mould(d)), UNDERCUT_MM2, "mm²"),
            "the mould overhangs part of the casting",
            ("design.gel.crown_height_mm", "lower the crown"),
            "max",
        ),
        _mould_check(
            ("mould.wall_mm", "Walls of the mould"),
            (wall_mm, LEAST_WALL_MM, "mm"),
            "the wall between cavity and clamp would bend or leak",
            ("design.gel.length_mm", "make the gel larger"),
            "min",
        ),
        _mould_check(
            ("mould.web_mm", "Gate and vents stand apart"),
            (web_mm, LEAST_WEB_MM, "mm"),
            "the lid would break between its openings",
            ("design.gel.width_mm", "make the gel larger"),
            "min",
        ),
        _mould_check(
            ("mould.vents", "Air can leave the mould"),
            (float(len(plan.vents)), float(LEAST_VENTS), ""),
            "trapped air leaves holes in the gel",
            ("design.gel.length_mm", "make the gel larger"),
            "min",
        ),
    )


def _least_wall_mm(cavity: GelShape, holes: Iterable[Hole]) -> float:
    return min(_outside_mm(cavity, x, y) - diameter / 2 for x, y, diameter in holes)


def _outside_mm(shape: GelShape, x: float, y: float) -> float:
    """Distance of a point from the rounded rectangle, negative within."""
    r = shape.corner_radius_mm
    dx, dy = abs(x) - (shape.length_mm / 2 - r), abs(y) - (shape.width_mm / 2 - r)
    return math.hypot(max(dx, 0.0), max(dy, 0.0)) + min(max(dx, dy), 0.0) - r


def _least_web_mm(openings: tuple[Hole, ...]) -> float:
    return min(
        math.hypot(a[0] - b[0], a[1] - b[1]) - (a[2] + b[2]) / 2
        for i, a in enumerate(openings)
        for b in openings[:i]
    )


def _check(
    rule: tuple[str, str],
    found: tuple[float, float, str],
    problem: str,
    remedy: tuple[str, str],
    sense: Literal["max", "min", ""] = "",
    measured_on: str = "the solids",
    group: str = "",
) -> Check:
    """Compare a value with its limit, which is a least value only where `sense` is "min"."""
    value, limit, unit = found
    margin = value - limit if sense == "min" else limit - value
    good = margin >= 0
    return Check(
        id=rule[0],
        title=rule[1],
        value=value,
        limit=limit,
        unit=unit,
        margin=margin,
        status="pass" if good else "fail",
        reason=f"measured on {measured_on}" if good else problem,
        parameter=remedy[0],
        advice="" if good else remedy[1],
        sense=sense,
        group=group,
    )


_mould_check = partial(
    _check, measured_on="mould and cavity", group="Printing, casting and marking"
)


def view_corridor(d: Dimensions) -> tuple[cq.Solid, cq.Solid]:
    """Pyramid from camera to mirror and frustum from mirror to window, inset by 0.02 mm."""
    _, mirror, window = corner_rays(d)
    pinhole = np.array([d["camera_pose.x_mm"], 0, d["camera_pose.z_mm"]])
    angle = math.radians(d["mirror.angle_deg"])
    lift = INSET_MM * np.array([-math.sin(angle), 0, math.cos(angle)])
    face, under = mirror + lift, window - np.array([0, 0, INSET_MM])
    pyramid = [[pinhole, face[k], face[(k + 1) % 4]] for k in range(4)]
    pyramid.append(list(face))
    frustum = [[face[k], face[(k + 1) % 4], under[(k + 1) % 4], under[k]] for k in range(4)]
    frustum += [list(face), list(under)]
    return _polyhedron(pyramid, "camera view"), _polyhedron(frustum, "gel view")


def _polyhedron(faces: Iterable[list[Points]], name: str) -> cq.Solid:
    planar = []
    for points in faces:
        # Triangles instead of quadrilaterals, whose four corners are not exactly coplanar.
        for k in range(1, len(points) - 1):
            loop = [cq.Vector(*points[0]), cq.Vector(*points[k]), cq.Vector(*points[k + 1])]
            planar.append(cq.Face.makeFromWires(cq.Wire.makePolygon([*loop, loop[0]])))
    shell = cq.Shell.makeShell(planar)
    solid = cq.Solid.makeSolid(shell)
    return single(solid.fix() if solid.Volume() < 0 else solid, name)


def blocked_volumes(d: Dimensions, parts: Iterable[Part]) -> dict[str, float]:
    """Volume in mm³ by which each part obstructs the view; empty when the view is free."""
    pieces = [(piece, bounding_box(piece)) for piece in view_corridor(d)]
    taken: dict[str, float] = {}
    for part in parts:
        if part.name in OPTICAL_PARTS:
            continue
        box = bounding_box(part.solid)
        near = [piece for piece, around in pieces if not around.IsOut(box)]
        volume = sum(abs(part.solid.intersect(piece).Volume()) for piece in near)
        if volume > 1e-4:
            taken[part.name] = volume
    return taken


def undercut_area_mm2(
    casting: cq.Shape, pull: tuple[float, float, float] = (0.0, 0.0, 1.0)
) -> float:
    """Area (mm²) of the casting's surface that is undercut when the casting is pulled out.

    The casting fills the cavity, whose opening is the plane farthest along `pull`. A surface whose
    outward normal has a component along `pull` lies under a part of the mould, unless it is the
    opening itself. The surface is sampled on a mesh within 0.02 mm, with the exact normals of the
    CAD faces: the facets of an upright cylinder may be inclined although the cylinder is not.
    """
    axis = np.asarray(pull, dtype=float)
    axis = axis / np.linalg.norm(axis)
    patches = face_patches(casting, LINEAR_MM, ANGLE_DEG)
    corners = np.concatenate([p.nodes_mm[p.triangles] for p in patches])
    normals = np.concatenate([p.normals[p.triangles].mean(axis=1) for p in patches])
    sides = corners[:, 1:] - corners[:, :1]
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2
    height = corners @ axis
    opening = height.min(axis=1) >= height.max() - OPENING_MM
    inclined = normals @ axis > SLOPE
    return float(area[inclined & ~opening].sum())
