"""Bins of the picture that show the reflection of something else than the gel.

A tilt of the gel takes light from one colour and gives it to another where the colours come from
different sides. A reflection, on the window or on the lens, adds light to all colours.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from gelslim_optics.light.light_map import LightMap

Layers = NDArray[np.floating]
Mask = NDArray[np.bool_]
_BRIGHTER = 0.1
"""Logarithmic change of the colour that gains least from which it is a reflection. In the presses
of a real sensor with red and green light from two sides it stays below 0.06."""
_RIM, _RIM_SIGMAS = 0.03, 2.0
"""The same, and standard deviations, down to which the reflection reaches."""
_BESIDE = 2
"""Bins beside it whose small share of the reflection does not show."""
_DIRECTIONS = 72
_LEAST_SENSITIVITY = 0.1
"""Mean relative change of the colours per unit slope that tells a tilt."""
_LEAST_LOSS = -0.2
"""Largest gain of the colour that gains least by a tilt, over the mean sensitivity: lights that are
opposite in the design are not quite so in the tracer."""


def colours_oppose(light: LightMap) -> bool:
    """Whether each tilt of the gel takes light from some colour, so that reflections can be told.

    Args:
        light: Light on the untouched gel.
    """
    towards = light.directions[:, :2] / light.directions[:, 2:]
    given = light.irradiance.mean(axis=(0, 1))[:, None] * light.colour
    lit = given.sum(axis=0) > 0
    sensitivity = (given[:, lit] / given[:, lit].sum(axis=0)).T @ towards
    angle = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    loss = sensitivity @ np.stack([np.cos(angle), np.sin(angle)])
    usual = float(np.hypot(*sensitivity.T).mean())
    return bool(usual > _LEAST_SENSITIVITY and loss.max(axis=0).min() >= _LEAST_LOSS * usual)


def reflecting(change: Layers, noise: Layers, valid: Mask) -> Mask:
    """(rows, columns) bins that show a reflection, to its rim.

    Args:
        change: (c, rows, columns) difference and mean of the logarithms of the first two colours,
            and those of the others less that mean; see `ShadingChange`.
        noise: (c, rows, columns) their standard deviations.
        valid: (rows, columns) bins to look at.
    """
    least = change[1] - np.abs(change[0]) / 2
    for other in change[2:]:
        least = np.minimum(least, change[1] + other)
    least = np.where(valid, least, 0.0)
    bright = least > np.maximum(_BRIGHTER, 2 * _RIM_SIGMAS * noise[1])
    if not bright.any():
        return bright
    parts, _ = ndimage.label(least > np.maximum(_RIM, _RIM_SIGMAS * noise[1]))
    shown = np.isin(parts, np.unique(parts[bright]))
    return np.asarray(ndimage.binary_dilation(shown, np.ones((3, 3)), iterations=_BESIDE))
