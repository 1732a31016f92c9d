"""The low-pass chooses its width by the noise: held to the true error and to the whole of C."""

from __future__ import annotations

import numpy as np
import pytest
from camera_rig import off_centre_view
from pad_samples import hertz_like, small_bundle

from gelslim_force.forces.estimator import (
    ForceEstimator,
    ForceSettings,
    curvature_operator,
    neighbour_matrix,
)
from gelslim_force.forces.low_pass import (
    WIDTHS_IN_CELLS,
    ForceNoise,
    LowPass,
    MotionNoise,
    normal_noise_mm,
    widths_mm,
)
from gelslim_force.motion.marker_motion import MarkerView
from gelslim_force.motion.surface_motion import SurfaceMotion
from gelslim_force.tracking.marker_noise import robust_sigma
from ifem_export.bundle.bundle import Bundle

CELL_MM = np.asarray(small_bundle().mesh.cell_size_mm[:2])
PARTS = (slice(0, 2), slice(2, 3))


@pytest.fixture(scope="module")
def case():
    """Operator, motion of the sensor, known forces (c, 3), their motion, and the low-passes."""
    bundle = small_bundle()
    operator = bundle.surface_operator("factor")
    motion = seen_motion(bundle)
    force = hertz_like(motion.points_mm, 1.0, (0.3, -0.2))
    noise = ForceNoise.of(operator, motion)
    passes = LowPass.of(motion.points_mm, widths_mm(CELL_MM, None), noise)
    return operator, motion, force, operator.displacement(force), passes


def seen_motion(bundle: Bundle) -> SurfaceMotion:
    """Every marker, seen from where it is printed."""
    assert bundle.markers is not None
    places = np.asarray(bundle.markers.positions_mm)
    camera = off_centre_view()
    view = MarkerView(camera, camera.project(np.column_stack([places, np.zeros(len(places))])))
    points = np.asarray(bundle.mesh.surface_mm)
    return SurfaceMotion(view, np.arange(len(places)), bundle.markers.sparse, points)


def noisy(case, rng, marker_px: float, normal_mm: float) -> np.ndarray:
    """Forces (c, 3) of the motion with white noise."""
    operator, motion, _, moved, _ = case
    u = moved + motion.of_noise(marker_px * rng.normal(size=(len(motion.view), 2)))
    u[:, 2] += normal_mm * rng.normal(size=len(u))
    return operator.force(u)


@pytest.mark.parametrize("marker_px", [0.02, 0.1, 0.4, 1.5])
@pytest.mark.parametrize("normal_mm", [0.0, 0.003, 0.03])
def test_width_chosen_is_about_the_best(case, marker_px: float, normal_mm: float) -> None:
    _, _, force, _, passes = case
    rng = np.random.default_rng(7)
    for columns in PARTS:
        ours, each = [], []
        for _ in range(6):
            found = noisy(case, rng, marker_px, normal_mm)
            chosen = passes.applied(found, MotionNoise(marker_px, normal_mm)).force_n
            ours.append(missed(chosen, force, columns))
            each.append([missed(spread @ found, force, columns) for spread in passes.spreads])
        assert np.mean(ours) < 1.12 * np.mean(each, axis=0).min()


def missed(found: np.ndarray, true: np.ndarray, columns: slice) -> float:
    return float(np.linalg.norm((found - true)[:, columns]))


def test_wider_for_more_noise_of_that_part_alone(case) -> None:
    rng = np.random.default_rng(8)
    found = noisy(case, rng, 0.02, 0.0)
    quiet = case[-1].applied(found, MotionNoise(0.02, 0.0)).width_mm
    loud = case[-1].applied(noisy(case, rng, 1.5, 0.0), MotionNoise(1.5, 0.0)).width_mm
    assert quiet[0] < loud[0]
    deep = case[-1].applied(noisy(case, rng, 0.02, 0.03), MotionNoise(0.02, 0.03)).width_mm
    assert quiet[1] < deep[1]


