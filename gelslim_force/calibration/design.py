"""What a bundle says of its sensor as designed: the camera and the markers' heights at rest."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.camera.virtual_camera import VirtualCamera
from ifem_export.errors import IfemError
from ifem_export.markers.interpolation import marker_to_node

if TYPE_CHECKING:
    from ifem_export.bundle.bundle import Bundle


def bundle_camera(bundle: Bundle) -> VirtualCamera:
    """Return the virtual camera of the design. Raises IfemError where the bundle has none."""
    if not bundle.camera:
        raise IfemError("the bundle has no camera: rebuild it with `gelslim bundle SPEC -o BUNDLE`")
    try:
        return VirtualCamera.from_record(bundle.camera)
    except ValueError as error:
        raise IfemError(f"the bundle's camera cannot be used: {error}") from error


def marker_heights_mm(bundle: Bundle) -> NDArray[np.float64]:
    """Heights (k,) of the bundle's markers at rest, bilinear in its surface nodes.

    They are zero on a flat gel and fall away from the apex of a crowned one.
    Raises IfemError for a bundle without markers.
    """
    if bundle.markers is None:
        raise IfemError("the bundle has no markers: rebuild it with marker positions")
    surface = np.asarray(bundle.mesh.surface_mm)
    positions = np.asarray(bundle.markers.positions_mm, dtype=float)
    if not np.ptp(surface[:, 2]) > 0:
        return np.zeros(len(positions))
    return np.asarray(marker_to_node(surface, positions) @ surface[:, 2])
