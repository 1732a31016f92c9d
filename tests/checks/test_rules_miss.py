"""Every rule holds for the shipped fingers, and misses when its design is spoilt."""

from __future__ import annotations

from typing import Any

import pytest
from rule_samples import judged, shipped, smallest

from gelslim_cad.checks import RULES, check
from gelslim_cad.dimensions import derive

LONG = {"design.gel.length_mm": 50.0, "design.gel.width_mm": 25.0}

# Rule: what is changed in the spec (or, after "=", put in by hand), and how it must end.
SPOILT: dict[str, list[tuple[dict[str, Any], str]]] = {
    "guide.bend_ratio": [
        ({"design.light_guide.bend_radius_ratio": 1.5}, "warn"),
        ({"design.light_guide.bend_radius_ratio": 0.4}, "fail"),
    ],
    "led.colours_nm": [
        ({"camera.picture": "mono"}, "warn"),
        ({"design.leds.one_wavelength_nm": 525.0}, "warn"),
    ],
    "led.fits_mm": [({"design.leds.package_mm": 2.3}, "fail")],
    "led.gap_mm": [({"design.leds.max_pitch_mm": 2.2}, "fail")],
    "led.pitch_mm": [({"design.leds.max_count": 2}, "warn")],
    "led.on_board_mm": [
        ({"design.leds.max_pitch_mm": 1.0, "design.leds.max_count": 50,
          "design.light_guide.end_support_mm": 0.5}, "fail"),
    ],
    "led.board_width_mm": [({"design.leds.package_mm": 3.0}, "fail")],
    "wire.tip_room_mm": [
        ({"design.leds.tip": "blue", "design.light_guide.bend_radius_ratio": 0.8}, "fail"),
    ],
    "led.tip_lip_mm": [
        ({"design.leds.tip": "blue", "manufacturing.print_process": "fdm"}, "warn"),
    ],
    "guide.stock_mm": [({"design.light_guide.thickness_mm": 2.6}, "fail")],
    "mirror.stock_mm": [({"design.mirror.thickness_mm": 1.2}, "fail")],
    "gel.on_window_mm": [
        ({"design.light_guide.side_margin_mm": 0.2}, "warn"),
        ({"design.light_guide.side_margin_mm": 0.05}, "fail"),
    ],
    "gel.index": [
        ({"material.gel.refractive_index": 1.35}, "warn"),
        ({"material.gel.refractive_index": 1.1}, "fail"),
    ],
    "print.overhang_mm": [({"manufacturing.print_process": "fdm"}, "warn")],
    "mould.cure": [({"manufacturing.mould_process": "sla"}, "warn")],
    "mould.gel_mm": [
        ({"design.gel.thickness_mm": 0.8}, "warn"),
        ({"design.gel.thickness_mm": 0.4}, "fail"),
    ],
    "mould.shrinkage_percent": [({"manufacturing.gel_shrinkage_percent": 3.0}, "warn")],
    "gel.crown_mm": [
        ({"design.gel.crown_height_mm": 1.5}, "warn"),
        ({"design.gel.crown_height_mm": 4.0}, "fail"),
    ],
    "marker.pitch_ratio": [({"design.markers.pitch_mm": 0.9}, "fail")],
    "marker.diameter_mm": [({"design.markers.diameter_mm": 0.25}, "fail")],
    "marker.gap_mm": [({"design.markers.pitch_mm": 0.9}, "fail")],
    "marker.inside_mm": [
        ({"design.markers.rows": 17, "design.markers.pitch_mm": 1.21}, "warn"),
        ({"=marker_grid.span_x_mm": 20.0}, "fail"),
    ],
    "marker.corner_mm": [({"design.gel.corner_radius_mm": 8.0}, "warn")],
    "marker.lattice": [
        ({"design.markers.pitch_mm": 3.0}, "warn"),
        ({"design.markers.pitch_mm": 6.0}, "fail"),
    ],
    "marker.anchors": [({"design.markers.anchors": "none"}, "warn")],
    "gel.modulus_mpa": [
        ({"material.gel.youngs_modulus_mpa": 2.0}, "warn"),
        ({"=material.gel.youngs_modulus_mpa": 6.0}, "fail"),
    ],
    "gel.too_soft_mpa": [({"material.gel.youngs_modulus_mpa": 0.01}, "warn")],
    "mesh.layers": [
        ({"material.gel.poissons_ratio": 0.42, "mesh.layers": 1}, "warn"),
        ({"material.gel.poissons_ratio": 0.46, "mesh.layers": 1}, "fail"),
    ],
    "mesh.alignment_mm": [({"mesh.cells_along": 30, "mesh.cells_across": 30}, "warn")],
    "mesh.aspect": [
        ({"mesh.layers": 32}, "warn"),
        ({"mesh.layers": 32, "mesh.nodes_per_marker_pitch": 1, "design.markers.pitch_mm": 4.0},
         "fail"),
    ],
    "mesh.crown_mm": [({"mesh.layers": 1, "design.gel.crown_height_mm": 0.3}, "fail")],
    "mesh.size": [
        ({"mesh.nodes_per_marker_pitch": 20, "mesh.layers": 1}, "warn"),
        ({"mesh.nodes_per_marker_pitch": 20, "mesh.layers": 8}, "fail"),
    ],
    "finger.thickness_mm": [({"design.envelope.max_thickness_mm": 17.0}, "fail")],
    "finger.width_mm": [({"design.envelope.max_width_mm": 30.0}, "fail")],
    "finger.length_mm": [({"design.envelope.max_length_mm": 50.0}, "fail")],
    "coverage.along": [({"=view.along_use": 0.99}, "fail")],
    "coverage.across": [({"=view.across_use": 0.99}, "fail")],
    "focus.travel_mm": [({"camera.lens_travel_mm": 0.1}, "fail")],
    "focus.view_percent": [
        ({"camera.focusing": "internal", "camera.horizontal_fov_deg": 50.0,
          "camera.field_of_view_at_mm": 60.0}, "fail"),
    ],
    "blur.gel": [
        ({"design.optics.blur_per_diameter": 0.45}, "warn"),
        ({"design.optics.blur_per_diameter": 0.7}, "fail"),
        ({"=view.near_blur_mm": 0.31}, "fail"),
    ],
    "blur.limit": [
        ({"=view.far_blur_mm": 0.21}, "fail"),
        ({"=view.near_blur_mm": 0.21}, "fail"),
    ],
    "blur.image_px": [({}, "warn")],
    "marker.far_px": [(LONG, "fail")],
    "view.keystone": [({"=view.keystone": 2.5}, "fail"), ({"=view.keystone": 0.4}, "fail")],
    "mirror.before_camera_mm": [({"=mirror.lower_x_mm": -25.0}, "fail")],
    "fold.feasible": [(LONG, "fail")],
    "led.hidden_mm": [({"=led.top_z_mm": -9.9}, "fail")],
    "mirror.between_baffles_mm": [({"=mirror.width_mm": 29.0}, "fail")],
    "view.between_baffles_mm": [
        ({"design.light_guide.bend_radius_ratio": 0.3, "design.housing.baffle_mm": 2.0}, "fail"),
    ],
    "wall.thinnest_mm": [
        ({"design.housing.baffle_mm": 0.5}, "fail"),
        ({"design.housing.ledge_mm": 0.5}, "fail"),
        ({"design.housing.side_wall_mm": 0.7, "manufacturing.print_process": "fdm"}, "fail"),
    ],
    "fit.clearance_mm": [
        ({"design.housing.fit_clearance_mm": 0.12, "manufacturing.print_process": "fdm"}, "warn"),
        ({"design.housing.fit_clearance_mm": 0.08}, "fail"),
    ],
    "bezel.thickness_mm": [
        ({"design.housing.gel_proud_mm": 0.9}, "warn"),
        ({"design.housing.gel_proud_mm": 1.2}, "fail"),
    ],
    "cover.thickness_mm": [({"design.housing.back_wall_mm": 1.0}, "fail")],
    "gel.proud_mm": [
        ({"design.housing.gel_proud_mm": 0.1}, "warn"),
        ({"=design.housing.gel_proud_mm": -0.1}, "fail"),
    ],
    "screw.wall_mm": [({"design.housing.tip_wall_mm": 4.0}, "fail")],
    "screw.apart_mm": [({"=finger.width_mm": 12.0}, "fail")],
    "corner.screw_mm": [({"design.housing.corner_radius_mm": 15.0}, "fail")],
    "bezel.stock_mm": [({"design.housing.gel_proud_mm": 0.6}, "warn")],
    "precompression.tolerance_mm": [
        ({"design.housing.precompression_mm": 0.3}, "fail"),
        ({"design.housing.bezel_material": "printed"}, "fail"),
        ({"tolerance.acrylic": "as_bought"}, "fail"),
        ({"tolerance.shim_mm": 0.3}, "fail"),
    ],
    "window.stress_mpa": [
        ({"=window.stress_mpa": 25.0}, "fail"),
    ],
    "precompression.shim_mm": [({"design.housing.precompression_mm": 0.7}, "fail")],
    "clamp.beside_channel_mm": [
        ({"=clamp.width_mm": 40.0, "=camera_pose.front_x_mm": -11.0}, "fail"),
    ],
    "clamp.before_seat_mm": [({"=clamp.front_x_mm": -5.0}, "fail")],
    "screw.shortest_mm": [({"design.mount.tongue_thickness_mm": 11.0}, "fail")],
    "thread.engagement_ratio": [
        ({"design.housing.thread": "self_cut"}, "fail"),
        ({"=thread.cover_mm": 1.9}, "fail"),
        ({"=thread.roof_mm": 1.9}, "fail"),
        ({"=thread.roof_mm": 1.5, "=thread.boss_room_mm": 0.0}, "fail"),
    ],
    "thread.depth_mm": [
        ({"design.mount.tongue_thickness_mm": 9.0}, "fail"),
        ({"=thread.roof_depth_mm": 3.0}, "fail"),
        ({"=thread.roof_depth_mm": 1.9, "=thread.boss_room_mm": 0.0}, "fail"),
    ],
    "thread.wall_mm": [({"design.housing.tip_wall_mm": 4.5}, "fail")],
    "thread.load_n": [({"=thread.load_n": 180.0}, "fail")],
    "mount.bolt_mm": [({"camera.cable_width_mm": 25.0}, "fail")],
    "mount.head_mm": [({"camera.cable_width_mm": 25.0}, "fail")],
    "mount.block_mm": [({"design.mount.tongue_thickness_mm": 14.0}, "fail")],
    "mount.cover_screw_mm": [({"design.mount.tongue_thickness_mm": 12.0}, "fail")],
    "mount.tongue_mm": [({"design.mount.tongue_length_mm": 5.0}, "fail")],
    "object.size_mm": [
        ({"design.mount.gripper": "wsg32", "design.mount.object_size_mm": 60.0}, "fail"),
    ],
    "object.mass_g": [({"design.mount.object_mass_g": 600.0}, "fail")],
    "gripper.force_n": [
        ({"design.mount.gripper": "wsg50", "design.mount.grip_force_n": 4.0}, "fail"),
        ({"design.mount.gripper": "wsg50", "design.mount.grip_force_n": 81.0}, "fail"),
    ],
    "grip.tongue_mpa": [({"design.mount.tongue_thickness_mm": 2.0}, "fail")],
    "grip.flange_mpa": [
        ({"design.mount.flange_thickness_mm": 2.0, "design.mount.grip_force_n": 12.0}, "fail"),
    ],
    "grip.bolt_n": [
        ({"design.mount.flange_bolt": "M3", "design.mount.grip_force_n": 80.0}, "fail"),
    ],
    "grip.limit_n": [({"design.mount.gripper": "wsg50"}, "warn")],
    "flange.pattern_mm": [
        ({"design.mount.gripper": "wsg50", "design.mount.flange_bolt_spacing_mm": 26.0}, "fail"),
    ],
    "flange.heads_mm": [({"design.mount.flange_bolt_spacing_mm": 7.0}, "fail")],
    "flange.measured": [({"design.mount.gripper": "franka_hand"}, "warn")],
    "cable.bend_mm": [({"=chamber.rear_x_mm": -26.0}, "fail")],
    "cable.slot_mm": [({"camera.cable_width_mm": 40.0}, "fail")],
    "cable.cover_mm": [
        ({"camera.cable_exit": "bottom", "camera.cable_bend_radius_mm": 12.0}, "fail"),
        ({"=cable.plug_z_mm": -17.3}, "fail"),
    ],
    "cable.roof_mm": [
        ({"=cable.level_z_mm": -1.2}, "fail"),
        ({"=wire.lane_top_z_mm": -1.5}, "fail"),
    ],
    "cable.window_mm": [
        ({"camera.cable_exit": "top", "=cable.level_z_mm": -2.0, "=cable.bend_end_x_mm": -17.0},
         "fail"),
        ({"camera.cable_exit": "top", "=cable.level_z_mm": -4.0, "=cable.bend_end_x_mm": -11.5},
         "fail"),
    ],
    "cable.floor_mm": [
        ({"camera.cable_exit": "bottom", "=clamp.base_mm": 0.4}, "fail"),
    ],
    "cable.depth_mm": [
        ({"camera.cable_exit": "bottom", "camera.module_depth_mm": 2.5,
          "=cable.thickness_mm": 1.21}, "fail"),
        ({"camera.cable_exit": "top", "camera.cable_kind": "round"}, "fail"),
    ],
    "cable.length_mm": [({"camera.cable_length_mm": 35.0}, "fail")],
    "cable.hold_n": [({"camera.cable_width_mm": 3.0}, "warn")],
    "wire.channel_mm": [({"design.leds.wire_diameter_mm": 2.8}, "fail")],
    "wire.beside_clamp_mm": [({"=wire.run_y_mm": 25.0, "=clamp.front_x_mm": -17.0}, "fail")],
    "clamp.tilt_deg": [
        ({"design.housing.camera_seat": "loose"}, "warn"),
        ({"=clamp.tilt_deg": 2.7, "=clamp.preloaded": 0.0}, "warn"),
    ],
    "led.located_mm": [
        ({"manufacturing.print_process": "fdm"}, "warn"),
        ({"=led.datum_mm": 0.01}, "warn"),
    ],
    "led.tip_reach_mm": [({**LONG, "design.leds.tip": "blue"}, "warn")],
    "clamp.preload_n": [({"=clamp.preload_n": 0.1}, "fail")],
    "electronics.led": [
        ({"design.leds.model": "unknown"}, "warn"),
        ({"design.leds.package_mm": 1.6}, "warn"),
    ],
    "electronics.led_ma": [({"electronics.current_ma": 1200.0}, "fail")],
    "electronics.spread_percent": [
        ({"electronics.supply_v": 4.8, "design.leds.radiant_flux_mw": 20.0}, "warn"),
    ],
    "electronics.supply_v": [
        ({"electronics.supply_v": 2.5}, "fail"),
        ({"electronics.driver": "constant_current"}, "fail"),
    ],
    "electronics.resistor_mw": [
        ({"electronics.supply_v": 48.0, "design.leds.max_count": 3}, "fail"),
    ],
    "electronics.junction_c": [({"design.leds.radiant_flux_mw": 60.0}, "fail")],
    "electronics.board_c": [({"design.leds.radiant_flux_mw": 25.0}, "warn")],
    "electronics.flux_percent": [({"electronics.current_ma": 10.0}, "warn")],
    "electronics.width_mm": [({"electronics.edge_mm": 0.6}, "warn")],
    "electronics.room_mm": [({"electronics.min_drill_mm": 0.7}, "warn")],
    "electronics.part_height_mm": [
        ({"design.leds.height_mm": 0.56, "design.housing.fit_clearance_mm": 0.1,
          "electronics.supply_v": 12.0, "design.leds.radiant_flux_mw": 20.0}, "warn"),
    ],
    "electronics.thickness_mm": [
        ({"design.leds.board_thickness_mm": 0.2}, "warn"),
        ({"electronics.board": "flexible"}, "warn"),
    ],
}  # fmt: skip
WARNS = {
    "blur.image_px": {"camera.circle_of_confusion_px": 5.0},
    "electronics.board_c": {"design.leds.radiant_flux_mw": 8.0},
}
"""Rules that warn on mini20, and what makes them hold."""


