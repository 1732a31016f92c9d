"""The clamp that holds the camera at its pitch: floor, cheeks with lips, and what lies behind.

Seen from the gel. Loose: a bar behind the module. Preloaded: points (*) before the module and at
its -y side, and leaf springs behind it. The cable passes between bar or springs, open upwards, so
that the camera drops in with its cable.

       +y   cheek | lip          +y  spring/| cheek   | lip
    bar |[ module ]                      |/[ module ]*
    ... |[        ]= lens            ... | [        ]  = lens
    bar |[        ]                      |-[        ]*
       -y   cheek | lip          -y  spring | * cheek | lip
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.dimensions.fold.housing import CLAMP_BAR_MM
from gelslim_cad.dimensions.housing import CLAMP_CHEEK_MM
from gelslim_cad.dimensions.seat import CABLE_GAP_MM, LEAST_LIP_MM, POINT_MM
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.camera import placed
from gelslim_cad.solids.layout import Layout
from gelslim_cad.solids.materials import CLAMP, PRINTED
from gelslim_cad.solids.shapes import (
    Point2,
    SolidError,
    box,
    pair,
    pointed_rod,
    prism_across,
    single,
    subtract,
    union,
)

FAR_MM = 200.0
SCREW_DEPTH_MM = 5.0
LEAST_FLOOR_MM = 0.8
"""Thinner floors of the clamp are left out: there the cover is the floor."""
NUB_MM = 0.6
"""From a leaf spring to the module."""
SPRING_GAP_MM = 1.0
"""From the module's rear face to the cheeks, so that the springs are free."""
TIP_MM = 1.0
"""Of a spring beyond the middle of its nub."""
OVERLAP_MM = 0.1


def clamp_screw_positions(d: Dimensions) -> list[Point2]:
    """Positions (x, y) of the screws that hold the clamp's cheeks from below.

    Over the depth of their holes they are in the middle between the cheeks' front and the gap of
    the springs, both of which lean with the camera.
    """
    f = _Frame.of(d)
    ends = (d["cover.top_z_mm"], d["cover.top_z_mm"] + SCREW_DEPTH_MM)
    front = min(_x_at(d, f.face + (f.play + f.lip if _lips(f) else 0.0), z) for z in ends)
    gap = f.rear + (SPRING_GAP_MM if d["clamp.preloaded"] > 0 else 0.0)
    x = (front + max(_x_at(d, gap, z) for z in ends)) / 2
    y = d["clamp.width_mm"] / 2 - CLAMP_CHEEK_MM / 2
    return [(x, -y), (x, y)]


def _x_at(d: Dimensions, along_mm: float, z_mm: float) -> float:
    """Where a plane across the camera's axis, at a place along it, has a height in the finger."""
    low, high = (placed(d, cq.Vertex.makeVertex(along_mm, 0, h)).Center() for h in (-1.0, 1.0))
    return float(low.x + (z_mm - low.z) / (high.z - low.z) * (high.x - low.x))


def camera_clamp(d: Dimensions) -> Part:
    """The clamp as the camera bends its springs, and as it is printed."""
    seated = d["clamp.preloaded"] > 0
    note = "drop the camera in from the gel side, its cable between the springs, down to the floor"
    part = Part(
        name="camera_clamp",
        solid=_clamp(d, 0.0),
        material=PRINTED[d["manufacturing.print_process"]],
        process="print",
        colour=CLAMP,
        explode_mm=(0, 0, -40),
        note=note if seated else "drop the camera in from the gel side; align it, then glue it",
    )
    if not seated:
        return part
    return replace(part, printed=_clamp(d, d["clamp.spring_deflection_mm"]))


