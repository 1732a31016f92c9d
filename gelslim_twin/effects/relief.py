"""What makes the light around a dot uneven: the slopes of the gel, and dirt."""

from __future__ import annotations

import math

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters

GRAZING_DEG = 18.9
"""Light enters the gel at this angle above its face or more (total reflection acrylic to gel): a
slope s changes what falls on the surface by at most s / tan of that, up to 1 / sin for a surface
that faces the light."""


class ShadingParameters(EffectParameters):
    """The coat of the gel reflects diffusely, in each direction of the traced light."""

    ambient_share: float = Field(
        default=0.0,
        ge=0,
        le=1,
        description="Further share of the light that does not depend on the slope",
    )


def grey_share(c: Circumstances) -> float:
    """Share of the light that the steepest slope adds or takes away.

    The gel is as steep as the tool, but not steeper than the mesh can be: the depth from one node
    to the next. What a probe has found counts where it is less.
    """
    p, t = c.given("shading", ShadingParameters), c.contact
    slope = min(t.depth_mm / c.sensor.node_pitch_mm, c.footprint.steepest(t.depth_mm))
    slope = max(slope, t.depth_mm / c.sensor.thickness_mm)
    angle = math.radians(GRAZING_DEG)
    share = (1 - p.ambient_share) * min(1 / math.sin(angle) - 1, slope / math.tan(angle))
    return share if c.probed is None else min(share, c.probed.light_share)


class DirtParameters(EffectParameters):
    """Without specks and hairs the picture is clean."""

    specks: int = Field(default=0, ge=0, le=10_000, description="Number of dark specks")
    hairs: int = Field(default=0, ge=0, le=10_000, description="Number of dark hairs")
    speck_mm: float = Field(default=0.25, gt=0, le=5, description="Largest diameter of a speck")
    hair_mm: float = Field(default=2.5, gt=0, le=50, description="Length of a hair")
    opacity: float = Field(default=0.6, ge=0, le=1, description="Share of light that dirt absorbs")
