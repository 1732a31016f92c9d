"""Blur of a lens focused at one distance while the gel spans many.

A point out of focus by the diameter b is a disc of standard deviation b/4 per axis; its Gaussian
of the same spread stands for it. Discretised by the modified Bessel functions (Lindeberg 1990):
a kernel on whole pixels whose variance is exactly the wanted one, however small, and which is
even, so that no dot's centre moves.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from gelslim_optics.virtual_camera import VirtualCamera
    from gelslim_twin.render.sight import Sight

Array = NDArray[np.float64]
_LEFT_OUT = 1e-4
_LARGEST_PX = 8.0
_TABLE = 321
_LEVELS = 6
_GRID_MM = 1.0


@dataclass(frozen=True)
class Defocus:
    """Entrance pupil `aperture_mm`, focused at `focus_mm`; `still_px` is the blur in focus.

    `still_px` is a standard deviation (aberrations, diffraction, demosaicing). Aperture and
    still blur 0 leave the picture as it is. Raises ValueError for values out of range.
    """

    aperture_mm: float
    focus_mm: float
    still_px: float = 0.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.aperture_mm) and self.aperture_mm >= 0):
            raise ValueError(f"an aperture of {self.aperture_mm} mm: must not be negative")
        if not (np.isfinite(self.focus_mm) and self.focus_mm > 0):
            raise ValueError(f"a focus at {self.focus_mm} mm: must be positive")
        if not 0 <= self.still_px <= _LARGEST_PX:
            raise ValueError(f"still_px = {self.still_px}: must be in 0 ... {_LARGEST_PX:g} px")

    @property
    def is_null(self) -> bool:
        """Whether nothing is blurred."""
        return self.aperture_mm == 0 and self.still_px == 0

    def sigma_px(self, camera: VirtualCamera, points_mm: Array, scale_px_per_mm: Array) -> Array:
        """Standard deviation (n,) in px at points (n, 3) where the picture has that scale (n,)."""
        still = np.full(len(points_mm), self.still_px**2)
        if self.aperture_mm > 0:
            blur = camera.blur_on_gel_mm(points_mm, self.aperture_mm, self.focus_mm)
            still += (blur * scale_px_per_mm / 4) ** 2
        sigma: Array = np.minimum(np.sqrt(still), _LARGEST_PX)
        return sigma

    def soften(
        self, camera: VirtualCamera, sight: Sight, planes: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Blur a still picture (h, w, c) as sharp as each place is, by `blur_map`.

        Between a few blurs of the whole picture, mixed by variance: exact for second moments.
        """
        if self.is_null:
            return planes
        from scipy.ndimage import gaussian_filter

        variance = self._variance_map(camera, sight)
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

    def _variance_map(self, camera: VirtualCamera, sight: Sight) -> Array:
        variance = np.full(sight.rest_mm.shape[:2], self.still_px**2)
        if self.aperture_mm == 0:
            return variance
        from scipy.ndimage import map_coordinates

        x, y = sight.rest_mm[..., 0], sight.rest_mm[..., 1]
        axes = [np.arange(a.min(), a.max() + _GRID_MM, _GRID_MM) for a in (x, y)]
        blur = camera.blur_map(axes[0], axes[1], self.aperture_mm, self.focus_mm)
        places = [(y - axes[1][0]) / _GRID_MM, (x - axes[0][0]) / _GRID_MM]
        seen = map_coordinates(blur, places, order=1, mode="nearest")
        variance += (seen / sight.pixel_mm() / 4) ** 2
        return np.asarray(np.minimum(variance, _LARGEST_PX**2))


def kernel_taps(sigma_px: Array) -> tuple[Array, NDArray[np.int64]]:
    """Half kernels (n, t), middle first, and their reaches (n,); reach 0 where sigma is 0.

    Interpolated in a table over the variance (mixing kernels keeps mean, sum and variance), cut
    where 1e-4 of the weight is left and normalised.
    """
    sigma = np.asarray(sigma_px, dtype=float)
    most = float(sigma.max(initial=0.0))
    if most == 0:
        return np.ones((len(sigma), 1)), np.zeros(len(sigma), dtype=np.int64)
    most = np.ceil(2 * most) / 2
    table = _kernels(float(most))
    reach = table.shape[1] - 1
    place = sigma**2 / most**2 * (_TABLE - 1)
    low = np.minimum(place.astype(int), _TABLE - 2)
    part = (place - low)[:, None]
    taps = (1 - part) * table[low] + part * table[low + 1]
    beyond = 1 - taps[:, :1] - 2 * np.cumsum(np.pad(taps[:, 1:], ((0, 0), (1, 0))), axis=1)
    reaches = np.where(sigma > 0, (beyond > _LEFT_OUT).sum(axis=1), 0)
    taps[np.arange(reach + 1)[None, :] > reaches[:, None]] = 0.0
    taps /= taps[:, :1] + 2 * taps[:, 1:].sum(axis=1, keepdims=True)
    return taps, reaches.astype(np.int64)


@cache
def _kernels(most_px: float) -> Array:
    """Half kernels (table, t) at even steps of variance up to `most_px`²."""
    from scipy.special import ive

    reach = int(np.ceil(3.9 * most_px)) + 1
    variance = np.linspace(0.0, most_px**2, _TABLE)
    return np.asarray(ive(np.arange(reach + 1)[None, :], variance[:, None]))


def a_priori_bound_px(sigma_px: float, light_change_per_px: float) -> float:
    """Bound of a dot's centre error if the blur is left out.

    Where the light changes by the share g per px, blurring dot and light together moves the
    centroid of darkness by g σ²; even light and an even kernel move nothing.
    """
    return abs(light_change_per_px) * sigma_px**2
