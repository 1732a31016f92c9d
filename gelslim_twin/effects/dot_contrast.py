"""The drawn dots, their blur and their brightness, and the shift that a change of grey stands for.

A picture is evaluated by its dots, on the sum of the colour channels. A change of grey by v shifts
the edge of a dot by at most v over the slope of the edge, which is contrast over width. The darkest
place of the picture counts, where the contrast is least. A dot that is shifted by its own diameter
is no longer that dot, so that the shift is at most this diameter.

A detector finds a dot by its whole rim, and much of what shifts an edge is alike on all sides or
differs from pixel to pixel. That averages out (`SIDES`, `rim_px`) where the light around the dots
is even (`is_even`): it does not beside a wall or dirt whose darkness a detector takes for a part
of a dot, where a change of one grey value may decide what belongs to it.
"""

from __future__ import annotations

import math

from pydantic import Field

from gelslim_twin.effects.circumstances import LEAST_LIGHT, Circumstances, EffectParameters
from gelslim_twin.effects.dot_positions import RARE
from gelslim_twin.effects.effect import Bound, Effect, Rung, picture
from gelslim_twin.effects.relief import DirtParameters, grey_share


class DrawingParameters(EffectParameters):
    """The dots are drawn as exact areas of ink, lit by the light of the guide."""

    level_dn: float = Field(
        default=80.0, gt=0, le=10_000, description="Grey value of the bare gel in full light"
    )
    contrast: float = Field(default=0.8, gt=0, le=1, description="Share of light that ink absorbs")


def dot_px(c: Circumstances) -> float:
    """Diameter of a dot where it is seen largest."""
    return c.sensor.marker_diameter_mm * c.sensor.px_per_mm


DRAWING = Effect(
    name="drawing",
    description="The picture of the printed dots",
    parameters=DrawingParameters,
    bound=lambda c: picture(dot_px(c)),
    formula="diameter of a dot",
    ladder=lambda c: (Rung("exact area", Bound(), 5.0 * c.sensor.frame_px / 307200),),
    implementation="gelslim_twin.render.frame_renderer",
    needs=("markers",),
    provides=("image",),
)


FLOOR_PX = 0.01
"""What a change of a few pixels by one grey value may move a dot by."""
DARK = 0.25
"""Darkness of dirt over that of a dot from which a detector takes it for a part of the dot: the
weight of a pixel begins there (`DetectorSettings.weight_from`)."""
FAINT = 0.5
"""The same for the shade at a wall of the tool, of which `grey_share` is a bound: in random scenes
dots jumped from 0.7 on."""
SIDES = 0.4
"""Share of a change of its edges by which a dot is shifted where the change is alike on all sides,
as that of blur and exposure: by the gradient of the light and by how its rim meets the pixels. In
47 random scenes with even light up to 0.2 was needed, and in 37 that were not looked at before up
to 0.24."""
RIM_GAIN, RIM_SAFETY = 4 / 3, 1.5
"""Change of a pixel's weight over that of its darkness over that of the dot: the weight rises from
0 to 1 between 1/4 and the whole (`DetectorSettings`). The factor is for the noise of the ring that
tells the light, and for dots that are seen obliquely; in 47 and 37 random scenes 0.66 and 0.95 of
the product without it was needed."""


def is_even(c: Circumstances) -> bool:
    """Whether neither dirt nor the shade at a wall is as dark as what counts as part of a dot."""
    p = c.given("dirt", DirtParameters)
    dirt = p.opacity if p.specks or p.hairs else 0.0
    shade = grey_share(c) if c.has_walls else 0.0
    return dirt < DARK * contrast(c) and shade < FAINT * contrast(c)


