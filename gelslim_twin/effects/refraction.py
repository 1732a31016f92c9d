"""Refraction at the acrylic and the gel."""

from __future__ import annotations

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.effect import Bound, Effect, Rung, optics


class RefractionParameters(EffectParameters):
    """Refraction; the indices stand in the sensor."""


def bound(c: Circumstances) -> Bound:
    """Straight rays see the gel farther off by what the layers lift it."""
    s = c.sensor
    return optics(s.lifted_px(s.lift_mm(s.oblique_deg)))


def paraxial_px(c: Circumstances) -> float:
    """What the apparent depth misses: the further lift of oblique rays, and pressed-in gel.

    Gel that is pressed away lifts no more. Never worse than straight rays.
    """
    s = c.sensor
    missed = s.lift_mm(s.oblique_deg) - s.lift_mm(0.0)
    pressed = c.contact.depth_mm / s.thickness_mm * s.lift_mm(s.oblique_deg)
    return s.lifted_px(min(missed + pressed, s.lift_mm(s.oblique_deg)))


def ladder(c: Circumstances) -> tuple[Rung, ...]:
    """Apparent depths, or Newton's iteration for every ray."""
    dots = c.sensor.markers / 575
    return (
        Rung("apparent depth", optics(paraxial_px(c)), 0.02 * dots, {"rays": "paraxial"}),
        Rung("exact", Bound(), 0.1 * dots, {"rays": "exact"}),
    )


EFFECT = Effect(
    name="refraction",
    title="Refraction in acrylic and gel",
    parameters=RefractionParameters,
    bound=bound,
    formula="f/Z lift (sin tilt + r/f), lift = sum of h (1 - cos/sqrt(n² - sin²)) of the ray",
    ladder=ladder,
    is_null=lambda c: all(h == 0 or n == 1 for h, n in c.sensor.layers_mm),
    implementation="gelslim_twin.render.scene_camera",
    refines=("markers",),
)
