"""JPEG compression of the frames."""

from __future__ import annotations

import math

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.dot_contrast import grey_shift_px
from gelslim_twin.effects.effect import Bound, Effect, Rung, picture

RMS_STEP = 67.1
"""Root mean square of the 64 luminance steps in table K.1 of ITU-T T.81."""


class CompressionParameters(EffectParameters):
    """None unless a quality is given."""

    quality: int | None = Field(default=None, ge=1, le=95, description="JPEG quality")


def grey_levels(quality: int) -> float:
    """Standard deviation of the grey error: uniform in a quantisation step q, q/sqrt(12).

    The usual scaling of the tables: 5000/quality per cent below 50, 200 - 2 quality above; steps
    are at least 1. An orthonormal transform keeps the mean square; rounding adds its own.
    """
    percent = 5000 / quality if quality < 50 else 200 - 2 * quality
    return math.hypot(max(1.0, RMS_STEP * percent / 100), 1.0) / math.sqrt(12)


def bound(c: Circumstances) -> Bound:
    """Three standard deviations, against the dots in the least light."""
    quality = c.given("compression", CompressionParameters).quality
    return picture(0.0 if quality is None else grey_shift_px(c, 3 * grey_levels(quality)))


EFFECT = Effect(
    name="compression",
    title="JPEG compression",
    parameters=CompressionParameters,
    bound=bound,
    formula="3 q_rms/sqrt(12) over the least contrast of a dot x width of an edge",
    ladder=lambda c: (Rung("jpeg", Bound(), 2.0 * c.sensor.frame_px / 307200),),
    is_null=lambda c: c.given("compression", CompressionParameters).quality is None,
    implementation="gelslim_twin.render.compression",
    refines=("image",),
    after=("shading", "dirt", "defocus", "specular", "motion_blur", "exposure", "sensor_noise"),
)
