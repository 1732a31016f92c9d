"""The light of the two LED strips, and how the camera sees it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.geometry.lookup import Lookup
from gelslim_optics.light.light_map import LED_COLOURS

RED_SHARE = 0.45
"""Red appears weaker than green in published images of this sensor."""
RESPONSES = {
    "red": LED_COLOURS[0],
    "green": LED_COLOURS[1],
    "blue": np.array([0.01, 0.06, 1.0]),
    "white": np.ones(3),
}
"""Red, green and blue that a camera with a colour matrix shows of each light. That of a blue LED
(470 nm) is assumed; white is what the camera is balanced to."""
SHARES = {"red": RED_SHARE, "green": 1.0, "blue": 1.0, "white": 1.0}
"""How bright the camera sees each light; that of blue is assumed to be that of green."""
WHITE = "white"


def strip_wavelengths_nm(d: Lookup) -> dict[str, float]:
    """Wavelengths of the strip at -y and of that at +y, by the name of their light.

    Two colours are called by their names. Strips of one wavelength and white ones are called by
    the side of the picture at which they shine: left and right.
    """
    one = d["design.leds.one_wavelength_nm"]
    one = d["design.leds.white_wavelength_nm"] if is_white(d) else one
    if one is not None:
        return {"left": one, "right": one}
    waves = colour_wavelengths_nm(d)
    return {name: waves[name] for name in d["design.leds.light"].split("_")}


def colour_wavelengths_nm(d: Lookup) -> dict[str, float]:
    """Wavelengths of the LEDs of each colour."""
    return {
        "red": d["design.leds.red_wavelength_nm"],
        "green": d["design.leds.green_wavelength_nm"],
        "blue": d["design.leds.blue_wavelength_nm"],
    }


def is_white(d: Lookup) -> bool:
    """Whether both strips shine white."""
    return bool(d["design.leds.light"] == WHITE)


def shared_light(d: Lookup) -> str:
    """The light of both strips in words, such as `white` or `850 nm`; empty for two colours."""
    one = d["design.leds.one_wavelength_nm"]
    return WHITE if is_white(d) else "" if one is None else f"{one:g} nm"


def camera_responses(d: Lookup) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How bright the camera sees each strip, and in which colour.

    A mono camera sees both strips alike. A colour camera sees one wavelength as the nearest of the
    usual LEDs.

    Args:
        d: Spec fields.

    Returns:
        (2,) share of each strip's light, and (2, 3) response of red, green and blue to it.
    """
    if d["camera.picture"] == "mono":
        return np.ones(2), np.ones((2, 3))
    one = d["design.leds.one_wavelength_nm"]
    if one is None:
        names = [WHITE] * 2 if is_white(d) else list(strip_wavelengths_nm(d))
        return np.array([SHARES[n] for n in names]), np.stack([RESPONSES[n] for n in names])
    usual = colour_wavelengths_nm(d)
    nearest = min(usual, key=lambda name: abs(usual[name] - one))
    return np.ones(2), np.stack([RESPONSES[nearest]] * 2)
