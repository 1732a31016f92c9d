"""Defocus: the lens is focused at one distance, but the gel spans a range of distances.

A blur disc of diameter b has the standard deviation b/4 per axis and is replaced by a Gaussian of
the same variance. The discrete kernel consists of modified Bessel functions (Lindeberg 1990). Its
variance is exact even for small blurs, and it is even, so that centroids do not move.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.camera.back_projection import HeightGrid
from gelslim_optics.camera.view_quality import blur_map

if TYPE_CHECKING:
    from gelslim_optics.camera.virtual_camera import VirtualCamera
    from gelslim_twin.render.surroundings import Sight

Array = NDArray[np.float64]
LEFT_OUT = 1e-4
"""Weight at which a kernel is truncated."""
LARGEST_PX = 8.0
"""Largest standard deviation of a blur."""
TABLE = 321
"""Variances of a table of kernels."""
_LEVELS = 6
_NODES = 49
SUNKEN_MM = 0.5
"""Depth of the second height of a `BlurField`."""


@dataclass(frozen=True)
class Defocus:
    """Defocus of a lens with entrance pupil `aperture_mm`, focused at `focus_mm`.

    `still_px` is the standard deviation of the blur in focus (aberrations, diffraction,
    demosaicing). If both blurs are 0, the picture does not change.
    """

    aperture_mm: float
    focus_mm: float
    still_px: float = 0.0

    @property
    def is_null(self) -> bool:
        """Whether nothing is blurred."""
        return self.aperture_mm == 0 and self.still_px == 0

    def sigma_px(self, field: BlurField, points_mm: Array, scale_px_per_mm: Array) -> Array:
        """Standard deviation (n,) in px at points (n, 3) where the picture has that scale (n,)."""
        spread = field.at(points_mm[:, 0], points_mm[:, 1], points_mm[:, 2]) * scale_px_per_mm / 4
        sigma: Array = np.minimum(np.sqrt(self.still_px**2 + spread**2), LARGEST_PX)
        return sigma

    def soften(
        self, field: BlurField, sight: Sight, planes: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Blur the constant part (h, w, c) of a picture by the local blur at rest.

        The result is interpolated by variance between a few uniform blurs, which is exact for
        second moments.
        """
        if self.is_null:
            return planes
        from scipy.ndimage import gaussian_filter

        x, y = sight.rest_mm[..., 0], sight.rest_mm[..., 1]
        spread = field.at(x, y, 0.0) / sight.pixel_mm() / 4
        variance = np.minimum(self.still_px**2 + spread**2, LARGEST_PX**2)
        levels = np.linspace(variance.min(), variance.max(), _LEVELS)
        if np.ptp(levels) < 1e-3:
            levels = levels[:1]
        done = [gaussian_filter(planes, (np.sqrt(v), np.sqrt(v), 0), truncate=4.0) for v in levels]
        if len(done) == 1:
            return np.ascontiguousarray(done[0], dtype=np.float32)
        place = (variance - levels[0]) / (levels[1] - levels[0])
        out = np.zeros_like(planes)
        for number, blurred in enumerate(done):
            share = np.clip(1 - np.abs(place - number), 0, 1)
            out += share[..., None].astype(np.float32) * blurred
        return out


@dataclass(frozen=True)
class BlurField:
    """Blur diameter over the pad at two heights, interpolated linearly between them.

    Outside the grid, which extends half a pad beyond the pad, the value at its edge is used.
    """

    level: HeightGrid
    sunken: HeightGrid

    @classmethod
    def of(
        cls, camera: VirtualCamera, aperture_mm: float, focus_mm: float, pad_mm: tuple[float, float]
    ) -> BlurField:
        """The field of a lens of pupil `aperture_mm` focused at `focus_mm`."""
        x, y = (np.linspace(-side, side, _NODES) for side in pad_mm)
        if aperture_mm == 0:
            sharp = HeightGrid(x, y, np.zeros((_NODES, _NODES)))
            return cls(sharp, sharp)
        maps = [blur_map(camera, x, y, aperture_mm, focus_mm, z) for z in (0.0, -SUNKEN_MM)]
        return cls(HeightGrid(x, y, maps[0]), HeightGrid(x, y, maps[1]))

    def at(self, x_mm: Array, y_mm: Array, z_mm: Array | float) -> Array:
        """Blur diameter in mm at points of any shape."""
        level = self.level(x_mm, y_mm)
        change = self.sunken(x_mm, y_mm) - level if np.any(z_mm) else 0.0
        blur: Array = np.maximum(level - np.asarray(z_mm) / SUNKEN_MM * change, 0.0)
        return blur


def kernel_taps(sigma_px: Array) -> tuple[Array, NDArray[np.int64]]:
    """Half kernels (n, t), centre first, and their radii (n,) in px; radius 0 where sigma is 0.

    They are interpolated in a table over the variance, which preserves mean, sum and variance,
    truncated where 1e-4 of the weight is left, and normalised.
    """
    sigma = np.asarray(sigma_px, dtype=float)
    most = float(sigma.max(initial=0.0))
    if most == 0:
        return np.ones((len(sigma), 1)), np.zeros(len(sigma), dtype=np.int64)
    most = np.ceil(2 * most) / 2
    table = kernel_table(float(most))
    reach = table.shape[1] - 1
    place = sigma**2 / most**2 * (TABLE - 1)
    low = np.minimum(place.astype(int), TABLE - 2)
    part = (place - low)[:, None]
    taps = (1 - part) * table[low] + part * table[low + 1]
    beyond = 1 - taps[:, :1] - 2 * np.cumsum(np.pad(taps[:, 1:], ((0, 0), (1, 0))), axis=1)
    reaches = np.where(sigma > 0, (beyond > LEFT_OUT).sum(axis=1), 0)
    taps[np.arange(reach + 1)[None, :] > reaches[:, None]] = 0.0
    taps /= taps[:, :1] + 2 * taps[:, 1:].sum(axis=1, keepdims=True)
    return taps, reaches.astype(np.int64)


@cache
def kernel_table(most_px: float) -> Array:
    """Half kernels (table, t) at equal steps of variance up to `most_px`²."""
    from scipy.special import ive

    reach = int(np.ceil(3.9 * most_px)) + 1
    variance = np.linspace(0.0, most_px**2, TABLE)
    return np.asarray(ive(np.arange(reach + 1)[None, :], variance[:, None]))
