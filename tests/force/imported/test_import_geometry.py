"""Places of the markers of sensors that the tests draw, found from one picture.

The camera that draws knows nothing of the one that is found: it looks through two layers over a
mirror, and each dot's true centre on the gel is known.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from camera_rig import finger_view, off_centre_view
from imported_samples import imported, off_places_mm
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from synthetic import Look, grid_of_dots, render

from gelslim_force.calibration.built_deviation import apparent_motion_per_mm
from gelslim_force.calibration.error import CalibrationError
from gelslim_force.imported.error import ImportSensorError
from gelslim_optics.camera.lens_distortion import LensDistortion
from gelslim_optics.camera.view_quality import fit_homography
from gelslim_optics.camera.virtual_camera import VirtualCamera
from ifem_export.markers.grid import MarkerGrid
from ifem_export.markers.lattice_frame import LatticeFrame

LOOK = Look(noise=2.0)
WINDOW = [{"thickness_mm": 2.5, "index": 1.4906}]
FOCAL = {"focal_px": 640.0}
CORNERS = ((-11.0, -10.25), (-11.0, 10.25), (11.0, 10.25), (11.0, -10.25))


def turned_grid(
    deg: float, pitches: tuple[float, float], middle: tuple[float, float]
) -> MarkerGrid:
    """17 x 14 dots of a lattice of two pitches that is turned and not centred."""
    c, s = np.cos(np.radians(deg)), np.sin(np.radians(deg))
    frame = LatticeFrame(
        pitches[0] * np.array([c, s]), pitches[1] * np.array([-s, c]), np.array(middle)
    )
    shape = (17, 14)
    sites = np.argwhere(np.ones(shape, dtype=bool))
    return MarkerGrid(
        frame.places_mm(sites, shape), sites[:, 0], sites[:, 1], np.full(len(sites), 0.45),
        np.zeros(len(sites)), float(np.mean(pitches)), shape, np.zeros((0, 2)), frame,
    )  # fmt: skip


def points_of(camera: VirtualCamera, noise_px: float) -> list[dict[str, Any]]:
    """The gel's corners as a person finds them in the picture."""
    seen = camera.project(np.array([[*corner, 0.0] for corner in CORNERS]))
    seen += np.random.default_rng(0).normal(0, noise_px, seen.shape)
    return [
        {"gel_mm": list(corner), "picture_px": place.tolist()}
        for corner, place in zip(CORNERS, seen, strict=True)
    ]


def lean_error(made: Any, camera: VirtualCamera, places_mm: NDArray[np.float64]) -> float:
    """Root mean square error of the apparent lateral motion of the markers per mm of depth."""
    seen, true = (
        np.column_stack([p, np.zeros(len(p))]) for p in (made.calibration.rest_mm, places_mm)
    )
    off = apparent_motion_per_mm(made.calibration.camera, seen)
    off -= apparent_motion_per_mm(camera, true)
    return float(np.sqrt(np.mean(off**2)))


def true_places(made: Any, centres_px: NDArray[np.float64], grid: MarkerGrid) -> NDArray:
    return grid.positions_mm[cKDTree(centres_px).query(made.calibration.reference_px)[1]]


WAYS = {
    "pitch": {},
    "pitch and lens": {"lens": FOCAL},
    "all but the pose": {"lens": FOCAL, "windows": WINDOW},
}


@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS)
def test_places_follow_from_the_pitch(way: str, tmp_path: Path) -> None:
    camera, grid = off_centre_view(), grid_of_dots()
    drawn = render(grid, camera, dataclasses.replace(LOOK, missing=0.03, dirt=8))
    made = imported(drawn.image, tmp_path, **WAYS[way])
    assert len(made.calibration) >= 0.98 * drawn.drawn.sum()
    off = off_places_mm(made, drawn.centres_px, grid)
    assert np.sqrt(np.mean(off**2)) < 0.004
    assert np.abs(off).max() < 0.05
    error = lean_error(made, camera, true_places(made, drawn.centres_px, grid))
    sigma = made.calibration.deviation.lean_sigma_mm_per_mm
    assert error < 2 * sigma
    assert sigma < {"pitch": 0.03, "pitch and lens": 0.02, "all but the pose": 0.004}[way]


