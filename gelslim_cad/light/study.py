"""The guide compared with straight guides of the GelSlim 1 type, traced with the same rays.

Also the study as plain data, for programs and for the build's light.json.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

from gelslim_cad.geometry.led_strips import has_tip_light, strip_wavelengths_nm
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.geometry.optics import (
    curved_guide,
    gel_section,
    guide_profile,
    straight_guide,
)
from gelslim_cad.light.exposure import Exposure, exposure
from gelslim_cad.light.scene import MIRROR_REFLECTANCE, launched_na, light_scene
from gelslim_optics.guide.shapes import curved_profile, mirror_profile
from gelslim_optics.guide.tir_certificate import TirCertificate, certify_tir
from gelslim_optics.light.result import Estimate, LightResult, paired_ratio
from gelslim_optics.light.trace import trace_light

RATIOS = (0.6, 0.8, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0)
RAYS = 1 << 17
CURVE_RAYS = 1 << 14
Progress = Callable[[str, int, int], None]
"""Called with what is being done, steps done and steps in all."""
Verdict = Literal["brighter", "darker", "no different"]


QUANTITIES = {"arrived": "light on the gel's coat", "entered_gel": "light into the gel"}


@dataclass(frozen=True)
class Comparison:
    """This guide's light over that of another guide, rays paired.

    `quantity` is what is compared, a key of QUANTITIES: what the camera sees is the coat; the gel
    also takes light that leaves again by its sides.
    """

    other: str
    quantity: str
    ratio: Estimate

    @property
    def verdict(self) -> Verdict:
        """The conclusion that the 95 % interval supports."""
        if self.ratio.low > 1:
            return "brighter"
        return "darker" if self.ratio.high < 1 else "no different"

    def sentence(self) -> str:
        """One sentence for people."""
        r = self.ratio
        return (
            f"{self.verdict} than {self.other}: {r.value:.3f} times the "
            f"{QUANTITIES[self.quantity]} (95 % interval {r.low:.3f} to {r.high:.3f})"
        )


@dataclass(frozen=True)
class TipLight:
    """The light of the strip at the tip against that of the sides.

    Attributes:
        colour: Its name.
        over_sides: Mean irradiance of the coat by this strip over the mean of both side strips,
            each by its own LEDs; NaN where the sides are dark.
    """

    colour: str
    over_sides: float


@dataclass(frozen=True)
class LightStudy:
    """Certificate, traced light, comparisons and exposures of one finger.

    `curve` holds (R/t, ratio against the glued mirror) at this finger's other dimensions.
    """

    certificate: TirCertificate
    light: LightResult
    glued: LightResult
    air_gap: LightResult
    comparisons: tuple[Comparison, ...]
    exposures: tuple[Exposure, ...]
    glued_exposures: tuple[Exposure, ...]
    curve: tuple[tuple[float, Estimate], ...]
    bend_ratio: float

    @property
    def tip(self) -> TipLight | None:
        """The light of the strip at the tip; None without one."""
        names = [c for c in self.light.colours if c not in self.glued.colours]
        if not names:
            return None
        tip, sides = names[0], self.exposures[: len(self.glued.colours)]
        side = sum(e.irradiance_uw_mm2 for e in sides) / len(sides)
        found = next(e.irradiance_uw_mm2 for e in self.exposures if e.colour == tip)
        return TipLight(tip, found / side if side > 0 else math.nan)


def study_light(
    d: Lookup,
    *,
    rays: int = RAYS,
    seed: int = 0,
    threads: int = 1,
    curve: bool = True,
    progress: Progress | None = None,
) -> LightStudy:
    """Trace this finger's guide and both kinds of straight guide with 45° mirrors.

    All guides share gel, window, LEDs, length of the legs and materials. The light of a strip at
    the tip takes no bend: it is traced in this finger's guide, but not compared.

    Args:
        d: Spec fields and dimensions.
        rays: Rays per guide; the curve over R/t takes an eighth of them per point.
        seed: Seed of the random numbers.
        threads: Number of threads; it never changes the answer.
        curve: Whether to trace other bend radii too.
        progress: Called as the work goes on.

    Returns:
        The study.
    """
    gel, straight = gel_section(d), straight_guide(d)
    air_gap = mirror_profile(replace(straight, fit="air_gap"), gel)
    scenes = {
        "curved": light_scene(d, guide_profile(d)),
        "glued": light_scene(d, mirror_profile(straight, gel), sides_only=True),
        "air_gap": light_scene(d, air_gap, sides_only=True),
    }
    steps = len(scenes) + (len(RATIOS) if curve else 0)
    tell = progress or (lambda text, done, total: None)
    traced = {}
    for done, (name, scene) in enumerate(scenes.items()):
        tell(f"tracing {name.replace('_', ' ')}", done, steps)
        traced[name] = trace_light(scene, rays, seed=seed, threads=threads)
    same = f"same LEDs and legs, mirrors of reflectance {MIRROR_REFLECTANCE:g}"
    light, glued, gap = (traced[n] for n in ("curved", "glued", "air_gap"))
    sides = light.of_colours(glued.colours) if has_tip_light(d) else light
    return LightStudy(
        certificate=certify_tir(
            guide_profile(d),
            launched_na(d),
            guide_index=d["material.acrylic.refractive_index"],
            gel_index=d["material.gel.refractive_index"],
        ),
        light=light,
        glued=glued,
        air_gap=gap,
        comparisons=tuple(
            Comparison(name, quantity, paired_ratio(sides, other, quantity))
            for quantity in QUANTITIES
            for name, other in (
                (f"a straight guide with glued 45° mirrors ({same})", glued),
                (f"a straight guide with air-gapped 45° mirrors ({same})", gap),
            )
        ),
        exposures=tuple(exposure(d, light, c) for c in strip_wavelengths_nm(d)),
        glued_exposures=tuple(exposure(d, glued, c) for c in glued.colours),
        curve=ratio_curve(
            d, rays // 8, seed, threads, lambda ratio, k: tell(f"R/t = {ratio:g}", 3 + k, steps)
        )
        if curve
        else (),
        bend_ratio=d["guide.bend_ratio"],
    )


def ratio_curve(
    d: Lookup,
    rays: int = CURVE_RAYS,
    seed: int = 0,
    threads: int = 1,
    tell: Callable[[float, int], None] | None = None,
) -> tuple[tuple[float, Estimate], ...]:
    """Light on the coat over that of glued mirrors, for other bend radii of this finger."""
    own, gel, points = curved_guide(d), gel_section(d), []
    mirrors = light_scene(d, mirror_profile(straight_guide(d), gel), sides_only=True)
    other = trace_light(mirrors, rays, seed=seed, threads=threads)
    for k, ratio in enumerate(RATIOS):
        if tell is not None:
            tell(ratio, k)
        radius = ratio * own.thickness_mm
        bent = curved_profile(replace(own, inner_radius_mm=radius), gel)
        scene = light_scene(d, bent, sides_only=True)
        ours = trace_light(scene, rays, seed=seed, threads=threads)
        points.append((ratio, paired_ratio(ours, other, "arrived")))
    return tuple(points)


def study_record(study: LightStudy) -> dict[str, Any]:
    """Certificate, ledgers, comparisons, curve and exposures; shares of the emitted flux.

    With a strip at the tip also `tip`, and for each colour the sensitivity to a slope along x.
    """
    record: dict[str, Any] = {
        "format": "gelslim-light/1",
        "certificate": {
            **asdict(study.certificate),
            "sentences": list(study.certificate.sentences()),
        },
        "guides": {
            "curved": _guide(study.light),
            "glued_mirrors": _guide(study.glued),
            "air_gap_mirrors": _guide(study.air_gap),
        },
        "comparisons": [
            {
                "other": c.other,
                "quantity": c.quantity,
                "verdict": c.verdict,
                "ratio": _estimate(c.ratio),
                "sentence": c.sentence(),
            }
            for c in study.comparisons
        ],
        "bend_ratio": study.bend_ratio,
        "ratio_by_bend_ratio": [
            {"bend_ratio": ratio, **_estimate(found)} for ratio, found in study.curve
        ],
        "exposures": [_exposure(e) for e in study.exposures],
        "exposures_with_glued_mirrors": [_exposure(e) for e in study.glued_exposures],
    }
    if study.tip is not None:
        tip = study.tip
        record["tip"] = {"colour": tip.colour, "over_sides": _finite(tip.over_sides)}
        for colour, found in record["guides"]["curved"]["by_colour"].items():
            along = study.light.slope_sensitivity(colour, "x")
            found["slope_sensitivity_along"] = _estimate(along)
    return record


def _exposure(found: Exposure) -> dict[str, Any]:
    return {
        **asdict(found),
        "exposure_ms": _finite(found.exposure_ms),
        "sentence": found.sentence(),
    }


def _guide(result: LightResult) -> dict[str, Any]:
    return {
        "rays": result.rays,
        "ledger": {name: _estimate(found) for name, found in result.ledger().items()},
        "ledger_gap": result.ledger_gap(),
        "entered_gel": _estimate(result.entered_gel()),
        "by_colour": {c: _colour(result, c) for c in result.colours},
    }


def _colour(result: LightResult, colour: str) -> dict[str, Any]:
    even = result.uniformity(colour)
    return {
        "arrived": _estimate(result.arrived(colour)),
        "min_over_mean": _finite(even.min_over_mean),
        "cv": _finite(even.cv),
        "elevation_deg": _estimate(result.elevation_deg(colour)),
        "slope_sensitivity": _estimate(result.slope_sensitivity(colour)),
    }


def _estimate(found: Estimate) -> dict[str, float | None]:
    return {side: _finite(getattr(found, side)) for side in ("value", "low", "high")}


def _finite(value: float) -> float | None:
    """None for what JSON cannot hold: a mean over no light, an exposure in the dark."""
    return value if math.isfinite(value) else None
