"""Sphere or paraboloid on an endless elastic layer bonded to a rigid base: truth for the tests.

Frictionless, adhesionless. The sinking under an axisymmetric pressure p is
u(r) = 2 (1 - ν²)/E ∫ L(kh) p~(k) J0(kr) dk with p~ its Hankel transform and
L = (2κ sinh 2x - 4x) / (2κ cosh 2x + 1 + κ² + 4x²), κ = 3 - 4ν (Hannah 1951; Johnson, Contact
Mechanics, 5.8). The pressure is a sum of (1 - r²/a²)^(m - 1/2), m ≥ 1: zero at the rim.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gamma, j0, jv

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LayerContact:
    radius_mm: float
    depth_mm: float
    force_n: float
    _k: Array
    _spectrum: Array

    def sinking(self, r_mm: ArrayLike) -> Array:
        r = np.abs(np.asarray(r_mm, dtype=float))
        table = np.linspace(0, r.max() + 1e-9, 500)
        return np.interp(r, table, hankel(self._k, self._spectrum, table))

    def exact_sinking(self, r_mm: ArrayLike) -> Array:
        return hankel(self._k, self._spectrum, np.asarray(r_mm, dtype=float))


def hankel(k: Array, spectrum: Array, r: Array) -> Array:
    """Transforms at radii r (n,) of a spectrum (m,) over k (m,), or of several (m, s)."""
    weight = np.full(len(k), k[1] - k[0])
    weight[0] /= 2
    return np.concatenate(
        [
            j0(np.outer(part, k)) @ (spectrum.T * weight).T
            for part in np.split(r, range(200, len(r), 200))
        ]
    )


def stiffness_factor(x: Array, nu: float) -> Array:
    """L(kh) of a layer that is bonded below and free of shear above."""
    x = np.minimum(x, 300.0)
    kappa = 3 - 4 * nu
    e = np.exp(-2 * x)
    return (kappa * (1 - e * e) - 4 * x * e) / (
        kappa * (1 + e * e) + (1 + kappa**2 + 4 * x * x) * e
    )


def strip_contact(
    profile, half_mm: float, thickness_mm: float, youngs_mpa: float, nu: float, terms: int = 6
) -> tuple[float, float]:
    """Depth (mm) and force per length (N/mm) of a line contact in plane strain.

    Sinking 2 (1 - ν²)/(π E) ∫ L(kh)/k p~(k) cos kx dk, p~ of (1 - x²/b²)^(m - 1/2) by Poisson's
    integral of the Bessel function J_m.
    """
    k = (np.arange(12000) + 0.5) * (0.025 / max(half_mm, thickness_mm))
    weight = stiffness_factor(k * thickness_mm, nu) / k * 2 * (1 - nu**2) / (np.pi * youngs_mpa)
    orders = np.arange(1, terms + 1)
    t = half_mm * k
    parts = np.array(
        [half_mm * np.sqrt(np.pi) * gamma(m + 0.5) * (2 / t) ** m * jv(m, t) for m in orders]
    )
    x = half_mm * (np.arange(24) + 0.5) / 24
    columns = np.cos(np.outer(x, k)) @ (parts * weight * (k[1] - k[0])).T
    solution, *_ = np.linalg.lstsq(
        np.column_stack([columns, -np.ones_like(x)]), -profile(x), rcond=None
    )
    whole = half_mm * np.sqrt(np.pi) * gamma(orders + 0.5) / gamma(orders + 1)
    return float(solution[-1]), float(solution[:-1] @ whole)


def layer_contact(
    profile, radius_mm: float, thickness_mm: float, youngs_mpa: float, nu: float, terms: int = 6
) -> LayerContact:
    """Contact of radius a with the paraboloid or sphere `profile(r)`."""
    a = radius_mm
    count = int(12000 * max(1.0, thickness_mm / a))
    k = np.arange(count + 1) * (0.025 / max(a, thickness_mm))
    k[0] = 1e-9
    factor = stiffness_factor(k * thickness_mm, nu)
    parts = []
    for m in range(1, terms + 1):
        mu = m - 0.5
        t = a * k
        small = t < 1e-6
        t = np.where(small, 1e-6, t)
        parts.append(a * a * 2**mu * gamma(mu + 1) * jv(mu + 1, t) / t ** (mu + 1))
    spectra = np.array(parts) * factor * 2 * (1 - nu**2) / youngs_mpa
    r = a * np.sqrt((np.arange(24) + 0.5) / 24)
    columns = np.column_stack([hankel(k, spectra.T, r), -np.ones_like(r)])
    # sinking = d - profile: the unknown d is the last column
    solution, *_ = np.linalg.lstsq(columns, -profile(r), rcond=None)
    c, depth = solution[:-1], solution[-1]
    force = float(2 * np.pi * (c @ np.array(parts)[:, 0]))
    return LayerContact(a, float(depth), force, k, c @ spectra)
