"""Rays aimed at corners to the last bit, and started on them, stay accounted for."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from light_cases import finger

from gelslim_optics.light.source import EdgeLaunch
from gelslim_optics.light.trace import TraceOptions, _job, _run
from gelslim_optics.light.trace_geometry import CORNERS, ENDS_STOPPED, LOST, PER_EDGE


@pytest.mark.parametrize(("mirror", "crown"), [("", 0.0), ("", 0.7), ("glued", 0.0), ("gap", 0.0)])
def test_no_ray_is_lost_at_a_corner(mirror: str, crown: float) -> None:
    scene = finger(1.3, mirror=mirror, crown_mm=crown, absorption=0.0)
    scene = replace(scene, sources=(EdgeLaunch("window_bottom"),))
    job = _job(scene, scene.sources[0], TraceOptions(split=1e-2))
    corners = np.unique(job.geometry.shape[:, :4].reshape(-1, 2), axis=0)
    rng = np.random.default_rng(5)
    floor = scene.profile.edge("window_bottom").curve.start[1] - job.middle[1]
    starts = []
    for _ in range(400):
        for corner in corners:
            y = rng.uniform(-10, 10)
            # Aimed along the sum of a corner and at most a few units of the last place.
            dy, dz = corner[0] - y, corner[1] - floor
            dz = abs(dz) + rng.integers(-2, 3) * np.spacing(dz) if dz else 1e-9
            slope = rng.choice([0.0, rng.uniform(-0.5, 0.5)])
            size = math.sqrt(slope**2 + dy * dy + dz * dz)
            starts.append((0.0, y, floor, slope / size, dy / size, dz / size, 1.0, 0.0))
    sums, *_ = _run(job, np.array(starts), np.uint64(3), 0)
    assert sums[LOST] == 0
    booked = sums[: ENDS_STOPPED + 1].sum() + sums[PER_EDGE:].sum()
    assert booked == pytest.approx(len(starts), abs=1e-8)


def test_rays_started_on_corners_of_the_foot() -> None:
    """Exactly on an end of the edge they start from, in every direction into the acrylic."""
    scene = finger(1.3, absorption=0.0)
    scene = replace(scene, sources=(EdgeLaunch("foot_right"),))
    job = _job(scene, scene.sources[0], TraceOptions())
    angles = np.linspace(0.01, math.pi - 0.01, 500)
    shape = job.geometry.shape[job.first_edge]
    starts = [
        (0.0, y, z, 0.0, math.cos(a), math.sin(a), 1.0, 0.0)
        for y, z in (shape[:2], shape[2:4])
        for a in angles
    ]
    sums, *_ = _run(job, np.array(starts), np.uint64(3), 0)
    assert sums[LOST] == 0
    # Half head out through the neighbouring wall at once; at one of the ends by signs alone.
    assert sums[CORNERS] == 250
    assert sums[: ENDS_STOPPED + 1].sum() + sums[PER_EDGE:].sum() == pytest.approx(1000, abs=1e-9)
