"""Sub-pixel centres of printed dots: ratio to the background, connected components, centroids.

The light varies in brightness and colour across the gel, and dots far from the camera are half as
large as near ones. The sum of the colour channels divided by its grey-scale closing does not
depend on the light. Its dark components give position and shape; the centroid of each dot is then
measured in the original picture.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import grey_closing
from scipy.spatial import cKDTree

from gelslim_force.detection.detections import (
    BORDER,
    FAINT,
    LARGE,
    NOT_CONVERGED,
    ODD_SHAPE,
    SMALL,
    Detections,
)
from gelslim_force.detection.settings import DetectorSettings
from gelslim_force.frames.read_only import read_only

_NOISE_FACTOR = 1.5
_MAX_ASPECT = 3.0
_LARGEST = 1.3
"""Diameter of a dot, at most, over that of the largest one expected."""
_NEIGHBOURS = 8
_GIVE_UP = 1.4
"""How far what a search has reached may be beyond what a dot can be, before it ends."""
_SPECK = 0.25
"""Area of a speck, at most, over that of a dot beside it."""
_PALE = 0.7
"""Darkness of the wedge at a corner of the pad, at most, over that of the dots around it."""
_MAX_STEPS = 16
_CONVERGED_PX = 0.01
_EVEN_FILL = 0.85
"""Area of a dot, at least, over that of the ellipse with its moments, to be an ellipse."""
_FLOOR = 8.0
_FIRST_LEVEL, _NEXT_LEVEL = 0.7, 1.6
"""Lowest threshold of darkness as a share of the least contrast, and the factor to the next."""


@dataclass(frozen=True)
class Detector:
    """Finds dots in frames; it has no state and can be shared between threads."""

    settings: DetectorSettings = field(default_factory=DetectorSettings)

    def detect(self, image: NDArray[np.uint8]) -> Detections:
        """Return all dots of a frame (h, w) or (h, w, 3) uint8.

        Raises ValueError if the array is no such frame.
        """
        planes = as_planes(image)
        sums = _channel_sums(planes)
        starts, moments = _candidates(sums, planes.shape, self.settings)
        dots = _measured(sums, planes.shape[1], starts, moments, self.settings)
        dots = dots[_plausible(dots, self.settings)]
        found = _flagged(_without_duplicates(dots))
        if self.settings.shape == "double":
            return found
        return found.take(np.flatnonzero(~_dark_corners(found)))

    def detect_near(
        self,
        image: NDArray[np.uint8],
        positions_px: NDArray[np.float64],
        moments_px2: NDArray[np.float64],
        *,
        compare: bool = True,
    ) -> Detections:
        """Return the dots near predicted positions (n, 2), in that order; faster than `detect`.

        A dot is found if the predicted position is less than about its radius away; otherwise
        `found` is false. If two predictions lead to one dot, the nearer one has it. Centres equal
        those of `detect` within rounding where both find the dot and round its ring alike, as they
        do for nearly all dots; for the others they differ by thousandths of a pixel.

        Args:
            image: The frame, (h, w) or (h, w, 3) uint8.
            positions_px: (n, 2) predicted positions.
            moments_px2: (n, 3) second moments that the dots had before.
            compare: Whether dots are flagged by comparison with their neighbours; without it a
                frame takes a third less time.

        Raises:
            ValueError: The image is no such frame, or an array has another shape.
        """
        from gelslim_force.detection.plausible_kernel import discard_lost

        planes = as_planes(image)
        starts = np.array(positions_px, dtype=float)
        moments = np.array(moments_px2, dtype=float)
        if starts.ndim != 2 or starts.shape[1] != 2 or moments.shape != (len(starts), 3):
            raise ValueError(
                f"positions {starts.shape} and moments {moments.shape} must be (n, 2) and (n, 3)"
            )
        dots = _measured(_channel_sums(planes), planes.shape[1], starts, moments, self.settings)
        discard_lost(dots, starts, moments, _plausible(dots, self.settings))
        return _flagged(dots, compare)


def as_planes(image: Any) -> NDArray[np.uint8]:
    """Return the frame as (h, w, c) with c 1 or 3.

    Raises ValueError if it is no uint8 picture of at least 16 x 16 px.
    """
    if not isinstance(image, np.ndarray) or image.dtype != np.uint8:
        kind = image.dtype if isinstance(image, np.ndarray) else type(image).__name__
        raise ValueError(f"a frame must be a uint8 array, not {kind}; convert it to 0 ... 255")
    if image.ndim == 2:
        image = image[:, :, None]
    if image.ndim != 3 or image.shape[2] not in (1, 3):
        raise ValueError(
            f"a frame must be (h, w) or (h, w, 3), not {image.shape}; drop an alpha channel"
        )
    if min(image.shape[:2]) < 16:
        raise ValueError(
            f"a frame of {image.shape[1]} x {image.shape[0]} px is too small; at least 16 x 16"
        )
    return read_only(image)


def _channel_sums(planes: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Sums of the channels (h, w + LANES), as `window_kernel` needs them."""
    from gelslim_force.detection import darkness_kernel as dk
    from gelslim_force.detection.window_kernel import LANES

    sums = np.empty((planes.shape[0], planes.shape[1] + LANES), dtype=np.uint16)
    dk.channel_sums(planes, sums)
    return sums


