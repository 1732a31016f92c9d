"""What tracking and forces need to know about one built sensor."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration.design import bundle_camera, marker_heights_mm
from gelslim_force.calibration.error import CalibrationError
from gelslim_force.detection.detection import Detector
from gelslim_force.detection.detections import Detections
from gelslim_force.detection.disc_centroid import centroid_offset_px
from gelslim_force.detection.settings import DetectorSettings
from gelslim_force.lattice.bundle_grid import bundle_grid
from gelslim_force.lattice.reference_lattice import ReferenceLattice
from gelslim_force.tracking.tracker import Tracker, TrackerSettings
from gelslim_optics.camera.back_projection import pixel_slopes
from gelslim_optics.camera.rays import points_along
from gelslim_optics.camera.virtual_camera import VirtualCamera
from ifem_export.markers.grid import MarkerGrid

if TYPE_CHECKING:
    from gelslim_force.calibration.built_deviation import BuiltDeviation
    from gelslim_force.lattice.registration import Registration
    from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]
_REACH = 2
"""Sites within which a marker needs another to be tracked."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """The built camera and the n markers found in a no-contact frame, in order of their ids.

    Raises ValueError where arrays disagree.
    """

    camera: VirtualCamera
    """As built; as designed in a nominal calibration."""
    grid: MarkerGrid
    markers: NDArray[np.int64]
    """(n,) ids in the grid, and in the bundle."""
    dots: Detections
    """The n markers' dots in the no-contact frame."""
    residual_px: Array
    """(n, 2) seen minus expected centre."""
    rest_mm: Array
    """(n, 2) where each marker is on the gel, as seen: the print's own errors included."""
    detector: DetectorSettings
    geometry_hash: str
    """Of the bundle that this calibration belongs to."""
    deviation: BuiltDeviation | None = None
    """None in a nominal calibration."""
    diagnosis: tuple[str, ...] = ()
    """Lines for people."""
    warnings: tuple[str, ...] = ()
    """What deserves a look before the calibration is trusted."""

    def __post_init__(self) -> None:
        count = len(self.markers)
        shapes = {"markers": (count,), "residual_px": (count, 2), "rest_mm": (count, 2)}
        for name, shape in shapes.items():
            array = np.array(getattr(self, name))
            array = array.astype(np.int64 if name == "markers" else np.float64)
            if array.shape != shape or not np.isfinite(array).all():
                raise ValueError(f"calibration: {name} {array.shape} must be {shape} and finite")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if len(self.dots) != count:
            raise ValueError(f"calibration: {len(self.dots)} dots for {count} markers")
        if count and (self.markers.min() < 0 or self.markers.max() >= len(self.grid)):
            raise ValueError(
                f"calibration: a marker id is not among the {len(self.grid)} of the print"
            )
        if np.any(np.diff(self.markers) <= 0):
            raise ValueError("calibration: marker ids must rise")

    def __len__(self) -> int:
        """Return the number of markers found."""
        return len(self.markers)

    @property
    def reference_px(self) -> Array:
        """(n, 2) centres in the no-contact frame."""
        return self.dots.centres_px

    @property
    def residual_mm(self) -> Array:
        """(n, 2) where each marker is minus where the print has it."""
        return self.rest_mm - self.grid.positions_mm[self.markers]

    @property
    def missing(self) -> NDArray[np.int64]:
        """Ids of the markers not found."""
        return np.setdiff1d(np.arange(len(self.grid)), self.markers)

    @cached_property
    def reference(self) -> ReferenceLattice:
        """The markers to track; one without any neighbour is left out."""
        sites = np.column_stack([self.grid.row, self.grid.column])[self.markers]
        apart = np.abs(sites[:, None, :] - sites[None, :, :]).max(axis=2)
        keep = (apart <= _REACH).sum(axis=1) > 1
        return ReferenceLattice(
            sites=sites[keep], positions_px=self.reference_px[keep], markers=self.markers[keep]
        )

    def tracker(self, settings: TrackerSettings | None = None) -> Tracker:
        """Return a tracker of this sensor's markers, at rest."""
        index = np.searchsorted(self.markers, self.reference.markers)
        return Tracker(
            Detector(self.detector), self.reference, self.dots.take(index), self.grid, settings
        )

    def require_bundle(self, bundle: Bundle) -> None:
        """Raise CalibrationError for a bundle of another geometry."""
        if bundle.geometry_hash != self.geometry_hash:
            raise CalibrationError(
                f"the calibration belongs to a sensor of geometry {self.geometry_hash[:12]}, the "
                f"bundle to {bundle.geometry_hash[:12]}: calibrate again with this bundle, or use "
                "the bundle it was made with"
            )

    @classmethod
    def nominal(
        cls,
        bundle: Bundle,
        registration: Registration,
        detections: Detections,
        detector: Detector | None = None,
    ) -> Calibration:
        """Take the design's camera as built, with the markers of a registered frame."""
        grid, camera = bundle_grid(bundle), bundle_camera(bundle)
        found = np.flatnonzero(registration.found)
        dots = detections.take(registration.dots[found])
        points, diameter = grid.positions_mm[found], grid.diameter_mm[found]
        offset = centroid_offset_px(camera, points, diameter)
        heights = marker_heights_mm(bundle)[found]
        at_rest = np.column_stack([points, heights])
        slopes = pixel_slopes(camera, dots.centres_px - offset)
        return cls(
            camera=camera,
            grid=grid,
            markers=found,
            dots=dots,
            residual_px=dots.centres_px - offset - camera.project(at_rest),
            rest_mm=points_along(camera, slopes, heights)[:, :2],
            detector=(detector or Detector(expected_dots(camera, grid))).settings,
            geometry_hash=bundle.geometry_hash,
            diagnosis=("The design's camera, not fitted to this sensor.",),
        )


def expected_dots(camera: VirtualCamera, grid: MarkerGrid) -> DetectorSettings:
    """Return a detector's settings for the sizes at which the camera sees the print."""
    flat = np.column_stack([grid.positions_mm, np.zeros(len(grid))])
    stretch = np.linalg.svd(camera.jacobian(flat), compute_uv=False)
    return DetectorSettings.for_diameters((stretch * grid.diameter_mm[:, None]).ravel())
