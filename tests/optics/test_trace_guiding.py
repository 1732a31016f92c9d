"""Total reflection in pipes and bends against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from light_cases import COATS, N_ACRYLIC, bend_scene, lone_bend, loop, media, slab
from sampled import quick

from bench.models.facets import facetted_profile
from gelslim_optics.light.result import LightResult
from gelslim_optics.light.scene import LightScene, Surface
from gelslim_optics.light.source import EdgeLaunch
from gelslim_optics.light.trace import TraceOptions, trace_light


def full_guidance(na: float) -> float:
    """Least R/t that guides all rays: outer wall, h = ρ cos ψ invariant."""
    return 1 / (math.sqrt(N_ACRYLIC**2 - na**2) - 1)


@pytest.mark.parametrize("na", [0.0, 0.5, 1.0])
def test_a_closed_pipe_leaks_exactly_nothing(na: float) -> None:
    pipe = loop(
        [(0, 0), (1, 0), (1, 40), (0, 40)],
        ("foot_right", "air"),
        ("right", "air"),
        ("far", "paint"),
        ("left", "air"),
    )
    scene = LightScene(
        pipe, (-2, 2), (-2, 2), (EdgeLaunch("foot_right", na=na),), media(), COATS, face="far"
    )
    result = trace_light(scene, 4096, seed=3)
    assert result.total("leaked").value == 0
    assert result.value("lost") == 0
    assert result.value("delivered") == pytest.approx(1, abs=1e-13)


@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("na", quick([0.0, 0.3, 0.5, 0.7, 1.0], (0.5, 1.0).__contains__))
def test_the_bend_holds_all_light_above_the_threshold_and_not_below(
    na: float, planar: bool
) -> None:
    limit = full_guidance(na)
    # Just below the threshold only rays next to the inner wall and at the cone's rim leak.
    inner = ("foot_inner",)
    above = trace_light(bend_scene(limit * 1.01, na, planar=planar), 1 << 14, seed=1)

    def rim_rays(ratio: float) -> LightResult:
        bend = lone_bend(ratio, leg_mm=1e-6)
        scene = bend_scene(ratio, na, planar=planar, profile=bend, foot=inner)
        return trace_light(scene, 1 << 19, seed=1)

    rim, below = rim_rays(limit * 1.01), rim_rays(limit * 0.99)
    for result in (above, rim):
        assert result.total("leaked").value == 0
        assert result.value("lost") == 0
    assert below.value("leaked.outer_bend") > 0


@pytest.mark.parametrize(("ratio", "na"), [(1.0, 1.0), (2.0, 1.0), (1.5, 0.5), (3.0, 1.0)])
def test_guided_fraction_in_the_plane_meets_the_integral(ratio: float, na: float) -> None:
    outer = ratio + 1
    rho = np.linspace(ratio, outer, 200_001)
    local = np.sqrt(np.maximum(0, N_ACRYLIC**2 - (outer / rho) ** 2))
    share = np.trapezoid(np.minimum(1, local / na), rho)
    # Long enough for every ray to meet the outer wall. Partial reflection keeps some of the
    # light that is not guided; the cut-off drops what was ever refracted out in part.
    bend = lone_bend(ratio, leg_mm=1e-3, bend_rad=math.radians(170))
    scene = bend_scene(ratio, na, planar=True, profile=bend)
    guided = TraceOptions(split=1e-4, cut=0.9999)
    result = trace_light(scene, 1 << 19, seed=2, options=guided)
    assert result.value("delivered") == pytest.approx(share, abs=1e-4)
    assert result.value("lost") == 0


def test_facets_leak_where_the_arc_does_not() -> None:
    na, ratio = 0.5, full_guidance(0.5) * 1.05
    exact = trace_light(bend_scene(ratio, na, planar=False), 1 << 14)
    leaks = []
    for facet in (2.5, 5.0, 15.0):
        rough = facetted_profile(lone_bend(ratio), facet)
        scene = bend_scene(ratio, na, planar=False, profile=rough)
        result = trace_light(scene, 1 << 14)
        assert result.value("lost") == 0
        leaks.append(result.total("leaked").value)
    assert exact.total("leaked").value == 0
    assert 0 < leaks[0] < leaks[1] < leaks[2]


def test_facets_within_the_margin_leak_nothing() -> None:
    ratio = 6.0
    # Least angle from the normal at the outer wall: sin θ = R/(R+t) for collimated light.
    margin = math.degrees(math.asin(ratio / (ratio + 1)) - math.asin(1 / N_ACRYLIC))
    facet = 2 * margin * 0.6
    assert facet > 5
    fine = facetted_profile(lone_bend(ratio), margin)
    result = trace_light(bend_scene(ratio, 0.0, planar=True, profile=fine), 1 << 12)
    assert len(fine.edges) > 6
    assert result.value("lost") == 0


def test_a_whole_circle_guides_for_ever() -> None:
    """A disc traps light launched steeper than critical; 20 000 faces on one arc, none lost."""
    from gelslim_optics.guide.profile import Arc, Edge, GuideProfile, Segment

    disc = GuideProfile(
        (
            Edge("rim", Arc((0, 0), 10.0, 0.0, 2 * math.pi), "acrylic", "air"),
            Edge("lamp", Segment((-0.1, 9.0), (0.1, 9.0)), "paint", "acrylic"),
        )
    )
    scene = LightScene(
        disc,
        (-1, 1),
        (-1, 1),
        (EdgeLaunch("lamp", planar=True, na=0.3),),
        media(),
        {"paint": Surface(), "mirror": Surface(1.0)},
    )
    result = trace_light(scene, 256, replicates=1, options=TraceOptions(max_faces=2000))
    assert result.value("lost") == 0
    assert result.ledger_gap() < 1e-12


def test_rays_within_a_billionth_of_the_critical_angle() -> None:
    critical = 1 / N_ACRYLIC
    for offset, leaks in ((1e-9, False), (-1e-9, True)):
        angle = math.asin(critical) + offset
        # A wedge tips the face by exactly the wanted angle for light along its axis.
        run = 2 * math.tan(angle)
        face = loop(
            [(0, 0), (2, 0), (2, 50 + run), (0, 50)],
            ("foot_right", "air"),
            ("right", "paint"),
            ("slope", "air"),
            ("left", "paint"),
        )
        source = EdgeLaunch("foot_right", na=0.0, planar=True)
        scene = LightScene(face, (-1, 1), (-1, 1), (source,), media(), COATS)
        result = trace_light(scene, 1024)
        assert result.ledger_gap() < 1e-12
        assert result.value("lost") == 0
        if leaks:
            assert 0 < result.value("leaked.slope") < 5e-3
        else:
            assert result.total("leaked").value == 0


def test_grazing_light_goes_straight_along_a_wall() -> None:
    scene = LightScene(
        slab(0.5, 200.0, top="paint"),
        (-2, 2),
        (-2, 2),
        (EdgeLaunch("foot_right", na=1e-12),),
        media(),
        COATS,
        face="top",
    )
    result = trace_light(scene, 4096)
    assert result.value("delivered") == pytest.approx(1, abs=1e-13)
    assert result.elevation_deg().value == pytest.approx(90, abs=1e-6)
