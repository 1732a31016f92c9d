"""Directions from which light reaches the gel's face, and how a slope changes it there.

A ray along d that brings the flux w through a level face with normal n brings w max(0, 1 - τ·s) /
sqrt(1 + s·s) to a facet of slope s, with the tangent τ of d / (d·n) in the face; where τ·s > 1 the
facet is in its own shadow. Rays of nearby directions are summed with their mean tangent, which is
exact for slopes that shade all or none of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
STEEPEST = 2.5
"""Largest slope of the tables, 68°; steeper facets count as this steep."""
_STEPS = 20
"""Of a table, from level to the largest slope."""
_FAINT = 1e-3
"""Share of the mean light below which the light of a place has the directions of the whole pad."""


@dataclass(frozen=True, eq=False)
class LightFans:
    """Light of k sources by direction, at places in even steps over the pad.

    Attributes:
        sums: (k, py, px, b, 3) share of the light of a source at a place in each of b bins of
            direction, and its products with the tangent along x and y. The shares sum to 1.
        lower_mm: (2,) corner of the pad in x and y.
        upper_mm: (2,) the opposite corner.

    Raises:
        ValueError: The shape is another, or shares are negative or do not sum to 1.
    """

    sums: Array
    lower_mm: tuple[float, float]
    upper_mm: tuple[float, float]

    def __post_init__(self) -> None:
        sums = np.asarray(self.sums, dtype=float)
        object.__setattr__(self, "sums", sums)
        if sums.ndim != 5 or sums.shape[-1] != 3 or not np.isfinite(sums).all():
            raise ValueError(f"fans of light {sums.shape}: must be (k, py, px, b, 3) and finite")
        share = sums[..., 0]
        if share.min() < 0 or np.abs(share.sum(axis=-1) - 1).max() > 1e-4:
            raise ValueError("shares in a fan of light must not be negative, and must sum to 1")

    @classmethod
    def of_trace(cls, fans: Array, size_mm: tuple[float, float]) -> LightFans:
        """From the tallies (k, px, py, azimuth, elevation, 3) of a tracer on a pad of a size.

        Raises ValueError for a source without light.
        """
        by_place = np.moveaxis(fans, 1, 2).reshape(len(fans), *fans.shape[2:0:-1], -1, 3)
        whole = by_place.mean(axis=(1, 2), keepdims=True)
        light = by_place[..., 0].sum(axis=-1)[..., None, None]
        mean = light.mean(axis=(1, 2), keepdims=True)
        if not (mean > 0).all():
            raise ValueError("a source of light does not reach the gel")
        chosen = np.where(light > _FAINT * mean, by_place, whole)
        sums = chosen / chosen[..., 0].sum(axis=-1)[..., None, None]
        used = sums[..., 0].any(axis=(0, 1, 2))
        half = size_mm[0] / 2, size_mm[1] / 2
        return cls(sums[..., used, :], (-half[0], -half[1]), half)

    def gain(self, slope: tuple[float, float]) -> Array:
        """Irradiance (k, py, px) of facets of one slope along x and y, over that of level ones."""
        shade = self.sums[..., 1] * slope[0] + self.sums[..., 2] * slope[1]
        lit = np.maximum(self.sums[..., 0] - shade, 0.0).sum(axis=-1)
        return np.asarray(lit / np.sqrt(1 + slope[0] ** 2 + slope[1] ** 2))

    @cached_property
    def tables(self) -> NDArray[np.float32]:
        """(k, py, px, n, n) gains times sqrt(1 + s·s), by even steps of the slope along y, then x.

        Slopes are from -2.5 to 2.5. Without shadows the values are linear in them.
        """
        axis = np.linspace(-STEEPEST, STEEPEST, 2 * _STEPS + 1)
        found = np.empty((*self.sums.shape[:3], len(axis), len(axis)), dtype=np.float32)
        for j, along_y in enumerate(axis):
            unshaded = self.sums[..., 0] - self.sums[..., 2] * along_y
            shade = self.sums[..., 1, None] * axis
            found[..., j, :] = np.maximum(unshaded[..., None] - shade, 0.0).sum(axis=-2)
        found[..., _STEPS, _STEPS] = 1.0
        return found
