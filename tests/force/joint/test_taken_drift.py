"""What the correction of drift takes off the motion by a load: the model of it, and its effect."""

from __future__ import annotations

import numpy as np
import pytest
from pressed_samples import pressed_by, round_patch
from sigma_cases import drifted
from sigma_gate import nothing_given

from gelslim_force.joint.markers.rows import MarkerRows
from gelslim_force.joint.markers.taken_drift import TakenDrift
from gelslim_force.tracking.drift import Similarity
from gelslim_force.tracking.drift_filter import FrameDrift

COUNT, UNKNOWNS = 20, 6


def test_rows_are_those_of_the_corrected_motion() -> None:
    """The motion in the picture, fitted and corrected marker by marker."""
    rng = np.random.default_rng(8)
    gain, basis = rng.normal(size=(4, COUNT, 2)), rng.normal(size=(COUNT, 2, 4))
    gain[:, ::3] = 0.0
    mm_per_px = np.eye(2) + 0.2 * rng.normal(size=(COUNT, 2, 2))
    nothing = np.zeros((4, 4)), np.zeros(4)
    drift = FrameDrift(
        Similarity(), np.zeros((COUNT, 2)), gain, basis, *nothing, "", untouched=False,
        residual_px=0.0,
    )  # fmt: skip
    taken = TakenDrift.of(drift, mm_per_px)
    assert taken is not None
    motion, used = rng.normal(size=(COUNT, 2, UNKNOWNS)), np.array([0, 4, 7, 8])
    force = rng.normal(size=UNKNOWNS)
    moved_px = np.einsum("nij,njk->nik", np.linalg.inv(mm_per_px), motion) @ force
    left_px = moved_px - basis @ np.einsum("ani,ni->a", gain, moved_px)
    left = np.einsum("nij,nj->ni", mm_per_px, left_px)[used]
    rows = motion[used].reshape(-1, UNKNOWNS)
    data = MarkerRows(used, rows, -rows @ force, np.ones(2 * len(used)))
    free = motion[taken.markers]
    found = taken.off(data, free.reshape(-1, UNKNOWNS), free @ force)
    np.testing.assert_allclose(found.rows @ force, left.ravel(), atol=1e-12)
    np.testing.assert_allclose(found.residual, -left.ravel(), atol=1e-12)


def test_nothing_is_taken_off_where_nothing_is_corrected() -> None:
    none = np.zeros((4, COUNT, 2)), np.zeros((COUNT, 2, 4)), np.zeros((4, 4)), np.zeros(4)
    drift = FrameDrift(
        Similarity(), np.zeros((COUNT, 2)), *none, "", untouched=True, residual_px=0.0
    )
    assert TakenDrift.of(drift, np.tile(np.eye(2), (COUNT, 1, 1))) is None


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_wide_contact_reads_the_same_after_the_camera_has_moved(seed: int) -> None:
    rng = np.random.default_rng([9, seed])
    place = tuple(rng.uniform(-2, 2, 2).tolist())
    image = pressed_by(round_patch(place, 2.6, 0.03), seed).image
    pipeline, normal_n = nothing_given(), []
    for drift_px in (np.zeros(4), rng.choice([-1, 1], 4) * rng.uniform(0.1, 0.25, 4)):
        pipeline.reset()
        seen = np.clip(np.rint(drifted(image.astype(float), drift_px)), 0, 255).astype(np.uint8)
        found = pipeline.process(seen)
        assert found.wrench is not None
        normal_n.append(found.wrench.force_n[2])
    assert normal_n[1] == pytest.approx(normal_n[0], rel=0.025)
