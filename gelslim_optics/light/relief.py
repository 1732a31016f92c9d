"""What a deformed gel does to the light besides its slopes: shadows that it casts, and parallax.

A part that is pressed in hides low light from what lies behind it. And light that would have met
the level surface farther on meets a lowered place before: with the tangent τ of the light's travel,
a place at height z gets what the place at x - z τ gets at rest. Light that the coat scatters within
a dent is left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from gelslim_optics.light.light_map import LightMap

Array = NDArray[np.float64]
BIN_WIDTH = 0.09
"""Breadth of the tracer's bins of direction in the tangent of a low elevation: 1/12 of the sine."""
LATTICE_MM = 0.3
"""Nodes that are closer than this are taken in steps."""
_FAINT, _PROBE_MM = 1e-3, 0.5
"""Part of the light that counts as dark; distance over which its fall is taken."""


@dataclass(frozen=True, eq=False)
class Relief:
    """Shadows and parallax of one light on a gel's surface."""

    light: LightMap

    @cached_property
    def sums(self) -> Array:
        """Bins of direction (k, py, px, b, 3) at each place, the brightest first."""
        sums = self.light.light_fans.sums
        order = np.argsort(-sums[..., 0], axis=-1, kind="stable")
        return np.take_along_axis(sums, order[..., None], axis=3)

    @cached_property
    def bins(self) -> tuple[NDArray[np.int64], Array, NDArray[np.int64], Array]:
        """Count of bins that are not dark, and of each bin what `relief_light` asks for."""
        from gelslim_optics.light.relief_kernel import TOWARDS

        sums = self.sums
        count = (sums[..., 0] > _FAINT).sum(axis=-1)
        rise = sums[..., 0] / np.maximum(np.hypot(sums[..., 1], sums[..., 2]), 1e-12)
        unit = TOWARDS / np.hypot(*TOWARDS.T)[:, None]
        return count, rise, np.argmax(-sums[..., 1:] @ unit.T, axis=-1), self._drifts

    @cached_property
    def _drifts(self) -> Array:
        """How the logarithm of each bin's share grows along its travel (k, py, px, b), per mm."""
        fans = self.light.light_fans
        share, drift = fans.sums[..., 0], np.zeros(fans.sums.shape[:-1])
        for axis, part in ((2, 0), (1, 1)):
            count = share.shape[axis]
            if count > 1:
                size = (fans.upper_mm[part] - fans.lower_mm[part]) / count
                drift += fans.sums[..., 1 + part] * np.gradient(share, size, axis=axis)
        growth = np.where(share > _FAINT, drift / np.maximum(share, _FAINT) ** 2, 0.0)
        order = np.argsort(-share, axis=-1, kind="stable")
        return np.take_along_axis(growth, order, axis=3)

    def on(self, height_mm: Array, origin_mm: Array, step_mm: Array) -> Array:
        """Light (ny, nx, k) on a surface over that of its slopes alone.

        Args:
            height_mm: (ny, nx) over the untouched gel, at the nodes of a lattice.
            origin_mm: (2,) first node along x and y.
            step_mm: (2,) of the lattice.
        """
        from gelslim_optics.light.relief_kernel import relief_light

        height = np.ascontiguousarray(height_mm)
        fans = self.light.light_fans
        factor = np.empty((*height.shape, self.light.sources))
        fall = fall_of_light(self.light, tuple(origin_mm), tuple(step_mm), height.shape)
        relief_light(
            height, origin_mm, step_mm, self.sums, *self.bins, fall, BIN_WIDTH,
            np.array(fans.lower_mm), np.array(fans.upper_mm), factor,
        )  # fmt: skip
        return factor


@lru_cache(maxsize=4)
def fall_of_light(
    light: LightMap,
    origin_mm: tuple[float, float],
    step_mm: tuple[float, float],
    shape: tuple[int, int],
) -> Array:
    """Gradient (ny, nx, k, 2) of the logarithm of the light at rest, on a lattice of nodes."""
    x, y = (o + s * np.arange(n) for o, s, n in zip(origin_mm, step_mm, shape[::-1], strict=True))
    x, y = np.meshgrid(x, y)
    faint = _FAINT * light.irradiance.mean(axis=(0, 1))
    dark = np.maximum(light.at(x, y), faint)
    along = light.at(x + _PROBE_MM, y) - light.at(x - _PROBE_MM, y)
    across = light.at(x, y + _PROBE_MM) - light.at(x, y - _PROBE_MM)
    return np.stack([along, across], axis=-1) / (2 * _PROBE_MM * dark[..., None])


@lru_cache(maxsize=8)
def relief_of(light: LightMap) -> Relief:
    """The relief of a light, kept for the next picture."""
    return Relief(light)
