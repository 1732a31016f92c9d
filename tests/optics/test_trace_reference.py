"""Single rays through uneven scenes against a slow tracer that divides every ray exactly."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from light_cases import transformed
from slow_tracer import Ray, SlowTracer

from gelslim_optics.guide.profile import Arc, Edge, GuideProfile, Segment
from gelslim_optics.guide.shapes import (
    CurvedGuide,
    GelSection,
    MirrorGuide,
    curved_profile,
    mirror_profile,
)
from gelslim_optics.light import trace_geometry as column
from gelslim_optics.light.launch import launch, launch_medium
from gelslim_optics.light.scene import LightScene, Medium, Surface
from gelslim_optics.light.source import EdgeLaunch, EndRow, LedRow
from gelslim_optics.light.trace import TraceOptions, _job, _run

CUT = 0.02
"""Weak enough; a share of it that any face divides is above the smallest split weight."""
BINS = (5, 7)
# All indices differ by so much that each face divides light visibly.
MEDIA = {
    "air": Medium(1.0),
    "acrylic": Medium(1.5, 0.02),
    "leg": Medium(1.6, 0.01),
    "gel": Medium(1.25, 0.05),
}
COATS = {"paint": Surface(0.55), "mirror": Surface(0.8)}


def uneven(
    profile: GuideProfile,
    gel_x_mm: tuple[float, float],
    *,
    face: str = "gel_face",
    ends: str = "air",
) -> LightScene:
    """Off the origin on every axis, with a gel that ends before the guide or with it."""
    moved = transformed(profile, 3.1, -1.7)
    return LightScene(
        moved,
        (-6.0, 9.0),
        gel_x_mm,
        (LedRow("foot_right", (1.0, 4.0)),),
        MEDIA,
        COATS,
        ends=ends,
        face=face,
    )


def first(profile: GuideProfile, name: str) -> GuideProfile:
    """The profile with one edge before all others."""
    edges = sorted(profile.edges, key=lambda edge: edge.name != name)
    return GuideProfile(tuple(edges))


def crowned() -> LightScene:
    guide = CurvedGuide(12, 2, 1.5, 2, math.radians(80), foot_thickness_mm=2.4)
    profile = curved_profile(guide, GelSection(9, 1.5, 0.9))
    return uneven(first(profile, "foot_right"), (-4.5, 9.0))


def dented() -> LightScene:
    """A pad whose coated face is hollow, and whose outline runs the other way round."""
    profile = curved_profile(CurvedGuide(12, 2, 1.5, 2), GelSection(9, 2.5))
    (face,) = (e for e in profile.edges if e.name == "gel_face")
    (ay, az), (by, _) = face.curve.start, face.curve.end
    radius, middle = 8.0, (ay + by) / 2
    half = math.asin((ay - by) / 2 / radius)
    centre = (middle, az + radius * math.cos(half))
    hollow = Edge("gel_face", Arc(centre, radius, half - math.pi / 2, -2 * half), "gel", "paint")
    edges = [hollow if e.name == "gel_face" else e for e in profile.edges]
    return uneven(
        transformed(GuideProfile(tuple(edges)), mirrored=True), (-6.0, 7.5), ends="mirror"
    )


def glued() -> LightScene:
    return uneven(
        mirror_profile(MirrorGuide(12, 2, 3), GelSection(11, 1.5)), (-4.0, 9.0), ends="mirror"
    )


def air_gap() -> LightScene:
    return uneven(
        mirror_profile(MirrorGuide(12, 2, 3, "air_gap"), GelSection(12, 1.5)), (-4.5, 7.0)
    )


def round_rod() -> LightScene:
    """Most of a circle, cut by a flat foot; the arc is more than half a turn."""
    start = math.radians(-60)
    rim = Arc((0, 0), 4.0, start, 2 * math.pi - math.radians(60))
    foot = Edge("foot_right", Segment(rim.end, rim.start), "acrylic", "air")
    profile = GuideProfile((Edge("rim", rim, "acrylic", "air"), foot))
    return uneven(profile, (-4.5, 9.0), face="rim")


SCENES = {f.__name__: f for f in (crowned, dented, glued, air_gap, round_rod)}


def agree(
    scene: LightScene, source: EdgeLaunch | EndRow | LedRow, rows: np.ndarray, medium: str
) -> None:
    """Compare the tallies of each ray."""
    options = TraceOptions(split=1e-4, cut=CUT, bins=BINS)
    job = _job(scene, source, options)
    job = replace(job, medium=[*scene.media].index(medium))
    names = column.face_names(scene)
    for number, row in enumerate(rows):
        centred = row - np.array([0, *job.middle, 0, 0, 0, 0, 0])
        sums, heat, *_ = _run(job, centred[None], np.uint64(3), number)
        slow = SlowTracer(scene, source, CUT, BINS)
        if row[6] > 0:
            through = "ends" if isinstance(source, EndRow) else source.edge
            slow.follow(Ray(row[:3], row[3:6], medium, row[6], through))
        expected = booked(slow, names, row[7])
        expected[column.MISSED] += 0.0 if row[6] > 0 else 1 - row[7]
        np.testing.assert_allclose(sums, expected, atol=1e-7, err_msg=f"ray {number}")
        np.testing.assert_allclose(heat, slow.map, atol=1e-7)


def booked(slow: SlowTracer, names: tuple[str, ...], reflected: float) -> np.ndarray:
    """The slow tracer's book in the columns of the compiled one."""
    places = {
        "absorbed": column.ABSORBED,
        "truncated": column.TRUNCATED,
        "leaked.ends": column.ENDS,
        "leaked.gel_ends": column.GEL_ENDS,
        "stopped.ends": column.ENDS_STOPPED,
        "arrived": column.ARRIVED,
        "elevation": column.ELEVATION,
        "slope": column.SLOPE,
        "slope_along": column.SLOPE_ALONG,
        "entered_gel": column.ENTERED_GEL,
        "crossings": column.CROSSINGS,
    }
    for group, kind in enumerate(("leaked", "stopped", "returned")):
        for i, name in enumerate(names):
            places[f"{kind}.{name}"] = column.PER_EDGE + group * len(names) + i
    sums = np.zeros(column.columns(len(names)))
    sums[column.FOOT_REFLECTION] = reflected
    for entry, value in slow.book.items():
        sums[places[entry]] += value
    return sums


