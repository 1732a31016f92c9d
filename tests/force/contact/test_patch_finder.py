"""The contact patch recovered from drawn frames whose surface is a solved contact."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from camera_rig import finger_view
from sampled import quick
from scipy.optimize import least_squares
from shaded_frames import CAMERA, GRID, PAD_MM, contact, pressed_heights, shaded, sight

from gelslim_force.contact.indenter import Cylinder, Flat, Sphere
from gelslim_force.contact.patch_finder import PatchFinder
from gelslim_force.contact.patch_shading import REFRESH_FRAMES
from gelslim_force.contact.region_outline import circle_start, fit_circle, fit_strip
from gelslim_force.frames.read_only import read_only

BALL_MM = 10.0


@cache
def reference():
    return shaded(seed=0)


@cache
def pad_nodes():
    x, y = np.meshgrid(np.arange(-PAD_MM[0], PAD_MM[0] + 0.1, 0.5),
                       np.arange(-PAD_MM[1], PAD_MM[1] + 0.1, 0.5))  # fmt: skip
    return np.column_stack([x.ravel(), y.ravel()])


def finder(indenter=None, **kwargs):
    frame = reference()
    return PatchFinder(
        CAMERA,
        frame.image,
        frame.centres_px,
        marker_radius_px=frame.diameter_px / 2,
        surface_mm=pad_nodes(),
        indenter=indenter or Sphere(BALL_MM),
        **kwargs,
    )


def rim_height(radius):
    return BALL_MM - np.sqrt(BALL_MM**2 - radius**2) - contact(radius, BALL_MM).depth_mm


@pytest.mark.parametrize("count", [4, pytest.param(16, marks=pytest.mark.slow)])
def test_place_and_size_of_a_sphere_within_the_stated_error(count):
    """Monte Carlo over place, size, noise and blur: errors over their standard deviations."""
    rng = np.random.default_rng(4)
    scores, errors = [], []
    for k in range(count):
        radius = (1.4, 2.0, 2.6, 3.2)[k % 4]
        centre = rng.uniform(-5, 5, 2)
        sx, sy, _ = pressed_heights(centre, radius, BALL_MM)
        noise, blur = (2.0, 4.0, 6.0)[k % 3], (0.7, 1.5)[k % 2]
        patch = finder().find(shaded((sx, sy), seed=k, noise=noise, blur=blur).image)
        assert patch is not None
        assert patch.method == "shading"
        assert patch.rim_share < 0.05
        patch = patch.at_height(rim_height(radius))
        off = np.array([*(patch.centre_mm - centre), patch.size_mm - radius])
        scores.append(off / np.sqrt(np.diag(patch.covariance)[:3]))
        errors.append([*off[:2], off[2] / radius])
    scores, errors = np.array(scores), np.array(errors)
    assert np.abs(scores).max() < 3.5
    spread = np.sqrt((scores**2).mean(axis=0))
    assert (spread < 1.4).all()
    assert (spread > 0.1).all()
    assert np.sqrt((errors[:, 2] ** 2).mean()) < 0.025
    assert np.sqrt((errors[:, :2] ** 2).mean()) < 0.05


@pytest.mark.parametrize("noise", [1.0, 4.0, 8.0])
def test_no_contact_no_patch(noise):
    assert finder().find(shaded(seed=3, noise=noise).image) is None
    assert finder().find(shaded(seed=4, noise=noise, brightness=0.8).image) is None
    assert finder().find(shaded(seed=5, noise=noise, brightness=1.15).image) is None
    slid = np.tile([0.15, -0.1], (len(GRID), 1))
    frame = shaded(seed=6, noise=noise, moved_mm=slid)
    assert finder().find(frame.image, frame.centres_px) is None


def test_contact_in_other_light_with_moved_markers():
    centre, radius = np.array([1.5, -2.0]), 2.2
    sx, sy, _ = pressed_heights(centre, radius, BALL_MM)
    away = GRID.positions_mm - centre
    near = np.exp(-((away**2).sum(axis=1) / 8))[:, None]
    frame = shaded((sx, sy), seed=8, brightness=0.85, moved_mm=0.3 * near * np.array([1.0, 0.3]))
    patch = finder().find(frame.image, frame.centres_px).at_height(rim_height(radius))
    sigma = np.sqrt(np.diag(patch.covariance))
    assert np.abs(patch.centre_mm - centre).max() < 3 * sigma[:2].max()
    assert abs(patch.size_mm - radius) < 3 * sigma[2]
    assert patch.contrast > 2


@pytest.mark.parametrize(
    "centre",
    quick(
        [(9.8, 1.0), (-10.4, -3.0), (2.0, 9.6), (-2.0, 9.6), (0.0, 9.0), (0.0, -9.6)],
        lambda centre: centre[0] < 0,
    ),
)
def test_patch_cut_by_the_pads_edge(centre):
    """Only a part is on the pad: fitted from that, with a larger error."""
    radius = 2.4
    sx, sy, _ = pressed_heights(centre, radius, BALL_MM)
    inner = pressed_heights((centre[0] * 0.4, centre[1] * 0.4), radius, BALL_MM)
    patch = finder().find(shaded((sx, sy), seed=9).image)
    whole = finder().find(shaded(inner[:2], seed=9).image)
    assert patch is not None
    assert 0.1 < patch.rim_share < 0.75
    assert whole.rim_share < patch.rim_share
    patch = patch.at_height(rim_height(radius))
    sigma = np.sqrt(np.diag(patch.covariance))
    assert (np.abs(patch.centre_mm - centre) < 3.5 * sigma[:2]).all()
    assert abs(patch.size_mm - radius) < 3.5 * sigma[2]
    assert sigma[2] > whole.sigma_mm


@pytest.mark.parametrize(
    ("aside_mm", "lens_offset_px", "centre", "radius"),
    [
        (0.0, (0.0, 0.0), (-5.0, -9.3), 1.8),
        (0.6, (-3.0, 2.0), (9.8, 1.0), 2.4),
        pytest.param(0.3, (6.0, -4.0), (9.8, -1.0), 2.4, marks=pytest.mark.slow),
    ],
)
def test_patch_cut_by_the_edge_has_no_second_solution(aside_mm, lens_offset_px, centre, radius):
    """A rim a quarter too small with a steep decay around it also explains what the edge leaves."""
    camera = finger_view(aside_mm=aside_mm, lens_offset_px=lens_offset_px)
    rest = shaded(seed=0, camera=camera)
    sx, sy, _ = pressed_heights(centre, radius, BALL_MM, camera=camera)
    patch = PatchFinder(
        camera,
        rest.image,
        rest.centres_px,
        marker_radius_px=rest.diameter_px / 2,
        surface_mm=pad_nodes(),
        indenter=Sphere(BALL_MM),
    ).find(shaded((sx, sy), seed=9, camera=camera).image)
    patch = patch.at_height(rim_height(radius))
    sigma = np.sqrt(np.diag(patch.covariance))
    assert patch.size_mm == pytest.approx(radius, abs=0.05)
    assert abs(patch.size_mm - radius) < 3.5 * sigma[2]
    assert (np.abs(patch.centre_mm - centre) < 3.5 * sigma[:2]).all()


@pytest.mark.parametrize(
    ("dark_sides", "noise"), [pytest.param(1.0, 4.0, marks=pytest.mark.slow), (2.0, 2.0)]
)
def test_noise_of_dark_sides_is_no_patch(dark_sides, noise):
    """Where one colour is all but gone its logarithm is noisy: once taken for a patch along the
    gel's whole side, wider than the pad, which drowned a light press in the middle."""
    rest = shaded(seed=0, noise=noise, dark_sides=dark_sides)
    find = PatchFinder(CAMERA, rest.image, rest.centres_px,
                       marker_radius_px=rest.diameter_px / 2,
                       surface_mm=pad_nodes(), indenter=Sphere(BALL_MM)).find  # fmt: skip
    for seed in range(1, 7):
        assert find(shaded(seed=seed, noise=noise, dark_sides=dark_sides).image) is None
    centre, radius = np.array([0.5, -0.8]), 1.8
    sx, sy, _ = pressed_heights(centre, radius, BALL_MM)
    for seed in range(10, 14):
        image = shaded((sx, sy), seed=seed, noise=noise, dark_sides=dark_sides).image
        patch = find(image).at_height(rim_height(radius))
        assert np.abs(patch.centre_mm - centre).max() < 0.1
        assert abs(patch.size_mm - radius) < 0.1


