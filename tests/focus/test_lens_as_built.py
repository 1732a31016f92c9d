"""A finger whose lens is where the build guide puts it, seen through an independent thin lens."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from chessboard import measured_lens
from numpy.typing import NDArray
from scipy.optimize import root

import gelslim
from bench.models.thin_lens import ThinLens
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.spec.reader import read_spec
from gelslim_force.calibration.built_deviation import BuiltDeviation
from gelslim_force.calibration.calibration import calibrate
from gelslim_force.calibration.camera_deviation import PARAMETERS
from gelslim_force.calibration.design import bundle_camera, bundle_grid
from gelslim_force.calibration.intrinsics import read_intrinsics
from gelslim_force.calibration.sensor_calibration import Calibration
from gelslim_force.settings import PipelineSettings
from ifem_export.bundle.bundle import Bundle

DESIGNS = Path(__file__).parents[2] / "designs"
FOCAL = PARAMETERS.index("focal_percent")
NAMES = sorted(path.stem for path in DESIGNS.glob("*.yaml"))


def design(name: str) -> Dimensions:
    return derive(read_spec(DESIGNS / f"{name}.yaml").spec)


def at_rest(bundle: Bundle, lens: ThinLens, samples: int) -> NDArray[np.uint8]:
    grid = bundle_grid(bundle)
    bright = lens.picture(grid.positions_mm[:, :2], grid.diameter_mm, samples)
    return np.round(60 + 150 * bright).astype(np.uint8)


def calibrated(bundle: Bundle, lens: ThinLens, samples: int) -> Calibration:
    return calibrate(bundle, at_rest(bundle, lens, samples))


def bundle_of(name: str) -> Bundle:
    return gelslim.make_bundle(DESIGNS / f"{name}.yaml", measure=False).bundle


def seen_by_calibration(bundle: Bundle, lens: ThinLens, samples: int) -> BuiltDeviation:
    """The scale of the picture is the design's, and so is the focal length as far as it is known.

    From one picture the focal length is known to between 0.1 and 1 %, because the distance of the
    camera has nearly the same effect. The scale, which both set, is known ten times better. With
    the lens as OpenCV measures it on a chessboard both are known.
    """
    picture = at_rest(bundle, lens, samples)
    found = calibrate(bundle, picture)
    assert len(found.missing) == 0
    assert found.deviation is not None
    assert abs(found.deviation.scale_percent) < 0.2
    assert abs(found.deviation.values[FOCAL]) < max(0.3, 3 * found.deviation.sigma[FOCAL])

    pytest.importorskip("cv2")
    with TemporaryDirectory() as folder:
        file = Path(folder) / "lens.yaml"
        focal_px = measured_lens(lens, file, seed=len(found))
        sharper = calibrate(bundle, picture, intrinsics=read_intrinsics(file)).deviation
    assert focal_px == pytest.approx(bundle_camera(bundle).focal_px, rel=1e-3)
    assert sharper is not None
    assert abs(sharper.scale_percent) < 0.2
    assert sharper.sigma[FOCAL] < 0.2
    assert abs(sharper.values[FOCAL]) < 0.3
    return found.deviation


def seen_at(lens: ThinLens, point_mm: tuple[float, float], guess_px: NDArray) -> NDArray:
    """The pixel whose ray through the middle of the lens meets the gel at a point."""

    def off(pixel: NDArray) -> NDArray:
        return lens.on_gel(pixel[None], np.zeros((1, 2)))[0] - point_mm

    found = root(off, guess_px, method="lm", tol=1e-12)
    assert np.abs(found.fun).max() < 1e-9
    return np.asarray(found.x)


def corners_are_where_the_rule_has_them(d: Dimensions) -> None:
    lens = ThinLens.as_built(d, extension_mm=d["view.lens_extension_mm"])
    x, y = d["design.gel.length_mm"] / 2, d["design.gel.width_mm"] / 2
    size = np.array(lens.size_px)
    off = [
        np.abs(seen_at(lens, (sx * x, sy * y), (size - 1) / 2) - (size - 1) / 2)
        for sx in (-1, 1)
        for sy in (-1, 1)
    ]
    expected = np.array([d["view.across_use"], d["view.along_use"]]) * size / 2
    corners = np.max(off, axis=0)
    assert corners[0] == pytest.approx(expected[0], abs=0.1)
    # Along the finger the middle of an edge may reach farther than its corners.
    edges = [seen_at(lens, (sx * x, 0.0), (size - 1) / 2)[1] for sx in (-1, 1)]
    along = max(corners[1], *np.abs(np.array(edges) - (size[1] - 1) / 2))
    assert along == pytest.approx(expected[1], abs=0.1)


def is_blurred_as_the_rule_says(d: Dimensions) -> None:
    """The largest blur at the near and at the far edge, their middles and corners."""
    lens = ThinLens.as_built(d, extension_mm=d["view.lens_extension_mm"])
    x, y = d["design.gel.length_mm"] / 2, d["design.gel.width_mm"] / 2
    near, far = (
        max(blur_px(lens, (end, 0.0)), blur_px(lens, (end, y)), blur_px(lens, (end, -y)))
        for end in (-x, x)
    )
    assert max(near, far) == pytest.approx(d["view.image_blur_px"], rel=0.05)
    # At best focus the nearest and the farthest image are blurred alike. The farthest is that of
    # the far edge; a camera that is hardly tilted has the nearest there as well, or in the middle.
    tilted = blur_px(lens, (0.0, 0.0)) < near
    if tilted and d["view.near_tangential_mm"] < d["view.far_tangential_mm"]:
        assert near == pytest.approx(far, rel=0.05)


def blur_px(lens: ThinLens, point_mm: tuple[float, float]) -> float:
    """Longest diameter of a point's image, by rays through the rim of the lens."""
    pixel = seen_at(lens, point_mm, (np.array(lens.size_px) - 1) / 2)
    turn = np.linspace(0, 2 * np.pi, 72, endpoint=False)
    rim = np.column_stack([np.cos(turn), np.sin(turn)])
    around_mm = lens.on_gel(np.broadcast_to(pixel, rim.shape), rim) - point_mm
    steps_px = [
        seen_at(lens, (point_mm[0] + dx, point_mm[1] + dy), pixel)
        - seen_at(lens, (point_mm[0] - dx, point_mm[1] - dy), pixel)
        for dx, dy in ((0.05, 0.0), (0.0, 0.05))
    ]
    around_px = around_mm @ np.array(steps_px) / 0.1
    return float(np.ptp(around_px @ rim.T, axis=0).max())