@pytest.mark.slow
@pytest.mark.parametrize("k1", [-0.25, -0.1, 0.1])
def test_a_lens_with_distortion(k1: float, tmp_path: Path) -> None:
    camera, grid = off_centre_view(), grid_of_dots("none")
    camera = dataclasses.replace(camera, lens=LensDistortion(k1=k1, k2=0.05))
    drawn = render(grid, camera, LOOK)
    made = imported(drawn.image, tmp_path)
    off = off_places_mm(made, drawn.centres_px, grid)
    off -= off.mean(axis=0)
    assert np.sqrt(np.mean(off**2)) < 0.004
    assert np.abs(off).max() < 0.02
    assert abs(made.calibration.camera.focal_px / camera.focal_px - 1) < 0.06


@pytest.mark.slow
def test_a_lens_that_was_measured(tmp_path: Path) -> None:
    """Its intrinsics stand in a file of ROS, beside the description."""
    camera, grid = off_centre_view(), grid_of_dots("none")
    camera = dataclasses.replace(camera, lens=LensDistortion(k1=-0.25, k2=0.05))
    (x, y), f = camera.principal_px, camera.focal_px
    (tmp_path / "lens.yaml").write_text(
        "image_width: 640\nimage_height: 480\ndistortion_model: plumb_bob\n"
        f"camera_matrix: {{rows: 3, cols: 3, data: [{f}, 0, {x}, 0, {f}, {y}, 0, 0, 1]}}\n"
        "distortion_coefficients: {rows: 1, cols: 5, data: [-0.25, 0.05, 0, 0, 0]}\n"
    )
    drawn = render(grid, camera, LOOK)
    lens = {"intrinsics": "lens.yaml"}
    made = imported(drawn.image, tmp_path, lens=lens, windows=WINDOW)
    off = off_places_mm(made, drawn.centres_px, grid)
    assert np.sqrt(np.mean(off**2)) < 0.003
    error = lean_error(made, camera, true_places(made, drawn.centres_px, grid))
    assert error < 2 * made.calibration.deviation.lean_sigma_mm_per_mm
    assert made.calibration.deviation.lean_sigma_mm_per_mm < 0.003
    small = drawn.image[::2, ::2].copy()
    with pytest.raises(ImportSensorError) as refused:
        imported(small, tmp_path, lens=lens)
    assert refused.value.field == "lens"


@pytest.mark.slow
@pytest.mark.parametrize("tilt_deg", [0.0, 8.0, 15.0, 30.0])
@pytest.mark.parametrize("lens", [None, FOCAL])
def test_the_uncertainty_of_depth_holds(
    tilt_deg: float, lens: dict[str, float] | None, tmp_path: Path
) -> None:
    """A camera that looks straight down hardly tells its focal length, and says so."""
    camera, grid = finger_view(tilt_deg=tilt_deg), grid_of_dots("none")
    drawn = render(grid, camera, LOOK)
    made = imported(drawn.image, tmp_path, **({} if lens is None else {"lens": lens}))
    true = true_places(made, drawn.centres_px, grid)
    # Rows beyond the picture move the middle of the dots by half a pitch each.
    off = made.calibration.rest_mm - true
    np.testing.assert_allclose(off.mean(axis=0) / 0.55, np.rint(off.mean(axis=0) / 0.55), atol=0.02)
    sigma = made.calibration.deviation.lean_sigma_mm_per_mm
    assert lean_error(made, camera, true) < 2 * sigma
    assert sigma < (0.06 if lens is None else 0.02)