@pytest.mark.parametrize(
    "sizes", [(1.4, 2.0), pytest.param((2.0, 2.6), marks=pytest.mark.slow), (2.0, 1.5)]
)
def test_a_patch_that_jumps_in_size_is_followed(sizes):
    """A rim a third of the size away: the fit once stayed at the old size with a steep decay."""
    follow, centre = finder(), np.array([-0.5, 2.0])
    for k, radius in enumerate(sizes):
        sx, sy, _ = pressed_heights(centre, radius, BALL_MM)
        image = shaded((sx, sy), seed=50 + k).image
        patch, fresh = follow.find(image), finder().find(image)
        assert abs(patch.size_mm - fresh.size_mm) < 0.05
        assert np.abs(patch.centre_mm - fresh.centre_mm).max() < 0.03


def test_a_patch_that_was_lost_to_a_wrong_size_comes_back():
    """Whatever a fit was led to, it is sought afresh within a dozen frames, and the fit that leaves
    less on the wider window is kept."""
    follow, centre, radius = finder(), np.array([1.0, 1.5]), 2.2
    sx, sy, _ = pressed_heights(centre, radius, BALL_MM)
    images = [shaded((sx, sy), seed=60 + k).image for k in range(3)]
    true = follow.find(images[0]).size_mm
    last = follow._last
    wrong = replace(last.fit, values=last.fit.values * [1, 1, 0.75, 1] + [0, 0, 0, 2.0])
    smaller = replace(last.patch, size_mm=0.75 * last.patch.size_mm)
    follow._last = replace(last, fit=wrong, patch=smaller)
    sizes = [follow.find(images[k % 3]).size_mm for k in range(REFRESH_FRAMES + 2)]
    assert abs(sizes[-1] - true) < 0.05


