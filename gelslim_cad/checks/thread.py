"""Rules on what the screws of bezel and cover hold in."""

from __future__ import annotations

import numpy as np

from gelslim_cad.checks.rule import Finding, rule
from gelslim_cad.dimensions.registry import Real
from gelslim_cad.dimensions.thread import BOSS_ROOM_MM
from gelslim_cad.geometry.fasteners import SCREW_EDGE_MM
from gelslim_cad.geometry.thread import (
    FLUSH_SEAT_MM,
    NUTS_MM,
    hole_diameter_mm,
    needed_depth_mm,
    needed_engagement_mm,
    pull_out_n,
    wall_mm,
)


@rule(
    "thread.engagement_ratio",
    title="Screws engage enough thread",
    parameter="design.housing.thread",
    why="a thread cut into plastic wants two diameters, brass one, a nut its whole height; a "
    "shorter one is torn out after a few times",
    advice="use inserts or nuts, a thinner tongue, or a smaller screw",
)
def engagement(
    thread_bezel_mm: Real,
    thread_roof_mm: Real,
    thread_cover_mm: Real,
    thread_boss_room_mm: Real,
    housing_thread: str,
    housing_screw: str,
) -> Finding:
    """Least engagement of the screws of bezel and cover, over what is needed."""
    needed = needed_engagement_mm(housing_thread, housing_screw)
    nut = needed_engagement_mm("nut", housing_screw)
    roof = thread_roof_mm / np.where(thread_boss_room_mm >= BOSS_ROOM_MM, needed, nut)
    least = np.minimum(np.minimum(thread_bezel_mm, thread_cover_mm) / needed, roof)
    return Finding(least, 1.0, least=True, tolerance=1e-9)


@rule(
    "thread.depth_mm",
    title="Holes are deep enough for their threads",
    parameter="design.mount.tongue_thickness_mm",
    why="an insert needs its length and room for what it displaces, a nut its slot",
    advice="use a thinner tongue, or let the screws cut their own thread",
)
def depth(
    thread_tip_depth_mm: Real,
    thread_roof_depth_mm: Real,
    thread_land_depth_mm: Real,
    thread_boss_room_mm: Real,
    housing_thread: str,
    housing_screw: str,
    manufacturing_print_process: str,
) -> Finding:
    """Least depth of the holes in tip block, roof and mount block, beyond what is needed."""
    needed = needed_depth_mm(housing_thread, housing_screw, manufacturing_print_process)
    flush = NUTS_MM[housing_screw][1] + FLUSH_SEAT_MM
    roof = thread_roof_depth_mm - np.where(thread_boss_room_mm >= BOSS_ROOM_MM, needed, flush)
    least = np.minimum(np.minimum(thread_tip_depth_mm, thread_land_depth_mm) - needed, roof)
    return Finding(least, 0.0, least=True, tolerance=1e-9)


@rule(
    "thread.wall_mm",
    title="Walls around the threads",
    parameter="design.housing.tip_wall_mm",
    why="an insert or a screw that cuts its thread splits a thinner wall",
    advice="lengthen the tip wall, or use a smaller screw",
)
def thread_wall(
    housing_tip_wall_mm: Real,
    housing_thread: str,
    housing_screw: str,
    manufacturing_print_process: str,
) -> Finding:
    """Plastic between the hole and the nearest face: tip, pocket or side wall's inner face."""
    hole = hole_diameter_mm(housing_thread, housing_screw, manufacturing_print_process)
    beside = np.minimum(housing_tip_wall_mm / 2, SCREW_EDGE_MM) - hole / 2
    return Finding(beside, wall_mm(housing_thread, housing_screw), least=True, tolerance=1e-9)


@rule(
    "thread.load_n",
    title="Threads hold the bezel against its shims",
    parameter="design.housing.shim_hardness_shore_a",
    why="the shims pull at the bezel's screws as long as the finger lives",
    advice="use softer shims, inserts, or a larger screw",
)
def load(
    thread_load_n: Real,
    thread_bezel_mm: Real,
    housing_thread: str,
    housing_screw: str,
    manufacturing_print_process: str,
) -> Finding:
    """Largest pull on a screw of the bezel against what its thread holds for good."""
    holds = pull_out_n(housing_thread, housing_screw, manufacturing_print_process, thread_bezel_mm)
    return Finding(thread_load_n, holds)
