"""A dot that dirt covers in part is no marker, and dirt is no contact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pressed_samples import calibration, lit_bundle, reference
from shaded_frames import shaded

from gelslim_force.built_sensor import BuiltGel
from gelslim_force.sensor import normal_source
from gelslim_force.tracking.tracks import MarkerStatus
from gelslim_force.tracking.whole_dots import WholeDots


def soiled(picture: np.ndarray, at_px: np.ndarray, radius_px: float) -> np.ndarray:
    rows, columns = np.mgrid[: picture.shape[0], : picture.shape[1]]
    image = picture.copy()
    image[np.hypot(columns - at_px[0], rows - at_px[1]) < radius_px] = 30
    return image


def test_a_dot_that_is_covered_in_part_is_rejected() -> None:
    found = calibration()
    dots = np.searchsorted(found.markers, found.reference.markers)
    whole = WholeDots(found.reference, found.dots.moments_px2[dots])
    tracker = found.tracker()
    clean = shaded(camera=calibration().camera, seed=41).image
    assert whole.of(tracker.update(clean)).tracks.tracked.all()
    marker = len(tracker.reference) // 2 + 3
    place = tracker.reference.positions_px[marker]
    for aside in (5.0, -5.0):
        tracker.reset()
        frame = tracker.update(soiled(clean, place + np.array([aside, 0.0]), 3.5))
        tracks = whole.of(frame).tracks
        assert tracks.status[marker] != MarkerStatus.TRACKED
        others = np.delete(np.arange(len(tracks)), marker)
        assert tracks.tracked[others].mean() > 0.99


def test_an_opaque_speck_is_no_contact() -> None:
    markers = calibration().reference.positions_px
    middle = markers[len(markers) // 2] + [13.0, 11.0]
    source = normal_source(BuiltGel(lit_bundle(), calibration()), reference().image, "sphere:6")
    assert source is not None
    clean = shaded(camera=calibration().camera, seed=43).image
    for radius in (4.0, 9.0):
        assert source.look(soiled(clean, middle, radius), markers) is None


def test_strained_dots_beside_soiled_ones_are_kept() -> None:
    """Dirt on parts of dots cut the strained ones beside them, and forces were off by 11 mN."""
    found = calibration()
    dots = np.searchsorted(found.markers, found.reference.markers)
    whole = WholeDots(found.reference, found.dots.moments_px2[dots])
    frame = found.tracker().update(shaded(camera=calibration().camera, seed=47).image)
    marker = len(found.reference) // 2
    beside = found.reference.neighbours[marker, :3]
    moments = frame.detections.moments_px2.copy()
    moments[frame.tracks.dots[marker]] *= np.exp(0.1)
    moments[frame.tracks.dots[beside]] *= np.exp(-0.3)
    strained = replace(frame, detections=replace(frame.detections, moments_px2=moments))
    tracked = whole.of(strained).tracks.tracked
    assert tracked[marker]
    assert not tracked[beside].any()
    hidden = strained.tracks.without(np.isin(np.arange(len(strained.tracks)), beside))
    assert not whole.of(replace(strained, tracks=hidden)).tracks.tracked[marker]


def test_dots_that_the_gel_strains_are_whole() -> None:
    """Balls that shear the gel until they slip had a third of the markers below them left out."""
    found = calibration()
    dots = np.searchsorted(found.markers, found.reference.markers)
    whole = WholeDots(found.reference, found.dots.moments_px2[dots])
    frame = found.tracker().update(shaded(camera=calibration().camera, seed=47).image)
    places = found.reference.positions_px - found.reference.positions_px.mean(axis=0)
    gradient = np.array([[0.2, 0.2], [-0.1, -0.25]])
    turned = np.eye(2) + gradient
    xx, xy, yy = frame.detections.moments_px2.T
    moments = turned @ np.array([[xx, xy], [xy, yy]]).transpose(2, 0, 1) @ turned.T
    moments = moments.reshape(-1, 4)[:, [0, 1, 3]]
    motion = frame.tracks.displacement_px + places @ gradient.T
    tracks = replace(frame.tracks, displacement_px=motion)
    detections = replace(frame.detections, moments_px2=moments)
    strained = replace(frame, tracks=tracks, detections=detections)
    _, stretch = whole.changes(strained)
    assert np.nanmin(stretch) > 0.4
    growth, stretch = whole.beyond_strain(strained)
    before = whole.changes(frame)
    assert np.nanmax(np.abs(growth - before[0])) < 0.01
    assert np.nanmax(stretch) < 0.1
    assert whole.of(strained).tracks.tracked.all()
    # Without the motion of the markers the dots are not those of the gel.
    assert not whole.of(replace(frame, detections=detections)).tracks.tracked.any()
