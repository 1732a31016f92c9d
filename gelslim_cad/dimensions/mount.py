"""The flange against the gripper's jaw, and what a gripping force does to flange and tongues.

The force F acts on the middle of the gel, square to it. The mount is a cantilever that starts at
the jaw: tongues and flange take F times their distance from the gel as a bending moment, and the
bolts take the same moment about the edge of the flange that the jaw carries.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gelslim_cad.dimensions.registry import Real, dimension
from gelslim_cad.geometry.jaw import FLANGE_EDGE_MM, JawBolts
from gelslim_cad.geometry.materials import MATERIALS, PRINTED, SAFETY
from gelslim_cad.spec.gripper_library import library_gripper

LEAST_FORCE_N = 10.0
LEAST_WIDTH_MM = 0.1
"""Narrower sections count as this wide: such a design fails other rules."""
BELOW_WIRES_MM = 0.2
"""Gap between the wires and the plate on a lateral jaw."""
SOURCE = "docs/design_guide.md#grippers"


@dimension("flange.thickness_mm", formula="given, or that of the gripper", source=SOURCE)
def flange_thickness_mm(mount_flange_thickness_mm: Real | None, mount_gripper: str) -> Real:
    """Thickness of the flange, and of the plate of a lateral one."""
    if mount_flange_thickness_mm is None:
        return library_gripper(mount_gripper).flange_thickness_mm
    return mount_flange_thickness_mm


@dimension("flange.foot_mm", formula="2 reach of the bolts + head + 2 edges; 0 on a lateral jaw")
def flange_foot_mm(
    mount_gripper: str, mount_flange_bolt: str, mount_flange_bolt_spacing_mm: Real | None
) -> Real:
    """Height of the strip below the finger's back that takes the bolts of an axial jaw."""
    bolts = JawBolts.of(mount_gripper, mount_flange_bolt, mount_flange_bolt_spacing_mm)
    if bolts.lateral:
        return 0.0
    return 2 * bolts.reach_u_mm + bolts.size.cap_head_mm + 2 * FLANGE_EDGE_MM


@dimension("flange.width_mm", formula="max(finger, 2 reach of the bolts + head + 2 edges)")
def flange_width_mm(
    finger_width_mm: Real,
    mount_gripper: str,
    mount_flange_bolt: str,
    mount_flange_bolt_spacing_mm: Real | None,
) -> Real:
    """Width of the flange across the finger."""
    bolts = JawBolts.of(mount_gripper, mount_flange_bolt, mount_flange_bolt_spacing_mm)
    return np.maximum(
        finger_width_mm, 2 * bolts.reach_y_mm + bolts.size.cap_head_mm + 2 * FLANGE_EDGE_MM
    )


@dimension(
    "flange.jaw_z_mm",
    formula="min(-half the gap of the closed jaws, back - foot / 2, cover - plate)",
    source=SOURCE,
)
def flange_jaw_z_mm(
    finger_thickness_mm: Real,
    flange_foot_mm: Real,
    cover_top_z_mm: Real,
    flange_thickness_mm: Real,
    mount_gripper: str,
) -> Real:
    """Middle of an axial jaw's bolts, or the face of a lateral jaw, seen from the gel's surface.

    Two fingers then meet when the jaws close, as far as the bolts find room below the back. The
    plate on a lateral jaw lies below the wires, which leave the finger on its cover.
    """
    jaw = library_gripper(mount_gripper).jaw
    highest = -finger_thickness_mm - flange_foot_mm / 2
    if jaw.face == "lateral":
        highest = np.minimum(highest, cover_top_z_mm - flange_thickness_mm - BELOW_WIRES_MM)
    closed = jaw.closed_gap_mm
    return highest if closed is None else np.minimum(highest, -closed / 2)


def opening_mm(gripper: str, flange_jaw_z_mm: Real) -> Real:
    """Distance between the two gels when the jaws are open; infinite for a gripper without data.

    Args:
        gripper: Name of the gripper.
        flange_jaw_z_mm: The dimension `flange.jaw_z_mm`.

    Returns:
        gap of the closed jaws + stroke - 2 |z|, in mm.
    """
    found = library_gripper(gripper)
    if found.stroke_mm is None or found.jaw.closed_gap_mm is None:
        return np.inf
    return found.jaw.closed_gap_mm + found.stroke_mm + 2 * flange_jaw_z_mm


