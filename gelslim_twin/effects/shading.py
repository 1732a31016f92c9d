"""Red and green light from the sides, falling on a surface that is no longer flat."""

from __future__ import annotations

import math

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.effect import Bound, Effect, Rung, picture
from gelslim_twin.effects.parameters import EffectParameters


class ShadingParameters(EffectParameters):
    """Red from -y, green from +y."""

    unevenness: float = Field(
        default=0.5, ge=0, le=1, description="How much the light varies over the undeformed gel"
    )
    relief: float = Field(
        default=1.0, ge=0, le=4, description="Change of brightness per unit of surface slope"
    )


def slope(c: Circumstances) -> float:
    """Slope of the surface at the rim of the contact: depth over the decay length of the pad."""
    return c.touch.depth_mm / c.sensor.thickness_mm


def bound(c: Circumstances) -> Bound:
    """Grey share of an even picture that the light takes away, as a shift of edges."""
    p = c.given("shading", ShadingParameters)
    return picture(c.edge_shift_px(math.hypot(p.unevenness, p.relief * slope(c))))


def ladder(c: Circumstances) -> tuple[Rung, ...]:
    """The light on the flat gel, or on the deformed surface with its normals."""
    p, size = c.given("shading", ShadingParameters), c.sensor.frame_px / 307200
    flat = picture(c.edge_shift_px(p.relief * slope(c)))
    return (
        Rung("flat gel", flat, 0.6 * size, {"normals": False}),
        Rung("surface normals", Bound(), 2.0 * size, {"normals": True}),
    )


EFFECT = Effect(
    name="shading",
    title="Red and green shading",
    parameters=ShadingParameters,
    bound=bound,
    formula="hypot(unevenness, relief x depth/h) of the grey range x width of an edge",
    ladder=ladder,
    is_null=lambda c: bound(c).image_px == 0,
    implementation="gelslim_twin.render.shading",
    needs=("displacement",),
    refines=("image",),
)
