"""Gel mould: the gel's outer surface down, a flat lid on its back.

      flat gel, acrylic              everything else
      =====lid======                 =====lid======     gate and vents through the lid
      ##        ####  frame          ##        ####
      ##  gel   ####                 ##  gel   ####     cavity block, crown in its floor
      ==============  base           ##############

The cavity is the gel solid scaled by 1 / (1 - shrinkage) about the origin of the sensor frame.
Its walls are vertical and its floor has no undercut, so that the gel can be lifted out along z.

      .-------------------------------------.    seen from above, the lid towards the viewer
      | o                                 o |    o  clamp bolts
      |      .-----------------------.      |
      |      |                     · |      |    ·  vents at the far end
      | +    | G        gel        · |    + |    +  dowels, displaced: one way only
      |      |                     · |      |    G  pour gate
      |      '-----------------------'      |
      | o                                 o |
      '-------------------------------------'
                                          x to the tip

The mould's frame: origin at the centre of the gel's outer surface, which lies at the bottom;
x as in the finger, z up towards the lid, so y is that of the finger with the sign changed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.geometry.part import Part, Process
from gelslim_cad.markers.outline import Outline
from gelslim_cad.solids.gel import gel_solid, shaped_gel
from gelslim_cad.solids.shapes import Hole, Point2, box, prism, rectangle, single, subtract, union

WALL_MM = 4.0
FLOOR_MM = 5.0
LID_MM = 5.0
PEG_MM = 4.0
PEG_HEIGHT_MM = 3.5
CLEAR = (0.85, 0.92, 0.97, 0.45)
MOULD = (0.86, 0.78, 0.55, 1.0)
METAL = (0.72, 0.74, 0.76, 1.0)
TAGS = frozenset({"mould"})
FINISH = {
    "sla": "wash, cure and bake at 60 °C for 2 h, then varnish or coat with PVA: bare resin stops "
    "platinum silicone from curing",
    "fdm": "layer lines copy into the gel: sand and varnish the floor",
    "aluminium": "have it CNC milled from the STEP file, floor polished",
    "acrylic": "a crowned floor cannot be laser cut: have it CNC milled from the STEP file and "
    "vapour polished",
}
BORDER_MM = 14.0
"""Wall around the cavity; clamp bolts in its middle leave more than 5 mm on both sides."""
BOLT_MM = 3.4
DOWEL_MM = 3.0
DOWEL_OFFSET_MM = 2.0
VENT_MM = 1.0
HOLE_GAP_MM = 1.2
INSET_MM = 0.3
CORNER_MM = 3.0


def cavity_solid(d: Dimensions) -> cq.Solid:
    """The cavity in the sensor frame: the gel enlarged for shrinkage."""
    return single(gel_solid(d).scale(shrinkage_factor(d)), "mould_cavity")


def cavity_in_mould(d: Dimensions) -> cq.Solid:
    """The cavity in the mould's frame: turned over about x, its outer surface down."""
    return single(_turned(cavity_solid(d)), "mould_cavity")


def mould_parts(d: Dimensions) -> tuple[Part, ...]:
    """The mould's parts in the mould's frame, each where it is when closed.

    Raises SolidError naming a part that the kernel cannot make.
    """
    plan = plan_mould(d)
    process = d["manufacturing.mould_process"]
    if process == "acrylic" and plan.cavity.crown_mm == 0:
        return _layers(d, plan)
    return _block_and_lid(d, plan, process)


def clamped_mm(d: Dimensions) -> float:
    """Height that the bolts of the closed mould clamp."""
    plan = plan_mould(d)
    if d["manufacturing.mould_process"] == "acrylic" and plan.cavity.crown_mm == 0:
        thickness, count = plate_stock(d["manufacturing.acrylic_stock_mm"], WALL_MM)
        return plan.depth_mm + 2 * thickness * count
    return plan.depth_mm + FLOOR_MM + LID_MM


