"""Faults of the marker print: dots off their places, missing, of odd size."""

from __future__ import annotations

import math

from pydantic import Field

from gelslim_twin.effects.circumstances import Circumstances, EffectParameters
from gelslim_twin.effects.effect import Bound, Effect, Rung, optics


class MarkerPrintParameters(EffectParameters):
    """Faults of the print; all nil is a perfect print."""

    jitter_mm: float = Field(
        default=0.0, ge=0, le=1, description="Standard deviation of a dot's place, per axis"
    )
    missing_percent: float = Field(default=0.0, ge=0, le=90, description="Dots that are missing")
    odd_percent: float = Field(default=0.0, ge=0, le=100, description="Dots of odd size and shape")


RARE = 1e-3
"""Share of prints of which a dot is farther off than the bound says."""


def is_null(c: Circumstances) -> bool:
    """Whether the print is perfect."""
    p = c.given("marker_print", MarkerPrintParameters)
    return p.jitter_mm == 0 and p.missing_percent == 0 and p.odd_percent == 0


def bound(c: Circumstances) -> Bound:
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


EFFECT = Effect(
    name="marker_print",
    title="Marker print: jitter, missing and odd dots",
    parameters=MarkerPrintParameters,
    bound=bound,
    formula="sigma sqrt(2 ln(n/0.001)) f/Z; a pitch where dots are missing; d/4 for odd ones",
    ladder=lambda c: (Rung("drawn", optics(0.0), 0.05 * c.sensor.markers / 575),),
    is_null=is_null,
    implementation="gelslim_twin.render.print_faults",
    refines=("markers",),
)
