"""Pixels back to planes and surfaces: the inverse of the projection."""

from __future__ import annotations

import math

import numpy as np
import pytest
from camera_cases import HEIGHT, WIDTH, finger_camera, random_pose, traced
from scipy.interpolate import RegularGridInterpolator

from gelslim_optics.camera import back_projection
from gelslim_optics.camera.back_projection import HeightGrid
from gelslim_optics.camera.height_points import points_at_heights
from gelslim_optics.camera.lens_distortion import LensDistortion
from gelslim_optics.camera.virtual_camera import VirtualCamera

LENSES = [None, LensDistortion(k1=-0.12, k2=0.03, p1=4e-4, p2=-3e-4, k3=-2e-3)]


def dent(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """A press of 0.9 mm with a sharp flank."""
    return -0.9 * np.exp(-((x - 2) ** 2 + (y + 1) ** 2) / 4)


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("seed", range(5))
def test_plane_round_trip(lens: LensDistortion | None, seed: int) -> None:
    rng = np.random.default_rng(seed)
    pose = random_pose(rng)
    camera = VirtualCamera.from_fold(**pose, lens=lens)
    bottom = camera.window_bottom_z_mm
    for z in (0.0, -0.4, 0.3, bottom + 0.2, bottom - 0.5):
        pixels = rng.uniform((0, 0), (WIDTH - 1, HEIGHT - 1), (100, 2))
        points = camera.backproject(pixels, z)
        assert np.all(points[:, 2] == z)
        assert np.abs(camera.project(points) - pixels).max() < 1e-9
        again = camera.backproject(camera.project(points), z)
        assert np.abs(again - points).max() < 1e-9


@pytest.mark.parametrize("lens", LENSES)
def test_points_at_heights_are_those_on_the_rays(lens: LensDistortion | None) -> None:
    """Heights in all layers; a pixel that looks away is named."""
    rng = np.random.default_rng(9)
    for _ in range(5):
        camera = VirtualCamera.from_fold(**random_pose(rng), lens=lens)
        pixels = rng.uniform((0, 0), (WIDTH - 1, HEIGHT - 1), (80, 2))
        z = rng.uniform(camera.window_bottom_z_mm - 1, 0.5, 80)
        found = points_at_heights(camera, pixels, z)
        expected = camera.points_along(camera.pixel_slopes(pixels), z)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)
        flat = np.column_stack([found[:, :2], z])
        assert np.abs(camera.project(flat) - pixels).max() < 1e-9
    away = dict(random_pose(rng), pitch_rad=math.pi)
    turned = VirtualCamera.from_fold(**away)
    with pytest.raises(ValueError, match="look away from the window"):
        points_at_heights(turned, pixels, z)


def test_finds_where_light_traced_from_the_real_camera_ends() -> None:
    rng = np.random.default_rng(6)
    pose = random_pose(rng)
    camera = VirtualCamera.from_fold(**pose)
    pixels = rng.uniform((0, 0), (WIDTH - 1, HEIGHT - 1), (40, 2))
    truth = [traced(pose, u, v, pose["layers"][1].thickness_mm) for u, v in pixels]
    np.testing.assert_allclose(camera.backproject(pixels), truth, atol=1e-10)


@pytest.mark.parametrize("lens", LENSES)
def test_height_field_round_trip(lens: LensDistortion | None) -> None:
    camera = finger_camera(lens=lens)
    rng = np.random.default_rng(7)
    xy = rng.uniform(-9, 9, (500, 2))
    points = np.column_stack([xy, dent(*xy.T)])
    found = camera.backproject(camera.project(points), dent)
    assert np.abs(found - points).max() < 1e-9


def test_sampled_surface_is_met_where_its_cells_are() -> None:
    camera = finger_camera()
    x, y = np.linspace(-10, 10, 81), np.linspace(-9, 9, 61)
    grid = HeightGrid(x, y, dent(*np.meshgrid(x, y)))
    rng = np.random.default_rng(8)
    xy = np.vstack([rng.uniform((-10, -9), (10, 9), (500, 2)), [[10, 9], [-10, -9], [x[3], y[5]]]])
    points = np.column_stack([xy, grid(*xy.T)])
    found = camera.backproject(camera.project(points), grid)
    assert np.abs(found - points).max() < 1e-9


def test_a_flat_field_is_the_plane() -> None:
    camera = finger_camera()
    pixels = np.random.default_rng(9).uniform((220, 60), (420, 340), (50, 2))
    plane = camera.backproject(pixels, -0.25)
    grid = HeightGrid([-15, 15], [-15, 15], np.full((2, 2), -0.25))
    np.testing.assert_allclose(camera.backproject(pixels, grid), plane, atol=1e-12)
    field = camera.backproject(pixels, lambda x, y: -0.25)
    np.testing.assert_allclose(field, plane, atol=1e-12)


