"""Camera, mirror and layers of built fingers: the design with errors, without solving the fold.

Everything stands on three printed references. Camera clamp and mirror seat are screwed to the
cover; the window is pressed against the bezel, so that its upper face keeps its place, an error of
its thickness moves its lower face, and an error of the gel's moves the outer surface.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.geometry.optics import lens_distortion
from gelslim_cad.tolerance.causes import Cause, causes, seated
from gelslim_optics.camera.lens_distortion import LensDistortion

Array = NDArray[np.float64]
Errors = Mapping[str, Array]
LEAST_LAYER = 0.05
"""Least part of its nominal height that an error leaves of a layer, and of a focal length."""
ROCKS = ("rock_pitch_deg", "rock_yaw_deg", "rock_roll_deg")


@dataclass(frozen=True)
class Setting:
    """What the person who assembles the finger sets; arrays (n,).

    Attributes:
        pitch_deg: Pitch of the camera in its clamp, downwards in the picture.
        yaw_deg: Its yaw, to the right in the picture.
        roll_deg: Its roll.
        focus_mm: Distance from the entrance pupil on which the lens is set.
    """

    pitch_deg: Array
    yaw_deg: Array
    roll_deg: Array
    focus_mm: Array


@dataclass(frozen=True)
class Built:
    """n built fingers, the camera mirrored at the fold mirror; sensor frame, mm.

    Attributes:
        position_mm: Mirrored entrance pupils (n, 3).
        axes: Right, down and forward of the mirrored cameras as rows (n, 3, 3).
        camera_z_mm: Heights (n,) of the real entrance pupils.
        heights_mm: Air, acrylic and gel, each (n, 1).
        indices: Their refractive indices.
        image_mm: Distances (n,) of the sensors from the lenses.
        focus_mm: Distances (n,) on which the lenses are sharp.
        aperture_mm: Diameters (n,) of the lens openings.
        principal_mm: Principal points (n, 2) on the sensor, from its middle.
        lens: Its distortion.
        mirror_point_mm: Middles (n, 3) of the mirrors.
        mirror_normal: Their unit normals (n, 3).
        mirror_along: Unit vector (3,) along the mirror's length.
    """

    position_mm: Array
    axes: Array
    camera_z_mm: Array
    heights_mm: tuple[Array, Array, Array]
    indices: tuple[float, float, float]
    image_mm: Array
    focus_mm: Array
    aperture_mm: Array
    principal_mm: Array
    lens: LensDistortion
    mirror_point_mm: Array
    mirror_normal: Array
    mirror_along: Array


def as_dropped_in(d: Lookup, e: Errors) -> Setting:
    """The camera as it falls into its clamp, the lens set with the focus jig.

    The jig's target stands at the nominal distance from the nominal entrance pupil.
    """
    pitch, yaw, roll = (e[name] for name in ROCKS)
    return Setting(pitch, yaw, roll, d["view.focus_mm"] - e["pupil_mm"])


def play_left(d: Lookup, e: Errors) -> Array:
    """Part (n,) of a loose clamp's gap that the tilt of the camera leaves for its shift.

    Printed points shift the camera by what they err, however it is tilted.
    """
    if seated(d):
        return np.ones_like(e[ROCKS[0]])
    used = [np.abs(e[c.name]) / max(c.spread, 1e-12) for c in rocking(d).values()]
    return 1 - np.clip(np.maximum.reduce(used), 0, 1)


def rocking(d: Lookup) -> dict[str, Cause]:
    """The three tilts of the camera in its clamp by name; their spreads are the largest tilts."""
    return {c.name: c for c in causes(d) if c.name in ROCKS}


def reach_deg(d: Lookup) -> Array:
    """How far (3,) a person can turn the camera in its clamp: pitch, yaw and roll.

    The play on both sides of the module allows it; in a seat of points foils under them do it.
    """
    sides = (d["camera.module_height_mm"], d["camera.module_width_mm"])
    pitch, yaw = (np.degrees(2 * d["clamp.play_mm"] / side) for side in sides)
    return np.array([pitch, yaw, pitch])


def built(d: Lookup, e: Errors, setting: Setting) -> Built:
    """Lay out n fingers.

    Args:
        d: Dimensions of the design.
        e: Errors (n,) by name, see `causes`.
        setting: What is set when they are assembled.

    Returns:
        The fingers.
    """
    focal, image, focus, extension = _lens(d, e, setting)
    moved = np.zeros((len(focal), 3))
    moved[:, 2] = e["body_z_mm"]
    point, normal, along = _mirror(d, e)
    point = point + moved
    position, axes = _camera(d, e, setting, extension)
    position = position + moved
    away = np.einsum("ni,ni->n", position - point, normal)[:, None]
    mirrored = axes - 2 * np.einsum("nij,nj->ni", axes, normal)[:, :, None] * normal[:, None, :]
    virtual = position - 2 * away * normal
    acrylic, gel = (
        np.maximum(nominal + error, LEAST_LAYER * nominal)[:, None]
        for nominal, error in (
            (d["design.light_guide.thickness_mm"], e["acrylic_mm"]),
            (d["stack.gel_total_mm"], e["gel_mm"]),
        )
    )
    air = d["stack.gel_bottom_z_mm"] - acrylic[:, 0] - virtual[:, 2]
    return Built(
        position_mm=virtual,
        axes=mirrored,
        camera_z_mm=position[:, 2],
        heights_mm=(np.maximum(air, LEAST_LAYER)[:, None], acrylic, gel),
        indices=(
            1.0,
            d["material.acrylic.refractive_index"],
            d["material.gel.refractive_index"],
        ),
        image_mm=image,
        focus_mm=focus,
        aperture_mm=focal / d["camera.f_number"],
        principal_mm=np.stack([e["centre_u_mm"], e["centre_v_mm"]], axis=1),
        lens=lens_distortion(d),
        mirror_point_mm=point,
        mirror_normal=normal,
        mirror_along=along,
    )


def _lens(d: Lookup, e: Errors, setting: Setting) -> tuple[Array, Array, Array, Array]:
    """Focal length, image distance, distance in focus and extension of each lens."""
    nominal = d["camera.focal_length_mm"]
    part = np.maximum(1 + e["focal_percent"] / 100, LEAST_LAYER)
    focal = nominal * part
    fixed_image = d["view.fixed_image_mm"]
    if d["camera.focusing"] == "fixed":
        still = np.zeros_like(focal)
        return focal, fixed_image * part, still + d["view.fixed_focus_mm"], still
    wanted = np.maximum(setting.focus_mm, 1.5 * focal)
    image = focal * wanted / (wanted - focal) + e["extension_mm"]
    image = np.maximum(image, (1 + 1e-4) * focal)
    focus = focal * image / (image - focal)
    if d["camera.focusing"] == "internal":
        return focal, fixed_image * part, focus, np.zeros_like(focal)
    return focal, image, focus, image - focal


def _mirror(d: Lookup, e: Errors) -> tuple[Array, Array, Array]:
    """Middle (n, 3), unit normal (n, 3) and direction (3,) along the mirror."""
    angle = np.radians(d["mirror.angle_deg"])
    along = np.array([np.cos(angle), 0.0, np.sin(angle)])
    normal = np.array([-np.sin(angle), 0.0, np.cos(angle)])
    tilted = (
        normal
        + np.tan(np.radians(e["mirror_slope_deg"]))[:, None] * along
        + np.tan(np.radians(e["mirror_roll_deg"]))[:, None] * np.array([0.0, 1.0, 0.0])
    )
    tilted = tilted / np.linalg.norm(tilted, axis=1)[:, None]
    upper = np.array([d["mirror.upper_x_mm"], 0.0, d["mirror.upper_z_mm"]])
    lower = np.array([d["mirror.lower_x_mm"], 0.0, d["mirror.lower_z_mm"]])
    raised = (e["mirror_seat_mm"] + e["mirror_glass_mm"])[:, None] * normal
    raised = raised + e["mirror_stop_mm"][:, None] * along
    return (upper + lower) / 2 + raised, tilted, along


def _camera(d: Lookup, e: Errors, setting: Setting, extension: Array) -> tuple[Array, Array]:
    """Entrance pupils (n, 3) and axes (n, 3, 3) of the real cameras, turned about their modules."""
    pitch = np.radians(d["camera_pose.pitch_deg"])
    axes = np.array(
        [
            [0.0, 1.0, 0.0],
            [np.sin(pitch), 0.0, np.cos(pitch)],
            [np.cos(pitch), 0.0, -np.sin(pitch)],
        ]
    )
    tilt = np.stack(
        [
            -(setting.pitch_deg + e["seat_pitch_deg"]),
            setting.yaw_deg + e["seat_yaw_deg"],
            setting.roll_deg + e["seat_roll_deg"],
        ],
        axis=1,
    )
    turn = Rotation.from_rotvec(np.radians(tilt)).as_matrix()
    turned = np.einsum("nji,jk->nik", turn, axes)
    behind = d["camera_pose.face_mm"] + d["camera.module_depth_mm"] / 2
    pupil = np.array([d["camera_pose.x_mm"], 0.0, d["camera_pose.z_mm"]])
    module = pupil - behind * axes[2]
    ahead = behind + e["pupil_mm"] + extension - d["view.lens_extension_mm"]
    left = play_left(d, e)
    shift = np.stack(
        [e["play_right_mm"] * left, e["play_down_mm"] * left, e["play_forward_mm"] * left], axis=1
    )
    place = np.stack([e["clamp_x_mm"], e["clamp_y_mm"], e["clamp_z_mm"]], axis=1)
    return module + place + shift @ axes + ahead[:, None] * turned[:, 2], turned
