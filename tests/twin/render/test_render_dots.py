"""Dots in frames: exact areas, exact places, found where they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from render_rig import (
    CAMERA,
    GRID,
    dent,
    detected_error,
    finger_camera,
    light,
    moved,
    renderer,
    rms,
)
from shapely.geometry import Polygon, box

from gelslim_force.calibration.fit import centroid_offset_px
from gelslim_optics.camera.lens_distortion import LensDistortion
from gelslim_twin.render.defocus import Defocus
from gelslim_twin.render.dot_kernel import draw_dots
from gelslim_twin.render.look import Look
from gelslim_twin.render.printed_dots import PrintedDots, centroids_px, outlines_px
from gelslim_twin.render.surface_state import SurfaceState
from ifem_export.markers.grid import build_marker_grid

DOTS = PrintedDots.nominal(GRID)
REST = SurfaceState.at_rest(22, 21)


def drawn(polygon: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    ink = np.zeros(shape, dtype=np.float32)
    one = np.ascontiguousarray(polygon[None], dtype=float)
    none, single = np.zeros(1, dtype=np.int64), np.ones(1, dtype=np.int64)
    draw_dots(one, one, np.ones(1, bool), single, np.ones((1, 1)), none, np.ones(1), ink)
    return ink


def polygons():
    """Stars, discs and triangles, either way round, some with corners on pixel borders."""
    rng = np.random.default_rng(3)
    for k in range(40):
        count = rng.integers(3, 40)
        turn = np.sort(rng.random(count)) * 2 * np.pi
        radius = np.full(count, 4.0) if k % 2 else rng.uniform(0.5, 6, count)
        p = np.stack([radius * np.cos(turn), radius * np.sin(turn)], 1) + 11 + rng.random(2)
        p = p[::-1] if k % 3 == 0 else p
        p = np.rint(2 * p) / 2 if k % 5 == 0 else p
        if Polygon(p).is_valid and Polygon(p).area > 0.01:
            yield p


@pytest.mark.slow
def test_coverage_is_the_area_that_shapely_cuts_out_of_each_pixel():
    checked = 0
    for p in polygons():
        shape = Polygon(p)
        exact = [
            [shape.intersection(box(x - 0.5, y - 0.5, x + 0.5, y + 0.5)).area for x in range(25)]
            for y in range(24)
        ]
        assert np.abs(drawn(p, (24, 25)) - exact).max() < 1e-6
        checked += 1
    assert checked > 25


def test_centroid_and_area_of_outlines_are_shapelys():
    for p in polygons():
        centre, area = centroids_px(p[None])
        there = Polygon(p).centroid
        assert centre[0] == pytest.approx([there.x, there.y], abs=1e-9)
        assert abs(area[0]) == pytest.approx(Polygon(p).area, rel=1e-12)


def test_a_dot_that_hangs_over_the_edge_loses_only_what_lies_outside():
    turn = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    p = np.stack([4 * np.cos(turn), 4 * np.sin(turn)], 1)
    for corner in ([0, 0], [29, 0], [0, 29], [29, 29], [-3, 12]):
        whole = drawn(p + corner + 20, (70, 70))[20:50, 20:50]
        assert 1 < whole.sum() < 45
        assert np.abs(drawn(p + corner, (30, 30)) - whole).max() < 1e-6
    assert drawn(p - 20, (30, 30)).max() == 0


@pytest.mark.parametrize("lens", [None, LensDistortion(k1=-0.18, k2=0.05, p1=1e-3)])
@pytest.mark.parametrize("pressed", [False, True])
def test_few_rim_points_place_dots_as_many_do(lens, pressed):
    camera, state = finger_camera(lens=lens), dent(0.8) if pressed else REST
    few, areas = centroids_px(outlines_px(camera, DOTS, state))
    many, many_areas = centroids_px(outlines_px(camera, DOTS, state, rim_points=256, corners=256))
    assert np.abs(few - many).max() < 5e-4
    assert areas / many_areas == pytest.approx(np.ones(len(areas)), abs=1e-4)


def test_centres_at_rest_are_the_projection_and_the_known_shift_of_a_disc():
    places = np.column_stack([GRID.positions_mm, np.zeros(len(GRID))])
    offset = centroid_offset_px(CAMERA, GRID.positions_mm, GRID.diameter_mm)
    centres, _ = centroids_px(outlines_px(CAMERA, DOTS, REST))
    assert np.abs(offset).max() > 3e-3
    assert np.abs(centres - CAMERA.project(places) - offset).max() < 2e-4


def test_a_surface_displaced_everywhere_alike_moves_every_dot_so():
    shifted = replace(DOTS, centres_mm=DOTS.centres_mm + np.array([0.3, -0.2]))
    a = outlines_px(CAMERA, DOTS, moved((0.3, -0.2, 0.0)))
    assert np.abs(a - outlines_px(CAMERA, shifted, REST)).max() < 1e-9


def test_interpolated_surface_meets_nodes_and_linear_fields_and_is_third_order():
    errors = []
    for count in (21, 41):
        axis = np.linspace(-5, 5, count)
        x, y = np.meshgrid(axis, axis)
        wave = np.sin(1.1 * x) * np.cos(0.9 * y)
        state = SurfaceState(axis, axis, np.stack([0.1 * x - 0.2 * y, wave, wave], 2))
        nodes = np.column_stack([x.ravel(), y.ravel()])
        assert np.abs(state.at(nodes) - state.displacement_mm.reshape(-1, 3)).max() < 1e-12
        at = np.random.default_rng(1).uniform(-4, 4, (500, 2))
        found = state.at(at)
        assert np.abs(found[:, 0] - (0.1 * at[:, 0] - 0.2 * at[:, 1])).max() < 1e-12
        truth = np.sin(1.1 * at[:, 0]) * np.cos(0.9 * at[:, 1])
        errors.append(np.abs(found[:, 1] - truth).max())
    assert errors[1] < errors[0] / 6


def test_nodes_of_a_rounded_mesh_fill_their_missing_corners():
    x, y = np.meshgrid(np.linspace(-2, 2, 5), np.linspace(-1, 1, 3))
    keep = ~((np.abs(x) == 2) & (np.abs(y) == 1))
    nodes = np.column_stack([x[keep], y[keep]])[::-1]
    state = SurfaceState.from_nodes(nodes, np.column_stack([nodes, nodes[:, 0]]))
    assert state.displacement_mm.shape == (3, 5, 3)
    assert state.displacement_mm[1, 4] == pytest.approx([2, 0, 2])
    assert np.abs(state.displacement_mm[2, 4, :2]).sum() == pytest.approx(2)


@pytest.mark.parametrize("pressed", [False, True])
def test_the_detector_finds_true_centres_on_clean_frames(pressed):
    state = dent(0.5) if pressed else None
    frame = renderer().frame(state)
    assert frame.drawn.sum() > 300
    assert rms(detected_error(frame, weight_from=0.0)) < 0.01
    # As the camera gives them, slightly soft, with the detector's own settings.
    soft = renderer(Look(defocus=Defocus(0.0, 30.0, 0.75))).frame(state)
    assert rms(detected_error(soft)) < 0.01
    assert rms(detected_error(soft, weight_from=0.0)) < 0.01


def test_truth_is_the_centroid_of_the_ink_that_is_drawn():
    sparse = build_marker_grid(5, 5, 3.5, 1.2, anchors="none")
    r = renderer(grid=sparse, light=light(1e6))
    state = dent(0.6)
    frame, ink = r.frame(state), np.zeros((480, 640), np.float32)
    outlines = outlines_px(CAMERA, r.dots, state)
    count = len(sparse)
    draw_dots(
        outlines, outlines, frame.drawn, np.ones(count, np.int64),
        np.ones((count, 1)), np.zeros(count, np.int64), np.ones(count), ink,
    )  # fmt: skip
    for centre, size in zip(frame.centres_px, frame.diameter_px, strict=True):
        x0, y0 = np.rint(centre).astype(int)
        half = int(size)
        part = ink[y0 - half : y0 + half + 1, x0 - half : x0 + half + 1].astype(float)
        y, x = np.mgrid[y0 - half : y0 + half + 1, x0 - half : x0 + half + 1]
        assert [(part * x).sum() / part.sum(), (part * y).sum() / part.sum()] == pytest.approx(
            centre, abs=1e-3
        )
        assert part.sum() == pytest.approx(np.pi / 4 * size**2, rel=1e-5)


def test_dots_shrink_with_distance_and_are_not_drawn_outside_the_picture():
    frame = renderer().frame()
    row = GRID.row[GRID.kind == 0]
    size = frame.diameter_px[GRID.kind == 0]
    middles = [size[row == r].mean() for r in range(19)]
    assert np.all(np.diff(middles) < 0) or np.all(np.diff(middles) > 0)
    assert max(middles) / min(middles) > 1.3
    away = renderer().frame(moved((0.0, 6.0, 0.0)))
    assert 0 < away.drawn.sum() < frame.drawn.sum()


def test_a_small_picture_is_the_middle_of_the_large_one():
    """Another size of picture, no multiple of the strips that frames are made in."""
    small = replace(CAMERA, image_width_px=202, image_height_px=150)
    a, b = renderer().frame(dent(0.5)), renderer(camera=small).frame(dent(0.5))
    assert b.image.shape == (150, 202, 3)
    cut = a.image[165:315, 219:421].astype(int)
    assert np.abs(cut - b.image)[2:-2, 2:-2].max() <= 1
    assert 0 < b.drawn.sum() < a.drawn.sum()
    shift = (a.centres_px - b.centres_px)[b.drawn]
    assert shift == pytest.approx(np.tile([219.0, 165.0], (len(shift), 1)), abs=1e-9)