def test_a_steep_wall_hides_what_is_behind_it() -> None:
    # A wall that hangs 1.5 mm into the gel: the ray meets its face towards the camera's foot.
    def wall(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return -0.75 * (np.tanh((x - 4) / 0.02) - np.tanh((x - 5) / 0.02))

    camera = finger_camera()
    behind = np.array([[5.2, 0.0, 0.0]])
    pixel = camera.project(behind)
    found = camera.backproject(pixel, wall)[0]
    assert 3.9 < found[0] < 5.1
    assert found[2] < -0.1
    assert np.abs(camera.project(found) - pixel).max() < 1e-9
    beyond = np.array([[7.0, 0.0, float(wall(np.array(7.0), np.array(0.0)))]])
    np.testing.assert_allclose(camera.backproject(camera.project(beyond), wall), beyond, atol=1e-9)


def test_a_step_is_met_in_its_face() -> None:
    camera = finger_camera()
    face = np.column_stack([np.full(9, 0.1), np.linspace(-1, 1, 9), np.linspace(-0.28, 0.28, 9)])
    found = camera.backproject(camera.project(face), lambda x, y: np.where(x < 0.1, 0.3, -0.3))
    np.testing.assert_allclose(found, face, atol=1e-9)


def test_bilinear_heights_by_hand() -> None:
    grid = HeightGrid([0.0, 1.0, 3.0], [0.0, 2.0], [[0.0, 1.0, 2.0], [4.0, 5.0, 6.0]])
    # Between columns 1 and 2 at a quarter, between the rows at a half.
    assert grid(1.5, 1.0) == pytest.approx(1.25 + 2.0)
    np.testing.assert_allclose(grid([3.0, 9.0, -2.0], [2.0, 9.0, -1.0]), [6.0, 6.0, 0.0])
    np.testing.assert_array_equal(grid.contains([0, 3, 3.1], [0, 2, 1]), [True, True, False])
    # Slopes within a cell do not exceed `max_gradient`: 1 per mm along, 2 per mm across.
    assert grid.max_gradient == pytest.approx(math.hypot(1, 2))


def test_pixels_off_the_surface_are_refused_or_missing() -> None:
    camera = finger_camera()
    grid = HeightGrid([-5, 5], [-5, 5], np.zeros((2, 2)))
    pixels = camera.project([[0.0, 0.0, 0.0], [8.0, 0.0, 0.0]])
    with pytest.raises(ValueError, match="1 of 2 pixels"):
        camera.backproject(pixels, grid)
    found = camera.backproject(pixels, grid, outside="nan")
    np.testing.assert_allclose(found[0], 0, atol=1e-12)
    assert np.isnan(found[1]).all()
    with pytest.raises(ValueError, match="1 of 1 pixels"):
        camera.backproject(pixels[:1], lambda x, y: 0 * x, z_range_mm=(0.5, 1.0))


def test_missing_pixels_give_missing_points() -> None:
    camera = finger_camera()
    pixels = np.array([[300.0, 200.0], [np.nan, 3.0]])
    for surface in (0.0, dent, HeightGrid([-15, 15], [-15, 15], np.zeros((2, 2)))):
        points = camera.backproject(pixels, surface)
        assert np.isfinite(points[0]).all()
        assert np.isnan(points[1]).all()


def test_pixels_that_look_along_the_window_are_refused() -> None:
    with pytest.raises(ValueError, match="away from the window"):
        finger_camera().backproject([[320.0, 6000.0]])


@pytest.mark.parametrize(
    ("surface", "options", "message"),
    [
        (-60.0, {}, "above the virtual pinhole"),
        (math.nan, {}, "finite"),
        (dent, {"z_range_mm": (1.0, -1.0)}, "lower first"),
        (dent, {"z_range_mm": (-99.0, 1.0)}, "above the virtual pinhole"),
        (lambda x, y: np.zeros(3), {}, "shape"),
        (0.0, {"outside": "ignore"}, "outside"),
    ],
)
def test_bad_surfaces_are_refused(surface: object, options: dict, message: str) -> None:
    camera = finger_camera()
    pixels = camera.project(np.column_stack([np.linspace(-1, 1, 41), np.zeros(41), np.zeros(41)]))
    with pytest.raises(ValueError, match=message):
        camera.backproject(pixels, surface, **options)


def test_default_heights_need_a_gel() -> None:
    with pytest.raises(ValueError, match="z_range_mm"):
        finger_camera(layers=()).backproject([[320.0, 200.0]], dent)


@pytest.mark.parametrize(
    ("x", "y", "z", "message"),
    [
        ([0, 0], [0, 1], np.zeros((2, 2)), "increasing"),
        ([0], [0, 1], np.zeros((2, 1)), "increasing"),
        ([0, 1, 2], [0, 1], np.zeros((3, 2)), "shape"),
        ([0, 1], [0, 1], [[0, np.nan], [0, 0]], "finite"),
    ],
)
def test_bad_height_grids_are_refused(x: list, y: list, z: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        HeightGrid(x, y, z)


def steps_to(
    surface: HeightGrid, pixels: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> tuple[int, np.ndarray]:
    """How often rays are followed to a height, and where they end."""
    followed = [0]
    original = back_projection.points_along

    def counted(*arguments: object) -> np.ndarray:
        followed[0] += 1
        return original(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(back_projection, "points_along", counted)
        found = finger_camera().backproject(pixels, surface)
    return followed[0], found


def test_a_gentle_surface_needs_few_steps_and_a_steep_one_a_search(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Rays steeper than the grid anywhere cross it once; others are followed height by height."""
    camera = finger_camera()
    pixels = camera.project(np.column_stack([np.linspace(-5, 5, 9), np.zeros(9), np.zeros(9)]))
    slopes = camera.pixel_slopes(pixels)
    size = np.hypot(*slopes.T).max()
    # Steepest ray in the layer of the smallest index, 1.41.
    in_gel = size / math.sqrt(1.41**2 + (1.41**2 - 1) * size**2)
    # Flatter than 0.9 of the ray, the margin that is kept.
    for share, searched in ((0.88, False), (0.92, True)):
        rise = share / in_gel
        axis = np.array([-20.0, 0.0, 0.4, 20.0])
        heights = np.array([-0.4 * rise, -0.4 * rise, 0.0, 0.0])
        grid = HeightGrid(axis, [-15.0, 15.0], np.tile(heights, (2, 1)))
        count, found = steps_to(grid, pixels, monkeypatch)
        assert (count > back_projection.LEVELS) == searched
        assert count < back_projection.LEVELS + 20
        np.testing.assert_allclose(found[:, 2], grid(found[:, 0], found[:, 1]), atol=1e-12)
    in_window = HeightGrid([-20.0, 20.0], [-15.0, 15.0], np.full((2, 2), -4.6))
    assert steps_to(in_window, pixels, monkeypatch)[0] > back_projection.LEVELS


def test_heights_are_searched_from_the_gels_back_to_a_gel_above_it() -> None:
    camera = finger_camera()
    pixel = camera.project([[1.0, 0.5, 0.0]])
    # The gel is 2 mm thick with its face at 0.
    for height in (-1.99, 1.99):
        found = camera.backproject(pixel, lambda x, y, z=height: 0 * x + z)
        assert found[0, 2] == pytest.approx(height)
    for height in (-2.01, 2.01):
        with pytest.raises(ValueError, match="1 of 1 pixels"):
            camera.backproject(pixel, lambda x, y, z=height: 0 * x + z)


def test_the_edge_of_a_grid_belongs_to_it_and_a_micron_beyond_does_not() -> None:
    grid = HeightGrid([0.0, 2.0], [1.0, 4.0], np.zeros((2, 2)))
    for x, y, inside in (
        (0.0, 1.0, True), (2.0, 4.0, True), (-1e-3, 2.0, False), (2.001, 2.0, False),
        (1.0, 0.999, False), (1.0, 4.001, False), (-5e-10, 4.0 + 5e-10, True),
    ):  # fmt: skip
        assert bool(grid.contains(x, y)) == inside
    assert bool(grid.contains(-0.05, 2.0, 0.1))


def test_uneven_grids_are_bilinear_and_bound_their_gradient() -> None:
    rng = np.random.default_rng(12)
    x, y = np.array([-4.0, -1.0, 0.5, 5.0]), np.array([-3.0, 0.0, 1.0])
    grid = HeightGrid(x, y, rng.normal(0, 1, (3, 4)))
    truth = RegularGridInterpolator((y, x), grid.z_mm)
    at = rng.uniform((-4, -3), (5, 1), (300, 2))
    np.testing.assert_allclose(grid(*at.T), truth(at[:, ::-1]), atol=1e-13)
    h = 1e-6
    inner = at[
        (at > np.array([-3.99, -2.99])).all(axis=1) & (at < np.array([4.9, 0.9])).all(axis=1)
    ]
    gx = (grid(inner[:, 0] + h, inner[:, 1]) - grid(*inner.T)) / h
    gy = (grid(inner[:, 0], inner[:, 1] + h) - grid(*inner.T)) / h
    assert np.hypot(gx, gy).max() <= grid.max_gradient + 1e-6
    along = max(abs(np.diff(row) / np.diff(x)).max() for row in grid.z_mm)
    across = max(abs(np.diff(column) / np.diff(y)).max() for column in grid.z_mm.T)
    assert grid.max_gradient == pytest.approx(math.hypot(along, across))


def test_a_surface_that_jumps_back_and_forth_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(back_projection, "MAX_STEPS", 3)
    pixels = finger_camera().project([[1.0, 0.5, 0.0]])
    with pytest.raises(ValueError, match="do not converge"):
        finger_camera().backproject(pixels, dent)
