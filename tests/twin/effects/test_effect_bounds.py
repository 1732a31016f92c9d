"""Bounds of the effects on pictures, against values calculated by hand for one sensor."""

from __future__ import annotations

import math

import pytest
from scene_samples import MINIMAL, SENSOR, load

from gelslim_twin.effects.registry import EFFECTS
from gelslim_twin.planning.question import question

BOUND = {effect.name: effect.bound for effect in EFFECTS}
SCALE_PX_PER_MM = 634.9 / 32.0
DOT_PX = 0.5 * SCALE_PX_PER_MM
BLUR_PX = max(634.9 * 1.24 * abs(z - 35.8) / (z * 35.8) for z in (32.0, 40.5))
"""Diameter of the blur disc where it is largest."""
EDGE_PX = math.hypot(1.0, BLUR_PX)
HALF, ALIKE = 2 / math.pi, 0.4
"""What moves a dot of a change on one half of its rim, and of one that is alike all around it."""
TIP_MM_S = 0.5 / 0.5
"""Depth over duration of the press in the sample scene."""


def image_px(folder, effect: str, block: str) -> float:
    """Bound of an effect with the parameters `block`, in px of the picture."""
    text = MINIMAL.replace("[force]", "[image]") + f"effects:\n  {effect}: {{{block}}}\n"
    return BOUND[effect](question(load(folder, text), SENSOR).circumstances).image_px


@pytest.mark.parametrize(
    ("effect", "block", "expected_px"),
    [
        # Opacity over the ink's contrast times the diameter of a speck; a hair is a fifth as wide.
        # One half of the rim moves, and the centre by 2/pi of that.
        (
            "dirt",
            "specks: 3, speck_mm: 0.2, opacity: 0.4",
            HALF * 0.1 * SCALE_PX_PER_MM,
        ),
        (
            "dirt",
            "hairs: 2, speck_mm: 0.2, opacity: 0.4",
            HALF * 0.02 * SCALE_PX_PER_MM,
        ),
        # At most half a dot and half a speck: the distance of their centres when they touch.
        ("dirt", "specks: 1, speck_mm: 5, opacity: 1", HALF * (DOT_PX + 5 * SCALE_PX_PER_MM) / 2),
        ("dirt", "opacity: 1", 0.0),
        # A quarter of the blur disc, half the path of a dot 1.5 times as fast as the tool, a
        # quarter of a dot.
        ("defocus", "use: auto", ALIKE * BLUR_PX / 4),
        ("defocus", "still_px: 2", ALIKE * math.hypot(BLUR_PX, 8) / 4),
        ("motion_blur", "shutter_ms: 20", 1.5 * TIP_MM_S * 0.02 * SCALE_PX_PER_MM / 2),
        ("marker_print", "odd_percent: 1", DOT_PX / 4),
        ("marker_print", "missing_percent: 1", 1.0 * SCALE_PX_PER_MM),
        (
            "marker_print",
            "jitter_mm: 0.01",
            0.01 * SCALE_PX_PER_MM * math.sqrt(2 * math.log(575 / 1e-3)),
        ),
        # Saturated at the diameter of a dot, or at the largest spot.
        ("specular", "spots: 1, brightness_percent: 1000, radius_px: 200", HALF * DOT_PX),
        ("specular", "spots: 1, brightness_percent: 1000, radius_px: 2", HALF * 6.0),
        ("specular", "spots: 1, brightness_percent: 1", HALF * EDGE_PX * 5.1 / (0.8 * 0.35 * 80)),
    ],
)
def test_bounds_are_those_calculated_by_hand(tmp_path, effect, block, expected_px):
    assert image_px(tmp_path, effect, block) == pytest.approx(expected_px, rel=1e-9)
