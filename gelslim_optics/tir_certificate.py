"""Certificate of total internal reflection in a bent guide, in closed form.

In a bend about a centre, h = n ρ cos ψ is constant along a ray (ρ: distance from the centre, ψ:
angle to the tangent), so the outer wall is met at sin θ = h / (n R_o), whatever happens before;
the inner wall is met more grazingly still. Light enters the bend with n sin ψ up to NA, evenly in
position and in n sin ψ (the étendue is filled, as by an LED that covers the foot).
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gelslim_optics.guide_profile import Bend, GuideProfile

Array = NDArray[np.float64]
NODES = 48
FEET = ("foot_left", "foot_right")


@dataclass(frozen=True)
class BendCertificate:
    """One bend. `margin_deg`: least angle at the outer wall less the critical angle.

    `guided_2d`, `guided_3d`: share of the light that the outer wall keeps, for rays in the
    section's plane and for rays in the whole cone; `error_3d` bounds the quadrature's error.
    """

    ratio: float
    least_ratio: float
    margin_deg: float
    guided_2d: float
    guided_3d: float
    error_3d: float


@dataclass(frozen=True)
class TirCertificate:
    """What closed forms say of a profile for light of numerical aperture `na` (in air).

    `bend_na` is the NA that reaches the bends: legs that narrow from the foot raise it, at most
    by foot / t. `straight_margin_deg` is that of the flat walls. `gel_critical_deg`: elevation
    above the bonded face from which light enters the gel; `top_elevation_deg`: the highest that
    reaches it. A bend so short that some rays pass without meeting its outer wall leaks less than
    stated.
    """

    na: float
    guide_index: float
    gel_index: float | None
    bend_na: float
    straight_margin_deg: float
    bends: tuple[BendCertificate, ...]
    gel_critical_deg: float | None
    top_elevation_deg: float

    @property
    def fully_guided(self) -> bool:
        """Whether no ray leaves by a wall; rays at the critical angle are guided."""
        return self.straight_margin_deg >= 0 and all(b.margin_deg >= 0 for b in self.bends)

    @property
    def guided(self) -> float:
        """Least guided share of the bends, whole cone; 1 without bends."""
        return min((b.guided_3d for b in self.bends), default=1.0)

    @property
    def enters_gel(self) -> bool:
        """Whether any of the guided light can enter the gel."""
        return self.gel_critical_deg is not None and self.top_elevation_deg > self.gel_critical_deg

    def sentences(self) -> tuple[str, ...]:
        """The certificate in words."""
        return (*self._guiding(), *self._gel())

    def _guiding(self) -> tuple[str, ...]:
        light = "collimated light" if self.na == 0 else f"light of NA {self.na:g}"
        if self.na == 1:
            light = "a bare LED's light (NA 1)"
        if not self.bends:
            return (f"No bends: the flat walls keep {light} by {self.straight_margin_deg:.2f}°.",)
        worst = min(self.bends, key=lambda b: b.margin_deg)
        needed = f"R/t = {worst.ratio:.3g}, full guidance needs {worst.least_ratio:.3g}"
        if self.fully_guided:
            return (
                f"Fully guided: {light} keeps {worst.margin_deg:.2f}° at the bends ({needed}).",
            )
        return (
            f"Not fully guided: the bends keep {self.guided:.1%} of {light} ({needed}; the worst "
            f"ray misses the critical angle by {-worst.margin_deg:.2f}°).",
        )

    def _gel(self) -> tuple[str, ...]:
        if self.gel_critical_deg is None:
            return ()
        if self.gel_critical_deg == 0:
            return ("The gel is at least as dense as the guide: all light that meets it enters.",)
        rise, reach = self.gel_critical_deg, self.top_elevation_deg
        if self.enters_gel:
            return (
                f"Light enters the gel from {rise:.1f}° above the face; the guide brings up to "
                f"{reach:.1f}°.",
            )
        return (
            f"No guided light enters the gel: it must rise {rise:.1f}° above the face and at most "
            f"{reach:.1f}° arrives; use tighter bends or a gel of higher index.",
        )


def certify_tir(
    profile: GuideProfile,
    na: float,
    *,
    guide_index: float,
    gel_index: float | None = None,
    outside_index: float = 1.0,
) -> TirCertificate:
    """Certify the acrylic of a profile for light launched at its feet.

    `na` is the numerical aperture in air, 0 (collimated) to 1 (a bare LED). Raises ValueError for
    an `na` or indices outside their ranges, and where the guide is no denser than its outside.
    """
    _check(na, guide_index, gel_index, outside_index)
    bends = profile.bends("acrylic")
    bend_na = min(na * _taper(profile, bends), guide_index)
    n, outside = guide_index, outside_index
    cosine = math.sqrt(max(n * n - bend_na**2, 0.0)) / n
    critical = math.asin(outside / n)
    certified = tuple(_certify_bend(b, bend_na, n, outside) for b in bends)
    return TirCertificate(
        na=na,
        guide_index=n,
        gel_index=gel_index,
        bend_na=bend_na,
        straight_margin_deg=_margin_deg(cosine, critical),
        bends=certified,
        gel_critical_deg=None
        if gel_index is None
        else math.degrees(math.acos(min(gel_index / n, 1.0))),
        top_elevation_deg=_top_elevation_deg(bends, cosine, outside / n),
    )


def least_ratio(na: float, guide_index: float, outside_index: float = 1.0) -> float:
    """Least R/t that guides all light of numerical aperture `na`; inf where none does.

    R/t >= n_out / (√(n² - NA²) - n_out), from h >= n_out R_o at ρ = R.
    """
    spare = math.sqrt(max(guide_index**2 - na**2, 0.0)) - outside_index
    return outside_index / spare if spare > 0 else math.inf


def _certify_bend(bend: Bend, na: float, n: float, outside: float) -> BendCertificate:
    inner, outer = bend.inner_radius_mm, bend.outer_radius_mm
    cosine = math.sqrt(max(n * n - na * na, 0.0)) / n
    fine = _guided_3d(inner / outer, na, n / outside, outside, NODES)
    coarse = _guided_3d(inner / outer, na, n / outside, outside, NODES // 2)
    return BendCertificate(
        ratio=bend.ratio,
        least_ratio=least_ratio(na, n, outside),
        margin_deg=_margin_deg(cosine * inner / outer, math.asin(outside / n)),
        guided_2d=guided_2d(inner / outer, na / outside, n / outside),
        guided_3d=fine,
        error_3d=abs(fine - coarse),
    )


def guided_2d(inner: float, na: float, index: float) -> float:
    """Guided share of rays in the plane; lengths in outer radii, indices over the outside's.

    (1 / t) ∫ min(1, NA(ρ) / NA) dρ with NA(ρ) = √(n² - 1/ρ²), whose antiderivative is
    √(n²ρ² - 1) - arccos(1 / (n ρ)).
    """
    none, full = 1 / index, 1 / math.sqrt(index**2 - na**2) if na < index else math.inf
    low, high = max(inner, min(none, 1.0)), min(max(inner, full), 1.0)
    part = 0.0
    if high > low and na > 0:
        part = (_aperture_integral(high, index) - _aperture_integral(low, index)) / na
    return (part + max(0.0, 1.0 - max(inner, full))) / (1 - inner)


def _aperture_integral(rho: float, index: float) -> float:
    h = max(index * rho, 1.0)
    return math.sqrt(h * h - 1) - math.acos(1 / h)


def _guided_3d(inner: float, na: float, index: float, outside: float, nodes: int) -> float:
    """Guided share of the whole cone, by Gauss-Legendre between the kinks of the integrand.

    With κ = ρ² (in outer radii), p = n d_⊥ and q = n d_x, a ray is guided iff
    p² <= n² - 1/κ + q² (1 - κ)/κ; (p, q) fill the disc of radius NA evenly.
    """
    na = na / outside
    if na == 0:
        return guided_2d(inner, 0.0, index)
    # First the axial rays are kept, then meridional ones too, last the whole cone.
    kinks = [
        math.sqrt(max(1 - na * na, 0.0) / (index**2 - na * na)),
        1 / index,
        1 / math.sqrt(index**2 - na * na),
    ]
    ends = sorted({inner, 1.0, *(k for k in kinks if inner < k < 1)})
    total = 0.0
    for low, high in itertools.pairwise(ends):
        rho, weight = _bunched(low, high, nodes)
        share = np.array([_guided_at(float(r), na, index, nodes) for r in rho])
        total += float(weight @ share)
    return min(total / (1 - inner), 1.0)


def _guided_at(rho: float, na: float, index: float, nodes: int) -> float:
    """Guided share of the cone at one radius."""
    a, b = index**2 - rho**-2, rho**-2 - 1
    if a >= na * na:
        return 1.0
    start = math.sqrt(-a / b) if a < 0 and b > 0 else (na if a < 0 else 0.0)
    meet = math.sqrt((na * na - a) / (1 + b))
    if start >= na:
        return 0.0
    q, weight = _bunched(start, meet, nodes)
    area = float(weight @ np.sqrt(np.maximum(a + b * q * q, 0.0)))
    # Beyond `meet` the cone itself is the limit: a segment of the disc.
    area += 0.5 * (na * na * math.acos(min(meet / na, 1.0)) - meet * math.sqrt(na**2 - meet**2))
    return area * 4 / (math.pi * na * na)


def _bunched(low: float, high: float, nodes: int) -> tuple[Array, Array]:
    """Nodes and weights on [low, high] bunched at both ends, where roots have steep slopes."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    angle = (x + 1) * math.pi / 4
    place = np.sin(angle) ** 2
    slope = np.sin(2 * angle) * math.pi / 4
    return low + (high - low) * place, (high - low) * slope * w