def test_a_patch_is_followed_from_frame_to_frame():
    """A press that grows and slides: the same errors as afresh; then it lifts off, then returns."""
    follow = finder()
    for k in range(4):
        centre, radius = np.array([0.4 * k - 1, 0.2 * k]), 2.0 + 0.2 * (k % 3)
        sx, sy, _ = pressed_heights(centre, radius, BALL_MM)
        image = shaded((sx, sy), seed=20 + k).image
        patch, fresh = follow.find(image), finder().find(image)
        assert np.abs(patch.centre_mm - fresh.centre_mm).max() < 0.03
        assert abs(patch.size_mm - fresh.size_mm) < 0.05
    assert follow.find(shaded(seed=30).image) is None
    sx, sy, _ = pressed_heights((-4.0, -3.0), 1.4, BALL_MM)
    back = follow.find(shaded((sx, sy), seed=31).image)
    assert np.abs(back.centre_mm - [-4.0, -3.0]).max() < 0.1
    sx, sy, _ = pressed_heights((4.0, 3.0), 3.2, BALL_MM)
    leapt = follow.find(shaded((sx, sy), seed=32).image)
    assert np.abs(leapt.centre_mm - [4.0, 3.0]).max() < 0.15
    assert abs(leapt.size_mm - 3.2) < 4 * leapt.sigma_mm


def test_a_press_that_fades_is_followed():
    """Noise then leaves more unexplained; a search in each frame doubled the time."""
    follow, centre = finder(), np.array([1.0, -1.0])
    sx, sy, _ = pressed_heights(centre, 2.4, BALL_MM)
    left = []
    for k, share in enumerate((0.5, 0.44, 0.38, 0.33)):
        patch = follow.find(shaded((share * sx, share * sy), seed=70 + k).image)
        assert abs(patch.size_mm - 2.4) < 0.1
        assert follow._last.age == k
        left.append(1 - follow._last.fit.explained)
    assert left[-1] > left[0] + 0.06


