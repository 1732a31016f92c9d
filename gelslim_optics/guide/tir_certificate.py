"""Certificate of total internal reflection (TIR) in a light guide, in closed form.

It is about the light on its way from the faces where it enters to the gel: at the flat walls, in
the legs and in the bends. Light that crosses the window without entering the gel and reaches the
opposite bend is not part of it. The formulas are in `tir_bend` and `tir_walls`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from gelslim_optics.guide.profile import Bend, GuideProfile
from gelslim_optics.guide.tir_bend import BendCertificate, certify_bend
from gelslim_optics.guide.tir_walls import (
    ENDS,
    GUIDE,
    Leg,
    Walls,
    kept_by_walls,
    steepest_rad,
    survey_walls,
    wall_margin_deg,
)

Verdict = Literal["fully_guided", "not_fully_guided", "mirror_corners", "refused"]


@dataclass(frozen=True)
class TirCertificate:
    """What closed forms say about a profile for light of a numerical aperture.

    Attributes:
        na: Numerical aperture of the launched light, in air.
        guide_index: Refractive index of the guide.
        gel_index: Refractive index of the gel; None without a gel.
        outside_index: Refractive index around the guide.
        verdict: `fully_guided`: no ray leaves through a wall; `not_fully_guided`;
            `mirror_corners`: only walls and bends are certified, as no closed form gives what the
            corner of a mirror loses; `refused`: nothing is certified, see `reasons`.
        reasons: Why the closed forms do not apply.
        mirrors: Whether the profile has mirrors.
        bend_na: Largest NA that reaches the bends; legs that narrow increase it.
        tapers: Whether the walls of a leg are not parallel; the shares are then lower bounds.
        straight_margin_deg: Smallest margin of total reflection at flat walls.
        bends: One certificate for each bend.
        guided_2d: Smallest share that walls and bends keep of rays in the plane of the section;
            a lower bound where a leg tapers or a bend is short, 0 when refused.
        guided: The same for the whole cone.
        largest_na: Largest launched NA that is fully guided; None where not even collimated light
            is.
        gel_critical_deg: Elevation above the bonded face from which light enters the gel.
        top_elevation_deg: Largest elevation of the light that reaches that face.
        largest_entry_ratio: R/t above which this light is too flat to enter the gel; None where
            it enters at any R/t, or without bends.
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

    def sentences(self) -> tuple[str, ...]:
        """The certificate in words, the verdict first."""
        return (*_guiding_text(self), *_limitations(self), *_gel_text(self))

    @property
    def fully_guided(self) -> bool:
        """Whether no ray leaves through a wall; also False where that cannot be certified."""
        return self.verdict == "fully_guided"

    @property
    def margin_deg(self) -> float:
        """Smallest margin of total reflection of walls and bends."""
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
    """Certify the acrylic of a profile.

    Args:
        profile: The cross-section.
        na: Numerical aperture of the light in air, from 0 (collimated along the leg) to 1 (a bare
            LED).
        guide_index: Refractive index of the acrylic.
        gel_index: Refractive index of the gel; None leaves the gel out.
        outside_index: Refractive index around the guide, below that of the guide.
        ends: Names of the edges at which light is launched or leaves.

    Returns:
        The certificate, with the verdict `refused` where the closed forms do not apply.

    Raises:
        ValueError: `na` or an index is out of range, or the outline of the acrylic is not closed.
    """
    _check(na, guide_index, gel_index, outside_index)
    n, outside = guide_index, outside_index
    bends = profile.bends(GUIDE)
    walls = survey_walls(profile, bends, ends)
    angles = [steepest_rad(leg, na, n) for leg in walls.legs] or [(math.asin(na / n),) * 2]
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
    """Smallest shares kept, in the plane and in the cone.

    With parallel walls the bends keep nothing of what the walls lose. A leg that tapers fills only
    a part of the bend's acceptance t · NA_b (t · NA_b² for the cone) with the étendue foot · NA
    (foot · NA²). If that part contained everything that leaks, the lost share would grow by their
    quotient.
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
    """Largest launched NA that walls and bends guide fully: `steepest_rad` solved for ψ."""
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
        # A ray that meets no wall keeps its angle; the others gain the taper at the last wall.
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


def _light(na: float) -> str:
    if na == 0:
        return "collimated light"
    return "a bare LED's light (NA 1)" if na == 1 else f"light of NA {na:g}"


def _share_text(share: float, at_least: bool = False) -> str:
    """A share in per cent, never rounded up to 100 %; with `at_least` always rounded down."""
    if share >= 1:
        return "100%"
    if share <= 0 and at_least:
        return "an unknown share"
    if share > 0.999:
        return f"all but {100 * (1 - share):.1g}%"
    return f"at least {math.floor(share * 1000) / 10:.1f}%" if at_least else f"{share:.1%}"


def _guiding_text(c: TirCertificate) -> list[str]:
    light = _light(c.na)
    if c.verdict == "refused":
        return [f"Not certified: {'; '.join(c.reasons)}."]
    if c.verdict == "mirror_corners":
        return [
            "Mirrors turn the light. They do not reflect totally, and what their corners lose is "
            f"not certified; the walls keep {light} with a margin of {c.margin_deg:.2f}°."
        ]
    kept = _share_text(c.guided, c.tapers or not all(b.exact for b in c.bends))
    if not c.bends:
        if c.fully_guided:
            margin = f"a margin of {c.margin_deg:.2f}°"
            return [f"Fully guided: flat walls keep {light} with {margin}; there are no bends."]
        return [
            f"Not fully guided: there are no bends, but the flat walls keep {kept} of {light}; the "
            f"worst ray misses the critical angle by {-c.margin_deg:.2g}°."
        ]
    worst = min(c.bends, key=lambda b: b.margin_deg)
    needs = "no R/t guides all of it"
    if worst.least_ratio is not None:
        needs = f"full guidance needs R/t >= {math.ceil(worst.least_ratio * 100 - 1e-6) / 100:.2f}"
    has = f"R/t = {worst.ratio:.3g}"
    margin = f"{abs(c.margin_deg):.2g}°"
    if c.fully_guided:
        return [
            f"Fully guided: {light} has a margin of {margin} at the worst wall ({has}; {needs})."
        ]
    legs = " The walls of the legs leak too." if c.straight_margin_deg < 0 else ""
    return [
        f"Not fully guided: {kept} of {light} stays in at the bend ({has}; {needs}; the worst ray "
        f"misses the critical angle by {margin}).{legs}"
    ]


def _limitations(c: TirCertificate) -> list[str]:
    if c.verdict == "refused":
        return []
    notes = []
    if c.mirrors and c.verdict == "not_fully_guided":
        notes.append("What the corners of the mirrors lose in addition is not certified.")
    if c.tapers:
        notes.append(
            f"The legs taper: light reaches the bends with NA {c.bend_na:.3g} at most, and shares "
            "are lower bounds."
        )
    short = [b for b in c.bends if not b.exact]
    if short:
        notes.append(
            f"A bend of {short[0].sweep_deg:.3g}° is short: only from "
            f"{short[0].full_sweep_deg:.3g}° on does every ray that can leak meet the outer wall, "
            "so less leaks than stated."
        )
    if c.verdict == "not_fully_guided":
        notes.append(
            "Not even collimated light is fully guided here."
            if c.largest_na is None
            else f"Light up to NA {math.floor(c.largest_na * 1000) / 1000:.3f} is fully guided."
        )
    return notes


def _gel_text(c: TirCertificate) -> list[str]:
    if c.gel_critical_deg is None or c.verdict == "refused":
        return []
    if c.gel_critical_deg == 0:
        return [
            "The index of the gel is at least that of the guide: there is no total reflection at "
            "their common face, and light that meets it enters except for partial reflection."
        ]
    rise, reach = c.gel_critical_deg, c.top_elevation_deg
    if c.enters_gel:
        return [
            f"Light enters the gel from {rise:.1f}° above the face; the guide delivers up to "
            f"{reach:.1f}°."
        ]
    remedy = "use a wider cone or a gel of higher index"
    if c.largest_entry_ratio is not None:
        remedy = f"bend tighter than R/t = {c.largest_entry_ratio:.3g} or use a gel of higher index"
    return [
        f"No guided light enters the gel: it must rise by {rise:.1f}° above the face, and at most "
        f"{reach:.1f}° arrive; {remedy}."
    ]
