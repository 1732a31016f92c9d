"""Refraction at the acrylic and the gel."""

from __future__ import annotations

from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.effect import Bound, Effect, Rung, optics
from gelslim_twin.effects.parameters import EffectParameters


class RefractionParameters(EffectParameters):
    """Refraction; the indices stand in the sensor."""


def bound(c: Circumstances) -> Bound:
    """Straight rays see the gel farther off by the sum of h (1 - 1/n): r times that over Z."""
    return optics(c.sensor.half_view_px * c.sensor.apparent_lift_mm / c.sensor.near_mm)


def paraxial_px(c: Circumstances) -> float:
    """What the apparent depth misses, in the image.

    Its next term, h (n² - 1)/(2 n³) tan²θ0, from sin θ0 = n sin θ; and the depth of a press,
    which looks shallower by 1/n in the gel.
    """
    s = c.sensor
    slope = s.half_view_px / s.focal_px + (s.far_mm - s.near_mm) / max(s.length_mm, 1e-9)
    missed = sum(h / n * (1 - 1 / n**2) / 2 * slope**2 for h, n in s.layers_mm)
    pressed = c.touch.depth_mm * (1 - 1 / max((n for _, n in s.layers_mm), default=1.0))
    return s.half_view_px * (missed + pressed) / s.near_mm


def ladder(c: Circumstances) -> tuple[Rung, ...]:
    """Apparent depths, or Newton's iteration for every ray."""
    dots = c.sensor.markers / 575
    return (
        Rung("apparent depth", optics(paraxial_px(c)), 0.02 * dots, {"rays": "paraxial"}),
        Rung("exact", Bound(), 0.3 * dots, {"rays": "exact"}),
    )


EFFECT = Effect(
    name="refraction",
    title="Refraction in acrylic and gel",
    parameters=RefractionParameters,
    bound=bound,
    formula="r/Z x sum of h (1 - 1/n); apparent depths miss r/Z x sum of h (n²-1)/(2 n³) tan²",
    ladder=ladder,
    is_null=lambda c: all(h == 0 or n == 1 for h, n in c.sensor.layers_mm),
    implementation="gelslim_twin.view.refraction",
    refines=("markers",),
)
