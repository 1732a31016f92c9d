"""Heights of a pressed gel in closed form: waves, the dent of a ball, the dent of a bar."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Height = Callable[[Array, Array], Array]
"""Height of the gel above its level over x and y, all in mm."""


def ripple(slope: float = 0.1, length_mm: float = 4.0) -> Height:
    """Waves across the finger of a largest slope: small slopes without a shift of the whole."""
    wave = 2 * np.pi / length_mm
    return lambda x, y: slope / wave * np.sin(wave * y)


def ball(depth_mm: float, radius_mm: float = 3.0) -> Height:
    """A ball's dent: its cap over a contact as of Hertz, and a decay with the cap's last slope."""
    edge = np.sqrt(radius_mm * depth_mm)
    last = np.sqrt(radius_mm**2 - edge**2)
    level, slope = last - radius_mm + depth_mm, edge / last

    def height(x: Array, y: Array) -> Array:
        r = np.hypot(x, y)
        cap = radius_mm - depth_mm - np.sqrt(radius_mm**2 - np.minimum(r, edge) ** 2)
        outside = -(depth_mm - radius_mm + last) * np.exp(-(r - edge) / (level / slope))
        return np.where(r < edge, cap, outside)

    return height


def strip(depth_mm: float, width_mm: float = 4.0, round_mm: float = 0.3) -> Height:
    """The dent of a flat bar along the finger with round edges; beside it the gel is at 45°."""
    turn = round_mm * np.sqrt(0.5)
    level = depth_mm - round_mm + turn

    def height(x: Array, y: Array) -> Array:
        t = np.maximum(np.abs(y) - width_mm / 2, 0.0)
        arc = round_mm - depth_mm - np.sqrt(round_mm**2 - np.minimum(t, turn) ** 2)
        return np.where(t < turn, arc, -level * np.exp(-(t - turn) / level)) + 0 * x

    return height


def level(x: Array, y: Array) -> Array:
    """The untouched gel."""
    return 0 * x + 0 * y
