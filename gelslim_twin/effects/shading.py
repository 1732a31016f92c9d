"""Light from the sides on a surface that is no longer flat: its slopes brighten and darken."""

from __future__ import annotations

import math

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.dot_contrast import shift_px
from gelslim_twin.effects.effect import Effect, Rung, picture

GRAZING_DEG = 18.9
"""Light enters the gel at this angle above its face or more (total reflection acrylic to gel): a
slope s changes what falls on the surface by at most s / tan of that, up to 1 / sin for a surface
that faces the light."""


class ShadingParameters(EffectParameters):
    """The coat is dull; part of the light comes from everywhere."""

    ambient_share: float = Field(
        default=0.3, ge=0, le=1, description="Share of the light that does not mind the slope"
    )


def grey_share(c: Circumstances) -> float:
    """Share of the light that the steepest slope adds or takes away.

    The gel is as steep as the tool, but not steeper than the mesh can be: the depth from one node
    to the next.
    """
    p, t = c.given("shading", ShadingParameters), c.contact
    if t.depth_mm == 0:
        return 0.0
    slope = min(t.depth_mm / c.sensor.node_pitch_mm, c.footprint.steepest(t.depth_mm))
    slope = max(slope, t.depth_mm / c.sensor.thickness_mm)
    angle = math.radians(GRAZING_DEG)
    return (1 - p.ambient_share) * min(1 / math.sin(angle) - 1, slope / math.tan(angle))


def ladder(c: Circumstances) -> tuple[Rung, ...]:
    """A value every few pixels; slopes vary over the thickness h: p² / (8 (h f/Z)²) is missed."""
    size, reach = c.sensor.frame_px / 307200, c.sensor.thickness_mm * c.sensor.px_per_mm
    return tuple(
        Rung(
            f"every {p} px",
            picture(shift_px(c, grey_share(c) * p * p / (8 * reach * reach))),
            (0.6 + 40 / p**2) * size,
            {"pixel_step": p},
        )
        for p in (8, 4, 2, 1)
    )


EFFECT = Effect(
    name="shading",
    title="Red and green shading of the slopes",
    parameters=ShadingParameters,
    bound=lambda c: picture(shift_px(c, grey_share(c))),
    formula="(1 - ambient) min(2.1, slope/tan 18.9 deg) over the ink's contrast x width of an edge",
    ladder=ladder,
    is_null=lambda c: grey_share(c) == 0,
    implementation="gelslim_twin.render.shading",
    needs=("displacement",),
    refines=("image",),
)
