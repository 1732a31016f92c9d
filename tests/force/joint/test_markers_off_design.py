"""Forces by the markers alone on sensors that are not as designed.

Contacts and sensors are those of the gate of the deviations: modulus off by 3 %, thickness by 1.5 %
and Poisson's ratio by 0.004, noise, dirt and a drifting camera in turns. The pictures are grey.
"""

from __future__ import annotations

import numpy as np
import pytest
from pressed_samples import calibration
from sigma_cases import press, seen, specified_bundle
from sigma_gate import condition_of

from gelslim_force.built_sensor import built_gel
from gelslim_force.joint.unknown_shape import unknown_shape
from gelslim_force.pipeline import ForcePipeline

CASES = 32
LEAST_N = 0.1


@pytest.mark.slow
def test_forces_and_deviations_by_the_markers_off_design() -> None:
    """On 210 cases F_z is off by 4 % in the median and 19 % at the 95th percentile.

    The deviations are two to three times the errors, as they hold gels beyond the tolerances too.
    """
    bundle = specified_bundle()
    gel = built_gel(bundle, calibration(), None)
    source = unknown_shape(bundle, calibration(), None)
    pipeline = ForcePipeline(bundle, calibration(), normal=source, gel=gel.share)
    off, sigma, true, unknown = [], [], [], 0
    for seed in range(CASES):
        contact = press(seed)
        if abs(contact.force_n[2]) < LEAST_N:
            continue
        image = seen(contact.picture, condition_of(seed), seed)
        pipeline.reset()
        found = pipeline.process(np.rint(image.mean(axis=2)).astype(np.uint8))
        assert found.wrench is not None
        if not found.normal_known or found.wrench.force_n[2] == 0:
            unknown += 1
            continue
        off.append(found.wrench.force_n - contact.force_n)
        sigma.append(found.wrench.standard_deviation[:3])
        true.append(contact.force_n)
    error, size = np.array(off), np.abs(np.array(true)[:, 2])
    share = np.abs(error[:, 2]) / size
    assert len(share) >= 12
    assert unknown <= 0.2 * len(share)
    assert np.median(share) < 0.07
    assert np.percentile(share, 95) < 0.25
    assert np.median(np.hypot(*error[:, :2].T)) < 0.004
    score = error / np.array(sigma)
    assert (np.sqrt(np.square(score).mean(axis=0)) < 1.3).all()
    assert (np.abs(score) < 2).mean() > 0.9
    assert np.median(np.array(sigma)[:, 2] / size) < 0.25
