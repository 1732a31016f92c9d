"""The design's camera, as a bundle's record tells it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gelslim_optics.camera.virtual_camera import VirtualCamera
from ifem_export.errors import IfemError

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
