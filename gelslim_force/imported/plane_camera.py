"""A camera that shows the plane of the gel as a homography does.

A homography H takes points of the plane to the picture. With the focal length f, the columns of
diag(1/f, 1/f, 1) H are, up to one factor, the images of x and y and the position of the origin in
the camera's frame (R. Hartley and A. Zisserman, *Multiple View Geometry*, section 8.1). Where f is
not known, the two columns of a rotation must be at right angles and of one length, which gives two
equations for 1/f² (Z. Zhang, IEEE TPAMI 22, 2000). A picture that hardly converges satisfies them
with any f.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.camera.lens_distortion import LensDistortion
from gelslim_optics.camera.refraction import Layer
from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]
_USUAL_FIELD_DEG = 55.0
"""Angle across the picture that is assumed where the picture does not show it."""
_LEAST_FIELD_DEG, _MOST_FIELD_DEG = 15.0, 120.0
_LEAST_CONVERGENCE = 0.1
"""Difference of the scale over the picture, as a part of it, from which it tells the focal length.
A lens with strong distortion looks like one of less."""


def focal_by_homography(matrix: Array, size_px: tuple[int, int]) -> float | None:
    """Focal length in px by which a homography (3, 3) is that of a pinhole camera.

    Args:
        matrix: From mm to px.
        size_px: Width and height of the picture, whose middle is on the lens axis.

    Returns:
        The focal length, or None where the picture hardly converges, or that of no usual lens.
    """
    centred = _centred(matrix, size_px)
    if _convergence(centred, size_px) < _LEAST_CONVERGENCE:
        return None
    (a, b), (c, d), (e, f) = centred[:, :2]
    image = np.array([a * b + c * d, a * a + c * c - b * b - d * d])
    depth = np.array([e * f, e * e - f * f])
    squared = -float(image @ image) / float(depth @ image) if depth @ image else -1.0
    low, high = (focal_of_field(angle, size_px[0]) for angle in (_MOST_FIELD_DEG, _LEAST_FIELD_DEG))
    return float(np.sqrt(squared)) if low**2 < squared < high**2 else None


def focal_of_field(angle_deg: float, width_px: int) -> float:
    """Focal length in px for an angle across the width of the picture."""
    return float(width_px / 2 / np.tan(np.radians(angle_deg) / 2))


def usual_focal_px(width_px: int) -> float:
    """The focal length that is assumed where nothing tells it."""
    return focal_of_field(_USUAL_FIELD_DEG, width_px)


def camera_of_homography(
    matrix: Array,
    focal_px: float,
    size_px: tuple[int, int],
    layers: tuple[Layer, ...],
    *,
    principal_offset_px: tuple[float, float] = (0.0, 0.0),
    lens: LensDistortion | None = None,
) -> VirtualCamera:
    """The camera below flat layers that shows their upper face nearly as a homography does.

    Rays are taken as paraxial: the layers bring the pinhole nearer by d (1 - 1/n).

    Args:
        matrix: (3, 3) from x and y in mm to px, with the gel's surface in front of the camera.
        focal_px: Focal length.
        size_px: Width and height of the picture.
        layers: From the camera up to the surface z = 0.
        principal_offset_px: Of the lens axis from the picture's middle.
        lens: Distortion.

    Returns:
        The camera; its image axes are left-handed where the picture is mirrored.

    Raises:
        ValueError: The camera would be within or above the layers.
    """
    centred = _centred(matrix, size_px, principal_offset_px)
    scaled = centred / np.array([focal_px, focal_px, 1.0])[:, None]
    left, _, right = np.linalg.svd(scaled[:, :2], full_matrices=False)
    axes = np.empty((3, 3))
    axes[:, :2] = left @ right
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    if axes[2, 2] < 0:
        axes[:, 2] *= -1
    length = float(np.mean(np.linalg.norm(scaled[:, :2], axis=0)))
    position = -axes.T @ (scaled[:, 2] / length)
    total = sum(layer.thickness_mm for layer in layers)
    position[2] -= sum(layer.thickness_mm * (1 - 1 / layer.index) for layer in layers)
    return VirtualCamera(
        position_mm=position,
        right=axes[0],
        down=axes[1],
        forward=axes[2],
        focal_px=focal_px,
        image_width_px=size_px[0],
        image_height_px=size_px[1],
        window_bottom_z_mm=-total,
        layers=layers,
        lens=lens,
        principal_offset_px=principal_offset_px,
    )


def pinhole_camera(
    position_mm: tuple[float, float, float],
    looks_at_mm: tuple[float, float],
    x_in_picture: Array,
    mirrored: bool,
    focal_px: float,
    size_px: tuple[int, int],
    layers: tuple[Layer, ...],
    *,
    principal_offset_px: tuple[float, float] = (0.0, 0.0),
    lens: LensDistortion | None = None,
) -> VirtualCamera:
    """The camera at a place that looks at a point of the gel.

    It is turned about its axis so that x has the direction `x_in_picture` (2,), as nearly as the
    tilt allows. Others as for `camera_of_homography`; raises ValueError as there.
    """
    forward = np.array([*looks_at_mm, 0.0]) - np.asarray(position_mm, dtype=float)
    forward /= np.linalg.norm(forward)
    along = np.array([1.0, 0.0, 0.0]) - forward[0] * forward
    along /= np.linalg.norm(along)
    across = np.cross(forward, along) * (-1.0 if mirrored else 1.0)
    u, v = x_in_picture
    return VirtualCamera(
        position_mm=np.asarray(position_mm, dtype=float),
        right=u * along - v * across,
        down=v * along + u * across,
        forward=forward,
        focal_px=focal_px,
        image_width_px=size_px[0],
        image_height_px=size_px[1],
        window_bottom_z_mm=-sum(layer.thickness_mm for layer in layers),
        layers=layers,
        lens=lens,
        principal_offset_px=principal_offset_px,
    )


def _centred(
    matrix: Array, size_px: tuple[int, int], offset_px: tuple[float, float] = (0.0, 0.0)
) -> Array:
    """The homography to pixels relative to the lens axis, with positive depth of the origin."""
    middle = (np.array(size_px) - 1) / 2 + np.array(offset_px)
    centred = np.array(matrix, dtype=float)
    centred[:2] -= middle[:, None] * centred[2]
    return centred * (-1.0 if centred[2, 2] < 0 else 1.0)


def _convergence(centred: Array, size_px: tuple[int, int]) -> float:
    """Difference of the depth over the picture, as a part of the depth at its middle."""
    inverse = np.linalg.inv(centred)
    half = np.array(size_px) / 2
    corners = np.array([[u, v, 1.0] for u in (-half[0], half[0]) for v in (-half[1], half[1])])
    depth = 1 / (corners @ inverse[2])
    middle = 1 / inverse[2, 2]
    return float(np.ptp(depth) / abs(middle))
