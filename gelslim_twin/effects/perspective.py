"""Folded-mirror perspective: where the camera behind the mirror sees each dot."""

from __future__ import annotations

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.effect import Bound, Effect, Rung, never_null, optics


class PerspectiveParameters(EffectParameters):
    """The camera, folded by the mirror."""


def bound(c: Circumstances) -> Bound:
    """Without a camera there is no picture: off by as much as the gel's image is wide."""
    return optics(2 * c.sensor.half_view_px)


EFFECT = Effect(
    name="perspective",
    title="Folded-mirror perspective",
    parameters=PerspectiveParameters,
    bound=bound,
    formula="width of the gel's image",
    ladder=lambda c: (Rung("pinhole", Bound(), 0.05 * c.sensor.markers / 575),),
    is_null=never_null,
    implementation="gelslim_twin.render.scene_camera",
    needs=("displacement",),
    provides=("markers",),
)