def _candidates(
    sums: NDArray[np.uint16], shape: tuple[int, ...], settings: DetectorSettings
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions (n, 2) and second moments (n, 3) of dark components of the size of a dot."""
    from gelslim_force.detection import component_kernel as ck

    least, limit = settings.least_contrast, settings.largest_diameter_px
    table = _components(_darkness(sums, shape, settings), least, limit)
    size = np.pi / 4 * settings.smallest_diameter_px**2
    keep = (table[:, ck.PEAK] > least) & (table[:, ck.AREA] >= 0.4 * size)
    keep &= table[:, ck.AREA] <= 1.3 * np.pi / 4 * limit**2
    table = table[keep]
    floor = settings.smallest_diameter_px**2 / 16
    moments = np.ascontiguousarray(table[:, [ck.XX, ck.XY, ck.YY]])
    moments[:, [0, 2]] = np.maximum(moments[:, [0, 2]], floor)
    return np.ascontiguousarray(table[:, [ck.X, ck.Y]]), moments


def _components(dark: NDArray[np.float32], least: float, limit: float) -> NDArray[np.float64]:
    """Rows of `component_kernel` for regions darker than `least` and narrower than `limit`.

    A wider region, such as a dot in a shadow or two dots that touch, is divided at rising levels.
    """
    from gelslim_force.detection import component_kernel as ck

    runs = ck.whole_rows(*dark.shape)
    kept = np.zeros((0, ck.COLUMNS))
    level = _FIRST_LEVEL * least
    while len(runs) and level < 1.0:
        table, runs, owner = ck.components(dark, runs, level)
        across = table[:, ck.RIGHT] - table[:, ck.LEFT]
        wide = np.maximum(across, table[:, ck.BOTTOM] - table[:, ck.TOP]) >= limit
        kept = np.vstack([kept, table[~wide & (table[:, ck.PEAK] > least)]])
        level = max(_NEXT_LEVEL * level, least)
        wide &= table[:, ck.PEAK] > level
        runs = runs[wide[owner]]
    return kept


def _darkness(
    sums: NDArray[np.uint16], shape: tuple[int, ...], settings: DetectorSettings
) -> NDArray[np.float32]:
    """Return the share of light that is missing at each pixel (h, w) of planes (h, w, c).

    The light is the grey-scale closing of the means of small cells, lightly smoothed. A closing
    keeps every gradient of light and every dark region that is larger than its window, and fills
    smaller dark regions.
    """
    from gelslim_force.detection import darkness_kernel as dk

    height, width, channels = shape
    cell = int(np.clip(settings.largest_diameter_px // 6, 1, min(height, width) // 4))
    means = np.empty((height // cell, width // cell), dtype=np.float32)
    dk.cell_means(sums, cell, means)
    half = int(np.ceil(0.65 * settings.largest_diameter_px / cell)) + 1
    background = _smoothed(grey_closing(means, 2 * half + 1, mode="nearest"))
    dark = np.empty((height, width), dtype=np.float32)
    slack = _NOISE_FACTOR * noise_of(sums[:, :width])
    dk.darkness(sums, background, cell, _FLOOR * channels, slack, dark)
    return dark


def _smoothed(means: NDArray[np.float32]) -> NDArray[np.float32]:
    """Binomial mean of 3 x 3 cells; the border is repeated."""
    padded = np.pad(means, 1, mode="edge").astype(float)
    rows = ((padded[:-2] + 2 * padded[1:-1] + padded[2:]) / 4).astype(np.float32).astype(float)
    return ((rows[:, :-2] + 2 * rows[:, 1:-1] + rows[:, 2:]) / 4).astype(np.float32)


def noise_of(sums: NDArray[np.uint16]) -> float:
    """Return the standard deviation of the noise of a pixel, from second differences along rows.

    The median of |a - 2b + c| is 0.6745 sqrt(6) standard deviations for white noise.
    """
    rows = sums[::11].astype(np.int32)
    second = np.abs(rows[:, :-2:3] - 2 * rows[:, 1:-1:3] + rows[:, 2::3])
    return float(np.median(second)) / (0.6745 * np.sqrt(6.0))


def _measured(
    sums: NDArray[np.uint16],
    width: int,
    starts: NDArray[np.float64],
    moments: NDArray[np.float64],
    settings: DetectorSettings,
) -> NDArray[np.float64]:
    from gelslim_force.detection import centroid_kernel

    dots = np.zeros((len(starts), 10))
    widest = _GIVE_UP * (_LARGEST * settings.largest_diameter_px / 4) ** 2
    faintest = settings.least_contrast / _GIVE_UP
    low, high = settings.weight_from, settings.weight_to
    centroid_kernel.measure(
        sums, width, starts, moments, widest, faintest, low, high, _MAX_STEPS, dots
    )
    return dots


def _axes(dots: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Long and short semi-axes (n,) of the ellipses with the dots' second moments."""
    xx, xy, yy = dots[:, 4:7].T
    middle = (xx + yy) / 2
    spread = np.hypot((xx - yy) / 2, xy)
    return 2 * np.sqrt(middle + spread), 2 * np.sqrt(np.maximum(middle - spread, 0.0))


def _most_aspect(settings: DetectorSettings) -> float:
    """Largest ratio of the semi-axes of a dot."""
    return _MAX_ASPECT * (1.5 if settings.shape == "double" else 1.0)


def _plausible(dots: NDArray[np.float64], settings: DetectorSettings) -> NDArray[np.bool_]:
    """(n,) whether measured dots have the contrast, size and shape of a dot."""
    from gelslim_force.detection.plausible_kernel import plausible

    keep = np.empty(len(dots), dtype=bool)
    plausible(
        dots,
        settings.least_contrast,
        settings.smallest_diameter_px,
        _LARGEST * settings.largest_diameter_px,
        _most_aspect(settings),
        keep,
    )
    return keep


def _without_duplicates(dots: NDArray[np.float64]) -> NDArray[np.float64]:
    """Remove dots that were found from two components, and what lies in another dot.

    Of two dots one of which is a speck, the larger remains; otherwise the darker, because a shadow
    beside a dot is large but pale.
    """
    if len(dots) < 2:
        return dots
    long, _ = _axes(dots)
    area, contrast = dots[:, 2], dots[:, 3]
    drop = np.zeros(len(dots), dtype=bool)
    for a, b in cKDTree(dots[:, :2]).query_pairs(float(1.2 * long.max() + 1)):
        gap = np.hypot(*(dots[a, :2] - dots[b, :2]))
        if gap < max(long[a], long[b]):
            small, large = (a, b) if area[a] < area[b] else (b, a)
            speck = area[small] < _SPECK * area[large]
            drop[small if speck or contrast[small] < contrast[large] else large] = True
    return dots[~drop]


def _dark_corners(found: Detections) -> NDArray[np.bool_]:
    """(n,) whether a region is the dark wedge between a corner of the pad and the border.

    It is cut by the border of the picture, is no ellipse, and is too large or not as dark as the
    dots around it. A double dot that the border cuts looks the same."""
    flags = found.flags
    wedge = (flags & BORDER > 0) & (flags & ODD_SHAPE > 0)
    suspects = np.flatnonzero(wedge)
    if len(found) <= _NEIGHBOURS:
        return np.zeros_like(wedge)
    if len(suspects):
        tree = cKDTree(found.centres_px)
        _, near = tree.query(found.centres_px[suspects], _NEIGHBOURS + 1)
        usual = np.median(found.contrast[near], axis=1)
        pale = found.contrast[suspects] < _PALE * usual
        wedge[suspects] = pale | (flags[suspects] & LARGE > 0)
    return wedge


def _flagged(dots: NDArray[np.float64], compare: bool = True) -> Detections:
    from gelslim_force.detection.plausible_kernel import own_flags

    flags = np.empty(len(dots), dtype=np.int64)
    own_flags(dots, _EVEN_FILL, _CONVERGED_PX, BORDER, ODD_SHAPE, NOT_CONVERGED, flags)
    area, contrast = dots[:, 2], dots[:, 3]
    seen = np.flatnonzero(area > 0)
    if compare and len(seen) > _NEIGHBOURS:
        _, near = cKDTree(dots[seen, :2]).query(dots[seen, :2], _NEIGHBOURS + 1)
        usual_area = np.median(area[seen][near], axis=1)
        usual_contrast = np.median(contrast[seen][near], axis=1)
        flags[seen] |= np.where(area[seen] > 1.6 * usual_area, LARGE, 0)
        flags[seen] |= np.where(area[seen] < 0.5 * usual_area, SMALL, 0)
        flags[seen] |= np.where(contrast[seen] < 0.5 * usual_contrast, FAINT, 0)
    return Detections(
        centres_px=dots[:, :2],
        area_px=area,
        contrast=contrast,
        moments_px2=dots[:, 4:7],
        flags=flags,
    )
