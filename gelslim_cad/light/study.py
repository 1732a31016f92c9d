"""The guide compared with straight guides of the GelSlim 1 type, traced with the same rays."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

from gelslim_cad.geometry.guide_section import (
    curved_guide,
    gel_section,
    guide_profile,
    straight_guide,
)
from gelslim_cad.geometry.lookup import Lookup
from gelslim_cad.light.exposure import Exposure, exposure
from gelslim_cad.light.scene import MIRROR_REFLECTANCE, launched_na, light_scene
from gelslim_optics.guide.shapes import curved_profile, mirror_profile
from gelslim_optics.guide.tir_certificate import TirCertificate, certify_tir
from gelslim_optics.light.result import Estimate, LightResult, paired_ratio
from gelslim_optics.light.trace import trace_light

RATIOS = (0.6, 0.8, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0)
RAYS = 1 << 17
CURVE_RAYS = 1 << 14
COLOURS = ("red", "green")
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

    All guides share gel, window, LEDs, length of the legs and materials. `rays` per guide; the
    curve over R/t takes an eighth of them per point. `threads` never changes the answer.
    """
    gel, straight = gel_section(d), straight_guide(d)
    scenes = {
        "curved": light_scene(d, guide_profile(d)),
        "glued": light_scene(d, mirror_profile(straight, gel)),
        "air_gap": light_scene(d, mirror_profile(replace(straight, fit="air_gap"), gel)),
    }
    steps = len(scenes) + (len(RATIOS) if curve else 0)
    tell = progress or (lambda text, done, total: None)
    traced = {}
    for done, (name, scene) in enumerate(scenes.items()):
        tell(f"tracing {name.replace('_', ' ')}", done, steps)
        traced[name] = trace_light(scene, rays, seed=seed, threads=threads)
    same = f"same LEDs and legs, mirrors of reflectance {MIRROR_REFLECTANCE:g}"
    light, glued, gap = (traced[n] for n in ("curved", "glued", "air_gap"))
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
            Comparison(name, quantity, paired_ratio(light, other, quantity))
            for quantity in QUANTITIES
            for name, other in (
                (f"a straight guide with glued 45° mirrors ({same})", glued),
                (f"a straight guide with air-gapped 45° mirrors ({same})", gap),
            )
        ),
        exposures=tuple(exposure(d, light, c) for c in COLOURS),
        glued_exposures=tuple(exposure(d, glued, c) for c in COLOURS),
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
    mirrors = light_scene(d, mirror_profile(straight_guide(d), gel))
    other = trace_light(mirrors, rays, seed=seed, threads=threads)
    for k, ratio in enumerate(RATIOS):
        if tell is not None:
            tell(ratio, k)
        radius = ratio * own.thickness_mm
        bent = curved_profile(replace(own, inner_radius_mm=radius), gel)
        ours = trace_light(light_scene(d, bent), rays, seed=seed, threads=threads)
        points.append((ratio, paired_ratio(ours, other, "arrived")))
    return tuple(points)
