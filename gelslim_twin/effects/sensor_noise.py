"""Noise of the image sensor: of the light itself and of reading it out."""

from __future__ import annotations

import math

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.effect import Bound, Effect, Rung, picture
from gelslim_twin.effects.exposure import dimming
from gelslim_twin.effects.parameters import EffectParameters


class SensorNoiseParameters(EffectParameters):
    """Typical of a small phone camera sensor with 1.4 µm pixels."""

    full_well_electrons: float = Field(
        default=5000.0,
        ge=0,
        le=1e6,
        description="Electrons of a white pixel, which set the shot noise; 0 for none",
    )
    read_noise_electrons: float = Field(
        default=5.0, ge=0, le=1000, description="Standard deviation of the read-out"
    )


def sigma_share(c: Circumstances) -> float:
    """Standard deviation of a white pixel over white: sqrt(N + r²)/N."""
    p = c.given("sensor_noise", SensorNoiseParameters)
    if p.full_well_electrons == 0:
        return 0.0
    electrons = p.full_well_electrons + p.read_noise_electrons**2
    return math.sqrt(electrons) / p.full_well_electrons


EFFECT = Effect(
    name="sensor_noise",
    title="Sensor noise, shot and read",
    parameters=SensorNoiseParameters,
    bound=lambda c: picture(3 * c.edge_shift_px(sigma_share(c)) / dimming(c)),
    formula="3 sqrt(N + r²)/N of the grey range x width of an edge, over exposure below 1",
    ladder=lambda c: (Rung("drawn", Bound(), 1.5 * c.sensor.frame_px / 307200),),
    is_null=lambda c: sigma_share(c) == 0,
    implementation="gelslim_twin.render.sensor_noise",
    refines=("image",),
    after=("shading", "dirt", "defocus", "specular", "motion_blur", "exposure"),
)
