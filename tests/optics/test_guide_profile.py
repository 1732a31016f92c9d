"""Profiles: closed outlines, exact areas, one shared face, mirror images."""

from __future__ import annotations

import math

import numpy as np
import pytest
from light_cases import transformed
from matplotlib.path import Path

from gelslim_optics.guide.profile import Arc, Edge, GuideProfile, Segment
from gelslim_optics.guide.shapes import (
    CurvedGuide,
    GelSection,
    MirrorGuide,
    curved_profile,
    mirror_profile,
)

GEL = GelSection(20.0, 2.0)
SHAPES = {
    "curved": curved_profile(CurvedGuide(22, 2, 6, 3), GEL),
    "crowned": curved_profile(CurvedGuide(22, 2, 6, 3), GelSection(20, 2, 0.8)),
    "flush": curved_profile(CurvedGuide(20, 2.5, 3, 1), GEL),
    "open": curved_profile(CurvedGuide(22, 2, 6, 3, bend_rad=math.radians(60)), GEL),
    "closed": curved_profile(CurvedGuide(30, 2, 6, 3, bend_rad=math.radians(120)), GEL),
    "tapered": curved_profile(CurvedGuide(22, 2, 6, 3, foot_thickness_mm=3.0), GEL),
    "glued": mirror_profile(MirrorGuide(22, 2, 3), GEL),
    "air_gap": mirror_profile(MirrorGuide(22, 2, 3, "air_gap"), GEL),
    "bare": curved_profile(CurvedGuide(22, 2, 6, 3)),
}


def polygon_area(profile: GuideProfile, medium: str, steps: int = 4000) -> float:
    points = np.array(
        [e.curve.at(k / steps) for e in profile.outline(medium) for k in range(steps)]
    )
    y, z = points.T
    return float(0.5 * np.sum(y * np.roll(z, -1) - z * np.roll(y, -1)))


@pytest.mark.parametrize("name", SHAPES)
def test_outlines_close_counter_clockwise_with_their_exact_area(name: str) -> None:
    profile = SHAPES[name]
    for medium in ("acrylic",) if name == "bare" else ("acrylic", "gel"):
        area = profile.area_mm2(medium)
        assert area > 0
        assert area == pytest.approx(polygon_area(profile, medium), rel=1e-6)


def test_area_of_the_curved_guide_is_that_of_its_pieces() -> None:
    expected = 22 * 2 + 2 * (math.pi / 4 * (8**2 - 6**2) + 3 * 2)
    assert SHAPES["curved"].area_mm2("acrylic") == pytest.approx(expected, rel=1e-14)


def test_areas_of_other_shapes_are_those_of_their_pieces() -> None:
    """Window, two ring sectors, two trapezoid legs; the crown is a circular segment."""
    gel = GEL.width_mm * GEL.thickness_mm
    for name, flat, turn, foot in (
        ("open", 22, 60, 2.0),
        ("closed", 30, 120, 2.0),
        ("tapered", 22, 90, 3.0),
    ):
        ring = math.radians(turn) / 2 * (8**2 - 6**2)
        expected = flat * 2 + 2 * (ring + 3 * (2 + foot) / 2)
        assert SHAPES[name].area_mm2("acrylic") == pytest.approx(expected, rel=1e-13)
        assert SHAPES[name].area_mm2("gel") == pytest.approx(gel, rel=1e-13)
    radius = (10**2 + 0.8**2) / (2 * 0.8)
    half = math.asin(10 / radius)
    cap = radius**2 * (half - math.sin(half) * math.cos(half))
    assert SHAPES["crowned"].area_mm2("gel") == pytest.approx(gel + cap, rel=1e-12)
    assert SHAPES["glued"].area_mm2("acrylic") == pytest.approx(22 * 2 + 2 * (2 * 2 / 2 + 3 * 2))
    assert SHAPES["air_gap"].area_mm2("acrylic") == pytest.approx(22 * 2)


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("turned", [False, True])
def test_media_lie_on_the_sides_they_are_said_to(name: str, turned: bool) -> None:
    """A point a little to the left of an edge is inside the outline of its left medium."""
    profile = transformed(SHAPES[name], mirrored=True) if turned else SHAPES[name]
    solids = [m for m in ("acrylic", "gel") if any(m in (e.left, e.right) for e in profile.edges)]
    regions = {
        m: Path([e.curve.at(k / 400) for e in profile.outline(m) for k in range(400)])
        for m in solids
    }
    for edge in profile.edges:
        (a, b), (c, d) = edge.curve.at(0.499), edge.curve.at(0.501)
        y, z = edge.curve.at(0.5)
        step = 1e-2 / math.hypot(c - a, d - b)
        left = (y - (d - b) * step, z + (c - a) * step)
        right = (y + (d - b) * step, z - (c - a) * step)
        for medium, region in regions.items():
            assert region.contains_point(left) == (edge.left == medium)
            assert region.contains_point(right) == (edge.right == medium)