def _layers(d: Dimensions, plan: MouldPlan) -> tuple[Part, ...]:
    stock = d["manufacturing.acrylic_stock_mm"]
    thickness, count = plate_stock(stock, WALL_MM)
    nearest = min(stock, key=lambda s: abs(s - plan.depth_mm))
    through = (*plan.bolts, *plan.dowels)
    top = plan.depth_mm
    base = prism(plan.block, (-thickness, 0.0), through)
    frame = prism(plan.block, (0.0, top), through, [plan.cavity.outline])
    lid = prism(plan.block, (top, top + thickness), (*through, plan.gate, *plan.vents))
    bolt = clamped_mm(d)
    base_note = (
        "bottom plate, its upper face shapes the gel's outer surface: use an unscratched sheet; "
        f"clamp with 4 M3 bolts over {bolt:.1f} mm and 2 dowel pins of 3 mm"
    )
    frame_note = (
        f"sets the gel's thickness: must measure {top:.3f} mm; pick or mill the sheet by calliper "
        f"(nearest stock {nearest:g} mm, stock varies by "
        f"{100 * d['manufacturing.acrylic_tolerance_ratio']:.0f} %)"
    )
    acrylic = partial(_mould_part, material="cast acrylic", process="laser", colour=CLEAR)
    return (
        acrylic("mould_base", base, note=base_note, quantity=count),
        acrylic("mould_frame", frame, note=frame_note),
        acrylic("mould_lid", lid, note=_filling(plan), quantity=count),
    )


def _mould_part(
    name: str,
    shape: cq.Shape,
    *,
    material: str,
    process: Process,
    colour: tuple[float, float, float, float],
    note: str,
    quantity: int = 1,
) -> Part:
    return Part(
        name=name,
        solid=single(shape, name),
        material=material,
        process=process,
        colour=colour,
        quantity=quantity,
        in_assembly=False,
        note=note,
        tags=TAGS,
    )


def _filling(plan: MouldPlan) -> str:
    return (
        f"fill through the {plan.gate[2]:.1f} mm gate by syringe, that end lowered by about 10°; "
        f"air leaves by {len(plan.vents)} vents of {plan.vents[0][2]:g} mm; trim the sprues flush"
    )


def _block_and_lid(d: Dimensions, plan: MouldPlan, process: str) -> tuple[Part, ...]:
    printed = process in ("sla", "fdm")
    material = {"sla": "mould resin", "fdm": "PETG", "aluminium": "aluminium 6082"}.get(
        process, "cast acrylic"
    )
    colour = {"aluminium": METAL, "acrylic": CLEAR}.get(process, MOULD)
    lid_holes = (*plan.bolts, plan.gate, *plan.vents)
    pins = plan.dowels
    if printed:
        fit = 2 * float(d["design.housing.fit_clearance_mm"])
        pins = tuple((x, y, PEG_MM + fit) for x, y, _ in plan.dowels)
    top = plan.depth_mm
    lid = prism(plan.block, (top, top + LID_MM), (*lid_holes, *pins))
    bolt = clamped_mm(d)
    note = f"{FINISH[process]}; 4 M3 bolts over {bolt:.1f} mm hold the lid"
    if not printed:
        note += ", 2 dowel pins of 3 mm align it"
    part = partial(_mould_part, material=material, colour=colour)
    made: Process = "print" if printed else "buy"
    lid_made: Process = "laser" if process == "acrylic" else made
    return (
        part("mould_block", _block(plan, pegs=printed), process=made, note=note),
        part("mould_lid", lid, process=lid_made, note=_filling(plan)),
    )


def _block(plan: MouldPlan, pegs: bool) -> cq.Solid:
    top = plan.depth_mm
    holes = plan.bolts if pegs else (*plan.bolts, *plan.dowels)
    body: cq.Shape = prism(plan.block, (-FLOOR_MM, top), holes)
    if pegs:
        body = union([body, *(_peg(x, y, top) for x, y, _ in plan.dowels)])
    # The cutter reaches above the parting plane, so that no two faces coincide.
    cutter = _turned(shaped_gel(plan.cavity, extra_depth_mm=1.0))
    return single(subtract(body, [cutter, *_pry_notches(plan)]), "mould_block")


def _turned(shape: cq.Shape) -> cq.Shape:
    """Turn over about the x axis."""
    return shape.rotate(cq.Vector(0, 0, 0), cq.Vector(1, 0, 0), 180)


