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
_NEIGHBOURS = 8
_MAX_STEPS = 16
_CONVERGED_PX = 0.01
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
        starts, moments = _candidates(planes, self.settings)
        dots = _measured(planes, starts, moments, self.settings)
        dots = dots[_plausible(dots, self.settings)]
        found = _flagged(_without_duplicates(dots))
        if self.settings.shape == "double":
            return found
        return found.take(np.flatnonzero(~_dark_corners(found.flags)))

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
        those of `detect` where both find the dot.

        Args:
            image: The frame, (h, w) or (h, w, 3) uint8.
            positions_px: (n, 2) predicted positions.
            moments_px2: (n, 3) second moments that the dots had before.
            compare: Whether dots are flagged by comparison with their neighbours; without it a
                frame takes a tenth less time.

        Raises:
            ValueError: The image is no such frame, or an array has another shape.
        """
        planes = as_planes(image)
        starts = np.array(positions_px, dtype=float)
        moments = np.array(moments_px2, dtype=float)
        if starts.ndim != 2 or starts.shape[1] != 2 or moments.shape != (len(starts), 3):
            raise ValueError(
                f"positions {starts.shape} and moments {moments.shape} must be (n, 2) and (n, 3)"
            )
        height, width = planes.shape[:2]
        inside = np.all((starts >= 0) & (starts <= [width - 1, height - 1]), axis=1)
        inside &= np.isfinite(moments).all(axis=1)
        dots = np.zeros((len(starts), 10))
        dots[inside] = _measured(planes, starts[inside], moments[inside], self.settings)
        dots[~inside, :2] = starts[~inside]
        moved = np.hypot(*(dots[:, :2] - starts).T)
        reach = 2.0 * np.sqrt(np.abs(moments).max(axis=1)) + 1.5
        lost = ~_plausible(dots, self.settings) | ~(moved <= reach)
        lost |= _duplicates(dots, moved, lost)
        dots[lost, 2:] = 0.0
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


def _candidates(
    planes: NDArray[np.uint8], settings: DetectorSettings
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions (n, 2) and second moments (n, 3) of dark components of the size of a dot."""
    from gelslim_force.detection import component_kernel as ck

    least, limit = settings.least_contrast, settings.largest_diameter_px
    table = _components(darkness_of(planes, settings), least, limit)
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

    height, width = dark.shape
    boxes = [(0, 0, width, height)]
    kept = np.zeros((0, ck.COLUMNS))
    level = _FIRST_LEVEL * least
    while boxes and level < 1.0:
        table = np.vstack([ck.components(dark, *box, level) for box in boxes])
        across = table[:, ck.RIGHT] - table[:, ck.LEFT]
        wide = np.maximum(across, table[:, ck.BOTTOM] - table[:, ck.TOP]) >= limit
        kept = np.vstack([kept, _new(table[~wide & (table[:, ck.PEAK] > least)], kept)])
        level = max(_NEXT_LEVEL * level, least)
        wide &= table[:, ck.PEAK] > level
        ends = table[wide][:, [ck.LEFT, ck.TOP, ck.RIGHT, ck.BOTTOM]].astype(int)
        ends[:, 2:] += 1
        boxes = [(int(a), int(b), int(c), int(d)) for a, b, c, d in np.unique(ends, axis=0)]
    return kept


def _new(table: NDArray[np.float64], kept: NDArray[np.float64]) -> NDArray[np.float64]:
    """Components that are not in the bounding box of one that was kept at a lower level."""
    from gelslim_force.detection import component_kernel as ck

    if len(table) == 0 or len(kept) == 0:
        return table
    _, near = cKDTree(kept[:, [ck.X, ck.Y]]).query(table[:, [ck.X, ck.Y]])
    box = kept[near]
    inside = (table[:, ck.X] >= box[:, ck.LEFT]) & (table[:, ck.X] <= box[:, ck.RIGHT])
    inside &= (table[:, ck.Y] >= box[:, ck.TOP]) & (table[:, ck.Y] <= box[:, ck.BOTTOM])
    return table[~inside]


