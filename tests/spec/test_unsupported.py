"""What people ask for and what is not supported is told plainly; slips are still corrected."""

from __future__ import annotations

import pytest

from gelslim_cad.spec import Spec
from gelslim_core.yaml.errors import InputError, Problem
from gelslim_core.yaml.reader import load_bytes

HEAD = """\
format: gelslim-spec/1
name: finger
camera: {image_width_px: 640, image_height_px: 480, sensor_width_mm: 3.6288,
         sensor_height_mm: 2.7216, focal_length_mm: 3.6, f_number: 2.9}
design:
  gel: {length_mm: 24, width_mm: 22}
"""
ASKED = {
    "straight onto": (
        "  mirror: none\n",
        "  mirror: false\n",
        "  mirror: {kind: none}\n",
        "  layout: straight_down\n",
        "  optics: {layout: direct}\n",
    ),
    "a gel that is no pad": (
        ("length_mm: 24", "length_mm: 24, shape: dome"),
        ("length_mm: 24", "length_mm: 24, dome_radius_mm: 12"),
        ("length_mm: 24", "length_mm: 24, form: hemisphere"),
    ),
    "a fourth strip, or several colours in one strip": (
        "  leds: {third_wavelength_nm: 470}\n",
        "  leds: {fourth_wavelength_nm: 590}\n",
        "  leds: {rear: blue}\n",
        "  leds: {ring: white}\n",
        "  leds: {left: rgb}\n",
        "  leds: {light: four_colours}\n",
        "  leds: {light: rgb}\n",
        "  leds: {light: red_green_blue}\n",
        "  leds: {colours: [red, green, blue]}\n",
        "  leds: {sides: 3}\n",
    ),
    "ultraviolet": ("  leds: {uv_wavelength_nm: 385}\n", "  leds: {light: uv}\n"),
    "infrared light under this name": (
        "  leds: {infrared_wavelength_nm: 850}\n",
        "  leds: {ir_wavelength_nm: 850}\n",
        "  leds: {light: infrared}\n",
    ),
    "any marker pattern": (
        "  markers: {pattern: random}\n",
        "  markers: random\n",
        "  markers: {layout: hexagonal}\n",
    ),
    "another camera": (("name: finger\n", "name: finger\ncameras: 2\n"),),
}
CASES = [(what, change) for what, changes in ASKED.items() for change in changes]
SLIPS = [
    (("length_mm: 24", "lenght_mm: 24"), "design.gel.length_mm"),
    ("  housing: {tip_wal_mm: 2}\n", "design.housing.tip_wall_mm"),
    ("  light_guide: {end_suport_mm: 2}\n", "design.light_guide.end_support_mm"),
    ("  leds: {max_cuont: 3}\n", "design.leds.max_count"),
    ("  leds: {blue_wave_length_nm: 465}\n", "design.leds.blue_wavelength_nm"),
    ("  leds: {light: whit}\n", "white"),
    ("  leds: {tip: bleu}\n", "blue"),
    ("  leds: {tipp: blue}\n", "design.leds.tip"),
    ("  markers: {pattern: nome}\n", "none"),
    ("  mirror: {thicknes_mm: 1}\n", "design.mirror.thickness_mm"),
]


def problems(change: str | tuple[str, str]) -> tuple[Problem, ...]:
    text = HEAD + change if isinstance(change, str) else HEAD.replace(*change)
    with pytest.raises(InputError) as caught:
        load_bytes("finger.yaml", text.encode(), Spec)
    return caught.value.problems


@pytest.mark.parametrize(("what", "change"), CASES)
def test_what_is_not_supported_is_said_and_nothing_is_guessed(
    what: str, change: str | tuple[str, str]
) -> None:
    told = [p for p in problems(change) if "is not supported" in p.message]
    (problem,) = told
    assert problem.message.startswith(what) or what in problem.message
    assert "did you mean" not in str(problem)
    assert problem.line is not None
    assert bool(problem.remedy) == what.startswith(("infrared", "a fourth"))


@pytest.mark.parametrize(("change", "meant"), SLIPS)
def test_a_slip_is_still_corrected(change: str | tuple[str, str], meant: str) -> None:
    told = problems(change)
    assert any(meant in p.remedy for p in told), told
    assert not any("not supported" in p.message for p in told)


def test_what_is_supported_is_read() -> None:
    text = HEAD + "  markers: none\n  leds: {light: white}\n"
    spec = load_bytes("finger.yaml", text.encode(), Spec).model
    assert (spec.design.markers.pattern, spec.design.leds.light) == ("none", "white")


@pytest.mark.parametrize(
    "change",
    [
        "  leds: {tip: red}\n",
        "  leds: {tip: white}\n",
        "  leds: {light: red_blue, tip: blue}\n",
        "  leds: {light: white, tip: blue}\n",
        "  leds: {one_wavelength_nm: 630, tip: blue}\n",
        "  leds: {tip: blue}\n",
    ],
)
def test_a_light_at_the_tip_that_the_sides_or_the_camera_do_not_suit_is_refused(
    change: str,
) -> None:
    mono = change == "  leds: {tip: blue}\n"
    head = HEAD.replace("f_number: 2.9", "f_number: 2.9, picture: mono") if mono else HEAD
    with pytest.raises(InputError) as caught:
        load_bytes("finger.yaml", (head + change).encode(), Spec)
    (problem,) = caught.value.problems
    assert (problem.field, problem.line) == ("design.leds.tip", 7)
    assert problem.remedy


@pytest.mark.parametrize(
    ("light", "tip", "picture"),
    [
        ("red_green", "blue", "colour"),
        ("red_blue", "green", "colour"),
        ("green_blue", "red", "colour"),
        ("white", "white", "colour"),
        ("white", "white", "mono"),
    ],
)
def test_three_colours_and_white_light_from_three_sides_are_read(
    light: str, tip: str, picture: str
) -> None:
    head = HEAD.replace("f_number: 2.9", f"f_number: 2.9, picture: {picture}")
    text = head + f"  leds: {{light: {light}, tip: {tip}}}\n"
    leds = load_bytes("finger.yaml", text.encode(), Spec).model.design.leds
    assert (leds.light, leds.tip) == (light, tip)
