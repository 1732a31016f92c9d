"""A finger with a mono camera: its light, its documents, its pictures and what is made of them."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gelslim
from gelslim_cad.assembly.finger_order import finger_order
from gelslim_cad.assembly.order import Step
from gelslim_cad.build.bill import bill_of_materials
from gelslim_cad.build.instructions import build_guide
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.explore.brightness import light_columns, trace
from gelslim_cad.light.scene import light_inputs, media
from gelslim_cad.light.study import study_light, study_record
from gelslim_cad.sensor import make_bundle, marker_grid, pad_mesh
from gelslim_cad.solids.camera import camera
from gelslim_cad.solids.guide import led_boards
from gelslim_cad.spec import Spec
from gelslim_force.calibration.calibration import calibrate
from gelslim_force.sensor import SensorError, indenter_source, open_sensor
from gelslim_optics.light.scene import PMMA_SELLMEIER
from gelslim_twin.render.image_sensor import Compression
from gelslim_twin.render.look import sensor_look
from gelslim_twin.render.surface_state import SurfaceState
from gelslim_twin.simulation.picture import sensor_renderer
from gelslim_twin.simulation.sensor import TwinSensor
from gelslim_twin.validation.validate import chains_for
from ifem_export.bundle.bundle import Bundle

MINI20 = Path(__file__).parents[2] / "designs" / "mini20.yaml"
SHIFT_MM = np.array([0.25, -0.15, 0.0])


@cache
def finger(picture: str, wavelength_nm: float | None) -> tuple[Spec, Dimensions]:
    content = gelslim.read_spec(MINI20).spec.model_dump()
    content["camera"]["picture"] = picture
    content["design"]["leds"]["one_wavelength_nm"] = wavelength_nm
    content["mesh"] |= {"cells_along": 14, "cells_across": 14, "layers": 2}
    spec = Spec.model_validate(content)
    return spec, derive(spec)


@cache
def bundle(picture: str, wavelength_nm: float | None, with_light: bool = True) -> Bundle:
    spec, d = finger(picture, wavelength_nm)
    grid = marker_grid(d)
    return make_bundle(spec, d, pad_mesh(d, grid)[0], grid, with_light=with_light)


def frames(sensor: Bundle) -> tuple[Any, Any]:
    """Frames of the gel at rest, and moved as a whole by SHIFT_MM."""
    from gelslim_force.calibration.design import bundle_camera

    twin = TwinSensor(sensor)
    look = sensor_look(aperture_mm=0.0, focus_mm=1.0, seed=3)
    draw = sensor_renderer(twin, bundle_camera(sensor), look, 3)
    moved = np.broadcast_to(SHIFT_MM, twin.points_mm.shape)
    return draw.frame(), draw.frame(SurfaceState.from_nodes(twin.points_mm, moved), number=1)


def test_light_of_one_wavelength_is_that_of_its_index_and_its_photons() -> None:
    b, c = PMMA_SELLMEIER

    def sellmeier(nm: float) -> float:
        return math.sqrt(1 + b * (nm / 1e3) ** 2 / ((nm / 1e3) ** 2 - c))

    one, two = finger("mono", 625.0)[1], finger("mono", None)[1]
    acrylic = media(one)["acrylic"]
    index = acrylic.index_for("left")
    assert index == acrylic.index_for("right") == media(two)["acrylic"].index_for("red")
    assert index - 1.4906 == pytest.approx(sellmeier(625.0) - sellmeier(590.0))
    study = study_light(one, rays=1 << 12, curve=False)
    assert study.light.colours == ("left", "right")
    assert [e.colour for e in study.exposures] == ["left", "right"]
    assert set(study_record(study)["guides"]["curved"]["by_colour"]) == {"left", "right"}
    # The same rays and index as the red strip of two colours: the same light, the same photons.
    reds = study_light(two, rays=1 << 12, curve=False).exposures[0]
    assert study.exposures[0].exposure_ms == pytest.approx(reds.exposure_ms)
    values = light_inputs(one)
    found = light_columns(one, trace(values, 1 << 12))
    assert found["light.exposure_ms"] == pytest.approx(
        max(e.exposure_ms for e in study.exposures), rel=0.2
    )


def order(d: Dimensions) -> tuple[Step, ...]:
    names = [p.name for p in (*led_boards(d), camera(d))]
    return finger_order(d, ["body", "back_cover", *names])


def test_the_documents_name_one_wavelength() -> None:
    d, two = finger("mono", 850.0)[1], finger("colour", None)[1]
    parts = (*led_boards(d), camera(d))
    bom = bill_of_materials(parts, 1020.0)
    boards = [line for line in bom if line.name.startswith("led_board")]
    assert [line.name for line in boards] == ["led_board_left", "led_board_right"]
    assert all("850 nm" in line.material for line in boards)
    assert "mono" in bom[-1].material
    guide = build_guide(d, marker_grid(d), bom, "one", order(d)).decode()
    assert guide.count("850 nm") >= 3
    assert not {"red", "green"} & {word.strip(".,:;)(") for word in guide.split()}
    assert [p.name for p in led_boards(two)] == ["led_board_red", "led_board_green"]
    assert "850 nm" not in build_guide(two, marker_grid(two), bom[:0], "two", order(two)).decode()


@pytest.mark.parametrize(("wavelength_nm", "with_light"), [(525.0, True), (None, False)])
def test_pictures_are_grey_and_carry_the_motion(
    wavelength_nm: float | None, with_light: bool
) -> None:
    sensor = bundle("mono", wavelength_nm, with_light)
    assert sensor.camera["picture"] == "mono"
    assert TwinSensor(sensor).mono
    light = TwinSensor(sensor).light()
    assert np.ptp(light.colour, axis=1).max() == 0
    rest, moved = frames(sensor)
    shape = sensor.camera["image_height_px"], sensor.camera["image_width_px"]
    assert rest.image.shape == moved.image.shape == shape
    assert Compression(80).apply(rest.image).shape == shape
    assert 40 < rest.image.mean() < 220
    pipeline = open_sensor(sensor, reference=rest.image, indenter="none")
    result = pipeline.process(moved.image)
    found = np.nanmedian(result.marker_displacement_mm[:, :2], axis=0)
    assert found == pytest.approx(SHIFT_MM[:2], abs=0.01)


def test_a_colour_camera_is_as_before() -> None:
    sensor = bundle("colour", None)
    rest, _ = frames(sensor)
    assert rest.image.ndim == 3
    # Red light from the left, green from the right.
    half = rest.image.shape[1] // 2
    red, green = (rest.image[..., k].astype(float) for k in (0, 1))
    assert red[:, :half].mean() > red[:, half:].mean()
    assert green[:, half:].mean() > green[:, :half].mean()
    assert not TwinSensor(sensor).mono
    one = TwinSensor(bundle("colour", 640.0)).light()
    assert np.array_equal(one.colour[0], one.colour[1])
    assert one.colour[0].argmax() == 0


def test_what_needs_colour_is_refused_and_left_out() -> None:
    sensor = bundle("mono", 525.0)
    rest, _ = frames(sensor)
    with pytest.raises(SensorError) as caught:
        open_sensor(sensor, reference=rest.image, indenter="sphere:10")
    assert caught.value.argument == "indenter"
    built = calibrate(sensor, rest.image)
    with pytest.raises(SensorError):
        indenter_source(sensor, built, rest.image, "sphere:10")
    colour = {c.name for c in chains_for(bundle("colour", None))}
    mono = {c.name for c in chains_for(sensor)}
    assert mono < colour
    assert not any(c.knows in ("shape", "cap") for c in chains_for(sensor))
