"""The light of a built sensor, by channel of its camera instead of by lamp.

A picture tells the light of each channel and not that of each lamp. Each channel is drawn as if it
had a lamp of its own: its irradiance is that of the picture, and its directions are those of all
lamps of the design, weighted by their shares in the channel at each place. Any number of lamps
thus becomes one source per channel, without loss: the light of a facet is linear in the lamps.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.light.light_fans import LightFans
from gelslim_optics.light.light_map import LightMap

if TYPE_CHECKING:
    from gelslim_twin.scene.built_look import BuiltLook

Array = NDArray[np.float64]
_STEPS = 33
"""Nodes of the drawn irradiance along each axis."""
_PLACES = 8
"""Places along each axis at which lamps of one direction each are mixed."""
_FAINT = 0.02
"""Light of a channel over its mean on the gel, below which the design's light is not trusted."""


def light_terms(place: Array) -> Array:
    """Products (n, 10) of Legendre polynomials up to the third degree at places (n, 2) in -1...1.

    They are orthogonal over the gel, so that the first coefficient is the mean. Outside the gel
    the values are those at its edge.
    """
    x, y = np.clip(place, -1, 1).T
    along, across = (
        (np.ones_like(v), v, (3 * v * v - 1) / 2, (5 * v**3 - 3 * v) / 2) for v in (x, y)
    )
    return np.column_stack([along[i] * across[j] for i in range(4) for j in range(4 - i)])


def design_light(light: LightMap, places_mm: Array, channels: int) -> Array:
    """(n, c) light of the design in each channel at places (n, 2), 1 in the mean of each.

    A camera without colours has the response to the first one.
    """
    seen = light.at(*places_mm.T) @ light.colour[:, :channels]
    mean = np.maximum(seen.mean(axis=0), 1e-12)
    return np.asarray(np.maximum(seen / mean, _FAINT))


def channel_light(look: BuiltLook, light: LightMap, size_mm: tuple[float, float]) -> LightMap:
    """The light of a look: one source for each channel of its camera.

    Args:
        look: The look.
        light: Light of the design, as in the bundle.
        size_mm: Length and width of the gel.

    Returns:
        Light whose unit is `look.level_dn`.
    """
    channels = len(look.contrast)
    x, y = (np.linspace(-0.5, 0.5, _STEPS) * size for size in size_mm)
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    half = np.array(size_mm) / 2
    factor = np.exp(light_terms(places / half) @ look.light_terms.T)
    irradiance = (design_light(light, places, channels) * factor).reshape(_STEPS, _STEPS, channels)
    fans = mixed_fans(light, channels, look.shading_gain)
    towards = fans.sums[..., 1:].sum(axis=3).mean(axis=(1, 2))
    steep = np.maximum(np.hypot(*towards.T), 1e-9)
    return LightMap(
        x,
        y,
        irradiance,
        np.rad2deg(np.arctan2(towards[:, 1], towards[:, 0])),
        np.rad2deg(np.arctan2(1.0, steep)),
        np.eye(3) if channels == 3 else np.ones((1, 3)),
        fans.sums,
    )


def mixed_fans(light: LightMap, channels: int, gain_terms: Array) -> LightFans:
    """Directions of the light of each channel.

    Args:
        light: Light of k lamps.
        channels: Number of channels c.
        gain_terms: (c, 6) factor on the change of light with the slope, over the gel.

    Returns:
        Fans of c sources, whose bins are those of all lamps side by side.
    """
    from gelslim_force.joint.light.calibration import GAINS, place_terms

    own = light.light_fans
    sums = own.sums
    if sums.shape[1:3] == (1, 1):
        sums = np.broadcast_to(sums, (sums.shape[0], _PLACES, _PLACES, *sums.shape[3:]))
    rows, columns = sums.shape[1:3]
    v, u = ((np.arange(n) + 0.5) / n * 2 - 1 for n in (rows, columns))
    place = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    lower, upper = np.array(own.lower_mm), np.array(own.upper_mm)
    falling = light.at(*((place + 1) / 2 * (upper - lower) + lower).T)
    parts = falling[:, :, None] * light.colour[None, :, :channels] + 1e-12
    share = (parts / parts.sum(axis=1, keepdims=True)).reshape(rows, columns, -1, channels)
    mixed = np.einsum("jikc,kjibd->cjikbd", share, sums)
    mixed = mixed.reshape(channels, rows, columns, -1, 3)
    gain = np.clip(gain_terms @ place_terms(place).T, *GAINS).reshape(channels, rows, columns, 1)
    mixed[..., 1:] *= gain[..., None]
    return LightFans(mixed, own.lower_mm, own.upper_mm)