def test_strip_of_a_cylinder():
    """Slopes of a line contact on a half-space, laid at an angle."""
    half, offset, angle = 1.6, 0.8, np.deg2rad(20.0)
    rest, _ = sight()
    across = np.cos(angle) * rest[:, 1] - np.sin(angle) * rest[:, 0] - offset
    out = np.maximum(np.abs(across) / half, 1.0)
    ratio = np.where(np.abs(across) < half, across / half,
                     np.sign(across) * (out - np.sqrt(out**2 - 1)))  # fmt: skip
    slope = ratio * half / 8.0
    frame = shaded((-np.sin(angle) * slope, np.cos(angle) * slope), seed=11)
    patch = finder(Cylinder(8.0)).find(frame.image)
    assert patch is not None
    assert patch.kind == "strip"
    sigma = np.sqrt(np.diag(patch.covariance))
    normal = np.array([-np.sin(angle), np.cos(angle)])
    turn = (patch.angle_deg - 20.0 + 90) % 180 - 90
    assert abs(turn) < max(3 * np.rad2deg(sigma[3]), 1.0)
    assert abs(patch.size_mm - half) < 3.5 * sigma[2]
    assert (
        abs(patch.centre_mm @ normal - offset)
        < 3.5 * np.sqrt(normal @ patch.covariance[:2, :2] @ normal) + 0.03
    )
    assert sigma[2] < 0.1 * half


def test_flat_punch_is_placed_by_its_outline():
    """Slopes beside a rectangular punch, falling off within a gel thickness."""
    rest, _ = sight()
    angle, centre, a, b = np.deg2rad(30.0), np.array([1.0, 0.5]), 2.0, 3.5
    dx, dy = (rest - centre).T
    u = np.cos(angle) * dx + np.sin(angle) * dy
    v = np.cos(angle) * dy - np.sin(angle) * dx
    pu, pv = np.maximum(np.abs(u) - a, 0), np.maximum(np.abs(v) - b, 0)
    steep = 0.5 * np.exp(-np.hypot(pu, pv) / 0.4) * (np.hypot(pu, pv) > 0)
    size = np.maximum(np.hypot(pu, pv), 1e-9)
    su, sv = steep * pu / size * np.sign(u), steep * pv / size * np.sign(v)
    slopes = np.cos(angle) * su - np.sin(angle) * sv, np.sin(angle) * su + np.cos(angle) * sv
    punch = Flat(half_sizes_mm=(a, b))
    patch = finder(punch).find(shaded(slopes, seed=12).image)
    assert patch is not None
    sigma = np.sqrt(np.diag(patch.covariance))
    assert (np.abs(patch.centre_mm - centre) < 3.5 * sigma[:2]).all()
    turn = (patch.angle_deg - 30.0 + 90) % 180 - 90
    assert abs(turn) < 6
    assert (patch.size_mm, patch.length_mm) == (a, b)
    lower = patch.at_height(-0.3)
    assert (lower.size_mm, lower.length_mm) == (a, b)
    seen = CAMERA.project([[*lower.centre_mm, -0.3], [*patch.centre_mm, 0.0]])
    assert np.linalg.norm(seen[0] - seen[1]) < 0.5


def test_the_circle_is_that_of_a_general_robust_fit():
    rng = np.random.default_rng(11)
    for _ in range(20):
        count, radius = int(rng.integers(8, 80)), rng.uniform(0.5, 5.0)
        turn = rng.uniform(0, rng.uniform(1.0, 6.28), count)
        points = radius * np.column_stack([np.cos(turn), np.sin(turn)])
        points += rng.normal(0, 0.03, points.shape)
        points[rng.random(count) < 0.15] += rng.normal(0, 0.5, 2)
        start = circle_start(points)

        def distance(p, points=points):
            return np.hypot(*(points - p[:2]).T) - p[2]

        scale = 2 * 1.4826 * np.median(np.abs(distance(start)))
        robust = least_squares(distance, start, loss="soft_l1", f_scale=scale, xtol=1e-12)
        np.testing.assert_allclose(fit_circle(points)[0], robust.x, atol=1e-3 * robust.x[2])