@pytest.mark.parametrize("name", SCENES)
def test_rays_from_the_leds_end_where_the_slow_tracer_says(name: str) -> None:
    scene = SCENES[name]()
    points = np.random.default_rng(17).random((24, 4))
    for foot in ("foot_left", "foot_right"):
        if any(edge.name == foot for edge in scene.profile.edges):
            source = LedRow(foot, (1.0, 4.0))
            agree(scene, source, launch(scene, source, points), launch_medium(scene, source))


@pytest.mark.parametrize("end", ["first", "last"])
@pytest.mark.parametrize("name", ["crowned", "air_gap", "round_rod"])
def test_rays_from_an_end_row_end_where_the_slow_tracer_says(name: str, end: str) -> None:
    """The row stands before window and leg, so that some light starts in a bend or beside it."""
    scene = SCENES[name]()
    y, z = scene.profile.edge("foot_right" if name == "round_rod" else "window_bottom").curve.start
    source = EndRow(end, (y - 1.0, y + 1.0), z + 0.8)  # type: ignore[arg-type]
    rows = launch(scene, source, np.random.default_rng(21).random((24, 4)))
    assert 0 < np.mean(rows[:, 6] > 0) < 1
    agree(scene, source, rows, launch_medium(scene, source))


@pytest.mark.parametrize("name", ["crowned", "dented", "air_gap"])
def test_rays_from_the_coated_face_end_where_the_slow_tracer_says(name: str) -> None:
    scene, source = SCENES[name](), EdgeLaunch("gel_window", into="gel")
    rows = launch(scene, source, np.random.default_rng(18).random((24, 4)))
    agree(scene, source, rows, "gel")


@pytest.mark.parametrize(
    ("name", "side"), [("crowned", -1), ("dented", 1), ("air_gap", -1), ("air_gap", 1)]
)
def test_light_in_the_air_beside_the_gel_enters_its_end_or_passes(name: str, side: int) -> None:
    scene, source = SCENES[name](), LedRow("foot_right", (1.0,))
    rng = np.random.default_rng(19)
    count = 60
    window_mm = scene.profile.edge("gel_window").curve.start[1]
    low, high = sorted((scene.gel_x_mm[side > 0], scene.x_mm[side > 0]))
    point = rng.uniform(
        (low + 0.01, -2.0, window_mm + 0.05), (high - 0.01, 8.0, window_mm + 3.0), (count, 3)
    )
    way = rng.uniform((0.3, -1.0, -1.0), (1.0, 1.0, 1.0), (count, 3)) * [-side, 1, 1]
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    rows = np.column_stack([point, way, np.ones(count), np.zeros(count)])
    agree(scene, source, rows, "air")


@pytest.mark.parametrize("name", ["crowned", "dented"])
def test_light_outside_ends_at_the_leds_and_on_the_back_of_the_coat(name: str) -> None:
    scene, source = SCENES[name](), LedRow("foot_left", (1.0,))
    rng = np.random.default_rng(20)
    rows = []
    for edge, away in (("foot_right", -1.0), ("gel_face", 1.0), ("window_bottom", -1.0)):
        for part in rng.uniform(0.1, 0.9, 8):
            y, z = scene.profile.edge(edge).curve.at(part)
            way = np.array([rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1), -away])
            rows.append([0.5, y, z + away, *(way / np.linalg.norm(way)), 1.0, 0.0])
    agree(scene, source, np.array(rows), "air")


def test_rays_beside_the_foot_have_missed_it_with_what_it_did_not_reflect() -> None:
    scene, source = crowned(), LedRow("foot_right", (1.0,))
    start = [1.0, *scene.profile.edge("foot_right").curve.start, 0.0, 0.0, 1.0]
    agree(scene, source, np.array([[*start, 0.0, 0.3], [*start, 0.0, 0.0]]), "acrylic")


def test_a_ray_that_starts_outside_of_its_medium_is_lost() -> None:
    scene, source = crowned(), LedRow("foot_right", (1.0,))
    job = _job(scene, source, TraceOptions(split=1e-4))
    sums, *_ = _run(job, np.array([[0.0, 0, 30, 0, 0, 1, 0.7, 0]]), np.uint64(3), 0)
    assert sums[column.LOST] == 0.7
    assert sums[column.CROSSINGS] == 1
    assert sums.sum() == pytest.approx(1.7)


@pytest.mark.parametrize("side", [0, 1])
def test_light_that_left_through_the_end_of_the_gel_leaks_through_it(side: int) -> None:
    """Level light in the gel, whose end lies before that of the guide or with it."""
    for name in ("air_gap", "crowned", "dented"):
        scene = SCENES[name]()
        middle = scene.profile.edge("gel_side_left").curve.at(0.5)[1]
        source = EdgeLaunch("gel_window", into="gel")
        way = [0.99 * (1 if side else -1), 0.02, math.sqrt(1 - 0.99**2 - 0.02**2)]
        row = [scene.gel_x_mm[side] * 0.9, 3.0, middle, *way, 1.0, 0.0]
        agree(scene, source, np.array([row]), "gel")
