"""Rungs of the effects: predicted times at a reference size, how they grow, and their errors."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from effect_samples import BOUND, FIGURES, LADDER, MOTION, ball, circumstances, values

from gelslim_twin.effects.circumstances import (
    Circumstances,
    CorrectedPose,
    MotionFigures,
    Probed,
    SensorFigures,
)
from gelslim_twin.effects.contact import moved_mm
from gelslim_twin.effects.effect import Bound, Rung, geometry, optics, picture
from gelslim_twin.effects.grey_values import MotionBlurParameters, ShadingParameters, grey_share
from gelslim_twin.effects.large_strain import (
    ALIKE,
    CORRECTED_RUNGS,
    HELD_AT,
    corrected_error,
    found_error,
)

REFERENCE = replace(
    FIGURES,
    length_mm=28.0,
    width_mm=28.0,
    surface_nodes=43 * 43,
    layers=4,
    markers=575,
    image_width_px=640,
    image_height_px=480,
)
"""Size of pad, grid and frame for which the times of all rungs stand in the declarations."""
APART = circumstances(sensor=REFERENCE, motion=replace(MOTION, depth_mm=0.0))
"""No contact, so that no time depends on it."""
TIMES_MS = {
    "normal_contact": (1.2, 1.3, 1.5, 1.8, 2.1),
    "friction": (0.4,),
    "sliding_friction": (0.1, 0.1, 0.1),
    "adhesion": (6.0,),
    "nonlinearity": (
        *(8.0, 10.0, 12.0, 14.0, 16.0, 18.0, 20.0, 22.0, 24.0, 26.0, 30.0, 36.0, 44.0, 60.0),
        *(250.0, 350.0, 450.0),
    ),
    "skin": (0.0,),
    "relaxation": (0.01 + 8e-5 * 1849,),
    "viscoelasticity": tuple(0.02 * n + 1.4 * (n - 1) for n in (1, 2, 4, 8, 16)),
    "perspective": (0.05,),
    "refraction": (0.02, 0.1),
    "lens_distortion": (0.02,),
    "marker_print": (0.05,),
    "drawing": (5.0,),
    "shading": (0.6 + 40 / 64, 0.6 + 40 / 16, 0.6 + 10, 0.6 + 40),
    "dirt": (0.01,),
    "defocus": (1.5,),
    "specular": (0.3,),
    "motion_blur": (1.2, 1.4, 1.8, 2.6, 4.2, 7.4),
    "exposure": (0.4,),
    "sensor_noise": (1.5,),
    "compression": (2.0,),
}
GROWS_WITH = {
    "nodes": ("normal_contact", "friction", "adhesion", "nonlinearity"),
    "dots": ("perspective", "refraction", "lens_distortion", "marker_print"),
    "pixels": ("drawing", "shading", "specular", "motion_blur", "exposure", "sensor_noise",
               "compression"),
}  # fmt: skip
LARGER: dict[str, SensorFigures] = {
    "nodes": replace(REFERENCE, surface_nodes=2 * 43 * 43, layers=12),
    "dots": replace(REFERENCE, markers=6 * 575),
    "pixels": replace(REFERENCE, image_width_px=2 * 640, image_height_px=3 * 480),
}
"""Six times as many."""


def test_times_are_those_of_the_reference_size() -> None:
    for name, expected in TIMES_MS.items():
        times = [rung.milliseconds for rung in LADDER[name](APART)]
        assert times == pytest.approx(expected), name
    assert set(TIMES_MS) == set(LADDER)


@pytest.mark.parametrize("what", GROWS_WITH)
def test_times_grow_with_the_size(what: str) -> None:
    larger = replace(APART, sensor=LARGER[what])
    for name, ladder in LADDER.items():
        factor = 6 if name in GROWS_WITH[what] else 1
        expected = [factor * t for t in TIMES_MS[name]]
        if (what, name) == ("nodes", "relaxation"):
            expected = [0.01 + 16e-5 * 1849]
        if (what, name) == ("nodes", "viscoelasticity"):
            expected = [0.02 * n + 6 * 1.4 * (n - 1) for n in (1, 2, 4, 8, 16)]
        if (what, name) == ("pixels", "defocus"):
            expected = [0.5 + 6 * 1.0]
        assert [rung.milliseconds for rung in ladder(larger)] == pytest.approx(expected), name


def test_a_dense_contact_costs_the_square_of_its_nodes() -> None:
    c = circumstances()
    nodes = 1300 * 3 / (43 * 43 * 4)
    for rung, single in zip(LADDER["normal_contact"](c), TIMES_MS["normal_contact"], strict=True):
        assert rung.milliseconds == pytest.approx(single * nodes + (c.contact_nodes / 100) ** 2)


TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)


@pytest.mark.parametrize(
    ("radius_mm", "width_mm", "tip"),
    [
        # Wide: neither few nodes across nor few in all.
        (14.0, 12.0, 0.0),
        # As narrow as the mesh and as small: the full error of a tip.
        (0.2, 0.5, 1.0),
        # Fewer nodes across than 3.5, many in all: a ridge.
        (40.0, 0.5, None),
        # Twice as many across as 3.5: a quarter of a tip's error.
        (0.2, 7 * FIGURES.node_pitch_mm, 0.25),
    ],
)
def test_error_of_a_tolerance_is_that_of_its_tool(
    radius_mm: float, width_mm: float, tip: float | None
) -> None:
    """Root of the tolerance, times 0.14 and 0.07 on wide tools, 1.1 and 0.15 on tips."""
    c = circumstances(footprint=replace(ball(radius_mm), width_mm=lambda _d: width_mm))
    if tip is None:
        tip = 50 / c.contact_nodes
        assert 0.14 / 1.1 < tip < 0.9
    for tolerance, rung in zip(TOLERANCES, LADDER["normal_contact"](c), strict=True):
        px = math.sqrt(tolerance) * max(0.14, 1.1 * tip) * 0.35 * FIGURES.px_per_mm
        force = math.sqrt(tolerance) * max(0.07, 0.15 * tip) * c.contact.normal_n
        assert rung.parameters == {"tolerance": tolerance}
        assert values(rung.error) == pytest.approx(values(geometry(px, force)))


def test_without_contact_no_tolerance_leaves_an_error() -> None:
    assert all(rung.error == Bound() for rung in LADDER["normal_contact"](APART))


def test_friction_leaves_its_error_to_the_contact() -> None:
    [rung] = LADDER["friction"](circumstances())
    assert (rung.error, rung.parameters) == (Bound(), {"tolerance": 1e-2})


@pytest.mark.parametrize("mu", [0.0, 0.6])
def test_large_strain_errs_by_the_tolerance_at_most_by_all(mu: float) -> None:
    c = circumstances(mu)
    whole = BOUND["nonlinearity"](c)
    rungs = LADDER["nonlinearity"](c)[-3:]
    for t, rung in zip((1e-2, 1e-3, 1e-4), rungs, strict=True):
        expected = geometry(t * 0.2 * 0.35 * FIGURES.px_per_mm, t * 0.1 * whole.force_n)
        assert values(rung.error) == pytest.approx(values(expected))
        assert rung.parameters == {"tolerance": t}
    slight = circumstances(mu, motion=replace(MOTION, depth_mm=1e-5, lateral_mm=0.0))
    least = BOUND["nonlinearity"](slight)
    assert 0 < least.markers_px < 1e-2 * 0.2 * 1e-5 * FIGURES.px_per_mm
    assert LADDER["nonlinearity"](slight)[0].error.markers_px == least.markers_px


def test_corrections_err_by_their_tolerance_and_more_where_walls_slide() -> None:
    """Of what is solved: the force and displacement of a probe, with the factor 1.25."""
    held = replace(MOTION, lateral_mm=0.0, twist_deg=0.0)
    found = Probed(1.0, 2.0, 0.4, {})
    px, depth_px = FIGURES.px_per_mm, 0.35 * FIGURES.px_per_mm

    def errors(motion: MotionFigures, steepest: float) -> dict[float, Bound]:
        tool = replace(ball(14.0), steepest=lambda _d: steepest)
        c = replace(circumstances(0.3, motion=motion, footprint=tool), probed=found)
        rungs = [r for r in LADDER["nonlinearity"](c) if "corrected_contact" in r.implementation]
        assert [r.parameters["tolerance"] for r in rungs] == [t for t, _ in CORRECTED_RUNGS]
        assert rungs[0].milliseconds < rungs[-1].milliseconds
        nodes.append(c.contact_nodes)
        whole.append(BOUND["nonlinearity"](c))
        return {r.parameters["tolerance"]: r.error for r in rungs}

    nodes, whole = list[float](), list[Bound]()
    smooth, straight = errors(held, 0.5), errors(held, math.inf)
    sliding = errors(MOTION, math.inf)

    def expected(t: float) -> Bound:
        return geometry(2 * t * 1.25 * 0.4 * px, t * 1.25 * 2.0)

    for t in (0.005, 0.002):
        assert values(smooth[t]) == values(straight[t]) == pytest.approx(values(expected(t)))
    flipped = expected(0.01).plus(geometry(depth_px)).at_most(whole[1])
    assert values(straight[0.01]) == pytest.approx(values(flipped))
    rim = geometry(2 * depth_px, 2 / nodes[-1] * 1.25 * 2.0)
    loose = geometry(4 * 0.01 * 1.25 * 0.4 * px, 0.01 * 1.25 * 2.0)
    capped = loose.plus(rim).at_most(whole[-1])
    assert values(sliding[0.01]) == pytest.approx(values(capped))
    # Nodes slip a little earlier or later at a sliding wall whatever the tolerance.
    fine = geometry(4 * 0.005 * 1.25 * 0.4 * px, 0.005 * 1.25 * 2.0)
    assert values(sliding[0.005]) == pytest.approx(values(fine))
    assert sliding[0.002] == sliding[0.005]


def test_errors_at_sliding_walls_follow_what_friction_drags() -> None:
    """Without a probe: the displacement of the press and that by friction, in seed 2190 ten times
    the depth."""
    tool = replace(ball(14.0), steepest=lambda _d: math.inf)
    held = circumstances(0.3, footprint=tool)
    for c in (held, replace(held, friction=0.0)):
        depth, aside = c.contact.depth_mm, c.contact.sideways_mm
        most_mm = math.hypot(depth, aside) + moved_mm(c)
        fine = corrected_error(c, HELD_AT)
        assert fine.displacement_px == pytest.approx(0.02 * most_mm * FIGURES.px_per_mm)
    assert corrected_error(held, HELD_AT).markers_px > fine.markers_px


CHANGE = Bound(0.04, 0.5, 0.3, 0.3)
"""What the first correction changes of a contact that moves by 10 px and has 2 N."""
PRESSED = replace(MOTION, lateral_mm=0.0, twist_deg=0.0, tilt_deg=0.0)


def corrected(
    change: Bound = CHANGE, motion: MotionFigures = PRESSED, steepest: float = 0.5
) -> Circumstances:
    found = Probed(2.0, 2.0, 0.4, {}, corrected=(CorrectedPose(change, 10.0, 2.0),))
    tool = replace(ball(14.0), steepest=lambda _d: steepest)
    return replace(circumstances(0.3, motion=motion, footprint=tool), probed=found)


def test_a_correction_tells_what_looser_rungs_leave_and_keep() -> None:
    """A press: 1 % of 2 N is half of 0.04 N, and 1 % of 10 px a fifth of 0.5 px, the stricter.

    A fifth of the change is left where the path stops, a third of that where it does not correct.
    """
    found = found_error(corrected(), 0.01)
    assert values(found) == pytest.approx(values(CHANGE.times(1.35 * (0.2 + 0.2 / 3))))
    # A correction that changes a twentieth leaves a tenth and twice that at most.
    loose = found_error(corrected(), 1.0)
    assert values(loose) == pytest.approx(values(CHANGE.times(1.35 * (0.1 + 2 * 0.05 + 1))))
    # Half is left at most, and all of the change where there is no correction.
    large = CHANGE.times(5)
    most = found_error(corrected(large), 1.0)
    assert values(most) == pytest.approx(values(large.times(1.35 * 1.5)))
    # Aside each observable has its own limit: 0.02 N and 0.1 px.
    aside = values(found_error(corrected(motion=replace(PRESSED, lateral_mm=0.2)), 0.01))
    expected = (0.2 * 0.04 + 0.02 / 3, 0.1 + 0.1 / 3, 0.06 + 0.1 / 3, 0.06 + 0.1 / 3)
    assert aside == pytest.approx([2.5 * e for e in expected])
    back = found_error(corrected(motion=replace(PRESSED, recedes=True)), 0.01)
    assert values(back) == pytest.approx([2.5 / 1.35 * value for value in values(found)])


def test_a_smooth_tool_that_strains_the_gel_and_moves_aside_promises_less() -> None:
    """And no more below a tolerance: corrections converge slowly, as in random scene 3208."""
    aside, strong = replace(PRESSED, lateral_mm=0.2), Bound(0.62, 0.5, 0.3, 0.3)
    c = corrected(strong, motion=aside)
    least = corrected_error(c, 0.003)
    assert corrected_error(c, 0.005).displacement_px > least.displacement_px
    assert corrected_error(c, 0.001) == least
    less = corrected(Bound(0.58, 0.5, 0.3, 0.3), motion=aside)
    assert values(least)[1:] == pytest.approx(
        [3.5 * v for v in values(corrected_error(less, 0.003))[1:]]
    )
    assert corrected_error(less, 0.001).displacement_px < least.displacement_px / 7
    straight = corrected_error(corrected(strong), 0.001)
    assert straight.displacement_px < least.displacement_px / 3.5


def test_strain_at_walls_may_make_them_hold_a_node_otherwise_at_every_tolerance() -> None:
    """As in random scenes 3209 and 3214: by 1.25 times the depth and the force of two nodes.

    A node that only one of the two gels holds changes by more than a third of the depth.
    """
    depth_px = corrected().contact.depth_mm * FIGURES.px_per_mm
    shares = (0.09, 0.2, 0.4)
    for tolerance in (0.001, HELD_AT):
        alike, strained, other = (
            corrected(Bound(0.04, share * depth_px, 0.1, 0.1), steepest=math.inf)
            for share in shares
        )
        promised = corrected_error(other, tolerance)
        held = corrected_error(strained, tolerance)
        assert held.displacement_px - promised.displacement_px == pytest.approx(1.25 * depth_px)
        lost_n = 1.25 * 2 / strained.contact_nodes * strained.force_n
        assert held.force_n - promised.force_n == pytest.approx(lost_n)
        assert corrected_error(alike, tolerance).displacement_px <= promised.displacement_px


def test_what_is_found_of_rungs_only_lowers_what_they_promise() -> None:
    for tolerance, _ in CORRECTED_RUNGS:
        c = corrected()
        blind = replace(c, probed=replace(c.probed, corrected=()))
        known, promised = corrected_error(c, tolerance), corrected_error(blind, tolerance)
        assert known == promised.at_most(found_error(c, tolerance))
        assert known.displacement_px < promised.displacement_px


def test_corrections_tell_nothing_of_walls_that_slide_or_hold_other_nodes() -> None:
    depth_px = corrected().contact.depth_mm * FIGURES.px_per_mm
    alike, other = (Bound(0.04, f * ALIKE * depth_px, 0.1, 0.1) for f in (0.99, 1.01))
    assert found_error(corrected(alike, steepest=math.inf), 0.02) is not None
    assert found_error(corrected(other, steepest=math.inf), 0.02) is None
    assert found_error(corrected(other), 0.02) is not None
    assert found_error(corrected(alike, MOTION, math.inf), 0.02) is None


def test_only_paths_of_sliding_walls_are_solved_anew() -> None:
    held = replace(MOTION, lateral_mm=0.0, twist_deg=0.0)
    for motion, steepest in ((held, math.inf), (MOTION, 0.5), (MOTION, math.inf)):
        tool = replace(ball(14.0), steepest=lambda _d, s=steepest: s)
        rungs = LADDER["nonlinearity"](circumstances(0.3, motion=motion, footprint=tool))
        anew = {r.parameters.get("restarts", False) for r in rungs if "by_rate" in r.parameters}
        assert anew == {motion is MOTION and math.isinf(steepest)}


def test_corrections_of_tools_with_walls_stop_later() -> None:
    times = []
    for steepest in (0.5, math.inf):
        tool = replace(ball(14.0), steepest=lambda _d, s=steepest: s)
        c = circumstances(0.3, footprint=tool)
        rungs = [r for r in LADDER["nonlinearity"](c) if "corrected_contact" in r.implementation]
        assert {r.parameters["by_rate"] for r in rungs} == {math.isfinite(steepest)}
        times.append([r.milliseconds for r in rungs])
    assert times[1] == pytest.approx([1.5 * ms for ms in times[0]])


def test_what_a_scene_switches_on_is_solved_until_it_converges() -> None:
    c = circumstances()
    forced = c.parameters["nonlinearity"].model_copy(update={"use": "on"})
    on = replace(c, parameters={**c.parameters, "nonlinearity": forced})
    assert [r.name for r in LADDER["nonlinearity"](on)] == ["coarse", "medium", "fine"]


def test_apparent_depths_miss_what_oblique_rays_and_pressed_gel_lift() -> None:
    """A point of the gel pressed in by d has d/h less gel over it; at most the whole is missed."""
    c = circumstances()
    lift, straight = FIGURES.lift_mm(43.0), FIGURES.lift_mm(0.0)
    expected_px = FIGURES.lifted_px(lift - straight + 0.35 / 1.9 * lift)
    near, exact = LADDER["refraction"](c)
    assert values(near.error) == pytest.approx(values(optics(expected_px)))
    assert (near.parameters, exact.parameters) == ({"rays": "paraxial"}, {"rays": "exact"})
    assert exact.error == Bound()
    deep = replace(c, motion=replace(MOTION, depth_mm=1.6))
    assert LADDER["refraction"](deep)[0].error == BOUND["refraction"](deep) == optics(
        FIGURES.lifted_px(lift)
    )  # fmt: skip


def interpolated_apart(step_px: float, reach_px: float) -> float:
    """Largest error of linear interpolation of cos(x/h) from values `step_px` apart."""
    x = np.linspace(0.0, step_px, 1001) - step_px / 2
    ends = math.cos(step_px / 2 / reach_px)
    return float(np.abs(np.cos(x / reach_px) - ends).max())


def test_light_between_grid_points_is_off_by_the_curvature() -> None:
    """A slope that varies over the gel's thickness, interpolated every few pixels."""
    c = circumstances(shading=ShadingParameters(ambient_share=0.45))
    reach_px = 1.9 * FIGURES.px_per_mm
    rungs = LADDER["shading"](c)
    assert [rung.parameters["pixel_step"] for rung in rungs] == [8, 4, 2, 1]
    for rung in rungs:
        step_px = float(rung.parameters["pixel_step"])
        share = grey_share(c) * interpolated_apart(step_px, reach_px)
        whole_px, whole = BOUND["shading"](c).image_px, grey_share(c)
        assert rung.error == picture(rung.error.image_px)
        assert rung.error.image_px == pytest.approx(whole_px * share / whole, rel=2e-3)