def test_circle_and_strip_fits_have_honest_errors():
    rng = np.random.default_rng(3)
    scores = []
    for _ in range(60):
        turn = rng.uniform(0, 2.2, 40)
        points = [1.0, -2.0] + 3 * np.column_stack([np.cos(turn), np.sin(turn)])
        values, covariance = fit_circle(points + rng.normal(0, 0.02, points.shape))
        scores.append((values - [1.0, -2.0, 3.0]) / np.sqrt(np.diag(covariance)))
    spread = np.sqrt(np.mean(np.square(scores), axis=0))
    # neighbouring points are taken to err together, which these do not: 1/√2
    assert np.allclose(spread, 0.7, atol=0.25)
    exact = [4.0, 1.0] + 2 * np.column_stack([np.cos(turn), np.sin(turn)])
    np.testing.assert_allclose(circle_start(exact), [4, 1, 2], rtol=1e-9)
    along, side = rng.uniform(-8, 8, 60), rng.choice([-1.2, 1.2], 60)
    c, s = np.cos(0.5), np.sin(0.5)
    points = np.column_stack([c * along - s * (side + 0.4), s * along + c * (side + 0.4)])
    values, _ = fit_strip(points + rng.normal(0, 0.01, points.shape))
    turn = (values[2] - 0.5 + np.pi / 2) % np.pi - np.pi / 2
    flip = np.cos(values[2] - 0.5)
    np.testing.assert_allclose([flip * values[0], values[1], turn], [0.4, 1.2, 0], atol=0.02)
    with pytest.raises(ValueError, match="line"):
        circle_start(np.column_stack([np.arange(5.0), np.arange(5.0)]))
    with pytest.raises(ValueError, match="three"):
        circle_start(np.zeros((2, 2)))


def test_light_ratios_are_those_of_numpy():
    from gelslim_force.contact.shading_kernel import FREE, block_discs, glaring_bins, light_ratios

    rng = np.random.default_rng(0)
    for channels in (1, 3):
        pair = rng.integers(0, 256, (2, 50, 70, channels)).astype(np.uint8)
        pair[:, 30:40, 20:40] = 255
        pair = read_only(pair)
        mask = np.full((50, 70), FREE, np.uint8)
        discs = np.array([[20.3, 10.0], [-2.0, 60.0], [np.nan, 1.0], [68.6, 48.7]])
        block_discs(mask, discs, np.full(4, 5.5))
        y, x = np.mgrid[:50, :70]
        blocked = (np.hypot(x - 20.3, y - 10) <= 5.5) | (np.hypot(x - 68.6, y - 48.7) <= 5.5)
        assert (mask == np.where(blocked, 0, FREE)).all()
        glaring = np.ones((2, 12, 17), np.uint8)
        for image, may in zip(pair, glaring, strict=True):
            glaring_bins(image, 4, may)
        assert glaring.any()
        assert not glaring.all() or channels == 1
        ratios, counts = np.ones((channels, 12, 17), np.float32), np.ones((12, 17), np.int64)
        light_ratios(*pair, mask, glaring[0] | glaring[1], 4, 5.0, ratios, counts)
        free = ~blocked & (pair.min(axis=3) < 253).all(axis=0)
        cut = (pair * free[..., None])[:, :48, :68].reshape(2, 12, 4, 17, 4, channels)
        left = free[:48, :68].reshape(12, 4, 17, 4).sum(axis=(1, 3))
        assert (counts == left).all()
        light = cut.sum(axis=(2, 4), dtype=float) + 5.0 * np.maximum(left, 1)[..., None]
        np.testing.assert_allclose(np.moveaxis(ratios, 0, 2), light[1] / light[0], rtol=1e-6)


