"""The finger as one rigid body with frames and a soft contact, which all formats show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gelslim_cad.export.mesh import TriangleMesh
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.geometry.jaw import JawBolts
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.geometry.names import Name
from gelslim_cad.geometry.part import Part
from gelslim_cad.robot.contact import GelContact, gel_contact
from gelslim_cad.robot.frames import (
    Transform,
    gel_frame,
    graphics_frame,
    mount_origin_mm,
    optical_frame,
    vertical_fov_rad,
)
from gelslim_cad.robot.mass import MassProperties, PartMass, combined_mass, part_mass
from gelslim_cad.robot.pieces import Piece, collision_pieces, part_meshes, visual_pieces

NAMES: tuple[Name, ...] = (
    "camera.focal_length_mm",
    "camera.image_height_px",
    "camera.image_width_px",
    "camera_pose.pitch_deg",
    "camera_pose.x_mm",
    "camera_pose.z_mm",
    "design.gel.corner_radius_mm",
    "design.gel.crown_height_mm",
    "design.gel.length_mm",
    "design.gel.thickness_mm",
    "design.gel.width_mm",
    "design.mount.flange_bolt",
    "design.mount.flange_bolt_spacing_mm",
    "design.mount.gripper",
    "design.mount.object_mass_g",
    "design.mount.object_size_mm",
    "finger.proximal_x_mm",
    "finger.tip_x_mm",
    "flange.jaw_z_mm",
    "flange.thickness_mm",
    "grip.force_n",
    "material.gel.density_kg_m3",
    "material.gel.poissons_ratio",
    "material.gel.youngs_modulus_mpa",
    "view.focal_px",
)
"""Dimensions and spec fields that the models depend on."""


def robot_inputs(d: Lookup) -> dict[str, Any]:
    """Values of NAMES."""
    return {name: d[name] for name in NAMES}


@dataclass(frozen=True)
class Frames:
    """Frames as transforms (4, 4) to the mount, in metres (`gelslim_cad.robot.frames`)."""

    gel: Transform
    optical: Transform
    graphics: Transform


@dataclass(frozen=True)
class RobotFinger:
    """A finger for simulators; lengths of meshes in mm, everything else in SI units.

    All coordinates are those of the mount: its origin is the middle of the jaw's face.

    Attributes:
        name: Name of the finger.
        mass: Mass properties of all parts together.
        part_masses: Those of each part, in the mount's frame.
        visuals: Meshes that are seen.
        collisions: Convex meshes that collide.
        frames: Sensor frame and camera.
        fov_y_rad: Vertical field of view of the camera.
        image_px: Width and height of its picture.
        focal_length_mm: Focal length of the lens.
        focal_px: Focal length in px.
        contact: Contact of the gel.
    """

    name: str
    mass: MassProperties
    part_masses: tuple[PartMass, ...]
    visuals: tuple[Piece, ...]
    collisions: tuple[Piece, ...]
    frames: Frames
    fov_y_rad: float
    image_px: tuple[int, int]
    focal_length_mm: float
    focal_px: float
    contact: GelContact

    @property
    def pieces(self) -> tuple[Piece, ...]:
        """All meshes."""
        return (*self.visuals, *self.collisions)


def robot_finger(
    name: str,
    parts: Sequence[Part],
    d: Lookup,
    meshes: Mapping[str, TriangleMesh] | None = None,
) -> RobotFinger:
    """Describe a finger for simulators.

    Args:
        name: Name of the finger.
        parts: Its assembled parts, in the sensor frame.
        d: Dimensions and spec fields (`NAMES`).
        meshes: Meshes of the parts by their names, where they are known already.

    Returns:
        The description. Needs the CAD kernel.
    """
    origin_mm = mount_origin_mm(d)
    masses = [part_mass(part, d["material.gel.density_kg_m3"]) for part in parts]
    moved = tuple(
        PartMass(
            m.name, m.properties.moved(-origin_mm * 1e-3), m.density_g_cm3, m.source, m.assumed
        )
        for m in masses
    )
    mass = combined_mass(m.properties for m in moved)
    optical = optical_frame(d)
    meshes = meshes or part_meshes(parts)
    return RobotFinger(
        name=name,
        mass=mass,
        part_masses=moved,
        visuals=visual_pieces(parts, meshes, origin_mm),
        collisions=collision_pieces(parts, meshes, GelShape.of(d), origin_mm, _cuts_x_mm(d)),
        frames=Frames(gel_frame(d), optical, graphics_frame(optical)),
        fov_y_rad=vertical_fov_rad(d),
        image_px=(int(d["camera.image_width_px"]), int(d["camera.image_height_px"])),
        focal_length_mm=float(d["camera.focal_length_mm"]),
        focal_px=float(d["view.focal_px"]),
        contact=gel_contact(d, mass.mass_kg),
    )


def _cuts_x_mm(d: Lookup) -> tuple[float, ...]:
    """Where the adapter is cut: behind the flange, if a plate stands on it, and before it."""
    front = float(d["finger.proximal_x_mm"])
    if JawBolts.of_design(d).lateral:
        return front - float(d["flange.thickness_mm"]), front
    return (front,)


def record(finger: RobotFinger) -> dict[str, Any]:
    """The description as plain values, for `model.json`: masses with sources, pieces, frames."""
    return {
        "format": "gelslim-robot/1",
        "name": finger.name,
        "frame": "mount: origin in the middle of the jaw's face, x to the tip, z out of the gel",
        "mass_kg": finger.mass.mass_kg,
        "centre_of_mass_m": finger.mass.centre_m.tolist(),
        "inertia_kg_m2": finger.mass.inertia_kg_m2.tolist(),
        "parts": [
            {
                "name": m.name,
                "mass_kg": m.properties.mass_kg,
                "density_g_cm3": m.density_g_cm3,
                "source": m.source,
                "assumed": m.assumed,
            }
            for m in finger.part_masses
        ],
        "material_volume_mm3": sum(
            m.properties.mass_kg / m.density_g_cm3 * 1e6 for m in finger.part_masses
        ),
        "collision_volume_mm3": {p.name: p.volume_mm3 for p in finger.collisions},
        "gel_frame": finger.frames.gel.tolist(),
        "camera_optical_frame": finger.frames.optical.tolist(),
        "camera": {
            "fov_y_rad": finger.fov_y_rad,
            "image_px": list(finger.image_px),
            "focal_px": finger.focal_px,
        },
        "contact": {
            "friction": finger.contact.friction,
            "stiffness_n_m": finger.contact.stiffness_n_m,
            "damping_n_s_m": finger.contact.damping_n_s_m,
            "effective_kg": finger.contact.effective_kg,
            "solref": list(finger.contact.solref),
            "solimp": list(finger.contact.solimp),
        },
    }


def rounded(values: Any, digits: int = 9) -> str:
    """Numbers separated by spaces, with so many significant digits."""
    flat = np.ravel(np.asarray(values, dtype=float)) + 0.0
    return " ".join(f"{v:.{digits}g}" for v in flat.tolist())