def smeared() -> Iterator[tuple[float, Rung, float]]:
    """Smear, rung and width of an edge, from a slow motion to one far beyond the edge."""
    for speed_mm_s in (0.5, 20.0, 900.0):
        c = circumstances(
            motion=replace(MOTION, speed_mm_s=speed_mm_s),
            motion_blur=MotionBlurParameters(shutter_ms=8.0),
        )
        # The gel flows aside 1.53 times as far as the tool presses.
        faster = max(1.5, c.contact.sideways_mm / c.contact.depth_mm)
        assert 1.5 < faster < 1.6
        smear_px = faster * speed_mm_s * 0.008 * FIGURES.px_per_mm
        assert BOUND["motion_blur"](c) == picture(pytest.approx(smear_px / 2))
        for rung in LADDER["motion_blur"](c):
            yield smear_px, rung, math.hypot(1.0, c.blur_px)


def test_instants_leave_a_quarter_of_a_step_or_its_second_moment() -> None:
    kinds = set()
    for smear_px, rung, width_px in smeared():
        step_px = smear_px / rung.parameters["most_poses"]
        coarse, fine = step_px / 4, step_px**2 / 12 / width_px
        kinds.add(coarse < fine)
        assert rung.error.image_px == pytest.approx(min(coarse, fine))
    assert kinds == {True, False}


