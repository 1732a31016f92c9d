"""How the picture of the gel's coat changes with the slope of its surface.

The coat reflects as Lambert's law says. Light of source k whose irradiance changes by the
sensitivity g_k per unit slope gives, relative to the level surface,

    E_k(s) = a + (1 - a) m(1 - h_k·s) / sqrt(1 + s·s),    m(t) = (t + sqrt(t² + p²)) / M

with the ambient share a that the coat scatters back. m is the positive part of t with a penumbra p,
because the light of a guide comes from a range of directions; M and h_k are such that E_k(0) = 1
and dE_k/ds = -g_k. For the traced light of gelslim2 the law with a = 0.3 and p = 0.25 differs from
the sum over the rays, with 0.12 of ambient light, by 0.01 at most up to the slope 1.5 on the lit
side, and by 0.04 in the attached shadow. That holds for the mean over the gel. Light that has come
far is lower, and changes more with the slope: `LightLawMap` has the law of each place.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.light.light_map import LightMap

Array = NDArray[np.float64]
AMBIENT, PENUMBRA = 0.3, 0.25
"""Of light whose directions are not known."""
SCATTERED = 0.12
"""Share of the light that the coat scatters back, which no wall of the surface keeps away."""


@dataclass(frozen=True, eq=False)
class LightLaw:
    """Irradiance of k sources as a function of the slope, everywhere or at each of n places.

    Attributes:
        sensitivity: (k, 2) or (k, n, 2) relative change of the irradiance per unit slope along x
            and y, with the sign of the light's direction: light that travels towards +y loses by a
            rise along y.
        ambient: Share of the light that does not depend on the slope, one number or (k, n).
        penumbra: Width of the transition into attached shadow, relative to the level irradiance,
            one number or (k, n).
        gamma: Exponent of the camera: grey value ∝ light^(1/gamma).
    """

    sensitivity: Array
    ambient: float | Array = AMBIENT
    penumbra: float | Array = PENUMBRA
    gamma: float = 1.8

    @classmethod
    def of(cls, light: LightMap, gamma: float = 1.8) -> LightLaw:
        """The law of a light map's mean: light of elevation e changes by cot e per unit slope."""
        directions = light.directions
        return cls(directions[:, :2] / directions[:, 2:], gamma=gamma)

    @cached_property
    def towards(self) -> Array:
        """(k, 2) or (k, n, 2) h of each source."""
        scale = np.asarray(towards_scale(self.ambient, self.penumbra))
        return np.asarray(self.sensitivity * scale[..., None])

    def taken(self, places: NDArray[np.intp]) -> LightLaw:
        """The law at some (m,) of the n places; the same one where it is that of everywhere."""
        if self.sensitivity.ndim == 2:
            return self
        shapes = self.sensitivity, np.asarray(self.ambient), np.asarray(self.penumbra)
        some = [np.take(shape, places, axis=1) if shape.ndim > 1 else shape for shape in shapes]
        return LightLaw(some[0], some[1], some[2], self.gamma)

    @cached_property
    def table(self) -> Array:
        """(n, k, 4) h along x and y, ambient share and penumbra; (1, k, 4) of one law."""
        towards = self.towards if self.towards.ndim == 3 else self.towards[:, None]
        shapes = [np.broadcast_to(v, towards.shape[:2]) for v in (self.ambient, self.penumbra)]
        return np.ascontiguousarray(np.moveaxis(np.dstack([towards, *shapes]), 1, 0))

    def irradiance(
        self, slope: Array, places: NDArray[np.intp] | None = None
    ) -> tuple[Array, Array]:
        """Irradiance relative to the level surface, and its derivative.

        Args:
            slope: (m, 2) slopes along x and y.
            places: (m,) of them among the n places of the law; None for all in order.

        Returns:
            (k, m) and (k, m, 2).
        """
        from gelslim_optics.light.light_law_kernel import irradiance

        count = len(self.sensitivity), len(slope)
        value, by_slope = np.empty(count), np.empty((*count, 2))
        if len(self.table) == 1:
            places = np.zeros(count[1], dtype=np.intp)
        elif places is None:
            places = np.arange(count[1])
        irradiance(slope, self.table, places, value, by_slope)
        return value, by_slope

    def change(
        self,
        slope: Array,
        share: Array,
        level: Array,
        gain: float | Array,
        relief: Array | None = None,
    ) -> tuple[Array, Array, Array]:
        """Logarithmic change of the grey values of c channels.

        Args:
            slope: (n, 2) slopes of the surface.
            share: (k, c, n) share of each source in the light of a channel on the level surface;
                the shares of a channel sum to 1.
            level: (c, n) grey value of the reference over itself plus the floor that was added
                before the logarithm.
            gain: Factor on the logarithm of the light, one number or (c, n); 1 for light as traced.
            relief: (k, n) direct light over that of the slopes alone, as `Relief` gives it; None
                for surfaces whose heights do not matter.

        Returns:
            (c, n) change, (c, n, 2) its derivative by the slopes, (c, n) by the gain.
        """
        value, by_slope = self.irradiance(slope)
        if relief is not None:
            value = SCATTERED + (value - SCATTERED) * relief
            by_slope = by_slope * relief[:, :, None]
        light = np.einsum("kcn,kn->cn", share, value)
        light_slope = np.einsum("kcn,knd->cnd", share, by_slope)
        exponent = gain / self.gamma
        grey = light**exponent
        seen = 1 + level * (grey - 1)
        outer = level * exponent * grey / (seen * light)
        by_gain = level * grey * np.log(light) / (seen * self.gamma)
        return np.log(seen), outer[:, :, None] * light_slope, by_gain


def towards_scale(ambient: float | Array, penumbra: float | Array) -> Array:
    """The size of h over that of the sensitivity, for shares and widths of any shape."""
    root = np.sqrt(1 + np.square(penumbra))
    steepness = (1 + 1 / root) / (1 + root)
    return np.asarray(1 / ((1 - np.asarray(ambient)) * steepness))
