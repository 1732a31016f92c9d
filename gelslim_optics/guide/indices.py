"""Refractive indices, critical angles and Fresnel reflection."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

PMMA_B, PMMA_C_UM2 = 1.1819, 0.011313


def pmma_index(wavelength_um: ArrayLike) -> NDArray[np.float64]:
    """Index of PMMA: n² = 1 + 1.1819 λ² / (λ² - 0.011313), λ in µm (one-term Sellmeier).

    Fit of Sultanova, Kasarova and Nikolov (2009) to measurements from 0.4368 to 1.052 µm. Raises
    ValueError outside 0.43 to 1.06 µm.
    """
    wavelength = np.asarray(wavelength_um, dtype=float)
    if not np.all((wavelength >= 0.43) & (wavelength <= 1.06)):
        raise ValueError(
            f"wavelength_um = {wavelength_um!r}: the formula for PMMA holds from 0.43 to 1.06 µm"
        )
    square = wavelength**2
    return np.sqrt(1 + PMMA_B * square / (square - PMMA_C_UM2))


def critical_angle_deg(index: ArrayLike, outside_index: ArrayLike = 1.0) -> NDArray[np.float64]:
    """Angle of incidence (from the normal) at which total reflection sets in; NaN where none."""
    inside, outside = _indices(index, outside_index)
    ratio = outside / inside
    return np.degrees(np.arcsin(np.where(ratio <= 1, ratio, np.nan)))


def fresnel_reflectance(
    cosine: ArrayLike, index: ArrayLike, outside_index: ArrayLike
) -> NDArray[np.float64]:
    """Reflectance of unpolarised light from medium `index` onto `outside_index`.

    `cosine` of the angle of incidence, 0 to 1; arguments broadcast. 1 from the critical angle on
    and at grazing incidence (0 at any angle for equal indices). Raises ValueError for cosines
    outside [0, 1] and indices below 1.
    """
    inside, outside = _indices(index, outside_index)
    cos_in = np.asarray(cosine, dtype=float)
    if not np.all((cos_in >= 0) & (cos_in <= 1)):
        raise ValueError("cosine of the angle of incidence must be between 0 and 1")
    # (n2 cos θ2)² = n2² - n1² + (n1 cos θ1)²: no cancellation near the critical angle.
    normal_in = inside * cos_in
    square = (outside - inside) * (outside + inside) + normal_in**2
    normal_out = np.sqrt(np.maximum(square, 0.0))
    with np.errstate(invalid="ignore", divide="ignore"):
        s = (normal_in - normal_out) / (normal_in + normal_out)
        a, b = outside**2 * normal_in, inside**2 * normal_out
        p = (a - b) / (a + b)
    found = np.where((square <= 0) | (cos_in == 0), 1.0, (s * s + p * p) / 2)
    return np.where(np.broadcast_to(inside == outside, found.shape), 0.0, found)


def _indices(index: ArrayLike, other: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    pair = np.asarray(index, dtype=float), np.asarray(other, dtype=float)
    for values in pair:
        if not np.all((values >= 1) & np.isfinite(values)):
            raise ValueError(f"refractive index = {values!r}: must be finite and at least 1")
    return pair
