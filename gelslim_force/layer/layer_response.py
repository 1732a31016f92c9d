"""How the surface of a bonded layer, with or without a skin, answers waves of traction.

A pressure p~ J0(kr) and an outward traction q~ J1(kr) let the surface sink by w~ J0(kr) and move
outwards by u~ J1(kr), with C = 2 (1 - ν²)/E,

    k w~ = C (L p~ + M q~),    k u~ = C (M p~ + N q~),
    L(x) = (2κ sinh 2x - 4x) / D,                M(x) = (8x² - 2κ (κ-1)(cosh 2x - 1)) / (κ+1) D,
    N(x) = (2κ sinh 2x + 4x) / D,                D(x) = 2κ cosh 2x + 1 + κ² + 4x²,

x = kh and κ = 3 - 4ν (L: Hannah 1951; Johnson, Contact Mechanics, 5.8; M and N follow from the same
solution in plane waves).

A skin is a membrane of plane stiffness T = N_s/(1 - ν_s²), force per width over strain where the
stretch across is held. By its equilibrium the gel gets q + T (u'' + u'/r - u/r²), q~ - T k² u~ in
waves, so that the same equations hold with

    L' = L - s M²/(1 + s N),    M' = M/(1 + s N),    N' = N/(1 + s N),    s = C T k.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import sici

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LayerResponse:
    """The response of one layer in its skin.

    Attributes:
        thickness_mm: Of the layer, > 0.
        poissons_ratio: Of the layer, below 0.5.
        skin_mm: Plane stiffness of the skin over Young's modulus of the layer; 0 for none.
    """

    thickness_mm: float
    poissons_ratio: float
    skin_mm: float = 0.0

    @property
    def rigid_limit(self) -> float:
        """M of a bare half-space."""
        return -(1 - 2 * self.poissons_ratio) / (2 * (1 - self.poissons_ratio))

    @property
    def skin_length_mm(self) -> float:
        """C T: a wave of this length over 2π is held by the skin as much as by the gel."""
        return 2 * (1 - self.poissons_ratio**2) * self.skin_mm

    @property
    def shallow(self) -> float:
        """L of a half-space in the same skin for endlessly short waves."""
        return 1 - self.rigid_limit**2 if self.skin_mm else 1.0

    def by_base(self, wave: Array) -> tuple[Array, Array]:
        """What L and M (n,) have more than those of a half-space in the same skin.

        It is below 1e-14 where kh > 18.
        """
        limit = self.rigid_limit
        sinking, outward, along = _bare(wave * self.thickness_mm, self.poissons_ratio)
        if not self.skin_mm:
            return sinking - 1, outward - limit
        held = self.skin_length_mm * wave
        free, half = 1 + held * along, 1 + held
        by_skin = held * (limit**2 / half - outward**2 / free)
        return sinking - 1 + by_skin, outward / free - limit / half

    def of_half_space(self, wave: Array) -> Array:
        """M (n,) of a half-space in the same skin."""
        return np.asarray(self.rigid_limit / (1 + self.skin_length_mm * wave))

    def by_wave(self, wave: Array) -> tuple[Array, Array, Array]:
        """L, M and N of the layer in its skin for waves of any shape, above 0."""
        sinking, outward, along = _bare(wave * self.thickness_mm, self.poissons_ratio)
        held = self.skin_length_mm * wave
        free = 1 + held * along
        return sinking - held * outward**2 / free, outward / free, along / free

    def along(self, wave: Array) -> Array:
        """N (n,) of the layer in its skin."""
        return self.by_wave(wave)[2]

    def skin_kernel(self, apart_mm: Array) -> Array:
        """∫ (L - shallow) cos(kv) dk of a half-space in this skin at v ≠ 0.

        It is (m²/c) ∫ cos(vt/c)/(1 + t) dt with c = `skin_length_mm` and m the `rigid_limit`, an
        auxiliary function of the sine and cosine integrals (Abramowitz and Stegun 5.2.13).
        """
        z = np.abs(apart_mm) / self.skin_length_mm
        sine, cosine = sici(z)
        auxiliary = -cosine * np.cos(z) - (sine - np.pi / 2) * np.sin(z)
        return np.asarray(self.rigid_limit**2 / self.skin_length_mm * auxiliary)

    def skin_integral(self, end_mm: Array) -> Array:
        """The integral of `skin_kernel` from 0 to v >= 0."""
        z = np.maximum(end_mm / self.skin_length_mm, 1e-300)
        sine, cosine = sici(z)
        auxiliary = cosine * np.sin(z) - (sine - np.pi / 2) * np.cos(z)
        return np.asarray(self.rigid_limit**2 * (np.pi / 2 - auxiliary))


def _bare(x: Array, poissons_ratio: float) -> tuple[Array, Array, Array]:
    """L, M and N (n,) of a bare layer at x = kh."""
    kappa = 3 - 4 * poissons_ratio
    e = np.exp(-2 * x)
    bottom = kappa * (1 + e * e) + (1 + kappa**2 + 4 * x * x) * e
    waving = (1 - e) ** 2 * kappa * (kappa - 1)
    return (
        (kappa * (1 - e * e) - 4 * x * e) / bottom,
        (8 * x * x * e - waving) / (kappa + 1) / bottom,
        (kappa * (1 - e * e) + 4 * x * e) / bottom,
    )
