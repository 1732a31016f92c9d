"""The light of the two LED strips, and how the camera sees it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.geometry.lookup import Lookup
from gelslim_optics.light.light_map import LED_COLOURS

RED_SHARE = 0.45
"""Red appears weaker than green in published images of this sensor."""


def strip_wavelengths_nm(d: Lookup) -> dict[str, float]:
    """Wavelengths of the strip at -y and of that at +y, by the name of their light.

    Two colours are called red and green. Strips of one wavelength are called by the side of the
    picture at which they shine: left and right.
    """
    one = d["design.leds.one_wavelength_nm"]
    if one is not None:
        return {"left": one, "right": one}
    return {
        "red": d["design.leds.red_wavelength_nm"],
        "green": d["design.leds.green_wavelength_nm"],
    }


def camera_responses(d: Lookup) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How bright the camera sees each strip, and in which colour.

    A mono camera sees both strips alike. A colour camera sees one wavelength as the nearer of the
    two usual LEDs.

    Args:
        d: Spec fields.

    Returns:
        (2,) share of each strip's light, and (2, 3) response of red, green and blue to it.
    """
    if d["camera.picture"] == "mono":
        return np.ones(2), np.ones((2, 3))
    one = d["design.leds.one_wavelength_nm"]
    if one is None:
        return np.array([RED_SHARE, 1.0]), LED_COLOURS
    middle = (d["design.leds.red_wavelength_nm"] + d["design.leds.green_wavelength_nm"]) / 2
    return np.ones(2), LED_COLOURS[[int(one < middle)] * 2]
