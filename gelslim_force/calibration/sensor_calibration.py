"""What tracking and forces need to know of one built sensor."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_force.calibration.error import CalibrationError
from gelslim_force.detection.detection import Detector
from gelslim_force.detection.detections import Detections
from gelslim_force.detection.settings import DetectorSettings
from gelslim_force.lattice.reference_lattice import ReferenceLattice
from gelslim_force.tracking.tracker import Tracker
from gelslim_optics.camera.virtual_camera import VirtualCamera
from ifem_export.markers.grid import MarkerGrid

if TYPE_CHECKING:
    from gelslim_force.calibration.built_deviation import BuiltDeviation
    from ifem_export.bundle.bundle import Bundle

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Calibration:
    """The built camera, and the n markers found in a reference picture, in order of their ids.

    Attributes:
        camera: The camera as built.
        grid: The print as designed.
        markers: (n,) ids in the grid, and in the bundle.
        dots: The n markers' dots in the reference picture.
        residual_px: (n, 2) seen minus expected centre.
        rest_mm: (n, 2) position of each marker on the gel as seen, errors of the print included.
        detector: Settings with which the dots were found.
        geometry_hash: Of the bundle that this calibration belongs to.
        deviation: Deviation of the built sensor from its design; None if it was not fitted.
        diagnosis: What was found, in sentences.
        warnings: What should be looked at before the calibration is trusted.
        picture: (h, w) or (h, w, 3) uint8, the reference picture upright; None if it was not kept.

    Raises:
        ValueError: The arrays contradict one another.
    """

    camera: VirtualCamera
    grid: MarkerGrid
    markers: NDArray[np.int64]
    dots: Detections
    residual_px: Array
    rest_mm: Array
    detector: DetectorSettings
    geometry_hash: str
    deviation: BuiltDeviation | None = None
    diagnosis: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    picture: NDArray[np.uint8] | None = None

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
            raise ValueError("calibration: marker ids must increase")

    def __len__(self) -> int:
        """Return the number of markers found."""
        return len(self.markers)

    @property
    def reference_px(self) -> Array:
        """(n, 2) centres in the reference picture."""
        return self.dots.centres_px

    @property
    def residual_mm(self) -> Array:
        """(n, 2) position of each marker as seen minus its position in the print."""
        return self.rest_mm - self.grid.positions_mm[self.markers]

    @property
    def missing(self) -> NDArray[np.int64]:
        """Ids of the markers not found."""
        return np.setdiff1d(np.arange(len(self.grid)), self.markers)

    @cached_property
    def reference(self) -> ReferenceLattice:
        """The markers to track; a marker without any neighbour is left out."""
        sites = np.column_stack([self.grid.row, self.grid.column])[self.markers]
        return ReferenceLattice.connected(sites, self.reference_px, self.markers)

    def tracker(self) -> Tracker:
        """Return a tracker of this sensor's markers, at rest."""
        index = np.searchsorted(self.markers, self.reference.markers)
        return Tracker(Detector(self.detector), self.reference, self.dots.take(index), self.grid)

    def require_bundle(self, bundle: Bundle) -> None:
        """Raise CalibrationError for a bundle of another geometry."""
        if bundle.geometry_hash != self.geometry_hash:
            raise CalibrationError(
                "bundle",
                f"the calibration belongs to a sensor of geometry {self.geometry_hash[:12]}, the "
                f"bundle to {bundle.geometry_hash[:12]}: calibrate again with this bundle, or use "
                "the bundle it was made with",
            )
