"""Frames of real sensors, with settings estimated from each picture; skipped where absent.

They belong to others and are not in the project: GELSLIM_REAL_FRAMES names their folder.
"""

import os
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from gelslim_force.detection.detection import Detector
from gelslim_force.dot_tracking import DotTracking, dots_at_rest
from gelslim_force.lattice.dot_size import estimate_settings
from gelslim_force.tracking.matching import match

pytest.importorskip("PIL")
from gelslim_force.frames.picture import read_picture

ROOT = Path(__file__).parents[3]
FRAMES = Path(os.environ.get("GELSLIM_REAL_FRAMES", ROOT.parent / "shared" / "real_frames"))
PRESSES = ("press_5", "press_14", "press_18", "press_26", "press_33", "press_38", "press_44",
           "press_49")  # fmt: skip
# Where each press is, as a person sees it: centre and half width in px.
SEEN = {"press_5": (245, 240, 36), "press_33": (215, 52, 34), "press_38": (141, 130, 36),
        "press_44": (227, 163, 33), "press_49": (227, 193, 36)}  # fmt: skip


def picture(name):
    path = FRAMES / name
    if not path.is_file():
        pytest.skip(f"NOT TESTED on real frames: {path} is absent; set GELSLIM_REAL_FRAMES")
    return read_picture(path)


def test_gelslim2_dots_lie_on_the_lattice_of_the_print():
    """25 rows along the finger; of the 25 columns in view, the rim of the picture cuts away more
    than three fifths of the two outermost, which leaves the 23 that are counted."""
    found = estimate_settings(picture("gelslim2/reference.png"))
    assert found.on_lattice >= 0.97
    rows, columns = np.bincount(found.lattice.sites[:, 0]), np.bincount(found.lattice.sites[:, 1])
    if (
        found.lattice.dots.size
        and np.ptp(
            found.detections.centres_px[found.lattice.dots][found.lattice.sites[:, 0] == 5, 0]
        )
        < 200
    ):
        rows, columns = columns, rows
    assert len(rows) == 25
    assert np.sum(columns >= 0.4 * 25) == 23
    assert len(columns) <= 25
    assert len(found.lattice.dots) >= 500
    assert np.nanmedian(found.lattice.residual_px) < 0.3


@pytest.fixture(scope="module")
def gelslim3():
    return dots_at_rest(picture("gelslim3/reference.jpg"))


@pytest.mark.parametrize("name", PRESSES)
def test_gelslim3_double_dots_are_matched_from_rest_to_press(gelslim3, name):
    image = picture(f"gelslim3/{name}.jpg")
    dots = Detector(gelslim3.settings).detect(image)
    tracks = match(gelslim3.reference, dots.centres_px)
    assert len(tracks) >= 255
    assert tracks.coverage >= 0.99
    length = np.hypot(*tracks.displacement_px.T)
    assert 2.5 < np.nanmax(length) < 15
    if name in SEEN:
        x, y, half = SEEN[name]
        away = np.hypot(*(gelslim3.reference.positions_px - [x, y]).T)
        far = tracks.tracked & (away > 2.5 * half)
        assert far.sum() > 150
        assert np.median(length[far]) < 0.3
        assert np.hypot(*np.median(tracks.displacement_px[far], axis=0)) < 0.15
        peak = gelslim3.reference.positions_px[np.nanargmax(np.where(tracks.tracked, length, 0))]
        assert np.hypot(*(peak - [x, y])) < 1.3 * half, "the largest motion is at the contact"


def test_gelslim3_presses_are_followed_one_after_the_other(gelslim3):
    """Eight unrelated presses in a row, each a jump from the last."""
    tracking = DotTracking(gelslim3)
    for k, name in enumerate(PRESSES):
        result = tracking.follow(picture(f"gelslim3/{name}.jpg"), k, float(k))
        assert result.coverage >= 0.985, name
    back = tracking.follow(picture("gelslim3/reference.jpg"), 8, 8.0)
    assert np.nanmax(np.hypot(*back.tracks.displacement_px.T)) < 0.6


def test_fots_dots_agree_with_the_table_of_another_program():
    """The table counts whole pixels; where it says (x, y, dx, dy) the dot is at x + dx, y + dy."""
    apart = []
    for k in (0, 1):
        found = estimate_settings(picture(f"fots/press_{k}.png"))
        assert found.on_lattice >= 0.98
        assert sorted(found.lattice.shape) == [9, 12]
        table = np.loadtxt(FRAMES / "fots" / f"press_{k}.csv", delimiter=",", skiprows=1)
        gap, _ = cKDTree(found.detections.centres_px).query(table[:, :2] + table[:, 2:4])
        apart.append(gap)
        assert np.mean(gap < 3) >= 0.96
    both = np.concatenate(apart)
    assert np.mean(both < 3) >= 0.97
    assert np.median(both) < 1.0


def test_difftactile_grid_is_found_among_debris():
    found = estimate_settings(picture("difftactile/reference.png"))
    assert sorted(found.lattice.shape) == [10, 14]
    assert len(found.lattice.dots) >= 130
    assert np.nanmedian(found.lattice.residual_px) < 0.3
