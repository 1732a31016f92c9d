"""Gel pad: rounded rectangle of clear silicone, flat or crowned, bonded to the window.

   ________________          z = 0, outer surface with the printed markers
 .'                '.
|____________________|       z = stack.gel_bottom_z_mm, bonded to the acrylic
"""

from __future__ import annotations

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import GelShape, has_markers
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.shapes import prism, single

GEL = (0.93, 0.93, 0.90, 0.55)


def gel_pad(d: Dimensions) -> Part:
    """The cast gel in its place."""
    shape = GelShape.of(d)
    return Part(
        name="gel_pad",
        solid=gel_solid(d),
        material=str(d["material.gel.name"]),
        process="cast",
        colour=GEL,
        explode_mm=(0.0, 0.0, 22.0),
        note=(
            f"cast, {shape.volume_mm3 / 1000:.2f} ml; "
            + ("markers go on the outer surface, " if has_markers(d) else "")
            + "the back is bonded to the acrylic window"
        ),
    )


def gel_solid(d: Dimensions) -> cq.Solid:
    """The gel as a solid. Raises SolidError when the kernel fails."""
    return shaped_gel(GelShape.of(d))


def shaped_gel(shape: GelShape, extra_depth_mm: float = 0.0) -> cq.Solid:
    """Solid of `shape`; as a cutting tool its flat back is lowered by `extra_depth_mm`."""
    low = -shape.thickness_mm - extra_depth_mm
    if shape.crown_mm <= 0:
        return single(prism(shape.outline, (low, 0.0)), "gel_pad")
    # The prism ends above the apex, so that its top is cut by the dome alone.
    column = prism(shape.outline, (low, 1.0 + shape.crown_mm))
    return single(column.intersect(_below_dome(shape, low)), "gel_pad")


def _below_dome(shape: GelShape, low_mm: float) -> cq.Solid:
    """The space below the paraboloid, over a rectangle that contains the outline.

    Over a rectangle the paraboloid is exactly one Bézier patch of degree 2 x 2. It has neither a
    pole nor a seam, so that its meshes are closed.
    """
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.Geom import Geom_BezierSurface
    from OCP.gp import gp_Pnt, gp_Vec
    from OCP.TColgp import TColgp_Array2OfPnt

    a, b = 0.55 * shape.length_mm + 1.0, 0.55 * shape.width_mm + 1.0
    curvature = shape.crown_mm / shape.rim_mm**2
    poles = TColgp_Array2OfPnt(1, 3, 1, 3)
    # On [-a, a] the function x² has the Bézier values a², -a², a².
    for i, (x, xx) in enumerate(((-a, a * a), (0.0, -a * a), (a, a * a)), start=1):
        for j, (y, yy) in enumerate(((-b, b * b), (0.0, -b * b), (b, b * b)), start=1):
            poles.SetValue(i, j, gp_Pnt(x, y, -curvature * (xx + yy)))
    dome = BRepBuilderAPI_MakeFace(Geom_BezierSurface(poles), 1e-7).Face()
    sweep = low_mm - 1.0 - shape.crown_mm
    return single(
        cq.Shape.cast(BRepPrimAPI_MakePrism(dome, gp_Vec(0, 0, sweep)).Shape()), "gel_pad"
    )