def test_edges_run_either_way_are_the_same_face() -> None:
    for edge in SHAPES["crowned"].edges:
        turned = edge.reversed()
        assert (turned.left, turned.right) == (edge.right, edge.left)
        assert turned.curve.at(0.25) == pytest.approx(edge.curve.at(0.75))
        assert turned.curve.length_mm == edge.curve.length_mm


def test_guide_and_gel_share_one_face() -> None:
    for name in ("curved", "glued", "crowned"):
        faces = [e for e in SHAPES[name].edges if {e.left, e.right} == {"acrylic", "gel"}]
        assert len(faces) == 1


@pytest.mark.parametrize("name", SHAPES)
def test_profiles_are_their_own_mirror_image(name: str) -> None:
    profile = SHAPES[name]
    turned = transformed(profile, mirrored=True)
    assert turned.area_mm2("acrylic") == pytest.approx(profile.area_mm2("acrylic"), rel=1e-12)

    def ends(p: GuideProfile) -> np.ndarray:
        found = [(*e.curve.at(0.5), e.curve.length_mm) for e in p.edges]
        return np.array(sorted((round(a, 9), round(b, 9), round(c, 9)) for a, b, c in found))

    np.testing.assert_allclose(ends(turned), ends(profile), atol=1e-8)


def test_bends_survive_a_metre_of_travel() -> None:
    (first, second) = transformed(SHAPES["curved"], 1000.0, 1000.0).bends()
    for bend in (first, second):
        assert bend.ratio == pytest.approx(3.0, rel=1e-12)
        assert bend.sweep_rad == pytest.approx(math.pi / 2)
    assert SHAPES["glued"].bends() == ()


