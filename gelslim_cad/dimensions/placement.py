"""Where camera and mirror stand: dimensions that follow from the solved fold."""

from __future__ import annotations

import numpy as np

from gelslim_cad.dimensions.fold.fold import Fold
from gelslim_cad.dimensions.registry import Real, dimension

FOLD = "docs/physics.md#camera-and-fold"


@dimension("camera_pose.x_mm", formula="mirror image of the virtual camera", source=FOLD)
def camera_pose_x_mm(fold_layout: Fold) -> Real:
    """Entrance pupil of the lens along the finger."""
    return fold_layout.camera_x_mm


@dimension("camera_pose.z_mm", formula="mirror image of the virtual camera", source=FOLD)
def camera_pose_z_mm(fold_layout: Fold) -> Real:
    """Entrance pupil of the lens across the thickness."""
    return fold_layout.camera_z_mm


@dimension("camera_pose.pitch_deg", formula="ψ = 90° - 2α - γ", source=FOLD)
def camera_pose_pitch_deg(mirror_angle_deg: Real, view_tilt_deg: Real) -> Real:
    """Pitch of the camera down towards the mirror."""
    return 90.0 - 2 * mirror_angle_deg - view_tilt_deg


@dimension("camera_pose.face_mm", formula="entrance pupil + lens extension", source=FOLD)
def camera_pose_face_mm(camera_pose_pupil_mm: Real, view_lens_extension_mm: Real) -> Real:
    """How far the entrance pupil is before the housing's front face, the lens in focus."""
    return camera_pose_pupil_mm + view_lens_extension_mm


@dimension("camera_pose.lens_front_mm", formula="lens height - entrance pupil", source=FOLD)
def camera_pose_lens_front_mm(camera_lens_height_mm: Real, camera_pose_pupil_mm: Real) -> Real:
    """How far the lens barrel's front is before the entrance pupil."""
    return camera_lens_height_mm - camera_pose_pupil_mm


@dimension("camera_pose.rear_x_mm", formula="rearmost corner of the housing", source=FOLD)
def camera_pose_rear_x_mm(fold_layout: Fold) -> Real:
    """Rearmost point of the camera housing."""
    return fold_layout.camera_rear_x_mm


@dimension("camera_pose.front_x_mm", formula="foremost corner of lens and housing", source=FOLD)
def camera_pose_front_x_mm(fold_layout: Fold) -> Real:
    """Foremost point of lens and housing."""
    return fold_layout.camera_front_x_mm


@dimension("mirror.angle_deg", formula="solved", source=FOLD)
def mirror_angle_deg(fold_layout: Fold) -> Real:
    """Mirror angle α to the gel plane."""
    return np.degrees(fold_layout.mirror_rad)


@dimension("mirror.upper_x_mm", formula="far ray at the mirror's upper edge", source=FOLD)
def mirror_upper_x_mm(fold_layout: Fold, mirror_border_mm: Real) -> Real:
    """Upper end of the reflecting face, border included."""
    return fold_layout.mirror_upper_x_mm + mirror_border_mm * np.cos(fold_layout.mirror_rad)


@dimension("mirror.upper_z_mm", formula="window bottom - clearance", source=FOLD)
def mirror_upper_z_mm(fold_layout: Fold, mirror_border_mm: Real) -> Real:
    """Upper end of the reflecting face, border included."""
    return fold_layout.mirror_upper_z_mm + mirror_border_mm * np.sin(fold_layout.mirror_rad)


@dimension("mirror.lower_x_mm", formula="near ray at the mirror", source=FOLD)
def mirror_lower_x_mm(fold_layout: Fold, mirror_border_mm: Real) -> Real:
    """Lower end of the reflecting face, border included."""
    return fold_layout.mirror_lower_x_mm - mirror_border_mm * np.cos(fold_layout.mirror_rad)


@dimension("mirror.lower_z_mm", formula="near ray at the mirror", source=FOLD)
def mirror_lower_z_mm(fold_layout: Fold, mirror_border_mm: Real) -> Real:
    """Lower end of the reflecting face, border included."""
    return fold_layout.mirror_lower_z_mm - mirror_border_mm * np.sin(fold_layout.mirror_rad)


@dimension("mirror.length_mm", formula="|upper end - lower end|")
def mirror_length_mm(
    mirror_upper_x_mm: Real,
    mirror_upper_z_mm: Real,
    mirror_lower_x_mm: Real,
    mirror_lower_z_mm: Real,
) -> Real:
    """Mirror length along its slope."""
    return np.hypot(mirror_upper_x_mm - mirror_lower_x_mm, mirror_upper_z_mm - mirror_lower_z_mm)


@dimension("mirror.rear_x_mm", formula="upper end + t sin α", source=FOLD)
def mirror_rear_x_mm(
    mirror_upper_x_mm: Real, mirror_thickness_mm: Real, mirror_angle_deg: Real
) -> Real:
    """Upper edge of the mirror's back, its point nearest the tip."""
    return mirror_upper_x_mm + mirror_thickness_mm * np.sin(np.radians(mirror_angle_deg))


@dimension("mirror.width_mm", formula="2 (widest corner ray at the mirror + border)", source=FOLD)
def mirror_width_mm(fold_layout: Fold, mirror_border_mm: Real) -> Real:
    """Mirror width across the finger."""
    return 2 * (fold_layout.mirror_half_width_mm + mirror_border_mm)
