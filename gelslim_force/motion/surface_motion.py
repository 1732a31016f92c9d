"""Motion of the surface nodes from that of the markers, for one sensor."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.contact.normal_source import NormalReading
from gelslim_force.motion.marker_motion import Compensation, MarkerView
from gelslim_optics.camera.projection_error import projection_error_mm
from ifem_export.markers.interpolation import marker_to_node
from ifem_export.markers.interpolation_matrix import MarkerInterpolation

Array = NDArray[np.float64]
_STEP_MM = 1e-3
_NOISE_SIGMAS = 3.0
_MOVED_MM = 0.03
"""Lateral motion beyond what noise and thermal drift cause."""
_UNCERTAIN_MM = 0.01
_FEWEST = 4
"""Markers that must move: one or two may be mistaken."""
_DEPTH_PER_LATERAL = 3.0
"""Depth of an indentation over the lateral motion of the gel around it."""


@dataclass(frozen=True, eq=False)
class SurfaceMotion:
    """n followed markers of the sensor's k, and the c nodes of its surface."""

    view: MarkerView
    markers: NDArray[np.int64]
    """(n,) ids among the sensor's markers."""
    interpolation: MarkerInterpolation
    """From all k markers to the nodes."""
    points_mm: Array
    """(c, 3) nodes at rest."""
    compensation: Compensation = "exact"

    @cached_property
    def nodes_to_markers(self) -> Any:
        """(n, c) bilinear interpolation."""
        return marker_to_node(self.points_mm, self.view.rest_mm)

    @cached_property
    def apparent_per_mm(self) -> Array:
        """(k, 2) apparent lateral motion of a marker per mm along z; 0 for markers not followed."""
        error = projection_error_mm(self.view.camera, self.view.rest_mm, _STEP_MM) / _STEP_MM
        return self._of_all(error, 0.0)

    def of_markers(self, positions_px: Array, reading: NormalReading | None) -> Array:
        """Motion (n, 3) in mm for positions (n, 2); z is NaN where the normal motion is unknown."""
        if reading is None or not reading.known:
            lateral = self.view.lateral_motion(positions_px, 0.0, self.compensation)
            return np.column_stack([lateral, np.full(len(lateral), np.nan)])
        w = self.nodes_to_markers @ reading.w_mm
        return np.column_stack([self.view.lateral_motion(positions_px, w, self.compensation), w])

    def in_contact(self, motion_mm: Array, reading: NormalReading) -> Array | None:
        """Mean lateral motion (2,) of the markers in the contact; None where none is seen there."""
        inside = self._seen_in_contact(motion_mm, reading)
        return motion_mm[inside, :2].mean(axis=0) if inside.any() else None

    def loaded(self, reading: NormalReading | None) -> NDArray[np.bool_]:
        """(n,) markers on gel that is known to be touched, or pressed in; none if unknown."""
        if reading is None or not reading.known:
            return np.zeros(len(self.markers), dtype=bool)
        pressed = reading.w_mm < -_MOVED_MM if reading.touched is None else reading.touched
        return np.asarray(self.nodes_to_markers @ pressed.astype(float) > 0.5)

    def apparent_over_seen(self, motion_mm: Array, reading: NormalReading) -> float:
        """How much larger the markers' apparent motion should be than the motion that is seen.

        A marker that sinks moves in the picture. A patch that is no contact requires apparent
        motion that the picture does not show, and compensating for it invents a lateral motion,
        which forces would then explain. The ratio is that of the root mean squares over the
        markers in the contact; 0 where none is seen there, or where the camera looks straight
        down on them.
        """
        inside = self._seen_in_contact(motion_mm, reading)
        if not inside.any():
            return 0.0
        w = (self.nodes_to_markers @ reading.w_mm)[inside]
        apparent = self.apparent_per_mm[self.markers][inside] * w[:, None]
        seen = motion_mm[inside, :2] + apparent
        return float(np.sqrt((apparent**2).mean()) / (np.sqrt((seen**2).mean()) + _UNCERTAIN_MM))

    def of_nodes(
        self, motion_mm: Array, reading: NormalReading | None
    ) -> tuple[MarkerInterpolation, Array]:
        """Interpolation without the lost markers, and the nodes' motion (c, 3).

        Raises InterpolationError where too few markers are left to interpolate from.
        """
        values = self._of_all(motion_mm[:, :2], np.nan)
        operator = self.interpolation.with_missing(np.isnan(values).any(axis=1))
        u = np.empty((len(self.points_mm), 3))
        u[:, :2] = operator(values)
        u[:, 2] = reading.w_mm if reading is not None and reading.known else np.nan
        return operator, u

    def moved(self, motion_mm: Array) -> bool:
        """Whether the gel moves laterally somewhere, beyond noise and thermal drift."""
        size = np.hypot(motion_mm[:, 0], motion_mm[:, 1])
        size = size[np.isfinite(size)]
        if len(size) == 0:
            return False
        large = np.partition(size, -_FEWEST)[-_FEWEST] if len(size) > _FEWEST else size.max()
        return bool(large > _MOVED_MM)

    def apparent_motion(self, motion_mm: Array, normal_mm: float, noise_mm: float = 0.0) -> Array:
        """(k, 2) apparent motion of the markers if the gel sinks by `normal_mm` unseen.

        The gel is taken to sink in proportion to its lateral motion, and by no more than three
        times that motion: a press moves the gel around it by about a third of its depth. Motion
        within three standard deviations `noise_mm` of a coordinate is none.
        """
        squared = np.square(np.nan_to_num(motion_mm[:, :2])).sum(axis=1)
        size = np.sqrt(np.maximum(squared - np.square(_NOISE_SIGMAS * noise_mm), 0.0))
        largest = max(float(size.max()), normal_mm / _DEPTH_PER_LATERAL, 1e-9)
        share = self._of_all(size / largest, 0.0)
        return np.asarray(-normal_mm * share[:, None] * self.apparent_per_mm)

    def compensation_change(self, height_mm: Array) -> Array:
        """(k, 2) change of the markers' lateral motion for nodes (c,) that are higher."""
        if self.compensation == "none":
            return np.zeros((self.interpolation.n_markers, 2))
        height = self._of_all(self.nodes_to_markers @ height_mm, 0.0)
        return np.asarray(-height[:, None] * self.apparent_per_mm)

    def of_noise(self, noise_px: Array) -> Array:
        """Motion (c, 3) of the nodes for errors (n, 2) of the positions; no normal motion."""
        motion = np.einsum("kij,kj->ki", self.view.mm_per_px, noise_px)
        lateral = self.interpolation(self._of_all(motion, 0.0))
        return np.column_stack([lateral, np.zeros(len(lateral))])

    def _seen_in_contact(self, motion_mm: Array, reading: NormalReading) -> NDArray[np.bool_]:
        """(n,) markers in the contact whose motion is known; none for an unknown contact."""
        seen = np.isfinite(motion_mm[:, :2]).all(axis=1)
        if not reading.known or reading.touched is None or not reading.touched.any():
            return np.zeros_like(seen)
        return np.asarray(seen & (self.nodes_to_markers @ reading.touched.astype(float) > 0.5))

    def _of_all(self, values: Array, other: float) -> Array:
        """(k, ...) with the values (n, ...) of the followed markers, `other` for the rest."""
        found = np.full((self.interpolation.n_markers, *values.shape[1:]), other)
        found[self.markers] = values
        return found
