"""Exposure and noise of the image sensor, as effects."""

from __future__ import annotations

import math

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.dot_contrast import (
    SIDES,
    ExposureParameters,
    edge_px,
    is_even,
    least_light_dn,
    rim_px,
    shift_px,
)
from gelslim_twin.effects.effect import Bound, Effect, Rung, picture


class SensorNoiseParameters(EffectParameters):
    """The default values are those of a small phone camera with pixels of 1.4 µm."""

    full_well_electrons: float = Field(
        default=5000.0,
        ge=0,
        le=1e6,
        description="Electrons of a white pixel, for the shot noise; 0 switches all noise off",
    )
    read_noise_electrons: float = Field(
        default=5.0, ge=0, le=1000, description="Standard deviation of the read noise"
    )
    grain_px: float = Field(
        default=0.0,
        ge=0,
        le=8,
        description="Standard deviation of the Gaussian filter that correlates the noise of "
        "neighbouring pixels, as demosaicing and compression do; 0 for none",
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


def sensor_noise_bound(c: Circumstances) -> Bound:
    """Three standard deviations of a pixel as shift of an edge; the rim's where light is even.

    Of noise that a Gaussian filter of standard deviation g correlates, 1/(4 pi g²) averages out.
    """
    share = sigma_share(c)
    px = shift_px(c, 3 * share)
    if not is_even(c):
        return picture(px)
    grain_px = c.given("sensor_noise", SensorNoiseParameters).grain_px
    return picture(min(px, rim_px(c, share) * math.sqrt(1 + 4 * math.pi * grain_px**2)))


SENSOR_NOISE = Effect(
    name="sensor_noise",
    description="Shot noise and read noise of the image sensor",
    parameters=SensorNoiseParameters,
    bound=sensor_noise_bound,
    formula="s = sqrt(n + 3 r²)/n of the least light over the ink's contrast: 3 s w for an edge of "
    "width w, 2 s sqrt(w/(pi R)) sqrt(2 ln(dots x poses/0.001)) where the light is even",
    ladder=lambda c: (Rung("drawn", Bound(), 1.5 * c.sensor.frame_px / 307200),),
    implementation="gelslim_twin.render.image_sensor",
    refines=("image",),
    after=("shading", "dirt", "defocus", "specular", "motion_blur", "exposure"),
    is_scattered=True,
)


def exposure_bound(c: Circumstances) -> Bound:
    """The width of an edge: brighter everywhere, edges stay between dark and bright.

    Exposure and response change the grey values of the two sides of an edge and of what lies
    between in the same order; of the width, the share by which they change them, at most all:
    |time gain - 1| and the largest |v^e - v| of the response. Where the light is even a part of
    that is left, since all sides of a dot change alike; the noise of the picture changes besides.
    """
    p = c.given("exposure", ExposureParameters)
    tone, exponent = 0.0, 1 / p.gamma
    if exponent != 1:
        v = exponent ** (1 / (1 - exponent))
        tone = abs(v**exponent - v)
    changed = abs(p.time * p.gain - 1) + tone
    alike_px = edge_px(c)
    if is_even(c):
        alike_px = min(alike_px, SIDES * alike_px + sensor_noise_bound(c).image_px)
    return picture(alike_px * min(1.0, changed))


EXPOSURE = Effect(
    name="exposure",
    description="Exposure, saturation and response curve of the camera",
    parameters=ExposureParameters,
    bound=exposure_bound,
    formula="min(1, |time gain - 1| + largest |v^(1/gamma) - v|) x width of an edge, where the "
    "light is even x 0.4 of that and the bound of noise",
    ladder=lambda c: (Rung("per pixel", Bound(), 0.4 * c.sensor.frame_px / 307200),),
    implementation="gelslim_twin.render.image_sensor",
    refines=("image",),
    after=("shading", "dirt", "defocus", "specular", "motion_blur"),
    is_scattered=True,
)