def test_no_noise_leaves_the_forces_as_they_are(case) -> None:
    _, _, force, _, passes = case
    found = passes.applied(force, MotionNoise())
    assert (found.force_n == force).all()
    assert not found.sigma_n.any()
    assert not found.width_mm.any()


def test_every_width_keeps_the_resultant(case) -> None:
    _, _, force, _, passes = case
    for spread in passes.spreads:
        assert (spread @ force).sum(axis=0) == pytest.approx(force.sum(axis=0), abs=1e-12)


def test_traces_are_those_of_the_whole_covariance(case) -> None:
    """Every column of C by one solve each, in place of the draws."""
    operator, motion, _, _, passes = case
    columns = []
    for marker in range(len(motion.view)):
        for axis in range(2):
            unit = np.zeros((len(motion.view), 2))
            unit[marker, axis] = 1.0
            columns.append(operator.force(motion.of_noise(unit)))
    each = np.array(columns)
    for k, spread in enumerate(passes.spreads):
        for part, which in enumerate(PARTS):
            spread_each = np.stack([spread @ e[:, which] for e in each])
            whole = (each[:, :, which] * spread_each).sum()
            assert passes.traces[k, part, 0] == pytest.approx(whole, rel=0.15)


def test_sigma_is_the_scatter_behind_the_low_pass(case) -> None:
    *_, passes = case
    rng = np.random.default_rng(9)
    told = passes.applied(noisy(case, rng, 0.3, 0.003), MotionNoise(0.3, 0.003))
    tangential, normal = (list(passes.widths_mm).index(w) for w in told.width_mm)
    tried = np.stack([noisy(case, rng, 0.3, 0.003) for _ in range(40)])
    sideways = np.stack([passes.spreads[tangential] @ f for f in tried])[..., :2]
    size = np.sqrt(sideways.var(axis=0, ddof=1).sum(axis=-1))
    up = np.stack([passes.spreads[normal] @ f for f in tried])[..., 2].std(axis=0, ddof=1)
    for found, scatter in zip(told.sigma_n.T, (size, up), strict=True):
        assert np.sqrt(np.mean(found**2)) == pytest.approx(np.sqrt(np.mean(scatter**2)), rel=0.12)


def test_noise_of_the_normal_motion_is_told_from_a_contact(case) -> None:
    _, motion, _, moved, _ = case
    bend = curvature_operator(neighbour_matrix(motion.points_mm, CELL_MM))
    smooth = moved[:, 2] * 0.3 / np.abs(moved[:, 2]).max()
    assert normal_noise_mm(bend, smooth) < 3e-4
    rng = np.random.default_rng(10)
    for sigma in (0.002, 0.01, 0.05):
        found = [normal_noise_mm(bend, smooth + rng.normal(0, sigma, len(smooth)))
                 for _ in range(5)]  # fmt: skip
        # A contact that covers a fifth of so small a pad leaves few quiet nodes.
        assert 0.85 * sigma < np.mean(found) < 1.4 * sigma


def test_too_few_rows_tell_no_noise() -> None:
    assert robust_sigma(np.ones((7, 2))) == 0.0


def test_fixed_width_and_direct_do_as_told(case) -> None:
    operator, motion, _, moved, passes = case
    mesh = small_bundle().mesh
    for settings, width in (
        (ForceSettings(low_pass_mm=0.75), 0.75),
        (ForceSettings(method="direct"), 0.0),
    ):
        estimator = ForceEstimator(mesh, operator, settings, motion=motion)
        found = estimator.estimate(moved, noise_px=0.5)
        assert found.low_pass_mm is not None
        assert found.low_pass_mm == pytest.approx([width, width])
    assert passes.widths_mm == pytest.approx(
        np.sqrt(CELL_MM[0] * CELL_MM[1]) * np.array(WIDTHS_IN_CELLS)
    )