@dataclass(frozen=True)
class _Frame:
    """Sizes of the clamp in the camera's frame."""

    play: float
    face: float
    rear: float
    """Rear face of the module."""
    half_width: float
    half_height: float
    outer: float
    lens: float
    lip: float
    cable: float
    """Half the width of the passage of the cable."""

    @classmethod
    def of(cls, d: Dimensions) -> _Frame:
        face = -d["camera_pose.face_mm"]
        return cls(
            play=d["clamp.play_mm"],
            face=face,
            rear=face - d["camera.module_depth_mm"],
            half_width=d["camera.module_width_mm"] / 2,
            half_height=d["camera.module_height_mm"] / 2,
            outer=d["clamp.width_mm"] / 2,
            lens=d["camera.lens_diameter_mm"] / 2,
            lip=d["clamp.lip_mm"],
            cable=d["camera.cable_width_mm"] / 2 + d["design.housing.fit_clearance_mm"],
        )

    @property
    def inner(self) -> float:
        """Inner face of a cheek."""
        return self.half_width + self.play

    @property
    def back(self) -> float:
        """Rear end of the clamp."""
        return self.rear - self.play - CLAMP_BAR_MM

    @property
    def floor(self) -> float:
        """Upper face of the floor."""
        return -self.half_height - self.play


def _clamp(d: Dimensions, forward_mm: float) -> cq.Solid:
    """The clamp whose springs stand forward by a length; 0 with the camera in place.

    Raises SolidError where the cable parts it and no floor joins its halves.
    """
    at, f = Layout(d), _Frame.of(d)
    pieces = _lips(f)
    pieces += _seat(d, f, forward_mm) if d["clamp.preloaded"] > 0 else _bar(f)
    floor = box((f.back, f.face), (-f.outer, f.outer), (f.floor - 0.1, f.floor))
    floored = placed(d, floor).BoundingBox().zmin - d["cover.top_z_mm"] > LEAST_FLOOR_MM
    if d["camera.cable_exit"] == "bottom":
        _joined_before_cable(d, f, floored)
    if floored:
        pieces.append(box((f.back, f.face), (-f.outer, f.outer), (-FAR_MM, f.floor)))
    whole = subtract(union(pieces), [_passage(d, f, forward_mm)])
    slab = box(
        (-FAR_MM, FAR_MM),
        (-FAR_MM, FAR_MM),
        (d["cover.top_z_mm"], d["stack.window_bottom_z_mm"] - 0.1),
    )
    low = d["cover.top_z_mm"] - 0.1
    holes = [
        pointed_rod(x, y, (low, low + 0.1 + SCREW_DEPTH_MM), at.screw.pilot_mm)
        for x, y in clamp_screw_positions(d)
    ]
    cradle = placed(d, whole).intersect(slab)
    return single(subtract(cradle, holes), "camera_clamp")


def _joined_before_cable(d: Dimensions, f: _Frame, floored: bool) -> None:
    """Raise SolidError where no floor joins the halves before a cable at the bottom."""
    parted = "camera_clamp is parted by the cable, which leaves at the bottom, and has no room for "
    if not floored:
        raise SolidError(f"{parted}a floor under the module (rule cable.floor_mm)")
    if f.face - f.rear <= d["cable.thickness_mm"] + CABLE_GAP_MM:
        raise SolidError(f"{parted}a floor before so thick a cable (rule cable.depth_mm)")


def _lips(f: _Frame) -> list[cq.Shape]:
    """The lips before the module, beside the lens."""
    if not (f.lip > LEAST_LIP_MM and f.lens + f.play < f.inner - LEAST_LIP_MM):
        return []
    reach = (f.face + f.play, f.face + f.play + f.lip)
    below = (-FAR_MM, f.lens)
    return [
        *pair((f.face - OVERLAP_MM, reach[1]), (f.inner, f.outer), below),
        *pair(reach, (f.lens + f.play, f.inner + OVERLAP_MM), below),
    ]


def _bar(f: _Frame) -> list[cq.Shape]:
    """Cheeks and bar of the loose clamp."""
    return [
        *pair((f.back, f.face), (f.inner, f.outer), (-FAR_MM, f.half_height)),
        box((f.back, f.rear - f.play), (-f.outer, f.outer), (-FAR_MM, 0)),
    ]


def _passage(d: Dimensions, f: _Frame, forward_mm: float) -> cq.Shape:
    """Free space of the cable behind the module, open upwards."""
    low, front = -FAR_MM, f.rear + max(d["cable.thickness_mm"] + CABLE_GAP_MM, forward_mm)
    if d["camera.cable_exit"] == "rear":
        low, front = -d["cable.thickness_mm"] / 2 - CABLE_GAP_MM, f.rear + forward_mm
    elif d["camera.cable_exit"] == "top":
        low = f.half_height - CABLE_GAP_MM
    return box((-FAR_MM, front), (-f.cable, f.cable), (low, FAR_MM))


