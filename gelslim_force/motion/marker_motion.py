"""Motion of the markers in the gel's plane from their motion in the picture.

A marker that is pressed down has an apparent lateral motion (see
`gelslim_optics.camera.projection_error`). The `exact` compensation traces the ray of its pixel
back to the height where the marker is now. The others trace it to the rest plane and subtract the
apparent motion, as the paper does.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_optics.camera.height_points import image_points, points_at_heights, points_on_rays
from gelslim_optics.camera.projection_error import projection_error_mm
from gelslim_optics.camera.virtual_camera import VirtualCamera

Array = NDArray[np.float64]
Compensation = Literal["none", "printed", "arctan", "exact"]
COMPENSATIONS: tuple[Compensation, ...] = get_args(Compensation)


@dataclass(frozen=True, eq=False)
class MarkerView:
    """n markers as one camera saw them at rest.

    Raises ValueError for positions of another shape, or positions that are not finite.
    """

    camera: VirtualCamera
    reference_px: Array
    """(n, 2)."""
    rest_height_mm: Array | float = 0.0
    """Scalar or (n,): heights of the gel there at rest."""

    def __post_init__(self) -> None:
        positions = np.array(self.reference_px, dtype=float)
        if positions.ndim != 2 or positions.shape[1] != 2 or not np.isfinite(positions).all():
            raise ValueError(f"reference positions {positions.shape} must be (n, 2) and finite")
        positions.setflags(write=False)
        object.__setattr__(self, "reference_px", positions)
        heights = np.array(np.broadcast_to(self.rest_height_mm, len(positions)), dtype=float)
        object.__setattr__(self, "rest_height_mm", heights)

    def __len__(self) -> int:
        """Return the number of markers."""
        return len(self.reference_px)

    @cached_property
    def rest_mm(self) -> Array:
        """(n, 3) where the markers are at rest."""
        return self._at(self.reference_px, np.asarray(self.rest_height_mm))

    @cached_property
    def mm_per_px(self) -> Array:
        """(n, 2, 2) motion on the gel per motion in the picture, at rest."""
        return np.asarray(np.linalg.inv(self.camera.jacobian(self.rest_mm)), dtype=float)

    @cached_property
    def mean_mm_per_px(self) -> Array:
        """(n,) at rest, the geometric mean over all directions."""
        return np.asarray(np.sqrt(np.abs(np.linalg.det(self.mm_per_px))))

    @cached_property
    def usual_mm_per_px(self) -> float:
        """Median over the markers of the length on the gel per length in the picture."""
        return float(np.median(np.sqrt(np.abs(np.linalg.det(self.mm_per_px)))))

    def by_height(self) -> Array:
        """(n, 2) by how much the exact lateral motion of each marker grows per mm of its height."""
        still, step_mm = self.reference_px, 1e-3
        return (self.lateral_motion(still, step_mm) - self.lateral_motion(still)) / step_mm

    def lateral_motion(
        self,
        positions_px: ArrayLike,
        normal_mm: ArrayLike | float = 0.0,
        compensation: Compensation = "exact",
    ) -> Array:
        """Displacements (n, 2) in mm along x and y.

        Args:
            positions_px: (n, 2) positions now; a NaN position gives a NaN motion.
            normal_mm: scalar or (n,) motion along z, negative where the gel is pressed in.
            compensation: see the module.

        Raises:
            ValueError: shapes that do not fit, an unknown compensation.
        """
        positions = np.asarray(positions_px, dtype=float)
        if positions.shape != self.reference_px.shape:
            raise ValueError(f"positions {positions.shape} must be {self.reference_px.shape}")
        if compensation not in COMPENSATIONS:
            raise ValueError(f"compensation {compensation!r}: one of {', '.join(COMPENSATIONS)}")
        w = np.broadcast_to(np.asarray(normal_mm, dtype=float), len(positions))
        known = np.isfinite(positions[:, 0] + positions[:, 1] + w)
        if known.all():
            return self._lateral(positions, self.rest_mm, w, compensation)
        motion = np.full(positions.shape, np.nan)
        if not known.any():
            return motion
        motion[known] = self._lateral(positions[known], self.rest_mm[known], w[known], compensation)
        return motion

    def _lateral(
        self, positions: Array, rest: Array, w: Array, compensation: Compensation
    ) -> Array:
        """Displacements (k, 2) of markers that are all known."""
        now = self._at(positions, rest[:, 2] + (w if compensation == "exact" else 0.0))
        motion = now[:, :2] - rest[:, :2]
        if compensation in ("printed", "arctan"):
            motion -= projection_error_mm(self.camera, rest, w, compensation)
        return np.asarray(motion)

    def _at(self, positions_px: Array, height_mm: Array) -> Array:
        return points_at_heights(self.camera, positions_px, height_mm)


@dataclass(frozen=True, eq=False)
class MarkerRays:
    """Rays of the n markers of one frame, whose motion is asked for at several heights.

    Attributes:
        view: The markers.
        positions_px: (n, 2) where they are seen; NaN for lost ones.
    """

    view: MarkerView
    positions_px: Array

    @cached_property
    def known(self) -> NDArray[np.bool_]:
        """(n,) markers that are seen."""
        return np.asarray(np.isfinite(self.positions_px[:, 0] + self.positions_px[:, 1]))

    def lateral(self, chosen: NDArray[np.intp], normal_mm: Array) -> Array:
        """Displacements (m, 2) of m known markers, by number, as `MarkerView.lateral_motion` gives.

        Args:
            chosen: (m,) markers.
            normal_mm: (m,) motion along z.
        """
        rest = self.view.rest_mm[chosen]
        now = points_on_rays(
            self.view.camera,
            self.positions_px[chosen],
            self._image[chosen],
            rest[:, 2] + normal_mm,
        )
        return now[:, :2] - rest[:, :2]

    @cached_property
    def _image(self) -> Array:
        """(n, 2) undistorted image points; NaN for lost ones."""
        image = np.full(self.positions_px.shape, np.nan)
        image[self.known] = image_points(self.view.camera, self.positions_px[self.known])
        return image
