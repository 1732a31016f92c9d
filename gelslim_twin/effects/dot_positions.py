"""Effects on where the camera sees the dots: projection, refraction, lens and print."""

from __future__ import annotations

import math

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.effect import Bound, Effect, Rung, optics


def perspective_bound(c: Circumstances) -> Bound:
    """Without a camera there is no picture: off by as much as the gel's image is wide."""
    return optics(2 * c.sensor.half_view_px)


PERSPECTIVE = Effect(
    name="perspective",
    description="Projection by the camera behind the fold mirror",
    parameters=EffectParameters,
    bound=perspective_bound,
    formula="width of the gel's image",
    ladder=lambda c: (Rung("pinhole", Bound(), 0.05 * c.sensor.markers / 575),),
    implementation="gelslim_twin.render.look",
    needs=("displacement",),
    provides=("markers",),
)


def refraction_bound(c: Circumstances) -> Bound:
    """Straight rays see the gel farther off by what the layers lift it."""
    s = c.sensor
    return optics(s.lifted_px(s.lift_mm(s.oblique_deg)))


def paraxial_px(c: Circumstances) -> float:
    """What the apparent depth misses: the further lift of oblique rays, and pressed-in gel.

    Gel that is pressed away lifts no more. Never worse than straight rays.
    """
    s = c.sensor
    missed = s.lift_mm(s.oblique_deg) - s.lift_mm(0.0)
    pressed = c.contact.depth_mm / s.thickness_mm * s.lift_mm(s.oblique_deg)
    return s.lifted_px(min(missed + pressed, s.lift_mm(s.oblique_deg)))


def refraction_ladder(c: Circumstances) -> tuple[Rung, ...]:
    """Apparent depths, or Newton's iteration for every ray."""
    dots = c.sensor.markers / 575
    return (
        Rung("apparent depth", optics(paraxial_px(c)), 0.02 * dots, {"rays": "paraxial"}),
        Rung("exact", Bound(), 0.1 * dots, {"rays": "exact"}),
    )


REFRACTION = Effect(
    name="refraction",
    description="Refraction of the rays in the acrylic and the gel of the sensor",
    parameters=EffectParameters,
    bound=refraction_bound,
    formula="f/Z lift (sin tilt + r/f), lift = sum of h (1 - cos/sqrt(n² - sin²)) of the ray",
    ladder=refraction_ladder,
    # Rounding may leave a bound above zero where no layer refracts.
    does_nothing=lambda c: all(h == 0 or n == 1 for h, n in c.sensor.layers_mm),
    implementation="gelslim_twin.render.look",
    refines=("markers",),
)


def lens_distortion_bound(c: Circumstances) -> Bound:
    """Radial and tangential shift at the farthest point of the gel's image, exactly refracted."""
    k = dict(c.sensor.lens_distortion)
    rho = (c.sensor.half_view_px + paraxial_px(c)) / c.sensor.focal_px
    angle = math.atan(rho) if c.sensor.wide_lens else rho
    radial = rho - angle + sum(abs(k.get(f"k{i}", 0.0)) * angle ** (2 * i + 1) for i in range(1, 5))
    tangential = 3 * math.hypot(k.get("p1", 0.0), k.get("p2", 0.0)) * rho**2
    return optics(c.sensor.focal_px * (radial + tangential))


LENS_DISTORTION = Effect(
    name="lens_distortion",
    description="Distortion with the model and the coefficients of the sensor's lens",
    parameters=EffectParameters,
    bound=lens_distortion_bound,
    formula="f (|k1| rho³ + |k2| rho⁵ + |k3| rho⁷ + 3 |p| rho²) at the farthest point of the gel; "
    "for a wide lens with angles for rho, and rho less its angle",
    ladder=lambda c: (Rung("exact", Bound(), 0.02 * c.sensor.markers / 575),),
    implementation="gelslim_twin.render.look",
    refines=("markers",),
    after=("refraction",),
)


class MarkerPrintParameters(EffectParameters):
    """Faults of the marker print. With all values at zero the print is perfect."""

    jitter_mm: float = Field(
        default=0.0, ge=0, le=1, description="Standard deviation of a dot's position, per axis"
    )
    missing_percent: float = Field(default=0.0, ge=0, le=90, description="Share of missing dots")
    odd_percent: float = Field(default=0.0, ge=0, le=100, description="Share of irregular dots")


RARE = 1e-3
"""Share of prints of which a dot is farther off than the bound says."""


def marker_print_bound(c: Circumstances) -> Bound:
    """The farthest of all dots; a whole pitch where dots are missing.

    Of n dots off by sigma per axis, none is farther off than sigma sqrt(2 ln(n/p)) in all but a
    share p of the prints (Rayleigh's distribution, union bound).

    Odd dots keep their centres: they change their edges by up to half a radius.
    """
    p, scale = c.given("marker_print", MarkerPrintParameters), c.sensor.px_per_mm
    moved = p.jitter_mm * scale * math.sqrt(2 * math.log(max(c.sensor.markers, 1) / RARE))
    if p.missing_percent > 0:
        moved = max(moved, c.sensor.marker_pitch_mm * scale)
    edge = c.sensor.marker_diameter_mm / 4 * scale if p.odd_percent > 0 else 0.0
    return Bound(markers_px=moved, image_px=max(moved, edge))


MARKER_PRINT = Effect(
    name="marker_print",
    description="Faults of the marker print: displaced, missing and irregular dots",
    parameters=MarkerPrintParameters,
    bound=marker_print_bound,
    formula="sigma sqrt(2 ln(n/0.001)) f/Z; a pitch where dots are missing; d/4 for odd ones",
    ladder=lambda c: (Rung("drawn", optics(0.0), 0.05 * c.sensor.markers / 575),),
    implementation="gelslim_twin.render.print_faults",
    refines=("markers",),
)
