"""Pictures of a camera in portrait, which come lying on their side, turned upright."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera

Value = TypeVar("Value", bound=np.generic)


def upright(picture: NDArray[Value], camera: VirtualCamera) -> NDArray[Value]:
    """Turn a picture of a camera in portrait so that the near edge of the gel is at its top.

    A module that is mounted in portrait still reads its pictures wide: they lie on their side, with
    the near edge of the gel at the left, and are turned clockwise by 90°. Pictures of another size
    are returned as they are, among them those that are upright already and all of a camera in
    landscape.

    Args:
        picture: (h, w) or (h, w, 3).
        camera: The camera, whose picture is higher than wide in portrait.

    Returns:
        The upright picture, contiguous where it was turned.
    """
    high, wide = camera.image_height_px, camera.image_width_px
    shape: Any = getattr(picture, "shape", None)
    if high <= wide or shape is None or shape[:2] != (wide, high):
        return picture
    return np.ascontiguousarray(np.rot90(picture, k=-1))
