"""Rules on the gripper: stroke, force, payload, and what the printed mount bears."""

from __future__ import annotations

import numpy as np

from gelslim_cad.checks.rule import Finding, rule
from gelslim_cad.dimensions.mount import allowed_bolt_n, allowed_mpa, opening_mm
from gelslim_cad.dimensions.registry import Real
from gelslim_cad.geometry.jaw import JawBolts
from gelslim_cad.geometry.materials import GEL_FRICTION, SAFETY
from gelslim_cad.spec.gripper_library import library_gripper

GRAVITY_M_S2 = 9.81
HOLE_EDGE_MM = 1.0
"""Jaw beside the hole of a bolt."""
HEADS_APART_MM = 0.5


@rule(
    "object.size_mm",
    title="Gripper opens wide enough for two fingers and the object",
    parameter="design.mount.object_size_mm",
    why="both fingers and the largest object share the stroke of the gripper",
    advice="make the finger thinner, grip smaller objects or take a gripper with more stroke",
)
def object_size(mount_object_size_mm: Real, flange_jaw_z_mm: Real, mount_gripper: str) -> Finding:
    """Size of the object against the distance of the gels at open jaws."""
    return Finding(mount_object_size_mm, opening_mm(mount_gripper, flange_jaw_z_mm))


@rule(
    "object.mass_g",
    title="Two gels lift the object at this gripping force",
    parameter="design.mount.object_mass_g",
    why="friction holds twice the weight, and the gripper carries its payload",
    advice="lift lighter objects or set a larger grip_force_n",
)
def object_mass(mount_object_mass_g: Real, grip_force_n: Real, mount_gripper: str) -> Finding:
    """Mass against the payload and against 2 µ F / (2 g), half of what slips."""
    held_kg = 2 * GEL_FRICTION * grip_force_n / (SAFETY * GRAVITY_M_S2)
    payload = library_gripper(mount_gripper).payload_kg
    limit_kg = held_kg if payload is None else np.minimum(held_kg, payload)
    return Finding(mount_object_mass_g, 1000 * limit_kg)


@rule(
    "gripper.force_n",
    title="Gripper can be set to this force",
    parameter="design.mount.grip_force_n",
    why="its motor sets forces within a range",
    advice="give a force within the range of the gripper",
)
def gripper_force(grip_force_n: Real, mount_gripper: str) -> Finding:
    """Force against the range of the gripper."""
    force_n = library_gripper(mount_gripper).force_n
    if force_n is None:
        return Finding(grip_force_n, np.inf)
    least, most = force_n
    below = np.asarray(grip_force_n) < least
    # A force below the least one is as far beyond its limit, seen from the other side.
    return Finding(
        np.where(below, most + least - grip_force_n, grip_force_n),
        most,
        reason=lambda: (
            f"{float(np.ravel(grip_force_n)[0]):g} N is not within {least:g} to {most:g} N"
        ),
    )


@rule(
    "grip.tongue_mpa",
    title="Tongues bear the gripping force",
    parameter="design.mount.tongue_thickness_mm",
    why="half the strength of the print across its layers may be used",
    advice="use a thicker tongue, set a smaller grip_force_n or print in a stronger material",
)
def grip_tongue(grip_tongue_mpa: Real, manufacturing_print_process: str) -> Finding:
    """Bending stress at the root of the tongues."""
    return Finding(grip_tongue_mpa, allowed_mpa(manufacturing_print_process))


@rule(
    "grip.flange_mpa",
    title="Flange bears the gripping force",
    parameter="design.mount.flange_thickness_mm",
    why="half the strength of the print across its layers may be used",
    advice="use a thicker flange, set a smaller grip_force_n or print in a stronger material",
)
def grip_flange(grip_flange_mpa: Real, manufacturing_print_process: str) -> Finding:
    """Bending stress between tongues and bolts."""
    return Finding(grip_flange_mpa, allowed_mpa(manufacturing_print_process))


