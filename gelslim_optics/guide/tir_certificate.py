"""Certificate of total internal reflection for the cross-section of a light guide, in closed form.

It speaks of the light on its way from the faces it enters by to the gel: at the flat walls, in
the legs and in the bends. What crosses the window without entering the gel and runs into the
opposite bend is spent, and not part of it. The formulas are in `tir_bend` and `tir_walls`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from gelslim_optics.guide.profile import Bend, GuideProfile
from gelslim_optics.guide.tir_bend import BendCertificate, certify_bend, least_ratio
from gelslim_optics.guide.tir_walls import (
    ENDS,
    GUIDE,
    Leg,
    Walls,
    kept_by_walls,
    steepest,
    survey_walls,
    wall_margin_deg,
)
from gelslim_optics.guide.tir_words import TirWords

__all__ = ["BendCertificate", "TirCertificate", "Verdict", "certify_tir", "least_ratio"]

Verdict = Literal["fully_guided", "not_fully_guided", "mirror_corners", "refused"]


@dataclass(frozen=True)
class TirCertificate(TirWords):
    """What closed forms say of a profile for light of numerical aperture `na` (in air).

    na, guide_index, gel_index (None: no gel asked about), outside_index: as given.
    verdict: fully_guided (no ray leaves by a wall; a ray at the critical angle stays),
    not_fully_guided, mirror_corners (walls and bends alone are certified: what a mirror's corner
    loses follows no closed form) or refused (`reasons` say why; nothing is certified).
    mirrors: whether the profile has any. bend_na: largest NA that reaches the bends; legs that
    narrow raise it. tapers: whether a leg's walls are not parallel; shares are lower bounds then.
    straight_margin_deg: worst margin at flat walls.
    guided_2d, guided: least share that walls and bends keep, for rays in the section's plane and
    in the whole cone; lower bounds where a leg tapers or a bend is short; 0 when refused.
    largest_na: largest launched NA that is fully guided; None where not even collimated light is.
    gel_critical_deg: elevation above the bonded face from which light enters the gel.
    top_elevation_deg: the highest that reaches that face. largest_entry_ratio: R/t above which
    this light is too flat to enter the gel; None where it enters at any R/t (or without bends).
    """

    na: float
    guide_index: float
    gel_index: float | None
    outside_index: float
    verdict: Verdict
    reasons: tuple[str, ...]
    mirrors: bool
    bend_na: float
    tapers: bool
    straight_margin_deg: float
    bends: tuple[BendCertificate, ...]
    guided_2d: float
    guided: float
    largest_na: float | None
    gel_critical_deg: float | None
    top_elevation_deg: float
    largest_entry_ratio: float | None

    @property
    def fully_guided(self) -> bool:
        """Whether no ray leaves by a wall; False too where that cannot be certified."""
        return self.verdict == "fully_guided"

    @property
    def margin_deg(self) -> float:
        """Worst margin of walls and bends."""
        return min([self.straight_margin_deg, *(b.margin_deg for b in self.bends)])

    @property
    def enters_gel(self) -> bool:
        """Whether any of the guided light can enter the gel."""
        return self.gel_critical_deg is not None and self.top_elevation_deg > self.gel_critical_deg


def certify_tir(
    profile: GuideProfile,
    na: float,
    *,
    guide_index: float,
    gel_index: float | None = None,
    outside_index: float = 1.0,
    ends: tuple[str, ...] = ENDS,
) -> TirCertificate:
    """Certify the acrylic of a profile for light launched at its `ends` (names of edges).

    `na` is the numerical aperture in air, 0 (collimated along the leg) to 1 (a bare LED). Raises
    ValueError for an `na` or indices outside their ranges, where the guide is no denser than its
    outside, and where the acrylic's outline is not closed. Profiles that the closed forms do not
    cover come back with the verdict `refused`.
    """
    _check(na, guide_index, gel_index, outside_index)
    n, outside = guide_index, outside_index
    bends = profile.bends(GUIDE)
    walls = survey_walls(profile, bends, ends)
    angles = [steepest(leg, na, n) for leg in walls.legs] or [(math.asin(na / n),) * 2]
    wall, axis = (max(a[i] for a in angles) for i in (0, 1))
    narrowing = any(leg.narrows for leg in walls.legs)
    bend_na = min(n * math.sin(axis), n) if narrowing else na
    certified = tuple(certify_bend(b, bend_na, n, outside) for b in bends)
    straight = wall_margin_deg(wall, n, outside)
    verdict = _verdict(walls, [straight, *(b.margin_deg for b in certified)])
    flat, cone = (0.0, 0.0)
    if verdict != "refused":
        flat, cone = _kept(walls.legs, certified, na, bend_na, n, outside)
    tightest = min((b.inner_radius_mm / b.outer_radius_mm for b in bends), default=1.0)
    cosine = math.sqrt(max(n * n - bend_na**2, 0.0)) / n
    return TirCertificate(
        na=na,
        guide_index=n,
        gel_index=gel_index,
        outside_index=outside,
        verdict=verdict,
        reasons=walls.reasons,
        mirrors=walls.mirrors,
        bend_na=bend_na,
        tapers=any(leg.tapers for leg in walls.legs),
        straight_margin_deg=straight,
        bends=certified,
        guided_2d=flat,
        guided=cone,
        largest_na=None if walls.reasons else _largest_na(walls.legs, certified, n, outside),
        gel_critical_deg=_gel_critical_deg(gel_index, n),
        top_elevation_deg=math.degrees(math.acos(min(max(tightest * cosine, outside / n), 1.0))),
        largest_entry_ratio=_largest_entry_ratio(bends, cosine, gel_index, n),
    )


def _verdict(walls: Walls, margins: list[float]) -> Verdict:
    if walls.reasons:
        return "refused"
    if min(margins) < 0:
        return "not_fully_guided"
    return "mirror_corners" if walls.mirrors else "fully_guided"


def _kept(
    legs: tuple[Leg, ...],
    bends: tuple[BendCertificate, ...],
    na: float,
    bend_na: float,
    n: float,
    outside: float,
) -> tuple[float, float]:
    """Least shares kept, (plane, cone).

    With parallel walls the bends keep nothing that the walls lose. A leg that tapers fills only
    part of the bend's acceptance t · NA_b (t · NA_b² for the cone) with the étendue foot · NA
    (foot · NA²); were all that leaks in it filled, the share lost would grow by their quotient.
    """
    walls = [kept_by_walls(leg, na, n, outside) for leg in legs]
    shares = []
    for dimension, at_bend in enumerate(
        ([b.guided_2d for b in bends], [b.guided_3d for b in bends])
    ):
        kept, lost = min(w[dimension] for w in walls), 1 - min(at_bend, default=1.0)
        if not any(leg.tapers for leg in legs):
            shares.append(min(kept, 1 - lost))
            continue
        ratio = min(leg.ratio for leg in legs)
        crowd = (bend_na / na) ** (dimension + 1) / ratio if na > 0 else math.inf
        shares.append(max(kept - (lost * crowd if lost > 0 else 0.0), 0.0))
    return shares[0], shares[1]


def _largest_na(
    legs: tuple[Leg, ...], bends: tuple[BendCertificate, ...], n: float, outside: float
) -> float | None:
    """Largest launched NA that walls and bends guide fully: `steepest` solved for ψ."""
    limits = [math.sqrt(n * n - outside * outside), *(b.largest_na for b in bends)]
    if any(limit is None for limit in limits):
        return None
    wall_limit = math.asin(limits[0] / n) if limits[0] is not None else 0.0
    axis_limit = min(math.asin(min(limit / n, 1.0)) for limit in limits if limit is not None)
    found = []
    for leg in legs:
        if not leg.narrows:
            found.append(axis_limit)
            continue
        # A ray that meets no wall keeps its angle; the others gain a taper at the last wall.
        wall = min(wall_limit, axis_limit - leg.taper_rad)
        if wall < 0:
            return None
        found.append(min(math.asin(math.sin(wall) / leg.ratio) - leg.taper_rad, axis_limit))
    least = min(found, default=axis_limit)
    return min(n * math.sin(least), 1.0) if least >= 0 else None


def _gel_critical_deg(gel_index: float | None, n: float) -> float | None:
    return None if gel_index is None else math.degrees(math.acos(min(gel_index / n, 1.0)))


def _largest_entry_ratio(
    bends: tuple[Bend, ...], cosine: float, gel_index: float | None, n: float
) -> float | None:
    """R/t where cos ψ R / R_o = n_gel / n: n_g / (n - n_g) for collimated light."""
    if not bends or gel_index is None or gel_index >= n * cosine:
        return None
    return gel_index / (n * cosine - gel_index)


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