def _peg(x: float, y: float, base_z: float) -> cq.Solid:
    """Round peg with a 45° lead-in, rooted 1 mm inside the block."""
    r, lead, top = PEG_MM / 2, 0.8, base_z + PEG_HEIGHT_MM
    profile = [(0, base_z - 1), (r, base_z - 1), (r, top - lead), (r - lead, top), (0, top)]
    wire = cq.Wire.makePolygon([cq.Vector(x + u, y, z) for u, z in profile], close=True)
    return cq.Solid.revolve(wire, [], 360.0, cq.Vector(x, y, 0), cq.Vector(x, y, 1))


def _pry_notches(plan: MouldPlan) -> list[cq.Solid]:
    """Notches under the lid's long edges for a coin or a screwdriver."""
    outer_y, top = plan.block.bounds_mm[3], plan.depth_mm
    z: Point2 = (top - min(1.5, plan.depth_mm), top + 1.0)
    spans: tuple[Point2, Point2] = ((outer_y - 3.0, outer_y + 1.0), (-outer_y - 1.0, 3.0 - outer_y))
    return [box((-5.0, 5.0), span, z) for span in spans]


@dataclass(frozen=True)
class MouldPlan:
    """The mould from above. Lengths in mm in the mould's frame."""

    cavity: GelShape
    """The gel enlarged for shrinkage."""
    block: Outline
    gate: Hole
    vents: tuple[Hole, ...]
    bolts: tuple[Hole, ...]
    dowels: tuple[Hole, ...]

    @property
    def depth_mm(self) -> float:
        """Depth of the cavity at its centre, the height of the parting plane."""
        return self.cavity.thickness_mm


def shrinkage_factor(d: Dimensions) -> float:
    """Cavity over gel, 1 / (1 - linear shrinkage)."""
    return 1.0 / (1.0 - float(d["manufacturing.gel_shrinkage_percent"]) / 100.0)


def plan_mould(d: Dimensions) -> MouldPlan:
    """Lay out gate, vents, bolts and dowels around the cavity."""
    cavity = GelShape.of(d).scaled(shrinkage_factor(d))
    half_x, half_y = cavity.length_mm / 2, cavity.width_mm / 2
    x, y = half_x + BORDER_MM / 2, half_y + BORDER_MM / 2
    outer_x, outer_y = half_x + BORDER_MM, half_y + BORDER_MM
    bolts = ((-x, -y, BOLT_MM), (x, -y, BOLT_MM), (x, y, BOLT_MM), (-x, y, BOLT_MM))
    gate_mm = min(6.0, 0.25 * min(cavity.length_mm, cavity.width_mm))
    gate = (-half_x + gate_mm / 2 + INSET_MM, 0.0, gate_mm)
    return MouldPlan(
        cavity=cavity,
        block=rectangle((-outer_x, outer_x), (-outer_y, outer_y), CORNER_MM),
        gate=gate,
        vents=_vents(cavity, gate),
        bolts=bolts,
        dowels=((x, 0.0, DOWEL_MM), (-x, DOWEL_OFFSET_MM, DOWEL_MM)),
    )


def _vents(cavity: GelShape, gate: Hole) -> tuple[Hole, ...]:
    """Vents where air collects: at the far corners first, then where there is room for more.

    The lid's underside is flat. With the gate's end lowered the far corners are the highest
    points; in a level mould the near corners and the far side may hold a bubble as well.
    """
    cx, cy = cavity.inset_corner_mm(VENT_MM / 2 + INSET_MM)
    far = cavity.length_mm / 2 - VENT_MM / 2 - INSET_MM
    kept: list[Hole] = []
    for x, y in ((cx, cy), (cx, -cy), (far, 0.0), (-cx, cy), (-cx, -cy)):
        taken = [gate, *kept]
        room = all(
            math.hypot(x - u, y - v) - (VENT_MM + diameter) / 2 >= HOLE_GAP_MM
            for u, v, diameter in taken
        )
        if room or len(kept) < 2:
            kept.append((x, y, VENT_MM))
    return tuple(kept)


def plate_stock(stock_mm: Sequence[float], least_mm: float) -> tuple[float, int]:
    """Thickness of the sheet for a plate of at least `least_mm`, and how many to stack.

    The thinnest sheet that is thick enough is taken, or else several of the thickest.
    """
    alone = [s for s in stock_mm if s >= least_mm - 1e-9]
    if alone:
        return min(alone), 1
    thickest = max(stock_mm)
    return thickest, math.ceil(least_mm / thickest - 1e-9)
