"""The strip of LEDs at the tip, in front of the window's end face; all 0 where there is none.

Seen from the side; the board stands in a slot of the tip block and shines towards the gripper:

      gel            bezel
    =========  ----------------
      window  | [LED|b|  tip    z of the row: middle of the window's thickness
    =========    ---|-|  block
     shim, ledge   slot's floor

The board is lower than the window is thick, so that it touches neither the bezel nor more than the
floor of its slot; lips of the block hold it by its two ends.
"""

from __future__ import annotations

import numpy as np

from gelslim_cad.dimensions.cable import LANE_GAP_MM
from gelslim_cad.dimensions.registry import Real, dimension
from gelslim_cad.geometry.led_strips import NO_TIP, TIP_LIP_MM

GUIDE = "docs/light_guide.md#a-strip-at-the-tip"
TIP_PLAY_MM = 0.1
"""Between the board and its lips, which their crushed ribs fill."""
TIP_MARGIN_MM = 2.0
"""Of the board beyond the flat part of the window, for the pads of its wires."""
TIP_WIRE_MM = 1.0
"""Of the wires from the edge of the flat part: under the middle of their pads."""


def _with_tip(tip: str, value: Real) -> Real:
    """A value where there is a strip at the tip, else 0."""
    # The sum turns -0.0 into 0.0.
    return value * float(tip != NO_TIP) + 0.0


@dimension("led.tip_count", formula="min(max count, ⌈gel width / max pitch⌉); 0 without")
def led_tip_count(
    gel_width_mm: Real, leds_max_pitch_mm: Real, leds_max_count: Real, leds_tip: str
) -> Real:
    """LEDs at the tip."""
    count = np.minimum(leds_max_count, np.ceil(gel_width_mm / leds_max_pitch_mm - 1e-9))
    return _with_tip(leds_tip, count)


@dimension("led.tip_pitch_mm", formula="gel width / count; 0 without")
def led_tip_pitch_mm(gel_width_mm: Real, led_tip_count: Real) -> Real:
    """Distance of neighbouring LEDs at the tip; the first is half a pitch inside the gel's side."""
    some = np.asarray(led_tip_count) > 0
    return np.where(some, gel_width_mm / np.where(some, led_tip_count, 1), 0.0)[()]


@dimension("led.tip_face_x_mm", formula="guide's tip end + fit; 0 without", source=GUIDE)
def led_tip_face_x_mm(
    guide_distal_end_x_mm: Real, housing_fit_clearance_mm: Real, leds_tip: str
) -> Real:
    """Emitting faces of the LEDs at the tip."""
    return _with_tip(leds_tip, guide_distal_end_x_mm + housing_fit_clearance_mm)


@dimension("led.tip_z_mm", formula="gel bottom - t / 2; 0 without", source=GUIDE)
def led_tip_z_mm(
    stack_gel_bottom_z_mm: Real, light_guide_thickness_mm: Real, leds_tip: str
) -> Real:
    """Height of the row at the tip, the middle of the window's thickness."""
    return _with_tip(leds_tip, stack_gel_bottom_z_mm - light_guide_thickness_mm / 2)


@dimension("led.tip_depth_mm", formula="LED height + board thickness; 0 without", source=GUIDE)
def led_tip_depth_mm(leds_height_mm: Real, leds_board_thickness_mm: Real, leds_tip: str) -> Real:
    """By how much the strip lengthens the finger: from the LEDs' faces to the board's back."""
    return _with_tip(leds_tip, leds_height_mm + leds_board_thickness_mm)


@dimension("led.tip_board_width_mm", formula="t - fit, half of it to bezel and floor; 0 without")
def led_tip_board_width_mm(
    light_guide_thickness_mm: Real, housing_fit_clearance_mm: Real, leds_tip: str
) -> Real:
    """Height of the board at the tip, which stands upright."""
    return _with_tip(leds_tip, light_guide_thickness_mm - housing_fit_clearance_mm)


@dimension("led.tip_board_length_mm", formula="flat width + 2 (2 + lip); 0 without")
def led_tip_board_length_mm(guide_flat_width_mm: Real, leds_tip: str) -> Real:
    """Board at the tip across the finger."""
    return _with_tip(leds_tip, guide_flat_width_mm + 2 * (TIP_MARGIN_MM + TIP_LIP_MM))


@dimension("wire.tip_y_mm", formula="min(flat width / 2 + 1, baffle - gap - wire / 2); 0 without")
def wire_tip_y_mm(
    guide_flat_width_mm: Real,
    baffle_inner_y_mm: Real,
    leds_wire_diameter_mm: Real,
    leds_tip: str,
) -> Real:
    """Where the wires of the tip's board run, between the mirror's seat and the baffle."""
    beside = baffle_inner_y_mm - LANE_GAP_MM - leds_wire_diameter_mm / 2
    return _with_tip(leds_tip, np.minimum(guide_flat_width_mm / 2 + TIP_WIRE_MM, beside))