def _seat(d: Dimensions, f: _Frame, forward_mm: float) -> list[cq.Shape]:
    """Cheeks, base, points and springs of the clamp that presses the camera."""
    inner = f.outer - d["clamp.spring_width_mm"]
    link = min(f.floor, -d["cable.thickness_mm"] / 2 - CABLE_GAP_MM)
    return [
        *pair((f.rear + SPRING_GAP_MM, f.face), (f.inner, f.outer), (-FAR_MM, f.half_height)),
        *pair((f.back, f.face), (min(f.cable, f.inner), f.outer), (-FAR_MM, f.floor)),
        box((f.back, f.rear - f.play), (-f.outer, f.outer), (-FAR_MM, link)),
        *pair((f.back, f.rear - f.play), (inner, f.outer), (-FAR_MM, _root(d, f))),
        *_points(f),
        *_springs(d, f, forward_mm),
    ]


def _points(f: _Frame) -> list[cq.Shape]:
    """Three points before the module, two at its -y side, and one on the floor."""
    touch = f.face
    before = (touch, touch + f.play + OVERLAP_MM)
    lower, upper = -f.half_height + POINT_MM / 2, f.lens - POINT_MM / 2
    beside = (f.lens + f.play, f.half_width)
    half = POINT_MM / 2

    def front(y: Point2, z: float) -> cq.Shape:
        return box(before, y, (z - half, z + half))

    away = (-beside[1], -beside[0])
    centre = (f.rear + SPRING_GAP_MM + f.face) / 2
    middle = (centre - half, centre + half)
    side = (-f.inner - OVERLAP_MM, -f.half_width)
    sides = f.half_height - POINT_MM
    points: list[cq.Shape] = [
        front(away, lower),
        front(away, upper),
        front(beside, (lower + upper) / 2),
        box(middle, side, (sides - half, sides + half)),
        box(middle, side, (-sides - half, -sides + half)),
    ]
    if f.play > 0:
        corner = (-f.inner - OVERLAP_MM, -f.half_width + POINT_MM)
        points.append(box(middle, corner, (-f.half_height - POINT_MM, -f.half_height)))
    return points


def _springs(d: Dimensions, f: _Frame, forward_mm: float) -> list[cq.Shape]:
    """Leaf springs behind the module; the nub at +y meets its rear edge under 45°."""
    front = f.rear - NUB_MM
    leaf = (front - d["clamp.spring_mm"], front)
    inner = f.outer - d["clamp.spring_width_mm"]
    touch, root = f.rear + forward_mm, front - OVERLAP_MM
    height = f.half_height / 2
    end = max(f.half_width, inner) + NUB_MM
    wedge = [
        (root, f.half_width - NUB_MM - OVERLAP_MM - forward_mm),
        (touch + NUB_MM / 2, f.half_width + NUB_MM / 2),
        (touch + NUB_MM / 2, end),
        (root, end),
    ]
    flat = [(root, -f.outer), (touch, -f.outer), (touch, POINT_MM - f.half_width)]
    flat.append((root, POINT_MM - f.half_width))
    return [
        *pair(leaf, (inner, f.outer), (_root(d, f) - OVERLAP_MM, height + TIP_MM)),
        *(_nub(outline, height) for outline in (flat, wedge)),
    ]


def _root(d: Dimensions, f: _Frame) -> float:
    """Height at which the springs begin, their nubs half way up the module's upper half."""
    return float(f.half_height / 2 - d["clamp.spring_length_mm"])


def _nub(outline: list[Point2], height: float) -> cq.Shape:
    """Prism over an outline (x, y) whose ends slope, for the camera to slide in and to print."""
    wire = cq.Wire.makePolygon(
        [cq.Vector(x, y, height - TIP_MM) for x, y in [*outline, outline[0]]]
    )
    whole = cq.Solid.extrudeLinear(wire, [], cq.Vector(0, 0, 2 * TIP_MM))
    low, high = min(x for x, _ in outline), max(x for x, _ in outline)
    flat = POINT_MM / 4
    sloped = [
        (low, height - TIP_MM),
        (high, height - flat),
        (high, height + flat),
        (low, height + TIP_MM),
    ]
    return whole.intersect(prism_across(sloped, FAR_MM))
