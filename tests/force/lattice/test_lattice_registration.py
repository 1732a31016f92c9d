"""Which dot is which: drawn frames registered on the print, absolutely, by anchors or camera."""

import numpy as np
import pytest
from camera_rig import finger_view
from sampled import quick
from synthetic import Look, grid_of_dots, render

from gelslim_force.detection.detection import Detector
from gelslim_force.detection.settings import DetectorSettings
from gelslim_force.lattice.growth import LatticeError, grow_lattice
from gelslim_force.lattice.registration import register
from ifem_export.markers.grid import build_marker_grid

GRID = grid_of_dots()
CAMERA = finger_view()
SHAPE = (480, 640)


def detected(frame):
    return Detector(DetectorSettings.for_diameters(frame.diameter_px)).detect(frame.image)


def assert_right(registration, frame, least=1.0):
    """Every marker found is where it was drawn, and enough are."""
    found = registration.found
    off = np.hypot(*(registration.centres_px - frame.centres_px)[found].T)
    assert off.max() < 5, f"{np.sum(off > 5)} markers are others"
    assert not found[~frame.drawn].any()
    assert found.sum() >= least * frame.drawn.sum()


@pytest.mark.parametrize("anchors", ["odd_sized", "omitted"])
@pytest.mark.parametrize(
    "look", [Look(), Look(noise=8), Look(noise=8, blur=2, dirt=10, specular=5)]
)
def test_the_anchors_alone_identify_every_dot(anchors, look):
    grid = grid_of_dots(anchors)
    frame = render(grid, look=look)
    found = register(detected(frame), grid, SHAPE)
    assert_right(found, frame, 0.985)
    assert found.coverage == pytest.approx(found.found.mean())
    assert found.margin > 4.6
    assert np.nanmedian(found.residual_px) < 0.3
    assert np.isnan(found.camera_offset_pitch)


@pytest.mark.parametrize("anchors", ["odd_sized", "omitted"])
@pytest.mark.parametrize(
    "step", quick([(1, 0), (-1, 0), (0, 1), (0, -2), (2, 1)], ((-1, 0), (2, 1)).__contains__)
)
def test_a_print_whole_pitches_off_is_resolved_by_its_anchors(anchors, step):
    """The frame looks the same but for the anchors and the rim; the camera says otherwise."""
    grid = grid_of_dots(anchors)
    moved = np.tile(np.array(step) * 1.1, (len(grid), 1))
    frame = render(grid, look=Look(noise=5), moved_mm=moved)
    for camera in (None, CAMERA):
        found = register(detected(frame), grid, SHAPE, camera)
        inside = np.all((frame.centres_px > 8) & (frame.centres_px < [631, 471]), axis=1)
        # A dot that the border of the picture cuts has another centroid.
        off = np.hypot(*(found.centres_px - frame.centres_px)[found.found & inside].T)
        assert off.max() < 1.5
        assert found.found[inside].mean() > 0.99
    assert found.camera_offset_pitch == pytest.approx(np.hypot(*step), rel=0.15)


@pytest.mark.parametrize("cut", [(120, 90, 560, 420), (60, 0, 420, 480), (200, 160, 640, 480)])
def test_a_window_of_the_print_is_placed_by_the_anchors_in_it(cut):
    """Its rim out of view, only the anchors tell where the window lies."""
    left, top, right, bottom = cut
    frame = render(GRID, look=Look(noise=4))
    image = np.ascontiguousarray(frame.image[top:bottom, left:right])
    dots = Detector(DetectorSettings.for_diameters(frame.diameter_px)).detect(image)
    found = register(dots, GRID, image.shape)
    inside = np.all(
        (frame.centres_px > [left + 8, top + 8]) & (frame.centres_px < [right - 9, bottom - 9]),
        axis=1,
    )
    off = np.hypot(*(found.centres_px - (frame.centres_px - [left, top])).T)
    assert np.nanmax(off[inside]) < 1.5
    assert np.nanmax(off) < 6, "cut by the window"
    assert found.found[inside].mean() > 0.98


def test_a_turned_and_a_mirrored_picture_are_recognised():
    frame = render(GRID, look=Look(noise=5))
    height, width = SHAPE
    detector = Detector(DetectorSettings.for_diameters(frame.diameter_px))
    turned = np.ascontiguousarray(np.rot90(frame.image, 2))
    found = register(detector.detect(turned), GRID, SHAPE)
    back = np.array([width - 1, height - 1]) - found.centres_px
    assert np.nanmax(np.hypot(*(back - frame.centres_px).T)) < 1.5
    mirrored = np.ascontiguousarray(frame.image[:, ::-1])
    found = register(detector.detect(mirrored), GRID, SHAPE)
    back = np.column_stack([width - 1 - found.centres_px[:, 0], found.centres_px[:, 1]])
    assert np.nanmax(np.hypot(*(back - frame.centres_px).T)) < 1.5


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_missing_dots_and_spurious_ones(seed):
    frame = render(GRID, look=Look(noise=6, missing=0.1, dirt=15, seed=seed))
    assert_right(register(detected(frame), GRID, SHAPE), frame, 0.97)


