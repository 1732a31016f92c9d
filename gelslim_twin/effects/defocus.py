"""Defocus: a slim finger is never sharp everywhere."""

from __future__ import annotations

from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.effect import Bound, Effect, Rung, picture
from gelslim_twin.effects.parameters import EffectParameters


class DefocusParameters(EffectParameters):
    """Blur by defocus; aperture and focus stand in the sensor."""


def bound(c: Circumstances) -> Bound:
    """A disc of diameter b spreads an edge over ±b/2: a mean shift of b/4."""
    return picture(c.blur_px / 4)


def ladder(c: Circumstances) -> tuple[Rung, ...]:
    """One disc for the whole frame, or its own for every dot."""
    size = c.sensor.frame_px / 307200
    return (
        Rung("one disc", picture(c.blur_px / 4), 1.0 * size, {"varying": False}),
        Rung("disc per dot", Bound(), 2.5 * size, {"varying": True}),
    )


EFFECT = Effect(
    name="defocus",
    title="Defocus",
    parameters=DefocusParameters,
    bound=bound,
    formula="b/4, b = f A |Z - s|/(Z s); it falls to 0 at best focus, so one disc errs as much",
    ladder=ladder,
    is_null=lambda c: c.blur_px == 0,
    implementation="gelslim_twin.render.defocus",
    refines=("image",),
    after=("shading", "dirt"),
)
