"""Tip bezel: it frames the gel and clamps the ends of the window, which compresses the shims."""

from __future__ import annotations

import cadquery as cq

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.dimensions.precompression import SHIM_GAP_MM, WINDOW_GAP_MM
from gelslim_cad.geometry.led_strips import has_tip_light
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.layout import Layout
from gelslim_cad.solids.materials import ALUMINIUM, BEZEL, METALS, PRINTED, SHIM, STEEL
from gelslim_cad.solids.shapes import (
    box,
    chamfered,
    countersink,
    prism,
    rectangle,
    rod,
    rounded_box,
    single,
    subtract,
)

CHAMFER_MM = 0.5


def bezel(d: Dimensions) -> Part:
    """The bezel with its gel window and four countersunk holes: printed, or metal sheet."""
    at, metal = Layout(d), d["design.housing.bezel_material"] != "printed"
    plate = _plate(d, at)
    if not metal:
        x, z = d["bezel.proximal_x_mm"], (d["stack.gel_bottom_z_mm"], at.top_z_mm)
        top = next(f for f in plate.Faces() if abs(f.Center().z - z[1]) < 1e-6)
        edges = [e for e in top.Edges() if abs(e.Center().x - x) > 1e-6]
        plate = chamfered(plate, edges, min(CHAMFER_MM, 0.4 * (z[1] - z[0])))
    s = at.screw
    holes = [
        countersink(
            h.x_mm,
            h.y_mm,
            h.surface_z_mm,
            -1,
            s.countersunk_head_mm,
            s.clearance_mm,
            h.plate_mm + 0.5,
        )
        for h in at.bezel_holes()
    ]
    note = "screwing it down compresses the shims and pre-loads the acrylic"
    if metal:
        note += (
            f"; countersink the four holes of its blank by 90° to {s.countersunk_head_mm:g} mm, "
            "break all edges"
        )
    return Part(
        name="tip_bezel",
        solid=single(subtract(plate, [_window(d, at), *holes]), "tip_bezel"),
        material=_material(d),
        process="countersink" if metal else "print",
        colour=_colour(d),
        explode_mm=(0, 0, 34),
        note=note,
        print_rotation_deg=(180, 0, 0),
    )


def bezel_blank(d: Dimensions) -> Part:
    """Flat blank of a metal bezel: its outline, the gel window and the screws' clearance holes."""
    at = Layout(d)
    z = (d["stack.gel_bottom_z_mm"], at.top_z_mm)
    holes = [
        rod(h.x_mm, h.y_mm, (z[0] - 1, z[1] + 1), at.screw.clearance_mm) for h in at.bezel_holes()
    ]
    return Part(
        name="tip_bezel_blank",
        solid=single(subtract(_plate(d, at), [_window(d, at), *holes]), "tip_bezel_blank"),
        material=_material(d),
        process="laser",
        colour=_colour(d),
        quantity=0,
        in_assembly=False,
        note="laser-cut, then countersink its holes on one side",
    )


def _plate(d: Dimensions, at: Layout) -> cq.Solid:
    half, r = at.half_width_mm, d["design.housing.corner_radius_mm"]
    x = (d["bezel.proximal_x_mm"], d["finger.tip_x_mm"])
    z = (d["stack.gel_bottom_z_mm"], at.top_z_mm)
    return rounded_box(x, (-half, half), z, (0, r, r, 0))


def _window(d: Dimensions, at: Layout) -> cq.Solid:
    length = d["design.gel.length_mm"] / 2 + WINDOW_GAP_MM
    width = d["design.gel.width_mm"] / 2 + WINDOW_GAP_MM
    corner = d["design.gel.corner_radius_mm"]
    corner = corner + WINDOW_GAP_MM if corner > 0 else 0.0
    z = (d["stack.gel_bottom_z_mm"] - 1, at.top_z_mm + 1)
    return prism(rectangle((-length, length), (-width, width), corner), z)


def _material(d: Dimensions) -> str:
    kind = d["design.housing.bezel_material"]
    if kind == "printed":
        return PRINTED[d["manufacturing.print_process"]]
    return f"{METALS[kind]} sheet, {d['bezel.thickness_mm']:g} mm"


def _colour(d: Dimensions) -> tuple[float, float, float, float]:
    colours = {"printed": BEZEL, "aluminium": ALUMINIUM, "steel": STEEL}
    return colours[d["design.housing.bezel_material"]]


def shims(d: Dimensions) -> tuple[Part, Part]:
    """Shims under the gripper and the tip end of the window."""
    window = d["stack.window_bottom_z_mm"]
    z = (window - d["shim.compressed_mm"], window)
    half = d["guide.flat_width_mm"] / 2 - SHIM_GAP_MM
    spans = {
        "proximal": (d["guide.proximal_end_x_mm"], d["ledge.edge_x_mm"]),
        "tip": (d["ledge.distal_x_mm"], d["guide.distal_end_x_mm"]),
    }
    # Light of a strip at the tip that misses the window's end must not pass below the window.
    dark = "; of black silicone" if has_tip_light(d) else ""
    first, second = (
        Part(
            name=f"shim_{name}",
            solid=single(box(x, (-half, half), z), f"shim_{name}"),
            material=f"silicone sheet, {d['design.housing.shim_thickness_mm']:g} mm, "
            f"{d['design.housing.shim_hardness_shore_a']:g} Shore A",
            process="cut",
            colour=SHIM,
            explode_mm=(0, 0, 6),
            note=f"compressed by {d['shim.least_reached_mm']:.2f} to "
            f"{d['design.housing.precompression_mm']:.2f} mm when assembled; cut it to size"
            + (dark if name == "tip" else ""),
        )
        for name, x in spans.items()
    )
    return first, second
