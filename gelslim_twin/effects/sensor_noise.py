"""Noise of the image sensor: of the light itself and of reading it out."""

from __future__ import annotations

import math

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.dot_contrast import least_light_dn, shift_px
from gelslim_twin.effects.effect import Bound, Effect, Rung, picture
from gelslim_twin.effects.exposure import ExposureParameters


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
    """Standard deviation of a pixel in the least light, over that light, channels summed.

    sqrt(n + 3 r²)/n with n electrons in the three channels: the full well's share of the light and
    of the exposure time. Gain amplifies both alike.
    """
    p = c.given("sensor_noise", SensorNoiseParameters)
    if p.full_well_electrons == 0:
        return 0.0
    time = c.given("exposure", ExposureParameters).time
    electrons = p.full_well_electrons * least_light_dn(c) / 255 * time
    return math.sqrt(electrons + 3 * p.read_noise_electrons**2) / electrons


EFFECT = Effect(
    name="sensor_noise",
    title="Sensor noise, shot and read",
    parameters=SensorNoiseParameters,
    bound=lambda c: picture(shift_px(c, 3 * sigma_share(c))),
    formula="3 sqrt(n + 3 r²)/n of the least light over the ink's contrast x width of an edge",
    ladder=lambda c: (Rung("drawn", Bound(), 1.5 * c.sensor.frame_px / 307200),),
    is_null=lambda c: sigma_share(c) == 0,
    implementation="gelslim_twin.render.sensor_noise",
    refines=("image",),
    after=("shading", "dirt", "defocus", "specular", "motion_blur", "exposure"),
)
