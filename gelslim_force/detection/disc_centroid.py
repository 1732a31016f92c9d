"""Where the centre of a printed disc's image lies against the image of the disc's centre.

Perspective and refraction shrink the far half of a disc more than the near half, so the centroid
of its image is not the projection of its centre. The difference grows with the square of the
diameter: about 0.01 px for a dot of 0.5 mm at 20 px/mm, the same way for all dots.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera

_CORNERS = 12


def centroid_offset_px(
    camera: VirtualCamera, centres_mm: ArrayLike, diameter_mm: ArrayLike
) -> NDArray[np.float64]:
    """Return centroid of each disc's image minus image of its centre, (n, 2) in px.

    Args:
        camera: the camera.
        centres_mm: (n, 2) on the rest plane z = 0.
        diameter_mm: (n,) or one for all.

    The rim is followed by a 12-gon of the disc's second moments, so the offset is right up to
    fourth order in the diameter. Raises ValueError for shapes that do not fit and for points
    that have no image.
    """
    centres = np.asarray(centres_mm, dtype=float)
    if centres.ndim != 2 or centres.shape[1] != 2:
        raise ValueError(f"disc centres {centres.shape}: must be (n, 2)")
    count = len(centres)
    radius = np.broadcast_to(np.asarray(diameter_mm, dtype=float) / 2, (count,))
    # Second moment of a regular N-gon about its centre: area R² (2 + cos 2π/N) / 12; disc: / 4.
    outer = radius * np.sqrt(3.0 / (2.0 + np.cos(2.0 * np.pi / _CORNERS)))
    turn = np.linspace(0.0, 2.0 * np.pi, _CORNERS, endpoint=False)
    points = np.zeros((count, _CORNERS + 1, 3))
    points[:, :, :2] = centres[:, None, :]
    points[:, 1:, 0] += outer[:, None] * np.cos(turn)
    points[:, 1:, 1] += outer[:, None] * np.sin(turn)
    image = camera.project(points.reshape(-1, 3)).reshape(count, _CORNERS + 1, 2)
    rim = image[:, 1:] - image[:, :1]
    following = np.roll(rim, -1, axis=1)
    cross = rim[..., 0] * following[..., 1] - following[..., 0] * rim[..., 1]
    moment = ((rim + following) * cross[..., None]).sum(axis=1)
    offset: NDArray[np.float64] = moment / (3.0 * cross.sum(axis=1)[:, None])
    return offset
