"""Total internal reflection in one bend, in closed form.

About the centre of the bend h = n ρ cos ψ is constant along a ray in the plane of the section
(ρ: distance from the centre, ψ: angle to the tangent), whatever walls it meets and whatever the
angle of the bend. It meets the outer wall at sin θ = h / (n R_o) and the inner wall, if at all, at
sin θ = h / (n R), which is more grazing, so that the outer wall governs. Light fills the entry
uniformly in position and in the transverse n d (étendue), as from a Lambertian LED that covers the
foot.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.guide.profile import Bend

Array = NDArray[np.float64]
ORDERS = (48, 24)
TIE_DEG = 1e-10


@dataclass(frozen=True)
class BendCertificate:
    """One bend, for light that enters it with a given numerical aperture.

    Attributes:
        ratio: R / t.
        least_ratio: Smallest R / t that guides all this light; None where none does.
        margin_deg: Smallest angle of incidence at the outer wall less the critical angle; negative
            where light leaks.
        inner_margin_deg: The same at the inner wall, which is never the smaller of the two.
        guided_2d: Share that the outer wall keeps of rays in the plane of the section, uniform in
            n sin ψ.
        guided_3d: The same for the whole cone, uniform over the disc of transverse n d.
        error_3d: Bound of the error of the quadrature, the difference of two orders.
        largest_na: Largest NA at the bend that is fully guided; None where not even collimated
            light is.
        sweep_deg: Angle of the bend.
        full_sweep_deg: Angle from which on every ray that can leak meets the outer wall; a shorter
            bend leaks less than stated.
    """

    ratio: float
    least_ratio: float | None
    margin_deg: float
    inner_margin_deg: float
    guided_2d: float
    guided_3d: float
    error_3d: float
    largest_na: float | None
    sweep_deg: float
    full_sweep_deg: float

    @property
    def exact(self) -> bool:
        """Whether the shares are exact; in a short bend they are lower bounds."""
        return self.sweep_deg >= self.full_sweep_deg - 1e-9


def least_ratio(na: float, guide_index: float, outside_index: float = 1.0) -> float:
    """Smallest R/t that guides all light of numerical aperture `na`; inf where none does.

    R/t >= n_out / (√(n² - NA²) - n_out), from h >= n_out R_o at ρ = R.
    """
    excess = math.sqrt(max(guide_index**2 - na**2, 0.0)) - outside_index
    return outside_index / excess if excess > 0 else math.inf


def largest_na(inner: float, guide_index: float, outside_index: float = 1.0) -> float | None:
    """Largest NA that a bend with R / R_o = `inner` guides fully; None where there is none."""
    square = guide_index**2 - (outside_index / inner) ** 2
    # The threshold itself counts as guided, whatever the rounding.
    return math.sqrt(max(square, 0.0)) if square >= -1e-12 * guide_index**2 else None


def certify_bend(
    bend: Bend, na: float, guide_index: float, outside_index: float
) -> BendCertificate:
    """Certificate of a bend for light that fills its entry with `na` (0 to the guide's index)."""
    inner = bend.inner_radius_mm / bend.outer_radius_mm
    cosine = math.sqrt(max(guide_index**2 - na * na, 0.0)) / guide_index
    critical = math.asin(outside_index / guide_index)
    margin, flat, fine, coarse = margin_deg(cosine * inner, critical), 1.0, 1.0, 1.0
    if margin < 0:
        flat = guided_2d(inner, na / outside_index, guide_index / outside_index)
        fine, coarse = (guided_3d(inner, na, guide_index, outside_index, k) for k in ORDERS)
    least = least_ratio(na, guide_index, outside_index)
    return BendCertificate(
        ratio=bend.ratio,
        least_ratio=least if math.isfinite(least) else None,
        margin_deg=margin,
        inner_margin_deg=margin_deg(cosine, critical),
        guided_2d=flat,
        guided_3d=fine,
        error_3d=abs(fine - coarse),
        largest_na=largest_na(inner, guide_index, outside_index),
        sweep_deg=math.degrees(abs(bend.sweep_rad)),
        full_sweep_deg=full_sweep_deg(inner, cosine, outside_index / guide_index),
    )


def full_sweep_deg(inner: float, cosine: float, sine_critical: float) -> float:
    """Smallest angle of a bend in which every ray with h < n_out R_o meets the outer wall.

    A ray that starts inwards turns by β(ρ) + β(R_o) - 2 β(R) until then, β(r) = arccos(h / n r).
    This increases with h up to h = n R and decreases from there, so that the longest path is known;
    rays out of the plane turn less. The angle is 0 where no ray leaks. Lengths are in units of R_o;
    `cosine` is the smallest cos ψ at the entry.
    """
    if inner * cosine >= sine_critical:
        return 0.0
    h = min(inner, sine_critical)
    rho = min(1.0, h / cosine) if cosine > 0 else 1.0
    turn = math.acos(min(h / rho, 1.0)) + math.acos(h) - 2 * math.acos(min(h / inner, 1.0))
    return math.degrees(turn)


def guided_2d(inner: float, na: float, index: float) -> float:
    """Guided share of rays in the plane; lengths in R_o, indices relative to the outside.

    (1 / t) ∫ min(1, NA(ρ) / NA) dρ with NA(ρ) = √(n² - 1/ρ²), whose antiderivative is
    √(n²ρ² - 1) - arccos(1 / (n ρ)).
    """
    none, full = 1 / index, _full_from(na, index)
    low, high = max(inner, min(none, 1.0)), min(max(inner, full), 1.0)
    part = 0.0
    if high > low and na > 0:
        part = (_aperture_integral(high, index) - _aperture_integral(low, index)) / na
    return min((part + max(0.0, 1.0 - max(inner, full))) / (1 - inner), 1.0)


def guided_3d(
    inner: float, na: float, guide: float, outside: float, nodes: int = ORDERS[0]
) -> float:
    """Guided share of the whole cone, by Gauss-Legendre between the kinks of the integrand.

    With κ = ρ² (ρ in R_o), p = n d_⊥ and q = n d_x, relative to the outside index, a ray is guided
    if and only if p² <= n² - 1/κ + q² (1 - κ)/κ; (p, q) fill the disc of radius NA uniformly.
    """
    na, index = na / outside, guide / outside
    if na == 0:
        return guided_2d(inner, 0.0, index)
    # With growing ρ the axial rays are guided first, then the meridional ones, then the whole cone.
    kinks = [1 / index, _full_from(na, index)]
    if na < 1:
        kinks.append(math.sqrt((1 - na * na) / (index**2 - na * na)))
    ends = sorted({inner, 1.0, *(k for k in kinks if inner < k < 1)})
    total = 0.0
    for low, high in itertools.pairwise(ends):
        rho, weight = _clustered(low, high, nodes)
        share = np.array([_guided_at(float(r), na, index, nodes) for r in rho])
        total += float(weight @ share)
    return min(total / (1 - inner), 1.0)


def margin_deg(sine: float, critical_rad: float) -> float:
    """Angle of incidence less the critical angle; within `TIE_DEG` of it counts as guided."""
    margin = math.degrees(math.asin(min(sine, 1.0)) - critical_rad)
    return 0.0 if -TIE_DEG < margin < 0 else margin


def _full_from(na: float, index: float) -> float:
    """Radius (in R_o) from which on the whole cone is guided."""
    return 1 / math.sqrt(index**2 - na**2) if na < index else math.inf


def _aperture_integral(rho: float, index: float) -> float:
    h = max(index * rho, 1.0)
    return math.sqrt(h * h - 1) - math.acos(1 / h)


def _guided_at(rho: float, na: float, index: float, nodes: int) -> float:
    """Guided share of the cone at one radius."""
    a, b = index**2 - rho**-2, rho**-2 - 1
    if a >= na * na:
        return 1.0
    start = math.sqrt(-a / b) if a < 0 < b else (na if a < 0 else 0.0)
    if start >= na:
        return 0.0
    meet = math.sqrt((na * na - a) / (1 + b))
    q, weight = _clustered(start, meet, nodes)
    area = float(weight @ np.sqrt(np.maximum(a + b * q * q, 0.0)))
    # Beyond `meet` the cone itself is the limit: a segment of the disc.
    chord = math.sqrt(max(na**2 - meet**2, 0.0))
    area += 0.5 * (na * na * math.acos(min(meet / na, 1.0)) - meet * chord)
    return area * 4 / (math.pi * na * na)


def _clustered(low: float, high: float, nodes: int) -> tuple[Array, Array]:
    """Nodes and weights on [low, high], clustered at the ends, where square roots are steep."""
    x, w = _gauss(nodes)
    angle = (x + 1) * math.pi / 4
    slope = np.sin(2 * angle) * math.pi / 4
    return low + (high - low) * np.sin(angle) ** 2, (high - low) * slope * w


@lru_cache(maxsize=8)
def _gauss(nodes: int) -> tuple[Array, Array]:
    x, w = np.polynomial.legendre.leggauss(nodes)
    return x, w