def rim_px(c: Circumstances, sigma_share: float) -> float:
    """Shift of the farthest dot by noise of the pixels, where the light is even.

    The rim of a dot of radius R is w wide. Noise of standard deviation s of a pixel, over its
    darkness, moves each pixel of the rim's length by sqrt(w) s across it, and the centroid by
    sqrt(w/(pi R)) s along either axis: the sum of (R cos)² over 2 pi R pixels is pi R³, and the
    area pi R². Of all dots in all frames none is farther off than that times sqrt(2 ln(n/p)) in all
    but a share p of the runs (Rayleigh's distribution, union bound). The smallest dots count.
    """
    s = c.sensor
    radius_px = s.marker_diameter_mm * s.focal_px / s.far_mm / 2
    of_rim = RIM_GAIN * math.sqrt(edge_px(c) / (math.pi * radius_px))
    sigma_px = RIM_SAFETY * of_rim * sigma_share / contrast(c)
    count = max(1, s.markers) * max(1, c.motion.poses)
    return sigma_px * math.sqrt(2 * math.log(count / RARE))


class DefocusParameters(EffectParameters):
    """Blur by defocus. Aperture and focus distance are those of the sensor."""

    still_px: float = Field(
        default=0.0,
        ge=0,
        le=8,
        description="Standard deviation of the blur in focus, from aberrations and diffraction",
    )


def diameter_px(c: Circumstances) -> float:
    """Diameter of the disc with the spread of both, four standard deviations."""
    return math.hypot(c.blur_px, 4 * c.given("defocus", DefocusParameters).still_px)


def edge_px(c: Circumstances) -> float:
    """Width over which the edge of a dot turns from dark to bright: blur, at least a pixel."""
    return math.hypot(1.0, diameter_px(c))


def defocus_bound(c: Circumstances) -> Bound:
    """A quarter of the diameter of the blur, and less of that where the light is even."""
    return picture(diameter_px(c) / 4 * (SIDES if is_even(c) else 1.0))


DEFOCUS = Effect(
    name="defocus",
    description="Blur of the parts of the gel that are out of focus",
    parameters=DefocusParameters,
    bound=defocus_bound,
    formula="b/4: a disc of diameter b = f A |Z - s|/(Z s) spreads an edge over b; x 0.4 where the "
    "light is even",
    ladder=lambda c: (Rung("own blur per dot", Bound(), 0.5 + 1.0 * c.sensor.frame_px / 307200),),
    implementation="gelslim_twin.render.defocus",
    refines=("image",),
    after=("shading", "dirt"),
    is_scattered=True,
)


class ExposureParameters(EffectParameters):
    """With all values at 1 the picture stays as it is."""

    time: float = Field(default=1.0, gt=0, le=1000, description="Exposure time over the normal one")
    gain: float = Field(default=1.0, gt=0, le=1000, description="Amplification of signal and noise")
    gamma: float = Field(
        default=1.0, ge=0.2, le=5, description="Inverse of the exponent of the response curve"
    )


def toned(share: float, gamma: float) -> float:
    """Grey over white of a light over what saturates."""
    return float(min(1.0, share) ** (1 / gamma))


def least_light_dn(c: Circumstances) -> float:
    """Grey value of the bare gel in the least light at the usual exposure.

    Dirt and the shade at walls may leave as little as where nothing is known.
    """
    light = c.sensor.least_light if is_even(c) else min(LEAST_LIGHT, c.sensor.least_light)
    return light * c.given("drawing", DrawingParameters).level_dn


def contrast(c: Circumstances) -> float:
    """Share of the light that the ink takes."""
    return c.given("drawing", DrawingParameters).contrast


def least_contrast_dn(c: Circumstances) -> float:
    """What a dot lacks in grey values in the least light, after exposure and response."""
    p = c.given("exposure", ExposureParameters)
    bare = least_light_dn(c) * p.time * p.gain / 255
    return 255 * (toned(bare, p.gamma) - toned(bare * (1 - contrast(c)), p.gamma))


def shift_px(c: Circumstances, light_share: float) -> float:
    """Shift of a dot's edge by a change of the light by `light_share` of itself."""
    return min(dot_px(c), edge_px(c) * light_share / contrast(c))


def grey_shift_px(c: Circumstances, grey_dn: float) -> float:
    """Shift of a dot's edge by grey values added to the finished picture."""
    least = least_contrast_dn(c)
    return min(dot_px(c), edge_px(c) * grey_dn / least) if least > 0 else dot_px(c)
