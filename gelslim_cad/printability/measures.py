"""Everything that is measured of a part for printing."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from gelslim_cad.export.mesh import TriangleMesh
from gelslim_cad.printability.first_layer import first_layer
from gelslim_cad.printability.holes import round_holes
from gelslim_cad.printability.overhangs import overhangs
from gelslim_cad.printability.surface import Surface
from gelslim_cad.printability.walls import least_wall

Point = tuple[float, float, float]


@dataclass(frozen=True)
class PrintMeasures:
    """A part as it stands on the plate. Lengths in mm, areas in mm², places on the plate.

    Attributes:
        size_mm: Sides of its box.
        wall_mm: Thinnest wall; None where all are thicker than 4 mm.
        wall_at_mm: A point on it.
        hole_mm: Narrowest round hole; None where there is none.
        overhang_mm2: Area that is steeper than the limit and spans more than the bridge.
        bridge_mm: Widest span of faces steeper than the limit.
        bridge_at_mm: Its middle.
        on_part_mm2: The share of `overhang_mm2` below which the part itself lies, so that supports
            would stand on it.
        floating: Regions that begin in the air.
        plate_mm2: Area on the plate.
        sharp_mm: Length of its sharp edges there.
        openings: Holes and windows that begin there with a sharp edge.
    """

    size_mm: Point
    wall_mm: float | None
    wall_at_mm: Point | None
    hole_mm: float | None
    overhang_mm2: float
    bridge_mm: float
    bridge_at_mm: Point | None
    on_part_mm2: float
    floating: int
    plate_mm2: float
    sharp_mm: float
    openings: int


def measure(mesh: TriangleMesh, solid: Any, overhang_deg: float, bridge_mm: float) -> PrintMeasures:
    """Measure a part for printing.

    Args:
        mesh: Its closed mesh in print orientation, its lowest point at z = 0.
        solid: Its `cadquery` solid, for the holes.
        overhang_deg: Steepest angle from the vertical without support.
        bridge_mm: Widest span without support.

    Returns:
        The measures; the same mesh gives the same figures.
    """
    surface = Surface(mesh)
    wall, found, layer = least_wall(surface), overhangs(surface, overhang_deg), first_layer(surface)
    wide = [o for o in found if o.span_mm > bridge_mm]
    carried = [o for o in found if math.isfinite(o.span_mm)]
    holes = round_holes(solid)
    x, y, z = (mesh.vertices_mm.max(axis=0) - mesh.vertices_mm.min(axis=0)).tolist()
    return PrintMeasures(
        size_mm=(round(x, 3), round(y, 3), round(z, 3)),
        wall_mm=wall.thickness_mm if wall else None,
        wall_at_mm=wall.at_mm if wall else None,
        hole_mm=round(holes[0].diameter_mm, 4) if holes else None,
        overhang_mm2=round(math.fsum(o.area_mm2 for o in wide), 3),
        bridge_mm=round(carried[0].span_mm, 3) if carried else 0.0,
        bridge_at_mm=carried[0].at_mm if carried else None,
        on_part_mm2=round(math.fsum(o.area_mm2 for o in wide if o.over_part), 3),
        floating=len(found) - len(carried),
        plate_mm2=round(layer.area_mm2, 3),
        sharp_mm=round(layer.sharp_mm, 3),
        openings=layer.openings,
    )
