"""Elastic shims between ledges and window, drawn at their compressed thickness."""

from __future__ import annotations

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.materials import SHIM
from gelslim_cad.solids.shapes import box, single

SIDE_GAP_MM = 0.3


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