@pytest.mark.parametrize("name", NAMES)
def test_the_corners_of_the_gel_are_where_the_rule_has_them(name: str) -> None:
    """Coverage by the rule and by the traced lens, to a tenth of a pixel."""
    corners_are_where_the_rule_has_them(design(name))


@pytest.mark.parametrize("name", NAMES)
def test_the_blur_in_the_picture_is_that_of_the_rule(name: str) -> None:
    is_blurred_as_the_rule_says(design(name))


@pytest.mark.slow
def test_a_picture_of_a_finger_built_to_the_letter_calibrates() -> None:
    """`view.focal_px` was once f / pitch, and the finger of the build guide was refused."""
    seen_by_calibration(bundle_of("mini20"), ThinLens.as_built(design("mini20")), samples=24)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_every_design_built_to_the_letter_calibrates(name: str) -> None:
    seen_by_calibration(bundle_of(name), ThinLens.as_built(design(name)), samples=64)


def picture(bundle: Bundle, lens: ThinLens, moved_mm: NDArray, samples: int) -> NDArray:
    """The markers where the gel has carried them, seen through the lens."""
    grid = bundle_grid(bundle)
    bright = lens.picture(grid.positions_mm[:, :2], grid.diameter_mm, samples, moved_mm)
    return np.round(60 + 150 * bright).astype(np.uint8)


def motion_is_measured(name: str, samples: int) -> None:
    """A bump of shear, drawn by the lens, comes out of the pipeline within a fiftieth of it."""
    bundle, lens = bundle_of(name), ThinLens.as_built(design(name))
    at = bundle_grid(bundle).positions_mm[:, :2]
    half = np.abs(at).max(axis=0)
    bump = np.prod(np.cos(np.pi / 2 * np.clip(at / half, -1, 1)) ** 2, axis=1)
    true_mm = bump[:, None] * [0.16, -0.12]
    still = picture(bundle, lens, 0 * true_mm, samples)
    sensor = gelslim.open_sensor(
        bundle, reference=still, indenter="none", settings=PipelineSettings(rung="fft")
    )
    sensor.process(still)
    result = sensor.process(picture(bundle, lens, true_mm, samples))
    assert result.tracks is not None
    assert result.marker_displacement_mm is not None
    assert result.tracks.tracked.all()
    off_mm = result.marker_displacement_mm[:, :2] - true_mm
    assert np.sqrt(np.mean(np.sum(off_mm**2, axis=1))) < 0.02 * 0.2
    assert np.abs(off_mm).max() < 0.05 * 0.2


@pytest.mark.slow
def test_a_finger_built_to_the_letter_measures() -> None:
    motion_is_measured("mini20", samples=24)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_every_design_built_to_the_letter_measures(name: str) -> None:
    motion_is_measured(name, samples=64)


def test_a_lens_left_at_infinity_is_refused() -> None:
    """Its picture is larger by a tenth, far out of what a built camera may deviate."""
    from gelslim_force.calibration.error import CalibrationError

    lens = ThinLens.as_built(design("gelslim2"), extension_mm=1e-3)
    with pytest.raises(CalibrationError):
        calibrated(bundle_of("gelslim2"), lens, samples=2)