def _taper(profile: GuideProfile, bends: tuple[Bend, ...]) -> float:
    """How much legs that narrow towards the bend widen the cone, at most (2-D étendue)."""
    names = {edge.name for edge in profile.edges}
    feet = [profile.edge(name).curve.length_mm for name in FEET if name in names]
    if not feet or not bends:
        return 1.0
    widest = max(feet) / min(b.thickness_mm for b in bends)
    # Rounding of a foot as wide as the guide must not move rays across the threshold.
    return widest if widest > 1 + 1e-9 else 1.0


def _top_elevation_deg(bends: tuple[Bend, ...], cosine: float, outside: float) -> float:
    """Highest elevation in the window: light launched at R leaves the bend at the outer wall."""
    tightest = min((b.inner_radius_mm / b.outer_radius_mm for b in bends), default=1.0)
    return math.degrees(math.acos(min(max(tightest * cosine, outside), 1.0)))


def _margin_deg(sine: float, critical_rad: float) -> float:
    """Angle of incidence less the critical angle; rounding at the threshold counts as guided."""
    margin = math.degrees(math.asin(min(sine, 1.0)) - critical_rad)
    return 0.0 if -1e-12 < margin < 0 else margin


def _check(na: float, guide: float, gel: float | None, outside: float) -> None:
    if not (math.isfinite(na) and 0 <= na <= 1):
        raise ValueError(f"na = {na!r}: must be between 0 (collimated) and 1 (a bare LED)")
    if not (math.isfinite(outside) and 1 <= outside <= 4):
        raise ValueError(f"outside_index = {outside!r}: must be between 1 and 4")
    if not (math.isfinite(guide) and outside < guide <= 4):
        raise ValueError(
            f"guide_index = {guide!r}: must be above outside_index = {outside:g}, or no light is "
            "totally reflected, and at most 4"
        )
    if gel is not None and not (math.isfinite(gel) and 1 <= gel <= 4):
        raise ValueError(f"gel_index = {gel!r}: must be between 1 and 4")
