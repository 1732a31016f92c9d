"""Values, limits and words of rules, by hand and by brute force; batches against singles."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from rule_samples import judged, overruled, shipped, smallest
from shipped_fingers import varied

from gelslim_cad.checks import RULES, check, margins_batch
from gelslim_cad.checks.apply import _check
from gelslim_cad.checks.rule import Finding, Rule
from gelslim_cad.dimensions import derive, derive_batch
from gelslim_cad.geometry.gel_shape import GelShape
from gelslim_cad.sensor import marker_grid
from ifem_export.markers.grid import build_marker_grid


def test_figures_worked_by_hand() -> None:
    # A measured sheet 0.05 mm, print 0.1 mm, shim 0.15 mm.
    found = judged("precompression.tolerance_mm")
    assert found.limit == pytest.approx(0.30)
    assert 0.30 < found.value < 0.45
    # 2.5 - 2 * 0.15 for a 2 mm package.
    assert judged("led.fits_mm").margin == pytest.approx(0.2)
    # M2 countersunk head 3.8 mm in a tip wall of 5 mm.
    assert judged("screw.wall_mm").value == pytest.approx(0.6)
    # pitch 1.2, largest dot 1.25 * 0.6.
    assert judged("marker.gap_mm").value == pytest.approx(0.45)
    # Gel 2.0, proud 0.5.
    assert judged("bezel.thickness_mm").value == pytest.approx(1.5)
    assert judged("guide.bend_ratio", {"design.light_guide.bend_radius_ratio": 2.0}).limit == (
        pytest.approx(1 / (1.4906 - 1))
    )


@pytest.mark.parametrize("leg_mm", [0.2, 1.0, 3.0])
@pytest.mark.parametrize("ratio", [0.8, 2.1, 4.0])
def test_no_line_from_an_led_to_the_lens_passes_a_baffle_that_hides_it(
    leg_mm: float, ratio: float
) -> None:
    d = derive(
        varied(
            shipped("mini20"),
            {
                "design.light_guide.leg_length_mm": leg_mm,
                "design.light_guide.bend_radius_ratio": ratio,
            },
        )
    )
    half, radius = d["design.leds.package_mm"] / 2, d["camera.lens_diameter_mm"] / 2
    top, edge = d["baffle.top_z_mm"], d["baffle.inner_y_mm"]
    # Straight lines from points of the emitting face to points of the lens, at the baffle's edge.
    from_y = (d["led.y_mm"] + np.linspace(-half, half, 21))[:, None, None]
    to_y = np.linspace(-radius, radius, 41)[:, None]
    to_z = d["camera_pose.z_mm"] + np.linspace(-radius, radius, 41)
    share = (from_y - edge) / (from_y - to_y)
    over = d["led.top_z_mm"] + share * (to_z - d["led.top_z_mm"]) - top
    found = next(c for c in check(d) if c.id == "led.hidden_mm")
    assert found.value == pytest.approx(-over.max(), abs=1e-9)
    disc = np.hypot(to_y, to_z - d["camera_pose.z_mm"]) <= radius
    if found.status == "pass":
        assert np.all(np.where(disc, over, -1.0) <= 0)


def test_the_lens_that_cannot_move_far_enough_is_told_by_how_much() -> None:
    d = overruled(smallest(), {"camera.lens_travel_mm": 0.4})
    found = next(c for c in check(d) if c.id == "focus.travel_mm")
    needed = d["view.lens_extension_mm"]
    # Thin lens: 1/f = 1/s + 1/(f + e).
    f = d["camera.focal_length_mm"]
    assert 1 / f == pytest.approx(1 / d["view.focus_mm"] + 1 / (f + needed))
    assert f"{needed:.2f} mm" in found.reason
    assert "0.40 mm" in found.reason
    assert f"{needed - 0.4:.2f} mm too little" in found.reason


def test_an_impossible_fold_names_each_limit_it_misses() -> None:
    changes = {"design.gel.length_mm": 60.0, "design.optics.max_keystone": 1.05}
    d = derive(varied(shipped("mini20"), changes))
    found = next(c for c in check(d) if c.id == "fold.feasible")
    missed = [n for n, v in d.fold.violations.items() if float(v[0]) > 1e-6]
    assert missed
    assert found.status == "fail"
    assert all(name in found.reason for name in missed)


def test_a_thin_wall_is_refused_with_the_reason_of_its_process() -> None:
    thin = {"design.housing.baffle_mm": 0.5}
    found = {
        process: judged("wall.thinnest_mm", {**thin, "manufacturing.print_process": process})
        for process in ("sla", "fdm", "sls")
    }
    assert {p: c.limit for p, c in found.items()} == {"sla": 0.6, "fdm": 0.8, "sls": 0.7}
    assert len({c.reason for c in found.values()}) == 3
    assert "nozzle" in found["fdm"].reason


@pytest.mark.parametrize("radius_mm", [0.0, 2.0, 3.0, 3.2, 4.0, 6.0, 9.0])
def test_corner_rule_agrees_with_the_dots_that_are_left_out(radius_mm: float) -> None:
    d = derive(varied(shipped("mini20"), {"design.gel.corner_radius_mm": radius_mm}))
    whole = build_marker_grid(
        round(d["marker_grid.rows"]),
        round(d["marker_grid.columns"]),
        d["design.markers.pitch_mm"],
        d["design.markers.diameter_mm"],
        d["design.markers.anchors"],
    )
    lost = len(whole) - len(whole.clipped(GelShape.of(d).outline.contains))
    found = next(c for c in check(d) if c.id == "marker.corner_mm")
    assert (found.status == "warn") == (lost > 0)
    assert len(marker_grid(d)) == len(whole) - lost


def test_a_value_at_its_limit_holds_and_one_beyond_does_not() -> None:
    entry = Rule("x", "t", "p", "because", "do", "mm", (), lambda: Finding(1.0, 1.0))
    d = smallest()
    assert _check(entry, d).status == "pass"
    for value, least, status in (
        (1 + 1e-12, False, "fail"),
        (1 - 1e-12, True, "fail"),
        (math.nan, False, "fail"),
        (math.nan, True, "fail"),
        (math.inf, True, "pass"),
    ):
        found = Finding(value, 1.0, least=least)
        assert _check(Rule("x", "t", "p", "w", "a", "", (), lambda f=found: f), d).status == status


def test_tolerance_keeps_the_true_limit_and_never_shows_a_negative_margin() -> None:
    found = Finding(1.00005, 1.0, tolerance=1e-4)
    shown = _check(Rule("x", "t", "p", "w", "a", "", (), lambda: found), smallest())
    assert (shown.status, shown.limit, shown.margin) == ("pass", 1.0, 0.0)


def test_caution_is_judged_only_where_the_limit_holds() -> None:
    def status(value: float) -> str:
        found = Finding(value, 2.0, caution=1.0)
        return _check(Rule("x", "t", "p", "w", "a", "", (), lambda: found), smallest()).status

    assert [status(v) for v in (0.5, 1.0, 1.5, 2.0, 2.5)] == [
        "pass", "pass", "warn", "warn", "fail",
    ]  # fmt: skip


@pytest.mark.slow
def test_a_batch_fails_where_single_designs_fail() -> None:
    rng = np.random.default_rng(8)
    count = 16
    overrides = {
        "design.gel.length_mm": rng.uniform(12, 45, count),
        "design.gel.width_mm": rng.uniform(12, 40, count),
        "design.light_guide.bend_radius_ratio": rng.uniform(0.3, 3, count),
        "design.housing.precompression_mm": rng.uniform(0.2, 0.7, count),
        "design.housing.baffle_mm": rng.uniform(0.4, 1.5, count),
        "design.markers.diameter_mm": rng.uniform(0.25, 0.7, count),
        "material.gel.poissons_ratio": rng.uniform(0.3, 0.49, count),
        "mesh.layers": rng.integers(1, 3, count),
    }
    margins = margins_batch(derive_batch(shipped("mini20"), overrides))
    failed = {rule: room < 0 for rule, room in margins.items()}
    assert set(failed) == set(RULES)
    some = {rule for rule, where in failed.items() if np.any(where)}
    assert {"guide.bend_ratio", "wall.thinnest_mm", "mesh.layers"} <= some
    for k in range(count):
        single = check(
            derive(varied(shipped("mini20"), {p: v[k].item() for p, v in overrides.items()}))
        )
        here = {r for r, where in failed.items() if np.broadcast_to(where, (count,))[k]}
        assert here == {c.id for c in single if c.status == "fail"}


@pytest.mark.slow
def test_ten_thousand_designs_are_checked_at_once() -> None:
    rng = np.random.default_rng(9)
    lengths, widths = rng.uniform(12, 40, (2, 10_000))
    overrides = {"design.gel.length_mm": lengths, "design.gel.width_mm": widths}
    batch = derive_batch(shipped("mini20"), overrides)
    failed = {rule: room < 0 for rule, room in margins_batch(batch).items()}
    np.testing.assert_array_equal(failed["fold.feasible"], ~batch.feasible())
    envelope = failed["finger.thickness_mm"]
    np.testing.assert_array_equal(envelope, batch["finger.thickness_mm"] > 18 + 1e-9)
    assert 0 < envelope.sum() < 10_000


def test_the_groove_and_the_least_tongue_lie_inside_of_the_tongues_outer_side():
    from gelslim_cad.checks.mount import cable_slot
    from gelslim_cad.dimensions.housing import TONGUE_LEAST_MM

    found = cable_slot(5.6, 6.0)
    assert (found.value, found.limit) == (5.6 + TONGUE_LEAST_MM, 6.0)


@pytest.mark.parametrize("pitch_deg", [-10.0, 0.0, 25.0])
def test_the_floor_under_a_pitched_camera(pitch_deg: float) -> None:
    """Lower corners of clamp and module by a rotation of complex numbers."""
    from gelslim_cad.checks.mount import cable_floor
    from gelslim_cad.dimensions.seat import clamp_base_mm

    turn = cmath.rect(1.0, -math.radians(pitch_deg))
    front, rear = complex(-1.5, -4.45) * turn, complex(-1.5 - 4.0 - 0.2 - 1.5, -4.45) * turn
    base = clamp_base_mm(-10.0, pitch_deg, 1.5, 4.0, 8.5, 0.2, -20.0)
    assert base == pytest.approx(10.0 + min(front.imag, rear.imag))
    assert cable_floor(base, "bottom").value == base
    assert cable_floor(0.2, "rear").value >= cable_floor(0.2, "rear").limit


@pytest.mark.parametrize("bend_end_x_mm", [-24.0, -21.4, -15.0])
def test_the_gap_over_a_bend_above_the_camera(bend_end_x_mm: float) -> None:
    """Least gap under bezel and window over points of the bend's outer side."""
    from gelslim_cad.checks.mount import LEAST_CEILING_MM, cable_window

    level, radius, thick = -6.5, 5.5, 4.0
    turn = np.linspace(0.0, np.pi / 2, 200_001)
    x = bend_end_x_mm + (radius + thick / 2) * np.sin(turn)
    z = level - radius + (radius + thick / 2) * np.cos(turn)
    x = np.append(x, np.linspace(bend_end_x_mm - 50.0, bend_end_x_mm, 50_001))
    z = np.append(z, np.full(50_001, level + thick / 2))
    gaps = [-2.3 - z[x >= -26.3].max(), -4.8 - 0.7 - z[x >= -20.0].max()]
    place = (-26.3, -19.8, 0.2, -2.3, -4.8, 0.7)
    found = cable_window(level, bend_end_x_mm, radius, thick, "top", *place)
    assert found.value == pytest.approx(min(gaps), abs=1e-3)
    assert cable_window(level, -40.0, radius, thick, "top", *place).value == LEAST_CEILING_MM
    assert cable_window(level, bend_end_x_mm, radius, thick, "rear", *place).value == (
        LEAST_CEILING_MM
    )