def test_half_of_the_markers_missing_is_placed_or_refused_never_wrong():
    placed = 0
    for seed in range(1, 9):
        frame = render(GRID, look=Look(noise=4, missing=0.5, seed=seed))
        try:
            found = register(detected(frame), GRID, SHAPE, CAMERA)
        except LatticeError:
            continue
        placed += 1
        assert_right(found, frame, 0.8)
    assert placed >= 6


def test_a_corner_in_shadow():
    frame = render(GRID, look=Look(noise=3))
    y, x = np.mgrid[:480, :640]
    shade = np.where(x + 1.2 * y < 300, 0.02, 1.0)[..., None]
    image = (frame.image * shade).astype(np.uint8)
    dots = Detector(DetectorSettings.for_diameters(frame.diameter_px)).detect(image)
    found = register(dots, GRID, SHAPE)
    off = np.hypot(*(found.centres_px - frame.centres_px)[found.found].T)
    assert off.max() < 2.0
    lit = frame.centres_px @ [1, 1.2] > 330
    assert found.found[lit].mean() > 0.99
    assert 0.8 < lit.mean() < 0.97


def test_without_anchors_the_camera_decides_and_without_both_it_is_refused():
    grid = grid_of_dots("none")
    frame = render(grid, look=Look(noise=5))
    dots = detected(frame)
    found = register(dots, grid, SHAPE, CAMERA)
    assert_right(found, frame, 0.99)
    assert found.camera_offset_pitch < 0.05
    with pytest.raises(LatticeError):
        register(dots, grid, SHAPE)


def test_another_print_is_refused():
    """Pitch and lattice of another sensor: more dots than the print has."""
    frame = render(GRID, look=Look(noise=4))
    small = build_marker_grid(7, 6, 2.9, 0.8, anchors="odd_sized")
    with pytest.raises(LatticeError):
        register(detected(frame), small, SHAPE, CAMERA)


def test_no_lattice_no_registration():
    empty = Detector().detect(np.full((480, 640, 3), 130, np.uint8))
    with pytest.raises(LatticeError, match="0 dots"):
        register(empty, GRID, SHAPE)
    rng = np.random.default_rng(1)
    frame = render(GRID, look=Look())
    dots = detected(frame)
    chaos = type(dots)(
        centres_px=rng.uniform(0, 480, (len(dots), 2)),
        area_px=dots.area_px,
        contrast=dots.contrast,
        moments_px2=dots.moments_px2,
        flags=dots.flags,
    )
    with pytest.raises(LatticeError):
        register(chaos, GRID, SHAPE)
    strip = dots.take(GRID.row < 2)
    with pytest.raises(LatticeError):
        register(strip, GRID, SHAPE)


def test_a_lattice_of_no_known_print():
    """Grown from the dots alone: every pair of neighbours is one on the print."""
    frame = render(GRID, look=Look(noise=8, missing=0.05, dirt=10))
    dots = detected(frame)
    lattice = grow_lattice(dots)
    assert sorted(lattice.shape) == [18, 19]
    gap = np.linalg.norm(dots.centres_px[lattice.dots][:, None] - frame.centres_px, axis=2)
    marker = gap.argmin(axis=1)
    assert gap.min(axis=1).max() < 1.5
    assert len(lattice.dots) >= 0.98 * frame.drawn.sum()
    own = np.column_stack([GRID.row, GRID.column])[marker]
    # One rigid motion of the index plane takes all sites to the print's.
    design = np.column_stack([lattice.sites, np.ones(len(own))])
    change, *_ = np.linalg.lstsq(design, own, rcond=None)
    assert np.abs(design @ change - own).max() < 1e-6
    assert np.allclose(np.abs(change[:2]).sum(axis=0), 1.0)


def test_a_speck_next_to_the_print_adds_no_row():
    frame = render(GRID, look=Look())
    dots = detected(frame)
    at = (GRID.row == 9) & (GRID.column >= 14)
    line = frame.centres_px[at][np.argsort(GRID.column[at])]
    speck = line[-1] + (line[-1] - line[-2])
    more = type(dots)(
        centres_px=np.vstack([dots.centres_px, speck]),
        area_px=np.append(dots.area_px, dots.area_px[-1]),
        contrast=np.append(dots.contrast, dots.contrast[-1]),
        moments_px2=np.vstack([dots.moments_px2, dots.moments_px2[-1]]),
        flags=np.append(dots.flags, 0),
    )
    lattice = grow_lattice(more)
    assert sorted(lattice.shape) == [18, 19]
    assert len(dots) not in lattice.dots