@dimension("grip.force_n", formula="given, or max(10 N, least force of the gripper)")
def grip_force_n(mount_grip_force_n: Real | None, mount_gripper: str) -> Real:
    """Gripping force that the mount is judged by."""
    if mount_grip_force_n is not None:
        return mount_grip_force_n
    force_n = library_gripper(mount_gripper).force_n
    return LEAST_FORCE_N if force_n is None else max(LEAST_FORCE_N, force_n[0])


@dimension("grip.tongue_mpa", formula="6 F |x| / (2 b h²), x the tongues' root", source=SOURCE)
def grip_tongue_mpa(
    grip_force_n: Real,
    finger_proximal_x_mm: Real,
    tongue_inner_y_mm: Real,
    tongue_outer_y_mm: Real,
    mount_tongue_thickness_mm: Real,
) -> Real:
    """Bending stress of the two tongues at the flange."""
    width = np.maximum(tongue_outer_y_mm - tongue_inner_y_mm, LEAST_WIDTH_MM)
    return 3 * grip_force_n * -finger_proximal_x_mm / (width * mount_tongue_thickness_mm**2)


@dimension("grip.flange_mpa", formula="6 F (|x| + t) / (b t²), b without the cable", source=SOURCE)
def grip_flange_mpa(
    grip_force_n: Real,
    finger_proximal_x_mm: Real,
    flange_thickness_mm: Real,
    flange_width_mm: Real,
    camera_cable_width_mm: Real,
    housing_fit_clearance_mm: Real,
    mount_gripper: str,
    mount_flange_bolt: str,
    mount_flange_bolt_spacing_mm: Real | None,
) -> Real:
    """Bending stress between tongues and bolts: of the flange, or of the narrower plate on it."""
    opening = camera_cable_width_mm + 2 * housing_fit_clearance_mm
    width = np.maximum(flange_width_mm - opening, LEAST_WIDTH_MM)
    bolts = JawBolts.of(mount_gripper, mount_flange_bolt, mount_flange_bolt_spacing_mm)
    if bolts.lateral:
        width = np.minimum(width, bolts.plate_width_mm)
    moment = grip_force_n * (flange_thickness_mm - finger_proximal_x_mm)
    return 6 * moment / (width * flange_thickness_mm**2)


@dimension("grip.bolt_n", formula="F (|x| + t) / (n e), e from the flange's edge", source=SOURCE)
def grip_bolt_n(
    grip_force_n: Real,
    finger_proximal_x_mm: Real,
    flange_thickness_mm: Real,
    flange_foot_mm: Real,
    mount_gripper: str,
    mount_flange_bolt: str,
    mount_flange_bolt_spacing_mm: Real | None,
) -> Real:
    """Tension of one bolt to the gripper, when the flange leans on its edge."""
    bolts = JawBolts.of(mount_gripper, mount_flange_bolt, mount_flange_bolt_spacing_mm)
    arm = bolts.plate_depth_mm / 2 if bolts.lateral else flange_foot_mm / 2
    moment = grip_force_n * (flange_thickness_mm - finger_proximal_x_mm)
    return moment / (bolts.count * arm)


def allowed_mpa(print_process: str) -> float:
    """Stress that a printed part may bear: its strength across the layers over the safety."""
    strength = MATERIALS[PRINTED[print_process]].strength_mpa
    assert strength is not None
    return strength / SAFETY


def allowed_bolt_n(print_process: str, gripper: str, bolt: str) -> float:
    """Tension at which the head of a bolt, without a washer, presses into the flange.

    The ring of the head, π/4 (head² - hole²), bears the stress of `allowed_mpa`. The bolt itself
    bears ten times as much.
    """
    size = JawBolts.of(gripper, bolt, None).size
    ring = np.pi / 4 * (size.cap_head_mm**2 - size.clearance_mm**2)
    return float(ring * allowed_mpa(print_process))


@dimension(
    "grip.limit_n", formula="F min(allowed / value) over tongues, flange and bolts", source=SOURCE
)
def grip_limit_n(
    grip_force_n: Real,
    grip_tongue_mpa: Real,
    grip_flange_mpa: Real,
    grip_bolt_n: Real,
    manufacturing_print_process: str,
    mount_gripper: str,
    mount_flange_bolt: str,
) -> Real:
    """Largest gripping force that the printed mount bears."""
    allowed = allowed_mpa(manufacturing_print_process)
    bolt = allowed_bolt_n(manufacturing_print_process, mount_gripper, mount_flange_bolt)
    shares: list[Any] = [allowed / grip_tongue_mpa, allowed / grip_flange_mpa, bolt / grip_bolt_n]
    return grip_force_n * np.minimum(np.minimum(shares[0], shares[1]), shares[2])
