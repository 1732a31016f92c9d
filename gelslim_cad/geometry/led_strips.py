"""The light of the LED strips, two or three, and how the camera sees it."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gelslim_cad.geometry.lookup import Lookup
from gelslim_optics.light.light_map import LED_COLOURS

Side = Literal["left", "right", "tip"]
SIDES: tuple[Side, Side, Side] = ("left", "right", "tip")
"""Where a strip is: under the leg at -y or at +y, or in front of the window's end face."""
TIP_LIP_MM = 1.2
"""Of both ends of the board at the tip, behind the lips that hold it."""
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
NO_TIP = "none"


def has_tip_light(d: Lookup) -> bool:
    """Whether a third strip shines into the window's end face at the tip."""
    return bool(d["design.leds.tip"] != NO_TIP)


def strip_sides(d: Lookup) -> tuple[Side, ...]:
    """Where the strips are, in the order of their lights: left, right and perhaps tip."""
    return SIDES if has_tip_light(d) else SIDES[:2]


def strip_wavelengths_nm(d: Lookup) -> dict[str, float]:
    """Wavelengths of the strip at -y, of that at +y and of that at the tip, where there is one.

    Two or three colours are called by their names. Strips of one wavelength and white ones are
    called by the side of the picture at which they shine: left, right and tip.
    """
    one = d["design.leds.one_wavelength_nm"]
    one = d["design.leds.white_wavelength_nm"] if is_white(d) else one
    if one is not None:
        return dict.fromkeys(strip_sides(d), one)
    waves = colour_wavelengths_nm(d)
    names = d["design.leds.light"].split("_")
    return {name: waves[name] for name in [*names, *([d["design.leds.tip"]] * has_tip_light(d))]}


def colour_wavelengths_nm(d: Lookup) -> dict[str, float]:
    """Wavelengths of the LEDs of each colour."""
    return {
        "red": d["design.leds.red_wavelength_nm"],
        "green": d["design.leds.green_wavelength_nm"],
        "blue": d["design.leds.blue_wavelength_nm"],
    }


def is_white(d: Lookup) -> bool:
    """Whether all strips shine white."""
    return bool(d["design.leds.light"] == WHITE)


def shared_light(d: Lookup) -> str:
    """The light of all strips in words, such as `white` or `850 nm`; empty for colours."""
    one = d["design.leds.one_wavelength_nm"]
    return WHITE if is_white(d) else "" if one is None else f"{one:g} nm"


def camera_responses(d: Lookup) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How bright the camera sees each strip, and in which colour.

    A mono camera sees all strips alike. A colour camera sees one wavelength as the nearest of the
    usual LEDs.

    Args:
        d: Spec fields.

    Returns:
        (n,) share of each of the n strips' light, and (n, 3) response of red, green and blue to
        it; n is 2, or 3 with a strip at the tip, which is the last.
    """
    strips = strip_wavelengths_nm(d)
    if d["camera.picture"] == "mono":
        return np.ones(len(strips)), np.ones((len(strips), 3))
    one = d["design.leds.one_wavelength_nm"]
    if one is None:
        names = [WHITE] * len(strips) if is_white(d) else list(strips)
        return np.array([SHARES[n] for n in names]), np.stack([RESPONSES[n] for n in names])
    usual = colour_wavelengths_nm(d)
    nearest = min(usual, key=lambda name: abs(usual[name] - one))
    return np.ones(len(strips)), np.stack([RESPONSES[nearest]] * len(strips))
