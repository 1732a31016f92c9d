"""The deviation of a built camera from its design: thirteen numbers with their tolerances."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from gelslim_optics.camera.lens_distortion import LensDistortion
from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]
PARAMETERS = (
    "rotation_x_deg",
    "rotation_y_deg",
    "rotation_z_deg",
    "shift_x_mm",
    "shift_y_mm",
    "shift_z_mm",
    "focal_percent",
    "k1",
    "k2",
    "p1",
    "p2",
    "principal_x_px",
    "principal_y_px",
)
"""Order of the values: the virtual camera's rotation vector and shift in the sensor frame, the
change of its focal length, and what is added to the design's distortion coefficients and to its
principal point."""


@dataclass(frozen=True)
class CameraTolerance:
    """Standard deviations of a built camera about its design. Raises ValueError unless > 0.

    The shift along x and y and the rotation about z include the placement of the print on the gel:
    flat layers look the same from everywhere, so that one picture cannot distinguish a shifted
    print from a shifted camera.
    """

    tilt_deg: float = 1.0
    """About x and y."""
    turn_deg: float = 1.5
    """About z, print included."""
    lateral_mm: float = 0.4
    """Along x and y, print included."""
    height_mm: float = 0.3
    focal_percent: float = 2.0
    k1: float = 0.05
    k2: float = 0.02
    tangential: float = 0.004
    """p1 and p2."""
    principal_share: float = 0.002
    """Offset of the principal point from the picture's middle, over the picture's width. It is
    small because a tilt has nearly the same effect; a larger offset is still found where the
    picture shows it."""

    def __post_init__(self) -> None:
        for name, value in dataclasses.asdict(self).items():
            if not (np.isfinite(value) and value > 0):
                raise ValueError(f"camera tolerance {name} = {value!r}: must be a number > 0")

    def sigma(self, design: VirtualCamera) -> Array:
        """Standard deviations (13,) in the order and units of `PARAMETERS`."""
        return np.array(
            [self.tilt_deg] * 2
            + [self.turn_deg]
            + [self.lateral_mm] * 2
            + [self.height_mm, self.focal_percent, self.k1, self.k2]
            + [self.tangential] * 2
            + [self.principal_share * design.image_width_px] * 2
        )


def deviated_camera(design: VirtualCamera, values: ArrayLike) -> VirtualCamera:
    """The design's camera changed by `values` (13,), see `PARAMETERS`.

    The camera turns about its own pinhole. Raises ValueError for values that no camera has.
    """
    v = np.asarray(values, dtype=float)
    if v.shape != (len(PARAMETERS),):
        raise ValueError(f"camera deviation of shape {v.shape}: must be ({len(PARAMETERS)},)")
    turned = Rotation.from_rotvec(np.radians(v[:3])).apply(design.axes)
    lens = design.lens or LensDistortion()
    distorted = dataclasses.replace(
        lens, k1=lens.k1 + v[7], k2=lens.k2 + v[8], p1=lens.p1 + v[9], p2=lens.p2 + v[10]
    )
    x, y = design.principal_offset_px
    return dataclasses.replace(
        design,
        principal_offset_px=(x + v[11], y + v[12]),
        position_mm=design.position_mm + v[3:6],
        right=turned[0],
        down=turned[1],
        forward=turned[2],
        focal_px=design.focal_px * (1 + v[6] / 100),
        lens=distorted if distorted.distorts else None,
    )
