"""Samples of a data set against independent sums, cameras and sensors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pyarrow.parquet as pq
import pytest
from data_set_rig import job_in, written
from scipy.spatial.transform import Rotation

from gelslim_core.yaml.errors import InputError
from gelslim_optics.camera.virtual_camera import VirtualCamera
from gelslim_twin.datasets.built_sensors import built_sensors, moved_camera, thickness_mm
from gelslim_twin.datasets.making import SampleMaker
from gelslim_twin.datasets.prepare import require_something_drawn
from gelslim_twin.scene.reader import read_scene
from gelslim_twin.simulation.scene_mechanics import mechanics_of, pad_compliance
from gelslim_twin.simulation.sensor import TwinSensor, stored_sensor
from ifem_export.bundle.files import load_bundle

DRAWN = {
    "tool", "sensor", "x_mm", "tilt_x_deg", "depth_factor", "friction", "youngs_modulus_mpa",
    "poissons_ratio", "thickness_mm", "camera_along_mm", "camera_turn_deg", "light_gain_0",
    "light_gain_1", "exposure_gain", "marker_print_jitter_mm", "seed",
}  # fmt: skip


def rows(folder: Path) -> list[dict[str, Any]]:
    return pq.read_table(folder / "index.parquet").to_pylist()


def test_everything_drawn_is_in_the_table_and_nothing_is_twice(data_set: Path) -> None:
    table = rows(data_set)
    assert len(table) == 8
    assert set(table[0]) >= DRAWN
    assert len({row["id"] for row in table}) == len({row["seed"] for row in table}) == 8
    assert all("." not in row["id"] for row in table)
    for name in ("x_mm", "tilt_x_deg", "friction", "youngs_modulus_mpa", "light_gain_0"):
        assert len({row[name] for row in table}) == 8, name
    assert {row["sensor"] for row in table} == {0, 1}
    assert len({(row["sensor"], row["poissons_ratio"], row["thickness_mm"]) for row in table}) == 2
    assert all(row["tool_x_mm"] == pytest.approx(row["x_mm"] + 0.1) for row in table)
    assert all(row["tool_tilt_x_deg"] == row["tilt_x_deg"] for row in table)


def test_labels_are_those_of_the_fields(data_set: Path) -> None:
    """Sums over the arrays, written out."""
    for row in rows(data_set):
        shard = data_set / row["file"]
        at = {n: np.load(shard.parent / f"{n}.npy")[row["row"]].astype(float)
              for n in ("force_n", "displacement_mm", "contact", "markers_px")}  # fmt: skip
        points = np.load(data_set / "sensors" / f"sensor_{row['sensor']:02d}.npz")["points_mm"]
        force, touched = at["force_n"], at["contact"] > 0
        for k, name in enumerate(("fx_n", "fy_n", "fz_n")):
            assert row[name] == pytest.approx(force[:, k].sum(), abs=1e-5)
        x, y = points[:, 0], points[:, 1]
        assert row["tz_nmm"] == pytest.approx((x * force[:, 1] - y * force[:, 0]).sum(), abs=1e-4)
        assert row["contact_nodes"] == touched.sum()
        assert row["sticking_nodes"] == (at["contact"] == 1).sum()
        moved = points + at["displacement_mm"]
        centre = (force[touched, 2] @ moved[touched, 0]) / force[touched, 2].sum()
        assert row["contact_x_mm"] == pytest.approx(centre, abs=1e-4)
        assert row["indentation_mm"] == pytest.approx(-at["displacement_mm"][:, 2].min(), abs=1e-6)
        expected = "partial" if 0 < row["slipping_nodes"] < touched.sum() else (
            "slip" if row["slipping_nodes"] else "stick")  # fmt: skip
        assert row["slip_state"] == expected
        image = cv2.imread(str(shard))
        assert image.shape == (120, 160, 3)
        assert image.std() > 5


def test_forces_are_those_of_a_gel_with_the_modulus_drawn(place: Path, data_set: Path) -> None:
    """The sensor is built again with its modulus, ratio and thickness, and solved anew."""
    job = job_in(place / "scene.yaml", "out")
    row = next(r for r in rows(data_set) if r["youngs_modulus_mpa"] > 0.16)
    design = load_bundle(place / "bundle")
    gel = replace(
        design.material,
        youngs_modulus_mpa=row["youngs_modulus_mpa"],
        poissons_ratio=row["poissons_ratio"],
    )
    stiffer = design.with_gel(gel, row["thickness_mm"] / thickness_mm(design))
    loaded = job.loaded.with_drawn(job.drawn(row["sample"]))
    states = mechanics_of(loaded, job.plan, pad_compliance(TwinSensor(stiffer)))
    *_, last = states.states(loaded.poses)
    assert last.force_n[:, 2].sum() == pytest.approx(row["fz_n"], rel=2e-3)
    assert last.force_n[:, 0].sum() == pytest.approx(row["fx_n"], rel=1e-2, abs=1e-4)


def test_a_moved_camera_sees_what_a_turned_scene_shows() -> None:
    """Turning the camera about its axis turns the picture about the principal point."""
    from render_rig import finger_camera

    record = finger_camera().to_record()
    before = VirtualCamera.from_record(record)
    after = VirtualCamera.from_record(moved_camera(record, {"turn_deg": 2.0}, 0.0))
    points = np.random.default_rng(3).uniform(-5, 5, (20, 3)) * [1, 1, 0]
    middle = np.array(before.principal_px)
    seen, turned = before.project(points) - middle, after.project(points) - middle
    angle = Rotation.from_euler("z", 2.0, degrees=True).as_matrix()[:2, :2]
    # The picture of a left-handed camera turns one way or the other, but by that angle.
    error = min(np.abs(turned - seen @ turn).max() for turn in (angle, angle.T))
    assert error < 1e-6
    shifted = VirtualCamera.from_record(moved_camera(record, {"along_mm": 0.3}, 0.0))
    np.testing.assert_allclose(
        shifted.project(points + np.array([0.3, 0.0, 0.0])), before.project(points), atol=1e-6
    )
    # A thicker gel is one more layer of gel in front of the same window and camera.
    thick = moved_camera(record, {}, 0.5)
    assert thick["position_mm"][2] == pytest.approx(record["position_mm"][2] - 0.5)  # type: ignore[index]
    total = sum(layer["thickness_mm"] for layer in thick["layers"])
    assert thick["window_bottom_z_mm"] + total == pytest.approx(0.0, abs=1e-9)


def test_a_sample_does_not_depend_on_those_before_it(place: Path) -> None:
    job = job_in(place / "scene.yaml", "never", frames="all")
    one = SampleMaker(job).sample(5)
    maker = SampleMaker(job)
    for number in (2, 7):
        maker.sample(number)
    two = maker.sample(5)
    assert one.draws == two.draws
    assert [f.number for f in one.frames] == [0, 1, 2, 3, 4]
    for first, second in zip(one.frames, two.frames, strict=True):
        assert repr(first.labels) == repr(second.labels)
        np.testing.assert_array_equal(first.image, second.image)
        for name, array in first.arrays.items():
            np.testing.assert_array_equal(array, second.arrays[name])
    every = SampleMaker(job_in(place / "scene.yaml", "never", frames="every:2")).sample(5)
    assert [f.number for f in every.frames] == [0, 2, 4]
    np.testing.assert_array_equal(every.frames[2].image, one.frames[4].image)


def test_light_gain_is_that_of_each_lamp(tmp_path: Path) -> None:
    """Without response curve, noise and ink, the picture is a sum over the lamps."""
    wanted = ("effects: {nonlinearity: off}",
              "effects: {nonlinearity: off, sensor_noise: off}")  # fmt: skip
    job = job_in(written(tmp_path, wanted), "never")
    maker = SampleMaker(job)
    sample = maker.sample(0)
    gains = [sample.draws[f"light_gain_{k}"] for k in (0, 1)]
    sensor = maker.prepared(int(sample.draws["sensor"]))
    loaded = job.loaded.with_drawn(job.drawn(0))
    plain = sensor.base(loaded).adjusted(loaded.scene).renderer
    lit = sensor.base(loaded).adjusted(loaded.scene, tuple(map(float, gains))).renderer
    one = plain.frame().image.astype(float)
    two = lit.frame().image.astype(float)
    bright = (one > 40) & (one < 200) & (two < 250)
    for channel, gain in ((0, gains[0]), (1, gains[1])):
        at = bright[..., channel]
        # Red light is from one side and green from the other; each lamp has a channel of its own.
        assert np.median(two[..., channel][at] / one[..., channel][at]) == pytest.approx(
            gain, rel=0.02
        )


def test_a_scene_that_draws_nothing_is_refused_with_the_remedy(tmp_path: Path) -> None:
    text = written(tmp_path).read_text()
    (tmp_path / "still.yaml").write_text(text[: text.index("vary:")] + "seed: 1\n")
    loaded = read_scene(tmp_path / "still.yaml")
    require_something_drawn(loaded, 1)
    with pytest.raises(InputError) as caught:
        require_something_drawn(loaded, 2)
    assert "vary" in caught.value.problems[0].remedy


def test_built_sensors_keep_to_the_tolerance(place: Path) -> None:
    bundle = replace(
        load_bundle(place / "bundle"),
        tolerances={"youngs_modulus_mpa": 0.01, "poissons_ratio": 0.01, "thickness_mm": 0.05},
    )
    scene = read_scene(place / "scene.yaml").scene
    gel = scene.vary.gel.model_copy(
        update={"within_tolerance": True, "poissons_ratio": None, "thickness_factor": None}
    )
    vary = scene.vary.model_copy(update={"sensors": 64, "gel": gel})
    found = built_sensors(scene.model_copy(update={"vary": vary}), bundle)
    ratio = np.array([one.poissons_ratio for one in found]) - bundle.material.poissons_ratio
    thick = (np.array([one.thickness_factor for one in found]) - 1) * thickness_mm(bundle)
    for values, sigma in ((ratio, 0.01), (thick, 0.05)):
        assert np.abs(values).max() <= 2 * sigma
        # Cut off at two standard deviations, 0.88 of one is left.
        assert values.std() == pytest.approx(0.88 * sigma, rel=0.3)


def test_what_the_effects_miss_is_told(place: Path) -> None:
    """On 32 samples, against the bounds of each of them."""
    tight = written(place, ("force_n: 0.2", "force_n: 0.01"), "tight.yaml")
    found = job_in(tight, "never").over_tolerance["force"]
    assert "nonlinearity" in found["effects"]
    assert found["largest"] >= found["median"] > found["tolerance"] == 0.01
    assert 16 < found["samples_over"] <= found["samples_judged"] == 32
    loose = written(place, ("force_n: 0.2, image_px: 0.5", "force_n: 20, image_px: 20"), "l.yaml")
    assert job_in(loose, "never").over_tolerance == {}


def test_the_stored_sensor_is_the_design(place: Path, data_set: Path) -> None:
    stored = stored_sensor(place / ".sensor").bundle
    assert stored.material == load_bundle(place / "bundle").material