def test_a_gap_is_named() -> None:
    loose = GuideProfile(
        (
            Edge("floor", Segment((0, 0), (1, 0)), "acrylic", "air"),
            Edge("wall", Segment((1, 0.1), (0, 0)), "acrylic", "air"),
        )
    )
    with pytest.raises(ValueError, match="open after edge floor"):
        loose.outline("acrylic")
    with pytest.raises(ValueError, match="no gel"):
        loose.outline("gel")
    with pytest.raises(KeyError, match="ceiling"):
        loose.edge("ceiling")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: CurvedGuide(22, 2, 0.0, 3), "inner_radius_mm = 0"),
        (lambda: CurvedGuide(22, -2, 6, 3), "thickness_mm = -2"),
        (lambda: CurvedGuide(22, 2, math.nan, 3), "inner_radius_mm = nan"),
        (lambda: CurvedGuide(22, 2, 6, 3, bend_rad=3.0), "at most 150"),
        (lambda: CurvedGuide(22, 2, 1, 3, foot_thickness_mm=5.0), "foot reaches"),
        (lambda: CurvedGuide(18, 2, 6, 3), "exceeds the flat window"),
        (lambda: CurvedGuide(22, 2, 6, 3, bend_rad=0.0), "bend_rad = 0"),
        (lambda: CurvedGuide(22, 2, 6, 3, foot_thickness_mm=0.0), "foot_thickness_mm = 0"),
    ],
)
def test_impossible_guides_are_refused(make: object, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        curved_profile(make(), GEL)  # type: ignore[operator]


@pytest.mark.parametrize(
    ("guide", "gel", "words"),
    [
        (MirrorGuide(22, 2, -3), GEL, "leg_mm = -3"),
        (MirrorGuide(22, math.inf, 3), GEL, "thickness_mm = inf"),
        (MirrorGuide(18, 2, 3, "air_gap"), GEL, "exceeds the flat window"),
        (MirrorGuide(22, 2, 3), GelSection(20, 0.0), "gel_thickness_mm = 0"),
        (MirrorGuide(22, 2, 3), GelSection(20, 2, -0.1), "crown_mm = -0.1"),
        (MirrorGuide(22, 2, 3), GelSection(20, 2, math.nan), "crown_mm = nan"),
        (MirrorGuide(22, 2, 3), GelSection(20, 2, 10.5), "half the width, 10"),
        (MirrorGuide(22, 2, 3, "loose"), GEL, "fit = 'loose'"),  # type: ignore[arg-type]
    ],
)
def test_impossible_mirrors_and_gels_are_refused(
    guide: MirrorGuide, gel: GelSection, words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        mirror_profile(guide, gel)


def test_edges_need_two_media_and_a_length() -> None:
    with pytest.raises(ValueError, match="both sides"):
        GuideProfile((Edge("a", Segment((0, 0), (1, 0)), "air", "air"),))
    with pytest.raises(ValueError, match="no length"):
        GuideProfile((Edge("a", Segment((0, 0), (0, 0)), "acrylic", "air"),))
    with pytest.raises(ValueError, match="radius_mm"):
        Arc((0, 0), 0.0, 0.0, 1.0)
    with pytest.raises(ValueError, match="sweep_rad"):
        Arc((0, 0), 1.0, 0.0, 0.0)


TOP_MM = 1.7


@pytest.mark.parametrize("bend_deg", [60.0, 90.0, 130.0])
def test_corners_of_a_curved_guide_are_those_of_its_drawing(bend_deg: float) -> None:
    """Window 20 x 2 at z = 1.7, bends of inner radius 3, legs of 5 that end 3 wide."""
    guide = CurvedGuide(20, 2, 3, 5, math.radians(bend_deg), 3.0, TOP_MM)
    profile = curved_profile(guide, GelSection(14, 1.5, 0.6))
    # Complex numbers y + iz about the centre of the right bend; the bend turns clockwise.
    centre, turned = complex(10, TOP_MM - 2 - 3), np.exp(-1j * math.radians(bend_deg))
    along = turned
    across = 1j * turned
    expected = {
        "window_bottom": (complex(-10, TOP_MM - 2), complex(10, TOP_MM - 2)),
        "inner_bend_right": (centre + 3j, centre + 3 * across),
        "inner_leg_right": (centre + 3 * across, centre + 2.5 * across + 5 * along),
        "foot_right": (centre + 2.5 * across + 5 * along, centre + 5.5 * across + 5 * along),
        "outer_leg_right": (centre + 5.5 * across + 5 * along, centre + 5 * across),
        "outer_bend_right": (centre + 5 * across, centre + 5j),
        "window_top_right": (complex(10, TOP_MM), complex(7, TOP_MM)),
        "gel_window": (complex(7, TOP_MM), complex(-7, TOP_MM)),
        "window_top_left": (complex(-7, TOP_MM), complex(-10, TOP_MM)),
        "gel_side_right": (complex(7, TOP_MM), complex(7, TOP_MM + 1.5)),
        "gel_face": (complex(7, TOP_MM + 1.5), complex(-7, TOP_MM + 1.5)),
        "gel_side_left": (complex(-7, TOP_MM + 1.5), complex(-7, TOP_MM)),
    }
    for name, ends in list(expected.items()):
        if name.endswith("_right") and "window" not in name and "gel" not in name:
            # The left side is the mirror image, run from the other end.
            left = tuple(complex(-p.real, p.imag) for p in reversed(ends))
            expected[name.replace("_right", "_left")] = left
    assert {edge.name for edge in profile.edges} == set(expected)
    for edge in profile.edges:
        found = [complex(*edge.curve.start), complex(*edge.curve.end)]
        np.testing.assert_allclose(found, expected[edge.name], atol=1e-12)
    assert profile.edge("gel_face").curve.at(0.5) == pytest.approx((0.0, TOP_MM + 2.1))
    for name in ("inner_bend_right", "outer_bend_left"):
        curve = profile.edge(name).curve
        assert abs(curve.sweep_rad) == pytest.approx(math.radians(bend_deg))
        assert curve.length_mm == pytest.approx(curve.radius_mm * math.radians(bend_deg))


@pytest.mark.parametrize("fit", ["glued", "air_gap"])
def test_corners_of_a_mirror_guide_are_those_of_its_drawing(fit: str) -> None:
    guide = MirrorGuide(20, 2, 5, fit, TOP_MM)  # type: ignore[arg-type]
    profile = mirror_profile(guide, GelSection(20, 1.5))
    low, foot = TOP_MM - 2, TOP_MM - 7
    expected = {
        "gel_window": ((10, TOP_MM), (-10, TOP_MM)),
        "window_bottom": ((-10, low), (10, low)),
        "inner_leg_right": ((10, low), (10, foot)),
        "foot_right": ((10, foot), (12, foot)),
        "outer_leg_right": ((12, foot), (12, low)),
        "mirror_right": ((12, low), (10, TOP_MM)),
        "gel_face": ((10, TOP_MM + 1.5), (-10, TOP_MM + 1.5)),
    }
    if fit == "air_gap":
        expected["window_end_right"] = ((10, low), (10, TOP_MM))
        expected["leg_top_right"] = ((12, low), (10, low))
    for name, (start, end) in expected.items():
        curve = profile.edge(name).curve
        assert curve.start == pytest.approx(start)
        assert curve.end == pytest.approx(end)
        if name.endswith("_right"):
            mirrored = profile.edge(name.replace("_right", "_left")).curve
            assert mirrored.start == pytest.approx((-end[0], end[1]))
            assert mirrored.end == pytest.approx((-start[0], start[1]))


def test_limits_of_shapes_are_allowed_themselves() -> None:
    widest = CurvedGuide(20, 2, 3, 5, math.radians(150))
    assert len(curved_profile(widest, GelSection(20, 1.5)).bends()) == 2
    flush = [e.name for e in curved_profile(widest, GelSection(20, 1.5)).edges]
    assert "window_top_right" not in flush
    half_round = curved_profile(widest, GelSection(20, 1.5, 10.0)).edge("gel_face").curve
    assert half_round.sweep_rad == pytest.approx(math.pi)
    assert half_round.radius_mm == pytest.approx(10.0)
    assert curved_profile(CurvedGuide(20, 2, 1, 3, foot_thickness_mm=3.99)).edge("foot_left")
    with pytest.raises(ValueError, match="foot reaches"):
        curved_profile(CurvedGuide(20, 2, 1, 3, foot_thickness_mm=4.0))


def bent(inner: Arc, outer: Arc) -> GuideProfile:
    """A ring sector between two arcs, closed by straight ends."""
    return GuideProfile(
        (
            Edge("outer", outer, "acrylic", "air"),
            Edge("far", Segment(outer.end, inner.start), "acrylic", "air"),
            Edge("inner", inner, "acrylic", "air"),
            Edge("near", Segment(inner.end, outer.start), "acrylic", "air"),
        )
    )


def test_only_concentric_arcs_of_equal_sweep_are_a_bend() -> None:
    outer, sweep = Arc((2.0, 1.0), 5.0, 0.2, 1.1), -1.1
    (bend,) = bent(Arc((2.0, 1.0), 3.5, 1.3, sweep), outer).bends()
    assert (bend.centre, bend.inner_radius_mm, bend.outer_radius_mm) == ((2.0, 1.0), 3.5, 5.0)
    assert bend.sweep_rad == pytest.approx(1.1)
    assert bend.thickness_mm == pytest.approx(1.5)
    assert bend.ratio == pytest.approx(3.5 / 1.5)
    for inner, found in (
        (Arc((2.0, 1.0 + 4e-6), 3.5, 1.3, sweep), 1),
        (Arc((2.0, 1.0 + 6e-6), 3.5, 1.3, sweep), 0),
        (Arc((2.0, 1.0), 3.5, 1.3, sweep + 0.9e-6), 1),
        (Arc((2.0, 1.0), 3.5, 1.3, sweep + 1.2e-6), 0),
        (Arc((2.0, 1.0), 5.5, 1.3, sweep), 0),
        (Arc((2.0, 1.0), 3.5, 0.2, 1.1), 0),
    ):
        edges = [Edge("outer", outer, "acrylic", "air"), Edge("inner", inner, "acrylic", "air")]
        assert len(GuideProfile(tuple(edges)).bends()) == found
    backwards = GuideProfile(tuple(e.reversed() for e in bent(
        Arc((2.0, 1.0), 3.5, 1.3, sweep), outer
    ).edges))  # fmt: skip
    assert backwards.bends() == (bend,)
