"""Front-surface fold mirror and the wedge it is glued to."""

from __future__ import annotations

import math

from gelslim_cad.dimensions import Dimensions
from gelslim_cad.geometry.part import Part
from gelslim_cad.solids.layout import Layout
from gelslim_cad.solids.materials import MIRROR, PRINTED, SEAT
from gelslim_cad.solids.shapes import Point2, prism_across, rod, single, subtract

SUNK_FRACTION = 0.4
SCREW_DEPTH_MM = 5.0


def _face(d: Dimensions) -> tuple[Point2, Point2, Point2, Point2]:
    """Lower and upper end (x, z) of the mirror's front, then of its back."""
    angle, t = math.radians(d["mirror.angle_deg"]), d["design.mirror.thickness_mm"]
    low = (d["mirror.lower_x_mm"], d["mirror.lower_z_mm"])
    high = (d["mirror.upper_x_mm"], d["mirror.upper_z_mm"])
    dx, dz = t * math.sin(angle), -t * math.cos(angle)
    return low, high, (low[0] + dx, low[1] + dz), (high[0] + dx, high[1] + dz)


def mirror(d: Dimensions) -> Part:
    """The mirror plate, reflecting face up."""
    low, high, low_back, high_back = _face(d)
    half = d["mirror.width_mm"] / 2
    return Part(
        name="mirror",
        solid=single(prism_across([low, high, high_back, low_back], half), "mirror"),
        material=f"front-surface mirror, {d['design.mirror.thickness_mm']:g} mm glass",
        process="buy",
        colour=MIRROR,
        explode_mm=(0, 0, -26),
        note=f"{d['mirror.length_mm']:.2f} x {d['mirror.width_mm']:.2f} mm; front-surface: a "
        "back-surface mirror ghosts; cut to size, edges masked",
        tags=frozenset({"outline"}),
    )


def seat_footprint(d: Dimensions, at: Layout) -> tuple[float, float, float]:
    """First x, last x and half width of the seat on the cover."""
    _, _, _, high_back = _face(d)
    return d["mirror.seat_x_mm"], high_back[0], d["mirror.width_mm"] / 2


def recessed_footprint(d: Dimensions, at: Layout) -> tuple[float, float, float]:
    """Footprint of the seat's thin end, which a recess of the cover locates."""
    x0, x1, half = seat_footprint(d, at)
    return x0, x0 + SUNK_FRACTION * (x1 - x0), half


def seat_screw_positions(d: Dimensions, at: Layout) -> list[Point2]:
    """Positions (x, y) of the screws that hold the seat's thick end from below."""
    _, x1, half = seat_footprint(d, at)
    x = x1 - min(3.0, 0.25 * (x1 - d["mirror.lower_x_mm"]))
    return [(x, s * half / 2) for s in (-1, 1)] if seat_pilot_mm(d, at, x) > 0 else []


def seat_pilot_mm(d: Dimensions, at: Layout, x: float) -> float:
    """Depth of the threaded hole in the seat at x, or 0 where the wedge is too thin for one."""
    _, _, low_back, high_back = _face(d)
    slope = (high_back[1] - low_back[1]) / (high_back[0] - low_back[0])
    height = low_back[1] + slope * (x - at.screw.pilot_mm / 2 - low_back[0])
    height -= d["cover.top_z_mm"]
    depth = min(SCREW_DEPTH_MM, height - 0.8)
    return depth if depth >= 2.0 else 0.0


def mirror_seat(d: Dimensions) -> Part:
    """Wedge under the mirror with a stop at the mirror's lower end."""
    at = Layout(d)
    low, _, low_back, high_back = _face(d)
    base = d["cover.top_z_mm"] - at.recess_mm
    stop = tuple(b + 0.7 * (f - b) for f, b in zip(low, low_back, strict=True))
    x0, x1, half = seat_footprint(d, at)
    step, floor = recessed_footprint(d, at)[1], d["cover.top_z_mm"]
    foot = [(x1, floor), (step, floor), (step, base), (x0, base)]
    wedge = prism_across([low_back, high_back, *foot, (x0, stop[1]), (stop[0], stop[1])], half)
    holes = [
        rod(x, y, (floor - 0.1, floor + seat_pilot_mm(d, at, x)), at.screw.pilot_mm)
        for x, y in seat_screw_positions(d, at)
    ]
    return Part(
        name="mirror_seat",
        solid=single(subtract(wedge, holes), "mirror_seat"),
        material=PRINTED[d["manufacturing.print_process"]],
        # On its side: flat, the step for the cover's recess would hang 0.5 mm above the plate.
        print_rotation_deg=(90.0, 0.0, 0.0),
        process="print",
        colour=SEAT,
        explode_mm=(0, 0, -40),
        note="glue the mirror against the stop; reprint to trim the angle",
    )
