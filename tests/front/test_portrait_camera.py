"""A camera in portrait: its frames come on their side and are turned by the force pipeline."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gelslim_cad.assembly.finger_order import finger_order
from gelslim_cad.build.instructions import build_guide
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.explore.space import changed
from gelslim_cad.sensor import make_bundle, marker_grid, pad_mesh
from gelslim_cad.spec import Spec
from gelslim_cad.spec.camera_library import lend_fields
from gelslim_core.yaml.errors import InputError
from gelslim_core.yaml.reader import Loaded, load_bytes
from gelslim_force.calibration.calibration import calibrate
from gelslim_force.calibration.design import bundle_camera
from gelslim_force.calibration.error import CalibrationError
from gelslim_force.contact.depth_map_source import DepthMapSource
from gelslim_force.frames.frame import Frame
from gelslim_force.frames.upright import upright
from gelslim_force.run import run_frames
from gelslim_force.sensor import open_sensor
from gelslim_twin.render.look import sensor_look
from gelslim_twin.render.surface_state import SurfaceState
from gelslim_twin.simulation.picture import sensor_renderer
from gelslim_twin.simulation.sensor import TwinSensor
from ifem_export.bundle.bundle import Bundle

TEXT = """\
format: gelslim-spec/1
name: tall
camera: {model: ov5647_spy, orientation: portrait}
design:
  gel: {length_mm: 26, width_mm: 18}
mesh: {cells_along: 13, cells_across: 9, layers: 2}
"""
SHIFT_MM = np.array([0.2, -0.12, 0.0])


def load(text: str = TEXT) -> Loaded[Spec]:
    return load_bytes("tall.yaml", text.encode(), Spec, lend_fields)


@pytest.fixture(scope="module")
def finger() -> Dimensions:
    return derive(load().model)


@pytest.fixture(scope="module")
def bundle(finger: Dimensions) -> Bundle:
    grid = marker_grid(finger)
    return make_bundle(load().model, finger, pad_mesh(finger, grid)[0], grid, with_light=False)


@pytest.fixture(scope="module")
def pictures(bundle: Bundle) -> tuple[Any, Any]:
    """Upright pictures of the gel at rest, and moved as a whole by SHIFT_MM."""
    twin = TwinSensor(bundle)
    look = sensor_look(aperture_mm=0.0, focus_mm=1.0, seed=2)
    draw = sensor_renderer(twin, bundle_camera(bundle), look, 2)
    moved = np.broadcast_to(SHIFT_MM, twin.points_mm.shape)
    state = SurfaceState.from_nodes(twin.points_mm, moved)
    return draw.frame().image, draw.frame(state, number=1).image


def native(picture: Any) -> Any:
    """The picture as the camera reads it: the top of the upright one is at its left."""
    return np.ascontiguousarray(np.swapaxes(picture, 0, 1)[::-1])


def test_a_camera_of_the_library_is_turned_as_a_whole(finger: Dimensions) -> None:
    tall = load(TEXT.replace("model: ov5647_spy", "model: imx219_v2")).model.camera
    wide = load(TEXT.replace("model: ov5647_spy", "model: imx219_v2").replace(
        "portrait", "landscape")).model.camera  # fmt: skip
    for what in ("image_{}_px", "sensor_{}_mm", "module_{}_mm"):
        names = what.format("width"), what.format("height")
        assert [getattr(tall, n) for n in names] == [getattr(wide, n) for n in names][::-1]
    assert tall.image_height_px > tall.image_width_px
    assert (tall.lens_diameter_mm, tall.focal_length_mm) == (6.0, 3.04)
    assert finger["view.along_fov_deg"] > finger["view.across_fov_deg"]
    # The same camera in landscape needs a thicker finger for a gel as long as this.
    other = changed(load().model, {"camera.orientation": "landscape"})
    assert other.camera.image_width_px == 640
    assert derive(other)["finger.thickness_mm"] > finger["finger.thickness_mm"] + 0.5
    steps = finger_order(finger, ["body", "back_cover", "camera_clamp", "camera"])
    assert "at the left" in build_guide(finger, marker_grid(finger), (), "tall", steps).decode()


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ("ov5647_spy", "ovm6211", "camera.orientation"),
        ("portrait", "portrait, image_height_px: 400", "camera.orientation"),
        ("portrait", "landscape, image_height_px: 700", "camera.image_height_px"),
        ("portrait", "upright", "camera.orientation"),
    ],
)
def test_orientation_and_picture_must_agree(old: str, new: str, field: str) -> None:
    with pytest.raises(InputError) as caught:
        load(TEXT.replace(old, new))
    (problem,) = caught.value.problems
    assert (problem.field, problem.line) == (field, 3)


def test_pictures_on_their_side_are_turned_and_no_others(bundle: Bundle) -> None:
    camera = bundle_camera(bundle)
    high, wide = camera.image_height_px, camera.image_width_px
    picture = np.arange(high * wide, dtype=np.int64).reshape(high, wide)
    assert np.array_equal(upright(native(picture), camera), picture)
    assert upright(picture, camera) is picture
    coloured = np.stack([picture, -picture, picture], axis=2)
    assert np.array_equal(upright(native(coloured), camera), coloured)
    landscape = replace(camera, image_width_px=high, image_height_px=wide)
    assert upright(picture, landscape) is picture


@pytest.mark.slow
def test_frames_as_the_camera_gives_them_calibrate_and_measure(
    bundle: Bundle, pictures: tuple[Any, Any]
) -> None:
    rest, moved = pictures
    assert rest.shape[:2] == (640, 480)
    one, other = calibrate(bundle, rest), calibrate(bundle, native(rest))
    assert np.array_equal(one.markers, other.markers)
    assert np.array_equal(one.reference.positions_px, other.reference.positions_px)
    pipeline = open_sensor(bundle, reference=native(rest), indenter="sphere:10")
    assert open_sensor(bundle, reference=rest).process(moved).problems == ()
    result = open_sensor(bundle, reference=native(rest)).process(native(moved))
    found = np.nanmedian(result.marker_displacement_mm[:, :2], axis=0)
    assert found == pytest.approx(SHIFT_MM[:2], abs=0.01)

    taken: list[tuple[Any, Any]] = []

    class Keep:
        def take(self, image: Any, result: Any) -> None:
            taken.append((image, result))

    summary = run_frames(pipeline, [Frame(0, 0.0, native(rest)), Frame(1, 0.1, None)], [Keep()])
    assert summary.frames == 2
    assert np.array_equal(taken[0][0], rest)
    assert taken[1][0] is None


def test_a_camera_turned_the_other_way_is_refused(
    bundle: Bundle, pictures: tuple[Any, Any]
) -> None:
    wrong = np.ascontiguousarray(native(pictures[0])[::-1, ::-1])
    with pytest.raises(CalibrationError):
        calibrate(bundle, wrong)


def test_depth_maps_are_turned_like_the_pictures(bundle: Bundle) -> None:
    camera, points = bundle_camera(bundle), np.asarray(bundle.mesh.surface_mm)
    rows, columns = np.mgrid[: camera.image_height_px, : camera.image_width_px]
    heights = -1e-4 * rows - 3e-4 * columns
    one, other = (DepthMapSource(camera, points, [m]) for m in (heights, native(heights)))
    nothing = np.zeros((0, 2))
    w = [s.motion(s.look(heights.astype(np.uint8), nothing)).w_mm for s in (one, other)]
    assert np.array_equal(*w)
    assert np.ptp(w[0]) > 0.05
