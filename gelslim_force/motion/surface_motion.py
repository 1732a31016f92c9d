"""Motion of the surface nodes from that of the markers, for one sensor."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gelslim_force.contact.indenter_source import NormalReading
from gelslim_force.motion.marker_motion import Compensation, MarkerView
from gelslim_optics.camera.projection_error import projection_error_mm
from ifem_export.markers.interpolation import marker_to_node
from ifem_export.markers.interpolation_matrix import FilledInterpolation

Array = NDArray[np.float64]
_SMALL_MM = 1e-3
_MOVED_MM = 0.03
_UNSURE_MM = 0.01
_FEW = 4
"""Markers that must move: one or two may be mistaken."""


@dataclass(frozen=True, eq=False)
class SurfaceMotion:
    """n followed markers of the sensor's k, and the c nodes of its surface."""

    view: MarkerView
    markers: NDArray[np.int64]
    """(n,) ids among the sensor's markers."""
    interpolation: FilledInterpolation
    """From all k markers to the nodes."""
    points_mm: Array
    """(c, 3) nodes at rest."""
    compensation: Compensation = "exact"

    @cached_property
    def nodes_to_markers(self) -> Any:
        """(n, c) bilinear."""
        return marker_to_node(self.points_mm, self.view.rest_mm)

    @cached_property
    def apparent_per_mm(self) -> Array:
        """(k, 2) sideways motion that a marker seems to make per mm along z; 0 if not followed."""
        seen = projection_error_mm(self.view.camera, self.view.rest_mm, _SMALL_MM) / _SMALL_MM
        return self._of_all(seen, 0.0)

    def of_markers(self, places_px: Array, reading: NormalReading | None) -> Array:
        """Motion (n, 3) in mm for places (n, 2); z is NaN where the normal motion is unknown."""
        if reading is None or not reading.known:
            lateral = self.view.lateral_motion(places_px, 0.0, self.compensation)
            return np.column_stack([lateral, np.full(len(lateral), np.nan)])
        height = self.nodes_to_markers @ reading.w_mm
        return np.column_stack(
            [self.view.lateral_motion(places_px, height, self.compensation), height]
        )

    def of_touched(self, motion_mm: Array, reading: NormalReading) -> Array | None:
        """Mean lateral motion (2,) of the markers in the contact; None where none is seen there."""
        if not reading.known or reading.touched is None or not reading.touched.any():
            return None
        near = self.nodes_to_markers @ reading.touched.astype(float) > 0.5
        seen = motion_mm[near, :2]
        seen = seen[np.isfinite(seen).all(axis=1)]
        return seen.mean(axis=0) if len(seen) else None

    def overdone(self, motion_mm: Array, reading: NormalReading) -> float:
        """How much farther the markers in the contact should seem to move, by their normal motion
        alone, than they do; 0 where none is seen there, or the camera looks straight on.

        What sinks moves in the picture. A patch that is none asks for a motion that nobody sees,
        and compensating for it invents a lateral motion that forces then explain.
        """
        if not reading.known or reading.touched is None or not reading.touched.any():
            return 0.0
        near = self.nodes_to_markers @ reading.touched.astype(float) > 0.5
        near &= np.isfinite(motion_mm[:, 0])
        if not near.any():
            return 0.0
        height = (self.nodes_to_markers @ reading.w_mm)[near]
        apparent = self.apparent_per_mm[self.markers][near] * height[:, None]
        shown = motion_mm[near, :2] + apparent
        return float(np.sqrt((apparent**2).mean()) / (np.sqrt((shown**2).mean()) + _UNSURE_MM))

    def of_nodes(
        self, motion_mm: Array, reading: NormalReading | None
    ) -> tuple[FilledInterpolation, Array]:
        """Interpolation without the lost markers, and the nodes' motion (c, 3).

        Raises InterpolationError where the markers left carry no field.
        """
        values = self._of_all(motion_mm[:, :2], np.nan)
        operator = self.interpolation.with_missing(np.isnan(values).any(axis=1))
        u = np.empty((len(self.points_mm), 3))
        u[:, :2] = operator(values)
        u[:, 2] = reading.w_mm if reading is not None and reading.known else np.nan
        return operator, u

    def moved(self, motion_mm: Array) -> bool:
        """Whether the gel moves sideways somewhere, beyond what noise and a drift of heat make."""
        size = np.hypot(motion_mm[:, 0], motion_mm[:, 1])
        size = size[np.isfinite(size)]
        if len(size) == 0:
            return False
        far = np.partition(size, -_FEW)[-_FEW] if len(size) > _FEW else size.max()
        return bool(far > _MOVED_MM)

    def apparent_motion(self, motion_mm: Array, normal_mm: float) -> Array:
        """(k, 2) motion that markers seem to make if the gel sinks by `normal_mm` unseen.

        Where the gel moves sideways it is taken to sink too, in proportion, and by no more than
        three times as far: a press moves the gel beside it by about a third of its depth.
        """
        size = np.nan_to_num(np.hypot(motion_mm[:, 0], motion_mm[:, 1]))
        share = self._of_all(size / max(float(size.max()), normal_mm / 3, 1e-9), 0.0)
        return np.asarray(-normal_mm * share[:, None] * self.apparent_per_mm)

    def covariance_mm2(self, known: NDArray[np.bool_], noise_px: float) -> Array:
        """(k, 2, 2) of the markers' motion for noise of their places; 0 where not seen."""
        scale = self.view.mm_per_px
        spread = noise_px**2 * scale @ scale.transpose(0, 2, 1)
        spread[~known] = 0.0
        return self._of_all(spread, 0.0)

    def of_noise(self, noise_px: Array) -> Array:
        """Motion (c, 3) of the nodes for places (n, 2) off by `noise_px`; no normal motion."""
        motion = np.einsum("kij,kj->ki", self.view.mm_per_px, noise_px)
        lateral = self.interpolation(self._of_all(motion, 0.0))
        return np.column_stack([lateral, np.zeros(len(lateral))])

    def _of_all(self, values: Array, other: float) -> Array:
        found = np.full((self.interpolation.n_markers, *values.shape[1:]), other)
        found[self.markers] = values
        return found
