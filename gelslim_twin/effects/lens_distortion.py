"""Brown-Conrady distortion of the lens."""

from __future__ import annotations

import math

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.effect import Bound, Effect, Rung, optics


class LensDistortionParameters(EffectParameters):
    """Lens distortion; the coefficients stand in the sensor."""


def bound(c: Circumstances) -> Bound:
    """Radial and tangential shift at the farthest point of the gel's image."""
    k = dict(c.sensor.lens_distortion)
    rho = c.sensor.half_view_px / c.sensor.focal_px
    radial = sum(
        abs(k.get(name, 0.0)) * rho**power for name, power in (("k1", 3), ("k2", 5), ("k3", 7))
    )
    tangential = 3 * math.hypot(k.get("p1", 0.0), k.get("p2", 0.0)) * rho**2
    return optics(c.sensor.focal_px * (radial + tangential))


EFFECT = Effect(
    name="lens_distortion",
    title="Lens distortion, Brown-Conrady",
    parameters=LensDistortionParameters,
    bound=bound,
    formula="f (|k1| rho³ + |k2| rho⁵ + |k3| rho⁷ + 3 |p| rho²) at the farthest point of the gel",
    ladder=lambda c: (Rung("exact", Bound(), 0.02 * c.sensor.markers / 575),),
    is_null=lambda c: not any(value for _, value in c.sensor.lens_distortion),
    implementation="gelslim_twin.render.scene_camera",
    refines=("markers",),
    after=("refraction",),
)