def test_every_rule_has_a_case_that_misses() -> None:
    assert set(SPOILT) == set(RULES)


@pytest.mark.parametrize(
    ("rule", "changes", "status"),
    [(rule, *case) for rule, cases in SPOILT.items() for case in cases],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_spoilt_design_is_caught(rule: str, changes: dict[str, Any], status: str) -> None:
    spec = {k: v for k, v in changes.items() if not k.startswith("=")}
    found = judged(rule, spec, {k[1:]: v for k, v in changes.items() if k.startswith("=")})
    assert found.status == status
    # It says what, by how much, why, and what to change.
    assert found.margin is not None
    assert found.margin < 0
    assert found.value != found.limit
    assert len(found.reason) > 20
    assert len(found.advice) > 10
    assert (found.value > found.limit) == (found.sense == "max")


@pytest.mark.parametrize("rule", sorted(RULES))
def test_every_rule_can_hold(rule: str) -> None:
    found = judged(rule, WARNS.get(rule))
    assert found.status == "pass"
    assert found.advice == ""
    assert found.margin is None or found.margin >= 0


def test_no_rule_fails_on_the_shipped_designs() -> None:
    for name in ("mini20", "gelslim2"):
        failed = [c.id for c in check(derive(shipped(name))) if c.status == "fail"]
        assert failed == []


def test_rules_come_by_group_and_name_a_parameter_of_the_spec() -> None:
    found = check(smallest())
    groups = [c.group for c in found]
    runs = [g for i, g in enumerate(groups) if i == 0 or groups[i - 1] != g]
    assert len(runs) == len(set(runs)) == 9
    assert {c.id for c in found} == set(RULES)
    unknown = {c.id: c.parameter for c in found if c.parameter not in smallest().given}
    assert unknown == {}
