"""Circumstances of a contact with every figure different, for tests of bounds and ladders."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from scene_samples import SENSOR

from gelslim_twin.effects.circumstances import (
    Circumstances,
    EffectParameters,
    MotionFigures,
    SensorFigures,
)
from gelslim_twin.effects.contact_estimate import Footprint
from gelslim_twin.effects.effect import Bound
from gelslim_twin.effects.registry import EFFECTS

BALL_MM = 14.0
FIGURES = replace(
    SENSOR,
    length_mm=27.0,
    width_mm=19.0,
    thickness_mm=1.9,
    poissons_ratio=0.41,
    surface_nodes=1300,
    layers=3,
    markers=410,
    marker_pitch_mm=1.1,
    marker_diameter_mm=0.6,
    image_width_px=800,
    image_height_px=600,
)
"""A sensor whose pad, frame and grid of dots are not square."""
MOTION = MotionFigures(
    poses=7,
    depth_mm=0.35,
    lateral_mm=0.8,
    twist_deg=12.0,
    tilt_deg=3.0,
    contact_s=1.7,
    speed_mm_s=2.6,
)
APART = replace(MOTION, depth_mm=0.0)
"""No contact."""
SCALE = 634.9 / 32.0
"""Pixels per mm where the gel is seen largest."""
BOUND = {effect.name: effect.bound for effect in EFFECTS}
IS_NULL = {effect.name: effect.is_null for effect in EFFECTS}
LADDER = {effect.name: effect.ladder for effect in EFFECTS}


def ball(radius_mm: float = BALL_MM) -> Footprint:
    """A ball, in closed form."""
    return Footprint(
        area_mm2=lambda d: math.pi * (2 * radius_mm * d - d * d),
        volume_mm3=lambda d: math.pi * d * d * (radius_mm - d / 3),
        reach_mm=lambda d: math.sqrt(2 * radius_mm * d - d * d),
        steepest=lambda d: math.sqrt(2 * radius_mm * d - d * d) / (radius_mm - d),
        width_mm=lambda d: 2 * math.sqrt(2 * radius_mm * d - d * d),
    )


def circumstances(
    friction: float = 0.6,
    footprint: Footprint | None = None,
    sensor: SensorFigures = FIGURES,
    motion: MotionFigures = MOTION,
    **parameters: EffectParameters,
) -> Circumstances:
    """A ball dragged over the pad, effects with their default parameters unless given."""
    given = {e.name: e.parameters() for e in EFFECTS}
    return Circumstances(sensor, motion, footprint or ball(), friction, given | parameters)


def values(bound: Bound) -> tuple[float, ...]:
    """Errors of force, displacement, markers and image."""
    return (bound.force_n, bound.displacement_px, bound.markers_px, bound.image_px)


def same(found: Bound, expected: Bound) -> None:
    """Agreement but for rounding."""
    assert values(found) == pytest.approx(values(expected), rel=1e-9)