def test_n_instants_of_a_smear_lack_the_second_moment_of_a_step() -> None:
    """Variance of n instants in the middles of equal parts against that of the whole smear."""
    for n in (2, 4, 8, 16, 32):
        middles = (np.arange(n) + 0.5) / n
        assert 1 / 12 - middles.var() == pytest.approx((1 / n) ** 2 / 12)
    assert [r.parameters["most_poses"] for r in LADDER["motion_blur"](APART)] == [
        2,
        4,
        8,
        16,
        32,
        64,
    ]


def test_exact_rungs_have_no_error() -> None:
    c = circumstances()
    for name in ("relaxation", "perspective", "marker_print", "drawing", "dirt", "defocus",
                 "specular", "exposure", "sensor_noise", "compression"):  # fmt: skip
        assert [rung.error for rung in LADDER[name](c)] == [Bound()], name
    assert [rung.error for rung in LADDER["lens_distortion"](c)] == [Bound()]


def test_rims_of_wide_tools_that_are_raised_with_friction_promise_more() -> None:
    """Nodes at the rim stick or slip otherwise on the way out: scenes 2122 and 2356."""
    c = corrected(steepest=math.inf, motion=replace(PRESSED, recedes=True))
    # A gel that is so thin that the tool is wide.
    wide = replace(c, sensor=replace(c.sensor, thickness_mm=c.contact.radius_mm / 4.1))
    assert wide.contact.radius_mm > 4 * wide.sensor.thickness_mm
    free = replace(wide, friction=0.0)
    assert wide.friction > 0
    assert found_error(wide, HELD_AT) is None
    assert found_error(free, HELD_AT) is not None
    blind = replace(free, probed=replace(free.probed, corrected=()))
    usual, more = corrected_error(blind, HELD_AT), corrected_error(wide, HELD_AT)
    assert more.displacement_px == pytest.approx(3 * usual.displacement_px, rel=0.2)
