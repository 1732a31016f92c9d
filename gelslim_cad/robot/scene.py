"""Sizes of the example scene: a parallel gripper of two fingers closes on an object."""

from __future__ import annotations

from dataclasses import dataclass

from gelslim_cad.dimensions.mount import opening_mm
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.robot.contact import JAW_KG
from gelslim_cad.spec.gripper_library import library_gripper

CLOSING_M_S = 0.1
"""Speed at which the damping of the slides balances the gripping force."""
LEAST_SIZE_MM = 2.0
USUAL_GAP_MM = 10.0
SHARE_OF_GEL = 0.4
"""Half height and half width of the object, as a part of the gel's length and width."""


@dataclass(frozen=True)
class GripperScene:
    """The scene in SI units, sizes of boxes as halves (closing direction, across, up).

    Attributes:
        object_half_m: The object.
        object_kg: Its mass.
        post_half_m: The post under it, narrow enough for the fingers to pass.
        gap_m: Between each gel and the object at the start.
        travel_m: Of each jaw.
        force_n: Gripping force of one jaw.
        most_force_n: Largest force that can be commanded.
        jaw_kg: Mass of a jaw.
        jaw_damping_n_s_m: Damping of its slide.
        gel_mm: Length and width of the gel.
    """

    object_half_m: tuple[float, float, float]
    object_kg: float
    post_half_m: tuple[float, float, float]
    gap_m: float
    travel_m: float
    force_n: float
    most_force_n: float
    jaw_kg: float
    jaw_damping_n_s_m: float
    gel_mm: tuple[float, float]


def gripper_scene(d: Lookup) -> GripperScene:
    """The scene of a design: its object, gripping force and, where it is known, its gripper."""
    length, width = d["design.gel.length_mm"], d["design.gel.width_mm"]
    size = max(d["design.mount.object_size_mm"], LEAST_SIZE_MM)
    gripper = d["design.mount.gripper"]
    room = (opening_mm(gripper, d["flange.jaw_z_mm"]) - size) / 2
    gap = max(min(USUAL_GAP_MM, float(room)), 0.5)
    force, range_n = d["grip.force_n"], library_gripper(gripper).force_n
    half = (size / 2000, SHARE_OF_GEL * width * 1e-3, SHARE_OF_GEL * length * 1e-3)
    return GripperScene(
        object_half_m=half,
        object_kg=max(d["design.mount.object_mass_g"], 1.0) * 1e-3,
        post_half_m=(0.8 * half[0], 0.8 * half[1], 0.05),
        gap_m=gap * 1e-3,
        travel_m=(gap + size / 2) * 1e-3,
        force_n=force,
        most_force_n=max(force, range_n[1] if range_n else force),
        jaw_kg=JAW_KG,
        jaw_damping_n_s_m=force / CLOSING_M_S,
        gel_mm=(length, width),
    )
