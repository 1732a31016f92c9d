"""Detector settings estimated from one picture: the dot size at which most dots form a lattice.

Dirt, texture and the border of the gel are found as dots too, but only printed dots lie on a
lattice. The detector is tried with sizes from 2.5 px on, each 1.5 times the last. The size with
which most dots lie on one lattice is then refined by the measured sizes of these dots.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gelslim_force.detection.detection import Detector, as_planes
from gelslim_force.detection.detections import Detections
from gelslim_force.detection.settings import DetectorSettings
from gelslim_force.lattice.growth import Lattice, LatticeError, grow_lattice

_SMALLEST_PX, _RATIO = 2.5, 1.5
_LARGEST_SHARE = 0.12
"""Largest size that is tried, as a share of the shorter side of the picture."""
_CONTRASTS = (0.12, 0.05)
_MAX_DOTS = 6000
_MIN_SHARE = 0.25
"""Share of the dots that must lie on the lattice; a smaller share may do so by chance."""
_MAX_RESIDUAL = 0.06
"""Median distance of a dot from the position its neighbours predict, in pitches: 0.02 in printed
lattices, 0.08 or more in lattices that random dots happen to form."""
_DOUBLE_ASPECT = 1.5
"""Length over width above which dots are taken to be double."""


@dataclass(frozen=True, eq=False)
class DotEstimate:
    """Estimated settings, and the dots and the lattice that they find in the picture."""

    settings: DetectorSettings
    detections: Detections
    lattice: Lattice
    diameter_px: tuple[float, float]
    """1st and 99th percentile of the diameters of the dots on the lattice."""

    @property
    def on_lattice(self) -> float:
        """Share of the dots that lie on the lattice."""
        return len(self.lattice.dots) / len(self.detections)


def estimate_settings(image: NDArray[np.uint8]) -> DotEstimate:
    """Return the settings for the dots of a picture (h, w) or (h, w, 3) uint8 without contact.

    Raises LatticeError if no size shows a lattice, ValueError if the array is no picture.
    """
    planes = as_planes(image)
    for contrast in _CONTRASTS:
        best = _best_of_sizes(planes, contrast)
        if best is not None:
            for _ in range(2):
                best = _refined(planes, best)
            return best
    height, width = planes.shape[:2]
    raise LatticeError(
        f"no lattice of dots is found in the picture of {width} x {height} px at any size from "
        f"{_SMALLEST_PX:g} to {_LARGEST_SHARE * min(height, width):.0f} px: is it in focus and "
        "well lit, and does it show a gel with a grid of dark dots?"
    )


def _best_of_sizes(planes: NDArray[np.uint8], contrast: float) -> DotEstimate | None:
    best: DotEstimate | None = None
    size = _SMALLEST_PX
    while size < _LARGEST_SHARE * min(planes.shape[:2]):
        settings = DetectorSettings(
            smallest_diameter_px=max(1.0, size / 2),
            largest_diameter_px=2 * size,
            least_contrast=contrast,
            shape="double",
        )
        found = _tried(planes, settings)
        if found is not None and (best is None or _score(found) > _score(best)):
            best = found
        size *= _RATIO
    return best


def _tried(planes: NDArray[np.uint8], settings: DetectorSettings) -> DotEstimate | None:
    dots = Detector(settings).detect(planes)
    if len(dots) > _MAX_DOTS:
        return None
    try:
        lattice = grow_lattice(dots)
    except LatticeError:
        return None
    # Two lines of dots have no direction, and a few specks easily form them.
    if min(lattice.shape) < 3 or len(lattice.dots) < _MIN_SHARE * len(dots):
        return None
    known = lattice.residual_px[np.isfinite(lattice.residual_px)]
    if len(known) == 0 or np.median(known) > _MAX_RESIDUAL * lattice.pitch_px:
        return None
    thin, long = _diameters(dots.take(lattice.dots))
    extent = (float(np.percentile(thin, 1)), float(np.percentile(long, 99)))
    return DotEstimate(settings, dots, lattice, extent)


def _score(found: DotEstimate) -> float:
    """Number of dots on the lattice, reduced if many dots do not lie on it.

    If the halves of double dots are found one by one, only one half of each lies on a lattice.
    """
    return float(len(found.lattice.dots) * np.sqrt(found.on_lattice))


def _refined(planes: NDArray[np.uint8], found: DotEstimate) -> DotEstimate:
    """Estimate again with the sizes of the dots on the lattice; keep the better estimate."""
    dots = found.detections.take(found.lattice.dots)
    thin, long = _diameters(dots)
    double = float(np.median(long / thin) ** 2) > _DOUBLE_ASPECT
    fitted = DetectorSettings.for_diameters(
        np.array(found.diameter_px), "double" if double else "round"
    )
    settings = replace(fitted, least_contrast=found.settings.least_contrast)
    tried = _tried(planes, settings)
    return found if tried is None or _score(tried) < _score(found) else tried


def _diameters(dots: Detections) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(n,) diameters of the discs of the same area, and (n,) extents along the long axes."""
    xx, xy, yy = dots.moments_px2.T
    long = 4 * np.sqrt((xx + yy) / 2 + np.hypot((xx - yy) / 2, xy))
    thin = np.sqrt(4 * dots.area_px / np.pi)
    return thin, np.maximum(long, thin)
