"""Motion blur: the tool moves while the shutter is open."""

from __future__ import annotations

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.dot_contrast import edge_px
from gelslim_twin.effects.effect import Bound, Effect, Rung, picture


class MotionBlurParameters(EffectParameters):
    """Smear over the exposure."""

    shutter_ms: float = Field(
        default=5.0, ge=0, le=1000, description="Time the shutter is open, up to the pose's time"
    )


def smear_px(c: Circumstances) -> float:
    """How far a dot moves while the shutter is open."""
    open_s = c.given("motion_blur", MotionBlurParameters).shutter_ms / 1000
    return c.motion.speed_mm_s * open_s * c.sensor.px_per_mm


def bound(c: Circumstances) -> Bound:
    """Half the smear: how far the middle of the smeared dot lags behind."""
    return picture(smear_px(c) / 2)


def ladder(c: Circumstances) -> tuple[Rung, ...]:
    """Instants averaged: n of them leave a staircase.

    A step q = smear/n of it shifts the middle of an edge by at most q/4. Where it is narrower than
    the edge it is not seen: the second moment lacks q²/12, which changes an edge of width w as a
    shift of q²/(12 w) does, or less.
    """
    size, width = c.sensor.frame_px / 307200, edge_px(c)
    steps = {n: smear_px(c) / n for n in (2, 4, 8, 16, 32)}
    return tuple(
        Rung(
            f"{n} instants",
            picture(min(q / 4, q * q / (12 * width))),
            (1.0 + 0.1 * n) * size,
            {"most_poses": n},
        )
        for n, q in steps.items()
    )


EFFECT = Effect(
    name="motion_blur",
    title="Motion blur",
    parameters=MotionBlurParameters,
    bound=bound,
    formula="v t f/(2 Z)",
    ladder=ladder,
    is_null=lambda c: smear_px(c) == 0,
    implementation="gelslim_twin.render.motion_blur",
    refines=("image",),
    after=("shading", "dirt", "defocus"),
)
