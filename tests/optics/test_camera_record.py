"""The camera as plain values: there and back, and what is refused."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from camera_cases import finger_camera

from gelslim_optics.camera.lens_distortion import LensDistortion
from gelslim_optics.camera.virtual_camera import VirtualCamera

LENS = LensDistortion(k1=-0.12, k2=0.03, p1=4e-4, p2=-3e-4, k3=0.001)


@pytest.mark.parametrize("lens", [None, LENS, replace(LENS, model="kannala_brandt", k4=0.01)])
def test_round_trip_through_json_is_the_same_camera(lens: LensDistortion | None) -> None:
    camera = finger_camera(lens=lens)
    back = VirtualCamera.from_record(json.loads(json.dumps(camera.to_record())))
    assert back.to_record() == camera.to_record()
    assert (back.layers, back.lens) == (camera.layers, lens)
    points = np.column_stack([np.random.default_rng(0).uniform(-9, 9, (20, 2)), np.zeros(20)])
    np.testing.assert_array_equal(back.project(points), camera.project(points))


def test_an_ideal_lens_is_left_out_and_other_keys_are_no_harm() -> None:
    record = finger_camera().to_record()
    assert "lens_distortion" not in record
    back = VirtualCamera.from_record(record | {"aperture_mm": 1.2, "focus_mm": 36.0})
    assert back.to_record() == record


def test_numpy_values_become_plain() -> None:
    camera = replace(finger_camera(), focal_px=np.float64(600), window_bottom_z_mm=np.float64(-4))
    assert type(camera.to_record()["focal_px"]) is float
    json.dumps(camera.to_record())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"model": "fisheye"}, "fisheye"),
        ({"position_mm": [0, 0]}, "position_mm"),
        ({"right": [0, "1", 0]}, "right"),
        ({"focal_px": None}, "focal_px"),
        ({"focal_px": float("nan")}, "focal_px"),
        ({"image_width_px": 640.5}, "whole"),
        ({"layers": 3}, "layers"),
        ({"layers": [2.5]}, "layers"),
        ({"layers": [{"thickness_mm": 1.0}]}, "index"),
        ({"layers": [{"thickness_mm": 1.0, "index": 0.5}]}, "index"),
        ({"lens_distortion": [0.1]}, "by name"),
        ({"lens_distortion": {"k9": 0.1}}, "k9"),
        ({"forward": [0, 0, 1]}, "right angles"),
    ],
)
def test_bad_records_are_refused(change: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        VirtualCamera.from_record(finger_camera().to_record() | change)


def test_a_record_that_lacks_something_is_refused() -> None:
    record = finger_camera().to_record()
    for key in set(record) - {"principal_offset_px"}:
        part = {k: v for k, v in record.items() if k != key}
        with pytest.raises(ValueError, match=key if key != "model" else "model None"):
            VirtualCamera.from_record(part)


def test_a_lens_off_centre_shifts_the_picture_and_comes_back() -> None:
    camera = replace(finger_camera(), principal_offset_px=(0.0, 0.0))
    off = replace(camera, principal_offset_px=(7.0, -4.5))
    points = np.array([[0.0, 0.0, 0.0], [3.0, -2.0, -0.3]])
    assert off.project(points) - camera.project(points) == pytest.approx(
        np.array([[7.0, -4.5]] * 2), abs=1e-12
    )
    assert off.backproject(off.project(points[:1]))[0] == pytest.approx(points[0], abs=1e-9)
    assert "principal_offset_px" not in camera.to_record()
    assert VirtualCamera.from_record(off.to_record()).principal_offset_px == (7.0, -4.5)
    with pytest.raises(ValueError, match="principal_offset_px"):
        replace(camera, principal_offset_px=(float("nan"), 0.0))
