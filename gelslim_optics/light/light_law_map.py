"""The law of the light at each place of the gel, from the directions in which light reaches it.

Light that has come far from its LEDs is low and changes twice as much with the slope as the mean;
next to the LEDs it comes from all directions and hardly changes. For places in even steps over the
pad the law has the sensitivity of the traced directions, and the ambient share and the penumbra
with which it is nearest to their sum, in the logarithm of the light, for slopes along the mean
direction of a source. Between the places these are bilinear.

The mean direction in a light map tells the sensitivity of the whole light, weighted by irradiance.
Where that is less than the directions say, the rest of the light is ambient.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from gelslim_optics.light.light_fans import LightFans
from gelslim_optics.light.light_law import LightLaw, towards_scale
from gelslim_optics.light.light_map import LightMap

Array = NDArray[np.float64]
_RISES = np.linspace(-1.5, 1.5, 31)
"""Slopes along the light for which the law is fitted."""
_USUAL, _FAINT = 0.6, 0.03
"""Slope up to which the fit counts most, and light below which it hardly counts."""
_AMBIENT = np.linspace(0.0, 0.6, 13)
_PENUMBRA = np.array([0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.7, 1.0])


@dataclass(frozen=True, eq=False)
class LightLawMap:
    """Laws of k sources at places in even steps over the pad.

    Attributes:
        sensitivity: (k, py, px, 2), as in `LightLaw`.
        ambient: (k, py, px).
        penumbra: (k, py, px).
        lower_mm: (2,) corner of the pad in x and y.
        upper_mm: (2,) the opposite corner.
    """

    sensitivity: Array
    ambient: Array
    penumbra: Array
    lower_mm: tuple[float, float]
    upper_mm: tuple[float, float]

    @classmethod
    def of(cls, light: LightMap) -> LightLawMap:
        """The laws of a light map with directions."""
        fans = light.light_fans
        mean = light.directions[:, :2] / light.directions[:, 2:]
        kept = _kept_share(light, fans, mean)
        shares = 1 - kept[:, None, None]
        sensitivity = kept[:, None, None, None] * fans.sums[..., 1:].sum(axis=-2)
        along = _unit(mean)
        rising = _by_rise(fans, along)
        rising = shares[..., None] + (1 - shares[..., None]) * rising
        across = np.einsum("kyxd,kd->kyx", sensitivity, along)
        ambient, penumbra = _nearest(rising, across)
        return cls(sensitivity, ambient, penumbra, fans.lower_mm, fans.upper_mm)

    def at(self, places_mm: Array, gamma: float) -> LightLaw:
        """The laws at places (n, 2), for a camera with the exponent `gamma`."""
        count = np.array(self.ambient.shape[2:0:-1])
        size = np.asarray(self.upper_mm) - self.lower_mm
        at = np.nan_to_num((places_mm - self.lower_mm) / size * count - 0.5).T[::-1]

        def between(values: Array) -> Array:
            flat = values.reshape(-1, *values.shape[-2:])
            found = [map_coordinates(layer, at, order=1, mode="nearest") for layer in flat]
            return np.reshape(found, (*values.shape[:-2], len(places_mm)))

        steep = np.moveaxis(between(np.moveaxis(self.sensitivity, -1, 1)), 1, -1)
        return LightLaw(steep, between(self.ambient), between(self.penumbra), gamma)


def law_at(light: LightMap, places_mm: Array, gamma: float) -> LightLaw:
    """The law of a light map at places (n, 2); that of its mean where no directions are known."""
    if light.fans is None:
        return LightLaw.of(light, gamma)
    return LightLawMap.of(light).at(places_mm, gamma)


def _kept_share(light: LightMap, fans: LightFans, mean: Array) -> Array:
    """(k,) sensitivity by the mean directions (k, 2) over that by all directions; 1 at most."""
    count = np.array(fans.sums.shape[2:0:-1])
    size = np.asarray(fans.upper_mm) - fans.lower_mm
    x, y = (
        lower + step * (np.arange(number) + 0.5)
        for lower, step, number in zip(fans.lower_mm, size / count, count, strict=True)
    )
    level = np.moveaxis(light.at(*np.meshgrid(x, y)), -1, 0)
    whole = np.einsum("kyx,kyxbd->kd", level, fans.sums[..., 1:])
    whole /= np.maximum(level.sum(axis=(1, 2)), 1e-12)[:, None]
    ratio = np.linalg.norm(mean, axis=1) / np.maximum((whole * _unit(mean)).sum(axis=1), 1e-12)
    return np.asarray(np.clip(ratio, 0.0, 1.0))


def _unit(ways: Array) -> Array:
    """Unit vectors (k, 2) along vectors (k, 2); 0 for light that comes straight from below."""
    return np.asarray(ways / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-12))


def _by_rise(fans: LightFans, along: Array) -> Array:
    """(k, py, px, r) irradiance by rises along directions (k, 2), over that of a level surface."""
    ways = np.einsum("kyxbd,kd->kyxb", fans.sums[..., 1:], along)
    lit = [np.maximum(fans.sums[..., 0] - rise * ways, 0).sum(axis=-1) for rise in _RISES]
    return np.stack(lit, axis=-1) / np.sqrt(1 + _RISES**2)


def _nearest(rising: Array, sensitivity: Array) -> tuple[Array, Array]:
    """Ambient share and penumbra (k, py, px) of the laws nearest to light by the rise.

    Args:
        rising: (k, py, px, r) light at `_RISES`.
        sensitivity: (k, py, px) along the light.
    """
    seen = np.log(np.maximum(rising, 0) + _FAINT)
    weight = np.exp(-((_RISES / _USUAL) ** 2)) + 0.1
    shape = sensitivity.shape
    least, ambient, penumbra = np.full(shape, np.inf), np.zeros(shape), np.zeros(shape)
    for share, wide in product(_AMBIENT, _PENUMBRA):
        lit = 1 - sensitivity[..., None] * towards_scale(share, wide) * _RISES
        direct = (lit + np.sqrt(lit**2 + wide**2)) / (1 + np.sqrt(1 + wide**2))
        law = share + (1 - share) * direct / np.sqrt(1 + _RISES**2)
        off = ((np.log(law + _FAINT) - seen) ** 2 * weight).sum(axis=-1)
        better = off < least
        least = np.where(better, off, least)
        ambient[better], penumbra[better] = share, wide
    return ambient, penumbra
