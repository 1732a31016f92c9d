"""Settings of the detector from a picture alone: the size at which most dots form a lattice.

Dirt, texture and the rims of the gel have sizes too, but only the print lies on a lattice. So
the dots are looked for at sizes from 2.5 px up, each half as large again as the last, and the
size that puts most of what it finds on one lattice is refined from the dots on it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gelslim_force.detection.detection import Detector, as_planes
from gelslim_force.detection.detections import Detections
from gelslim_force.detection.settings import DetectorSettings
from gelslim_force.lattice.growth import Lattice, LatticeError, grow_lattice

_SMALLEST_PX, _STEP = 2.5, 1.5
_LARGEST_SHARE = 0.12
"""Largest size tried, of the picture's shorter side: a lattice has several dots across."""
_CONTRASTS = (0.12, 0.05)
_MOST_DOTS = 6000
_LEAST_SHARE = 0.25
"""Share of the dots found that must lie on the lattice; fewer lie on one by chance."""
_MOST_UNEVEN = 0.06
"""Median distance of a dot from where its neighbours predict it, in pitches: printed lattices
have 0.02, dots strewn at random 0.08 and more where they can be strung together at all."""
_DOUBLE_ASPECT = 1.5


@dataclass(frozen=True, eq=False)
class DotEstimate:
    """Settings found for a picture, with what they find in it."""

    settings: DetectorSettings
    detections: Detections
    lattice: Lattice
    diameter_px: tuple[float, float]
    """Smallest and largest extent of the lattice's dots, but for a hundredth at either end."""

    @property
    def on_lattice(self) -> float:
        """Share of the dots found that lie on the lattice."""
        return len(self.lattice.dots) / len(self.detections)


def estimate_settings(image: NDArray[np.uint8]) -> DotEstimate:
    """Return the settings for the dots of a picture (h, w) or (h, w, 3) uint8 without contact.

    Raises LatticeError where no size shows a lattice, ValueError for what is no picture.
    """
    planes = as_planes(image)
    for contrast in _CONTRASTS:
        best = _best_of_ladder(planes, contrast)
        if best is not None:
            for _ in range(2):
                best = _refined(planes, best)
            return best
    height, width = planes.shape[:2]
    raise LatticeError(
        f"no lattice of dots is seen in the picture of {width} x {height} px at any size from "
        f"{_SMALLEST_PX:g} to {_LARGEST_SHARE * min(height, width):.0f} px: is it in focus, lit, "
        "and of a gel with a grid of dark dots?"
    )


def _best_of_ladder(planes: NDArray[np.uint8], contrast: float) -> DotEstimate | None:
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
        size *= _STEP
    return best


def _tried(planes: NDArray[np.uint8], settings: DetectorSettings) -> DotEstimate | None:
    dots = Detector(settings).detect(planes)
    if len(dots) > _MOST_DOTS:
        return None
    try:
        lattice = grow_lattice(dots)
    except LatticeError:
        return None
    # A strip of two lines has no direction, and a few specks make one easily.
    if min(lattice.shape) < 3 or len(lattice.dots) < _LEAST_SHARE * len(dots):
        return None
    known = lattice.residual_px[np.isfinite(lattice.residual_px)]
    if len(known) == 0 or np.median(known) > _MOST_UNEVEN * lattice.pitch_px:
        return None
    thin, long = _diameters(dots.take(lattice.dots))
    extent = (float(np.percentile(thin, 1)), float(np.percentile(long, 99)))
    return DotEstimate(settings, dots, lattice, extent)


def _score(found: DotEstimate) -> float:
    """Dots on the lattice, less where the lattice leaves out much of what was found.

    Halves of double dots, found one by one, lie on a lattice only by the half.
    """
    return float(len(found.lattice.dots) * np.sqrt(found.on_lattice))


def _refined(planes: NDArray[np.uint8], found: DotEstimate) -> DotEstimate:
    """The same for the sizes of the lattice's own dots, if that loses none of them."""
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