def darkness_of(planes: NDArray[np.uint8], settings: DetectorSettings) -> NDArray[np.float32]:
    """Return the share of light that is missing at each pixel (h, w).

    The light is the grey-scale closing of the means of small cells, lightly smoothed. A closing
    keeps every gradient of light and every dark region that is larger than its window, and fills
    smaller dark regions.
    """
    from gelslim_force.detection import darkness_kernel as dk

    height, width, channels = planes.shape
    sums = np.empty((height, width), dtype=np.uint16)
    dk.channel_sums(planes, sums)
    cell = int(np.clip(settings.largest_diameter_px // 6, 1, min(height, width) // 4))
    means = np.empty((height // cell, width // cell), dtype=np.float32)
    dk.cell_means(sums, cell, means)
    half = int(np.ceil(0.65 * settings.largest_diameter_px / cell)) + 1
    background = _smoothed(grey_closing(means, 2 * half + 1, mode="nearest"))
    dark = np.empty((height, width), dtype=np.float32)
    slack = _NOISE_FACTOR * noise_of(sums)
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
    planes: NDArray[np.uint8],
    starts: NDArray[np.float64],
    moments: NDArray[np.float64],
    settings: DetectorSettings,
) -> NDArray[np.float64]:
    from gelslim_force.detection import centroid_kernel

    dots = np.zeros((len(starts), 10))
    centroid_kernel.measure(
        planes, starts, moments, settings.weight_from, settings.weight_to, _MAX_STEPS, dots
    )
    return dots


def _axes(dots: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Long and short semi-axes (n,) of the ellipses with the dots' second moments."""
    xx, xy, yy = dots[:, 4:7].T
    middle = (xx + yy) / 2
    spread = np.hypot((xx - yy) / 2, xy)
    return 2 * np.sqrt(middle + spread), 2 * np.sqrt(np.maximum(middle - spread, 0.0))


def _plausible(dots: NDArray[np.float64], settings: DetectorSettings) -> NDArray[np.bool_]:
    long, short = _axes(dots)
    area = dots[:, 2]
    keep = (area > 0) & (dots[:, 3] >= settings.least_contrast)
    keep &= area >= 0.6 * np.pi / 4 * settings.smallest_diameter_px**2
    keep &= 2 * long <= 1.3 * settings.largest_diameter_px
    aspect = _MAX_ASPECT * (1.5 if settings.shape == "double" else 1.0)
    keep &= long <= aspect * np.maximum(short, 0.5)
    return keep & (area >= 0.55 * np.pi * long * short)


def _duplicates(
    dots: NDArray[np.float64], moved: NDArray[np.float64], lost: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """(n,) whether the same dot was also found from a nearer prediction."""
    twice = np.zeros(len(dots), dtype=bool)
    live = np.flatnonzero(~lost)
    if len(live) < 2:
        return twice
    for a, b in cKDTree(dots[live, :2]).query_pairs(1.0):
        a, b = live[a], live[b]
        twice[a if moved[a] > moved[b] else b] = True
    return twice


def _without_duplicates(dots: NDArray[np.float64]) -> NDArray[np.float64]:
    """Remove dots that were found from two components, and specks near a larger dot."""
    if len(dots) < 2:
        return dots
    long, _ = _axes(dots)
    drop = np.zeros(len(dots), dtype=bool)
    for a, b in cKDTree(dots[:, :2]).query_pairs(float(1.2 * long.max() + 1)):
        gap = np.hypot(*(dots[a, :2] - dots[b, :2]))
        if gap < max(long[a], long[b]):
            drop[a if dots[a, 2] < dots[b, 2] else b] = True
    return dots[~drop]


def _dark_corners(flags: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(n,) whether a region is the dark wedge between a corner of the pad and the border.

    It is cut by the border of the picture, is no ellipse, and is too faint or too large for a
    dot. A double dot that the border cuts looks the same."""
    cut = (flags & BORDER > 0) & (flags & ODD_SHAPE > 0)
    return np.asarray(cut & (flags & (FAINT | LARGE) > 0))


def _flagged(dots: NDArray[np.float64], compare: bool = True) -> Detections:
    area, contrast = dots[:, 2], dots[:, 3]
    flags = np.zeros(len(dots), dtype=np.int64)
    seen = np.flatnonzero(area > 0)
    if compare and len(seen) > _NEIGHBOURS:
        _, near = cKDTree(dots[seen, :2]).query(dots[seen, :2], _NEIGHBOURS + 1)
        usual_area = np.median(area[seen][near], axis=1)
        usual_contrast = np.median(contrast[seen][near], axis=1)
        flags[seen] |= np.where(area[seen] > 1.6 * usual_area, LARGE, 0)
        flags[seen] |= np.where(area[seen] < 0.5 * usual_area, SMALL, 0)
        flags[seen] |= np.where(contrast[seen] < 0.5 * usual_contrast, FAINT, 0)
    long, short = _axes(dots)
    with np.errstate(invalid="ignore"):
        flags |= np.where((area > 0) & (area < 0.85 * np.pi * long * short), ODD_SHAPE, 0)
    flags |= np.where((area > 0) & (dots[:, 8] < 1.0), BORDER, 0)
    flags |= np.where((area > 0) & (dots[:, 9] > _CONVERGED_PX), NOT_CONVERGED, 0)
    return Detections(
        centres_px=dots[:, :2],
        area_px=area,
        contrast=contrast,
        moments_px2=dots[:, 4:7],
        flags=flags,
    )
