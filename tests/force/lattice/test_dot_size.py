"""Settings estimated from a picture alone, and any sensor's dots followed by them."""

import numpy as np
import pytest
from synthetic import Look, grid_of_dots, render

from gelslim_force.dot_tracking import DotTracking, dots_at_rest
from gelslim_force.lattice.dot_size import estimate_settings
from gelslim_force.lattice.growth import LatticeError
from gelslim_force.outputs.track_record import COLUMNS, TrackRecord
from ifem_export.markers.grid import build_marker_grid

GRID = grid_of_dots()


@pytest.mark.parametrize(
    ("grid", "look"),
    [
        pytest.param(GRID, Look(noise=8), marks=pytest.mark.slow),
        (GRID, Look(noise=8, double=True)),
        pytest.param(GRID, Look(noise=4, contrast=0.1), marks=pytest.mark.slow),
        (GRID, Look(noise=8, dirt=20, specular=8)),
        pytest.param(GRID, Look(noise=8, colour=False, blur=2), marks=pytest.mark.slow),
        pytest.param(
            build_marker_grid(9, 9, 2.2, 1.2, anchors="odd_sized"),
            Look(noise=8),
            marks=pytest.mark.slow,
        ),
        (build_marker_grid(25, 24, 0.8, 0.3, anchors="odd_sized"), Look(noise=6)),
    ],
    ids=["round", "double", "faint", "dirt", "grey", "large", "small"],
)
def test_the_settings_find_the_whole_print_and_little_else(grid, look):
    frame = render(grid, look=look)
    found = estimate_settings(frame.image)
    assert sorted(found.lattice.shape) == sorted(grid.lattice_shape)
    # Anchors left out are the print's; dots are lost to dirt only.
    assert len(found.lattice.dots) >= 0.985 * len(grid)
    assert found.on_lattice > 0.97
    low, high = found.diameter_px
    assert low == pytest.approx(np.percentile(frame.diameter_px, 1), rel=0.35)
    assert found.settings.smallest_diameter_px < low < high
    assert high < found.settings.largest_diameter_px
    assert (found.settings.shape == "double") or not look.double


@pytest.mark.parametrize("seed", [1, 2])
def test_pictures_without_a_lattice_are_refused(seed):
    rng = np.random.default_rng(seed)
    noise = rng.integers(0, 255, (240, 320, 3), dtype=np.uint8)
    for image in (np.full((240, 320), 128, np.uint8), noise, np.zeros((240, 320), np.uint8)):
        with pytest.raises(LatticeError):
            estimate_settings(image)
    with pytest.raises(ValueError, match="float64"):
        estimate_settings(np.zeros((240, 320)))


@pytest.mark.parametrize(
    "seed", [5, 6, *(pytest.param(k, marks=pytest.mark.slow) for k in range(7, 11))]
)
def test_dots_strewn_at_random_are_no_lattice(seed):
    rng = np.random.default_rng(seed)
    image = np.full((300, 400), 180, np.uint8)
    y, x = np.mgrid[:300, :400]
    for cx, cy in rng.uniform(10, 290, (90, 2)):
        image[np.hypot(x - cx, y - cy) < 4] = 40
    with pytest.raises(LatticeError):
        estimate_settings(image)


def test_tracks_of_an_unknown_sensor_and_their_record(tmp_path):
    """Sites are arbitrary, displacements are not: each belongs to the dot that rests there."""
    rest = dots_at_rest(render(GRID, look=Look(noise=5)).image)
    still = render(GRID, look=Look()).centres_px
    tracking, record = DotTracking(rest), TrackRecord(rest)
    moved = 0.8 * np.exp(-np.sum((GRID.positions_mm - [2, 1]) ** 2, axis=1) / 18)[:, None]
    moved = moved * np.array([[0.6, 0.8]])
    pressed = render(GRID, look=Look(noise=5, seed=4), moved_mm=moved)
    images = [render(GRID, look=Look(noise=5, seed=3)).image, None, pressed.image,
              pressed.image[:240], np.zeros((480, 640, 2), np.uint8)]  # fmt: skip
    for k, image in enumerate(images):
        record.take(tracking.follow(image, k, 0.01 * k))
    record.write(tmp_path / "run" / "tracks.npz")
    with np.load(tmp_path / "run" / "tracks.npz") as data:
        kept = dict(data)
    count = len(rest.reference)
    assert kept["places_px"].shape == (5, count, 2)
    assert kept["time_s"].tolist() == pytest.approx([0, 0.01, 0.02, 0.03, 0.04])
    assert kept["frame_index"].tolist() == [0, 1, 2, 3, 4]
    assert len(np.unique(kept["sites"], axis=0)) == count
    own = np.linalg.norm(kept["rest_px"][:, None] - still, axis=2).argmin(axis=1)
    off = kept["displacement_px"][2] - (pressed.centres_px - still)[own]
    assert np.sqrt(np.nanmean(off**2)) < 0.06
    assert np.nanmax(np.hypot(*kept["displacement_px"][2].T)) > 5
    assert np.nanmax(np.hypot(*kept["displacement_px"][0].T)) < 0.4
    assert kept["coverage"][[0, 2]].min() > 0.99
    assert kept["coverage"][[1, 3, 4]].max() == 0
    assert np.all(kept["status"][1] == 255)
    assert np.isnan(kept["places_px"][1]).all()
    lines = record.table().decode().splitlines()
    assert lines[0] == ",".join(COLUMNS)
    assert len(lines) == 6
    assert "could not be read" in lines[2]
    assert "640 x 240 px" in lines[4]
    summary = record.summary()
    assert (summary["frames"], summary["frames_without_tracks"]) == (5, 3)
    assert sorted(summary["lattice_shape"]) == [18, 19]
    assert sorted(summary["problems"]) == ["1", "3", "4"]


def test_the_same_run_gives_the_same_bytes(tmp_path):
    rest = dots_at_rest(render(GRID, look=Look(noise=5)).image)
    for name in ("a", "b"):
        tracking, record = DotTracking(rest), TrackRecord(rest)
        record.take(tracking.follow(render(GRID, look=Look(noise=5, seed=3)).image, 0, 0.0))
        record.write(tmp_path / f"{name}.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    assert sorted(f.name for f in tmp_path.iterdir()) == ["a.npz", "b.npz"]
