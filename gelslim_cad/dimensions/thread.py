"""Depths of the holes that the screws of bezel and cover hold in, and what pulls at them."""

from __future__ import annotations

import numpy as np

from gelslim_cad.dimensions.registry import Real, dimension
from gelslim_cad.geometry.fasteners import SCREW_EDGE_MM, SCREWS
from gelslim_cad.geometry.thread import engagement_mm, flush_engagement_mm, half_width_mm

LONGEST_HOLE_MM = 6.0
BETWEEN_HOLES_MM = 1.0
"""Plastic between the holes of bezel and cover, which meet in the tip block."""
UNDER_SLOT_MM = 0.6
"""Plastic between the hole of a cover screw and the slot of a tongue."""
BOSS_DIAMETERS = 2.5
BOSS_END_MM = 0.5
BOSS_ROOM_MM = 0.15
"""Least gap between a boss and the camera's clamp; with less the roof has no boss."""


@dimension("thread.tip_depth_mm", formula="min(6, (tip block - 1) / 2)")
def thread_tip_depth_mm(stack_gel_bottom_z_mm: Real, cover_top_z_mm: Real) -> Real:
    """Depth of the holes in the tip block, of the bezel's screws and of the cover's."""
    block = stack_gel_bottom_z_mm - cover_top_z_mm
    return np.minimum(LONGEST_HOLE_MM, (block - BETWEEN_HOLES_MM) / 2)


@dimension("thread.boss_room_mm", formula="gap to the clamp beside the boss, or in front of it")
def thread_boss_room_mm(
    finger_width_mm: Real,
    housing_side_wall_mm: Real,
    clamp_width_mm: Real,
    bezel_proximal_x_mm: Real,
    housing_tip_wall_mm: Real,
    camera_pose_front_x_mm: Real,
    housing_thread: str,
    housing_screw: str,
    manufacturing_print_process: str,
) -> Real:
    """Gap between the camera's clamp and a boss under the roof."""
    half = half_width_mm(housing_thread, housing_screw, manufacturing_print_process)
    across = finger_width_mm / 2 - housing_side_wall_mm - SCREW_EDGE_MM
    beside = across - half - clamp_width_mm / 2
    before = bezel_proximal_x_mm + housing_tip_wall_mm / 2 - half - camera_pose_front_x_mm
    return np.maximum(beside, before)


@dimension(
    "thread.roof_depth_mm",
    formula="max(guide thickness, 2.5 d + 0.5) with a boss, else the guide thickness",
)
def thread_roof_depth_mm(
    light_guide_thickness_mm: Real, thread_boss_room_mm: Real, housing_screw: str
) -> Real:
    """Depth of the bezel's other holes, through the roof and into a boss where one has room."""
    deep = BOSS_DIAMETERS * SCREWS[housing_screw].thread_mm + BOSS_END_MM
    boss = np.maximum(light_guide_thickness_mm, deep)
    return np.where(thread_boss_room_mm >= BOSS_ROOM_MM, boss, light_guide_thickness_mm)


@dimension("thread.land_depth_mm", formula="min(6, slot - cover - 0.6)")
def thread_land_depth_mm(
    tongue_z_mm: Real,
    mount_tongue_thickness_mm: Real,
    housing_fit_clearance_mm: Real,
    cover_top_z_mm: Real,
) -> Real:
    """Depth of the holes of the cover's screws in the mount block, under the tongues' slots."""
    slot = tongue_z_mm - mount_tongue_thickness_mm / 2 - housing_fit_clearance_mm
    return np.minimum(LONGEST_HOLE_MM, slot - cover_top_z_mm - UNDER_SLOT_MM)


@dimension("thread.bezel_mm", formula="stock screw - plate, or the insert, in the tip block")
def thread_bezel_mm(
    bezel_thickness_mm: Real,
    thread_tip_depth_mm: Real,
    housing_thread: str,
    housing_screw: str,
) -> Real:
    """Length of thread that the bezel's screws engage at the tip."""
    return engagement_mm(housing_thread, housing_screw, bezel_thickness_mm, thread_tip_depth_mm)


@dimension(
    "thread.roof_mm", formula="as at the tip, in a boss; else that of a nut sunk into the roof"
)
def thread_roof_mm(
    bezel_thickness_mm: Real,
    thread_roof_depth_mm: Real,
    thread_boss_room_mm: Real,
    housing_thread: str,
    housing_screw: str,
) -> Real:
    """Length of thread that the bezel's screws engage in the roof."""
    boss = engagement_mm(housing_thread, housing_screw, bezel_thickness_mm, thread_roof_depth_mm)
    nut = flush_engagement_mm(housing_screw, bezel_thickness_mm, thread_roof_depth_mm)
    return np.where(thread_boss_room_mm >= BOSS_ROOM_MM, boss, nut)


@dimension("thread.cover_mm", formula="least of tip and mount: stock screw - plate, or the insert")
def thread_cover_mm(
    housing_back_wall_mm: Real,
    thread_tip_depth_mm: Real,
    thread_land_depth_mm: Real,
    housing_thread: str,
    housing_screw: str,
) -> Real:
    """Length of thread that the cover's screws engage."""
    return np.minimum(
        engagement_mm(housing_thread, housing_screw, housing_back_wall_mm, thread_tip_depth_mm),
        engagement_mm(housing_thread, housing_screw, housing_back_wall_mm, thread_land_depth_mm),
    )


@dimension("thread.load_n", formula="force of the shims / 4 · (1 + lever / distance to the edge)")
def thread_load_n(
    shim_force_n: Real,
    housing_tip_wall_mm: Real,
    housing_fit_clearance_mm: Real,
    light_guide_end_support_mm: Real,
) -> Real:
    """Largest pull on a screw of the bezel.

    The shims press beside the screws, and the bezel pries on its outer edge: an upper bound, as if
    the plate touched nothing but that edge.
    """
    to_edge = housing_tip_wall_mm / 2
    lever = to_edge + housing_fit_clearance_mm + light_guide_end_support_mm / 2
    return shim_force_n / 4 * (1 + lever / to_edge)
