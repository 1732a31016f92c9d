"""Motion and forces of an imported sensor, against the truth and against the generated sensor.

The truth is a push on a pad of half the pitch and eight layers (`sensor_samples`). The generated
sensor knows its camera, layers and print by design; the imported one has a picture and the gel.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from imported_samples import imported
from sensor_samples import NORMAL_N, SHEAR_N, frame, press, sensor_bundle, sensor_grid
from synthetic import Frame, Look

from gelslim_force.calibration.file import read_calibration, write_calibration
from gelslim_force.imported.importer import ImportedSensor
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.sensor import open_sensor
from gelslim_force.settings import PipelineSettings
from ifem_export.bundle.files import load_bundle, write_bundle

pytestmark = pytest.mark.slow

LOOK = Look(noise=2.0)
TRUE_N = np.array([*SHEAR_N, -NORMAL_N])
LENS = {"focal_px": 640.0}


@pytest.fixture(scope="module")
def rest() -> Frame:
    return frame(0.0, LOOK)


@pytest.fixture(scope="module")
def sensor(rest: Frame, tmp_path_factory: pytest.TempPathFactory) -> ImportedSensor:
    """Written and read again, as the commands do."""
    folder = tmp_path_factory.mktemp("sensor")
    made = imported(rest.image, folder, lens=LENS)
    write_bundle(folder / "bundle", made.bundle)
    write_calibration(made.calibration, folder / "calibration.json")
    return replace(
        made,
        bundle=load_bundle(folder / "bundle"),
        calibration=read_calibration(folder / "calibration.json"),
    )


@pytest.fixture(scope="module")
def pipeline(sensor: ImportedSensor) -> ForcePipeline:
    """The gel of the push is linear."""
    linear = PipelineSettings(gel="linear")
    return open_sensor(sensor.bundle, calibration=sensor.calibration, settings=linear)


def pushed(share: float, seed: int) -> Frame:
    return frame(share, Look(noise=2.0, seed=seed))


def test_what_is_written_is_read_again(sensor: ImportedSensor, rest: Frame, tmp_path: Path) -> None:
    made = imported(rest.image, tmp_path, lens=LENS)
    assert sensor.bundle.imported is not None
    assert made.bundle.imported is not None
    assert sensor.bundle.imported.to_record() == made.bundle.imported.to_record()
    assert sensor.bundle.geometry_hash == made.bundle.geometry_hash
    read, fresh = sensor.calibration.grid.frame, made.calibration.grid.frame
    assert read is not None
    assert fresh is not None
    assert read.to_record() == fresh.to_record()
    np.testing.assert_array_equal(sensor.calibration.rest_mm, made.calibration.rest_mm)


def test_the_motion_of_the_markers_is_that_of_the_gel(sensor: ImportedSensor, rest: Frame) -> None:
    """Tangential motion: what the picture shows of a motion in the plane."""
    tangential = open_sensor(sensor.bundle, calibration=sensor.calibration, indenter="none")
    grid = sensor_grid()
    true = press().markers_mm.copy()
    true[:, 2] = 0.0
    from camera_rig import off_centre_view
    from synthetic import render

    result = tangential.process(
        render(grid, off_centre_view(), Look(noise=2.0, seed=7), true).image
    )
    assert result.marker_displacement_mm is not None
    markers = tangential.calibration.reference.markers
    places = sensor.calibration.grid.positions_mm[markers]
    near = np.argmin(np.linalg.norm(places[:, None] - grid.positions_mm[None], axis=2), axis=1)
    off = result.marker_displacement_mm[:, :2] - true[near, :2]
    size = np.hypot(*true[:, :2].T).max()
    assert size > 0.1
    assert np.sqrt(np.nanmean(off**2)) < 0.003
    assert np.nanmax(np.abs(off)) < 0.1 * size


def test_forces_are_those_of_the_push_within_what_is_stated(pipeline: ForcePipeline) -> None:
    """The gel is given exactly, so that camera, markers and noise alone make the deviation."""
    z = []
    for k, share in enumerate((0.4, 0.6, 0.8, 1.0)):
        result = pipeline.process(pushed(share, 20 + k).image)
        assert result.normal_known
        assert result.wrench is not None
        off = result.wrench.force_n - share * TRUE_N
        assert np.abs(off[:2]).max() < 0.1 * share
        assert abs(off[2]) < 0.15 * share
        z.append(off / result.wrench.standard_deviation[:3])
    assert np.abs(z).max() < 3
    assert np.sqrt(np.mean(np.square(z))) < 1.8


def test_rest_is_no_force(pipeline: ForcePipeline) -> None:
    result = pipeline.process(pushed(0.0, 5).image)
    assert result.wrench is not None
    force = result.wrench.force_n
    assert np.abs(force).max() < 3 * result.wrench.standard_deviation[:3].max()
    assert np.abs(force).max() < 0.03


def test_forces_are_those_of_the_generated_sensor(sensor: ImportedSensor, rest: Frame) -> None:
    """Tangential forces of both pipelines on the same pictures."""
    own = open_sensor(sensor_bundle(), reference=rest.image, indenter="none")
    other = open_sensor(sensor.bundle, calibration=sensor.calibration, indenter="none")
    for k, share in enumerate((0.4, 1.0)):
        picture = pushed(share, 40 + k).image
        first, second = own.process(picture).wrench, other.process(picture).wrench
        assert first is not None
        assert second is not None
        np.testing.assert_allclose(second.force_n[:2], first.force_n[:2], atol=0.01 * share)
        sigma = np.array([w.standard_deviation[:2] for w in (first, second)])
        np.testing.assert_allclose(sigma[1], sigma[0], rtol=0.6, atol=0.004)
        assert np.isnan(second.force_n[2])
