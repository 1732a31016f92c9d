"""The covariance of a frame's wrench against its definition, marker by marker."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from camera_rig import off_centre_view
from pad_samples import small_bundle

from gelslim_force.contact.normal_source import NormalReading
from gelslim_force.forces.wrench import WrenchNoise
from gelslim_force.forces.wrench_covariance import WrenchCovariance
from gelslim_force.lattice.reference_lattice import ReferenceLattice
from gelslim_force.motion.marker_motion import MarkerView
from gelslim_force.motion.surface_motion import SurfaceMotion
from gelslim_force.motion.unseen_motion import FilledMotion
from gelslim_force.tracking.drift import FarField, Similarity
from gelslim_force.tracking.drift_filter import FrameDrift

NOT_FOLLOWED, NOT_SEEN = 3, np.array([5, 6])
NOISE_PX, UNNOTICED_MM = 0.07, 0.3
CAMERA = off_centre_view()


class Sensor:
    """All markers of a small pad but one."""

    def __init__(self) -> None:
        bundle = small_bundle()
        markers = bundle.markers
        self.ids = np.delete(np.arange(len(markers.positions_mm)), NOT_FOLLOWED)
        at = np.asarray(markers.positions_mm)[self.ids]
        self.seen_px = CAMERA.project(np.column_stack([at, np.zeros(len(at))]))
        points = np.asarray(bundle.mesh.surface_mm)
        view = MarkerView(CAMERA, self.seen_px)
        self.motion = SurfaceMotion(view, self.ids, markers.sparse, points)
        sites = np.stack([np.unique(v.round(6), return_inverse=True)[1] for v in at.T[:2]], axis=1)
        self.field = FarField(ReferenceLattice(sites, self.seen_px, self.ids))
        self.noise = WrenchNoise.of(bundle.surface_operator(), points)
        self.covariance = WrenchCovariance(self.noise, self.motion, self.field, UNNOTICED_MM)

    def drift(self, rng: np.random.Generator) -> FrameDrift:
        """A drift of which a part is corrected."""
        half = rng.normal(0, 0.01, (4, 4))
        gain = rng.normal(0, 0.003, (4, len(self.ids), 2))
        leak, nothing = rng.uniform(0, 1e-5, 4), float("nan")
        return FrameDrift(
            Similarity(), self.seen_px, gain, self.field.basis, half @ half.T, leak, "", False,
            nothing,
        )  # fmt: skip


@pytest.fixture(scope="module")
def sensor() -> Sensor:
    return Sensor()


def expected(
    sensor: Sensor,
    filled: FilledMotion,
    drift: FrameDrift,
    lateral_mm: np.ndarray,
    sunk: np.ndarray,
) -> np.ndarray:
    """Sum over all causes, for a lateral motion (k, 2) that depends on the same depth as `sunk`."""
    lost = np.zeros(len(sensor.ids) + 1, dtype=bool)
    lost[NOT_FOLLOWED] = True
    gains = sensor.noise.gains(sensor.motion.interpolation.with_missing(lost))
    whole = sensor.noise.gains(sensor.motion.interpolation)
    scale, basis = sensor.motion.view.mm_per_px, sensor.field.basis
    rigid = sum(whole[:, m] @ scale[n] @ basis[n] for n, m in enumerate(sensor.ids))
    total = rigid @ (drift.covariance + np.diag(drift.leak)) @ rigid.T
    common = sunk.copy()
    for n, marker in enumerate(sensor.ids):
        per_px = gains[:, marker] @ scale[n] - rigid @ drift.gain[:, n]
        common += per_px @ np.linalg.inv(scale[n]) @ lateral_mm[marker]
        if n not in filled.unseen:
            total = total + NOISE_PX**2 * per_px @ per_px.T
    for i, first in enumerate(filled.unseen):
        for j, second in enumerate(filled.unseen):
            pair = gains[:, sensor.ids[first]] @ gains[:, sensor.ids[second]].T
            total = total + filled.covariance_mm2[i, j] * pair
    return total + np.outer(common, common)


@pytest.mark.parametrize("deep", [True, False])
def test_the_covariance_is_the_sum_of_its_causes(sensor: Sensor, deep: bool) -> None:
    rng = np.random.default_rng(int(deep))
    drift, count = sensor.drift(rng), len(sensor.ids)
    half = rng.normal(0, 0.02, (2, 2))
    filled = FilledMotion(rng.normal(0, 0.05, (count, 3)), NOT_SEEN, half @ half.T)
    lost = np.zeros(count + 1, dtype=bool)
    lost[NOT_FOLLOWED] = True
    interpolation = sensor.motion.interpolation.with_missing(lost)
    nodes = len(sensor.motion.points_mm)
    reading = NormalReading.given(nodes, rng.normal(0, 0.1, nodes), 0.01) if deep else None
    if reading is None:
        noise_mm = NOISE_PX * sensor.motion.view.usual_mm_per_px
        lateral = sensor.motion.apparent_motion(filled.motion_mm, UNNOTICED_MM, noise_mm)
        sunk = np.zeros(6)
    else:
        lateral = sensor.motion.compensation_change(reading.sigma_mm)
        sunk = sensor.noise.response[:, :, 2] @ reading.sigma_mm
    found = sensor.covariance.of_motion(interpolation, filled, NOISE_PX, reading, drift)
    due = expected(sensor, filled, drift, lateral, sunk)
    np.testing.assert_allclose(found, due, atol=1e-10 * np.abs(due).max())


def test_independent_errors_of_the_motion_add_their_own_covariances(sensor: Sensor) -> None:
    """Two errors are not one that is as large as both, which may be of opposite sign."""
    rng, count = np.random.default_rng(6), len(sensor.ids)
    interpolation, none = sensor.motion.interpolation, np.zeros(0, dtype=np.intp)
    filled = FilledMotion(rng.normal(0, 0.05, (count, 3)), none, np.zeros((0, 0)))
    drift, nodes = sensor.drift(rng), len(sensor.motion.points_mm)
    plain = NormalReading.given(nodes, rng.normal(0, 0.1, nodes), 0.0)
    errors = rng.normal(0, 0.01, (3, nodes))

    def of(reading: NormalReading) -> np.ndarray:
        return sensor.covariance.of_motion(interpolation, filled, NOISE_PX, reading, drift)

    without, found = of(plain), of(replace(plain, errors_mm=errors))
    each = [of(replace(plain, errors_mm=error[None])) - without for error in errors]
    np.testing.assert_allclose(found - without, sum(each), atol=1e-9 * np.abs(found).max())
    hidden = np.abs(rng.normal(0, 0.01, nodes))
    with_hidden = replace(plain, errors_mm=errors).with_error(hidden)
    np.testing.assert_allclose(with_hidden.common_errors_mm, np.vstack([errors, hidden]))
    np.testing.assert_allclose(with_hidden.sigma_mm, np.hypot(plain.sigma_mm, hidden))
    alone = plain.with_error(hidden)
    np.testing.assert_allclose(alone.common_errors_mm, [hidden])
