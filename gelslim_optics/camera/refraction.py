"""Exact refraction through flat layers.

A ray that leaves the camera in air at the angle θ0 from the normal of the layers crosses layer i at
sin θi = sin θ0 / ni and reaches r(θ0) = Σ hi tan θi sideways (Snell's law). With t = tan θ0 this is

    r(t) = Σ hi t / sqrt(ni² + (ni² - 1) t²),

a sum of positive terms without cancellation, from the normal ray to grazing incidence.
`refraction_newton.newton_slope` inverts it; `rays.ray_slope` also checks its input.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gelslim_optics.camera.refraction_newton import apparent_height, slope_ratio

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Layer:
    """A flat layer of a transparent medium above the air.

    Attributes:
        thickness_mm: Thickness in mm.
        index: Refractive index relative to air.

    Raises:
        ValueError: The thickness is below zero or the index below 1.
    """

    thickness_mm: float
    index: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.thickness_mm) and self.thickness_mm >= 0):
            raise ValueError(
                f"thickness_mm = {self.thickness_mm} of a layer must be finite and at least zero"
            )
        if not (math.isfinite(self.index) and self.index >= 1):
            raise ValueError(f"index = {self.index} of a layer must be finite and at least 1")


@dataclass(frozen=True)
class LayerStack:
    """The media above a pinhole at height `start_z_mm`: air, then the layers upwards.

    `tops_mm` are the heights at which the media end. The last medium has no end, because gel that
    is pulled out of its plane stays gel.
    """

    start_z_mm: float
    tops_mm: tuple[float, ...]
    indices: tuple[float, ...]

    @classmethod
    def above(cls, start_z_mm: float, bottom_z_mm: float, layers: tuple[Layer, ...]) -> LayerStack:
        """The stack of `layers` whose lowest face is at `bottom_z_mm`."""
        faces = bottom_z_mm + np.cumsum([0.0, *(layer.thickness_mm for layer in layers)])
        return cls(
            start_z_mm,
            (*faces[:-1].tolist(), math.inf),
            (1.0, *(layer.index for layer in layers)),
        )

    def crossed_mm(self, z_mm: Array) -> list[Array]:
        """Path along z in each medium, air first, from the pinhole to `z_mm` (any shape)."""
        heights: list[Array] = []
        floor = self.start_z_mm
        for top in self.tops_mm:
            heights.append(np.maximum(np.minimum(z_mm, top) - floor, 0.0))
            floor = max(floor, top)
        return heights

    def index_at(self, z_mm: Array) -> Array:
        """Refractive index at heights `z_mm` of any shape; on a face that of the medium above."""
        number = np.searchsorted(self.tops_mm, z_mm, side="right")
        return np.asarray(self.indices)[np.minimum(number, len(self.indices) - 1)]


def lateral_reach(
    slope: ArrayLike, heights_mm: Sequence[ArrayLike], indices: Sequence[ArrayLike]
) -> Array:
    """Lateral reach in mm of rays through flat layers.

    Args:
        slope: Slope tan θ0 of the rays in air; the reach is an odd function of it.
        heights_mm: Thickness of each layer in mm; each broadcasts with `slope`.
        indices: Refractive index of each layer; 1 for air.

    Returns:
        The reach, of the broadcast shape.
    """
    t = np.asarray(slope, dtype=float)
    heights = [np.asarray(h, dtype=float) for h in heights_mm]
    return np.asarray(t * reach_per_slope(t, heights, indices), dtype=float)


def reach_per_slope(
    slope: ArrayLike, heights_mm: Sequence[ArrayLike], indices: Sequence[ArrayLike]
) -> Array:
    """r(t)/t in mm: Σ h / sqrt(n² + (n² - 1) t²); for the normal ray the apparent height."""
    t = np.asarray(slope, dtype=float)
    heights = [np.asarray(h, dtype=float) for h in heights_mm]
    media = [np.asarray(n, dtype=float) for n in indices]
    return np.asarray(apparent_height(t, heights, media), dtype=float)


def reach_growth(
    slope: ArrayLike, heights_mm: Sequence[ArrayLike], indices: Sequence[ArrayLike]
) -> Array:
    """dr/dt in mm per unit slope: Σ h n² / (n² + (n² - 1) t²)^1.5."""
    t = np.asarray(slope, dtype=float)
    total = np.zeros(np.broadcast_shapes(t.shape, *(np.shape(h) for h in heights_mm)))
    for height, index in zip(heights_mm, indices, strict=True):
        n = np.asarray(index, dtype=float)
        w = slope_ratio(t, n)
        total = total + np.asarray(height) * w * (n * n) * w * w
    return np.asarray(total, dtype=float)
