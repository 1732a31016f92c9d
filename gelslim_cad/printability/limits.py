"""What a printing process can make: advised and least sizes, with their sources."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.geometry.part import Part


@dataclass(frozen=True)
class PrintLimits:
    """Limits of a process, mm and degrees.

    Attributes:
        process: `sla`, `fdm` or `sls`.
        wall_mm: Thinner walls get weak or wavy.
        least_wall_mm: Thinner walls are not printed.
        hole_mm: Narrower holes close in part.
        least_hole_mm: Narrower holes close.
        overhang_deg: Steepest angle from the vertical without support.
        bridge_mm: Widest span without support.
        printer_mm: Room of the printer.
        foot_mm: How far the first layer stands out along sharp edges on the plate.
        gap_mm: Gap between parts that slide into each other.
    """

    process: str
    wall_mm: float
    least_wall_mm: float
    hole_mm: float
    least_hole_mm: float
    overhang_deg: float
    bridge_mm: float
    printer_mm: tuple[float, float, float]
    foot_mm: float
    gap_mm: float = 0.2


LIMITS = {
    "fdm": PrintLimits("fdm", 0.8, 0.4, 1.5, 0.5, 45.0, 10.0, (250.0, 210.0, 210.0), 0.2),
    "sla": PrintLimits("sla", 0.4, 0.2, 0.5, 0.3, 71.0, 29.0, (145.0, 145.0, 185.0), 0.15),
    "sls": PrintLimits("sls", 0.7, 0.4, 1.5, 0.5, 90.0, math.inf, (165.0, 165.0, 300.0), 0.0),
}
"""By process. FDM: two and one line of a nozzle of 0.4 mm; 45° and 10 mm as in the design charts of
Hubs ("Key design considerations for 3D printing"); holes of the pilots in use; Prusa MK4. SLA:
Formlabs, design guide: walls, holes of 0.5 mm, 19° from level, bridges of 29 mm; Form 3. SLS: Hubs:
walls of 0.7 mm, holes of 1.5 mm, no supports; Fuse 1. The least sizes are taken at about half of
the advised ones (assumed). First layer: what PrusaSlicer takes off by default on FDM (0.2 mm);
0.15 mm for SLA is assumed; SLS has no plate."""


def print_process(d: Lookup, part: Part) -> str:
    """The process of a printed part: that of the mould, or that of the finger."""
    if "mould" in part.tags:
        return d["manufacturing.mould_process"]
    return d["manufacturing.print_process"]


def print_limits(d: Lookup, process: str) -> PrintLimits:
    """The limits of a process with the spec's own figures."""
    limits = replace(LIMITS[process], gap_mm=d["design.housing.fit_clearance_mm"])
    if process == "fdm":
        line = d["manufacturing.nozzle_mm"]
        limits = replace(limits, wall_mm=2 * line, least_wall_mm=line)
    if d["manufacturing.max_overhang_deg"] is not None:
        limits = replace(limits, overhang_deg=d["manufacturing.max_overhang_deg"])
    if d["manufacturing.max_bridge_mm"] is not None:
        limits = replace(limits, bridge_mm=d["manufacturing.max_bridge_mm"])
    if d["manufacturing.elephant_foot_mm"] is not None:
        limits = replace(limits, foot_mm=d["manufacturing.elephant_foot_mm"])
    if d["manufacturing.printer_mm"]:
        x, y, z = d["manufacturing.printer_mm"]
        limits = replace(limits, printer_mm=(x, y, z))
    return limits
