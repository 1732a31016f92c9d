"""The contact patch in frames of a real sensor, where they are at hand."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from gelslim_force.contact.patch_finder import PatchFinder
from gelslim_force.detection.detection import Detector
from gelslim_force.detection.settings import DetectorSettings
from gelslim_optics.camera.virtual_camera import Layer, VirtualCamera

FRAMES = Path(
    os.environ.get("GELSLIM_REAL_FRAMES", Path(__file__).parents[4] / "shared" / "real_frames")
)
# Middle and half-width in px of the coloured spot, read off the pictures by eye.
SEEN = {
    "press_14": (117, 142, 40),
    "press_18": (243, 250, 38),
    "press_26": (284, 156, 36),
    "press_33": (215, 52, 34),
    "press_38": (141, 130, 36),
    "press_44": (227, 163, 33),
    "press_49": (227, 193, 36),
    "press_5": (245, 240, 36),
}


def test_every_press_of_a_real_sensor_is_found_where_it_is():
    """Markers known, camera and ball not: it is taken to look straight down at 1 px/mm."""
    image = pytest.importorskip("PIL.Image")
    folder = FRAMES / "gelslim3"
    if not folder.is_dir():
        pytest.skip(f"no real frames at {folder}: set GELSLIM_REAL_FRAMES")

    def picture(name):
        return np.array(image.open(folder / f"{name}.jpg").convert("RGB"))

    reference = picture("reference")
    detector = Detector(DetectorSettings(shape="double"))
    dots = detector.detect(reference)
    radius = 1.6 * np.sqrt(dots.area_px / np.pi)
    height, width = reference.shape[:2]
    camera = VirtualCamera(
        position_mm=np.array([0.0, 0.0, -1000.0]),
        right=np.array([1.0, 0.0, 0.0]),
        down=np.array([0.0, 1.0, 0.0]),
        forward=np.array([0.0, 0.0, 1.0]),
        focal_px=1000.0,
        image_width_px=width,
        image_height_px=height,
        window_bottom_z_mm=-1.0,
        layers=(Layer(1.0, 1.0),),
    )
    finder = PatchFinder(camera, reference, dots.centres_px, marker_radius_px=radius)
    assert finder.find(reference) is None
    middle = (np.array(reference.shape[1::-1]) - 1) / 2
    for name, (x, y, half) in SEEN.items():
        frame = picture(name)
        patch = finder.find(frame, detector.detect(frame).centres_px)
        assert patch is not None, name
        off = np.linalg.norm(patch.centre_mm + middle - [x, y])
        assert off < 0.45 * half, (name, off)
        assert 0.6 * half < patch.size_mm < 1.2 * half, (name, patch.size_mm)
