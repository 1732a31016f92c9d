"""Gel, window, bends, legs and LEDs."""

from __future__ import annotations

import numpy as np

from gelslim_cad.dimensions.registry import Real, dimension

GUIDE = "docs/physics.md#light"


@dimension("stack.gel_total_mm", formula="edge thickness + crown")
def stack_gel_total_mm(gel_thickness_mm: Real, gel_crown_height_mm: Real) -> Real:
    """Gel thickness at its centre."""
    return gel_thickness_mm + gel_crown_height_mm


@dimension("stack.gel_bottom_z_mm", formula="-gel total")
def stack_gel_bottom_z_mm(stack_gel_total_mm: Real) -> Real:
    """Plane where the gel is bonded to the acrylic."""
    return -stack_gel_total_mm


@dimension("stack.window_bottom_z_mm", formula="-(gel total + guide thickness)")
def stack_window_bottom_z_mm(stack_gel_total_mm: Real, light_guide_thickness_mm: Real) -> Real:
    """Lower face of the acrylic window."""
    return -(stack_gel_total_mm + light_guide_thickness_mm)


@dimension("guide.inner_radius_mm", formula="R = (R/t) t", source=GUIDE)
def guide_inner_radius_mm(guide_bend_ratio: Real, light_guide_thickness_mm: Real) -> Real:
    """Inner radius of the bends."""
    return guide_bend_ratio * light_guide_thickness_mm


@dimension("guide.outer_radius_mm", formula="R + t", source=GUIDE)
def guide_outer_radius_mm(guide_inner_radius_mm: Real, light_guide_thickness_mm: Real) -> Real:
    """Outer radius of the bends."""
    return guide_inner_radius_mm + light_guide_thickness_mm


@dimension("guide.flat_width_mm", formula="gel width + 2 side margin")
def guide_flat_width_mm(gel_width_mm: Real, light_guide_side_margin_mm: Real) -> Real:
    """Flat part of the window across the finger."""
    return gel_width_mm + 2 * light_guide_side_margin_mm


@dimension("guide.outer_width_mm", formula="flat width + 2 (R + t)")
def guide_outer_width_mm(guide_flat_width_mm: Real, guide_outer_radius_mm: Real) -> Real:
    """Guide across the finger, over the legs."""
    return guide_flat_width_mm + 2 * guide_outer_radius_mm


@dimension("guide.leg_end_z_mm", formula="window bottom - R - leg")
def guide_leg_end_z_mm(
    stack_window_bottom_z_mm: Real, guide_inner_radius_mm: Real, light_guide_leg_length_mm: Real
) -> Real:
    """Entry faces of the legs, where the LEDs sit."""
    return stack_window_bottom_z_mm - guide_inner_radius_mm - light_guide_leg_length_mm


@dimension("guide.distal_end_x_mm", formula="tip ledge + end support, or the mirror's rear edge")
def guide_distal_end_x_mm(
    ledge_distal_x_mm: Real, light_guide_end_support_mm: Real, mirror_rear_x_mm: Real
) -> Real:
    """Tip end of the guide; the tip block begins a fit behind it, and the mirror stays inside."""
    return np.maximum(ledge_distal_x_mm + light_guide_end_support_mm, mirror_rear_x_mm)


@dimension("guide.proximal_end_x_mm", formula="ledge edge - end support")
def guide_proximal_end_x_mm(ledge_edge_x_mm: Real, light_guide_end_support_mm: Real) -> Real:
    """Gripper end of the guide."""
    return ledge_edge_x_mm - light_guide_end_support_mm


@dimension("guide.length_mm", formula="distal end - proximal end")
def guide_length_mm(guide_distal_end_x_mm: Real, guide_proximal_end_x_mm: Real) -> Real:
    """Guide along the finger."""
    return guide_distal_end_x_mm - guide_proximal_end_x_mm


@dimension(
    "guide.blank_width_mm",
    formula="(flat width + 2 (leg + trim + π/2 (R + k t))) / (1 - shrinkage), neutral fibre at k t",
)
def guide_blank_width_mm(
    guide_flat_width_mm: Real,
    light_guide_leg_length_mm: Real,
    guide_inner_radius_mm: Real,
    light_guide_thickness_mm: Real,
    manufacturing_leg_trim_mm: Real,
    manufacturing_bend_neutral_ratio: Real,
    manufacturing_heat_shrinkage_percent: Real,
) -> Real:
    """Flat acrylic blank before bending, across the finger."""
    neutral = manufacturing_bend_neutral_ratio * light_guide_thickness_mm
    leg = light_guide_leg_length_mm + manufacturing_leg_trim_mm
    bent = guide_flat_width_mm + 2 * (leg + np.pi / 2 * (guide_inner_radius_mm + neutral))
    return bent / (1 - manufacturing_heat_shrinkage_percent / 100)


