"""What a screw holds in: a thread cut into plastic, a brass insert or a nut.

plate     ___________           ___________           ___________
---------|    ||     |---------|    ||     |---------|    ||     |----
print    |    ||     |   head  |==__||__===|         |    ||     |  seat
         |    ||     |  insert | |[]||[]|  |         |  __||__   |
         |    ||     |         | |[]||[]|  |   slot ====|nut|==  |
         |    ||     |         |    ||     |         |    ||     |
           self-cut              insert                 nut
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.geometry.fasteners import SCREWS, stock_lengths_mm

Real = float | NDArray[np.float64]
CUT_DIAMETERS = 2.0
"""Least engagement of a thread that a screw cuts into plastic, in diameters of the screw (Lincoln,
Gomes, Braden, Mechanical Fastening of Plastics: two to three)."""
BRASS_DIAMETERS = 1.0
"""Least engagement in brass or steel, in diameters; ISO 4032 nuts are 0.8 diameters high."""
NUT_SHARE = 1.0
"""Share of a nut's height that the screw must pass."""
CUT_WALL_MM = 0.9
"""Plastic around a self-cut thread, half the diameter of an M2 screw (assumed)."""
MELT_MM = 0.5
"""Free depth below an insert, for displaced plastic."""
GLUE_MM = 0.1
"""What the hole of a glued insert is wider and deeper than the insert: resin does not melt."""
NUT_SEAT_MM = 1.2
"""Plastic that a nut is pulled against."""
NUT_PLAY_MM = 0.2
FLUSH_SEAT_MM = 0.4
"""Least plastic over a nut that is sunk into the roof (assumed)."""
SHORT_OF_END_MM = 0.2
"""What a screw stays short of the end of its hole."""
STRENGTH_MPA = {"sla": 40.0, "fdm": 35.0, "sls": 42.0}
"""Tensile strength across the layers of tough resin, PETG and PA12: assumed, about 10 % below the
data sheets of Formlabs Tough 2000, of common PETG, and of EOS PA 2200."""
SAFETY = 4.0
"""For a load that stays on for months, and a screw that is taken out at times (assumed)."""


@dataclass(frozen=True)
class Insert:
    """A brass insert, mm."""

    outer: float
    length: float
    hole: float
    wall: float
    head: float
    head_height: float


INSERTS = {
    "M1.6": Insert(2.50, 2.5, 2.15, 0.8, 3.0, 0.4),
    "M2": Insert(3.00, 3.0, 2.65, 0.8, 3.5, 0.4),
    "M2.5": Insert(3.65, 4.0, 3.20, 1.0, 4.0, 0.4),
}
"""PENCOM MNZ miniature inserts, metric: sheet of pencomsf.com, hole +0.1/-0."""
NUTS_MM = {"M1.6": (3.2, 1.3), "M2": (4.0, 1.6), "M2.5": (5.0, 2.0)}
"""ISO 4032: width across flats and height."""


def hole_diameter_mm(thread: str, screw: str, print_process: str) -> float:
    """Widest part of the hole that stays after assembly, without the counterbore of a head."""
    if thread == "self_cut":
        return SCREWS[screw].pilot_mm
    if thread == "nut":
        return SCREWS[screw].clearance_mm
    insert = INSERTS[screw]
    return insert.outer + GLUE_MM if print_process == "sla" else insert.hole


def wall_mm(thread: str, screw: str) -> float:
    """Plastic that is needed around the hole."""
    return INSERTS[screw].wall if thread == "insert" else CUT_WALL_MM


def half_width_mm(thread: str, screw: str, print_process: str) -> float:
    """Half width of a boss around the hole."""
    if thread == "nut":
        return (NUTS_MM[screw][0] + NUT_PLAY_MM) / 2 + CUT_WALL_MM
    return hole_diameter_mm(thread, screw, print_process) / 2 + wall_mm(thread, screw)


def insert_depth_mm(screw: str, print_process: str) -> float:
    """Depth of the wide part of an insert's hole."""
    return INSERTS[screw].length + (GLUE_MM if print_process == "sla" else MELT_MM)


def needed_depth_mm(thread: str, screw: str, print_process: str) -> float:
    """Depth of the hole, from the plate, that the thread needs."""
    diameter = SCREWS[screw].thread_mm
    if thread == "self_cut":
        return CUT_DIAMETERS * diameter + SHORT_OF_END_MM
    if thread == "insert":
        return insert_depth_mm(screw, print_process)
    return NUT_SEAT_MM + NUTS_MM[screw][1] + NUT_PLAY_MM + SHORT_OF_END_MM


def needed_engagement_mm(thread: str, screw: str) -> float:
    """Length of thread that must be engaged."""
    diameter = SCREWS[screw].thread_mm
    if thread == "self_cut":
        return CUT_DIAMETERS * diameter
    return BRASS_DIAMETERS * diameter if thread == "insert" else NUT_SHARE * NUTS_MM[screw][1]


def engagement_mm(thread: str, screw: str, plate_mm: Real, depth_mm: Real) -> Real:
    """Length of thread that the longest stock screw engages.

    Args:
        thread: `self_cut`, `insert` or `nut`.
        screw: Size, such as `M2`.
        plate_mm: Thickness of the plate under the screw's head, the head sunk into it.
        depth_mm: Depth of the hole behind the plate.

    Returns:
        The engagement; negative where the screw does not reach the thread.
    """
    beyond = stock_lengths_mm(plate_mm + depth_mm - SHORT_OF_END_MM) - plate_mm
    beyond = np.minimum(beyond, depth_mm)
    if thread == "insert":
        return np.minimum(beyond, INSERTS[screw].length)
    if thread == "nut":
        return np.minimum(beyond - NUT_SEAT_MM, NUTS_MM[screw][1])
    return beyond


def flush_engagement_mm(screw: str, plate_mm: Real, roof_mm: Real) -> Real:
    """Length of thread that a screw engages in a nut sunk flush into the far side of a roof."""
    height = NUTS_MM[screw][1]
    beyond = stock_lengths_mm(plate_mm + roof_mm) - plate_mm
    return np.minimum(beyond - (roof_mm - height), height)


def pull_out_n(thread: str, screw: str, print_process: str, engaged_mm: Real) -> Real:
    """Force that one screw holds for good.

    The plastic is sheared along a cylinder at σ / √3 (von Mises): π d L σ / √3, with the mean of
    the thread's outer and core diameter for d, or the diameter and length of the insert; a nut is
    pulled against the plastic around its hole. `SAFETY` divides it.
    """
    strength = STRENGTH_MPA[print_process] / SAFETY
    if thread == "nut":
        flats, hole = NUTS_MM[screw][0], SCREWS[screw].clearance_mm
        return strength * (math.sqrt(3) / 2 * flats**2 - math.pi / 4 * hole**2)
    if thread == "insert":
        insert = INSERTS[screw]
        return math.pi * insert.outer * insert.length * strength / math.sqrt(3)
    size = SCREWS[screw]
    diameter = (size.thread_mm + size.pilot_mm) / 2
    return math.pi * diameter * np.maximum(engaged_mm, 0) * strength / math.sqrt(3)
