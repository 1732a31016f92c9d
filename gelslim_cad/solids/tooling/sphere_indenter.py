"""Sphere indenter: a spherical cap of known radius on a flange, for force calibration.

     .-""-.         spherical cap, radius R
     |    |         stem, as thick as the cap
.----'    '----.
|  o        o  |    flange with two holes for M3, onto a force gauge
'--------------'
"""

from __future__ import annotations

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.materials import PRINTED
from gelslim_cad.solids.prism import prism, rectangle
from gelslim_cad.solids.shapes import box, rod, single, union

RADIUS_MM = 5.0
FLANGE_MM = 24.0
FLANGE_WIDTH_MM = 14.0
FLANGE_THICKNESS_MM = 5.0
STEM_MM = 8.0
BOLT_MM = 3.4
BOLT_SPACING_MM = 16.0
INDENTER = (0.85, 0.86, 0.88, 1.0)


def indenter_radius_mm(shape: GelShape) -> float:
    """Radius of the sphere: 5 mm, or less for a gel that is too small for it."""
    return min(RADIUS_MM, 0.4 * min(shape.length_mm, shape.width_mm))


def sphere_indenter(d: Dimensions) -> Part:
    """The indenter, flange at z = 0, cap upwards."""
    radius = indenter_radius_mm(GelShape.of(d))
    apex = FLANGE_THICKNESS_MM + STEM_MM
    half = BOLT_SPACING_MM / 2
    flange = prism(
        rectangle(
            (-FLANGE_MM / 2, FLANGE_MM / 2), (-FLANGE_WIDTH_MM / 2, FLANGE_WIDTH_MM / 2), 3.0
        ),
        (0.0, FLANGE_THICKNESS_MM),
        [(-half, 0.0, BOLT_MM), (half, 0.0, BOLT_MM)],
    )
    stem = rod(0.0, 0.0, (1.0, apex + 1.0), 1.6 * radius)
    side = (-1.5 * radius, 1.5 * radius)
    above = box(side, side, (apex - radius, apex + 2.0)).cut(_ball(radius, apex - radius))
    solid = union([flange, stem.cut(above)])
    return Part(
        name="sphere_indenter",
        solid=single(solid, "sphere_indenter"),
        material=PRINTED[d["manufacturing.print_process"]],
        process="print",
        colour=INDENTER,
        in_assembly=False,
        note=f"spherical cap of radius {radius:g} mm; polish it, screw it to a force gauge or "
        "load it with weights and press it on the gel",
        tags=frozenset({"tooling"}),
    )


def _ball(radius: float, centre_z: float) -> cq.Shape:
    """Sphere with its poles on the x axis and its seam below: the cap contains neither."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    axes = gp_Ax2(gp_Pnt(0, 0, centre_z), gp_Dir(1, 0, 0), gp_Dir(0, 0, -1))
    return cq.Shape.cast(BRepPrimAPI_MakeSphere(axes, radius).Solid())