@dimension("guide.blank_length_mm", formula="length / (1 - shrinkage)")
def guide_blank_length_mm(
    guide_length_mm: Real, manufacturing_heat_shrinkage_percent: Real
) -> Real:
    """Flat acrylic blank before bending, along the finger."""
    return guide_length_mm / (1 - manufacturing_heat_shrinkage_percent / 100)


@dimension("guide.full_guidance_ratio", formula="1 / (n - 1): collimated light", source=GUIDE)
def guide_full_guidance_ratio(material_acrylic_refractive_index: Real) -> Real:
    """Least R/t that guides even collimated light."""
    return 1 / (material_acrylic_refractive_index - 1)


@dimension(
    "guide.stack_mm", formula="R + leg + gap + LED + board (+ gap to the cover)", source=GUIDE
)
def guide_stack_mm(
    guide_inner_radius_mm: Real,
    light_guide_leg_length_mm: Real,
    housing_fit_clearance_mm: Real,
    leds_height_mm: Real,
    leds_board_thickness_mm: Real,
) -> Real:
    """Depth below the window that the guide and its LED boards need."""
    return (
        guide_inner_radius_mm
        + light_guide_leg_length_mm
        + 2 * housing_fit_clearance_mm
        + leds_height_mm
        + leds_board_thickness_mm
    )


@dimension("led.count", formula="min(max count, ⌈gel length / max pitch⌉)")
def led_count(gel_length_mm: Real, leds_max_pitch_mm: Real, leds_max_count: Real) -> Real:
    """LEDs per side."""
    return np.minimum(leds_max_count, np.ceil(gel_length_mm / leds_max_pitch_mm - 1e-9))


@dimension("led.pitch_mm", formula="gel length / count")
def led_pitch_mm(gel_length_mm: Real, led_count: Real) -> Real:
    """Distance of neighbouring LEDs; the first stands half a pitch inside the gel's end."""
    return gel_length_mm / led_count


@dimension("led.y_mm", formula="flat width / 2 + R + t/2")
def led_y_mm(
    guide_flat_width_mm: Real, guide_inner_radius_mm: Real, light_guide_thickness_mm: Real
) -> Real:
    """Distance of the LED rows from the mid-plane: red at -y, green at +y."""
    return guide_flat_width_mm / 2 + guide_inner_radius_mm + light_guide_thickness_mm / 2


@dimension("led.top_z_mm", formula="leg end - gap")
def led_top_z_mm(guide_leg_end_z_mm: Real, housing_fit_clearance_mm: Real) -> Real:
    """Emitting faces of the LEDs."""
    return guide_leg_end_z_mm - housing_fit_clearance_mm


@dimension("led.board_width_mm", formula="t + fit clearance (the channel is t + 2 clearances)")
def led_board_width_mm(light_guide_thickness_mm: Real, housing_fit_clearance_mm: Real) -> Real:
    """LED board across the finger."""
    return light_guide_thickness_mm + housing_fit_clearance_mm


@dimension("led.board_bottom_z_mm", formula="LED top - LED height - board thickness")
def led_board_bottom_z_mm(
    led_top_z_mm: Real, leds_height_mm: Real, leds_board_thickness_mm: Real
) -> Real:
    """Back of the LED boards."""
    return led_top_z_mm - leds_height_mm - leds_board_thickness_mm


@dimension("led.board_length_mm", formula="min(gel length + 4, guide length - 1)")
def led_board_length_mm(gel_length_mm: Real, guide_length_mm: Real) -> Real:
    """LED board along the finger."""
    return np.minimum(gel_length_mm + 4.0, guide_length_mm - 1.0)


@dimension("led.datum_mm", formula="t / 2 + fit - board width / 2")
def led_datum_mm(
    light_guide_thickness_mm: Real, housing_fit_clearance_mm: Real, led_board_width_mm: Real
) -> Real:
    """How far the edge that locates an LED board stands out of the channel's outer wall."""
    return light_guide_thickness_mm / 2 + housing_fit_clearance_mm - led_board_width_mm / 2
