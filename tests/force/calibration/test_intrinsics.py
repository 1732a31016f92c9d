"""Intrinsics of a camera: files of ROS and OpenCV, and what they change in a calibration."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from calibration_samples import BUILD, small_bundle
from camera_rig import finger_view
from synthetic import grid_of_dots, render

from gelslim_core.yaml.errors import InputError
from gelslim_force.calibration.calibration import calibrate
from gelslim_force.calibration.camera_deviation import PARAMETERS, deviated_camera
from gelslim_force.calibration.error import CalibrationError
from gelslim_force.calibration.intrinsics import Intrinsics, read_intrinsics
from gelslim_optics.camera.lens_distortion import LensDistortion

FOCAL = PARAMETERS.index("focal_percent")
ROS = """\
image_width: 640
image_height: 480
camera_name: head
camera_matrix:
  rows: 3
  cols: 3
  data: [651.2, 0, 318.1, 0, 651.6, 241.0, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.03, 0.008, 0.0007, -0.0006, 0.001]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
"""


def read(tmp_path: Path, text: str) -> Intrinsics:
    path = tmp_path / "lens.yaml"
    path.write_text(text, encoding="utf-8")
    return read_intrinsics(path)


def test_a_file_of_ros_is_read(tmp_path: Path) -> None:
    lens = read(tmp_path, ROS)
    assert lens.size_px == (640, 480)
    assert lens.focal_px == pytest.approx(651.4, abs=1e-3)
    assert lens.principal_px == (318.1, 241.0)
    assert lens.distortion == LensDistortion(-0.03, 0.008, 0.0007, -0.0006, 0.001)
    wide = ROS.replace("plumb_bob", "equidistant").replace(", 0.001]", "]")
    assert read(tmp_path, wide).distortion == LensDistortion(
        k1=-0.03, k2=0.008, k3=0.0007, k4=-0.0006, model="kannala_brandt"
    )


@pytest.mark.parametrize("shape", [(5,), (1, 5), (5, 1)])
def test_a_file_of_opencv_is_read(tmp_path: Path, shape: tuple[int, ...]) -> None:
    cv2 = pytest.importorskip("cv2")
    path = tmp_path / "lens.yaml"
    store = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    store.write("image_width", 640)
    store.write("image_height", 480)
    store.write("camera_matrix", np.array([[651.2, 0, 318.1], [0, 651.6, 241.0], [0, 0, 1]]))
    store.write(
        "distortion_coefficients", np.array([-0.03, 0.008, 0.0007, -0.0006, 0.001]).reshape(shape)
    )
    store.release()
    assert read_intrinsics(path) == read(tmp_path, ROS)


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("image_width: 640", "image_width: wide", 1),
        ("image_height: 480", "image_height: 480.5", 2),
        ("651.6", "-651.6", 4),
        ("651.6", "700", 4),
        ("241.0", "541.0", 4),
        ("241.0, ", "", 7),
        ("651.2", ".nan", 7),
        ("plumb_bob", "rational_polynomial", 8),
        ("data: [-0.03, ", "data: [0, 0, ", 12),
        ("data: [-0.03, 0.008,", "data: [-0.03, yes,", 12),
    ],
)
def test_a_wrong_entry_is_refused_with_its_line(
    tmp_path: Path, old: str, new: str, line: int
) -> None:
    with pytest.raises(InputError) as refused:
        read(tmp_path, ROS.replace(old, new))
    assert refused.value.problems[0].line == line


@pytest.mark.parametrize("missing", ["image_width: 640\n", "camera_matrix", "distortion_coeff"])
def test_a_missing_entry_is_refused(tmp_path: Path, missing: str) -> None:
    text = ROS.replace(missing, "" if missing.endswith("\n") else "other")
    with pytest.raises(InputError):
        read(tmp_path, text)
    with pytest.raises(InputError):
        read_intrinsics(tmp_path / "none.yaml")


@pytest.mark.slow
def test_the_focal_length_is_known_with_the_lens_measured() -> None:
    """Pose, print and picture are as in `test_clean_frame_gives_the_camera...`."""
    grid = grid_of_dots()
    camera = deviated_camera(finger_view(), BUILD)
    frame = render(grid, camera).image
    bundle = small_bundle(grid)
    without = calibrate(bundle, frame).deviation
    lens = Intrinsics(
        size_px=(camera.image_width_px, camera.image_height_px),
        focal_px=camera.focal_px * 1.001,
        principal_px=(float(camera.principal_px[0]), float(camera.principal_px[1])),
        distortion=camera.lens or LensDistortion(),
    )
    calibration = calibrate(bundle, frame, intrinsics=lens)
    found = calibration.deviation
    assert without is not None
    assert found is not None
    flat = np.column_stack([grid.positions_mm, np.zeros(len(grid))])
    assert np.abs(calibration.camera.project(flat) - camera.project(flat)).max() < 0.03
    assert found.sigma[FOCAL] < 0.7 * without.sigma[FOCAL]
    # Relative to the design, as without the measured lens.
    assert found.values[FOCAL] == pytest.approx(BUILD[FOCAL], abs=0.2)
    assert np.array_equal(found.tolerance, without.tolerance)


def test_the_lens_of_another_camera_is_refused() -> None:
    grid, camera = grid_of_dots(), finger_view()
    bundle, frame = small_bundle(grid), render(grid, camera).image
    middle = (319.5, 239.5)
    for size, focal_px in (((480, 640), 640.0), ((1280, 960), 1280.0), ((640, 480), 750.0)):
        lens = Intrinsics(size, focal_px, middle, LensDistortion())
        with pytest.raises(CalibrationError):
            calibrate(bundle, frame, intrinsics=lens)
