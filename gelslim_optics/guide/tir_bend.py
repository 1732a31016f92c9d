"""Total internal reflection in one bend, in closed form.

About the bend's centre h = n ρ cos ψ is constant along a ray in the section's plane (ρ: distance
from the centre, ψ: angle to the tangent), whatever walls it meets and whatever the bend's angle.
The outer wall is met at sin θ = h / (n R_o), the inner one, if at all, at sin θ = h / (n R): more
grazingly, so the outer wall governs. Light fills the entry evenly in position and in the
transverse n d (étendue), as from a Lambertian LED that covers the foot.
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
    """One bend, for the light that enters it with numerical aperture up to `na` (in air).

    ratio: R / t. least_ratio: least R / t that guides all this light; None where none does.
    margin_deg: least angle of incidence at the outer wall less the critical angle; negative
    where light leaks. inner_margin_deg: the same at the inner wall; never the smaller of the two.
    guided_2d, guided_3d: share that the outer wall keeps of light that fills the entry, for rays
    in the section's plane (even in n sin ψ) and in the whole cone (even over the disc of
    transverse n d). error_3d bounds the quadrature's error (difference of two orders).
    largest_na: largest aperture at the bend that is fully guided; None where not even collimated
    light is. sweep_deg: the bend's angle. full_sweep_deg: the angle from which on every ray that
    can leak does meet the outer wall; in a shorter bend less leaks than stated.
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
        """Whether the shares are exact; else the bend is so short that they are lower bounds."""
        return self.sweep_deg >= self.full_sweep_deg - 1e-9


def least_ratio(na: float, guide_index: float, outside_index: float = 1.0) -> float:
    """Least R/t that guides all light of numerical aperture `na`; inf where none does.

    R/t >= n_out / (√(n² - NA²) - n_out), from h >= n_out R_o at ρ = R.
    """
    spare = math.sqrt(max(guide_index**2 - na**2, 0.0)) - outside_index
    return outside_index / spare if spare > 0 else math.inf


def largest_na(inner: float, guide_index: float, outside_index: float = 1.0) -> float | None:
    """Largest NA guided fully by a bend with R / R_o = `inner`; None if not even 0 is."""
    square = guide_index**2 - (outside_index / inner) ** 2
    # The threshold itself must count as guided, whatever its rounding.
    return math.sqrt(max(square, 0.0)) if square >= -1e-12 * guide_index**2 else None


def local_acceptance(rho: Array, guide_index: float, outside_index: float = 1.0) -> Array:
    """Largest guided NA of light that enters at ρ (in units of R_o); NaN where none is guided.

    NA(ρ) = √(n² - (n_out R_o / ρ)²).
    """
    square = guide_index**2 - (outside_index / np.asarray(rho, dtype=float)) ** 2
    return np.sqrt(np.where(square >= 0, square, np.nan))


def certify_bend(
    bend: Bend, na: float, guide_index: float, outside_index: float
) -> BendCertificate:
    """Certificate of one bend for light that fills its entry with `na` (0 to the guide's index)."""
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
    """Least angle of a bend in which every ray with h < n_out R_o meets the outer wall.

    A ray that sets out inwards turns by β(ρ) + β(R_o) - 2 β(R) until then, β(r) = arccos(h / nr).
    This rises with h up to h = n R and falls from there, so the longest way is known; rays out of
    the plane turn less. 0 where no ray leaks. Lengths in R_o; `cosine`: least cos ψ at the entry.
    """
    if inner * cosine >= sine_critical:
        return 0.0
    h = min(inner, sine_critical)
    rho = min(1.0, h / cosine) if cosine > 0 else 1.0
    turn = math.acos(min(h / rho, 1.0)) + math.acos(h) - 2 * math.acos(min(h / inner, 1.0))
    return math.degrees(turn)


def guided_2d(inner: float, na: float, index: float) -> float:
    """Guided share of rays in the plane; lengths in outer radii, indices over the outside's.

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

    With κ = ρ² (in outer radii), p = n d_⊥ and q = n d_x, over the outside's index, a ray is
    guided iff p² <= n² - 1/κ + q² (1 - κ)/κ; (p, q) fill the disc of radius NA evenly.
    """
    na, index = na / outside, guide / outside
    if na == 0:
        return guided_2d(inner, 0.0, index)
    # First the axial rays are kept, then meridional ones too, last the whole cone.
    kinks = [1 / index, _full_from(na, index)]
    if na < 1:
        kinks.append(math.sqrt((1 - na * na) / (index**2 - na * na)))
    ends = sorted({inner, 1.0, *(k for k in kinks if inner < k < 1)})
    total = 0.0
    for low, high in itertools.pairwise(ends):
        rho, weight = _bunched(low, high, nodes)
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
    q, weight = _bunched(start, meet, nodes)
    area = float(weight @ np.sqrt(np.maximum(a + b * q * q, 0.0)))
    # Beyond `meet` the cone itself is the limit: a segment of the disc.
    chord = math.sqrt(max(na**2 - meet**2, 0.0))
    area += 0.5 * (na * na * math.acos(min(meet / na, 1.0)) - meet * chord)
    return area * 4 / (math.pi * na * na)


def _bunched(low: float, high: float, nodes: int) -> tuple[Array, Array]:
    """Nodes and weights on [low, high] bunched at both ends, where roots have steep slopes."""
    x, w = _gauss(nodes)
    angle = (x + 1) * math.pi / 4
    slope = np.sin(2 * angle) * math.pi / 4
    return low + (high - low) * np.sin(angle) ** 2, (high - low) * slope * w


@lru_cache(maxsize=8)
def _gauss(nodes: int) -> tuple[Array, Array]:
    x, w = np.polynomial.legendre.leggauss(nodes)
    return x, w
