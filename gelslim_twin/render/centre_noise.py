"""How far pixel noise moves a dot's centre: shared by the effects that add noise."""

from __future__ import annotations

import numpy as np

WINDOW = 1.35
"""Radius of the weighing window over the dot's."""


def centre_noise_px(noise_dn: float, contrast_dn: float, dot_diameter_px: float) -> float:
    """Standard deviation per axis of a centroid of darkness under white noise.

    Over a window of radius w about a dot of radius r, var = (σ/c)² Σx² / (π r²)² with
    Σx² = π w⁴ / 4. Raises ValueError for a dot without size or contrast.
    """
    if not (dot_diameter_px > 0 and contrast_dn > 0):
        raise ValueError("a dot needs a diameter and a contrast above 0 to have a centre")
    r = dot_diameter_px / 2
    second = np.pi * (WINDOW * r) ** 4 / 4
    return float(noise_dn / contrast_dn * np.sqrt(second) / (np.pi * r * r))
