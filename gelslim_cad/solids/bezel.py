"""Tip bezel: it frames the gel and clamps the ends of the window, which compresses the shims."""

from __future__ import annotations

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.layout import Layout
from gelslim_cad.solids.materials import BEZEL, PRINTED, SHIM
from gelslim_cad.solids.shapes import box, chamfered, countersink, rounded_box, single, subtract

WINDOW_GAP_MM = 0.3
CHAMFER_MM = 0.5
SIDE_GAP_MM = 0.3


def bezel(d: Dimensions) -> Part:
    """The printed bezel with its gel window and four countersunk holes."""
    at = Layout(d)
    half, r = at.half_width_mm, d["design.housing.corner_radius_mm"]
    z = (d["stack.gel_bottom_z_mm"], at.top_z_mm)
    x = (d["bezel.proximal_x_mm"], d["finger.tip_x_mm"])
    plate = rounded_box(x, (-half, half), z, (0, r, r, 0))
    top = next(f for f in plate.Faces() if abs(f.Center().z - z[1]) < 1e-6)
    edges = [e for e in top.Edges() if abs(e.Center().x - x[0]) > 1e-6]
    plate = chamfered(plate, edges, min(CHAMFER_MM, 0.4 * (z[1] - z[0])))
    length = d["design.gel.length_mm"] / 2 + WINDOW_GAP_MM
    width = d["design.gel.width_mm"] / 2 + WINDOW_GAP_MM
    corner = d["design.gel.corner_radius_mm"]
    corner = corner + WINDOW_GAP_MM if corner > 0 else 0.0
    window = rounded_box((-length, length), (-width, width), (z[0] - 1, z[1] + 1), [corner] * 4)
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
    return Part(
        name="tip_bezel",
        solid=single(subtract(plate, [window, *holes]), "tip_bezel"),
        material=PRINTED[d["manufacturing.print_process"]],
        process="print",
        colour=BEZEL,
        explode_mm=(0, 0, 34),
        note="screwing it down compresses the shims and pre-loads the acrylic",
        print_rotation_deg=(180, 0, 0),
    )


def shims(d: Dimensions) -> tuple[Part, Part]:
    """Shims under the gripper and the tip end of the window."""
    window = d["stack.window_bottom_z_mm"]
    z = (window - d["shim.compressed_mm"], window)
    half = d["guide.flat_width_mm"] / 2 - SIDE_GAP_MM
    spans = {
        "proximal": (d["guide.proximal_end_x_mm"], d["ledge.edge_x_mm"]),
        "tip": (d["ledge.distal_x_mm"], d["guide.distal_end_x_mm"]),
    }
    first, second = (
        Part(
            name=f"shim_{name}",
            solid=single(box(x, (-half, half), z), f"shim_{name}"),
            material=f"silicone sheet, {d['design.housing.shim_thickness_mm']:g} mm",
            process="cut",
            colour=SHIM,
            explode_mm=(0, 0, 6),
            note=f"compressed to {d['shim.compressed_mm']:.2f} mm when assembled",
        )
        for name, x in spans.items()
    )
    return first, second
