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
from gelslim_optics.light.source import EdgeLaunch, LedRow
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


def uneven(profile: GuideProfile, *, face: str = "gel_face", ends: str = "air") -> LightScene:
    """Off the origin on every axis, with a gel that ends before the guide at one end only."""
    moved = transformed(profile, 3.1, -1.7)
    return LightScene(
        moved,
        (-6.0, 9.0),
        (-4.5, 9.0),
        (LedRow("foot_right", (1.0, 4.0)),),
        MEDIA,
        COATS,
        ends=ends,
        face=face,
    )


def crowned() -> LightScene:
    guide = CurvedGuide(12, 2, 1.5, 2, math.radians(80), foot_thickness_mm=2.4)
    return uneven(curved_profile(guide, GelSection(9, 1.5, 0.9)))


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
    return uneven(transformed(GuideProfile(tuple(edges)), mirrored=True), ends="mirror")


def glued() -> LightScene:
    return uneven(mirror_profile(MirrorGuide(12, 2, 3), GelSection(11, 1.5)), ends="mirror")


def air_gap() -> LightScene:
    return uneven(mirror_profile(MirrorGuide(12, 2, 3, "air_gap"), GelSection(12, 1.5)))


def round_rod() -> LightScene:
    """Most of a circle, cut by a flat foot; the arc is more than half a turn."""
    start = math.radians(-60)
    rim = Arc((0, 0), 4.0, start, 2 * math.pi - math.radians(60))
    foot = Edge("foot_right", Segment(rim.end, rim.start), "acrylic", "air")
    profile = GuideProfile((Edge("rim", rim, "acrylic", "air"), foot))
    return uneven(profile, face="rim")


SCENES = {f.__name__: f for f in (crowned, dented, glued, air_gap, round_rod)}


def agree(scene: LightScene, source: EdgeLaunch | LedRow, rows: np.ndarray, medium: str) -> None:
    """Compare the tallies of each ray."""
    options = TraceOptions(split=1e-4, cut=CUT, bins=BINS)
    job = _job(scene, source, options)
    job = replace(job, medium=[*scene.media].index(medium))
    names = column.face_names(scene)
    for number, row in enumerate(rows):
        if row[6] == 0:
            continue
        centred = row - np.array([0, *job.middle, 0, 0, 0, 0, 0])
        sums, heat, _ = _run(job, centred[None], np.uint64(3), number)
        slow = SlowTracer(scene, source, CUT, BINS)
        slow.follow(Ray(row[:3], row[3:6], medium, row[6], source.edge))
        expected = booked(slow, names, row[7])
        np.testing.assert_allclose(sums, expected, atol=1e-9, err_msg=f"ray {number}")
        np.testing.assert_allclose(heat, slow.map, atol=1e-9)


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


@pytest.mark.parametrize("name", ["crowned", "dented", "air_gap"])
def test_rays_from_the_coated_face_end_where_the_slow_tracer_says(name: str) -> None:
    scene, source = SCENES[name](), EdgeLaunch("gel_window", into="gel")
    rows = launch(scene, source, np.random.default_rng(18).random((24, 4)))
    agree(scene, source, rows, "gel")


@pytest.mark.parametrize("name", ["crowned", "dented"])
def test_light_in_the_air_beside_the_gel_enters_its_end_or_passes(name: str) -> None:
    scene, source = SCENES[name](), LedRow("foot_right", (1.0,))
    rng = np.random.default_rng(19)
    count = 60
    window_mm = scene.profile.edge("gel_window").curve.start[1]
    point = rng.uniform((-5.9, -2.0, window_mm + 0.05), (-4.6, 8.0, window_mm + 3.0), (count, 3))
    way = rng.uniform((0.3, -1.0, -1.0), (1.0, 1.0, 1.0), (count, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    rows = np.column_stack([point, way, np.ones(count), np.zeros(count)])
    agree(scene, source, rows, "air")