def test_the_compiled_fit_ends_where_least_squares_does():
    """Against scipy on the plain law with the gains solved by NumPy; tables and Broyden's update
    cost less than the fit's own tolerance."""
    from scipy.optimize import least_squares

    from gelslim_force.contact.patch_fit_kernel import settle
    from gelslim_force.contact.slope_kernel import law

    rng = np.random.default_rng(5)
    x, y = rng.uniform(-4, 4, (2, 900))
    lean = np.full((900, 2), [0.3, -0.1])
    for strip in (False, True):
        true = np.array([0.3, 0.2, 1.8, 0.8])

        def basis(theta, strip=strip):
            if strip:
                dx, dy = np.cos(theta[1]) * y - np.sin(theta[1]) * x - theta[0], 0 * x
            else:
                dx, dy = x - theta[0], y - theta[1]
            r = np.hypot(dx, dy)
            terms = np.zeros((2, 900))
            for side, weight in zip(*np.polynomial.legendre.leggauss(12), strict=True):
                ratio = (r + side * 0.05) / theta[2]
                slopes = [np.sign(q) * np.array(law(abs(q), theta[3], strip)) for q in ratio]
                terms += weight / 2 * np.array(slopes).T
            unit = np.array([dx, dy]) / r
            return np.column_stack(
                [*(terms[0] * unit), *(terms[1] * unit), terms[0] ** 2, 1 + 0 * x]
            )

        gains = np.array([[3, 0.2], [0.1, 2], [1, 0], [0, 1], [0.5, 0.5], [0.1, 0.2]])
        change = 10 * basis(true) @ gains + rng.normal(size=(900, 2))

        def left(theta, change=change, basis=basis):
            b = basis(theta)
            return (change - b @ np.linalg.lstsq(b, change, rcond=1e-9)[0]).ravel()

        best = least_squares(left, true)
        for near in (0.0, 0.03):
            found, residual = true + np.array([0.2, 0.1, -0.2, 0.3]), np.empty((900, 2))
            jacobian = np.zeros((1800, 4))
            cost = settle(x, y, lean, change, found, strip, 0.0, 0.05, 12, near, residual, jacobian)
            assert cost < 2 * best.cost * 1.004
            np.testing.assert_allclose(found[:3], best.x[:3], atol=0.01)
            np.testing.assert_allclose((residual**2).sum(), cost, rtol=1e-12)


def test_grey_frames_show_a_patch_too():
    """One channel tells the slope towards one side only."""
    centre, radius = np.array([0.5, 1.0]), 2.4
    sx, sy, _ = pressed_heights(centre, radius, BALL_MM)
    red = (reference().image[:, :, 0], shaded((sx, sy), seed=40).image[:, :, 0])
    frame = reference()
    grey = PatchFinder(CAMERA, red[0], frame.centres_px, marker_radius_px=frame.diameter_px / 2,
                       surface_mm=pad_nodes(), indenter=Sphere(BALL_MM))  # fmt: skip
    patch = grey.find(red[1]).at_height(rim_height(radius))
    sigma = np.sqrt(np.diag(patch.covariance))
    assert (np.abs(patch.centre_mm - centre) < 4 * sigma[:2]).all()
    assert abs(patch.size_mm - radius) < 4 * sigma[2]


def test_unfit_pictures_are_refused():
    frame = reference()
    with pytest.raises(ValueError, match="reference"):
        finder().find(frame.image[::2, ::2])
    with pytest.raises(ValueError, match="uint8"):
        finder().find(frame.image.astype(float))
    with pytest.raises(ValueError, match="uint8"):
        finder().find(np.zeros((480, 640, 4), np.uint8))
    with pytest.raises(ValueError, match="32 x 32"):
        finder().find(np.zeros((0, 0, 3), np.uint8))
    with pytest.raises(ValueError, match="dark"):
        PatchFinder(CAMERA, np.zeros_like(frame.image), frame.centres_px)
    with pytest.raises(ValueError, match="320 x 240"):
        PatchFinder(CAMERA, frame.image[:240, :320], frame.centres_px)
    assert finder().find(np.zeros_like(frame.image)) is None
    assert finder().find(np.full_like(frame.image, 255)) is None