@pytest.mark.slow
def test_places_follow_from_points_of_the_gel(tmp_path: Path) -> None:
    """A lattice of two pitches that is turned and off the middle."""
    camera, grid = off_centre_view(), turned_grid(3.0, (1.1, 1.3), (0.4, -0.3))
    drawn = render(grid, camera, LOOK)
    for noise_px, most in ((0.0, 0.01), (1.0, 0.05)):
        view = {"points": points_of(camera, noise_px)}
        made = imported(drawn.image, tmp_path, markers={"pitch_mm": None}, view=view, lens=FOCAL)
        off = off_places_mm(made, drawn.centres_px, grid)
        assert np.sqrt(np.mean(off**2)) < most
        frame = made.calibration.grid.frame
        assert frame is not None
        np.testing.assert_allclose(frame.pitches_mm, (1.1, 1.3), rtol=max(most / 5, 2e-3))
        turn = np.degrees(np.arctan2(frame.row_step_mm[1], frame.row_step_mm[0]))
        assert turn == pytest.approx(3.0, abs=10 * most)


@pytest.mark.slow
def test_places_follow_from_a_homography_or_the_pinhole(tmp_path: Path) -> None:
    camera, grid = finger_view(), grid_of_dots("none")
    drawn = render(grid, camera, LOOK)
    sides = np.linspace(-10, 10, 9), np.linspace(-9, 9, 9)
    aim = camera.position_mm - camera.position_mm[2] / camera.forward[2] * camera.forward
    views = (
        {"homography": fit_homography(camera, *sides).matrix.tolist()},
        {"pinhole": {"position_mm": camera.position_mm.tolist(), "looks_at_mm": aim[:2].tolist()}},
    )
    for view, most in zip(views, (0.01, 0.003), strict=True):
        made = imported(
            drawn.image, tmp_path, markers={"pitch_mm": None}, view=view, lens=FOCAL,
            windows=WINDOW,
        )  # fmt: skip
        off = off_places_mm(made, drawn.centres_px, grid)
        assert np.sqrt(np.mean(off**2)) < most


@pytest.mark.slow
def test_two_pitches_and_dots_beyond_the_rim(tmp_path: Path) -> None:
    camera, grid = off_centre_view(), turned_grid(0.0, (1.1, 1.35), (0.0, 0.0))
    drawn = render(grid, camera, LOOK)
    made = imported(
        drawn.image, tmp_path, markers={"pitch_mm": 1.1, "pitch_across_mm": 1.35}, lens=FOCAL,
        gel={"length_mm": 17.0, "width_mm": 20.5},
    )  # fmt: skip
    off = off_places_mm(made, drawn.centres_px, grid)
    assert np.sqrt(np.mean(off**2)) < 0.004
    # Rows at 8.8 mm lie outside a gel that ends at 8.5 mm; corners of 1 mm cut no dot off.
    assert made.calibration.grid.lattice_shape == (15, 14)
    assert np.abs(made.calibration.grid.positions_mm[:, 0]).max() < 8.5


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        pytest.param({"markers": {"pitch_mm": 3.0}}, "gel", marks=pytest.mark.slow),
        ({"view": {"points": [{"gel_mm": [float(k), float(k)], "picture_px": [float(k), 2.0 * k]}
                              for k in range(4)]}}, "view"),
        ({"markers": {"diameters_px": [100.0, 200.0]}}, "view.reference"),
    ],
)  # fmt: skip
def test_a_picture_that_does_not_fit_is_refused(
    changes: dict[str, Any], field: str, tmp_path: Path
) -> None:
    drawn = render(grid_of_dots("none"), off_centre_view(), LOOK)
    with pytest.raises(ImportSensorError) as refused:
        imported(drawn.image, tmp_path, **changes)
    assert refused.value.field == field


def test_a_picture_without_dots_and_no_picture_are_refused(tmp_path: Path) -> None:
    grey = np.random.default_rng(0).integers(90, 110, (120, 160), dtype=np.uint8)
    with pytest.raises(ImportSensorError):
        imported(grey, tmp_path)
    from imported_samples import described

    from gelslim_force.imported.importer import import_sensor

    with pytest.raises(CalibrationError):
        import_sensor(described().model, tmp_path / "nowhere", ladder=False)
