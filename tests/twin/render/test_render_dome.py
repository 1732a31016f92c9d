"""Domed gels: dots, sight lines and shading follow the dome, and calibration agrees with them."""

from __future__ import annotations

import numpy as np
import pytest
from render_rig import AXIS_X, AXIS_Y, CAMERA, GRID, PAD, dent, detected_error, moved, renderer, rms
from scipy.spatial import cKDTree

from gelslim_force.calibration.calibration import calibrate
from gelslim_force.calibration.design import marker_heights_mm
from gelslim_twin.render.look import Look, sensor_look
from gelslim_twin.render.shading import Shading
from gelslim_twin.render.surface_state import DomedTop, SurfaceState
from gelslim_twin.render.surroundings import Sight
from ifem_export.bundle.bundle import Bundle, build_bundle
from ifem_export.elements.material import Material
from ifem_export.markers.grid import build_marker_grid
from ifem_export.mesh.crown import Paraboloid
from ifem_export.mesh.outline import RoundedRectangle
from ifem_export.mesh.pad_mesh import build_pad_mesh

CROWN = Paraboloid(0.8, 15.0)


def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.asarray(CROWN.height_mm(x, y))


def dome() -> DomedTop:
    x, y = np.meshgrid(AXIS_X, AXIS_Y)
    rest = np.zeros((*x.shape, 3))
    rest[..., 2] = height(x, y)
    return DomedTop(SurfaceState(AXIS_X, AXIS_Y, rest))


def crowned_bundle() -> Bundle:
    grid = build_marker_grid(19, 18, 1.1, 0.45, anchors="odd_sized")
    mesh, _ = build_pad_mesh(
        RoundedRectangle(length_mm=22.0, width_mm=21.0, corner_radius_mm=1.0),
        2.0,
        cells=(44, 42, 4),
        crown=CROWN,
        weighting="volume_fraction",
    )
    return build_bundle(
        mesh,
        Material(0.147, 0.3223, 1000.0),
        "bbar",
        marker_positions_mm=grid.positions_mm,
        marker_arrays=grid.labels,
        camera=CAMERA.to_record(),
        with_stiffness=False,
    )


def test_flat_gels_have_no_dome_and_a_level_dome_is_flat() -> None:
    flat = np.column_stack([a.ravel() for a in np.meshgrid(AXIS_X, AXIS_Y)])
    assert DomedTop.of_nodes(np.column_stack([flat, np.zeros(len(flat))])) is None
    level = DomedTop(SurfaceState(AXIS_X, AXIS_Y, np.zeros((len(AXIS_Y), len(AXIS_X), 3))))
    for motion in (None, dent()):
        plain, over = (renderer(Look(), top=top).frame(motion) for top in (None, level))
        assert np.array_equal(plain.image, over.image)
        assert np.array_equal(plain.centres_px, over.centres_px)


def test_dots_of_a_dome_are_images_of_their_places_on_it() -> None:
    found = renderer(top=dome()).frame()
    places = GRID.positions_mm
    true = CAMERA.project(np.column_stack([places, height(*places.T)]))
    flat = CAMERA.project(np.column_stack([places, np.zeros(len(places))]))
    # The centroid of a dot's image is not the image of its centre: keystone makes 0.06 px of it.
    off = (found.centres_px - true)[found.drawn]
    assert np.abs(off).max() < 0.07
    assert np.linalg.norm(true - flat, axis=1).max() > 4


def test_detector_finds_dots_of_a_dome_where_they_are() -> None:
    flat = rms(detected_error(renderer().frame()))
    assert flat < 0.025
    assert rms(detected_error(renderer(top=dome()).frame())) < 1.1 * flat
    assert rms(detected_error(renderer(top=dome()).frame(moved((0.2, -0.1, -0.1))))) < 1.1 * flat


def test_rays_meet_the_dome_where_the_height_field_is_met() -> None:
    sight = Sight.of(CAMERA, 40)
    seen = dome().seen_mm(sight)
    places = seen.reshape(-1, 2)
    on_pad = (np.abs(places) < (PAD.length_mm / 2 - 1, PAD.width_mm / 2 - 1)).all(axis=1)
    at = CAMERA.project(np.column_stack([places, height(*places.T)]))[on_pad]
    rows, columns = sight.rest_mm.shape[:2]
    y, x = np.mgrid[:rows, :columns] * 40.0
    pixels = np.column_stack([x.ravel(), y.ravel()])[on_pad]
    assert on_pad.sum() > 50
    assert np.abs(at - pixels).max() < 0.02


def test_flanks_of_a_dome_are_lit_by_their_slope() -> None:
    drawn = renderer(Look(shading=Shading(ambient_share=0.0), contrast=0.0), top=dome())
    ink = np.zeros((CAMERA.image_height_px, CAMERA.image_width_px), dtype=np.float32)
    flat = renderer(Look(shading=Shading(ambient_share=0.0), contrast=0.0), top=None)
    ratio = drawn.values(ink) / np.maximum(flat.values(ink), 1e-6)
    for y_mm in (-6.0, 6.0):
        px = CAMERA.project(np.array([[0.0, y_mm, height(0.0, y_mm)]]))[0]
        column, row = np.rint(px).astype(int)
        # Red travels along +y, green along -y, rising by 25 degrees; n = (-hx, -hy, 1).
        slope = -2 * 0.8 * y_mm / 15.0**2
        size = np.sqrt(1 + slope**2)
        cot = 1 / np.tan(np.radians(25.0))
        red, green = (1 - slope * cot) / size, (1 + slope * cot) / size
        # Light falls off across the pad, and a ray meets the dome beside where it meets z = 0.
        assert ratio[row, column, 0] == pytest.approx(red, rel=0.06)
        assert ratio[row, column, 1] == pytest.approx(green, rel=0.06)


@pytest.mark.parametrize("look", [Look(), sensor_look(1.2, 40.0, 3)], ids=["clean", "sensor"])
def test_calibration_finds_the_drawn_dots_where_it_says(look: Look) -> None:
    bundle = crowned_bundle()
    top = DomedTop.of_nodes(np.asarray(bundle.mesh.surface_mm))
    grid = build_marker_grid(19, 18, 1.1, 0.45, anchors="odd_sized")
    draws = renderer(look, grid=grid, top=top)
    frame = draws.frame(number=1)
    found = calibrate(bundle, frame.image)
    heights = marker_heights_mm(bundle)[found.markers]
    assert np.abs(heights - height(*grid.positions_mm[found.markers].T)).max() < 0.005
    says = found.camera.project(np.column_stack([found.rest_mm, heights]))
    apart, _ = cKDTree(frame.centres_px[frame.drawn]).query(says)
    # With noise and specks, what is left is the detector's.
    assert np.median(apart) < (0.05 if look.sensor_noise is None else 0.08)
    off = found.rest_mm - draws.dots.centres_mm[found.markers]
    assert np.median(np.abs(off)) < 0.003


def test_a_dome_drawn_flat_would_not_pass() -> None:
    grid = build_marker_grid(19, 18, 1.1, 0.45, anchors="odd_sized")
    frame = renderer(grid=grid).frame()
    places = np.column_stack([grid.positions_mm, height(*grid.positions_mm.T)])
    apart = np.linalg.norm(frame.centres_px - CAMERA.project(places), axis=1)
    assert np.median(apart) > 1
