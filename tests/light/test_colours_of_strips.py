"""Strips of other colours and white ones: index, photons, camera, boards, documents, pictures."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gelslim
from gelslim_cad.assembly.finger_order import finger_order
from gelslim_cad.build.instructions import build_guide
from gelslim_cad.checks import check
from gelslim_cad.dimensions import Dimensions, derive
from gelslim_cad.electronics.finger import finger_boards
from gelslim_cad.electronics.order import circuit_record
from gelslim_cad.geometry.led_strips import camera_responses, strip_wavelengths_nm
from gelslim_cad.light.figures import paths_png
from gelslim_cad.light.scene import light_inputs, media
from gelslim_cad.light.study import LightStudy, study_light, study_record
from gelslim_cad.sensor import make_bundle, marker_grid, pad_light, pad_mesh
from gelslim_cad.solids.camera import camera
from gelslim_cad.solids.guide import led_boards
from gelslim_cad.spec import Spec
from gelslim_optics.light.scene import PMMA_SELLMEIER

MINI20 = Path(__file__).parents[2] / "designs" / "mini20.yaml"
RAYS = 1 << 13


@cache
def finger(light: str, picture: str = "colour", model: str = "LUXEON CZ") -> tuple[Spec, Any]:
    content = gelslim.read_spec(MINI20).spec.model_dump()
    content["camera"]["picture"] = picture
    leds = {"model": model, "light": light, "package_mm": 2.0, "height_mm": 0.7}
    content["design"]["leds"] |= leds
    content["mesh"] |= {"cells_along": 14, "cells_across": 14, "layers": 2}
    spec = Spec.model_validate(content)
    return spec, derive(spec)


def dimensions(light: str, **given: str) -> Dimensions:
    found: Dimensions = finger(light, **given)[1]
    return found


@cache
def study(light: str) -> LightStudy:
    return study_light(dimensions(light), rays=RAYS, curve=False)


def quarters(profile: np.ndarray) -> np.ndarray:
    """Means of four bands over the mean: single bins are noisy."""
    return np.array([band.mean() for band in np.array_split(profile, 4)]) / profile.mean()


def sellmeier(nm: float) -> float:
    b, c = PMMA_SELLMEIER
    return math.sqrt(1 + b * (nm / 1e3) ** 2 / ((nm / 1e3) ** 2 - c))


@pytest.mark.parametrize(
    ("light", "strips"),
    [
        ("red_green", {"red": 625.0, "green": 525.0}),
        ("red_blue", {"red": 625.0, "blue": 470.0}),
        ("green_blue", {"green": 525.0, "blue": 470.0}),
        ("white", {"left": 560.0, "right": 560.0}),
    ],
)
def test_each_strip_is_refracted_by_the_index_of_its_wavelength(
    light: str, strips: dict[str, float]
) -> None:
    d = dimensions(light)
    assert strip_wavelengths_nm(d) == strips
    acrylic = media(d)["acrylic"]
    for name, wave in strips.items():
        shift = acrylic.index_for(name) - d["material.acrylic.refractive_index"]
        assert shift == pytest.approx(sellmeier(wave) - sellmeier(590.0), abs=1e-12)


def test_a_bluer_strip_is_bent_more_and_needs_more_light_per_photon() -> None:
    """Two fingers that differ in the colour of the right strip alone."""
    green, blue = study("red_green"), study("red_blue")
    assert media(dimensions("red_blue"))["acrylic"].index_for("blue") > media(
        dimensions("red_green")
    )["acrylic"].index_for("green")
    # Same rays: what arrives differs by the dispersion of PMMA alone, about half a per cent.
    ratio = blue.light.arrived("blue").value / green.light.arrived("green").value
    assert ratio == pytest.approx(1, abs=0.02)
    assert ratio != 1
    # An exposure counts photons, E λ / (h c): for one irradiance it grows as 1/λ.
    first, second = green.exposures[1], blue.exposures[1]
    photons = first.exposure_ms * first.irradiance_uw_mm2 * 525
    assert second.exposure_ms * second.irradiance_uw_mm2 * 470 == pytest.approx(photons)


def test_white_light_comes_alike_from_both_sides() -> None:
    light = study("white").light
    assert light.colours == ("left", "right")
    left, right = light.arrived("left"), light.arrived("right")
    assert abs(left.value - right.value) < 4 * math.hypot(left.standard_error, right.standard_error)
    across = quarters(light.irradiance("left").mean(axis=0))
    mirrored = quarters(light.irradiance("right").mean(axis=0)[::-1])
    assert across == pytest.approx(mirrored, abs=0.12)
    assert across.max() > 1.3 * across.min()  # a mirrored map is told from the map itself
    assert set(study_record(study("white"))["guides"]["curved"]["by_colour"]) == {"left", "right"}


def test_the_camera_sees_white_as_grey_and_blue_in_its_blue_channel() -> None:
    shares, colour = camera_responses(dimensions("white"))
    assert np.all(colour == 1)
    assert np.all(shares == 1)
    _, colour = camera_responses(dimensions("red_blue"))
    assert colour.argmax(axis=1).tolist() == [0, 2]
    assert camera_responses(dimensions("green_blue"))[1].argmax(axis=1).tolist() == [1, 2]
    assert np.all(camera_responses(dimensions("red_blue", picture="mono"))[1] == 1)
    content = dimensions("red_green")
    near_blue = {**content.given, "design.leds.one_wavelength_nm": 460.0}
    assert camera_responses(near_blue)[1].argmax(axis=1).tolist() == [2, 2]


def test_the_twin_draws_white_light_grey_and_two_colours_coloured() -> None:
    from gelslim_force.calibration.design import bundle_camera
    from gelslim_twin.render.look import sensor_look
    from gelslim_twin.simulation.picture import sensor_renderer
    from gelslim_twin.simulation.sensor import TwinSensor

    def means(light: str) -> np.ndarray:
        spec, d = finger(light)
        grid = marker_grid(d)
        twin = TwinSensor(make_bundle(spec, d, pad_mesh(d, grid)[0], grid))
        look = sensor_look(aperture_mm=0.0, focus_mm=1.0, seed=3)
        picture = sensor_renderer(twin, bundle_camera(twin.bundle), look, 3).frame().image
        height, width, _ = picture.shape
        middle = picture[height // 4 : -height // 4, width // 4 : -width // 4]
        return np.array(
            [middle[:, : middle.shape[1] // 3].mean((0, 1)), middle.mean((0, 1))], dtype=float
        )

    white, purple = means("white")[1], means("red_blue")
    assert np.ptp(white) < 0.02 * white.mean()
    assert purple[1][1] < 0.5 * min(purple[1][0], purple[1][2])
    # Red comes from the left: there it is stronger, against blue, than in the whole.
    assert purple[0][0] / purple[0][2] > 1.1 * purple[1][0] / purple[1][2]


def test_the_light_of_a_bundle_has_the_two_directions_of_the_strips() -> None:
    found = pad_light(dimensions("red_blue"))
    assert found.irradiance.shape[-1] == 2
    assert found.azimuth_deg.tolist() == [90.0, -90.0]


def test_boards_follow_the_light() -> None:
    (both,) = finger_boards(dimensions("white")).boards
    assert (both.board.name, both.board.quantity, both.sides) == ("led_board", 2, ("left", "right"))
    assert both.circuit.led.variant.part == "L1CU-4070000000000"
    record = circuit_record(finger_boards(dimensions("red_blue")))
    assert {b["name"] for b in record["boards"]} == {"led_board_red", "led_board_blue"}
    red, blue = finger_boards(dimensions("red_blue")).boards
    assert blue.circuit.led.variant.wavelength_nm == 470
    assert blue.circuit.forward_v > red.circuit.forward_v


def test_a_type_without_that_colour_is_refused_by_the_rule_on_leds() -> None:
    d = dimensions("red_blue", model="Kingbright 0805")
    assert check(d).of("electronics.led").status != "pass"
    assert not finger_boards(d).boards
    assert check(dimensions("red_blue")).of("electronics.led").status == "pass"


@pytest.mark.parametrize(
    ("light", "picture", "status"),
    [
        ("red_green", "colour", "pass"),
        ("red_blue", "colour", "pass"),
        ("green_blue", "colour", "pass"),
        ("white", "colour", "warn"),
        ("white", "mono", "pass"),
        ("red_blue", "mono", "warn"),
    ],
)
def test_the_rule_on_colours_warns_where_they_do_not_suit(
    light: str, picture: str, status: str
) -> None:
    assert check(dimensions(light, picture=picture)).of("led.colours_nm").status == status


def test_documents_and_pictures_name_the_colours() -> None:
    def guide(light: str) -> str:
        d = dimensions(light)
        names = [p.name for p in (*led_boards(d), camera(d))]
        steps = finger_order(d, ["body", "back_cover", *names])
        return build_guide(d, marker_grid(d), (), "finger", steps).decode()

    assert "red light comes from -y (left), blue from +y (right)" in guide("red_blue")
    assert "Left red, right blue." in guide("red_blue")
    assert "white light comes from -y" in guide("white")
    assert "green" not in guide("white")
    assert paths_png(light_inputs(dimensions("red_blue"))).startswith(b"\x89PNG")
