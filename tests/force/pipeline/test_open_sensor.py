"""A sensor opened in one line: the same numbers as the long way, and clear refusals."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
import pytest
from sensor_samples import frame, sensor_bundle, stream
from shaded_frames import pressed_heights, shaded

import gelslim_force
from gelslim_core.errors import GelslimError
from gelslim_force.calibration.calibration import calibrate
from gelslim_force.calibration.file import write_calibration
from gelslim_force.contact.indenter import Sphere
from gelslim_force.forces.frame_result import FrameResult
from gelslim_force.frames.frame import Frame
from gelslim_force.pipeline import ForcePipeline
from gelslim_force.sensor import SensorError, indenter_source, open_sensor
from gelslim_force.settings import PipelineSettings
from ifem_export.bundle.files import write_bundle


@pytest.fixture(scope="module")
def reference() -> np.ndarray:
    return frame(0.0).image


@pytest.fixture(scope="module")
def place(tmp_path_factory, reference):
    """Bundle, reference picture and calibration as files."""
    folder = tmp_path_factory.mktemp("sensor")
    write_bundle(folder / "bundle", sensor_bundle())
    np.save(folder / "reference.npy", reference)
    write_calibration(calibrate(sensor_bundle(), reference), folder / "calibration.json")
    return folder


def same(one: FrameResult, other: FrameResult) -> bool:
    return bool(
        one.wrench.vector.tobytes() == other.wrench.vector.tobytes()
        and one.wrench.covariance.tobytes() == other.wrench.covariance.tobytes()
        and one.field.force_n.tobytes() == other.field.force_n.tobytes()
    )


def test_files_give_the_same_numbers_as_the_long_way(place, reference) -> None:
    long = ForcePipeline(sensor_bundle(), calibrate(sensor_bundle(), reference))
    by_reference = open_sensor(place / "bundle", reference=str(place / "reference.npy"))
    by_calibration = open_sensor(str(place / "bundle"), calibration=place / "calibration.json")
    for seen in stream(4):
        expected = long.process(seen.image)
        assert expected.wrench is not None
        assert same(by_reference.process(seen.image), expected)
        assert same(by_calibration.process(seen.image), expected)


def test_objects_and_settings_are_taken_as_they_are(reference) -> None:
    built = calibrate(sensor_bundle(), reference)
    settings = PipelineSettings(rung="fft", noise_px=0.1)
    opened = open_sensor(sensor_bundle(), calibration=built, settings=settings)
    assert opened.calibration is built
    assert opened.settings is settings
    assert opened.operator_name.startswith("fft")


@pytest.mark.slow
def test_an_indenter_makes_the_normal_force_known() -> None:
    still = shaded(seed=99).image
    pressed = shaded(pressed_heights((1.0, -1.0), 2.4, 10.0)[:2], seed=3).image
    built = calibrate(sensor_bundle(), still)
    normal = indenter_source(sensor_bundle(), built, still, Sphere(10.0))
    expected = ForcePipeline(sensor_bundle(), built, normal=normal).process(pressed)
    for arguments in (
        {"reference": still, "indenter": "sphere:10"},
        {"reference": still, "calibration": built, "indenter": Sphere(10.0)},
        {"reference": still, "normal": indenter_source(sensor_bundle(), built, still, Sphere(10))},
    ):
        found = open_sensor(sensor_bundle(), **arguments).process(pressed)
        assert found.extra["normal"] == expected.extra["normal"]
        assert same(found, expected)


def test_a_frame_of_a_source_is_processed_with_its_time(place, reference) -> None:
    sensor = open_sensor(place / "bundle", calibration=place / "calibration.json")
    plain = sensor.process(reference, time_s=1.5)
    sensor.reset()
    found = sensor.process(Frame(7, 1.5, reference))
    assert (found.index, found.time_s) == (0, 1.5)
    assert same(found, plain)
    assert sensor.process(Frame(8, 1.6, reference), time_s=2.0).time_s == 2.0
    torn = sensor.process(Frame(9, 1.7, None, "torn picture"))
    assert (torn.index, torn.time_s, torn.problems) == (2, 1.7, ("torn picture",))
    assert torn.wrench is None


def test_the_callers_stamp_takes_the_place_of_the_frames(place) -> None:
    """Torn frames, whose results have stamps as well; a stamp of another unit is refused."""
    sensor = open_sensor(place / "bundle", calibration=place / "calibration.json")
    torn = Frame(0, 0.0, None, "torn picture", stamp_s=1.8e9, sensor_s=31.5)
    own = sensor.process(torn)
    given = sensor.process(torn, stamp_s=1.7e9)
    assert [(r.time_s, r.stamp_s, r.sensor_s) for r in (own, given)] == [
        (0.0, 1.8e9, 31.5),
        (0.0, 1.7e9, 31.5),
    ]
    assert sensor.process(np.zeros((3, 3), np.uint8)).stamp_s is None
    assert sensor.unreadable("gone", stamp_s=1.8e9).stamp_s == 1.8e9
    for wrong in (1.8e18, -1.0, np.nan, "now", datetime.now(UTC)):
        with pytest.raises(ValueError, match="since 1970"):
            sensor.process(torn, stamp_s=wrong)  # type: ignore[arg-type]
    for wrong in (np.inf, np.nan, "3"):
        with pytest.raises(ValueError, match="time_s"):
            sensor.process(torn, time_s=wrong)  # type: ignore[arg-type]
    assert sensor.process(torn).index == 4


def test_the_documented_lines_run(place, reference) -> None:
    frames = np.stack([seen.image for seen in stream(3)])
    sensor = gelslim_force.open_sensor(place / "bundle", reference=reference)
    with gelslim_force.open_frames(frames) as source:
        wrenches = [sensor.process(each).wrench for each in source]
    assert len(wrenches) == 3
    assert isinstance(wrenches[-1], gelslim_force.Wrench)


@pytest.mark.slow
def test_another_normal_source_shares_what_was_prepared(place, reference) -> None:
    first = open_sensor(place / "bundle", reference=reference)
    first.process(stream(4)[2].image)
    other = first.with_normal(None)
    fresh = open_sensor(place / "bundle", reference=reference)
    seen = stream(4)[3].image
    assert same(other.process(seen), fresh.process(seen))
    assert (other.process(seen).index, first.process(seen).index) == (1, 1)


@pytest.mark.parametrize(
    ("arguments", "argument"),
    [
        ({}, "reference"),
        ({"reference": "r.png", "depth_mm": 0.5}, "depth_mm"),
        ({"reference": "r.png", "indenter": "sphere:10", "normal": object()}, "normal"),
    ],
)
def test_arguments_that_do_not_fit_are_named(arguments, argument) -> None:
    with pytest.raises(SensorError) as caught:
        open_sensor(sensor_bundle(), **arguments)
    assert caught.value.argument == argument


@pytest.mark.parametrize(
    "arguments",
    [
        {"reference": "missing.png"},
        {"calibration": "missing.json"},
        {"reference": "reference.npy", "indenter": "cube:3"},
        {"reference": "bundle/manifest.json"},
    ],
)
def test_files_that_cannot_be_used_are_refused(place, arguments) -> None:
    given = {k: v if k == "indenter" else place / v for k, v in arguments.items()}
    with pytest.raises(GelslimError):
        open_sensor(place / "bundle", **given)
    with pytest.raises(GelslimError):
        open_sensor(place / "missing", reference=place / "reference.npy")


def test_a_reference_of_another_size_is_refused(place, reference) -> None:
    with pytest.raises(GelslimError):
        open_sensor(place / "bundle", reference=reference[:240])
    with pytest.raises(GelslimError):
        open_sensor(place / "bundle", reference=reference[:, :, 0] * np.uint8(0))


def test_an_impossible_response_is_refused() -> None:
    with pytest.raises(ValueError, match="gamma = 0"):
        PipelineSettings(gamma=0.0)