@rule(
    "grip.bolt_n",
    title="Bolts to the gripper do not press into the flange",
    parameter="design.mount.flange_bolt",
    why="the head bears on the print, at half its strength",
    advice="use a larger bolt or set a smaller grip_force_n",
)
def grip_bolt(
    grip_bolt_n: Real,
    manufacturing_print_process: str,
    mount_gripper: str,
    mount_flange_bolt: str,
) -> Finding:
    """Tension of a bolt against the ring under its head."""
    return Finding(
        grip_bolt_n, allowed_bolt_n(manufacturing_print_process, mount_gripper, mount_flange_bolt)
    )


@rule(
    "grip.limit_n",
    title="Mount bears the largest force of the gripper",
    parameter="design.mount.grip_force_n",
    why="a wrong setting would break the print",
    advice="limit the force in the gripper's settings",
)
def grip_limit(grip_limit_n: Real, grip_force_n: Real, mount_gripper: str) -> Finding:
    """Largest force that the mount bears against the largest that can be set."""
    force_n = library_gripper(mount_gripper).force_n
    most = grip_force_n if force_n is None else force_n[1]
    return Finding(grip_limit_n, most, least=True, advisory=True)


@rule(
    "flange.pattern_mm",
    title="Bolts lie on the gripper's jaw",
    parameter="design.mount.flange_bolt_spacing_mm",
    why="a bolt beside the jaw holds nothing",
    advice="leave flange_bolt and flange_bolt_spacing_mm out, or give those of your gripper",
)
def flange_pattern(
    mount_gripper: str, mount_flange_bolt: str, mount_flange_bolt_spacing_mm: Real | None
) -> Finding:
    """Holes and 1 mm of jaw around them: what they exceed the jaw by, on the worse axis."""
    bolts = JawBolts.of(mount_gripper, mount_flange_bolt, mount_flange_bolt_spacing_mm)
    around = bolts.size.clearance_mm / 2 + HOLE_EDGE_MM
    jaw = bolts.gripper.jaw
    beyond = [
        reach + around - size / 2
        for reach, size in ((bolts.reach_y_mm, jaw.width_mm), (bolts.reach_u_mm, jaw.depth_mm))
        if size is not None
    ]
    if not beyond:
        return Finding(0.0, np.inf)
    return Finding(np.maximum.reduce(np.broadcast_arrays(*beyond)), 0.0, tolerance=1e-9)


@rule(
    "flange.heads_mm",
    title="Heads of the gripper's bolts stand apart",
    parameter="design.mount.flange_bolt_spacing_mm",
    why="0.5 mm between two heads",
    advice="use a smaller flange_bolt or a larger flange_bolt_spacing_mm",
)
def flange_heads(
    mount_gripper: str, mount_flange_bolt: str, mount_flange_bolt_spacing_mm: Real | None
) -> Finding:
    """Diameter of a head and gap against the distance of the bolts."""
    bolts = JawBolts.of(mount_gripper, mount_flange_bolt, mount_flange_bolt_spacing_mm)
    return Finding(bolts.size.cap_head_mm + HEADS_APART_MM, bolts.apart_mm)


@rule(
    "flange.measured",
    title="Places of the gripper's bolts are known",
    parameter="design.mount.flange_bolt_spacing_mm",
    why="no public drawing states where the bolts of this gripper are",
    advice="measure your gripper and give flange_bolt and flange_bolt_spacing_mm",
    unit="places assumed",
)
def flange_measured(mount_gripper: str, mount_flange_bolt_spacing_mm: Real | None) -> Finding:
    """Number of bolts whose place is assumed."""
    found = library_gripper(mount_gripper)
    open_question = (
        mount_gripper != "generic" and mount_flange_bolt_spacing_mm is None and found.places_assumed
    )
    return Finding(len(found.jaw.holes_mm) if open_question else 0, 0, advisory=True)
