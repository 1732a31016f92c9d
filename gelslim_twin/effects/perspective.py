"""Folded-mirror perspective: where the camera behind the mirror sees each dot."""

from __future__ import annotations

from gelslim_twin.effects.circumstances import Circumstances
from gelslim_twin.effects.effect import Bound, Effect, Rung, never_null, optics
from gelslim_twin.effects.parameters import EffectParameters


class PerspectiveParameters(EffectParameters):
    """The camera, folded by the mirror."""


def bound(c: Circumstances) -> Bound:
    """Without a camera there is no picture: off by as much as the gel's image is wide."""
    return optics(2 * c.sensor.half_view_px)


def affine_px(c: Circumstances) -> float:
    """What one scale for all of the gel misses: the scale varies by ±(k-1)/(k+1) about its mean."""
    keystone = c.sensor.far_mm / c.sensor.near_mm
    lift = c.touch.depth_mm / c.sensor.near_mm
    return c.sensor.half_view_px * ((keystone - 1) / (keystone + 1) + lift)


def ladder(c: Circumstances) -> tuple[Rung, ...]:
    """One affine map, or a pinhole for every dot."""
    dots = c.sensor.markers / 575
    return (
        Rung("affine", optics(affine_px(c)), 0.02 * dots, {"map": "affine"}),
        Rung("pinhole", Bound(), 0.05 * dots, {"map": "pinhole"}),
    )


EFFECT = Effect(
    name="perspective",
    title="Folded-mirror perspective",
    parameters=PerspectiveParameters,
    bound=bound,
    formula="width of the gel's image; one scale for all misses r ((k-1)/(k+1) + depth/Z)",
    ladder=ladder,
    is_null=never_null,
    implementation="gelslim_twin.render.projection",
    needs=("displacement",),
    provides=("markers",),
)
