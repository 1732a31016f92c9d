"""What is solved depends neither on what was asked before nor on the threads, to the last bit."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

sys.path.extend([str(Path(__file__).parents[1] / area) for area in ("twin", "force")])
from camera_rig import finger_view
from sensor_samples import sensor_bundle, sensor_grid
from sim_rig import small_sensor
from synthetic import Look, render

from gelslim_force.calibration.calibration import calibrate
from gelslim_force.pipeline import ForcePipeline
from ifem_export.bundle.files import load_bundle
from ifem_export.compliance.columns import SurfaceCompliance
from ifem_export.markers.thin_plate import thin_plate


def test_columns_of_the_compliance_are_the_same_in_whatever_order(tmp_path: Path) -> None:
    """A simulation that goes on after a kill finds other columns made than one that was not."""
    bundle = load_bundle(small_sensor(tmp_path))
    whole = SurfaceCompliance(bundle)
    count = whole.nodes
    whole.require(np.arange(count))
    unit = np.eye(3 * count).reshape(count, 3, count, 3)
    full = np.stack([[whole.displacement(np.arange(count), u) for u in unit[k]] for k in (0, 57)])
    random = np.random.default_rng(5)
    for asked in (1, 3, 17, 64, 65):
        some = SurfaceCompliance(bundle)
        some.require(random.choice(count, asked, replace=False))
        some.require(np.array([0, 57]))
        found = [[some.displacement(np.array([k]), e[None]) for e in np.eye(3)] for k in (0, 57)]
        assert np.array_equal(np.array(found), full)


def of_threads(made: Callable[[], list[NDArray[np.float64]]]) -> list[list[bytes]]:
    """The bytes of what is made with one BLAS thread and with two."""
    found = []
    for threads in (1, 2):
        with threadpool_limits(threads, user_api="blas"):
            found.append([np.asarray(array).tobytes() for array in made()])
    return found


def test_a_spline_is_the_same_whatever_the_threads() -> None:
    """Two threads gave other bits: the bundle's files depended on the processors."""
    random = np.random.default_rng(3)
    markers, nodes = random.uniform(0, 20, (300, 2)), random.uniform(0, 20, (900, 2))

    def spline() -> list[NDArray[np.float64]]:
        made = thin_plate(markers, nodes)
        return [made.to_nodes, made.bending]

    one, two = of_threads(spline)
    assert one == two


@pytest.mark.slow
def test_calibration_and_forces_are_the_same_whatever_the_threads() -> None:
    bundle, dots = sensor_bundle(), np.asarray(sensor_grid().positions_mm)
    rest = render(sensor_grid(), finger_view(), Look(noise=2.0))
    push = 0.1 * np.exp(-np.sum(dots**2, axis=1) / 18)[:, None] * [1.0, -0.5, 0.0]
    pushed = render(sensor_grid(), finger_view(), Look(noise=2.0), push)

    def found() -> list[NDArray[np.float64]]:
        calibration = calibrate(bundle, rest.image)
        result = ForcePipeline(bundle, calibration).process(pushed.image)
        assert result.field is not None
        assert np.abs(result.field.force_n[:, :2]).max() > 0
        camera = calibration.camera
        return [camera.position_mm, camera.forward, result.field.force_n, result.wrench.covariance]

    one, two = of_threads(found)
    assert one == two


CENTRES = (
    "import hashlib, sensor_samples as s, synthetic, camera_rig;"
    "from gelslim_force.calibration.calibration import calibrate;"
    "look = synthetic.Look(noise=2.0);"
    "seen = synthetic.render(s.sensor_grid(), camera_rig.finger_view(), look);"
    "found = calibrate(s.sensor_bundle(), seen.image);"
    "print(hashlib.sha256(found.reference.positions_px.tobytes()).hexdigest())"
)


@pytest.mark.slow
def test_dots_are_the_same_compiled_and_from_the_cache(tmp_path: Path) -> None:
    """Sums that may be reordered were, in one of the two: dots moved by 1e-8 px."""
    tests = Path(__file__).parents[1]
    paths = os.pathsep.join([str(tests.parent), str(tests / "force")])
    own = {**os.environ, "PYTHONPATH": paths, "NUMBA_CACHE_DIR": str(tmp_path)}
    argv = [sys.executable, "-c", CENTRES]
    compiled, cached = (
        subprocess.run(argv, env=own, capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    )
    assert compiled == cached
