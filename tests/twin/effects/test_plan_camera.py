"""The optical effects one by one: their bounds hold on the bundle's own camera."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scene_samples import MINIMAL, ROOT, load

from gelslim_cad.dimensions import derive
from gelslim_cad.geometry.optics import camera_record
from gelslim_cad.spec.reader import read_spec
from gelslim_optics.camera.virtual_camera import VirtualCamera
from gelslim_twin.effects.dot_positions import LENS_DISTORTION, REFRACTION
from gelslim_twin.planning.question import plan_scene, question
from gelslim_twin.planning.sensor_figures import figures
from gelslim_twin.render.look import plan_camera, plan_look, refracting

LENS = {"k1": -0.12, "k2": 0.03, "p1": 0.001, "p2": -0.002, "k3": 0.0}
WIDE = {"model": "kannala_brandt", "k1": -0.04, "k2": 0.02, "k3": 0.01, "k4": -0.003}


@cache
def built(name):
    return camera_record(derive(read_spec(ROOT / "designs" / f"{name}.yaml").spec))


@pytest.fixture(params=["gelslim2", "mini20", "wide"])
def record(request):
    return dict(built(request.param))


def sensor(record, side=20.0):
    return figures(
        record, size_mm=(side, side, 2.0), material=(0.147, 0.3223), surface_nodes=1849,
        layers=4, markers=575, marker_pitch_mm=1.0, marker_diameter_mm=0.5,
    )  # fmt: skip


def gel_points(depth=0.5, side=20.0):
    x, y = np.meshgrid(np.linspace(-side / 2, side / 2, 21), np.linspace(-side / 2, side / 2, 21))
    random = np.random.default_rng(2)
    z = -depth * random.random(x.size)
    return np.column_stack([x.ravel(), y.ravel(), z])


TEXT = MINIMAL.replace("observe: [force]", "observe: [image]")


def asked(tmp_path, record, more=""):
    return question(load(tmp_path, TEXT + more), sensor(record)).circumstances


def plan_of(tmp_path, record, **use):
    effects = "".join(f"  {name}: {word}\n" for name, word in use.items())
    text = TEXT + "tolerance: {image_px: 0.02}\n" + (f"effects:\n{effects}" if use else "")
    return plan_scene(load(tmp_path, text), sensor(record))


@pytest.mark.parametrize("lens", [LENS, WIDE])
def test_with_everything_kept_the_camera_is_the_bundles(tmp_path, record, lens):
    record["lens_distortion"] = lens
    plan = plan_of(tmp_path, record)
    camera = plan_camera(plan, record)
    points = gel_points()
    expected = VirtualCamera.from_record(record).project(points)
    assert camera.project(points).tobytes() == expected.tobytes()


def test_leaving_refraction_out_errs_by_no_more_than_its_bound(tmp_path, record):
    points = gel_points()
    true = VirtualCamera.from_record(record).project(points)
    straight = plan_camera(plan_of(tmp_path, record, refraction="off"), record).project(points)
    worst = np.linalg.norm(straight - true, axis=1).max()
    bound = REFRACTION.bound(asked(tmp_path, record)).markers_px
    assert 1.0 < worst <= bound
    assert bound < 4 * worst, "a bound so loose decides nothing"


def test_apparent_depths_err_by_no_more_than_their_rung_says(tmp_path, record):
    points = gel_points()
    c = asked(tmp_path, record)
    rung = next(r for r in REFRACTION.ladder(c) if r.name == "apparent depth")
    full = plan_camera(plan_of(tmp_path, record), record)
    near = refracting(full, full.layers, **rung.parameters)
    worst = np.linalg.norm(near.project(points) - full.project(points), axis=1).max()
    assert worst <= rung.error.markers_px
    assert worst < 0.5 * REFRACTION.bound(c).markers_px


@pytest.mark.parametrize("lens", [LENS, WIDE])
def test_leaving_the_lens_out_errs_by_no_more_than_its_bound(tmp_path, record, lens):
    points = gel_points()
    ideal = VirtualCamera.from_record(record).project(points)
    record["lens_distortion"] = lens
    bound = LENS_DISTORTION.bound(asked(tmp_path, record)).markers_px
    worst = np.linalg.norm(VirtualCamera.from_record(record).project(points) - ideal, axis=1).max()
    assert 0 < worst <= bound < 4 * worst


def test_layers_of_index_one_are_no_refraction_bit_for_bit(tmp_path, record):
    record["layers"] = [{**layer, "index": 1.0} for layer in record["layers"]]
    assert REFRACTION.is_null(asked(tmp_path, record))
    points = gel_points()
    off = plan_camera(plan_of(tmp_path, record, refraction="off"), record).project(points)
    on = plan_camera(plan_of(tmp_path, record, refraction="on"), record)
    assert on.project(points).tobytes() == off.tobytes()


def test_figures_agree_with_the_generators_own(record):
    spec = read_spec(ROOT / "designs" / "gelslim2.yaml").spec
    d = derive(spec)
    found = sensor(dict(camera_record(d)), side=28.0)
    assert found.near_mm == pytest.approx(d["view.near_tangential_mm"], rel=5e-3)
    assert found.far_mm == pytest.approx(d["view.far_sagittal_mm"], rel=5e-3)


def test_the_look_carries_the_scenes_parameters(tmp_path, record):
    effects = """effects:
  marker_print: {jitter_mm: 0.03, missing_percent: 2}
  sensor_noise: {full_well_electrons: 2550, read_noise_electrons: 20}
  motion_blur: {use: on, shutter_ms: 10}
  specular: {spots: 3, brightness_percent: 50}
  exposure: {gain: 2}
  compression: on
  dirt: {use: off, specks: 9}
"""
    loaded = load(tmp_path, TEXT + effects)
    plan = plan_scene(loaded, sensor(record))
    look = plan_look(plan, loaded.scene.effects.parameters(), record, 5)
    assert (look.marker_print.jitter_mm, look.marker_print.missing_percent) == (0.03, 2)
    assert look.marker_print.seed == look.sensor_noise.seed == 5
    assert look.sensor_noise.electrons_per_dn == pytest.approx(10)
    assert look.sensor_noise.read_dn == pytest.approx(2)
    assert look.motion_blur.shutter_ms == 10
    assert look.specular.brightness_percent == 50
    assert look.exposure.gain == 2
    assert look.defocus.aperture_mm == record["aperture_mm"]
    assert look.compression.quality is None
    assert look.dirt is None
    assert look.shading.pixel_step == dict(plan.choice("shading").rung_parameters)["pixel_step"]
